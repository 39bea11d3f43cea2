"""Elements of the layouts of a module as immutable objects, with the operators for which the module has kernels.

Single elements, arrays of them and their operators are in one file because each creates objects of the others.
"""

from __future__ import annotations

import operator
import sys
import warnings
from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar

import numpy as np

from .array_element import OPERATORS, ArrayElement, Element, adopt, field_of
from .arrays import FLOAT64, plain
from .documentation import layout_text
from .extension import extension
from .kernel import Kernel
from .layout import Layout, check_unit, coefficients, converted, number

_NUMBERS = (int, float, np.integer, np.floating)
"""Types of the numbers by which values can be multiplied."""


class Family:
    """The value types of one module and their operators.

    Attributes
    ----------
    operators : dict
        Maps an operator's symbol and the types of its operands to the kernel, the type of the result, and whether the
        kernel takes the operands in reverse order.
    sums : list of type
        The types of sums and multiples, those with fewer coefficients first. Their coefficients are unconstrained.
    types : dict
        The types by their layouts: coefficients, and whether elements are of unit norm.
    """

    def __init__(self) -> None:
        self.operators: dict[tuple[str, tuple[type, ...]], tuple[Kernel, Any, bool]] = {}
        self.sums: list[Any] = []
        self.types: dict[tuple[Any, bool], Any] = {}

    def alike(self, types: tuple[Any, ...]) -> tuple[Any, ...]:
        """Return types with those of other modules replaced by the types of this one with the same layouts."""
        return tuple(
            self.types.get((kind.layout.identity, kind.layout.unit), kind)
            if issubclass(kind, Value) and kind.family is not self
            else kind
            for kind in types
        )


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
            cls, index: int, names: tuple[str, ...], operate: Any, coefficients: Any, layout: Any, *is_unit: bool
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

    @property
    def module(self) -> str:
        """The name of the module."""
        raise NotImplementedError

    @property
    def stored(self) -> tuple[np.ndarray[Any, Any], Layout]:
        """The coefficients and their layout, which kernels check."""
        return self.values, self.layout

    def like(self, layout: Layout, values: np.ndarray[Any, Any]) -> Any:
        """Return elements of a layout that belong to the same module."""
        return value_of(self.module, layout, values)

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
        found = _square(self)
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
        adopt(cls, cls.layout, _operate, _coefficients)

    @property
    def module(self) -> str:
        """The name of the module."""
        return self.__module__

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
    kind: Any

    def __new__(cls, kind: Any, values: np.ndarray[Any, Any]) -> Self:
        made = ArrayElement.__new__(cls, kind.layout, values)
        object.__setattr__(made, "kind", kind)
        return made

    family = property(operator.attrgetter("kind.family"))
    module = property(operator.attrgetter("kind.__module__"))

    @staticmethod
    def _operate(symbol: str, *operands: Any) -> Any:
        return _operate(symbol, *operands)

    def _part(self, values: np.ndarray[Any, Any]) -> Any:
        return _made(self.kind, values)

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


def _made(kind: Any, values: np.ndarray[Any, Any]) -> Any:
    return kind(values) if values.ndim == 1 and values.dtype == FLOAT64 else Values(kind, values)


def _kind(x: Any) -> Any:
    return x.kind if isinstance(x, Values) else type(x)


def _warn(what: str, instead: str, category: type[Warning] = DeprecationWarning) -> None:
    message = f"{what} of an element will mean elements, not coefficients, from version 0.4 on; use {instead}"
    warnings.warn(message, category, stacklevel=3)


def value_of(module: str, layout: Layout, values: np.ndarray[Any, Any]) -> Any:
    """Return values of a module from coefficients; their type is created if the module names none of the layout."""
    types = families.setdefault(module, Family()).types
    found = types.get((layout.identity, layout.unit))
    if found is None:
        word = "".join(part.capitalize() for part in layout.name.rpartition(".")[2].split("_"))
        name = word if word.isidentifier() else "Multivector"
        found = type(name, (Value,), {"__slots__": (), "__module__": module}, layout=layout)
    return _made(found, values)


def _square(x: OfModule) -> np.ndarray[Any, Any] | None:
    """Return ``x ~x - 1`` by operators of the module; None if it has none for a type that can hold the value."""
    for (symbol, types), (product, _, _) in x.family.operators.items():
        reverse = x.family.operators.get(("~", types[:1]))
        if symbol != "*" or types != 2 * types[:1] or reverse is None:
            continue
        kind: Any = types[0]
        wide: Layout = kind.layout
        if (
            wide.unit
            or wide.algebra != x.layout.algebra
            or not {*x.layout.blades, *dict(x.layout.fixed)} <= {*wide.blades}
        ):
            continue
        values = converted("", x.values, x.layout, wide)
        one = [blade == "1" for blade in product.layouts["out"].blades]
        return np.asarray(product(values, reverse[0](values)) - one)
    return None


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


def _operate(symbol: str, *operands: Any) -> Any:
    """Apply an operator by its kernel; return NotImplemented for foreign types, which may define the operator."""
    types = own = tuple(map(type, operands))
    modules = {operand.family: None for operand in operands if isinstance(operand, OfModule)}
    family = next(iter(modules))
    found = family.operators.get((symbol, types))
    if found is None and (len(modules) > 1 or Values in types):
        types = tuple(map(_kind, operands))
        found = next((row for each in modules if (row := each.operators.get((symbol, each.alike(types))))), None)
    if found is None:
        other = next((x for x in operands if not isinstance(x, OfModule) and hasattr(x, "stored")), None)
        if other is not None and (symbol, len(operands)) in OPERATORS:  # those of the other element have any operands
            return OPERATORS[symbol, len(operands)](
                *[other.like(x.layout, np.array(x.values)) if isinstance(x, OfModule) else x for x in operands]
            )
        combined = None if symbol == "()" else _sum_or_multiple(symbol, *operands)
        if combined is not None:
            return combined
        if all(isinstance(x, (OfModule, int, float, complex, np.ndarray, np.generic, list, tuple)) for x in operands):
            raise _unknown(family, symbol, types)
        if symbol == "()" or (len(types) == 2 and types[0].__name__ == types[1].__name__):
            raise _unknown(family, symbol, types)
        return NotImplemented
    kernel, result, swapped = found
    arrays = [operand.values for operand in operands]
    value = kernel(*(reversed(arrays) if swapped else arrays))
    if types != own:
        return value if result is float else _made(result, value)
    if extension is not None and kernel.element_address:
        extension.bind_operator(symbol, types, None if result is float else result, kernel.element_address, swapped)
    return result(value)


def _sum_or_multiple(symbol: str, a: Any, b: Any = None) -> Any:
    """Return a sum, a difference, a multiple or a negative, which need no kernel; None for all other operations."""
    if symbol == "*" and isinstance(a, _NUMBERS):
        a, b = b, a
    if symbol == "-" and b is None:
        if a.layout.unit and not a.layout.fixed:
            # The negative of a unit element is a unit element.
            return Values(a.kind, -a.values) if isinstance(a, Values) else type(a)(*[-x for x in a._numbers()])
        total = {blade: -x for blade, x in _terms(a).items()}
    elif symbol in "*/" and isinstance(a, OfModule) and isinstance(b, _NUMBERS):
        scale = operator.mul if symbol == "*" else operator.truediv
        total = {blade: scale(x, float(b)) for blade, x in _terms(a).items()}
    elif symbol in "+-" and all(isinstance(x, (OfModule, *_NUMBERS)) for x in (a, b)):
        join = operator.add if symbol == "+" else operator.sub
        own, other = _terms(a), _terms(b)
        total = {blade: join(own.get(blade, 0.0), other.get(blade, 0.0)) for blade in {**own, **other}}
    else:
        return None
    is_single = type(a) is not Values is not type(b)
    types = tuple([(type(x) if is_single else _kind(x)) for x in (a, b) if isinstance(x, OfModule)])
    # Equal fixed coefficients cancel in a difference: two points of weight 1 give a direction.
    result = _type_of_sum(types, frozenset(blade for blade, x in total.items() if (x if is_single else np.any(x))))
    if result is None:
        return None
    row = [total.get(blade, 0.0) for blade in result.layout.blades]
    return result(*row) if is_single else _made(result, np.stack(np.broadcast_arrays(*row), -1))


@cache
def _type_of_sum(types: tuple[Any, ...], nonzero: frozenset[str]) -> Any:
    """Return the type of a sum of values with these coefficients that are not 0; None if the module has none."""
    wanted = nonzero.union(*(kind.layout.blades for kind in types))
    sums = types[0].family.sums
    for result in (*(kind for kind in types if kind in sums), *sums):
        if wanted <= set(result.layout.blades) and all(kind.layout.algebra == result.layout.algebra for kind in types):
            return result
    return None


def _terms(x: Any) -> dict[str, Any]:
    """Return all coefficients of a value or a number by blade, including those that are not stored."""
    if not isinstance(x, OfModule):
        return {"1": float(x)}
    layout = x.layout
    if layout.implied or not isinstance(x, Value):
        return coefficients(x.values, layout)
    fixed = {blade: number(text) for blade, text in layout.fixed}
    return {**dict(zip(layout.blades, x._numbers(), strict=True)), **fixed}


def _unknown(family: Family, symbol: str, types: tuple[type, ...]) -> TypeError:
    """Return the error for an undefined operator, which lists the operators that are defined."""
    like = [
        f"{_expression(symbol, each)} ({kernel.name})"
        for (other, each), (kernel, _, _) in family.operators.items()
        if other == symbol and (symbol == "()" or len(each) == len(types))
    ]
    there = ", ".join(like)
    module = next(each.__module__ for each in types if issubclass(each, Value))
    found = _expression(symbol, types, len({each.__name__ for each in types}) < len(set(types)))
    return TypeError(f"{found}: not defined by {module}; expected one of: {there or 'none'}")


def _expression(symbol: str, types: tuple[type, ...], with_modules: bool = False) -> str:
    first, *others = (f"{each.__module__}.{each.__name__}" if with_modules else each.__name__ for each in types)
    if symbol == "()":
        return f"{first}({', '.join(others)})"
    return f"{first} {symbol} {others[0]}" if others else f"{symbol}{first}"
