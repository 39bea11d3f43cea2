"""Homographies and fundamental matrices of random samples, and those near them with the least truncated squares.

Homographies come from four pairs of pixels and fundamental matrices from seven. Descents use all pairs whose squared
distance is below a limit. Tests of fundamental matrices use both, so that all of it is in one file.
"""

from fractions import Fraction
from itertools import combinations_with_replacement

import gacompiler as ga
from gacompiler import (
    SCALAR,
    absolute,
    array,
    each,
    fold,
    iterate,
    kernel,
    matrices,
    maximum,
    minimum,
    select,
    sqrt,
    total,
)
from gacompiler.specs.families.covariances import choose, cross, dot, square
from gacompiler.specs.families.descents import LEAST_DAMPING, TINY, UNKNOWN, descend, step_of
from gacompiler.specs.families.essential import nonzero, null_space
from gacompiler.specs.families.linear_equations import (
    dominant,
    moved_and_scaled,
    normalized,
    quotient,
    solution,
    undone,
)
from gacompiler.specs.families.rotations import quaternion_of_matrix
from gacompiler.specs.families.two_views import (
    applied,
    product,
    rotation_matrix,
    sampson,
    transposed,
    turned_by,
    unit,
)
from gacompiler.specs.projective2 import homography_equations
from gacompiler.specs.projective3 import epipolar_equation

THREE, NUMBERS = array(SCALAR, 3, 3), array(SCALAR, "n")
PIXELS, OWN_PIXELS = array(SCALAR, "n", 2, shared=True), array(SCALAR, "n", 2)
FLAT = Fraction(1, 1000)
"""A triangle whose height is below this part of its longest side leaves the homography of four points undetermined."""
FLAT_SQUARE = Fraction(1, 10**14)
"""Points are on a line if their sum of squares across it is below this part of that along it."""
OPEN = Fraction(1, 10**14)
"""The solution of the equations is not unique if the eighth squared singular value is below this part of the first."""
ROUNDING = Fraction(1, 10**20)
"""A squared distance below this part of the squared extent of the pixels is rounding."""
VAST = 10**300
"""More than any coordinate."""
ALL = 10**20
"""A squared distance, in units of the size of the images, that no pixels reach."""
SMALL = Fraction(1, 10**28)
"""A sum of squares of coordinates near 1 that is rounding."""
SHORT = Fraction(1, 10**6)
"""A last step decreases the sum of squares by this part: for a thousand pairs, it is a thirtieth of the deviation."""


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


@kernel(matrix=THREE, first=array(SCALAR, 3, 2), second=array(SCALAR, 3, 2), returns=THREE)
def homography_of_three(matrix, first, second):
    """Compute the homography of norm 1 that maps three pixels to three others and is compatible with F.

    It is that of the plane through three points, seen by two cameras with the fundamental matrix `matrix`.
    """
    columns = transposed(matrix)
    crossed = [cross(columns[j], columns[k]) for j, k in ((1, 2), (2, 0), (0, 1))]
    epipole, most = crossed[0], dot(crossed[0], crossed[0])
    for each_ in crossed[1:]:
        square_ = dot(each_, each_)
        epipole, most = choose(square_ > most, each_, epipole), maximum(square_, most)
    epipole = [x / nonzero(sqrt(most)) for x in epipole]
    # All such homographies are this one minus the product of the epipole and a vector.
    one = transposed([cross(epipole, column) for column in columns])
    places = [(*p, 1) for p in first]
    parts = []
    for x, y in zip(places, second, strict=True):
        y = (*y, 1)
        line = cross(y, epipole)
        parts.append(dot(cross(y, applied(one, x)), line) / nonzero(dot(line, line)))
    duals = [cross(places[j], places[k]) for j, k in ((1, 2), (2, 0), (0, 1))]
    volume = nonzero(dot(duals[0], places[0]))
    vector = [sum(part * dual[k] for part, dual in zip(parts, duals, strict=True)) / volume for k in range(3)]
    entries = unit([a - e * b for row, e in zip(one, epipole, strict=True) for a, b in zip(row, vector, strict=True)])
    return entries[:3], entries[3:6], entries[6:]


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


def _mean(points):
    """Return the mean of points."""
    sums, count = total(lambda p: (tuple(p), 1), points)
    return tuple(x / count for x in sums)


def _of_factors(matrix, products):
    """Return the normal equations of the first eight entries of a matrix that precedes another.

    Derivatives of the place p by the rows of the other are u / w, and those by its last row -p u / w. The sums of
    ``u u'`` times 1, both coordinates of p and its square, each divided by the square of w, are the `products`.
    """
    blocks = {}
    for k in range(3):
        for m in range(k, 3):
            (a, b, c), (d, e, f) = ([row[i] for row in matrix] for i in (k, m))
            factors = a * d + b * e, -a * f - c * d, -b * f - c * e, c * f
            sums = zip(*products, strict=True)
            blocks[k, m] = square([dot(factors, each_) for each_ in sums], 3)
    entry = {}
    for k, m in blocks:
        for i in range(3):
            for j in range(3):
                entry[3 * k + i, 3 * m + j] = blocks[k, m][i][j]
    return [entry[i, j] for i in range(8) for j in range(i, 8)]


def _slope_of_factors(matrix, slopes):
    """Return half of the derivatives by these entries, from those by the rows of the other matrix."""
    return [x for column in transposed(matrix) for x in [dot(column, each_) for each_ in transposed(slopes)]][:8]


@kernel(
    matrix=THREE, first=PIXELS, second=PIXELS, limit=SCALAR, at_most=SCALAR, settled=SCALAR,
    returns=(THREE, array(SCALAR, 3)),
)  # fmt: skip
def descend_homography(matrix, first, second, limit, at_most, settled):
    """Find the homography near another with the least `transfer_squares`, each at most `limit`.

    Steps of Levenberg and Marquardt are by eight entries of a matrix that precedes it, for normalised pixels. The last
    step is expected to decrease the sum of squares by the part `settled` at most.

    Returns
    -------
    matrix
    numbers
        The sum of truncated squares, 1 if a minimum was reached, else 0, and the number of steps.
    """
    (x_mean, y_mean), scale = _scale(first)
    there = _mean(second)
    rows = [[a - m * b for a, b in zip(row, matrix[2], strict=True)] for row, m in zip(matrix[:2], there, strict=True)]
    start = [(row[0] / scale, row[1] / scale, dot(row, (x_mean, y_mean, 1))) for row in (*rows, matrix[2])]

    def equations(state):
        now = state[:3], state[3:6], state[6:]

        def of(x, y):
            u = scale * (x[0] - x_mean), scale * (x[1] - y_mean), 1
            off, place, weight = _moved_pixel(now, u[:2], [b - m for b, m in zip(y, there, strict=True)])
            square_ = dot(off, off)
            used = select(square_ < limit, 1, 0) / weight
            part = used / weight
            along = [part * p for p in place]
            slope = [used * off[0], used * off[1], -used * dot(place, off)]
            weights = part, *along, dot(along, place)
            pairs = [u[i] * u[j] for i in range(3) for j in range(i, 3)]
            products = [[a * b for b in pairs] for a in weights]
            return tuple(map(tuple, products)), tuple(tuple(a * b for b in u) for a in slope), minimum(square_, limit)

        products, slopes, cost = total(of, first, second)
        return (*_of_factors(now, products), *_slope_of_factors(now, slopes), cost)

    def moved(state, step):
        now = state[:3], state[3:6], state[6:]
        change = step[:3], step[3:6], (*step[6:], 0)
        steps = [x for row in product(now, change) for x in row]
        return unit([a + b for a, b in zip(state, steps, strict=True)])

    found = descend(unit([x for row in start for x in row]), 8, equations, moved, at_most, settled=settled)
    *rows, last = found.state[:3], found.state[3:6], found.state[6:]
    rows = [[a + m * b for a, b in zip(row, last, strict=True)] for row, m in zip(rows, there, strict=True)]
    entries = [
        x
        for row in (*rows, last)
        for x in (scale * row[0], scale * row[1], row[2] - scale * (row[0] * x_mean + row[1] * y_mean))
    ]
    entries = unit(entries)
    return (entries[:3], entries[3:6], entries[6:]), (found.cost, found.ended, found.steps)


# Fundamental matrices.


@kernel(first=array(SCALAR, 7, 2), second=array(SCALAR, 7, 2), returns=(array(SCALAR, 3, 3, 3), SCALAR))
def fundamentals_of_seven(first, second):
    """Compute the fundamental matrices of norm 1 that seven pairs of pixels fit, and their number: 1 or 3.

    They are the singular ones of the matrices that fit.
    """
    (one, left), (two, right) = _seven_normalized(first), _seven_normalized(second)
    pairs = [[unit((*p, 1)) for p in seven] for seven in (one, two)]
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
        entries = [x * p + q for p, q in zip(scaled, fixed, strict=True)]
        found.append(_of_pixels((entries[:3], entries[3:6], entries[6:]), left, right))
    return tuple(found), number


def _seven_normalized(points):
    """Return seven points relative to their mean, times a scale, and the similarity that maps the points to them."""
    mean = tuple(sum(p[k] for p in points) / 7 for k in (0, 1))
    off = [[x - m for x, m in zip(p, mean, strict=True)] for p in points]
    size = sum(dot(p, p) for p in off)
    scale = 1 / sqrt(nonzero(size) / 14)
    rows = (scale, 0, -scale * mean[0]), (0, scale, -scale * mean[1]), (0, 0, 1)
    return [tuple(scale * x for x in p) for p in off], rows


def _of_pixels(matrix, left, right):
    """Return the fundamental matrix of norm 1 of pixels, from that of pixels after similarities."""
    entries = unit([x for row in product(transposed(right), product(matrix, left)) for x in row])
    return entries[:3], entries[3:6], entries[6:]


def _pixels_normalized(first, second):
    """Return pixels relative to their mean with the same scale in both images, the similarities, and the scale."""
    sums, others, count = total(lambda x, y: (tuple(x), tuple(y), 1), first, second)
    means = [tuple(x / count for x in each_) for each_ in (sums, others)]

    def squares(x, y):
        off = [a - b for p, mean in zip((x, y), means, strict=True) for a, b in zip(p, mean, strict=True)]
        return dot(off, off)

    scale = 1 / sqrt(nonzero(total(squares, first, second) / (4 * count)))
    return *moved_and_scaled(first, means[0], scale), *moved_and_scaled(second, means[1], scale), scale


class _RankTwo:
    """Fundamental matrices near another: ``U diag(1, s, 0) V'`` with rotations U and V (Bartoli and Sturm 2004)."""

    def __init__(self, matrix, first, second):
        self.one, self.left, self.two, self.right, self.scale = _pixels_normalized(first, second)
        matrix = product(transposed(undone(self.right)), product(matrix, undone(self.left)))
        values, right = matrices.three_singular_vectors(matrix)
        images = product(matrix, right)
        one, two = (unit([row[k] for row in images]) for k in (0, 1))
        u = transposed((one, two, cross(one, two)))
        v = [[row[k] for row in right] for k in (0, 1)]
        v = transposed((*v, cross(*v)))
        self.start = (*quaternion_of_matrix(u), *quaternion_of_matrix(v), values[1] / nonzero(values[0]))

    def equations(self, state, limit, tail=None):
        """Return the sums over all pairs for a step in six angles and s, with each square at most `limit`.

        With a `tail`, squares have weights, and those beyond the limit do not count.
        """
        left, back = rotation_matrix(state[:4]), rotation_matrix(state[4:8])
        current = self.matrix(state)
        columns = transposed(current)
        one, two = ([row[1] for row in rotation] for rotation in (left, back))

        def of(x, y):
            x, y = (*x, 1), (*y, 1)
            off, size, line, other = sampson(current, columns, x[:2], y[:2])
            inverse = 1 / sqrt(maximum(size, TINY))
            residual = off * inverse
            square_ = residual * residual
            part = residual * inverse
            # The derivative of the residual by the matrix is near x' - y far'.
            near = [(y[0] - part * line[0]) * inverse, (y[1] - part * line[1]) * inverse, inverse]
            far = [part * inverse * other[0], part * inverse * other[1]]
            turns = cross(line, near), cross([dot(row[:2], far) for row in current], y)
            turns_back = cross(applied(columns, near), x), cross(other, (*far, 0))
            row = [a - b for pair in (turns, turns_back) for a, b in zip(*pair, strict=True)]
            row.append(dot(one, near) * dot(two, x) - dot(one, y) * dot(two[:2], far))
            used = [select(square_ < limit, a, 0) for a in row]
            weight = 1 if tail is None else tail / (tail + square_)
            weighed = [weight * a for a in used]
            table = [weighed[i] * used[j] for i, j in combinations_with_replacement(range(7), 2)]
            cost = minimum(square_, limit) if tail is None else select(square_ < limit, weight * square_, 0)
            return (*table, *(residual * a for a in weighed), cost)

        return total(of, self.one, self.two)

    def moved(self, state, step):
        """Return the state after a step."""
        return (*turned_by(state[:4], step[:3]), *turned_by(state[4:8], step[3:6]), state[8] + step[6])

    def matrix(self, state):
        """Return the matrix of a state, for normalised pixels."""
        left, back = rotation_matrix(state[:4]), rotation_matrix(state[4:8])
        return product([(row[0], state[8] * row[1]) for row in left], transposed(back)[:2])


@kernel(
    matrix=THREE, first=OWN_PIXELS, second=OWN_PIXELS, limit=SCALAR, at_most=SCALAR, settled=SCALAR,
    returns=(THREE, array(SCALAR, 3)),
)  # fmt: skip
def descend_fundamental(matrix, first, second, limit, at_most, settled):
    """Find the matrix of rank 2 near another with the least squares of Sampson distances, each at most `limit`.

    The last step is expected to decrease the sum of squares by the part `settled` at most.

    Returns
    -------
    matrix
        Of norm 1.
    numbers
        The sum of truncated squares, 1 if a minimum was reached, else 0, and the number of steps.
    """
    near = _RankTwo(matrix, first, second)
    square = near.scale * near.scale
    bound = minimum(limit * square, ALL)
    found = descend(near.start, 7, lambda state: near.equations(state, bound), near.moved, at_most, SMALL, settled)
    return _of_pixels(near.matrix(found.state), near.left, near.right), (found.cost / square, found.ended, found.steps)


@kernel(
    matrix=THREE, first=OWN_PIXELS, second=OWN_PIXELS, limit=SCALAR, tail=SCALAR, at_most=SCALAR,
    returns=(THREE, array(SCALAR, 2)),
)  # fmt: skip
def likeliest_fundamental(matrix, first, second, limit, tail, at_most):
    """Find the matrix of rank 2 near a minimum of squares that is likeliest if errors have the tails of Student's t.

    Sampson distances whose square is `tail` have half the weight of small ones, and those beyond `limit` none. Each
    step minimises the sum of squares with the weights of the one before (iteratively reweighted least squares).

    Returns
    -------
    matrix
        Of norm 1.
    numbers
        1 if the last step was short, else 0, and the number of steps.
    """
    near = _RankTwo(matrix, first, second)
    bounds = [minimum(each_ * near.scale * near.scale, ALL) for each_ in (limit, tail)]

    def body(now):
        *sums, cost = near.equations(now[:9], *bounds)
        step, gain = step_of(sums[:28], sums[28:], LEAST_DAMPING)
        return (*near.moved(now[:9], step), select(gain < SHORT * cost + SMALL, 1, 0))

    found, ended, steps = iterate(body, (*near.start, 0), lambda _, new: new[9] > 0, at_most)
    return _of_pixels(near.matrix(found[:9]), near.left, near.right), (ended, steps)


# What else pairs of pixels fit.


def _plane_of(first, second):
    """Return the homography by linear equations, in pixels."""
    (one, left), (two, right) = normalized(first, 2), normalized(second, 2)
    entries, _, _ = solution(homography_equations, one, two)
    matrix = entries[:3], entries[3:6], entries[6:]
    entries = unit([x for row in product(undone(right), product(matrix, left)) for x in row])
    return entries[:3], entries[3:6], entries[6:]


def _least_and_largest(sums, entries, inverse):
    """Return the least, the second least and the largest eigenvalue of the sums of products of equations."""
    vectors = entries, dominant(inverse, 9), dominant(sums, 9)
    return [maximum(quotient(sums, vector), 0) for vector in vectors]


@kernel(first=OWN_PIXELS, second=OWN_PIXELS, returns=array(SCALAR, 3))
def squares_of_plane(first, second):
    """Compute squared singular values of the equations of a homography between normalised pixels.

    These are the least, the second least and the largest one, to 1e-14 of the largest.
    """
    (one, _), (two, _) = normalized(first, 2), normalized(second, 2)
    entries, sums, inverse = solution(homography_equations, one, two)
    return tuple(_least_and_largest(sums, entries, inverse))


@kernel(first=OWN_PIXELS, second=OWN_PIXELS, used=NUMBERS, returns=OWN_PIXELS)
def affine_places(first, second, used):
    """Compute the images of pixels under the affine map that leaves the least squares of distances from others.

    Parameters
    ----------
    first, second
    used
        1 for each of the pairs that determine the map, else 0. If they are on a line, places beside it do not move.
    """

    def sums(x, y, w):
        return w, tuple(w * a for a in x), tuple(w * a for a in y)

    count, here, there = total(sums, first, second, used)
    count = nonzero(count)
    here, there = ([a / count for a in each_] for each_ in (here, there))

    def products(x, y, w):
        u, v = [a - m for a, m in zip(x, here, strict=True)], [a - m for a, m in zip(y, there, strict=True)]
        return (w * u[0] * u[0], w * u[0] * u[1], w * u[1] * u[1]), tuple(tuple(w * a * b for b in u) for a in v)

    (xx, xy, yy), mixed = total(products, first, second, used)
    volume = xx * yy - xy * xy
    volume = select(volume > FLAT_SQUARE * (xx + yy) * (xx + yy), 1 / nonzero(volume), 0)
    rows = [(volume * (yy * a - xy * b), volume * (xx * b - xy * a)) for a, b in mixed]

    def moved(x):
        u = [a - m for a, m in zip(x, here, strict=True)]
        return tuple(m + dot(row, u) for row, m in zip(rows, there, strict=True))

    return each(moved, first)


@kernel(first=OWN_PIXELS, second=OWN_PIXELS, returns=NUMBERS)
def least_plane_squares(first, second):
    """Compute `plane_squares` of the homography by linear equations, in the direction that leaves less.

    The equations of fewer than four pairs have exact solutions.
    """
    forward, back = _plane_of(first, second), _plane_of(second, first)

    def squares(x, y):
        return _plane_square(forward, x, y), _plane_square(back, y, x)

    left, other, count = total(lambda x, y: (*squares(x, y), 1), first, second)

    def of(x, y):
        own, back_own = squares(x, y)
        return select(count >= 4, select(left <= other, own, back_own), 0)

    return each(of, first, second)


def _extents(points):
    """Return the least and the largest sum of squares of points about their mean, along directions, and their size."""
    sums, count = total(lambda p: (tuple(p), 1), points)
    mean = tuple(x / count for x in sums)

    def products(p):
        x, y = p[0] - mean[0], p[1] - mean[1]
        return x * x, x * y, y * y

    def bounds(found, p):
        return tuple((minimum(low, x), maximum(high, x)) for (low, high), x in zip(found, p, strict=True))

    xx, xy, yy = total(products, points)
    (left, right), (down, up) = fold(bounds, ((VAST, -VAST), (VAST, -VAST)), points)
    large = (xx + yy + sqrt((xx - yy) * (xx - yy) + 4 * xy * xy)) / 2
    return maximum(xx * yy - xy * xy, 0) / nonzero(large), large, maximum(right - left, up - down)


@kernel(points=OWN_PIXELS, returns=array(SCALAR, 2))
def extents_of_pixels(points):
    """Compute the least and the largest sum of squares of points about their mean, along directions.

    The least one is exact to 1e-16 of the largest.
    """
    thin, long, _ = _extents(points)
    return thin, long


def _line(ends, distance):
    """Return the function ``a x + b y + c`` of the line through two points, and the size that it has at a distance."""
    (x, y), (u, v) = ends
    a, b = y - v, u - x
    return (a, b, -a * x - b * y), distance * sqrt(a * a + b * b)


@kernel(ends=array(SCALAR, 2, 2), points=PIXELS, distance=SCALAR, returns=SCALAR)
def count_near_line(ends, points, distance):
    """Count the points that are nearer to the line through two points than a distance."""
    line, limit = _line(ends, distance)
    return total(lambda p: select(absolute(dot(line, (*p, 1))) < limit, 1, 0), points)


@kernel(ends=array(SCALAR, 2, 2), points=OWN_PIXELS, distance=SCALAR, returns=NUMBERS)
def off_line(ends, points, distance):
    """Determine which points are not nearer to the line through two points than a distance: 1, else 0."""
    line, limit = _line(ends, distance)
    return each(lambda p: select(absolute(dot(line, (*p, 1))) < limit, 0, 1), points)


@kernel(
    matrix=THREE, first=OWN_PIXELS, second=OWN_PIXELS, off=NUMBERS, known=SCALAR, by_size=SCALAR, by_rest=SCALAR,
    line=SCALAR, plane=SCALAR, ratio=SCALAR, returns=SCALAR,
)  # fmt: skip
def are_degenerate(matrix, first, second, off, known, by_size, by_rest, line, plane, ratio):
    """Determine whether pairs of pixels also fit a line, a plane, or other fundamental matrices.

    The variance of pixels is the sum of three parts.

    Parameters
    ----------
    matrix
        A fundamental matrix.
    first, second
    off
        Their `least_plane_squares`.
    known
        The variance if it is known, else 0.
    by_size
        The part for a unit of the squared extent of the pixels.
    by_rest
        The part for a unit of the squares that a step from the matrix leaves.
    line
        Points are on a line if their sum of squares across it is at most this multiple of the variance.
    plane
        Pairs are those of a plane if the sum of `off` is at most this multiple of the variance.
    ratio
        Equations of eight or more pairs have several solutions if their two smallest singular values have at most this
        ratio.
    """
    near = _RankTwo(matrix, first, second)
    *table, cost = near.equations(near.start, UNKNOWN)
    _, gain = step_of(table[:28], table[28:], LEAST_DAMPING)
    rest = maximum(cost - gain, 0) / (near.scale * near.scale)
    (thin, long, size), (other_thin, other_long, other_size) = _extents(first), _extents(second)
    square = maximum(size, other_size) * maximum(size, other_size)
    variance = known + by_size * square + by_rest * rest
    count, left = total(lambda x: (1, x), off)
    on_line = minimum(thin, other_thin) <= maximum(line * variance, ROUNDING * square * (count - 2))
    flat = select(thin <= FLAT_SQUARE * long, 1, other_thin <= FLAT_SQUARE * other_long)
    on_plane = left <= maximum(plane * variance, ROUNDING * square * (2 * count - 8))
    (one, _), (two, _) = normalized(first, 2), normalized(second, 2)
    entries, sums, inverse = solution(lambda x, y: [epipolar_equation(x, y)], one, two)
    least, second_least, largest = _least_and_largest(sums, entries, inverse)
    several = select(second_least <= OPEN * largest, 1, second_least <= ratio * ratio * least)
    several = select(count < 8, 0, several)
    return maximum(maximum(on_line, flat), maximum(on_plane, several))
