"""Laser scans in the plane: lines of runs of points, votes for motions between scans, and their refinement.

Points and lines are those of G(2,0,1), as in the module `pga2`. A motor takes the coordinates of a scan to those of
another one, or of a map. Kernels of one beam, line or point come first, then loops over the points of a scan.
"""

from fractions import Fraction
from typing import Any, NamedTuple

import gacompiler as ga
from gacompiler import SCALAR, absolute, array, assemble, kernel, least, scan, select, total
from gacompiler.algebra.catalog import PGA2

POINT, LINE, MOTOR, DIRECTION = PGA2.POINT, PGA2.LINE, PGA2.MOTOR, PGA2.DIRECTION
POINTS, TARGETS = array(SCALAR, "n", 2), array(SCALAR, "m", 5, shared=True)
SUMS = array(SCALAR, 5)
FAR = 10**30
TINY = Fraction(1, 10**30)


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


@kernel(p=array(SCALAR, 2), a=array(SCALAR, 2), b=array(SCALAR, 2), returns=SCALAR)
def squared_distance_from_chord(p, a, b):
    """Compute the squared distance of `p` from the line through `a` and `b`, or from `a` if they coincide."""
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


@kernel(p=array(SCALAR, 2), targets=TARGETS, returns=SCALAR)
def nearest_square(p, targets):
    """Compute the squared distance from the nearest of some targets, as `nearest` does; a large number for none."""
    return ga.fold(lambda least, target: ga.minimum(least, _squared_distance(p[0], p[1], target)), FAR, targets)


class Moved(NamedTuple):
    """A point, moved by a motor."""

    x: Any
    y: Any


def _moved(motor, p):
    moved = ga.sandwich(motor, assemble(PGA2, {"e20": p[0], "e01": p[1], "e12": 1}))
    return Moved(moved["e20"], moved["e01"])


@kernel(
    motor=MOTOR, points=POINTS, targets=POINTS, normals=POINTS, across=array(SCALAR, "n"), weights=array(SCALAR, "n"),
    scale=SCALAR, returns=(MOTOR, array(SCALAR, 6), array(SCALAR, 4)),
)  # fmt: skip
def alignment_step(motor, points, targets, normals, across, weights, scale):
    """Take a Gauss-Newton step for the motor that moves points to lines, and sum its normal equations.

    The residuals are the distance of a moved point from its target along the normal, and, with the weight `across`,
    the distance at right angles to it. Residuals r count with the weight ``1 / (1 + r r / scale scale)`` squared.

    Parameters
    ----------
    motor
        The current motor.
    points
        The points that it moves.
    targets, normals
        For each point, a point of its line, and the unit normal there.
    across
        The weights of distances along the lines.
    weights
        The weights of points; those without a target have 0.
    scale
        The residual at which points lose three quarters of their weight.

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

    def of(p, q, n, e, w):
        at = _moved(motor, p)
        off = (at.x - q[0], at.y - q[1])
        along = n[0] * off[0] + n[1] * off[1]
        side = -n[1] * off[0] + n[0] * off[1]
        ratio = 1 / (1 + (along * along + e * side * side) / (scale * scale))
        weight = w * ratio * ratio
        row = (n[0], n[1], n[1] * at.x - n[0] * at.y)
        other = (-n[1], n[0], n[0] * at.x + n[1] * at.y)
        triangle = tuple(weight * (row[i] * row[j] + e * other[i] * other[j]) for i in range(3) for j in range(i, 3))
        gradient = tuple(weight * (row[i] * along + e * other[i] * side) for i in range(3))
        return triangle, gradient, (weight, weight * along * along)

    triangle, gradient, sums = total(of, points, targets, normals, across, weights)
    xx, xy, xa, yy, ya, aa = triangle
    # A small increment of the diagonal keeps directions that no residual determines.
    damping = Fraction(1, 10**6) * (xx + yy) + TINY
    turning = Fraction(1, 10**6) * aa + TINY
    matrix = ((xx + damping, xy, xa), (xy, yy + damping, ya), (xa, ya, aa + turning))
    (dx, dy, da), _ = ga.solve_symmetric(matrix, tuple(-g for g in gradient))
    step = assemble(PGA2, {"1": 1, "e20": dy / 2, "e01": -dx / 2}) * assemble(
        PGA2, {"1": ga.cos(da / 2), "e12": -ga.sin(da / 2)}
    )
    return ga.normalize(step * motor), triangle, (*sums, dx * dx + dy * dy, da * da)


@kernel(p=array(SCALAR, 2), returns=(SCALAR, SCALAR))
def distance_and_angle(p):
    """Compute the distance and the angle, from x towards y, at which a scanner at the origin sees a point."""
    return ga.sqrt(p[0] * p[0] + p[1] * p[1]), ga.atan2(p[1], p[0])


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


@kernel(origin=array(SCALAR, 2), direction=array(SCALAR, 2), segments=SEGMENTS, returns=SCALAR)
def expected_range(origin, direction, segments):
    """Compute the range at which a beam with a unit direction hits the first of some segments; a large number if none.

    A segment is its middle, its unit normal, and half of its length.
    """

    def hit(found, segment):
        dx, dy = segment[0] - origin[0], segment[1] - origin[1]
        cosine = segment[2] * direction[0] + segment[3] * direction[1]
        grazing = absolute(cosine) <= Fraction(1, 1000)
        distance = (segment[2] * dx + segment[3] * dy) / select(grazing, 1, cosine)
        along = segment[2] * (distance * direction[1] - dy) - segment[3] * (distance * direction[0] - dx)
        hits = (1 - grazing) * (distance > 0) * (absolute(along) <= segment[4])
        return select(hits, ga.minimum(found, distance), found)

    return ga.fold(hit, FAR, segments)
