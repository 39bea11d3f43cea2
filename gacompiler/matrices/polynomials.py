"""Roots of polynomials in kernels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from ..frontend.equations import nonzero
from ..frontend.functions import exp, log, sqrt
from ..frontend.loops import each, fold, iterate, total
from ..frontend.operations import absolute, cos, equal, select, sin
from ..frontend.searches import row_numbers

MOST_STEPS = 1000
"""Maximum number of steps. About ten suffice for roots of similar absolute values."""
TURN = 6.283185307179586
OFFSET = 0.7
"""Angle of the first initial guess. Guesses that are symmetric to the real axis would remain so."""


class Complex(NamedTuple):
    """A complex number."""

    real: Any
    imaginary: Any


def complex_product(a: Complex, b: Complex) -> Complex:
    """Return the product of two complex numbers."""
    return Complex(a.real * b.real - a.imaginary * b.imaginary, a.real * b.imaginary + a.imaginary * b.real)


def roots(coefficients: Any) -> tuple[Any, Any, Any, Any]:
    """Compute the roots of a polynomial with real coefficients whose first coefficient is 1.

    Parameters
    ----------
    coefficients : array of scalars, (n)
        The other coefficients, from that of ``x**(n - 1)`` to the constant one. They are also the negated first row of
        the companion matrix, whose eigenvalues are the roots.

    Returns
    -------
    real, imaginary : arrays of scalars, (n)
        The roots in no particular order; the imaginary parts of real roots are 0.
    n_real : scalar
        The number of real roots.
    converged : scalar
        1 if the value of the polynomial at every root is rounding, else 0.

    Notes
    -----
    All roots are improved at the same time (Aberth), from points on a circle, until the value of the polynomial is at
    most its rounding error. The roots are therefore exact for a polynomial whose coefficients differ by about 1e-15 of
    their own values: errors of simple roots are near 1e-16 times their condition number, and those of a root of
    multiplicity k near the k-th root of 1e-16. A root is real if no other one is nearer to its conjugate, so that
    rounding can make a double root a pair of conjugates. The powers of the roots up to the n-th must not overflow.
    """
    numbers = row_numbers(coefficients)
    n = total(lambda _: 1, numbers)
    guesses = _guesses(coefficients, numbers, n)

    def step(state: Any) -> Any:
        return aberth_step(state[0], numbers, lambda z: _values(coefficients, z), 4 * n)

    (points, _), converged, _ = iterate(step, (guesses, n), lambda _, new: new[1] <= 0, at_most=MOST_STEPS)

    def is_real(z: Any, i: Any) -> Any:
        def is_conjugate(other: Any, j: Any) -> Any:
            x, y = z[0] - other[0], z[1] + other[1]
            return select(equal(i, j), 0, x * x + y * y < 4 * z[1] * z[1])

        return select(total(is_conjugate, points, numbers) > 0, 0, 1)

    reals = each(is_real, points, numbers)
    imaginary = each(lambda z, real: select(real, 0, z[1]), points, reals)
    return each(lambda z: z[0], points), imaginary, total(lambda x: x, reals), converged


def _positive(square: Any) -> Any:
    """Return a square, or 1 where it is 0, as a safe divisor."""
    return select(square > 0, square, 1)


def aberth_step(
    points: Any, numbers: Any, values: Callable[[Complex], tuple[Complex, Complex, Any]], parts: Any
) -> Any:
    """Return points after a step of Aberth's method towards the roots of a function, and how many of them moved.

    Parameters
    ----------
    points : array of two scalars, (n)
        Their real and imaginary parts.
    numbers : array of scalars, (n)
        The indices from 0 to n - 1.
    values : callable
        Function from a complex number to the value, its derivative, and the sum of the absolute values of its terms.
    parts : scalar
        A point is a root if the value, divided by this number, is below the rounding errors of that sum.
    """

    def moved(z: Any, i: Any) -> Any:
        z = Complex(*z)
        value, slope, bound = values(z)
        is_root = equal(bound + (absolute(value.real) + absolute(value.imaginary)) / parts, bound)

        def inverse(other: Any, j: Any) -> Any:
            x, y = z.real - other[0], z.imaginary - other[1]
            square = select(equal(i, j), 0, x * x + y * y)
            is_apart, safe = square > 0, _positive(square)
            return select(is_apart, x, 0) / safe, select(is_apart, -y, 0) / safe

        others = complex_product(value, Complex(*total(inverse, points, numbers)))
        x, y = slope.real - others.real, slope.imaginary - others.imaginary
        square = _positive(x * x + y * y)
        along = (value.real * x + value.imaginary * y) / square, (value.imaginary * x - value.real * y) / square
        return tuple(select(is_root, at, at - step) for at, step in zip(z, along, strict=True)), select(is_root, 0, 1)

    found, changes = each(moved, points, numbers)
    return found, total(lambda x: x, changes)


def _guesses(coefficients: Any, numbers: Any, n: Any) -> Any:
    """Return points on a circle whose radius is the geometric mean of the roots that are not 0, and zeros for those."""

    def last(state: Any, c: Any, i: Any) -> Any:
        found, order = state
        return select(equal(c, 0), found, absolute(c)), select(equal(c, 0), order, i + 1)

    constant, order = fold(last, (1, 0), coefficients, numbers)
    radius = exp(log(constant) / nonzero(order))

    def guess(i: Any) -> Any:
        angle, length = OFFSET + TURN * i / n, select(i < order, radius, 0)
        return length * cos(angle), length * sin(angle)

    return each(guess, numbers)


def _values(coefficients: Any, z: Any) -> tuple[Any, Any, Any]:
    """Return the value of the polynomial, its derivative, and the sum of the absolute values of its terms."""
    size = sqrt(z.real * z.real + z.imaginary * z.imaginary)

    def horner(state: Any, c: Any) -> Any:
        value, slope, bound = state
        up, along = complex_product(value, z), complex_product(slope, z)
        return (
            Complex(up.real + c, up.imaginary),
            Complex(along.real + value.real, along.imaginary + value.imaginary),
            bound * size + absolute(c),
        )

    return fold(horner, (Complex(1, 0), Complex(0, 0), 1), coefficients)  # type: ignore[no-any-return]
