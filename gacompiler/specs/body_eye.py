"""Body-eye calibration: the axes of joints in the frame of an eye, from circles of points that it tracks.

While one joint moves, the points of the surroundings run on circles about its axis in the frame of the eye. The
difference of two conformal points is their bisector plane, which contains the axis if both are on the same circle. The
sum of products of all bisector planes of a circle, four numbers each, is proportional to the scatter of its conformal
points about their mean, which takes a single pass.
"""

from fractions import Fraction
from typing import Any, NamedTuple

import gacompiler as ga
from gacompiler import SCALAR, array, each, gather, index, iterate, kernel, scatter, select, total
from gacompiler.algebra.catalog import CGA3, PGA3
from gacompiler.specs.families.covariances import cross, dot
from gacompiler.specs.families.lines import direction_of, line_of, moment_of, place_of

LINE, MOTOR, POINT = PGA3.LINE, PGA3.MOTOR, PGA3.POINT
VECTOR = array(SCALAR, 3)
POINTS = array(POINT, "n")
INFORMATION = array(SCALAR, "n", 6)
CIRCLE = index("n", into="k")
CIRCLES = array(SCALAR, "k")
NEVER_ZERO = Fraction(1, 10**300)
NEAR = Fraction(1, 10**4)
"""The least weighted mean square distance of a circle's points from the axis, relative to the mean of all circles."""
SINGULAR = Fraction(1, 10**20)
"""The least determinant of two equations, relative to the square of their trace."""
STEPS = 20


# Exact axes from few points.


def _bisector(a, b):
    """Return the bisector plane of two conformal points, their difference, as a plane of G(3,0,1)."""
    plane = b - a
    return ga.assemble(PGA3, {"e1": plane["e1"], "e2": plane["e2"], "e3": plane["e3"], "e0": -plane["einf"]})


@kernel(a=CGA3.POINT, b=CGA3.POINT, c=CGA3.POINT, returns=LINE)
def axis_of_three_points(a, b, c):
    """Compute the axis of the circle through three points: the meet of the bisector planes ``b - a`` and ``c - b``.

    The direction is that in which the rotation from a to b to c is right-handed. The norm is twice the area of the
    triangle, 0 for collinear points.
    """
    return _bisector(a, b) ^ _bisector(b, c)


@kernel(a=CGA3.POINT, moved_a=CGA3.POINT, b=CGA3.POINT, moved_b=CGA3.POINT, returns=LINE)
def axis_of_two_displacements(a, moved_a, b, moved_b):
    """Compute the axis of a rotation from two points and their images: the meet of their two bisector planes.

    The sign is arbitrary. The norm is 0 if the displacements are parallel.
    """
    return _bisector(a, moved_a) ^ _bisector(b, moved_b)


# Axes of many circles.


def _outer(a, b):
    return tuple(a[i] * b[j] for i in range(3) for j in range(i + 1))


@kernel(
    points=POINTS, circle=CIRCLE, counts=CIRCLES, centre=VECTOR,
    returns=(LINE, VECTOR, SCALAR),
)  # fmt: skip
def axis_of_circles(points, circle, counts, centre):
    """Compute the common axis of circles from the bisector planes of all pairs of points of each circle.

    The direction of the axis is that with the least sum of squared products with the normals of the planes. Its
    position is that with the least sum of squared products with the planes, weighted by the inverse of the mean square
    distance of their circle's points from the axis, which makes their errors equal.

    Parameters
    ----------
    points
    circle
        The circle of each point.
    counts
        The number of points of each circle; 0 counts as 1.
    centre
        A point near the others. Squares of distances are computed from it.

    Returns
    -------
    axis
        A unit line with an arbitrary sign.
    values
        The eigenvalues of the scatter of the points about the means of their circles, ascending. The first is due to
        noise; the second vanishes if the points of all circles are collinear, in parallel lines.
    size
        The mean square distance of the points from the centre.
    """

    def conformal(point):
        place = tuple(x - c for x, c in zip(place_of(point), centre, strict=True))
        return (*place, dot(place, place) / 2)

    rows = each(conformal, points)
    counts = each(lambda count: ga.maximum(count, 1), counts)
    sums = scatter(rows, circle, counts)
    means = each(lambda row, count: tuple(x / count for x in row), sums, counts)
    centred = each(lambda row, mean: tuple(x - m for x, m in zip(row, mean, strict=True)), rows, gather(means, circle))
    xx, yx, yy, zx, zy, zz = total(lambda row: _outer(row[:3], row[:3]), centred)
    values, vectors = ga.eigenvectors_symmetric(((xx, yx, zx), (yx, yy, zy), (zx, zy, zz)))
    direction, *plane = zip(*vectors, strict=True)

    def located(weights):
        """Return the point of the axis in the plane of the other two eigenvectors through the centre."""

        def products(row, weight):
            p, q = (dot(axis, row[:3]) for axis in plane)
            return weight * p * p, weight * q * p, weight * q * q, weight * p * row[3], weight * q * row[3]

        pp, qp, qq, p, q = total(products, centred, gather(weights, circle))
        determinant = ga.maximum(pp * qq - qp * qp, SINGULAR * (pp + qq) * (pp + qq) + NEVER_ZERO)
        first, second = (qq * p - qp * q) / determinant, (pp * q - qp * p) / determinant
        return tuple(first * x + second * y for x, y in zip(*plane, strict=True))

    def squared_distances(place):
        def square(row):
            arm = cross(direction, tuple(x - p for x, p in zip(row[:3], place, strict=True)))
            return dot(arm, arm)

        return each(lambda found, count: found / count, scatter(each(square, rows), circle, counts), counts)

    squares = squared_distances(located(each(lambda count: 1 + 0 * count, counts)))
    mean, n_circles = total(lambda square: (square, 1), squares)
    # Points next to the axis are noise, which a larger weight would amplify.
    least = NEAR * mean / n_circles + NEVER_ZERO
    place = located(each(lambda square: 1 / ga.maximum(square, least), squares))
    point = tuple(p + c for p, c in zip(place, centre, strict=True))
    far, count = total(lambda row: (2 * row[3], 1), rows)
    return line_of(direction, cross(point, direction)), values, far / count


# Refinement.


class Fit(NamedTuple):
    """The state of the iteration for a motor."""

    motor: Any
    cost: Any
    less: Any
    """The decrease of the cost that the last step predicts."""
    rounding: Any
    """A cost that is due to rounding errors."""


def _across(information, radial, axis):
    """Return the information of the components along two unit vectors: the inverse of their covariance."""
    xx, yx, yy, zx, zy, zz = information
    tangent = cross(axis, radial)
    table = ((xx, yx, zx), (yx, yy, zy), (zx, zy, zz))
    frame = radial, axis, tangent
    turned = [[dot(p, [dot(row, q) for row in table]) for q in frame] for p in frame]
    # The component along the circle is unknown: the Schur complement of its information.
    whole = turned[2][2] + NEVER_ZERO
    rr, ra, aa = ((turned[i][j] - turned[i][2] * turned[j][2] / whole) for i, j in ((0, 0), (0, 1), (1, 1)))
    return rr, ra, aa


def _cylindric(point, line, information):
    """Return radius and height of a point about a line, the information of these, and the unit vectors along them."""
    x, d, m = place_of(point), direction_of(line), moment_of(line)
    # The point of the line next to the origin is d x m.
    arm = tuple(a - b for a, b in zip(x, cross(d, m), strict=True))
    height = dot(d, arm)
    out = tuple(a - height * b for a, b in zip(arm, d, strict=True))
    radius = ga.sqrt(dot(out, out) + NEVER_ZERO)
    radial = tuple(a / radius for a in out)
    return (radius, height), _across(information, radial, d), tuple(radial), tuple(d)


def _rows(point, place, radial, axis):
    """Return the derivatives of the radius and the height by the twist of the line, and the values."""
    x = place_of(point)
    # If the line moves by a twist, the radius and the height change as if the point moved by the inverse. Heights are
    # from the point of the line next to the origin, which moves along the line too: that part is the same for all
    # points of a circle, and is absorbed by its height.
    found = []
    for gradient, value in zip((radial, axis), place, strict=True):
        turn = cross(x, gradient)
        found.append((-turn[2], turn[1], -turn[0], *(-g for g in gradient), value))
    return tuple(tuple(row) for row in found)


def _times(weight, radial, axial):
    """Return the products of a matrix of two rows, (rr, ra) and (ra, aa), with a pair of rows."""
    rr, ra, aa = weight
    pairs = list(zip(radial, axial, strict=True))
    return tuple(rr * a + ra * b for a, b in pairs), tuple(ra * a + aa * b for a, b in pairs)


def _weighed(row, weight):
    first, second = _times(weight, *row)
    return (*weight, *first, *second)


def _centre(values):
    """Return the weighted mean of the rows of a circle from sums of `_weighed`."""
    rr, ra, aa, *rest = values
    pairs = list(zip(rest[:7], rest[7:], strict=True))
    determinant = rr * aa - ra * ra + NEVER_ZERO
    return (
        tuple((aa * a - ra * b) / determinant for a, b in pairs),
        tuple((rr * b - ra * a) / determinant for a, b in pairs),
    )


def _products(row, weight, mean):
    """Return the lower triangle of the normal equations of a point."""
    radial, axial = (tuple(a - b for a, b in zip(*both, strict=True)) for both in zip(row, mean, strict=True))
    first, second = _times(weight, radial, axial)
    return tuple(radial[i] * first[j] + axial[i] * second[j] for i in range(7) for j in range(i + 1))


def _sizes(row, weight):
    """Return the sums of squares from which means are not subtracted: for turns, translations, and values."""
    rr, _, aa = weight
    squares = [rr * a * a + aa * b * b for a, b in zip(*row, strict=True)]
    return sum(squares[:3]), sum(squares[3:6]), squares[6]


def _square(triangle):
    return [[triangle[max(i, j) * (max(i, j) + 1) // 2 + min(i, j)] for j in range(7)] for i in range(7)]


@kernel(
    points=POINTS, information=INFORMATION, circle=CIRCLE, lines=array(LINE, "k"), start=MOTOR, free=array(SCALAR, 6),
    least_change=SCALAR, rounding=SCALAR, damping=SCALAR,
    returns=(MOTOR, array(SCALAR, 8, 7), CIRCLES, CIRCLES, SCALAR),
)  # fmt: skip
def refined_axes(points, information, circle, lines, start, free, least_change, rounding, damping):
    """Move lines as one rigid body, by Gauss-Newton steps, to the axes of circles nearest to all points.

    The radius of a circle and its position along its axis are those with the least sum of squares. Each step is the
    twist B of ``exp(-B/2) m``.

    Parameters
    ----------
    points
    information
        The inverse covariance of each point: xx, yx, yy, zx, zy, zz.
    circle
        The circle of each point.
    lines
        The unit line about which each circle is, before the motion.
    start
        The initial motion.
    free
        1 for the coefficients of the twist that are determined, 0 for others.
    least_change
        Iteration stops if a step decreases the sum of squares by at most this fraction.
    rounding
        Sums of squares are rounding errors up to this fraction of the sum of squared radii and heights.
    damping
        Increment of the pivots of the normal equations, relative to sums of squares from which means are not
        subtracted: far above the rounding errors of pivots that vanish.

    Returns
    -------
    motor
    sums
        The matrix of the normal equations of the twist, in the order of `generated.pga3` lines, with the right side as
        last row and column, which ends with the sum of squared residuals, weighted by the information. The eighth row
        begins with the sums of squares from which means are not subtracted: for turns, for translations, and of the
        radii and heights.
    radii, heights
        Of the circles; heights are positions along the axis from its point next to the origin.
    converged
        Whether the iteration converged.
    """

    def sums(motor):
        moved = each(lambda line: ga.sandwich(motor, line), lines)
        places, weights, radials, axes = each(_cylindric, points, gather(moved, circle), information)
        table = each(_rows, points, places, radials, axes)
        means = each(_centre, scatter(each(_weighed, table, weights), circle, lines))
        triangle = total(_products, table, weights, gather(means, circle))
        return _square(triangle), total(_sizes, table, weights), means

    def step(state):
        whole, sizes, _ = sums(state.motor)
        # Rotations and translations have different units.
        table = [
            [
                free[i] * free[j] * whole[i][j]
                + ((1 - free[i] + damping * free[i]) * (sizes[i // 3] + NEVER_ZERO) if i == j else 0)
                for j in range(6)
            ]
            for i in range(6)
        ]
        right = [-free[i] * whole[i][6] for i in range(6)]
        twist, _ = ga.solve_symmetric(table, right)
        bivector = ga.assemble(PGA3, dict(zip(LINE.blades, (-x / 2 for x in twist), strict=True)))
        less = dot(twist, right)
        good = less >= 0
        moved = ga.exp(ga.select(good, 1, 0) * bivector) * state.motor
        return Fit(moved, whole[6][6], select(good, less, 0), rounding * sizes[2])

    end, converged, _ = iterate(
        step, Fit(start, 0, 0, 0), lambda _, new: new.less <= least_change * new.cost + new.rounding, STEPS
    )
    whole, sizes, means = sums(end.motor)
    radii = each(lambda mean: mean[0][6], means)
    heights = each(lambda mean: mean[1][6], means)
    table = (*(tuple(row) for row in whole), (*sizes, 0, 0, 0, 0))
    return end.motor, table, radii, heights, converged
