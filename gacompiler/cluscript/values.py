"""Functions of numbers in scripts. Exact numbers are lifted to expressions, which decide later how roots are taken."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

from ..algebra.multivector import Multivector
from ..errors import KernelError
from ..frontend import operations
from ..frontend.expression import Expression, lift


def lifted(value: Any) -> Any:
    """Exact numbers and constant multivectors as expressions; all else as it is."""
    return lift(value) if isinstance(value, (int, Fraction, Multivector)) else value


def scalar_part(value: Any) -> Any:
    """The coefficient of 1, which is what functions of numbers take of a multivector, as in Gaalop.

    Raises
    ------
    KernelError
        When there is none.
    """
    if not isinstance(value, (Expression, Multivector)) or (isinstance(value, Expression) and value.is_scalar):
        return value
    if 0 not in value.blades:
        raise KernelError("a function of numbers", f"{value}, which has no scalar part", "a scalar")
    return value[0]


def of_scalars(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of numbers, for whatever a script gives it."""
    return lambda *values: function(*(lifted(scalar_part(value)) for value in values))


sqrt = of_scalars(operations.sqrt)
sin = of_scalars(operations.sin)
cos = of_scalars(operations.cos)
acos = of_scalars(operations.acos)
log = of_scalars(operations.log)
atan2 = of_scalars(operations.atan2)
absolute = of_scalars(operations.absolute)


def length(value: Any) -> Any:
    """``abs(m)``: the root of the absolute value of the scalar part of ``m ~m``."""
    if not isinstance(value, (Expression, Multivector)) or (isinstance(value, Expression) and value.is_scalar):
        return absolute(value)
    square = operations.norm_squared(value)
    return sqrt(absolute(square.scalar if isinstance(square, Multivector) else square))
