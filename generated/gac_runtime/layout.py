"""Layouts, which describe the last axis of arrays."""

from __future__ import annotations

from typing import NamedTuple


class Layout(NamedTuple):
    """The coefficients that are stored along the last axis of an array.

    Attributes
    ----------
    name : str
        The name of the layout in its algebra.
    blades : tuple of str
        The blades of the stored coefficients, in order.
    fixed : tuple of (str, str)
        Coefficients that are not stored, and their constant value; ``implied`` if it follows from the stored ones.
    unit : bool
        Whether ``x ~x = 1`` is assumed.
    implied : tuple of (str, str)
        Coefficients that follow from the stored ones, as sums of products, ``1/2*e1*e1 + 1/2*e2*e2``.
    """

    name: str
    blades: tuple[str, ...]
    fixed: tuple[tuple[str, str], ...] = ()
    unit: bool = False
    implied: tuple[tuple[str, str], ...] = ()


SCALAR = Layout("SCALAR", ())
"""The layout of numbers, which have no axis of coefficients."""


def layout(name: str, blades: str, fixed: str = "", implied: str = "", unit: bool = False) -> Layout:
    """Create a layout from the notation of generated modules.

    Parameters
    ----------
    name, unit
        As in `Layout`.
    blades : str
        Names of the stored coefficients, separated by spaces.
    fixed, implied : str
        ``e123 = 1, e0 = 1/2``; the names in `implied` are also listed as fixed coefficients of the layout, with the
        value ``implied``.
    """
    formulas = _pairs(implied)
    values = (*_pairs(fixed), *((blade, "implied") for blade, _ in formulas))
    return Layout(name, tuple(blades.split()), values, unit, formulas)


def _pairs(text: str) -> tuple[tuple[str, str], ...]:
    pairs = (item.partition(" = ") for item in text.split(", ") if item)
    return tuple((blade, value) for blade, _, value in pairs)
