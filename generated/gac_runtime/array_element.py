"""Elements whose coefficients are in an array, and Python's operators, which the extension gives all other elements."""

from __future__ import annotations

import itertools
import operator
import sys
from collections.abc import Callable
from typing import Any, NoReturn

import numpy as np

from .layout import Layout, number

OPERATORS: dict[tuple[str, int], Callable[..., Any]] = {
    ("*", 2): operator.mul, ("^", 2): operator.xor, ("&", 2): operator.and_, ("|", 2): operator.or_,
    ("+", 2): operator.add, ("-", 2): operator.sub, ("/", 2): operator.truediv, (">>", 2): operator.rshift,
    ("()", 2): lambda a, b: a(b), ("~", 1): operator.invert, ("-", 1): operator.neg,
}  # fmt: skip
"""The functions of Python's operators, by symbol and number of operands; ``()`` is the call ``m(x)``."""


def _two(symbol: str) -> tuple[Callable[[Any, Any], Any], Callable[[Any, Any], Any]]:
    """Return a binary operator and its reflection."""

    def forward(a: Any, b: Any) -> Any:
        return a._operate(symbol, a, b)

    def backward(b: Any, a: Any) -> Any:
        return b._operate(symbol, a, b)

    return forward, backward


next_index = itertools.count().__next__
"""Numbers of the types of elements, by which operators are found."""


def field_of(blade: str) -> str:
    """Return the attribute name of a blade's coefficient."""
    return "scalar" if blade == "1" else blade.replace("^", "_")


def adopt(cls: Any, layout: Layout, operate: Any, coefficients: Any, is_entry: bool = False) -> None:
    """Make a class a type of single elements of a layout, with their coefficients as attributes.

    Parameters
    ----------
    cls : type
        A subclass of the extension's type of values, or of the class that replaces it.
    operate, coefficients : callable
        Apply operators that the extension does not know, and convert arguments of the type that it does not read.
    is_entry : bool
        Whether arrays of numpy hold the elements themselves; otherwise they hold the coefficients.
    """
    # The attributes of the class keep interned names alive, of which the extension has the addresses.
    names = tuple(sys.intern(field_of(blade)) for blade in layout.blades)
    cls._adopt(next_index(), names, operate, coefficients, layout.identity, layout.unit, is_entry)
    for blade, text in layout.fixed:
        if text != "implied":
            setattr(cls, field_of(blade), number(text))


class ArrayElement:
    """Base class of immutable elements that the extension does not store: arrays of elements, and all without it.

    Subclasses define `layout`, and `_operate`, which applies a Python operator to operands that include an element.

    Attributes
    ----------
    values : numpy.ndarray
        The stored coefficients along the last axis. Read-only.
    """

    __slots__ = ("values",)
    values: np.ndarray[Any, Any]
    _operate: Callable[..., Any]

    def _hold(self, values: np.ndarray[Any, Any]) -> None:
        """Set the coefficients; the array of the caller can still be written if it could."""
        if values.flags.writeable:
            values = values.view()
            values.flags.writeable = False
        object.__setattr__(self, "values", values)

    def __setattr__(self, name: str, value: Any = None) -> NoReturn:
        raise AttributeError(f"{type(self).__name__} is immutable; cannot set or delete {name}")

    __delattr__: Any = __setattr__

    def __hash__(self) -> int:
        if self.values.ndim != 1:
            raise TypeError("an array of multivectors is not hashable")
        # The hash of a NaN depends on the identity of its object.
        return hash(tuple(x if x == x else 0.0 for x in self.values.tolist()))

    def __call__(self, *operands: Any) -> Any:
        return self._operate("()", self, *operands)

    def __invert__(self) -> Any:
        return self._operate("~", self)

    def __neg__(self) -> Any:
        return self._operate("-", self)

    __mul__, __rmul__ = _two("*")
    __xor__, __rxor__ = _two("^")
    __and__, __rand__ = _two("&")
    __or__, __ror__ = _two("|")
    __add__, __radd__ = _two("+")
    __sub__, __rsub__ = _two("-")
    __truediv__, __rtruediv__ = _two("/")
    __rshift__, __rrshift__ = _two(">>")
