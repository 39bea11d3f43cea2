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
        Coefficients that are the same for every element, and their value.
    unit : bool
        Whether ``x ~x = 1`` is assumed.
    """

    name: str
    blades: tuple[str, ...]
    fixed: tuple[tuple[str, str], ...] = ()
    unit: bool = False
