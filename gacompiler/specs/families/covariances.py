"""Covariance matrices in kernels: symmetric matrices by their upper triangles, and Kalman updates of one number."""

from fractions import Fraction

import gacompiler as ga
from gacompiler import absolute

SMALL, FINITE = Fraction(1, 2**1000), 2**60
"""Numbers count as finite if the sum of their absolute values times SMALL is at most FINITE."""
UNMEASURED = 10**30
"""The variance of a number that was not measured: updates with it change nothing."""


def size_of_triangle(n):
    """Return the number of entries on and above the diagonal."""
    return n * (n + 1) // 2


def square(entries, n):
    """Return the rows of a symmetric matrix from its upper triangle."""
    matrix = [[None] * n for _ in range(n)]
    remaining = iter(entries)
    for j in range(n):
        for k in range(j, n):
            matrix[j][k] = matrix[k][j] = next(remaining)
    return matrix


def triangle(matrix):
    """Return the upper triangle of a symmetric matrix, row by row."""
    return tuple(matrix[j][k] for j in range(len(matrix)) for k in range(j, len(matrix)))


def dot(a, b):
    """Return the sum of products; terms with the number 0 are left out."""
    terms = [x * y for x, y in zip(a, b, strict=True) if not (_is_zero(x) or _is_zero(y))]
    return sum(terms[1:], terms[0]) if terms else 0


def _is_zero(x):
    return isinstance(x, int) and x == 0


def cross(a, b):
    """Return the cross product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def congruent(matrix, covariance):
    """Return ``F P F^T`` for the rows of a matrix F and of a symmetric matrix P."""
    n = len(matrix)
    half = [[dot(row, column) for column in covariance] for row in matrix]
    upper = {(j, k): dot(half[j], matrix[k]) for j in range(n) for k in range(j, n)}
    return [[upper[min(j, k), max(j, k)] for k in range(n)] for j in range(n)]


def are_finite(values):
    """Return 1 if all numbers are finite, else 0."""
    return SMALL * sum(map(absolute, values)) <= FINITE


def choose(condition, these, those):
    """Return the numbers `these` where a condition holds, else `those`."""
    return tuple(ga.select(condition, a, b) for a, b in zip(these, those, strict=True))


def measured(state, covariance, row, innovation, variance, corrected=None):
    """Update a state by one measured number ``row . state`` with a variance.

    Parameters
    ----------
    state : sequence
    covariance : rows
    row : sequence
        The derivatives of the measured number with respect to the state.
    innovation : scalar
        The measured number minus the predicted number.
    variance : scalar
    corrected : collection of int, optional
        The components that are corrected. The gain of the others is 0, and the covariance is that of this gain.

    Returns
    -------
    state, covariance, square
        The last is the square of the innovation divided by its variance.
    """
    n = len(state)
    corrected = range(n) if corrected is None else corrected
    side = [dot(row, column) for column in covariance]
    scale = 1 / (dot(row, side) + variance)
    gain = [x * scale if k in corrected else 0 for k, x in enumerate(side)]
    after = [x + gain[k] * innovation if k in corrected else x for k, x in enumerate(state)]
    # If the gain K of j is optimal, K_j S = side_j, and so the Joseph form of an entry (j, k) reduces to one product.
    rows = [list(each) for each in covariance]
    for j in range(n):
        for k in range(j, n):
            if j in corrected:
                rows[j][k] = rows[k][j] = covariance[j][k] - gain[j] * side[k]
            elif k in corrected:
                rows[j][k] = rows[k][j] = covariance[j][k] - gain[k] * side[j]
    return after, rows, innovation * innovation * scale
