"""Exponentials by closed forms in one or two numbers; `gacompiler.frontend.scaling` has those without.

With the notation of `gacompiler.frontend.squares`: ``exp(b) = C(s) + S(s) b`` where the square is a scalar, with

    C(x) = cosh(sqrt x) = cos(sqrt -x),    S(x) = sinh(sqrt x)/sqrt x = sin(sqrt -x)/sqrt -x,

and ``exp(b) = F0 + F1 p + (G0 + G1 p) b`` where it is ``s + 2 p``. With ``P = p p`` the squares of the two commuting
parts of `b` are ``x = (s +- sqrt(s**2 - 4 P))/2`` and give

    F0 = C1 C2,  F1 = S1 S2,  G1 = (C1 S2 - C2 S1)/(x1 - x2),  G0 = C2 S1 - x2 G1;

the eigenvalues ``y = s +- 2 sqrt P = (sqrt x1 +- sqrt x2)**2`` of the square give

    F0 = (C+ + C-)/2,  F1 = (C+ - C-)/(2 sqrt P),  G0 = (S+ + S-)/2,  G1 = (S+ - S-)/(2 sqrt P).

The first form loses digits where ``x1 = x2`` (isoclinic rotations), the second where one part vanishes; both lose none
where ``P`` lies between, so that ``8 P > s**2`` decides. Where `p` can be a null element (five basis vectors that are
not all of one sign, or several null ones) it can be large although ``s`` and ``P`` are mere rounding; there power
series in ``s + 2 p`` are used near 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import factorial
from typing import Any

from ..algebra.multivector import Multivector
from ..algebra.signs import Signs
from .operations import absolute, cos, exp, maximum, select, sin, sqrt
from .scaling import exponential_by_squaring
from .squares import Form, Value, blades_of, form_of

NEARLY_ZERO = Fraction(1, 10**18)
"""Squares below this are 0 to rounding, for functions that begin with ``1 + x / 6``."""
TINY = NEARLY_ZERO**2
ONE = 1.0
"""What functions are given where their value is not used; a float, so that they have a value also outside kernels."""
SMALL = Fraction(1, 4)
"""Up to here ``S`` is a polynomial, because ``exp(u) - exp(-u)`` loses the digits of a small u."""
NEAR = Fraction(1, 8)
"""Up to here ``s**2`` and ``8 P`` are small: the eigenvalues are below 0.61."""
HALF = Fraction(1, 2)

# Enough for `NEAR`; further denominators would be larger than 2**53, and the text would hold rounded numbers.
_SINES = tuple(Fraction(1, factorial(2 * k + 1)) for k in range(9))
_COSINES = tuple(Fraction(1, factorial(2 * k)) for k in range(10))
_TERMS = 7
"""Enough for `SMALL`."""

Pair = tuple[Value, Value]
"""The number ``a + b p``."""


def exponential(b: Any) -> Any:
    """``exp(b)`` of an element without scalar part."""
    form = form_of(b.algebra, blades_of(b))
    if form is None:
        return exponential_by_squaring(b)
    square = b * b
    s = 0 if form.s.zero else square["1"]
    circle = circle_of(b, form)
    if circle is not None:
        angle, blade = circle
        return cos(angle) + sin(angle) * blade
    if not form.rest:
        cosine, sine = circular(s, form.s, form.vanishing, length_of(b, form))
        return cosine + sine * b
    p = square.grade(*form.rest) / 2
    if form.q.zero:
        f, g = _with_null_square(s, length_of(b, form), form)
    else:
        f, g = _of_two_numbers(s, (p * p)["1"], form)
    return f[0] + f[1] * p + g[0] * b + _kept(g[1] * p * b, b)


def _kept(product: Any, b: Any) -> Any:
    """The part of `product` of the grades of `b`, which is all there is: the rest of it cancels."""
    return product.grade(*sorted({blade.bit_count() for blade in blades_of(b)}))


def length_of(b: Any, form: Form) -> Value | None:
    """A root of ``s`` or ``-s`` where that needs no root, of either sign."""
    return None if form.axis is None else b[form.axis]


def circle_of(b: Any, form: Form) -> tuple[Value, Multivector] | None:
    """Coefficient and blade where `b` is a multiple of one basis blade with the square -1."""
    if form.axis is None or not form.s.negative or blades_of(b) != {form.axis}:
        return None
    return b[form.axis], Multivector(b.algebra, {form.axis: 1})


def circular(x: Value, signs: Signs, vanishing: bool = True, length: Value | None = None) -> Pair:
    """``C(x)`` and ``S(x)``, where `x` has the given signs.

    Where `x` can vanish otherwise than as a sum of squares (`vanishing`), its first derivative there is not 0, and
    polynomials give both functions with their derivatives. `length` is a root of `x` or of ``-x``, where one is known.
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
    """``c0 + c1 x + ...`` by Horner's rule."""
    value: Value = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = value * x + coefficient
    return value


def polynomial_of_pair(coefficients: Sequence[Fraction], x: Pair, square: Value) -> Pair:
    """``c0 + c1 z + ...`` of the number ``z = x[0] + x[1] q`` with ``p p = square``."""
    a, b = coefficients[-1] * x[0] + coefficients[-2], coefficients[-1] * x[1]
    for coefficient in coefficients[-3::-1]:
        a, b = a * x[0] + b * x[1] * square + coefficient, a * x[1] + b * x[0]
    return a, b


def _with_null_square(s: Value, length: Value | None, form: Form) -> tuple[Pair, Pair]:
    """``F`` and ``G`` where ``p p`` is always 0: one of the commuting parts has square 0."""
    if form.s.zero:
        return (1, 1), (1, Fraction(1, 3))
    cosine, sine = circular(s, form.s, form.vanishing, length)
    slope = divided(cosine - sine, s, form.s, Fraction(1, 3))
    if form.nilpotent:
        near = absolute(s) < SMALL
        slope = select(near, polynomial_of_pair(_SINES[:_TERMS], (select(near, s, 0), 2), 0)[1], slope)
    return (cosine, sine), (sine, slope)


def divided(difference: Value, s: Value, signs: Signs, limit: Fraction) -> Value:
    """``difference / s``, and its limit where `s`, of the given signs, is 0 to rounding."""
    if not signs.positive:
        tiny = -s < NEARLY_ZERO
        return select(tiny, limit, -difference / select(tiny, ONE, -s))
    tiny = (absolute(s) if signs.negative else s) < NEARLY_ZERO
    return select(tiny, limit, difference / select(tiny, ONE, s))


def _of_two_numbers(s: Value, p2: Value, form: Form) -> tuple[Pair, Pair]:
    """``F`` and ``G`` of ``s + 2 p`` with ``p p = p2``."""
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
    if form.second.positive:  # then x1 and x2 need not be real
        f = polynomial_of_pair(_COSINES, z, square)
        f0, f1 = select(near, f[0], f0), select(near, f[1], f1)
    return (f0, f1), (g0, g1)
