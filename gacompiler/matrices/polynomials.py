"""Roots of polynomials in kernels."""

from __future__ import annotations

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


class _Complex(NamedTuple):
    real: Any
    imaginary: Any


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
        points, _ = state

        def moved(z: Any, i: Any) -> Any:
            value, slope, bound = _values(coefficients, z)
            is_root = equal(bound + (absolute(value.real) + absolute(value.imaginary)) / (4 * n), bound)

            def inverse(other: Any, j: Any) -> Any:
                x, y = z.real - other.real, z.imaginary - other.imaginary
                square = select(equal(i, j), 0, x * x + y * y)
                return _Complex(select(square > 0, x, 0) / nonzero(square), select(square > 0, -y, 0) / nonzero(square))

            others = total(inverse, points, numbers)
            x, y = slope.real - _real(value, others), slope.imaginary - _imaginary(value, others)
            square = nonzero(x * x + y * y)
            change = _Complex(
                (value.real * x + value.imaginary * y) / square, (value.imaginary * x - value.real * y) / square
            )
            return (
                _Complex(
                    select(is_root, z.real, z.real - change.real),
                    select(is_root, z.imaginary, z.imaginary - change.imaginary),
                ),
                select(is_root, 0, 1),
            )

        found, changes = each(moved, points, numbers)
        return found, total(lambda x: x, changes)

    (points, _), converged, _ = iterate(step, (guesses, n), lambda _, new: new[1] <= 0, at_most=MOST_STEPS)

    def is_real(z: Any, i: Any) -> Any:
        def is_conjugate(other: Any, j: Any) -> Any:
            x, y = z.real - other.real, z.imaginary + other.imaginary
            return select(equal(i, j), 0, x * x + y * y < 4 * z.imaginary * z.imaginary)

        return select(total(is_conjugate, points, numbers) > 0, 0, 1)

    reals = each(is_real, points, numbers)
    imaginary = each(lambda z, real: select(real, 0, z.imaginary), points, reals)
    return each(lambda z: z.real, points), imaginary, total(lambda x: x, reals), converged


def _guesses(coefficients: Any, numbers: Any, n: Any) -> Any:
    """Return points on a circle whose radius is the geometric mean of the roots that are not 0, and zeros for those."""

    def last(state: Any, c: Any, i: Any) -> Any:
        found, order = state
        return select(equal(c, 0), found, absolute(c)), select(equal(c, 0), order, i + 1)

    constant, order = fold(last, (1, 0), coefficients, numbers)
    radius = exp(log(constant) / nonzero(order))

    def guess(i: Any) -> Any:
        angle, length = OFFSET + TURN * i / n, select(i < order, radius, 0)
        return _Complex(length * cos(angle), length * sin(angle))

    return each(guess, numbers)


def _real(a: Any, b: Any) -> Any:
    return a.real * b.real - a.imaginary * b.imaginary


def _imaginary(a: Any, b: Any) -> Any:
    return a.real * b.imaginary + a.imaginary * b.real


def _values(coefficients: Any, z: Any) -> tuple[Any, Any, Any]:
    """Return the value of the polynomial, its derivative, and the sum of the absolute values of its terms."""
    size = sqrt(z.real * z.real + z.imaginary * z.imaginary)

    def horner(state: Any, c: Any) -> Any:
        value, slope, bound = state
        return (
            _Complex(_real(value, z) + c, _imaginary(value, z)),
            _Complex(_real(slope, z) + value.real, _imaginary(slope, z) + value.imaginary),
            bound * size + absolute(c),
        )

    return fold(horner, (_Complex(1, 0), _Complex(0, 0), 1), coefficients)  # type: ignore[no-any-return]
