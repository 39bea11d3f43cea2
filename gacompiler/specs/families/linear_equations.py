"""Linear equations between normalised coordinates in kernels, and the vector that solves them best.

Points are normalised to mean 0 and mean square d, their number of coordinates (Hartley, *In Defense of the Eight-Point
Algorithm*, 1997). The vector comes from the sums of the products of coefficients, so that all equations are read once,
and is then corrected by the equations, since sums of products have half of the digits.
"""

from fractions import Fraction

from gacompiler import absolute, each, equal, fold, iterate, maximum, select, sqrt, total
from gacompiler.specs.families.covariances import choose, dot, square, triangle
from gacompiler.specs.families.two_views import unit

LEAST_PIVOT = Fraction(1, 2**52)
"""A pivot below this part of the trace is rounding."""
BELOW_ROUNDING = Fraction(1, 10**30)
"""Less than the rounding of a number near 1."""
SINGLE = Fraction(1, 10**8)
"""A matrix is that of one vector, after it is squared, if the others have less than this part of its trace."""
LARGER = Fraction(9, 8)
"""A number is larger than others if it exceeds this multiple of them."""
SQUARINGS = 20
"""A limit on work: the number of squarings separates eigenvalues that differ by a part in 10,000."""
CORRECTED = Fraction(1, 10**30)
"""The square of a correction that is rounding,"""
CORRECTIONS = 5
"""and a limit on work: the number of corrections."""


def normalized(points, dimension):
    """Return points of mean 0 and mean square norm `dimension`, and the similarity that maps the points to them.

    A spread of at most eight roundings of the largest coordinate is not scaled up.
    """
    sums, count = total(lambda p: (tuple(p), 1), points)
    mean = tuple(x / count for x in sums)
    squares = total(lambda p: sum((x - m) * (x - m) for x, m in zip(p, mean, strict=True)), points)
    largest = fold(lambda m, p: _largest(m, p), 0, points)
    spread = sqrt(squares / (count * dimension))
    is_rounding = equal(largest + spread / 16, largest)
    scale = 1 / select(is_rounding, _largest(1, mean), spread)
    return moved_and_scaled(points, mean, scale)


def moved_and_scaled(points, mean, scale):
    """Return points relative to a place, times a scale, and the similarity that maps the points to them."""
    dimension = len(mean)
    shift = tuple(-scale * m for m in mean)
    # Differences from the mean are exact far from the origin, where sums with a shift would round each point.
    moved = each(lambda p: tuple(scale * (x - m) for x, m in zip(p, mean, strict=True)), points)
    rows = [(*(scale if j == i else 0 for j in range(dimension)), shift[i]) for i in range(dimension)]
    return moved, (*rows, (*(0 for _ in range(dimension)), 1))


def _largest(start, numbers):
    for x in numbers:
        start = maximum(start, absolute(x))
    return start


def undone(similarity):
    """Return the inverse of a similarity of the plane."""
    (scale, _, x), (_, _, y), _ = similarity
    return (1 / scale, 0, -x / scale), (0, 1 / scale, -y / scale), (0, 0, 1)


def solution(equations, *rows):
    """Return the unit vector x with the smallest sum of squares of ``a . x``, and the sums of products.

    Parameters
    ----------
    equations : callable
        Function from a row of each array to a sequence of equations a.
    *rows : array
        The arrays over which the sums run.

    Returns
    -------
    vector : tuple of scalar
    table : tuple of scalar
        The upper triangle of the sum of ``a a'``,
    rest : tuple of scalar
        and that of its inverse, in which x has almost no part.
    """

    def products(*own):
        return _sum_of(_products_of(a) for a in equations(*own))

    table = total(products, *rows)
    n = rows_of(len(table))
    start = dominant(inverse_of(table, n), n)
    # Where x solves all equations, the inverse has no digits of other vectors; without x it has.
    rest = inverse_of(without(table, start), n)
    matrix = square(rest, n)

    def corrected(state):
        x = state[:n]

        def gradient(*own):
            return _sum_of([dot(a, x) * b for b in a] for a in equations(*own))

        slope = total(gradient, *rows)
        level = dot(x, slope)
        step = [dot(row, [s - level * y for s, y in zip(slope, x, strict=True)]) for row in matrix]
        along = dot(step, x)
        step = [s - along * y for s, y in zip(step, x, strict=True)]
        return (*unit([y - s for y, s in zip(x, step, strict=True)]), dot(step, step))

    found, _, _ = iterate(corrected, (*start, 1), lambda _, new: new[n] <= CORRECTED, CORRECTIONS)
    # Where equations are few, components are 0 in exact numbers, and rounding would decide what follows from them.
    return tuple(x + (k * k + 1) * BELOW_ROUNDING for k, x in enumerate(found[:n])), table, rest


def rows_of(size):
    """Return the number of rows of a symmetric matrix whose upper triangle has a number of entries."""
    return next(n for n in range(1, size + 1) if n * (n + 1) // 2 == size)


def _products_of(a):
    return [a[j] * a[k] for j in range(len(a)) for k in range(j, len(a))]


def _sum_of(rows):
    first, *others = rows
    for row in others:
        first = [x + y for x, y in zip(first, row, strict=True)]
    return tuple(first)


def inverse_of(table, n):
    """Return the upper triangle of the inverse of a positive semidefinite matrix, whose eigenvalues 0 are rounding.

    The sweep operator (Goodnight 1979) is applied to the first unknown, which then becomes the last, n times.
    """
    least = LEAST_PIVOT * trace(table, n)

    def swept(state):
        matrix = square(state[:-1], n)
        pivot = 1 / maximum(matrix[0][0], least)
        row = [x * pivot for x in matrix[0]]
        rest = [[matrix[j][k] - matrix[0][j] * row[k] for k in range(n)] for j in range(n)]
        order = [*range(1, n), 0]

        def entry(j, k):
            j, k = min(order[j], order[k]), max(order[j], order[k])
            return rest[j][k] if j else row[k] if k else -pivot

        return (*(entry(j, k) for j in range(n) for k in range(j, n)), state[-1] + 1)

    found, _, _ = iterate(swept, (*table, 0), lambda _, new: new[-1] >= n, n)
    return tuple(-x for x in found[:-1])


def trace(table, n):
    """Return the trace of a symmetric matrix from its upper triangle, or 1 for the matrix 0."""
    matrix = square(table, n)
    found = sum((matrix[k][k] for k in range(1, n)), matrix[0][0])
    return select(found > 0, found, 1)


def dominant(table, n):
    """Return the unit eigenvector of the largest eigenvalue of a positive semidefinite matrix.

    The matrix is squared until the other eigenvalues vanish beside it; the number of steps depends on their ratio.
    """

    def squared(state):
        matrix = square(state[:-1], n)
        found = [dot(matrix[j], matrix[k]) for j in range(n) for k in range(j, n)]
        rest = trace(found, n)
        return (*(x / rest for x in found), rest)

    size = trace(table, n)
    start = (*(x / size for x in table), 0)
    found, _, _ = iterate(squared, start, lambda _, new: new[-1] > 1 - SINGLE, SQUARINGS)
    matrix = square(found[:-1], n)
    most, vector = matrix[0][0], matrix[0]
    for k in range(1, n):
        # Any large column will do; a margin keeps rounding from choosing between equal ones.
        is_larger = matrix[k][k] > LARGER * most
        most, vector = select(is_larger, matrix[k][k], most), choose(is_larger, matrix[k], vector)
    return unit(vector)


def without(table, vector):
    """Return a positive semidefinite matrix, with the eigenvector of its least eigenvalue moved to its trace."""
    n = len(vector)
    size = trace(table, n)
    scaled = [size * x for x in vector]
    matrix = square(table, n)
    return triangle(
        [[a + s * y for a, y in zip(row, vector, strict=True)] for row, s in zip(matrix, scaled, strict=True)]
    )


def quotient(table, vector):
    """Return ``v' M v`` for the upper triangle of a symmetric matrix M."""
    return dot(vector, [dot(row, vector) for row in square(table, len(vector))])
