"""Exponentials by closed forms in one or two numbers; see `gacompiler.frontend.scaling` for those without closed form.

With the notation of `gacompiler.frontend.squares`, ``exp(b) = C(s) + S(s) b`` if the square is a scalar, with

    C(x) = cosh(sqrt x) = cos(sqrt -x),    S(x) = sinh(sqrt x)/sqrt x = sin(sqrt -x)/sqrt -x,

and ``exp(b) = F0 + F1 p + (G0 + G1 p) b`` if it is ``s + 2 p``. With ``P = p p``, the squares of the two commuting
parts of `b` are ``x = (s +- sqrt(s**2 - 4 P))/2``, and

    F0 = C1 C2,  F1 = S1 S2,  G1 = (C1 S2 - C2 S1)/(x1 - x2),  G0 = C2 S1 - x2 G1;

with the eigenvalues ``y = s +- 2 sqrt P = (sqrt x1 +- sqrt x2)**2`` of the square,

    F0 = (C+ + C-)/2,  F1 = (C+ - C-)/(2 sqrt P),  G0 = (S+ + S-)/2,  G1 = (S+ - S-)/(2 sqrt P).

The first form loses digits near ``x1 = x2`` (isoclinic rotations), and the second where one part vanishes. Between
these cases both are accurate; the second form is used if ``8 P > s**2``. If `p` can be a null element (five basis
vectors whose squares have both signs, or several null vectors), it can be large although ``s`` and ``P`` are only
rounding errors. In these algebras, power series in ``s + 2 p`` are used near 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from math import factorial
from typing import Any

from ..algebra.multivector import Multivector
from ..algebra.signs import Signs
from .many_vectors import has_many_vectors, keeps_loops, versor_exponential
from .operations import absolute, cos, exp, maximum, select, sin, sqrt
from .scaling import exponential_by_squaring
from .squares import Form, Value, blades_of, form_of, grades_of

NEARLY_ZERO = Fraction(1, 10**18)
"""Squares below this are 0 up to rounding, in functions with the power series ``1 + x / 6 + ...``."""
TINY = NEARLY_ZERO**2
ONE = 1.0
"""Argument of functions whose value is not used; a float, so that the value also exists outside kernels."""
SMALL = Fraction(1, 4)
"""Below this, ``S`` is computed by a polynomial, because ``exp(u) - exp(-u)`` loses the digits of a small u."""
NEAR = Fraction(1, 8)
"""Limit of ``s**2`` and ``8 P`` for the power series, where the eigenvalues are below 0.61."""
HALF = Fraction(1, 2)

# Enough terms for `NEAR`; further denominators would exceed 2**53, and the emitted text would contain rounded numbers.
_SINES = tuple(Fraction(1, factorial(2 * k + 1)) for k in range(9))
_COSINES = tuple(Fraction(1, factorial(2 * k)) for k in range(10))
_TERMS = 7
"""Number of terms for `SMALL`."""

Pair = tuple[Value, Value]
"""The number ``a + b p``."""


def exponential(b: Any) -> Any:
    """Return ``exp(b)`` for an element without scalar part."""
    form = form_of(b.algebra, blades_of(b))
    if form is None and has_many_vectors(b) and keeps_loops(b.algebra) and grades_of(b.blades) == {2}:
        return versor_exponential(b)
    if form is None:
        return exponential_by_squaring(b)
    even, odd = even_and_odd(b, form)
    return even + odd


def even_and_odd(b: Any, form: Form, sign: int = 1) -> tuple[Any, Any]:
    """Return the parts of ``exp(b)`` with even and odd powers of `b`; for the sign -1, with alternating signs.

    These are ``cosh b`` and ``sinh b``, or ``cos b`` and ``sin b``, for an element without scalar part of this form.
    """
    square = b * b if sign == 1 else -(b * b)
    s = 0 if form.s.zero else square["1"]
    circle = circle_of(b, form)
    if circle is not None and sign == 1:
        angle, blade = circle
        return cos(angle), sin(angle) * blade
    length = length_of(b, form)
    if sign == -1:
        first, second = _negated(form.second), _negated(form.first)
        form = replace(form, s=_negated(form.s), first=first, second=second)
    if not form.rest:
        cosine, sine = circular(s, form.s, form.vanishing, length)
        return cosine, sine * b
    p = square.grade(*form.rest) / 2
    if form.q.zero:
        f, g = _with_null_square(s, length, form)
    else:
        f, g = _of_two_numbers(s, (p * p)["1"], form)
    return f[0] + f[1] * p, g[0] * b + _kept(g[1] * p * b, b)


def _negated(signs: Signs) -> Signs:
    return Signs(signs.positive, signs.negative)


def _kept(product: Any, b: Any) -> Any:
    """Return the part of `product` of the grades of `b`; the other parts cancel mathematically."""
    return product.grade(*sorted({blade.bit_count() for blade in blades_of(b)}))


def length_of(b: Any, form: Form) -> Value | None:
    """Return a square root of ``s`` or ``-s``, of either sign, if it is a coefficient of `b`; else None."""
    return None if form.axis is None else b.coefficient_at(form.axis)


def circle_of(b: Any, form: Form) -> tuple[Value, Multivector] | None:
    """Return the coefficient and the blade if `b` is a multiple of a basis blade with the square -1; else None."""
    if form.axis is None or not form.s.negative or blades_of(b) != {form.axis}:
        return None
    return b.coefficient_at(form.axis), Multivector(b.algebra, {form.axis: 1})


def circular(x: Value, signs: Signs, vanishing: bool = True, length: Value | None = None) -> Pair:
    """Return ``C(x)`` and ``S(x)``, where `x` has the given signs.

    If `x` can vanish although it is not a sum of squares (`vanishing`), its first derivative there is not 0, and both
    functions are computed by polynomials, with correct derivatives. `length` is a known square root of `x` or ``-x``.
    """
    if signs.zero:
        return 1, 1
    if not signs.positive and not vanishing:
        tiny = -x < NEARLY_ZERO
        if length is not None:
            return cos(length), select(tiny, 1, sin(length) / select(tiny, ONE, length))
        u = sqrt(select(tiny, ONE, -x))
        return select(tiny, 1, cos(u)), select(tiny, 1, sin(u) / u)
    size = absolute(x) if signs.both else x if signs.positive else -x
    small = size < SMALL
    near = select(small, x, 0)
    sine_near = polynomial(_SINES[:_TERMS], near)
    cosine_near = sqrt(1 + near * sine_near * sine_near)
    u = sqrt(select(small, ONE, size)) if length is None else select(small, ONE, length)
    if signs.positive:
        grown = exp(select(x < 0, 0, u) if signs.negative else u)
        cosine, sine = (grown + 1 / grown) / 2, (grown - 1 / grown) / 2
    if signs.both:
        cosine, sine = select(x < 0, cos(u), cosine), select(x < 0, sin(u), sine)
    elif signs.negative:
        cosine, sine = cos(u), sin(u)
    return select(small, cosine_near, cosine), select(small, sine_near, sine / u)


def polynomial(coefficients: Sequence[Fraction], x: Value) -> Value:
    """Evaluate ``c0 + c1 x + ...`` by Horner's rule."""
    value: Value = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = value * x + coefficient
    return value


def polynomial_of_pair(coefficients: Sequence[Fraction], x: Pair, square: Value) -> Pair:
    """Evaluate ``c0 + c1 z + ...`` for the number ``z = x[0] + x[1] p`` with ``p p = square``."""
    a, b = coefficients[-1] * x[0] + coefficients[-2], coefficients[-1] * x[1]
    for coefficient in coefficients[-3::-1]:
        a, b = a * x[0] + b * x[1] * square + coefficient, a * x[1] + b * x[0]
    return a, b


def _with_null_square(s: Value, length: Value | None, form: Form) -> tuple[Pair, Pair]:
    """Return ``F`` and ``G`` if ``p p`` is always 0, so that one of the commuting parts has the square 0."""
    if form.s.zero:
        return (1, 1), (1, Fraction(1, 3))
    cosine, sine = circular(s, form.s, form.vanishing, length)
    g1 = divided(cosine - sine, s, form.s, Fraction(1, 3))
    if form.nilpotent:
        near = absolute(s) < SMALL
        g1 = select(near, polynomial_of_pair(_SINES[:_TERMS], (select(near, s, 0), 2), 0)[1], g1)
    return (cosine, sine), (sine, g1)


def divided(difference: Value, s: Value, signs: Signs, limit: Fraction) -> Value:
    """Return ``difference / s``, or its limit where `s`, of the given signs, is 0 up to rounding."""
    if not signs.positive:
        tiny = -s < NEARLY_ZERO
        return select(tiny, limit, -difference / select(tiny, ONE, -s))
    tiny = (absolute(s) if signs.negative else s) < NEARLY_ZERO
    return select(tiny, limit, difference / select(tiny, ONE, s))


def _of_two_numbers(s: Value, p2: Value, form: Form) -> tuple[Pair, Pair]:
    """Return ``F`` and ``G`` of ``s + 2 p`` with ``p p = p2``."""
    q2 = 4 * p2
    near = maximum(s * s, 2 * absolute(q2)) < NEAR if form.nilpotent else 0
    isoclinic = maximum(s * s, NEAR if form.nilpotent else 2 * TINY) < 2 * q2 if form.isoclinic else 0
    square = select(isoclinic, q2, s * s - q2)
    tiny = square < TINY
    root = sqrt(select(tiny, ONE, square))
    difference = select(tiny, 0, root)
    scale = select(isoclinic, 1, HALF)
    x1, x2 = scale * (s + difference), scale * (s - difference)
    c1, s1 = circular(x1, form.first)
    c2, s2 = circular(x2, form.second)
    g1 = select(tiny, Fraction(1, 3), select(isoclinic, s1 - s2, c1 * s2 - c2 * s1) / root)
    g0 = select(isoclinic, (s1 + s2) / 2, c2 * s1 - g1 * x2)
    f0 = select(isoclinic, (c1 + c2) / 2, c1 * c2)
    f1 = select(isoclinic, (c1 - c2) / root, s1 * s2)
    if not form.nilpotent:
        return (f0, f1), (g0, g1)
    z, square = (select(near, s, 0), 2), select(near, p2, 0)
    g = polynomial_of_pair(_SINES, z, square)
    g0, g1 = select(near, g[0], g0), select(near, g[1], g1)
    if form.second.positive:  # x1 and x2 may be complex
        f = polynomial_of_pair(_COSINES, z, square)
        f0, f1 = select(near, f[0], f0), select(near, f[1], f1)
    return (f0, f1), (g0, g1)
