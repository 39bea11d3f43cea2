"""The functions of the language; their names are case-insensitive, as in Gaalop."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

from ..algebra.multivector import Multivector
from ..errors import KernelError
from ..frontend import functions
from .values import acos, atan2, cos, length, lifted, log, of_scalars, scalar_part, sin, sqrt, within_domain


def _exponential(value: Any) -> Any:
    """Return the exponential of a scalar, a multiple of one blade with known square, or any multivector."""
    element = lifted(value)
    if element.is_scalar or len(element.blades) != 1:
        return functions.exp(element)
    (blade,) = element.blades
    square = element.algebra.blade_product(blade, blade)
    if set(square) - {0}:
        return functions.exp(element)
    number, size = square.get(0, 0), element.coefficient_at(blade)
    if number == 0:
        return 1 + element
    root = sqrt(abs(number)) if abs(number) != 1 else 1
    angle, plane = root * size, Multivector(element.algebra, {blade: 1}) / root
    if number < 0:
        return cos(angle) + sin(angle) * plane
    grown, shrunk = functions.exp(angle), functions.exp(-angle)
    return (grown + shrunk) / 2 + (grown - shrunk) / 2 * plane


def _tangent(x: Any) -> Any:
    return sin(x) / cos(x)


def _arcsine(x: Any) -> Any:
    return atan2(x, sqrt((1 - x) * (1 + x)))


def _of_number(function: Callable[[Any], Any], name: str) -> Callable[[Any], Any]:
    def of_number(value: Any) -> Any:
        number = scalar_part(value)
        if not isinstance(number, (int, Fraction)):
            raise KernelError(name, f"{name} of {number}, which is known only at run time", "a constant number")
        return function(number)

    return of_number


LARGEST_FACTORIAL = 170
"""The factorial of the next number is out of the range of doubles."""


def _factorial(value: Any) -> Any:
    if value != int(value) or not 0 <= value <= LARGEST_FACTORIAL:
        raise KernelError("fact", f"fact({value})", f"a natural number up to {LARGEST_FACTORIAL}")
    return math.factorial(int(value))


FUNCTIONS: dict[str, tuple[int, Callable[..., Any]]] = {
    "abs": (1, length),
    "sqrt": (1, sqrt),
    "exp": (1, _exponential),
    "log": (1, log),
    "sin": (1, sin),
    "cos": (1, cos),
    "tan": (1, of_scalars(_tangent)),
    "asin": (1, within_domain("asin", _arcsine)),
    "acos": (1, acos),
    "atan": (1, lambda x: atan2(x, 1)),
    "atan2": (2, atan2),
    "ceil": (1, _of_number(math.ceil, "ceil")),
    "floor": (1, _of_number(math.floor, "floor")),
    "fact": (1, _of_number(_factorial, "fact")),
}
"""Number of arguments and meaning. ``coefficient(x, blade)`` is separate: its second argument is a blade.

Functions of numbers take the scalar part of what they are given; `exp` takes whole multivectors.
"""
