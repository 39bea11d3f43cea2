"""Functions of numbers in scripts. Exact numbers are lifted to expressions, so that roots are evaluated later."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

from ..algebra.multivector import Multivector
from ..algebra.operations import Operation
from ..errors import KernelError
from ..frontend import operations
from ..frontend.expression import Expression, lift


def lifted(value: Any) -> Any:
    """Return exact numbers and constant multivectors as expressions, and all other values unchanged."""
    return lift(value) if isinstance(value, (int, Fraction, Multivector)) else value


def scalar_part(value: Any) -> Any:
    """Return the coefficient of 1, to which functions of numbers reduce a multivector, as in Gaalop.

    Raises
    ------
    KernelError
        If there is no such coefficient.
    """
    if not isinstance(value, (Expression, Multivector)) or (isinstance(value, Expression) and value.is_scalar):
        return value
    if 0 not in value.blades:
        raise KernelError("a function of numbers", f"{value}, which has no scalar part", "a scalar")
    return value["1"]


def of_scalars(function: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a function of numbers so that it accepts any value of a script."""
    return lambda *values: function(*(lifted(scalar_part(value)) for value in values))


DOMAINS: dict[str, Callable[[Any], bool]] = {
    "sqrt": lambda x: x >= 0,
    "log": lambda x: x > 0,
    "acos": lambda x: abs(x) <= 1,
    "asin": lambda x: abs(x) <= 1,
}
"""Domains of functions."""


def within_domain(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a function of a number so that it refuses exact numbers outside its real domain."""

    def checked(x: Any) -> Any:
        number = x.data.scalar if isinstance(x, Expression) and x.operation is Operation.CONSTANT else x
        if isinstance(number, (int, Fraction)) and not DOMAINS[name](number):
            raise KernelError(name, f"{name}({number}), which is not a real number", "a number where it is defined")
        return function(x)

    return of_scalars(checked)


sqrt = within_domain("sqrt", operations.sqrt)
sin = of_scalars(operations.sin)
cos = of_scalars(operations.cos)
acos = within_domain("acos", operations.acos)
log = within_domain("log", operations.log)
atan2 = of_scalars(operations.atan2)
absolute = of_scalars(operations.absolute)


def length(value: Any) -> Any:
    """Compute ``abs(m)``: the root of the absolute value of the scalar part of ``m ~m``."""
    if not isinstance(value, (Expression, Multivector)) or (isinstance(value, Expression) and value.is_scalar):
        return absolute(value)
    square = operations.norm_squared(value)
    return sqrt(absolute(square.scalar if isinstance(square, Multivector) else square))
