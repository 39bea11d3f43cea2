"""Laser scans in the plane: lines of runs of points, votes for motions between scans, and their refinement.

Points and lines are those of G(2,0,1), as in the module `pga2`. A motor takes the coordinates of a scan to those of
another one, or of a map. Kernels of one beam, line or point come first, then loops over the points of a scan.
"""

import math
from fractions import Fraction
from typing import Any, NamedTuple

import gacompiler as ga
from gacompiler import (
    SCALAR,
    absolute,
    array,
    assemble,
    each,
    equal,
    floor,
    fold,
    iterate,
    kernel,
    least,
    pick,
    row_numbers,
    scan,
    select,
    total,
)
from gacompiler.algebra.catalog import PGA2

POINT, LINE, MOTOR, DIRECTION = PGA2.POINT, PGA2.LINE, PGA2.MOTOR, PGA2.DIRECTION
POINTS, TARGETS = array(SCALAR, "n", 2), array(SCALAR, "m", 5, shared=True)
SUMS = array(SCALAR, 5)
FAR = 10**30
TINY = Fraction(1, 10**30)
HALF = Fraction(1, 2)


@kernel(distance=SCALAR, angle=SCALAR, returns=POINT)
def beam_point(distance, angle):
    """Compute the point at a distance and an angle, from x towards y, from the origin."""
    return assemble(PGA2, {"e20": distance * ga.cos(angle), "e01": distance * ga.sin(angle), "e12": 1})


@kernel(points=POINTS, returns=array(SCALAR, "n", 5))
def prefix_sums(points):
    """Sum ``x, y, x x, x y, y y`` over the points up to each one."""

    def step(carry, p):
        x, y = p[0], p[1]
        return tuple(c + v for c, v in zip(carry, (x, y, x * x, x * y, y * y), strict=True))

    return scan(step, (0, 0, 0, 0, 0), points)


def _squared_distance_from_chord(p, a, b):
    """Return the squared distance of `p` from the line through `a` and `b`, or from `a` if they coincide."""
    along, off = (b[0] - a[0], b[1] - a[1]), (p[0] - a[0], p[1] - a[1])
    length = along[0] * along[0] + along[1] * along[1]
    area = along[0] * off[1] - along[1] * off[0]
    none = length <= TINY
    return select(none, off[0] * off[0] + off[1] * off[1], area * area / select(none, 1, length))


@kernel(before=SUMS, last=SUMS, count=SCALAR, returns=(array(SCALAR, 2), SCALAR, array(SCALAR, 2), array(SCALAR, 2)))
def line_of_run(before, last, count):
    """Fit a line to a run of points by total least squares, from the sums up to before its first and up to its last.

    Returns the unit normal, away from the origin; the distance from the origin; the mean of the points; and their mean
    squares off and along the line.
    """
    x, y, xx, xy, yy = ((b - a) / count for a, b in zip(before, last, strict=True))
    cxx, cxy, cyy = xx - x * x, xy - x * y, yy - y * y
    mean, half = (cxx + cyy) / 2, (cxx - cyy) / 2
    root = ga.sqrt(half * half + cxy * cxy)
    # The normal is the eigenvector of the smaller eigenvalue; of its two formulas, the one without cancellation.
    tall = half > 0
    nx, ny = select(tall, -cxy, root - half), select(tall, root + half, -cxy)
    size = ga.sqrt(nx * nx + ny * ny)
    none = size <= TINY
    scale = 1 / select(none, 1, size)
    nx, ny = select(none, 1, nx * scale), select(none, 0, ny * scale)
    offset = nx * x + ny * y
    sign = select(offset < 0, -1, 1)
    small = ga.maximum(mean - root, 0)
    return (sign * nx, sign * ny), sign * offset, (x, y), (small, mean + root)


NONE, NO_SUMS = (0, 0), (0, 0, 0, 0, 0)
MERGES = 3
"""Passes that merge neighbouring runs."""


def _bounds_beside(flags, numbers):
    """Return for each row the last bound up to it and the one before, the first from it on and the one after; or -1."""

    def passed(carry, flag, k):
        is_bound = flag > 0
        return select(is_bound, k, carry[0]), select(is_bound, carry[0], carry[1])

    return *scan(passed, (-1, -1), flags, numbers), *scan(passed, (-1, -1), flags, numbers, reverse=True)


@kernel(points=POINTS, sums=array(SCALAR, "n", 5), tolerance=SCALAR, returns=array(SCALAR, "n"))
def straight_bounds(points, sums, tolerance):
    """Divide points, in their order, into straight runs: 1 at the ends of runs, which neighbours share, and else 0.

    Runs are split at the points farthest from the chord between their ends, all at once, until all points are within
    the tolerance. Then neighbours are merged if one line fits both: its root mean square of distances is at most a
    third of the tolerance, and that of their common end at most the tolerance.

    Parameters
    ----------
    points
    sums
        The result of `prefix_sums`.
    tolerance
        The largest distance of a point from the chord of its run.
    """
    numbers = row_numbers(points)
    n = total(lambda p: 1, points)
    ends = each(lambda k: 1 - (k > 0) * (k < n - 1), numbers)

    def split(state):
        flags, _ = state
        first, _, last, _ = _bounds_beside(flags, numbers)

        def square(p, flag, a, b):
            far = _squared_distance_from_chord(p, pick(points, a, NONE), pick(points, b, NONE))
            return select(flag > 0, 0, far)

        def farther(most, flag, far):
            return select(flag > 0, 0, ga.maximum(most, far))

        squares = each(square, points, flags, first, last)
        before, after = scan(farther, 0, flags, squares), scan(farther, 0, flags, squares, reverse=True)

        # Points at the same largest distance are all bounds; neighbours that one line fits are merged later.
        def bound(flag, far, one, two):
            return ga.maximum(flag, (far > tolerance * tolerance) * equal(far, ga.maximum(one, two)))

        found = each(bound, flags, squares, before, after)
        return found, total(lambda a, b: a - b, found, flags)

    def merge(state):
        flags, _ = state
        _, before, _, after = _bounds_beside(flags, numbers)

        def cost(p, flag, a, b):
            is_inner = flag * (a >= 0) * (b >= 0) > 0
            count = select(is_inner, b + 1 - a, 1)
            normal, offset, _, squares = line_of_run.function(pick(sums, a - 1, NO_SUMS), pick(sums, b, NO_SUMS), count)
            corner = absolute(normal[0] * p[0] + normal[1] * p[1] - offset)
            off = ga.sqrt(squares[0])
            return select(is_inner * (3 * off < tolerance) * (corner < tolerance) > 0, off, FAR)

        costs = each(cost, points, flags, before, after)

        # At most one bound of each run is removed.
        def kept(flag, own, a, b):
            is_best = (own < FAR) * (own <= pick(costs, a, FAR)) * (own < pick(costs, b, FAR))
            return flag * (1 - is_best)

        found = each(kept, flags, costs, before, after)
        return found, total(lambda a, b: a - b, flags, found)

    begun, _, _ = iterate(split, (ends, 0), lambda _, new: new[1] <= 0, n)
    merged, _, _ = iterate(merge, begun, lambda _, new: new[1] <= 0, MERGES)
    return merged[0]


LEAST_POINTS, LEAST_LENGTH, ROUGHNESS, LONG = 4, Fraction(1, 5), Fraction(1, 25), 1
"""What makes a run a line: its points, its length, and its deviation, in metres; and the length of lines that are
expected to continue."""
ALONG_LINES, ALONG_POINTS = Fraction(1, 1000), Fraction(3, 5)
"""Weights of distances at right angles to the normals, of readings on lines and of others."""
REACH, FARTHEST, SHARE_OF_GAP = Fraction(1, 10), 3, Fraction(3, 5)
"""Half of the length of line that a point represents without a loss in distance, in metres: at least, at most, and as a
share of the gaps beside it."""
SPACING, MOST_SAMPLES = Fraction(3, 20), 8
"""Distance between samples of lines in metres, and the most of them between two points."""
NEAR, LOOSE = Fraction(3, 10), Fraction(3, 10)
"""Metres up to which neighbouring points off lines count as one surface, and the weight of its direction."""


class Run(NamedTuple):
    """The straight run from a point to the next one: its line, and its number of steps if it is one, or else 0."""

    nx: Any
    ny: Any
    x: Any
    y: Any
    size: Any
    is_long: Any


def _run(points, sums, a, b):
    count = ga.maximum(b + 1 - a, 1)
    p, q = pick(points, a, NONE), pick(points, b, NONE)
    normal, _, mean, squares = line_of_run.function(pick(sums, a - 1, NO_SUMS), pick(sums, b, NO_SUMS), count)
    length = (p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1])
    is_line = (count >= LEAST_POINTS) * (length > LEAST_LENGTH**2) * (squares[0] < ROUGHNESS**2)
    return Run(normal[0], normal[1], mean[0], mean[1], is_line * (count - 1), is_line * (length > LONG**2))


@kernel(
    points=POINTS, sums=array(SCALAR, "n", 5), bounds=array(SCALAR, "n"), stride=SCALAR,
    returns=(array(SCALAR, "n", 6), array(SCALAR, "n", 5), array(SCALAR, "n", 5), array(SCALAR, "n", 5)),
)  # fmt: skip
def outline_of_runs(points, sums, bounds, stride):
    """Describe the points of a scan and the steps to their successors, given the ends of straight runs.

    Parameters
    ----------
    points, sums, bounds
        As of `straight_bounds`, and its result.
    stride
        Every so many points are kept.

    Returns
    -------
    surface
        Points, normals away from the scanner, weights of distances at right angles to them, and of points.
    targets
        Points, normals, and factors of squared distances, for the kernel `nearest`.
    lines
        Of the step from each point to the next: the mean of its line, the normal, and whether a long line begins.
    steps
        The step from each point, its number of samples, the angle of its normal, and the weight of this direction; 0
        for the last point.
    """
    numbers = row_numbers(points)
    n = total(lambda p: 1, points)
    first, _, last, after = _bounds_beside(bounds, numbers)
    runs = each(lambda a, b, c, flag: _run(points, sums, a, select(flag > 0, c, b)), first, last, after, bounds)
    sizes = each(lambda run, k: select(k < n - 1, run.size, 0), runs, numbers)

    def step(p, k):
        q = pick(points, k + 1, NONE)
        return select(k < n - 1, q[0] - p[0], 0), select(k < n - 1, q[1] - p[1], 0)

    steps = each(step, points, numbers)
    gaps = each(lambda s: ga.sqrt(s[0] * s[0] + s[1] * s[1]), steps)
    of_lines = each(lambda gap, size: select(size > 0, gap, 0), gaps, sizes)

    def point(p, run, size, gap, flag, k):
        # A shared end belongs to the line with more points, and the last point to the last run.
        earlier = pick(runs, k - 1, Run(0, 0, 0, 0, 0, 0))
        is_earlier = flag * (earlier.size > size) > 0
        nx, ny = select(is_earlier, earlier.nx, run.nx), select(is_earlier, earlier.ny, run.ny)
        is_on = select(is_earlier, 1, size > 0) > 0
        far = ga.sqrt(p[0] * p[0] + p[1] * p[1])
        normal = select(is_on, nx, p[0] / far), select(is_on, ny, p[1] / far)
        spacing = stride * SHARE_OF_GAP * ga.maximum(gap, pick(of_lines, k - 1, 0))
        factor = REACH / ga.minimum(ga.maximum(spacing, REACH), FARTHEST)
        surface = (*p, *normal, select(is_on, ALONG_LINES, ALONG_POINTS), select(is_on, 1, HALF))
        return surface, (*p, *normal, select(is_on, factor * factor, 1))

    surface, targets = each(point, points, runs, sizes, of_lines, bounds, numbers)

    def described(p, s, gap, run, size, flag, k):
        is_line = size > 0
        is_step = k < n - 1
        area = p[0] * (p[1] + s[1]) - p[1] * (p[0] + s[0])
        side = select(area < 0, -1, 1)
        angle = ga.atan2(select(is_line, run.ny, -side * s[0]), select(is_line, run.nx, side * s[1]))
        weight = select(is_line, ga.minimum(gap, 1), select(gap < NEAR, LOOSE * gap, 0))
        count = ga.minimum(ga.maximum(-floor(-gap / SPACING), 1), MOST_SAMPLES)
        count = is_step * select(is_line, count, 1)
        line = (run.x, run.y, run.nx, run.ny, flag * is_line * run.is_long)
        return line, (*s, count, select(is_step, angle, 0), is_step * weight)

    lines, described_steps = each(described, points, steps, gaps, runs, sizes, bounds, numbers)
    return surface, targets, lines, described_steps


def _begins(points, ranges, beams, step, reach, numbers):
    """Return for each reading whether a surface begins with it: 1, or 0 if it is joined to the reading before it."""

    # A step that is long near the scanner is usual at a distance.
    def begins(p, range, beam, k):
        q = pick(points, k - 1, NONE)
        most = ga.maximum(reach, 4 * absolute(step) * range)
        far = (p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]) >= most * most
        return ga.maximum(k <= 0, ga.maximum(far, beam - pick(beams, k - 1, 0) > 2))

    return each(begins, points, ranges, beams, numbers)


@kernel(
    points=POINTS, ranges=array(SCALAR, "n"), beams=array(SCALAR, "n"), step=SCALAR, reach=SCALAR,
    returns=array(SCALAR, "n"),
)  # fmt: skip
def surface_begins(points, ranges, beams, step, reach):
    """Find the readings with which surfaces begin: 1 for these, 0 for those on the surface of the reading before.

    Parameters
    ----------
    points, ranges, beams
        Readings in the order of their beams.
    step
        The angle between two beams.
    reach
        Distance up to which neighbours are on one surface, in metres.
    """
    return _begins(points, ranges, beams, step, reach, row_numbers(points))


@kernel(
    points=POINTS, ranges=array(SCALAR, "n"), beams=array(SCALAR, "n"), step=SCALAR, rules=array(SCALAR, 3),
    returns=array(SCALAR, "n"),
)  # fmt: skip
def narrow_readings(points, ranges, beams, step, rules):
    """Find readings of narrow objects in front of what is beside them: 1 for these, 0 for others.

    Parameters
    ----------
    points, ranges, beams
        Readings in the order of their beams.
    step
        The angle between two beams.
    rules
        Distance up to which neighbours are on one surface, width of objects, and distance in front of others, in
        metres.
    """
    numbers = row_numbers(points)

    starts = _begins(points, ranges, beams, step, rules[0], numbers)
    ends = each(lambda k: pick(starts, k + 1, 1), numbers)

    def passed(carry, flag, k):
        return select(flag > 0, k, carry)

    first, last = scan(passed, 0, starts, numbers), scan(passed, 0, ends, numbers, reverse=True)

    # The first and the last object of a scan may continue beyond it.
    def in_front(a, b):
        p, q = pick(points, a, NONE), pick(points, b, NONE)
        width = (p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1])
        before = pick(ranges, a - 1, -FAR) > pick(ranges, a, 0) + rules[2]
        after = pick(ranges, b + 1, -FAR) > pick(ranges, b, 0) + rules[2]
        return (width < rules[1] * rules[1]) * before * after

    return each(in_front, first, last)


def _squared_distance(x, y, target):
    """Return the square of the distance off a line plus, with the factor of the target, of that along it."""
    dx, dy = x - target[0], y - target[1]
    off, along = target[2] * dx + target[3] * dy, target[2] * dy - target[3] * dx
    return off * off + target[4] * (along * along)


@kernel(p=array(SCALAR, 2), targets=TARGETS, returns=(SCALAR, SCALAR))
def nearest(p, targets):
    """Find the nearest of some targets, and the squared distance to it.

    A target is a point, a unit normal and the factor of squared distances at right angles to the normal: 1 for a point,
    less for a piece of a line.
    """
    return least(lambda target: _squared_distance(p[0], p[1], target), targets)


@kernel(p=array(SCALAR, 2), targets=array(SCALAR, "m", 4, 5, shared=True), returns=SCALAR)
def nearest_square(p, targets):
    """Compute the squared distance from the nearest of some targets, as `nearest` does; a large number for none.

    Targets are in rows of four, which can be compared before the least one so far is known.
    """

    def nearer(least, four):
        a, b, c, d = (_squared_distance(p[0], p[1], target) for target in four)
        return ga.minimum(least, ga.minimum(ga.minimum(a, b), ga.minimum(c, d)))

    return fold(nearer, FAR, targets)


class Moved(NamedTuple):
    """A point, moved by a motor."""

    x: Any
    y: Any


def _moved(motor, p):
    moved = ga.sandwich(motor, assemble(PGA2, {"e20": p[0], "e01": p[1], "e12": 1}))
    return Moved(moved["e20"], moved["e01"])


@kernel(motor=MOTOR, points=array(SCALAR, "n", 2, shared=True), returns=POINTS)
def moved_points(motor, points):
    """Move points by a motor."""
    return each(lambda p: tuple(_moved(motor, p)), points)


def _sums_of(at, q, n, across, weight, scale):
    """Return the normal equations of a moved point and its line, and its weight times 1 and the squared distance."""
    off = (at.x - q[0], at.y - q[1])
    along = n[0] * off[0] + n[1] * off[1]
    side = -n[1] * off[0] + n[0] * off[1]
    ratio = 1 / (1 + (along * along + across * side * side) / (scale * scale))
    weight = weight * ratio * ratio
    row = (n[0], n[1], n[1] * at.x - n[0] * at.y)
    other = (-n[1], n[0], n[0] * at.x + n[1] * at.y)
    triangle = tuple(weight * (row[i] * row[j] + across * other[i] * other[j]) for i in range(3) for j in range(i, 3))
    gradient = tuple(weight * (row[i] * along + across * other[i] * side) for i in range(3))
    return triangle, gradient, (weight, weight * along * along)


def _step(motor, triangle, gradient):
    """Return the motor after a Gauss-Newton step, and the squares of the translation and the angle of the step."""
    xx, xy, xa, yy, ya, aa = triangle
    # A small increment of the diagonal keeps directions that no residual determines.
    damping = Fraction(1, 10**6) * (xx + yy) + TINY
    turning = Fraction(1, 10**6) * aa + TINY
    matrix = ((xx + damping, xy, xa), (xy, yy + damping, ya), (xa, ya, aa + turning))
    (dx, dy, da), _ = ga.solve_symmetric(matrix, tuple(-g for g in gradient))
    step = assemble(PGA2, {"1": 1, "e20": dy / 2, "e01": -dx / 2}) * assemble(
        PGA2, {"1": ga.cos(da / 2), "e12": -ga.sin(da / 2)}
    )
    return ga.normalize(step * motor), dx * dx + dy * dy, da * da


NO_SURFACE = (0, 0, 0, 0, 0, 0)


@kernel(
    motor=MOTOR, points=array(SCALAR, "n", 6, shared=True), squares=array(SCALAR, "n"), rows=array(SCALAR, "n"),
    targets=array(SCALAR, "m", 6, shared=True), others=array(SCALAR, "k", 6, shared=True),
    other_squares=array(SCALAR, "k"), other_rows=array(SCALAR, "k"), scale=SCALAR, reach=SCALAR,
    returns=(MOTOR, array(SCALAR, 6), array(SCALAR, 4)),
)  # fmt: skip
def step_between(motor, points, squares, rows, targets, others, other_squares, other_rows, scale, reach):
    """Take a Gauss-Newton step for the motor that moves points to the lines of targets, and sum its normal equations.

    The residuals are the distance of a moved point from its target along the normal, and, with a weight, the distance
    at right angles to it. Residuals r count with the weight ``1 / (1 + r r / scale scale)`` squared. Points, targets
    and others have rows of a place, a unit normal, the weight of distances at right angles to it, and the weight of
    the point.

    Parameters
    ----------
    motor
        The current motor.
    points, squares, rows
        The points that it moves, the squared distances from their nearest targets, and the rows of these.
    targets
    others, other_squares, other_rows
        Points at which the lines of moved points are looked for: the same the other way; may be none.
    scale
        The residual at which points lose three quarters of their weight.
    reach
        The distance from which on nothing is a target.

    Returns
    -------
    motor
        The motor after the step.
    information
        The upper triangle of the normal equations by x, y and the angle of a motion about the origin that follows.
    numbers
        The sum of weights, that of weights times squared residuals along the normals, the sum of the squares of the
        translation and the angle of the step.
    """

    def forth(p, square, row):
        q = pick(targets, row, NO_SURFACE)
        return _sums_of(_moved(motor, p), q, (q[2], q[3]), q[4], p[5] * q[5] * (square < reach * reach), scale)

    def back(q, square, row):
        p = pick(points, row, NO_SURFACE)
        turned = ga.sandwich(motor, assemble(PGA2, {"e20": p[2], "e01": p[3]}))
        normal = (turned["e20"], turned["e01"])
        return _sums_of(_moved(motor, p), q, normal, p[4], p[5] * q[5] * (square < reach * reach), scale)

    one, two = total(forth, points, squares, rows), total(back, others, other_squares, other_rows)
    triangle, gradient, sums = (tuple(a + b for a, b in zip(x, y, strict=True)) for x, y in zip(one, two, strict=True))
    return _with_sums(motor, triangle, gradient, sums)


def _with_sums(motor, triangle, gradient, sums):
    moved, shift, turn = _step(motor, triangle, gradient)
    return moved, triangle, (*sums, shift, turn)


@kernel(
    motor=MOTOR, points=array(SCALAR, "n", 6, shared=True), squares=array(SCALAR, "n"), rows=array(SCALAR, "n"),
    targets=array(SCALAR, "m", 6, shared=True), rules=array(SCALAR, 3), returns=array(SCALAR, 3),
)  # fmt: skip
def normals_on_lines(motor, points, squares, rows, targets, rules):
    """Sum ``n n^T`` over the normals n of points on lines that are moved to points on lines with the same normals.

    Parameters
    ----------
    motor, points, squares, rows, targets
        As of `step_between`; points on lines have the weight 1.
    rules
        The squared distance up to which a point is on a line, the least cosine of the angle between the normals, and
        the distance from the scanner from which on a point counts fully; nearer ones count less.

    Returns
    -------
    triangle
        The upper triangle of the sum.
    """

    def of(p, square, row):
        q = pick(targets, row, NO_SURFACE)
        turned = ga.sandwich(motor, assemble(PGA2, {"e20": p[2], "e01": p[3]}))
        x, y = turned["e20"], turned["e01"]
        is_on = (square < rules[0]) * (x * q[2] + y * q[3] > rules[1]) * equal(p[5], 1) * equal(q[5], 1)
        weight = is_on * ga.minimum(1, ga.sqrt(p[0] * p[0] + p[1] * p[1]) / rules[2])
        return weight * x * x, weight * x * y, weight * y * y

    return total(of, points, squares, rows)


@kernel(p=array(SCALAR, 2), returns=(SCALAR, SCALAR))
def distance_and_angle(p):
    """Compute the distance and the angle, from x towards y, at which a scanner at the origin sees a point."""
    return ga.sqrt(p[0] * p[0] + p[1] * p[1]), ga.atan2(p[1], p[0])


IN_FRONT, HIDDEN, CONTINUED = Fraction(-1, 2), Fraction(3, 10), Fraction(95, 100)
"""Scores of points where the other scan shows free space, and that it cannot show: of any, and on the continuation of a
line."""
TURN = 2 * math.pi
MANY = 10**6
"""More lines than scans and maps have."""


@kernel(
    points=POINTS, squares=array(SCALAR, "n"), distances=array(SCALAR, "n"), angles=array(SCALAR, "n"),
    closest=array(SCALAR, "b", shared=True), lines=TARGETS, first=SCALAR, step=SCALAR, scale=SCALAR, returns=SCALAR,
)  # fmt: skip
def sum_of_scores(points, squares, distances, angles, closest, lines, first, step, scale):
    """Sum the scores of points in the frame of a scan.

    A point at the distance d from the nearest target scores ``1 - d d / scale scale`` if this is positive. Others are
    in front of what the scan shows, on the continuation of its lines, behind it, or elsewhere.

    Parameters
    ----------
    points, squares, distances, angles
        Points, the squared distances from their nearest targets, and the distances and angles at which they are seen.
    closest
        The range of each beam; 0 if nothing is measured.
    lines
        Lines that are expected to continue, as targets with the factor 0.
    first, step
        The angle of the first beam, and the step between beams.
    scale
        The distance at which the score is 0.
    """
    squared = scale * scale

    def of(p, square, distance, angle):
        turns = select(step < 0, first - angle, angle - first) / TURN
        beam = (turns - floor(turns)) * TURN / absolute(step)
        range = pick(closest, floor(beam + Fraction(1, 2)), 0)
        score = 1 - square / squared
        is_hidden = (distance > range + Fraction(1, 5)) * (score <= 0)
        off = fold(
            lambda least, line: ga.minimum(least, _squared_distance(p[0], p[1], line)),
            FAR, lines, within=(0, MANY * is_hidden),
        )  # fmt: skip
        unseen = ga.maximum(HIDDEN, CONTINUED * (1 - off / squared))
        free = select(distance < Fraction(97, 100) * range - Fraction(1, 5), IN_FRONT, 0)
        return select(score > 0, score, select(is_hidden > 0, unseen, free))

    return total(of, points, squares, distances, angles)


CONSTRAINT = array(SCALAR, 6)


@kernel(a=CONSTRAINT, b=CONSTRAINT, returns=(DIRECTION, SCALAR))
def translation_votes(a, b):
    """Compute the translation that satisfies two constraints, as the meet of two lines, and its weight.

    A line seen at the distance d, turned, and the line of a map at the distance d' with the same normal n constrain the
    translation t of the scanner to the line ``n . t = d' - d``. The constraint holds the coefficients e1 e2 e0 of this
    line, the interval of positions along it (`position_along_line` of the module `pga2`) at which what was seen lies
    within the line of the map, and its weight. The weight of a vote is the sine of the angle of the lines times both
    weights; it is 0 outside of the intervals.
    """
    lines = [assemble(PGA2, {"e1": c[0], "e2": c[1], "e0": c[2]}) for c in (a, b)]
    meet = lines[0] ^ lines[1]
    sine = meet["e12"]
    parallel = absolute(sine) <= Fraction(1, 10)
    scale = 1 / select(parallel, 1, sine)
    x, y = meet["e20"] * scale, meet["e01"] * scale
    inside = 1 - parallel
    for c in (a, b):
        position = x * c[1] - y * c[0]
        inside = inside * (c[3] <= position) * (position <= c[4])
    return assemble(PGA2, {"e20": x, "e01": y}), inside * absolute(sine) * a[5] * b[5]


SEGMENTS = array(SCALAR, "m", 5, shared=True)


def _squared_distance_of_segment(x, y, segment):
    dx, dy = x - segment[0], y - segment[1]
    off, along = segment[2] * dx + segment[3] * dy, segment[2] * dy - segment[3] * dx
    beyond = ga.maximum(0, absolute(along) - segment[4])
    return off * off + beyond * beyond


@kernel(p=array(SCALAR, 2), segments=SEGMENTS, returns=(SCALAR, SCALAR))
def nearest_segment(p, segments):
    """Find the segment nearest to a point: the squared distance and its row.

    A segment is its middle, its unit normal, and half of its length.
    """
    return least(lambda segment: _squared_distance_of_segment(p[0], p[1], segment), segments)


# Places in a map: its segments are listed in the cells of a grid.

ENTRIES, STARTS, GRID = array(SCALAR, "e", shared=True), array(SCALAR, "c", shared=True), array(SCALAR, 6)
MAP = dict(segments=SEGMENTS, entries=ENTRIES, starts=STARTS, grid=GRID)
NO_SEGMENT = (0, 0, 0, 0, 0)
WALL = Fraction(1, 2)
"""Half of the length, in metres, of the shortest segment that hides what is behind it."""
SEES_THROUGH, SHARE_OF_RANGE = Fraction(2, 5), Fraction(103, 100)
"""Metres beyond a segment, and the share of its range, from which on a reading contradicts it."""
CONTRADICTION = Fraction(1, 10)
"""What a contradicting reading costs, in readings that agree."""


def _entries_at(x, y, starts, grid):
    """Return the interval of entries of the cell of a point; without entries outside of the grid."""
    column, row = floor((x - grid[0]) / grid[2]), floor((y - grid[1]) / grid[2])
    is_inside = (column >= 0) * (column < grid[3]) * (row >= 0) * (row < grid[4])
    cell = select(is_inside > 0, row * grid[3] + column, -1)
    return pick(starts, cell, 0), pick(starts, cell + 1, 0)


def _nearest_at(at, segments, entries, starts, grid):
    """Return the squared distance of the nearest segment and its row among those of the cell of a point."""

    def nearer(best, entry):
        square = _squared_distance_of_segment(at.x, at.y, pick(segments, entry, NO_SEGMENT))
        is_nearer = square < best[0]
        return select(is_nearer, square, best[0]), select(is_nearer, entry, best[1])

    return fold(nearer, (FAR, -1), entries, within=_entries_at(at.x, at.y, starts, grid))


@kernel(motor=MOTOR, points=array(SCALAR, "n", 2, shared=True), **MAP, scale=SCALAR, returns=SCALAR)
def sum_of_place_scores(motor, points, segments, entries, starts, grid, scale):
    """Sum the scores of readings of a scan at a place in a map.

    A reading at the distance d from the nearest segment scores ``1 - d d / scale scale`` if this is positive, less a
    tenth if a wall is in front of it.

    Parameters
    ----------
    motor
        The place: the motor from the frame of the scan to that of the map.
    points
        The readings.
    segments
        The map: middles, unit normals, and halves of lengths.
    entries, starts
        Rows of segments, cell after cell, and the number of the first entry of each cell, with that after the last one.
    grid
        The corner x, y of the grid, the size of cells, the numbers of columns and rows, and the distance up to which
        the segments of a cell are listed.
    scale
        The distance at which the score is 0.
    """
    origin = _moved(motor, NONE)
    # No cell is farther from the scanner than this, however far its readings are.
    farthest = sum(
        ga.maximum(absolute(low - at), absolute(low + grid[2] * count - at))
        for low, count, at in ((grid[0], grid[3], origin.x), (grid[1], grid[4], origin.y))
    )

    def of(p):
        at = _moved(motor, p)
        square, _ = _nearest_at(at, segments, entries, starts, grid)
        range = ga.sqrt(p[0] * p[0] + p[1] * p[1])
        limit = (range - SEES_THROUGH) / SHARE_OF_RANGE
        dx, dy = (at.x - origin.x) / range, (at.y - origin.y) / range

        def blocks(hit, entry):
            x, y, nx, ny, half = pick(segments, entry, NO_SEGMENT)
            x, y = x - origin.x, y - origin.y
            cosine = nx * dx + ny * dy
            is_grazing = absolute(cosine) <= Fraction(1, 1000)
            distance = (nx * x + ny * y) / select(is_grazing, 1, cosine)
            along = nx * (distance * dy - y) - ny * (distance * dx - x)
            is_hit = (1 - is_grazing) * (distance > 0) * (distance < limit) * (absolute(along) <= half)
            return ga.maximum(hit, is_hit * (half > WALL))

        # Each piece of the beam is within the reach of the cell of its middle.
        def piece(state):
            distance = (2 * state[0] + 1) * grid[5]
            within = _entries_at(origin.x + distance * dx, origin.y + distance * dy, starts, grid)
            return state[0] + 1, fold(blocks, 0, entries, within=within, until=lambda hit: hit > 0)

        pieces = floor(ga.minimum(limit, farthest) / (2 * grid[5])) + 1
        (_, is_behind), _, _ = iterate(piece, (0, 0), lambda _, new: new[1] > 0, pieces)
        return ga.maximum(1 - square / (scale * scale), 0) - CONTRADICTION * is_behind

    return total(of, points)


@kernel(
    motor=MOTOR, points=array(SCALAR, "n", 2, shared=True), **MAP, scale=SCALAR, reach=SCALAR,
    returns=(MOTOR, array(SCALAR, 6), array(SCALAR, 4)),
)  # fmt: skip
def step_to_map(motor, points, segments, entries, starts, grid, scale, reach):
    """Take a Gauss-Newton step for the place of a scan in a map, as `step_between` and `sum_of_place_scores` say."""

    def of(p):
        at = _moved(motor, p)
        square, row = _nearest_at(at, segments, entries, starts, grid)
        q = pick(segments, row, NO_SEGMENT)
        return _sums_of(at, q, (q[2], q[3]), 0, square < reach * reach, scale)

    return _with_sums(motor, *total(of, points))
