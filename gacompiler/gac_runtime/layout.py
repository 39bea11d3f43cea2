"""Layouts, which describe the last axis of arrays, and conversions between them.

Only conversions import numpy: the compiler describes layouts in browsers, where numpy takes long to load.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from typing import Any, NamedTuple


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
    related : bool
        Whether other relations are assumed.
    """

    name: str
    blades: tuple[str, ...]
    fixed: tuple[tuple[str, str], ...] = ()
    unit: bool = False
    implied: tuple[tuple[str, str], ...] = ()
    related: bool = False

    @property
    def algebra(self) -> str:
        """The name of the algebra."""
        return self.name.rpartition(".")[0]

    @property
    def identity(self) -> str:
        """A text that is the same for all layouts with the same coefficients, in all packages and processes.

        Relations other than ``x ~x = 1`` are functions, which are only known by the name of their layout. The text is
        interned: one object in all copies of this file in a process, so that the extension compares addresses.
        """
        formulas = dict(self.implied)
        others = [f"; {blade} = {formulas.get(blade, value)}" for blade, value in self.fixed]
        others += [f"; relations of {self.name}"] * self.related
        return sys.intern(f"{self.algebra}: {' '.join(self.blades)}{''.join(others)}")

    @property
    def is_scalar(self) -> bool:
        """Whether its elements are numbers."""
        return self.name == "SCALAR" and not self.blades

    @property
    def has_meaning(self) -> bool:
        """Whether it assumes relations between its coefficients."""
        return self.unit or self.related


SCALAR = Layout("SCALAR", ())
"""The layout of numbers, which have no axis of coefficients."""


def layout(
    name: str, blades: str, fixed: str = "", implied: str = "", unit: bool = False, related: bool = False
) -> Layout:
    """Create a layout from the notation of generated modules.

    Parameters
    ----------
    name, unit, related
        As in `Layout`.
    blades : str
        Names of the stored coefficients, separated by spaces.
    fixed, implied : str
        ``e123 = 1, e0 = 1/2``; the names in `implied` are also listed as fixed coefficients of the layout, with the
        value ``implied``.
    """
    formulas = _pairs(implied)
    values = (*_pairs(fixed), *((blade, "implied") for blade, _ in formulas))
    return Layout(name, tuple(blades.split()), values, unit, formulas, related)


def _pairs(text: str) -> tuple[tuple[str, str], ...]:
    pairs = (item.partition(" = ") for item in text.split(", ") if item)
    return tuple((blade, value) for blade, _, value in pairs)


def converted(where: str, values: Any, own: Layout, wanted: Layout) -> Any:
    """Return the coefficients of elements in another layout.

    Parameters
    ----------
    where : str
        The argument, for messages.
    values : array (..., k)
        The stored coefficients in the layout `own`.

    Raises
    ------
    TypeError
        If the algebras differ, or the other layout cannot represent the elements exactly: it does not store a
        coefficient that is not zero, or one of its fixed coefficients has another value. Implied coefficients may
        differ by rounding errors.
    """
    import numpy as np

    if own.identity == wanted.identity:
        return values
    expected = f"{wanted.name or 'numbers'} ({' '.join(wanted.blades)})"
    if own.algebra != wanted.algebra:
        raise TypeError(f"{where} is {own.name}; expected {expected}; transfer coefficients by their names")
    found = coefficients(values, own)
    zero = np.zeros(values.shape[:-1], values.dtype)
    stored = {blade: found.get(blade, zero) for blade in wanted.blades}
    goal = coefficients(np.stack([*stored.values()], -1), wanted)
    size = np.max(np.abs(values), axis=-1, initial=1.0)
    rounding = {blade: 8 * np.finfo(values.dtype).eps * size**2 for blade, _ in wanted.implied}
    for blade in {**found, **goal}:
        off = np.abs(found.get(blade, zero) - goal.get(blade, zero)) > rounding.get(blade, 0.0)
        if np.any(off):
            number = np.broadcast_to(found.get(blade, zero), off.shape)[off][0]
            raise TypeError(f"{where} is {own.name} with {blade} = {number:.6g}; expected {expected}")
    return np.stack([*stored.values()], -1)


UNIT = 1e-9
"""How far ``x ~x`` of unit elements may be from 1, relative to the square of the largest coefficient above 1.

Products of unit elements drift by about one rounding error each: a million of them stay within it."""


SINGLE = 1 / (1 << 17)
"""The same in single precision, 64 rounding errors: the relations of up to 16 rounded terms have larger ones."""


def check_unit(where: str, name: str, off: Any, values: Any) -> None:
    """Raise TypeError if ``off = x ~x - 1`` of elements with these coefficients is not 0 within `UNIT`."""
    import numpy as np

    worst = np.abs(np.asarray(off)).max(initial=0.0)
    array = np.asarray(values)
    largest, single = float(np.abs(array).max(initial=1.0)), array.dtype in (np.float32, np.complex64)
    if not worst <= (SINGLE if single else UNIT) * largest * largest:
        raise TypeError(f"{where} is {name} with x ~x = 1 up to {worst:.3g}; expected unit elements; normalize them")


def coefficients(values: Any, layout: Layout) -> dict[str, Any]:
    """Return all coefficients by blade, including those that are fixed or implied, as arrays."""
    import numpy as np

    columns = [values[..., k] for k in range(len(layout.blades))]
    return named(columns, layout, lambda x: np.full(values.shape[:-1], x, values.dtype))


def named(columns: Any, layout: Layout, constant: Callable[[float], Any] = float) -> dict[str, Any]:
    """Return the same from arrays or numbers, those of each blade; `constant` converts fixed coefficients."""
    found = dict(zip(layout.blades, columns, strict=True))
    for blade, text in layout.fixed:
        if text != "implied":
            found[blade] = constant(number(text))
    for blade, text in layout.implied:
        products = (product.split("*") for product in text.split(" + "))
        found[blade] = sum(math.prod((found[name] for name in names), start=number(one)) for one, *names in products)
    return found


def number(text: str) -> float:
    """Return the value of a fraction such as ``-1/2``."""
    top, _, bottom = text.partition("/")
    return int(top) / int(bottom or 1)
