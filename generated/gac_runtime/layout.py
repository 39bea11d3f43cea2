"""What the last axis of an array holds."""

from __future__ import annotations

from typing import NamedTuple


class Layout(NamedTuple):
    """Which coefficients the last axis of an array holds.

    Attributes
    ----------
    name : str
        As the algebra calls it.
    blades : tuple of str
        The stored coefficients, in order.
    fixed : tuple of (str, str)
        Coefficients that are the same for every element, and their value; ``implied`` where it follows from the others.
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
"""A number."""


def layout(name: str, blades: str, fixed: str = "", implied: str = "", unit: bool = False) -> Layout:
    """A layout as generated modules write it.

    Parameters
    ----------
    name, unit
        As in `Layout`.
    blades : str
        Names of the stored coefficients, with spaces between them.
    fixed, implied : str
        ``e123 = 1, e0 = 1/2``; the names in `implied` are among the fixed ones of the layout, with the value
        ``implied``.
    """
    formulas = _pairs(implied)
    values = (*_pairs(fixed), *((blade, "implied") for blade, _ in formulas))
    return Layout(name, tuple(blades.split()), values, unit, formulas)


def _pairs(text: str) -> tuple[tuple[str, str], ...]:
    pairs = (item.partition(" = ") for item in text.split(", ") if item)
    return tuple((blade, value) for blade, _, value in pairs)
