"""Homographies and fundamental matrices of random samples, and those near them with the least truncated squares.

Homographies come from four pairs of pixels and fundamental matrices from seven. Descents use all pairs whose squared
distance is below a limit.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, absolute, array, each, kernel, matrices, maximum, minimum, select, sqrt, total
from gacompiler.specs.families.covariances import choose, cross, dot
from gacompiler.specs.families.descents import descend, truncated_equations
from gacompiler.specs.families.essential import nonzero, null_space
from gacompiler.specs.families.rotations import quaternion_of_matrix
from gacompiler.specs.families.two_views import (
    applied,
    product,
    rotation_matrix,
    sampson,
    sampson_sums,
    transposed,
    turned_by,
    unit,
)

THREE, NUMBERS = array(SCALAR, 3, 3), array(SCALAR, "n")
PIXELS, OWN_PIXELS = array(SCALAR, "n", 2, shared=True), array(SCALAR, "n", 2)
FLAT = Fraction(1, 1000)
"""A triangle whose height is below this part of its longest side leaves the homography of four points undetermined."""
SMALL = Fraction(1, 10**28)
"""A sum of squares of coordinates near 1 that is rounding."""
AXES = ((1, 0, 0), (0, 1, 0), (0, 0, 1))


# Homographies.


def _minors(points):
    """Return the four vectors of products of three of four points, and 1 if no three are nearly on a line."""
    places = [(*p, 1) for p in points]
    crossed = [cross(places[j], places[k]) for j, k in ((1, 2), (2, 0), (0, 1))]
    fine = 1
    for i in range(4):
        a, b, c = (points[k] for k in range(4) if k != i)
        u, v = [[q - p for p, q in zip(a, other, strict=True)] for other in (b, c)]
        area = absolute(u[0] * v[1] - u[1] * v[0])
        fine = fine * select(area > FLAT * maximum(dot(u, u), dot(v, v)), 1, 0)
    return places, crossed, [dot(each_, places[3]) for each_ in crossed], fine


@kernel(first=array(SCALAR, 4, 2), second=array(SCALAR, 4, 2), returns=(THREE, SCALAR))
def homography_of_four(first, second):
    """Compute the homography of norm 1 that maps four pixels to four others.

    Returns
    -------
    matrix
    is_determined
        1 if no three of the pixels are nearly on a line in either image, else 0.
    """
    _, crossed, weights, fine = _minors(first)
    places, _, others, fine_there = _minors(second)
    # Coordinates of the fourth point by the other three: H is the sum of others[k] / weights[k] q_k (p_i x p_j)'.
    factors = [others[k] * weights[i] * weights[j] for k, i, j in ((0, 1, 2), (1, 2, 0), (2, 0, 1))]
    columns = [tuple(f * x for x in p) for f, p in zip(factors, places[:3], strict=True)]
    matrix = product(transposed(columns), crossed)
    size = sqrt(sum(x * x for row in matrix for x in row))
    return tuple(tuple(x / nonzero(size) for x in row) for row in matrix), fine * fine_there


def _moved_pixel(matrix, x, y):
    """Return the offset of the image of a pixel from another, the image, and its weight."""
    moved = applied(matrix, (*x, 1))
    weight = nonzero(moved[2])
    place = moved[0] / weight, moved[1] / weight
    return (place[0] - y[0], place[1] - y[1]), place, weight


@kernel(matrix=THREE, first=PIXELS, second=PIXELS, returns=NUMBERS)
def transfer_squares(matrix, first, second):
    """Compute the squared distances of pixels of the second image from the images of those of the first."""

    def of(x, y):
        off, _, _ = _moved_pixel(matrix, x, y)
        return dot(off, off)

    return each(of, first, second)


@kernel(matrix=THREE, first=PIXELS, second=PIXELS, limit=SCALAR, returns=SCALAR)
def truncated_transfer_squares(matrix, first, second, limit):
    """Sum `transfer_squares`, each at most `limit`."""

    def of(x, y):
        off, _, _ = _moved_pixel(matrix, x, y)
        return minimum(dot(off, off), limit)

    return total(of, first, second)


def _plane_square(matrix, x, y):
    """Return the squared Sampson distance of a pair of pixels from the pairs that fit a homography."""
    off, place, weight = _moved_pixel(matrix, x, y)
    change = [[(row[k] - p * matrix[2][k]) / weight for k in (0, 1)] for row, p in zip(matrix[:2], place, strict=True)]
    a, b, c = 1 + dot(change[0], change[0]), dot(change[0], change[1]), 1 + dot(change[1], change[1])
    square = (c * off[0] * off[0] - 2 * b * off[0] * off[1] + a * off[1] * off[1]) / (a * c - b * b)
    return maximum(square, 0)


@kernel(matrix=THREE, first=OWN_PIXELS, second=OWN_PIXELS, returns=NUMBERS)
def plane_squares(matrix, first, second):
    """Compute squared Sampson distances of pairs of pixels from those that fit a homography, in four coordinates.

    Noise in both images is taken into account: the mean square is twice the variance of a coordinate.
    """
    return each(lambda x, y: _plane_square(matrix, x, y), first, second)


@kernel(matrix=THREE, first=PIXELS, second=PIXELS, limit=SCALAR, returns=SCALAR)
def truncated_plane_squares(matrix, first, second, limit):
    """Sum `plane_squares`, each at most `limit`."""
    return total(lambda x, y: minimum(_plane_square(matrix, x, y), limit), first, second)


def _scale(points):
    """Return the mean of points, and the inverse of their root mean square distance from it."""
    sums, count = total(lambda p: (tuple(p), 1), points)
    mean = tuple(x / count for x in sums)
    square = total(lambda p: sum((x - m) * (x - m) for x, m in zip(p, mean, strict=True)), points)
    return mean, 1 / sqrt(select(square > 0, square / count, 1))


@kernel(
    matrix=THREE, first=PIXELS, second=PIXELS, limit=SCALAR, at_most=SCALAR,
    returns=(THREE, array(SCALAR, 3)),
)  # fmt: skip
def descend_homography(matrix, first, second, limit, at_most):
    """Find the homography near another with the least `transfer_squares`, each at most `limit`.

    Steps of Levenberg and Marquardt are by eight entries of a matrix that precedes it, for normalised pixels.

    Returns
    -------
    matrix
    numbers
        The sum of truncated squares, 1 if a minimum was reached, else 0, and the number of steps.
    """
    (x_mean, y_mean), scale = _scale(first)
    start = [(row[0] / scale, row[1] / scale, dot(row, (x_mean, y_mean, 1))) for row in matrix]

    def equations(state):
        now = state[:3], state[3:6], state[6:]

        def of(x, y):
            u = scale * (x[0] - x_mean), scale * (x[1] - y_mean), 1
            off, place, weight = _moved_pixel(now, u[:2], y)
            square = dot(off, off)
            change = [[(row[k] - p * now[2][k]) / weight for k in range(3)] for row, p in zip(now, place, strict=False)]
            rows = [[row[i] * u[j] for i in range(3) for j in range(3)][:8] for row in change]
            return truncated_equations(tuple(zip(*rows, strict=True)), off, square, limit)

        return total(of, first, second)

    def moved(state, step):
        now = state[:3], state[3:6], state[6:]
        change = step[:3], step[3:6], (*step[6:], 0)
        steps = [x for row in product(now, change) for x in row]
        return unit([a + b for a, b in zip(state, steps, strict=True)])

    found = descend(unit([x for row in start for x in row]), 8, equations, moved, at_most)
    rows = found.state[:3], found.state[3:6], found.state[6:]
    entries = [
        x
        for row in rows
        for x in (scale * row[0], scale * row[1], row[2] - scale * (row[0] * x_mean + row[1] * y_mean))
    ]
    entries = unit(entries)
    return (entries[:3], entries[3:6], entries[6:]), (found.cost, found.ended, found.steps)


# Fundamental matrices.


@kernel(first=array(SCALAR, 7, 2), second=array(SCALAR, 7, 2), returns=(array(SCALAR, 3, 3, 3), SCALAR))
def fundamentals_of_seven(first, second):
    """Compute the fundamental matrices of norm 1 that seven pairs of pixels fit, and their number: 1 or 3.

    They are the singular ones of the matrices that fit. Pixels are normalised, of the order of 1.
    """
    pairs = [[unit((*p, 1)) for p in seven] for seven in (first, second)]
    basis = null_space([[b * a for b in y for a in x] for x, y in zip(*pairs, strict=True)])
    a, b = ((each_[:3], each_[3:6], each_[6:]) for each_ in basis)
    outer = [[cross(m[j], m[k]) for j, k in ((1, 2), (2, 0), (0, 1))] for m in (a, b)]
    cubic, constant = dot(outer[0][0], a[0]), dot(outer[1][0], b[0])
    flat = [tuple(x for row in m for x in row) for m in (a, b)]
    mixed = [dot([x for row in outer[k] for x in row], flat[1 - k]) for k in (0, 1)]
    # The matrices are a + x b, or x a + b if the roots would be large.
    swap = absolute(constant) < absolute(cubic)
    highest, high, low, lowest = choose(swap, (cubic, *mixed, constant), (constant, *mixed[::-1], cubic))
    real, _, number = ga.cubic_roots(highest, high, low, lowest)
    scaled, fixed = choose(swap, flat[0], flat[1]), choose(swap, flat[1], flat[0])
    found = []
    for x in real:
        entries = unit([x * p + q for p, q in zip(scaled, fixed, strict=True)])
        found.append((entries[:3], entries[3:6], entries[6:]))
    return tuple(found), number


@kernel(
    matrix=THREE, first=OWN_PIXELS, second=OWN_PIXELS, limit=SCALAR, at_most=SCALAR,
    returns=(THREE, array(SCALAR, 4)),
)  # fmt: skip
def descend_fundamental(matrix, first, second, limit, at_most):
    """Find the matrix of rank 2 near another with the least squares of Sampson distances, each at most `limit`.

    It is ``U diag(1, s, 0) V'`` with rotations U and V (Bartoli and Sturm 2004). Steps of Levenberg and Marquardt are
    in six angles and s. Pixels are normalised, of the order of 1, with the same scale in both images.

    Returns
    -------
    matrix
        Of norm 1.
    numbers
        The sum of truncated squares, 1 if a minimum was reached, else 0, the number of steps, and the sum that linear
        equations at the matrix would leave.
    """
    values, right = matrices.three_singular_vectors(matrix)
    images = product(matrix, right)
    one, two = (unit([row[k] for row in images]) for k in (0, 1))
    u = transposed((one, two, cross(one, two)))
    v = [[row[k] for row in right] for k in (0, 1)]
    v = transposed((*v, cross(*v)))

    def factors(state):
        return rotation_matrix(state[:4]), rotation_matrix(state[4:8]), state[8]

    def whole(left, back, ratio):
        scaled = [(row[0], ratio * row[1]) for row in left]
        return product(scaled, transposed(back)[:2])

    def equations(state):
        left, back, ratio = factors(state)
        current = whole(left, back, ratio)
        columns = transposed(current)
        changes = [transposed([cross(axis, column) for column in columns]) for axis in AXES]
        changes += [[cross(axis, row) for row in current] for axis in AXES]
        changes.append([[row[1] * other[1] for other in back] for row in left])
        reverse = transposed(current)
        return total(lambda x, y: sampson_sums(sampson(current, reverse, x, y), x, y, changes, limit), first, second)

    def moved(state, step):
        return (*turned_by(state[:4], step[:3]), *turned_by(state[4:8], step[3:6]), state[8] + step[6])

    start = (*quaternion_of_matrix(u), *quaternion_of_matrix(v), values[1] / nonzero(values[0]))
    found = descend(start, 7, equations, moved, at_most, SMALL)
    entries = unit([x for row in whole(*factors(found.state)) for x in row])
    return (entries[:3], entries[3:6], entries[6:]), (
        found.cost,
        found.ended,
        found.steps,
        maximum(found.cost - found.gain, 0),
    )
