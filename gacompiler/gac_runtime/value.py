"""Elements of the layouts of a module as immutable objects, with the operators for which the module has kernels."""

from __future__ import annotations

import operator
import sys
import warnings
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar

import numpy as np

from .array_element import ArrayElement, Element, adopt, field_of
from .arrays import FLOAT64, plain
from .documentation import layout_text
from .extension import extension
from .layout import Layout, check_unit, coefficients
from .operators import Family, operate, square_minus_one

families: dict[str, Family] = {}
"""The families by name of their module."""


Kind = TypeVar("Kind", covariant=True)
if TYPE_CHECKING:

    class _Value(Generic[Kind]):
        """What type checkers know of both base classes; the kind is the literal name of the layout."""

        def _numbers(self) -> list[float]: ...
        def __hash__(self) -> int: ...
        @classmethod
        def _adopt(
            cls, index: int, names: tuple[str, ...], operate: Any, coefficients: Any, layout: Any, *more: Any
        ) -> None: ...

else:
    # The base class stands for `_Value[Kind]`, since the class in C takes no parameters of types.
    _Value = {Kind: ArrayElement if extension is None else extension.Value}


class OfModule(Element):
    """What one element and an array of elements of a module have in common."""

    __slots__ = ()
    __array_ufunc__ = None
    layout: Layout
    family: Family
    kind: Any

    @property
    def module(self) -> str:
        """The name of the module."""
        return str(self.kind.__module__)

    @property
    def stored(self) -> tuple[np.ndarray[Any, Any], Layout]:
        """The coefficients and their layout, which kernels check."""
        return self.values, self.layout

    def like(self, layout: Layout, values: np.ndarray[Any, Any]) -> Any:
        """Return elements of a layout that belong to the same module."""
        return value_of(self.module, layout, values)

    def _part(self, values: np.ndarray[Any, Any]) -> Any:
        return self.kind.made(values)

    def _coefficient(self, name: str) -> Any:
        found = coefficients(self.values, self.layout)
        if name not in found:
            raise KeyError(f"{self.layout.name} has no coefficient {name!r}; expected one of {' '.join(found)}")
        return found[name]

    def require_unit(self, where: str) -> None:
        """Raise TypeError unless ``x ~x = 1``, where a kernel takes unit elements only.

        The product and the reverse are those of the first type of the module with both operators that can hold this
        value. If there is none, the norm cannot be tested, and values whose type does not guarantee it are refused.
        """
        found = square_minus_one(self)
        if found is None:
            raise TypeError(
                f"{where} is {self.layout.name}, whose norm {self.module} cannot compute; expected a type of unit "
                "elements"
            )
        check_unit(where, self.layout.name, found, self.values)


class Value(OfModule, _Value[Kind]):
    """One element of a layout, with the operators that the module's kernels define, and sums and multiples.

    Values are created from an array or from their coefficients, ``Point(1, 2, 3)``, and are immutable. `values` is a
    read-only array of the coefficients, without a copy; each is an attribute named after its blade, or `scalar`.

    The type of a sum has unconstrained coefficients: the sum of two motors is an even element, not a motor.
    """

    __slots__ = ()
    shape = ()
    kind: Any = property(type, doc="The type of single values.")
    if TYPE_CHECKING:

        @property
        def values(self) -> np.ndarray[Any, Any]:
            """The coefficients. Read-only."""

    elif extension is not None:
        values = property(np.frombuffer, doc="The coefficients. Read-only.")
    else:

        def __new__(cls, *_arguments: Any) -> Any:
            raise TypeError(f"{cls.__name__} has no layout and cannot be instantiated; use a type with a layout")

    def __init_subclass__(cls, layout: Layout | None = None) -> None:
        if layout is not None:
            cls.layout = layout
        (base, *_) = cls.__bases__
        if base is not Value:
            raise TypeError(f"{base.__name__} cannot be subclassed")
        # The extension stores coefficients where a dictionary or a field of another base would begin.
        if cls.__dictoffset__ or cls.__weakrefoffset__ or cls.__basicsize__ != Value.__basicsize__:
            raise TypeError(f"{cls.__name__} has fields of its own; expected __slots__ = () and no base with fields")
        cls.family = families.setdefault(cls.__module__, Family())
        cls.family.types.setdefault((cls.layout.identity, cls.layout.unit), cls)
        cls.__doc__ = cls.__doc__ or layout_text(*cls.layout[:4])
        adopt(cls, cls.layout, operate, _coefficients)

    @classmethod
    def made(cls, values: np.ndarray[Any, Any]) -> Any:
        """Return one element, or an array of elements, from their coefficients as a kernel returns them."""
        create: Any = cls if values.ndim == 1 and values.dtype == FLOAT64 else partial(Values, cls)
        return create(values)

    @classmethod
    def array(cls, values: Any) -> Values:
        """Return an array of elements from their coefficients along the last axis."""
        array, size = np.asarray(values), len(cls.layout.blades)
        array = np.array(array, None if array.dtype.kind == "f" else FLOAT64)
        if array.shape[-1:] != (size,):
            wanted = f"(..., {size}): {' '.join(cls.layout.blades)}"
            raise ValueError(f"{cls.__name__}: coefficients have shape {array.shape}; expected {wanted}")
        return Values(cls, array)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray[Any, Any]:
        if dtype is None:
            # Not hidden by default, because functions of lists, such as numpy.sum, mix coefficients without an error.
            _warn("numpy.asarray(x)", "numpy.asarray(x, float) or x.values", FutureWarning)
            dtype = FLOAT64
        return super().__array__(dtype, copy)

    def __len__(self) -> int:
        _warn("len(x)", "len(x.values)")
        return len(self.values)

    def __iter__(self) -> Iterator[float]:
        _warn("iteration over x", "x.values")
        return iter(self._numbers())

    def __getitem__(self, index: str) -> float:
        """Return a coefficient by the name of its blade, as spelled in the layout: ``x["e12"]``."""
        given: Any = index
        if isinstance(given, str):
            return float(self._coefficient(given))
        k = operator.index(given)
        _warn("x[k]", 'x.values[k] or x["e12"]')
        return self._numbers()[k]

    def __reduce__(self) -> tuple[Any, ...]:
        if getattr(sys.modules.get(self.__module__), type(self).__name__, None) is type(self):
            return type(self), tuple(self._numbers())
        return value_of, (self.module, self.layout, np.array(self.values))

    def __repr__(self) -> str:
        text = ""
        fixed = [(blade, getattr(self, field_of(blade))) for blade, value in self.layout.fixed if value != "implied"]
        for blade, x in (*zip(self.layout.blades, self._numbers(), strict=True), *fixed):
            if x:
                number = repr(abs(x)).removesuffix(".0")
                sign = ("-" if x < 0 else "") if not text else " - " if x < 0 else " + "
                text += sign + (number if blade == "1" else blade if number == "1" else f"{number}*{blade}")
        return f"{type(self).__name__}({text or '0'})"


class Values(OfModule, ArrayElement):
    """An array of elements of one type of a module, or a single one in another precision.

    Attributes
    ----------
    kind : type
        The type of single elements.
    """

    __slots__ = ("kind",)

    def __new__(cls, kind: Any, values: np.ndarray[Any, Any]) -> Self:
        made = ArrayElement.__new__(cls, kind.layout, values)
        object.__setattr__(made, "kind", kind)
        return made

    _operate = staticmethod(operate)
    family = property(operator.attrgetter("kind.family"))

    def __getattr__(self, name: str) -> Any:
        """Return the coefficients of a blade, ``x.e12``."""
        for blade in () if name.startswith("_") else (*self.layout.blades, *dict(self.layout.fixed)):
            if field_of(blade) == name:
                return self._coefficient(blade)
        raise AttributeError(f"{self.kind.__name__} has no coefficient {name!r}")

    def reshape(self, *shape: int | tuple[int, ...]) -> Any:
        """Return the same elements in another shape."""
        wanted = shape[0] if len(shape) == 1 and isinstance(shape[0], tuple) else shape
        return self._part(self.values.reshape((*wanted, self.values.shape[-1])))

    def __reduce__(self) -> tuple[Any, ...]:
        return value_of, (self.module, self.layout, np.array(self.values))

    def __repr__(self) -> str:
        return f"{self.kind.__name__} of shape {self.shape}:\n{self.values}"


def _warn(what: str, instead: str, category: type[Warning] = DeprecationWarning) -> None:
    message = f"{what} of an element will mean elements, not coefficients, from version 0.4 on; use {instead}"
    warnings.warn(message, category, stacklevel=3)


def value_of(module: str, layout: Layout, values: np.ndarray[Any, Any]) -> Any:
    """Return values of a module from coefficients; their type is created if the module names none of the layout."""
    types = families.setdefault(module, Family()).types
    found: Any = types.get((layout.identity, layout.unit))
    if found is None:
        word = "".join(part.capitalize() for part in layout.name.rpartition(".")[2].split("_"))
        name = word if word.isidentifier() else "Multivector"
        found = type(name, (Value,), {"__slots__": (), "__module__": module}, layout=layout)
    return found.made(values)


def _coefficients(cls: Any, arguments: tuple[Any, ...]) -> np.ndarray[Any, Any]:
    """Return a new array with the coefficients of a value."""
    name, size, wanted = cls.__name__, len(cls.layout.blades), " ".join(cls.layout.blades)
    if len(arguments) not in (1, size):
        raise TypeError(f"{name}: {len(arguments)} arguments; expected an array or {size} numbers: {wanted}")
    given = plain(name, arguments[0], cls.layout) if len(arguments) == 1 else arguments
    try:
        array = np.asarray(given if len(arguments) != 1 or size > 1 or np.ndim(given) else [given])
    except ValueError as error:
        raise ValueError(f"{name}: not an array of numbers ({error})") from None
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: coefficients have dtype {array.dtype}; expected real numbers")
    if array.shape != (size,):
        raise ValueError(f"{name}: coefficients have shape {array.shape}; expected ({size},): {wanted}")
    return np.array(array, FLOAT64)
