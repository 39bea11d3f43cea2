"""Circular and hyperbolic functions of symbolic multivectors, in closed form; of scalars, those of sympy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy

from ..algebra.multivector import Multivector
from .functions import OWN, even_and_odd, factor_of, split_number
from .multivector import symbolic
from .relations import reduce


def sin(a: Any) -> Any:
    """Return the sine ``a - a**3 / 6 + ...`` of a scalar plus a part whose square is a scalar."""
    return _wave("sin()", a, sympy.sin, sympy.cos, -1)


def cos(a: Any) -> Any:
    """Return the cosine ``1 - a**2 / 2 + ...`` of a scalar plus a part whose square is a scalar."""
    return _wave("cos()", a, sympy.cos, lambda w: -sympy.sin(w), -1)


def sinh(a: Any) -> Any:
    """Return the hyperbolic sine ``a + a**3 / 6 + ...`` of a scalar plus a part whose square is a scalar."""
    return _wave("sinh()", a, sympy.sinh, sympy.cosh, 1)


def cosh(a: Any) -> Any:
    """Return the hyperbolic cosine ``1 + a**2 / 2 + ...`` of a scalar plus a part whose square is a scalar."""
    return _wave("cosh()", a, sympy.cosh, sympy.sinh, 1)


def tan(a: Any) -> Any:
    """Return the tangent, the sine divided by the cosine."""
    return reduce(sin(a) / cos(a)) if isinstance(a, Multivector) else sympy.tan(a)


def tanh(a: Any) -> Any:
    """Return the hyperbolic tangent, the hyperbolic sine divided by the hyperbolic cosine."""
    return reduce(sinh(a) / cosh(a)) if isinstance(a, Multivector) else sympy.tanh(a)


def _wave(where: str, a: Any, even: Callable[..., Any], odd: Callable[..., Any], sign: int) -> Any:
    """Return ``f(w + b) = f(w) C + f'(w) S b``, with ``C`` and ``S`` of `even_and_odd` for the square of `b`."""
    if not isinstance(a, Multivector):
        return even(a)
    w, b, _ = split_number(where, a)
    size, rest = factor_of(b)
    cosine, sine = even_and_odd(sign * reduce(rest * rest)["1"], size)
    return symbolic(odd(w) * sine * rest + even(w) * cosine)


OWN |= {"sin": sin, "cos": cos, "tan": tan, "sinh": sinh, "cosh": cosh, "tanh": tanh}
