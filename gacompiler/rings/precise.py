"""Exponentials and logarithms of multivectors with numbers of mpmath, to the precision of mpmath.

The functions for kernels have limits and polynomials for doubles. Exponentials are therefore sums of Taylor's series
here, and logarithms are improved by Newton's method.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from fractions import Fraction
from typing import Any

from ..algebra.coefficients import scalar_function
from ..algebra.multivector import Multivector

MOST_STEPS = 64
"""Most steps of Newton's method. Each one adds digits, at least a few except where the logarithm is not determined."""
TERMS = 40
"""Terms of the series of the inverse derivative of the exponential. The ratio of successive terms is the largest sum of
two angles divided by 2 pi, so that more terms hardly reduce the number of steps."""


def _operation(run: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    def method(self: Precise, other: Any) -> Any:
        return NotImplemented if isinstance(other, Multivector) else Precise(run(self.value, _plain(other)))

    return method


def _comparison(run: Callable[[Any, Any], Any]) -> Callable[[Any, Any], bool]:
    def method(self: Precise, other: Any) -> bool:
        return bool(run(self.value, _plain(other)))

    return method


class Precise:
    """A number of mpmath that has the operations of coefficients with fractions, which mpmath refuses."""

    __slots__ = ("value",)

    def __init__(self, value: Any) -> None:
        self.value = value

    @property
    def is_zero(self) -> bool:
        """Whether the number is 0."""
        return bool(self.value == 0)

    def scalar_function(self, name: str, arguments: tuple[Any, ...]) -> Any:
        """Apply a scalar function; called by `gacompiler.algebra.coefficients.scalar_function`."""
        found = scalar_function(name, *map(_plain, arguments))
        return found if isinstance(found, int) else Precise(found)

    __add__, __radd__ = _operation(operator.add), _operation(operator.add)
    __sub__, __rsub__ = _operation(operator.sub), _operation(lambda a, b: b - a)
    __mul__, __rmul__ = _operation(operator.mul), _operation(operator.mul)
    __truediv__, __rtruediv__ = _operation(operator.truediv), _operation(lambda a, b: b / a)

    def __neg__(self) -> Precise:
        return Precise(-self.value)

    def __abs__(self) -> Precise:
        return Precise(abs(self.value))

    __lt__, __le__ = _comparison(operator.lt), _comparison(operator.le)
    __gt__, __ge__ = _comparison(operator.gt), _comparison(operator.ge)

    def __eq__(self, other: object) -> bool:
        return bool(self.value == _plain(other))

    def __hash__(self) -> int:
        return hash(self.value)


def _plain(value: Any) -> Any:
    if isinstance(value, Precise):
        return value.value
    if isinstance(value, Fraction):
        import mpmath

        return mpmath.mpf(value.numerator) / value.denominator
    return value


def is_precise(a: Any) -> bool:
    """Return whether some coefficient of a multivector is a number of mpmath."""
    found = isinstance(a, Multivector) and any(type(x).__module__.startswith("mpmath") for x in a.terms.values())
    return found and any(a.terms)


def by_doubles(function: Callable[[Multivector], Multivector], a: Multivector) -> Multivector:
    """Return a function of a multivector, whose limits and polynomials are those for doubles."""
    return a.lift(function(a.map(Precise))).map(_plain)


def exponential(a: Multivector) -> Multivector:
    """Return ``exp(a)`` to the precision of mpmath, by Taylor's series for a fraction of `a`, and squarings."""
    import mpmath

    size = sum(abs(_plain(x)) for x in a.terms.values()) * 2 ** (a.algebra.dimension // 2)
    halvings = max(int(mpmath.ceil(mpmath.log(size, 2))) + 8, 0) if size else 0
    with mpmath.workprec(mpmath.mp.prec + 2 * halvings + 16):
        small = a.map(lambda x: mpmath.mpmathify(_plain(x)) / 2**halvings)
        term = found = a.lift(mpmath.mpf(1))
        k = 1
        while term.terms and max(map(abs, term.terms.values())) > mpmath.eps:
            term = (term * small).map(lambda x, k=k: x / k)  # type: ignore[misc]
            found, k = found + term, k + 1
        for _ in range(halvings):
            found = found * found
    return found.map(lambda x: +x)


def waves(a: Multivector, circle: bool) -> tuple[Multivector, Multivector]:
    """Return the cosine and the sine of any multivector, or the hyperbolic ones, to the precision of mpmath."""
    import mpmath

    if circle:
        found = exponential(a.map(lambda x: mpmath.mpc(0, _plain(x))))
        return found.map(mpmath.re), found.map(mpmath.im)
    there, back = exponential(a), exponential(-a)
    return (there + back).map(lambda x: x / 2), (there - back).map(lambda x: x / 2)


def corrected_logarithm(versor: Multivector, start: Multivector) -> Multivector:
    """Return the bivector `B` with ``exp(B) = versor`` or its negative, near `start`, to the precision of mpmath.

    From ``exp(B + X) = exp(phi(ad B) X) exp(B)`` up to second order, ``phi(z) = (exp(z) - 1) / z``, the step `X` is the
    series ``sum b_k / k! ad(B)**k`` of a residual, with Bernoulli's numbers `b_k`.
    """
    import mpmath

    exact = versor.map(lambda x: mpmath.mpmathify(_plain(x)))
    if (exact * exponential(-start)).scalar < 0:
        exact = -exact
    for _ in range(MOST_STEPS):
        step = term = (exact * exponential(-start)).grade(2)
        for k in range(1, TERMS):
            term = (start * term - term * start).grade(2).map(lambda x, k=k: x / k)  # type: ignore[misc]
            step = step + term.map(lambda x, k=k: x * mpmath.bernoulli(k))  # type: ignore[misc]
        start = start + step
        if max(map(abs, step.terms.values()), default=0) <= 4 * mpmath.eps * max(map(abs, start.terms.values())):
            break
    return start
