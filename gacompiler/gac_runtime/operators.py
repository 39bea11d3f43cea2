"""Operators of values of generated modules: by a kernel of the module, or as a sum or multiple, which needs none."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from numbers import Rational
from typing import Any

import numpy as np

from .array_element import OPERATORS, Element
from .extension import extension
from .kernel import Kernel
from .layout import Layout, coefficients, converted, number

_NUMBERS = (int, float, Rational, np.integer, np.floating)
"""Types of the numbers by which values can be multiplied."""


_of_value: Callable[[Any], bool] = cache(lambda kind: issubclass(kind, Element) and hasattr(kind, "family"))
"""Whether this is a type of values of modules with this copy of the runtime."""


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
            if _of_value(kind) and kind.family is not self
            else kind
            for kind in types
        )


def operate(symbol: str, *operands: Any) -> Any:
    """Apply an operator by its kernel; return NotImplemented for foreign types, which may define the operator."""
    own = tuple(map(type, operands))
    values = [x for x in operands if _of_value(type(x))]
    types: tuple[Any, ...] = tuple([x.kind if _of_value(type(x)) else type(x) for x in operands])
    found = values[0].family.operators.get((symbol, types))
    if found is None and len(values) > 1:
        families = {x.family: None for x in values}
        if len(families) > 1:
            found = next((row for each in families if (row := each.operators.get((symbol, each.alike(types))))), None)
    if found is None:
        others = [x for x in operands if not _of_value(type(x))]
        other = next((x for x in others if hasattr(x, "stored")), None) if others else None
        if other is not None and (symbol, len(operands)) in OPERATORS:  # those of the other element have any operands
            return OPERATORS[symbol, len(operands)](
                *[other.like(x.layout, np.array(x.values)) if _of_value(type(x)) else x for x in operands]
            )
        combined = None if symbol == "()" else _sum_or_multiple(symbol, *operands)
        if combined is not None:
            return combined
        known = (int, float, complex, np.ndarray, np.generic, list, tuple)
        is_pair = len(types) == 2 and types[0].__name__ == types[1].__name__
        if symbol == "()" or is_pair or all(isinstance(x, known) for x in others):
            raise _unknown(values[0].family, symbol, types)
        return NotImplemented
    kernel, result, swapped = found
    arrays = [operand.values for operand in operands]
    value = kernel(*(reversed(arrays) if swapped else arrays))
    if types == own and extension is not None and kernel.element_address:
        extension.bind_operator(symbol, types, None if result is float else result, kernel.element_address, swapped)
    if result is float:
        return float(value) if types == own else value
    return result.made(value)


def _sum_or_multiple(symbol: str, a: Any, b: Any = None) -> Any:
    """Return a sum, a difference, a multiple or a negative, which need no kernel; None for all other operations."""
    if symbol == "*" and isinstance(a, _NUMBERS):
        a, b = b, a
    if symbol == "-" and b is None:
        if a.layout.unit and not a.layout.fixed:
            # The negative of a unit element is a unit element.
            return type(a)(*[-x for x in a._numbers()]) if type(a) is a.kind else a.kind.made(-a.values)
        symbol, b = "*", -1.0
    values = [x for x in (a, b) if _of_value(type(x))]
    numbers = [float(x) for x in (a, b) if isinstance(x, _NUMBERS)]
    is_sum = symbol in "+-"
    if len(values) + len(numbers) < 2 or not (is_sum or (symbol in "*/" and numbers and values[0] is a)):
        return None
    result = _type_of_sum(symbol, tuple([x.kind for x in values]), is_sum and any(numbers))
    if result is None:
        return None
    left = _in_type(a, result)
    right = _in_type(b, result) if is_sum else numbers * len(result.layout.blades)
    if type(left) is list and type(right) is list:
        return result(*map(OPERATORS[symbol, 2], left, right))
    dtype = values[0].values.dtype if numbers else None
    left, right = (np.asarray(each, dtype) if type(each) is list else each for each in (left, right))
    return result.made(OPERATORS[symbol, 2](left, right))


@cache
def _type_of_sum(symbol: str, kinds: tuple[Any, ...], has_number: bool) -> Any:
    """Return the type of a sum or multiple, with a number other than 0 if there is one; None if the module has none."""
    fixed: list[dict[str, float]] = [
        {blade: number(value) for blade, value in kind.layout.fixed if value != "implied"} for kind in kinds
    ]
    if len(kinds) == 2:
        # Equal fixed coefficients cancel in a difference: two points of weight 1 give a direction.
        one, two = fixed
        fixed = [{blade: OPERATORS[symbol, 2](one.get(blade, 0.0), two.get(blade, 0.0)) for blade in {**one, **two}}]
    wanted = {blade for blade, value in fixed[0].items() if value}.union(["1"] * has_number)
    for kind in kinds:
        wanted.update(kind.layout.blades, dict(kind.layout.implied))
    sums = kinds[0].family.sums
    for result in (*(kind for kind in kinds if kind in sums), *sums):
        if wanted <= set(result.layout.blades) and all(kind.layout.algebra == result.layout.algebra for kind in kinds):
            return result
    return None


def _in_type(x: Any, result: Any) -> Any:
    """Return a value or number as the coefficients of a type, without those that cancel: a list for a single one."""
    blades = result.layout.blades
    if not _of_value(type(x)):
        return [float(x) if blade == "1" else 0.0 for blade in blades]
    is_single = type(x) is x.kind
    if x.layout.blades == blades:
        return x._numbers() if is_single else x.values
    if x.layout.implied:
        found = coefficients(x.values, x.layout)
        return np.stack([found.get(blade, np.zeros_like(x.values[..., 0])) for blade in blades], -1)
    row, places = _row(x.kind, result)
    if is_single:
        numbers = row.copy()
        for place, each in zip(places, x._numbers(), strict=True):
            numbers[place] = each
        return numbers
    values = np.empty((*x.shape, len(row)), x.values.dtype)
    values[...] = row
    values[..., places] = x.values
    return values


@cache
def _row(kind: Any, result: Any) -> tuple[list[float], list[int]]:
    """Return the fixed coefficients of a type in another one, and the places of those that it stores."""
    fixed, blades = dict(kind.layout.fixed), result.layout.blades
    return [number(fixed.get(blade, "0")) for blade in blades], [blades.index(blade) for blade in kind.layout.blades]


def _unknown(family: Family, symbol: str, types: tuple[type, ...]) -> TypeError:
    """Return the error for an undefined operator, which lists the operators that are defined."""
    like = [
        f"{_expression(symbol, each)} ({kernel.name})"
        for (other, each), (kernel, _, _) in family.operators.items()
        if other == symbol and (symbol == "()" or len(each) == len(types))
    ]
    there = ", ".join(like)
    module = next(each.__module__ for each in types if hasattr(each, "family"))
    found = _expression(symbol, types, len({each.__name__ for each in types}) < len(set(types)))
    return TypeError(f"{found}: not defined by {module}; expected one of: {there or 'none'}")


def _expression(symbol: str, types: tuple[type, ...], with_modules: bool = False) -> str:
    first, *others = (f"{each.__module__}.{each.__name__}" if with_modules else each.__name__ for each in types)
    if symbol == "()":
        return f"{first}({', '.join(others)})"
    return f"{first} {symbol} {others[0]}" if others else f"{symbol}{first}"


def square_minus_one(x: Any) -> np.ndarray[Any, Any] | None:
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
