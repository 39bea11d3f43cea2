"""Roots of polynomials of degree 2, 3 and 4 with real coefficients, as functions for kernels.

All three functions return real parts, imaginary parts and the number of real roots. Real roots come first, in ascending
order. They are followed by pairs of conjugates in the order of their real parts, the root with the positive imaginary
part first, and by zeros in place of roots that are missing because leading coefficients vanish. Depending on rounding,
a double root is returned as two real roots or as a pair of conjugates, so the number of real roots is as uncertain as
the sign of a discriminant.

The measure of errors is the backward error, the residual ``|p(x)|`` divided by the sum of ``|a_k x**k|``. Roots are
computed to the accuracy that is determined by the rounded coefficients: a double root to half of the digits.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from ..algebra.coefficients import divide
from .equations import nonzero
from .operands import check_scalars
from .operations import absolute, equal, exp, log, maximum, minimum, select, sqrt

Vector = tuple[Any, ...]
Roots = tuple[Vector, Vector, Any]
Pair = tuple[Vector, Any, Any]
Rated = tuple[Vector, Vector, Any]
HALF, THIRD = Fraction(1, 2), Fraction(1, 3)

_START = tuple(Fraction(n, 10**5) for n in (173213, 33066, -8138, 1864))
"""Coefficients of the initial guess of `separated_root`, with an error of at most 1e-4."""
POLISH = 2
"""Number of Newton steps on a root of a cubic; a step is accepted only if it reduces the residual."""
NEAR = 64
"""If a root of the resolvent is smaller by this factor than the coefficient it is compared with, roots nearly coincide.

In this case three or four roots of the quartic are close to each other.
"""


def quadratic_roots(a: Any, b: Any, c: Any) -> Roots:
    """Compute the roots of ``a x**2 + b x + c``.

    Parameters
    ----------
    a, b, c : scalar
        Any of them may be 0. Squares and products of two coefficients must not overflow.

    Returns
    -------
    real : 2 scalars
    imaginary : 2 scalars
        Real and imaginary parts, in the order described in `gacompiler.frontend.roots`.
    number : scalar
        The number of real roots: 2, 1 if `a` is 0, or 0.

    Notes
    -----
    The root farther from 0 is computed by the formula without cancellation, and the other from the product of the roots
    (Higham, *Accuracy and Stability of Numerical Algorithms*, 1.8). Residuals are below 4e-16 of the terms, for
    coefficients of any magnitude.
    """
    check_scalars("quadratic_roots()", a, b, c)
    (low, high), half_width, number = _quadratic(a, b, c)
    return (low, high), (half_width, -half_width), number


def _quadratic(a: Any, b: Any, c: Any) -> Pair:
    """Return the real parts, the non-negative imaginary part, and the number of real roots.

    The real parts are in ascending order, followed by 0 for a missing root.
    """
    half = b * HALF
    discriminant = half * half - a * c
    root = sqrt(absolute(discriminant))
    is_real = discriminant >= 0
    q = -half - select(half < 0, -root, root)
    far, near = divide(q, nonzero(a)), divide(c, nonzero(q))
    middle = divide(-half, nonzero(a))
    is_linear = equal(a, 0)
    is_constant = equal(b, 0)
    first = select(is_linear, select(is_constant, 0, near), select(is_real, minimum(far, near), middle))
    second = select(is_linear, 0, select(is_real, maximum(far, near), middle))
    width = select(is_real, 0, absolute(divide(root, nonzero(a))))
    number = select(is_linear, 1 - is_constant, select(is_real, 2, 0))
    return (first, second), width, number


def separated_root(r: Any) -> Any:
    """Return the largest root ``2 cos(acos(r) / 3)`` of ``t**3 - 3 t - 2 r`` for r in [0, 1]; it is in [sqrt(3), 2].

    It is a simple root for every r, so two Newton steps from a cubic polynomial in r reach double precision.
    """
    a, b, c, d = _START
    t = a + r * (b + r * (c + r * d))
    for _ in range(2):
        square = t * t
        t = Fraction(2, 3) * divide(square * t + r, square - 1)
    return t


def cubic_roots(a: Any, b: Any, c: Any, d: Any) -> Roots:
    """Compute the roots of ``a x**3 + b x**2 + c x + d``.

    Parameters
    ----------
    a, b, c, d : scalar
        Any of them may be 0. Cubes of ``b / a`` and of similar quotients must not overflow.

    Returns
    -------
    real : 3 scalars
    imaginary : 3 scalars
        Real and imaginary parts, in the order described in `gacompiler.frontend.roots`.
    number : scalar
        The number of real roots: 3 or 1; for a polynomial of lower degree 2, 1 or 0.

    Notes
    -----
    The root farthest from the mean is computed in closed form and refined by Newton's method. The other two are roots
    of the quotient, whose coefficients are computed from the end without cancellation (Kahan, *To Solve a Real Cubic
    Equation*, 1986). Residuals are below 6e-16 of the terms if the magnitudes of the roots differ by factors up to
    1e16, and below 2e-15 beyond.
    """
    check_scalars("cubic_roots()", a, b, c, d)
    root, quotient = _split_cubic(a, b, c, d)
    return _with_root(root, 1 - equal(a, 0), *_quadratic(*quotient))


def _with_root(root: Any, is_there: Any, others: Vector, width: Any, number: Any) -> Roots:
    """Return the roots of a cubic from a real root, which may be missing, and the roots of the quotient."""
    (low, high), has_pair = others, width > 0
    upper = maximum(root, low)
    three = minimum(root, low), minimum(upper, high), maximum(upper, high)
    three = _selected(has_pair, (root, low, high), three)
    return (
        _selected(is_there, three, (low, high, 0)),
        _selected(is_there, (0, width, -width), (width, -width, 0)),
        number + is_there,
    )


def _selected(condition: Any, a: Sequence[Any], b: Sequence[Any]) -> Vector:
    return tuple(select(condition, x, y) for x, y in zip(a, b, strict=True))


def _polynomial(coefficients: Sequence[Any], x: Any) -> Any:
    """Evaluate a polynomial by Horner's scheme, with the leading coefficient first."""
    value = coefficients[0]
    for coefficient in coefficients[1:]:
        value = value * x + coefficient
    return value


def _split_cubic(a: Any, b: Any, c: Any, d: Any) -> tuple[Any, Vector]:
    """Return a real root of a cubic and the quadratic quotient; for a polynomial of degree 2 or less, 0 and itself."""
    unit = divide(1, nonzero(a))
    shift = -b * unit * THIRD
    p = c * unit - 3 * shift * shift
    q = _polynomial((1, b * unit, c * unit, d * unit), shift)
    x = shift + _depressed_cubic_root(p, q)
    value = _polynomial((a, b, c, d), x)
    for _ in range(POLISH):
        derivative = _polynomial((3 * a, 2 * b, c), x)
        trial = x - divide(value, nonzero(derivative))
        found = _polynomial((a, b, c, d), trial)
        is_better = absolute(found) < absolute(value)
        x, value = select(is_better, trial, x), select(is_better, found, value)
    x = select(equal(d, 0), 0, x)
    is_far = absolute(d) < absolute(a * x * x * x)
    from_end = -divide(d, nonzero(x))
    from_start = a * x + b
    f = select(is_far, divide(from_end - c, nonzero(x)), from_start)
    g = select(is_far, from_end, from_start * x + c)
    is_lower = equal(a, 0)
    return select(is_lower, 0, x), _selected(is_lower, (b, c, d), (a, f, g))


def _depressed_cubic_root(p: Any, q: Any) -> Any:
    """Return the real root of ``t**3 + p t + q`` farthest from 0, which is not close to another unless all are 0."""
    sign = select(q < 0, -1, 1)
    third, half = p * THIRD, sign * q * HALF
    size = sqrt(absolute(third))
    cube = size * size * size
    # One real root: Cardano's formula as a quotient, without cancellation. Only cubes can overflow.
    largest = nonzero(maximum(half, cube))
    x, y = divide(half, largest), divide(cube, largest)
    total = half + largest * sqrt(select(third < 0, maximum(x - y, 0) * (x + y), x * x + y * y))
    edge = exp(log(nonzero(total)) * THIRD)
    ratio = divide(third, edge)
    single = divide(2 * half, edge * edge + third + ratio * ratio)
    three = size * separated_root(minimum(x, 1))  # where y is 1, so that x is their ratio
    t = select(third < 0, select(half < cube, three, single), single)
    return -sign * t


def quartic_roots(a: Any, b: Any, c: Any, d: Any, e: Any) -> Roots:
    """Compute the roots of ``a x**4 + b x**3 + c x**2 + d x + e``.

    Parameters
    ----------
    a, b, c, d, e : scalar
        Any of them may be 0. Sixth powers of ``b / a`` and of similar quotients must not overflow.

    Returns
    -------
    real : 4 scalars
    imaginary : 4 scalars
        Real and imaginary parts, in the order described in `gacompiler.frontend.roots`.
    number : scalar
        The number of real roots: 4, 2 or 0; for a polynomial of lower degree, that of the function for this degree.

    Notes
    -----
    The quartic is split into two quadratic factors, real or conjugate, with a root of Ferrari's resolvent that is not
    close to another (after Orellana and De Michele, *Algorithm 1010: Boosting Efficiency in Solving Quartic Equations
    with No Compromise in Accuracy*, 2020). A Newton step on the coefficients of the factors follows.

    Residuals were measured on 10000 polynomials of each kind. They are below 1e-15 of the terms if the roots are
    separate and their magnitudes differ by factors up to 1e6, and if all four are equal. If some roots nearly coincide,
    magnitudes differ by factors up to 1e16, or `a` is 1e-12 of the other coefficients, they are below 1e-13 for 99 of
    100 polynomials. The worst residuals are 1e-11 for two double roots, 1e-10 for four close roots, and 1e-3 or no
    correct digit for magnitudes that are far apart.
    """
    check_scalars("quartic_roots()", a, b, c, d, e)
    is_lower = equal(a, 0)
    unit = divide(1, nonzero(a))
    monic = (b * unit, c * unit, d * unit, e * unit)
    # Both the resolvent of a quartic and a polynomial of lower degree need a real root of a cubic and the quotient.
    root, quotient = _split_cubic(*_selected(is_lower, (b, c, d, e), _resolvent(*monic)))
    is_real, (p, q, r, s), conjugate = _factors(monic, root)
    second = _quadratic(*_selected(is_lower, quotient, (1, r, s)))
    real, imaginary, number = _joined(_quadratic(1, p, q), second)
    pairs_real, pairs_imaginary = _conjugate_pairs(*conjugate)
    lower_real, lower_imaginary, lower_number = _with_root(root, 1 - equal(b, 0), *second)
    return (
        _selected(is_lower, (*lower_real, 0), _selected(is_real, real, pairs_real)),
        _selected(is_lower, (*lower_imaginary, 0), _selected(is_real, imaginary, pairs_imaginary)),
        select(is_lower, lower_number, select(is_real, number, 0)),
    )


def _joined(first: Pair, second: Pair) -> Roots:
    """Return the roots of a quartic from those of two monic quadratic factors."""
    (a, b), u, m = first
    (c, d), v, n = second
    third, fourth = maximum(a, c), minimum(b, d)
    four = minimum(a, c), minimum(third, fourth), maximum(third, fourth), maximum(b, d)
    swap = select(v > 0, select(u > 0, c < a, 0), u > 0)
    real = _selected(swap, (c, d, a, b), (a, b, c, d))
    imaginary = _selected(swap, (v, -v, u, -u), (u, -u, v, -v))
    return _selected(equal(m + n, 4), four, real), imaginary, m + n


def _resolvent(a: Any, b: Any, c: Any, d: Any) -> Vector:
    """Return the cubic with the roots ``x y + z w`` minus their mean, for the roots x, y, z, w of a monic quartic."""
    middle = a * c
    p = middle - 4 * d - b * b * THIRD
    q = (8 * d + middle - 2 * b * b * Fraction(1, 9)) * b * THIRD - c * c - a * a * d
    return 1, 0, p, q


def _factors(monic: Vector, root: Any) -> tuple[Any, Vector, Vector]:
    """Return two factors of a monic quartic from a root of its resolvent: whether they are real, and two forms.

    The linear and constant coefficients of the factors are ``a/2 +- x`` and ``y +- z``. The first form, valid if x and
    z are real, is (p, q, r, s) for ``t**2 + p t + q`` and ``t**2 + r t + s``. The second form, valid if x and z are
    imaginary and the factors conjugate, is (a/2, x, y, z).
    """
    a, _, c, d = monic
    mean = a * HALF
    first, middle, mixed, last = _squares(monic, root)
    # Both squares have the same sign; it is taken from the one with the smaller relative rounding error.
    weight = middle * middle + absolute(d), absolute(first - root) + absolute(root)
    is_real = select(absolute(last) * weight[1] < absolute(first) * weight[0], first, last) >= 0
    sign = select(is_real, 1, -1)
    mixed = sign * mixed
    x, z = sqrt(maximum(sign * first, 0)), sqrt(maximum(sign * last, 0))
    z = select(mixed < 0, -z, z)
    weights = _weights(monic, (mean + x, middle + z, mean - x, middle - z))
    choices = [
        (_misfit(monic, weights, sign, (middle, *choice)), choice)
        for choice in ((x, z), (x, divide(mixed, nonzero(x))), (divide(mixed, nonzero(z)), z))
    ]
    misfit, best = choices[0]
    for other, choice in choices[1:]:
        best, misfit = _selected(misfit <= other, best, choice), minimum(misfit, other)
    x, z = best
    flip = select(middle * z < 0, -1, 1)  # the first factor gets the larger constant coefficient
    p, q, r = mean + flip * x, middle + flip * z, mean - flip * x
    s = divide(d, nonzero(q))
    start = _better(
        _rated(monic, weights, (p, q, r, s)),
        _rated(monic, weights, (p, q, divide(c - p * s, nonzero(q)), s)),
    )
    (p, q, r, _), _, _ = _better(start, _rated(monic, weights, _step(*start[:2])))
    r = select(equal(d, 0), divide(c, nonzero(q)), r)  # roots that are 0 are exact
    return is_real, (p, q, r, divide(d, nonzero(q))), (mean, x, middle, z)


def _squares(monic: Vector, root: Any) -> Vector:
    """Return ``x**2``, y, ``x z`` and ``z**2`` of the factors in `_factors`, for a root of the resolvent.

    By the resolvent, the square of the third is the product of the first and the last. If all its roots are close to 0,
    they are accurate only to a third of the digits; a step of Laguerre's method on this form of the resolvent restores
    the lost digits.
    """
    a, b, c, d = monic
    mean = a * HALF
    free = mean * mean - Fraction(2, 3) * b

    def squares(root: Any) -> Vector:
        middle = (b * THIRD + root) * HALF
        return free + root, middle, (a * middle - c) * HALF, middle * middle - d

    first, middle, mixed, last = before = squares(root)
    value = first * last - mixed * mixed
    derivative = last + first * middle - mean * mixed
    curvature = 2 * middle + (first - mean * mean) * HALF
    length = sqrt(maximum(4 * derivative * derivative - 6 * value * curvature, 0))
    length = select(derivative < 0, -length, length)
    after = squares(root - divide(3 * value, nonzero(derivative + length)))
    found = after[0] * after[3] - after[2] * after[2]
    is_better = select(NEAR * absolute(root) < absolute(b), absolute(found) < absolute(value), 0)
    return _selected(is_better, after, before)


def _misfit(monic: Vector, weights: Vector, sign: Any, found: Vector) -> Any:
    """Return the misfit of the product of the factors in `_factors`; `sign` is that of their squares."""
    a, b, c, d = monic
    y, x, z = found
    lack_b = b - a * a * Fraction(1, 4) + sign * x * x - 2 * y
    lack_c = c - a * y + 2 * sign * x * z
    lack_d = d - y * y + sign * z * z
    return absolute(lack_b) * weights[1] + absolute(lack_c) * weights[2] + absolute(lack_d) * weights[3]


def _conjugate_pairs(a: Any, b: Any, c: Any, d: Any) -> tuple[Vector, Vector]:
    """Return the roots of ``t**2 + (a + i b) t + (c + i d)`` and of the conjugate polynomial."""
    a, b = a * HALF, b * HALF
    e, f = a * a - b * b - c, 2 * a * b - d
    largest = nonzero(maximum(absolute(e), absolute(f)))
    scaled = divide(e, largest), divide(f, largest)
    long = sqrt((largest * sqrt(scaled[0] * scaled[0] + scaled[1] * scaled[1]) + absolute(e)) * HALF)
    short = divide(f * HALF, nonzero(long))
    is_right = e >= 0
    u, v = select(is_right, long, short), select(is_right, short, long)  # the root of the discriminant
    sign = select(a * u + b * v < 0, 1, -1)
    x, y = sign * u - a, sign * v - b
    scale = divide(1, nonzero(x * x + y * y))
    m, n = (c * x + d * y) * scale, absolute(d * x - c * y) * scale
    y = absolute(y)
    swap = m < x
    return _selected(swap, (m, m, x, x), (x, x, m, m)), _selected(swap, (n, -n, y, -y), (y, -y, n, -n))


def _weights(monic: Vector, factors: Vector) -> Vector:
    """Return the reciprocals of the magnitudes of the terms of each coefficient of the product of two factors."""
    a, b, c, d = map(absolute, monic)
    p, q, r, s = map(absolute, factors)
    sizes = a + p + r, b + q + s + p * r, c + p * s + q * r, d + q * s
    return tuple(divide(1, nonzero(size)) for size in sizes)


def _rated(monic: Vector, weights: Vector, factors: Vector) -> Rated:
    """Return the factors, the difference of the quartic and their product, and the sum of its relative magnitudes."""
    a, b, c, d = monic
    p, q, r, s = factors
    lack = (a - p - r, b - q - s - p * r, c - p * s - r * q, d - q * s)
    misfit: Any = 0
    for x, weight in zip(lack, weights, strict=True):
        misfit = misfit + absolute(x) * weight
    return factors, lack, misfit


def _better(a: Rated, b: Rated) -> Rated:
    """Return the factors with the smaller misfit."""
    keep = a[2] <= b[2]
    return _selected(keep, a[0], b[0]), _selected(keep, a[1], b[1]), minimum(a[2], b[2])


def _step(factors: Vector, lack: Vector) -> Vector:
    """Return the factors after a Newton step; the determinant of its equations is the resultant of the factors."""
    p, q, r, s = factors
    h, k, m, n = lack
    k = k - p * h
    m, n = m - p * k - q * h, n - q * k
    u, v = p - r, q - s
    w = p * u - v
    scale = divide(1, nonzero(v * w - u * u * q))
    dp = (v * m - u * n) * scale
    dq = (u * q * m - w * n) * scale
    return p + dp, q + dq, r + h - dp, s + k - dq + u * dp
