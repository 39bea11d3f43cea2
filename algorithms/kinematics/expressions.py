"""Expressions in descriptions of robots: a small part of Python, which is parsed by it and evaluated here.

Numbers, texts, lists, comparisons and functions of mathematics are known. There are no attributes of values, no
comprehensions and no other names, so that an expression cannot run programs or read files. Values are bounded, so that
it cannot fill the memory, either.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

MOST = 100_000
"""Robots have some thousand elements, and texts of some hundred letters; macros that repeat others could have any."""
_LONGEST = 4096
"""Integers of more bits are not those of robots."""


def evaluated(text: str, named: Callable[[str], Any]) -> Any:
    """Return the value of an expression.

    Parameters
    ----------
    text : str
    named : function
        Returns the value of a name, or raises a LookupError.

    Raises
    ------
    TypeError, ValueError, ArithmeticError, LookupError
        If the text is no expression, or its value cannot be computed.
    """
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, RecursionError, MemoryError):
        raise ValueError("no expression") from None
    try:
        found = _value_of(tree, named)
    except RecursionError:
        raise ValueError("an expression that is nested too often") from None
    return _bounded(found)


def _value_of(node: ast.expr, named: Callable[[str], Any]) -> Any:
    def of(part: ast.expr) -> Any:
        return _value_of(part, named)

    match node:
        case ast.Constant(value=int() | float() | str() | None as value):
            return value
        case ast.Name(id=name):
            return named(name)
        case ast.Attribute(value=ast.Name(id="math"), attr=name) if name in NAMES:
            return NAMES[name]
        case ast.List(elts=parts) | ast.Tuple(elts=parts):
            return _bounded([of(part) for part in parts])
        case ast.Dict(keys=keys, values=parts) if None not in keys:
            entries = zip(keys, parts, strict=True)
            return _bounded({of(key): of(part) for key, part in entries if key is not None})
        case ast.Subscript(value=of_what, slice=place) if not isinstance(place, ast.Slice):
            return of(of_what)[of(place)]
        case ast.UnaryOp(op=op, operand=part) if type(op) in _UNARY:
            return _UNARY[type(op)](of(part))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
            return _calculated(_BINARY[type(op)], of(left), of(right))
        case ast.BoolOp(op=op, values=parts):
            value = of(parts[0])
            for part in parts[1:]:
                if bool(value) == isinstance(op, ast.Or):
                    break
                value = of(part)
            return value
        case ast.Compare(left=left, ops=ops, comparators=parts) if all(type(op) in _COMPARED for op in ops):
            values = [of(part) for part in (left, *parts)]
            pairs = zip(ops, values, values[1:], strict=False)
            return all(_COMPARED[type(op)](a, b) for op, a, b in pairs)
        case ast.IfExp(test=test, body=body, orelse=other):
            return of(body) if of(test) else of(other)
        case ast.Call(func=function, args=parts, keywords=[]) if not any(isinstance(x, ast.Starred) for x in parts):
            called = of(function)
            if not callable(called):
                raise TypeError(f"{ast.unparse(function)} is no function")
            return _bounded(called(*(of(part) for part in parts)))
    raise TypeError(f"{ast.unparse(node)} is not supported in descriptions of robots")


def _bounded(value: Any) -> Any:
    """Return a value, or raise an error if it is too long. Parts of expressions are bounded before they are joined."""
    if _size(value) > MOST:
        raise ValueError(f"a value of more than {MOST} entries")
    return value


def _size(value: Any) -> int:
    """Return the number of letters and entries of a value. Those that it consists of have been measured before."""
    match value:
        case str():
            return len(value)
        case list():
            return sum(map(_size, value)) + 1
        case dict():
            return sum(_size(each) + 1 for each in value.values()) + 1
    return 1


def _calculated(function: Callable[[Any, Any], Any], left: Any, right: Any) -> Any:
    """Calculate with numbers, and join texts and lists; powers and repeated texts that fill the memory are refused."""
    is_number = all(isinstance(x, (bool, int, float)) for x in (left, right))
    if not is_number and function is not operator.add:
        raise TypeError(f"{type(left).__name__} and {type(right).__name__}; expected numbers")
    if not is_number:
        return _bounded(left + right)
    bits = [x.bit_length() if isinstance(x, int) else 0 for x in (left, right)]
    if all(isinstance(x, int) for x in (left, right)):
        longest = bits[0] * abs(right) if function is operator.pow else sum(bits)
        if longest > _LONGEST:
            raise ValueError("an integer that is too long")
    return function(left, right)


def _rounded(number: Any, digits: Any = None) -> Any:
    """Return a rounded number. Python computes a power of ten with all digits, which may be too long."""
    if isinstance(digits, int) and abs(digits) > _LONGEST:
        raise ValueError(f"round to {digits} digits; expected at most {_LONGEST}")
    return round(number, digits)


_UNARY: Mapping[type[ast.unaryop], Callable[[Any], Any]] = {
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
}
_BINARY: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
}
_COMPARED: Mapping[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.In: lambda a, b: a in b,
    ast.NotIn: lambda a, b: a not in b,
}
_FUNCTIONS = (
    math.acos, math.asin, math.atan, math.atan2, math.ceil, math.copysign, math.cos, math.cosh, math.degrees, math.exp,
    math.fabs, math.floor, math.fmod, math.hypot, math.log, math.log10, math.pow, math.radians, math.sin, math.sinh,
    math.sqrt, math.tan, math.tanh, math.trunc, abs, bool, float, int, len, max, min, str, sum,
)  # fmt: skip
NAMES: Mapping[str, Any] = {
    **{each.__name__: each for each in _FUNCTIONS},
    "round": _rounded,
    "pi": math.pi,
    "e": math.e,
    "inf": math.inf,
    "nan": math.nan,
    "True": True,
    "False": False,
}
"""Functions and constants of expressions."""
