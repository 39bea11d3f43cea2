"""Calls of operations with numeric multivectors: their operands, and the compiled functions for types of operands.

Operators of single multivectors of doubles are bound to their types, so that the extension calls compiled functions
without this file. It runs the first call for each pair of types, and all calls with arrays.
"""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from ..algebra.layout import SCALAR, SCALARS, Layout
from ..algebra.multivector import Multivector
from ..algebra.operations import Kind, Operation
from ..algebra.versors import n_vectors
from ..errors import OperandError, ZeroDivisorError
from ..frontend.expression import Expression
from ..frontend.operands import own_operations
from ..gac_runtime.array_element import OPERATORS, next_index
from .arrays import (
    LARGEST_POWER,
    ArrayMultivector,
    MultivectorArray,
    coefficients_of,
    from_exact,
    is_single,
    mixed,
    objects_of,
    scalar_of,
    single_type,
    values_of,
    wrap,
)
from .definitions import BINARY, FUNCTIONS, NORMALIZE, UNARY, Definition, power_of
from .exponentials import MOST_VECTORS
from .methods import Engine, curried, run_by
from .native import extension
from .normalizing import is_clearly_not_null, limits_of_divisor, normalized
from .numpy_functions import joined
from .operators import OBSERVERS, Operator, operator_of
from .scalars import Scalar
from .tables import table_of

SYMBOLS = (
    {
        (symbol, each.row.operands): (UNARY if each.row.operands == 1 else BINARY)[each]
        for each in Operation
        if each.row.kind is not Kind.SCALAR
        for symbol in (each.row.operator, *each.row.object_operators)
        if symbol
    }
    | {(f"**{n}", 1): power_of(n) for n in range(2, LARGEST_POWER + 1)}
    | {("**-1", 1): UNARY["inverse"]}
)
"""Definitions of Python's operators by symbol and number of operands; ``()`` is the call ``m(x)``."""


QUOTIENT = Definition("quotient", ("a", "b"), "a * ~b")
"""Division by a unit versor, whose inverse is its reverse."""

DIVISION = Definition("division", ("a", "b"), "a * ga.inverse(b)")
"""Division by a single element whose square is clearly a number other than 0; other divisors are inverted first."""


_NORMALIZE = curried(NORMALIZE)
"""``a / norm(a)`` as in kernels; the method of elements also restores the Study condition."""

_NUMBERS = (float, int, Scalar)
_MANY = frozenset((ArrayMultivector, np.ndarray))
"""Types of operands of which there may be many elements, so that an operation does not go through the extension."""


def run_operation(name: str, *operands: Any) -> Any:
    """Apply an operation of the kernel language to objects and numbers, for functions such as `gacompiler.reverse`."""
    operands = objects_of(f"{name}()", operands)
    if name == "normalize" and isinstance(operands[0], MultivectorArray):
        return normalized(operands[0], _NORMALIZE[0], wrap)
    if name in ("normalize", "inverse", *FUNCTIONS, "power"):
        return getattr(operands[0], name)(*operands[1:])
    table = UNARY if len(operands) == 1 else BINARY
    if name in table:
        return apply(table[name], *operands)
    first = next(each for each in operands if own_operations((each,)) is not None)
    raise OperandError(f"{name}()", f"a {first.layout}", "numbers")


class _Role(NamedTuple):
    """The operation of a callable object of the extension, which may already hold the first operand."""

    definition: Definition
    layout: Layout | None


_roles: dict[type, _Role] = {}
_partial_types: dict[tuple[str, type], type] = {}


def role_type(definition: Definition, layout: Layout | None) -> Any:
    """Return a type of the extension for an operation; its only object is called with a single multivector.

    The call returns the result. For an operation with two operands, it returns an object that holds the coefficients of
    the first operand and is called with the second; its type depends on the layout of the first operand.
    """
    names = () if layout is None else layout.blades
    made: Any = type(definition.name, (extension().Value,), {"__slots__": (), "_names": names})
    made._adopt(next_index(), tuple(f"_{k}" for k in range(len(names))), operate, coefficients_of, None)
    _roles[made] = _Role(definition, layout)
    return made


def _play(role: _Role, holder: Any, x: Any) -> Any:
    """Run the first call of an operation with operands of these types."""
    definition, layout = role
    if layout is not None:
        if type(x) in _NUMBERS:
            return holder(single_type(SCALAR)(x))
        return _second(definition, holder, wrap(layout, np.frombuffer(holder)), x)
    if len(definition.parameters) == 1:
        result = apply(definition, x)
        if is_single(type(x)):
            found = operator_of(definition, (_layout(x),))
            native = found.native
            _bind("()", (type(holder), type(x)), found, native and native.marked)
        return result
    return lambda y: _second(definition, holder, x, y)


def _second(definition: Definition, holder: Any, x: Any, y: Any) -> Any:
    result = apply(definition, x, y)
    if is_single(type(x)) and is_single(type(y)) and table_of(definition, (_layout(x), _layout(y))) is None:
        found = operator_of(definition, (_layout(x), _layout(y)))
        native, key = found.native, (definition.name, type(x))
        if native is None:
            return result
        if key not in _partial_types:
            _partial_types[key] = role_type(definition, x.layout)
            extension().bind_operator("()", (type(holder), type(x)), _partial_types[key], native.left, False)
        _bind("()", (_partial_types[key], type(y)), found, native.element)
    return result


def apply(definition: Definition, *operands: Any) -> Any:
    """Apply an operation to multivectors and numbers.

    Raises
    ------
    OperandError
        If an operand is a list, or an array where one of numbers has no use but one of coordinates would have.
    """
    types = tuple(map(type, operands))
    known = _PACKED.get((id(definition), *types))
    if known is not None and not OBSERVERS:
        return known.call(known.holder(*_flat(operands)))
    if not _MANY.isdisjoint(types) and (result := _known_result(definition, operands)) is not None:
        return result
    if np.ndarray in types:
        operands = tuple(map(joined, operands))
    symbolic = next((each for each in operands if isinstance(each, Expression)), None)
    if symbolic is not None:
        return definition.function(definition.algebra or symbolic.algebra)(*operands)
    algebra = definition.algebra
    refused = (list, tuple, np.ndarray) if definition in _OF_MULTIVECTORS else (list, tuple)
    if any(hasattr(kind, "family") for kind in types):
        operands = objects_of(definition.name, operands)
    for each in operands:
        if isinstance(each, refused) and not np.ndim(each) == 0:
            raise OperandError(
                definition.name,
                f"{type(each).__name__}, numbers that do not say which blades they belong to",
                "multivectors",
                "make one of them, as in PGA3.point(1, 2, 3), or an array of numbers for multiples",
            )
        if isinstance(each, MultivectorArray) and each.algebra is not SCALARS:
            if algebra is not None and each.algebra is not algebra and each.algebra != algebra:
                raise mixed(definition.name, algebra, each.algebra)
            algebra = each.algebra
    lifted = [values_of(definition.name, each) for each in operands]
    layouts = tuple(layout for layout, _ in lifted)
    table = table_of(definition, layouts)
    if table is not None:
        return wrap(table.result, table.product(*(values for _, values in lifted)))
    found = operator_of(definition, layouts)
    if found.native is not None:
        _pack(definition, operands, layouts, found)
    if not _MANY.isdisjoint(types) and not (np.ndarray in types and definition in _OF_MULTIVECTORS):
        key = _known_key(definition, operands)
        if key is not None:
            _KNOWN[key] = found, found.result.is_scalar, definition, layouts
    return wrap(found.result, found([values for _, values in lifted]))


_KNOWN: dict[tuple[int, ...] | None, tuple[Operator, bool, Definition, tuple[Layout, ...]]] = {}
"""Operations on arrays, and whether their results are numbers, by definition and layouts, which are kept alive."""


def _known_key(definition: Definition, operands: tuple[Any, ...]) -> tuple[int, ...] | None:
    """Return what identifies a definition and the kinds of its operands: layouts, numbers or arrays of doubles."""
    key = [id(definition)]
    for x in operands:
        kind = type(x)
        if kind in _NUMBERS or (kind is np.ndarray and x.dtype == np.float64):
            key.append(id(kind))
        elif isinstance(x, MultivectorArray) and x.layout.algebra is not SCALARS:
            key.append(id(x.layout))
        else:
            return None
    return tuple(key)


def _known_result(definition: Definition, operands: tuple[Any, ...]) -> Any:
    """Return the result of an operation that was applied to operands of these kinds before; None for all others."""
    known = _KNOWN.get(_known_key(definition, operands))
    if known is None:
        return None
    found, is_scalar, *_ = known
    out = found([x.values if isinstance(x, MultivectorArray) else np.asarray(x, float) for x in operands])
    return wrap(found.result, out) if is_scalar or out.ndim == 1 else ArrayMultivector(found.result, out)


class _Packed(NamedTuple):
    """An operation on single elements and numbers, whose coefficients are passed together."""

    holder: Any
    """The type of the extension that holds the coefficients of all operands."""
    call: Callable[[Any], Any]
    """Takes an object of this type."""
    definition: Definition
    """Kept alive, since the key has its identity."""


_PACKED: dict[tuple[Any, ...], _Packed] = {}
"""By the identity of the definition and the types of the operands."""
_HOLDERS: dict[int, Any] = {}
"""Types of holders by their number of coefficients."""


def _no_numbers(cls: Any, arguments: tuple[Any, ...]) -> Any:
    raise TypeError("operands are numbers")


def _flat(operands: tuple[Any, ...]) -> list[float]:
    numbers: list[float] = []
    for x in operands:
        if type(x) is float or type(x) is int:
            numbers.append(x)
        else:
            numbers += x._numbers()
    return numbers


def _pack(definition: Definition, operands: tuple[Any, ...], layouts: tuple[Layout, ...], found: Operator) -> None:
    """Let operations on operands of these types, single elements and Python's numbers, call the compiled function."""
    types = tuple(map(type, operands))
    if all(t is float or t is int or is_single(t) for t in types):
        made = packed(definition, layouts, found)
        if made is not None:
            _PACKED[id(definition), *types] = made


def packed(definition: Definition, layouts: tuple[Layout, ...], found: Operator) -> _Packed | None:
    """Return an operation that takes all coefficients together; None if it is not compiled (yet)."""
    native = found.native
    result = Scalar if found.result.is_scalar else single_type(found.result)
    if native is None or result is None:
        return None
    size = sum(1 if layout.is_scalar else layout.size for layout in layouts)
    if size not in _HOLDERS:
        names = tuple(f"_{k}" for k in range(size))
        holder: Any = type("Operands", (extension().Value,), {"__slots__": (), "_names": names})
        holder._adopt(next_index(), names, operate, _no_numbers, None)
        _HOLDERS[size] = holder
    role = role_type(definition, None)
    extension().bind_operator("()", (role, _HOLDERS[size]), result, native.packed, False)
    return _Packed(_HOLDERS[size], role(), definition)


_OF_MULTIVECTORS = frozenset(
    each for name, each in BINARY.items() if name not in ("geometric_product", "add", "subtract", "divide", "power")
)
"""Operations whose operands are not arrays of numbers."""


def _is_operand(x: Any) -> bool:
    return isinstance(x, (MultivectorArray, Multivector, int, float, complex, np.ndarray, np.generic, list, tuple))


_ABSENT: Any = object()


def _as_single(x: Any) -> Any:
    """Return `x`, stored by the extension if it is a single multivector that was created before that was available.

    Rational and decimal numbers become floats, as beside arrays of floats.
    """
    if isinstance(x, (Fraction, Decimal)):
        return float(x)
    return wrap(x.layout, x.values) if type(x) is ArrayMultivector and not x.shape and not x.layout.is_scalar else x


def operate(symbol: str, a: Any, b: Any = _ABSENT) -> Any:
    """Apply a Python operator to operands that include a multivector, and bind it to the types of single ones."""
    first, second = type(a), type(b)
    role = _roles.get(first)
    if role is not None:
        return _play(role, a, b if second is ArrayMultivector and b.shape else _as_single(b))
    if (first is np.ndarray and a.dtype == object) or (second is np.ndarray and b.dtype == object):
        pair = joined(a), joined(b)
        if pair[0] is not a or pair[1] is not b:
            return OPERATORS[symbol, 2](*pair)
    if (first in _MANY or second in _MANY) and (symbol != "/" or second in _NUMBERS or second is np.ndarray):
        operands = (a,) if b is _ABSENT else (a, b)
        definition = SYMBOLS.get((symbol, len(operands)))
        if definition is not None and (result := _known_result(definition, operands)) is not None:
            return result
    a, b = _as_single(a), _as_single(b)
    first, second = type(a), type(b)
    if symbol == "/" and second in (int, float, Scalar, np.float64) and b == 0 and not np.shape(a):
        raise ZeroDivisorError(
            "division", f"{a} / 0", "a divisor other than zero", "in an array, such quotients are infinite or NaN"
        )
    if any(hasattr(kind, "family") for kind in (first, second)):
        a, b = objects_of(f"a {symbol} b" if symbol != "()" else "a(b)", (a, b))
        return OPERATORS[symbol, 2](a, b)
    if symbol in ("()", ">>"):
        if isinstance(b, Expression) and isinstance(a, MultivectorArray):
            return apply(SYMBOLS[symbol, 2], a, b)
        if not _is_operand(b):
            raise TypeError(f"a versor can be applied to multivectors only; found {second.__name__}")
        if not isinstance(a, (MultivectorArray, Multivector)):
            raise TypeError(f"the left operand of >> must be a versor; found {first.__name__}")
    elif first in _NUMBERS and is_single(second):
        return OPERATORS[symbol, 2](single_type(SCALAR)(a), b)
    elif second in _NUMBERS and is_single(first):
        return OPERATORS[symbol, 2](a, single_type(SCALAR)(b))
    operands, types = ((a,), (first,)) if b is _ABSENT else ((a, b), (first, second))
    if not all(map(_is_operand, operands)):
        return NotImplemented
    definition, limits, can_bind = SYMBOLS[symbol, len(operands)], b"", all(map(is_single, types))
    divisor: Any = operands[-1] if symbol in ("/", "**-1") else None
    if isinstance(divisor, Multivector):
        divisor = from_exact(divisor)
    if hasattr(divisor, "layout") and (symbol == "**-1" or divisor.algebra is not SCALARS):
        is_unit = divisor.layout.unit
        limits = b"" if is_unit else limits_of_divisor(divisor.layout)
        can_bind = can_bind and bool(is_unit or limits)
        if symbol == "/":
            if isinstance(a, MultivectorArray) and a.algebra not in (SCALARS, divisor.algebra):
                raise mixed("division", a.algebra, divisor.algebra)
            if not is_unit and not (can_bind and is_clearly_not_null(divisor.layout, divisor._numbers())):
                return a * divisor.inverse()
            definition = QUOTIENT if is_unit else DIVISION
    result = apply(definition, *operands) if symbol != "**-1" else a._inverted()
    if can_bind and extension() is not None:
        _bind_operation(symbol, definition, operands, limits)
    return result


def _layout(x: Any) -> Layout:
    return SCALAR if x.layout.is_scalar else x.layout


def _bind_operation(symbol: str, definition: Definition, operands: tuple[Any, ...], limits: bytes) -> None:
    """Let a Python operator on single multivectors of these types run the compiled function if there is one."""
    layouts = tuple(_layout(x) for x in operands)
    if table_of(definition, layouts) is None:
        found = operator_of(definition, layouts)
        native = found.native
        _bind(symbol, tuple(map(type, operands)), found, native and native.element, limits)


def bind_power(x: Any, exponent: float) -> None:
    """Let the extension run powers of unit versors of this type with exponents that are not whole."""
    if is_single(type(x)) and n_vectors(x.layout.support) <= MOST_VECTORS:
        _bind_operation("**", BINARY["power"], (x, single_type(SCALAR)(exponent)), b"")


def _bind(symbol: str, types: tuple[type, ...], found: Operator, address: int | None, limits: bytes = b"") -> None:
    """Let the extension run a compiled function on objects of these types from now on."""
    if address is not None:
        result = Scalar if found.result.is_scalar else single_type(found.result)
        extension().bind_operator(symbol, types, result, address, False, limits)


MultivectorArray._operate = staticmethod(operate)
MultivectorArray._bind_power = staticmethod(bind_power)
MultivectorArray._run_operation = staticmethod(run_operation)
run_by(Engine(apply, role_type, scalar_of))
