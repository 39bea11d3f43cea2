"""What the last axis of an array holds.

Copied into every generated module as it is, with the other ``runtime_`` files.
"""

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
