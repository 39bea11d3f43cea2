"""What elements with numbers have in common, and those whose coefficients are in an array.

The extension stores the coefficients of all other elements, and gives them Python's operators.
"""

from __future__ import annotations

import itertools
import math
import operator
import sys
from collections.abc import Callable, Iterator
from functools import cache, partial
from numbers import Number
from typing import TYPE_CHECKING, Any, NoReturn, Self

import numpy as np

from . import layout as layouts
from .layout import Layout, number

if TYPE_CHECKING:
    from .annotations import Array

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


def adopt(cls: Any, layout: Layout, operate: Any, coefficients: Any) -> None:
    """Make a class a type of single elements of a layout, with their coefficients as attributes.

    Parameters
    ----------
    cls : type
        A subclass of the extension's type of values, or of the class that replaces it.
    operate, coefficients : callable
        Apply operators that the extension does not know, and convert arguments of the type that it does not read.
    """
    # The attributes of the class keep interned names alive, of which the extension has the addresses.
    names = tuple(sys.intern(field_of(blade)) for blade in layout.blades)
    fixed = [(_key(blade), abs(number(text))) for blade, text in layout.fixed if text != "implied"]
    is_plain = not layout.implied and "1" not in dict(layout.fixed)
    hashed = (tuple(map(_key, layout.blades)), tuple(row for row in fixed if row[1])) if is_plain else None
    cls._adopt(next_index(), names, operate, coefficients, layout.identity, layout.unit, hashed)
    for blade, text in layout.fixed:
        if text != "implied":
            setattr(cls, field_of(blade), number(text))


def _number(k: int, x: ArrayElement) -> float:
    return float(x.values[k])


@cache
def _key(blade: str) -> str:
    """Return a text that is the same for all spellings of a blade, as ``e31`` and ``e1^e3``."""
    return "".join(sorted({*blade} - {"^"}))


def _is_number(x: Any) -> bool:
    """Whether this is a number or an array of numbers."""
    return isinstance(x, Number) or (isinstance(x, np.ndarray) and x.dtype.kind in "biufc")


def _terms(x: Any) -> dict[str, Any]:
    """Return all coefficients of elements, or a number, by blade."""
    if _is_number(x):
        return {"1": x}
    values, layout = x.stored
    if layout.is_scalar:
        return {"1": values[..., 0]}
    return layouts.named(values.tolist(), layout) if values.ndim == 1 else layouts.coefficients(values, layout)


class Element:
    """Base class of elements with numbers: a single one, with shape ``()``, or an array of any shape.

    Lengths, indices and arrays of numpy mean elements; coefficients are in `values`, and in ``x["e12"]``. Subclasses
    define `values`, `stored`, and two methods: `_part` and `_coefficient`.
    """

    __slots__ = ()
    layout: Any
    values: Any

    @property
    def stored(self) -> tuple[Array, Layout]:
        """The coefficients and their layout, which kernels check."""
        raise NotImplementedError

    def _part(self, values: np.ndarray[Any, Any]) -> Any:
        """Return elements of the same layout."""
        raise NotImplementedError

    def _coefficient(self, name: str) -> Any:
        """Return the coefficient of a blade."""
        raise NotImplementedError

    def _is_of_algebra(self, other: Any) -> bool:
        """Whether other elements belong to the same algebra, as numbers do."""
        one, two = self.stored[1], other.stored[1]
        return one.algebra == two.algebra or bool(one.is_scalar or two.is_scalar)

    def _equals(self, other: Any) -> Any:
        """Whether elements of any layouts are equal, for each; a number is equal to an element with no other part."""
        pair = self, other
        elements = [x for x in pair if not _is_number(x)]
        if not all(hasattr(type(x), "stored") for x in elements):
            return NotImplemented
        same: Any = self._is_of_algebra(elements[-1])
        one, two = map(_terms, pair) if same else ({}, {})
        algebra = next((x.algebra for x in elements if hasattr(x, "algebra") and not x.stored[1].is_scalar), None)
        if algebra is not None and not (one.keys() <= two.keys() or two.keys() <= one.keys()):
            # The spellings of their blades may differ, as e31 and e13.
            one, two = ({algebra.blade(name)[1]: algebra.blade(name)[0] * x for name, x in each.items()}
                        for each in (one, two))  # fmt: skip
        for blade in {**one, **two}:
            same = same & (one.get(blade, 0.0) == two.get(blade, 0.0))
        shapes = [shape for x in pair if (shape := getattr(x, "shape", ()))]
        return np.array(np.broadcast_to(same, np.broadcast_shapes(*shapes))) if shapes else bool(same)

    def _hash(self) -> int:
        """Return the hash of a single element, which depends neither on its layout nor on how its blades are spelled.

        A scalar has the hash of the number. The extension computes the same for layouts without implied coefficients.
        """
        terms = {blade: x for blade, x in _terms(self).items() if x == x and x != 0}  # the hash of a NaN is an address
        if terms.keys() <= {"1"}:
            return hash(terms.get("1", 0.0))
        return hash(frozenset([(_key(blade), abs(x)) for blade, x in terms.items()]))  # spellings differ in signs

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape without the axis of blades."""
        found: tuple[int, ...] = self.values.shape[:-1]
        return found

    @property
    def ndim(self) -> int:
        """Number of axes without the axis of blades."""
        return len(self.shape)

    @property
    def size(self) -> int:
        """Number of elements."""
        return math.prod(self.shape)

    @property
    def dtype(self) -> np.dtype[np.object_]:
        """That of `numpy.asarray`, an array of elements; libraries such as xarray need it of arrays that they hold."""
        return np.dtype(object)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray[Any, Any]:
        """Return the coefficients for a type of numbers, ``np.asarray(x, float)``; otherwise an array of elements.

        numpy converts each element of a list by the same call as a single one. With elements as entries, functions of
        lists, such as ``np.sum([a, b])`` and ``rng.permutation(points)``, keep the meaning of the coefficients.
        """
        if dtype is not None and np.dtype(dtype) != np.dtype(object):
            return np.array(self.values, dtype, copy=copy)
        if copy is False:
            raise ValueError(
                f"np.asarray: arrays of elements are copies; the numbers of {self.stored[1].name} are in .values"
            )
        found = np.empty(self.shape, object)
        for index in np.ndindex(self.shape):
            found[index] = self[index] if index else self
        return found

    def __float__(self) -> float:
        name = self.stored[1].name
        raise TypeError(f"{name}: an element is not a number; its coefficients are in .values, that of 1 is x['1']")

    __int__: Callable[..., Any] = __float__
    __complex__: Callable[..., Any] = __float__

    def __len__(self) -> int:
        if not self.shape:
            raise TypeError(f"a single {self.stored[1].name} has no length; its coefficients are in .values")
        return self.shape[0]

    def __bool__(self) -> bool:
        raise TypeError("the truth value of a multivector is undefined; compare coefficients, or use isclose()")

    def __iter__(self) -> Iterator[Any]:
        if not self.shape:
            raise TypeError(f"a single {self.stored[1].name} is not iterable; its coefficients are in .values")
        return map(self._part, self.values)

    def __getitem__(self, index: Any) -> Any:
        """Return a coefficient by the name of its blade, ``x["e31"]``, or elements by the axes of `shape`."""
        if isinstance(index, str):
            return self._coefficient(index)
        values = self.values
        if values.ndim == 1:
            layout = self.stored[1]
            raise TypeError(f'a single {layout.name} has no axes; index it by a blade, x["{layout.blades[0]}"]')
        indices = index if isinstance(index, tuple) else (index,)
        last = slice(None) if any(each is Ellipsis for each in indices) else Ellipsis
        return self._part(values[(*indices, last)])


class ArrayElement:
    """Immutable elements that the extension does not store: arrays, other precisions, and all elements without it.

    Subclasses define `_operate`, which applies a Python operator to operands that include an element, and `stored`.

    Attributes
    ----------
    layout : Layout
        The layout, of the runtime or of the compiler.
    values : numpy.ndarray
        The stored coefficients along the last axis. Read-only.
    """

    __slots__ = ("layout", "values")
    layout: Any
    values: np.ndarray[Any, Any]
    _operate: Callable[..., Any]

    def __new__(cls, layout: Any, values: np.ndarray[Any, Any]) -> Self:
        made = object.__new__(cls)
        object.__setattr__(made, "layout", layout)
        if values.flags.writeable:  # the array of the caller can still be written
            values = values.view()
            values.flags.writeable = False
        object.__setattr__(made, "values", values)
        return made

    @classmethod
    def _adopt(cls, index: int, names: tuple[str, ...], operate: Any, coefficients: Any, *_layout: Any) -> None:
        """Become a type of single elements of one layout, whose objects are created by their coefficients."""

        def new(cls: Any, *arguments: Any) -> Any:
            array = coefficients(cls, arguments)
            array.flags.writeable = False
            made = object.__new__(cls)
            object.__setattr__(made, "values", array.view())  # a view of such an array can never be written
            return made

        cls.__new__, cls._operate = staticmethod(new), staticmethod(operate)  # type: ignore[assignment]
        for k, name in enumerate(names):
            setattr(cls, name, property(partial(_number, k)))

    def _numbers(self) -> list[float]:
        numbers: list[float] = self.values.tolist()
        return numbers

    def __setattr__(self, name: str, value: Any = None) -> NoReturn:
        raise AttributeError(f"{type(self).__name__} is immutable; cannot set or delete {name}")

    __delattr__: Any = __setattr__

    def __eq__(self, other: object) -> Any:
        """Whether elements are equal, each of an array, whatever their layouts."""
        pair: Any = self, other
        if hasattr(type(other), "stored"):
            (values, own), (others, wanted) = (each.stored for each in pair)
            if own is wanted or own.identity == wanted.identity:
                same: Any = np.all(values == others, axis=-1)
                return same if same.ndim else bool(same)
        return pair[0]._equals(other)

    def __ne__(self, other: object) -> Any:
        found = self.__eq__(other)
        return found if found is NotImplemented else np.logical_not(found) if np.ndim(found) else not found

    def __hash__(self) -> int:
        if self.values.ndim != 1:
            raise TypeError("an array of multivectors is not hashable")
        single: Any = self
        found: int = single._hash()
        return found

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
