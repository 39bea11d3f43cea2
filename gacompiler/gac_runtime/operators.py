"""Operators of values of generated modules: by a kernel of the module, or as a sum or multiple, which needs none."""

from __future__ import annotations

import operator
from functools import cache
from typing import Any

import numpy as np

from .array_element import OPERATORS, Element
from .extension import extension
from .kernel import Kernel
from .layout import Layout, coefficients, converted, number

_NUMBERS = (int, float, np.integer, np.floating)
"""Types of the numbers by which values can be multiplied."""


def _is_value(x: Any) -> bool:
    """Whether this is a value of a module with this copy of the runtime."""
    return isinstance(x, Element) and hasattr(type(x), "family")


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
            if issubclass(kind, Element) and getattr(kind, "family", self) is not self
            else kind
            for kind in types
        )


def operate(symbol: str, *operands: Any) -> Any:
    """Apply an operator by its kernel; return NotImplemented for foreign types, which may define the operator."""
    own = tuple(map(type, operands))
    types: tuple[Any, ...] = tuple([x.kind if _is_value(x) else type(x) for x in operands])
    modules = {x.family: None for x in operands if _is_value(x)}
    found = next((row for each in modules if (row := each.operators.get((symbol, each.alike(types))))), None)
    if found is None:
        other = next((x for x in operands if not _is_value(x) and hasattr(x, "stored")), None)
        if other is not None and (symbol, len(operands)) in OPERATORS:  # those of the other element have any operands
            return OPERATORS[symbol, len(operands)](
                *[other.like(x.layout, np.array(x.values)) if _is_value(x) else x for x in operands]
            )
        combined = None if symbol == "()" else _sum_or_multiple(symbol, *operands)
        if combined is not None:
            return combined
        known = (int, float, complex, np.ndarray, np.generic, list, tuple)
        is_pair = len(types) == 2 and types[0].__name__ == types[1].__name__
        if symbol == "()" or is_pair or all(_is_value(x) or isinstance(x, known) for x in operands):
            raise _unknown(next(iter(modules)), symbol, types)
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
            return a.kind.made(-a.values)  # the negative of a unit element is a unit element
        total = {blade: -x for blade, x in _terms(a).items()}
    elif symbol in "*/" and _is_value(a) and isinstance(b, _NUMBERS):
        scale = operator.mul if symbol == "*" else operator.truediv
        total = {blade: scale(x, float(b)) for blade, x in _terms(a).items()}
    elif symbol in "+-" and all(_is_value(x) or isinstance(x, _NUMBERS) for x in (a, b)):
        join = operator.add if symbol == "+" else operator.sub
        own, other = _terms(a), _terms(b)
        total = {blade: join(own.get(blade, 0.0), other.get(blade, 0.0)) for blade in {**own, **other}}
    else:
        return None
    types = tuple([x.kind for x in (a, b) if _is_value(x)])
    # Equal fixed coefficients cancel in a difference: two points of weight 1 give a direction.
    result = _type_of_sum(
        types, frozenset(blade for blade, x in total.items() if (x if type(x) is float else np.any(x)))
    )
    if result is None:
        return None
    row = [total.get(blade, 0.0) for blade in result.layout.blades]
    return result(*row) if all(type(x) is float for x in row) else result.made(np.stack(np.broadcast_arrays(*row), -1))


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
    if not _is_value(x):
        return {"1": float(x)}
    layout = x.layout
    if layout.implied or type(x) is not x.kind:
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
