"""Maps of line segments and graphs of poses in the plane, by lines and motors of G(2,0,1).

A pose is a unit motor from the frame of the robot to that of the map. Its perturbation is a motion in its own frame: an
angle and a translation, in this order. A segment of a map is a normalised line, with a middle point on it and two
positions along the line, as in `pga2.position_along_line`. The error of a line is its angle and its offset at the
middle, in this order; covariances and information are given by their upper triangles.
"""

import gacompiler as ga
from gacompiler import SCALAR, array, kernel, total
from gacompiler.algebra.catalog import PGA2
from gacompiler.specs import pga2
from gacompiler.specs.families.plane_based import coordinates

POINT, UNIT_LINE, MOTOR = PGA2.POINT, PGA2.UNIT_LINE, PGA2.MOTOR
VECTOR, TRIANGLE, TWIST, MATRIX = array(SCALAR, 2), array(SCALAR, 3), array(SCALAR, 3), array(SCALAR, 3, 3)
ORIGIN = PGA2.multivector({"e12": 1})

angle_between_lines = pga2.angle_between_lines.function
motor_to_angle_translation = pga2.motor_to_angle_translation.function
position_along_line = pga2.position_along_line.function
move_line = pga2.move_line.function


# Graphs of poses.


def _turn(m):
    """Return the cosine and the sine of the angle of a unit motor."""
    return m["1"] * m["1"] - m["e12"] * m["e12"], -2 * m["1"] * m["e12"]


@kernel(a=MOTOR, b=MOTOR, motion=MOTOR, returns=(TWIST, MATRIX, MATRIX))
def edge_of_poses(a, b, motion):
    """Compute the misfit ``~motion ~a b`` of a measured motion between two poses, and its derivatives.

    Returns
    -------
    misfit
        The angle in [-pi, pi] and the translation.
    by_a, by_b
        The derivatives with respect to perturbations ``a T(d)`` and ``b T(d)``.
    """
    between = ~a * b
    angle, (x, y) = motor_to_angle_translation(~motion * between)
    c, s = _turn(~motion * between)
    by_b = ((1, 0, 0), (0, c, -s), (0, s, c))
    p, q = coordinates(between * ORIGIN * ~between)
    c, s = _turn(motion)
    # The point (p, q) moves by (q, -p) if frame a turns by a small angle, and the motion's inverse turns that.
    by_a = ((-1, 0, 0), (c * q - s * p, -c, -s), (-s * q - c * p, s, -c))
    return (angle, x, y), by_a, by_b


# Alignment of scans.

POINTS, NUMBERS = array(SCALAR, "n", 2), array(SCALAR, "n")


@kernel(
    m=MOTOR, points=POINTS, targets=POINTS, normals=POINTS, weights=NUMBERS, scale=SCALAR,
    returns=(array(SCALAR, 6), TWIST, SCALAR, SCALAR),
)  # fmt: skip
def sums_of_distances(m, points, targets, normals, weights, scale):
    """Sum the normal equations of distances of moved points from lines, by perturbations ``m T(d)`` of the pose.

    Parameters
    ----------
    m
        The pose that moves the points.
    points
        Points in the frame of the robot.
    targets, normals
        For each point, a point of its line, and the unit normal of the line.
    weights
        Of the points.
    scale
        The distance at which points lose three quarters of their weight.

    Returns
    -------
    triangle, gradient
        The upper triangle of the matrix, and the right-hand side with the sign of the derivative of the sum.
    total
        The sum of weights, reduced by distances.
    squares
        The sum of squared distances with these weights.
    """

    def of(p, q, n, w):
        at = coordinates(ga.sandwich(m, ga.assemble(PGA2, {"e20": p[0], "e01": p[1], "e12": 1})))
        x, y = coordinates(ga.sandwich(~m, ga.assemble(PGA2, {"e20": n[0], "e01": n[1]})))
        distance = n[0] * (at[0] - q[0]) + n[1] * (at[1] - q[1])
        share = 1 / (1 + distance * distance / (scale * scale))
        weight = w * share * share
        row = (y * p[0] - x * p[1], x, y)
        matrix = tuple(weight * row[i] * row[j] for i in range(3) for j in range(i, 3))
        return matrix, tuple(weight * distance * r for r in row), weight, weight * distance * distance

    return total(of, points, targets, normals, weights)


# Segments of lines.


@kernel(
    line=UNIT_LINE, middle=POINT, other=UNIT_LINE, other_middle=POINT, covariance=TRIANGLE,
    returns=(VECTOR, TRIANGLE),
)  # fmt: skip
def line_seen_from(line, middle, other, other_middle, covariance):
    """Express a measured line as a small change of a line: angle, offset at its middle, and their covariance.

    Parameters
    ----------
    line, middle
        The line, and the point at which offsets are measured.
    other, other_middle, covariance
        The measured line, and the covariance of its angle and of its offset at `other_middle`.
    """
    angle, offset = angle_between_lines(line, other), -(middle & other)
    lever = position_along_line(other_middle, other) - position_along_line(middle, other)
    aa, ao, oo = covariance
    return (angle, offset), (aa, ao - lever * aa, oo - 2 * lever * ao + lever * lever * aa)


@kernel(line=UNIT_LINE, middle=POINT, change=VECTOR, returns=UNIT_LINE)
def changed_line(line, middle, change):
    """Turn a line about a point by an angle, and then move it along its normal by an offset."""
    half = change[0] / 2
    turned = move_line(ga.cos(half) - ga.sin(half) * middle, line)
    return turned - change[1] * PGA2.multivector({"e0": 1})


@kernel(a=TRIANGLE, b=TRIANGLE, change=VECTOR, returns=(VECTOR, TRIANGLE, SCALAR))
def fuse_lines(a, b, change):
    """Fuse a line with a measured change of it in information form.

    Parameters
    ----------
    a, b
        Covariances of the angle and offset of the line, and of the measured change.
    change
        The measured change.

    Returns
    -------
    correction
        The change of the fused line.
    covariance
        Its covariance.
    square
        The squared change divided by its covariance ``a + b``.
    """
    xx, xy, yy = (p + q for p, q in zip(a, b, strict=True))
    size = xx * yy - xy * xy
    u = (yy * change[0] - xy * change[1]) / size
    v = (xx * change[1] - xy * change[0]) / size
    correction = (a[0] * u + a[1] * v, a[1] * u + a[2] * v)
    # The inverse of ``a^-1 + b^-1`` is ``a - a (a + b)^-1 a``, here as ``(det(b) a + det(a) b) / det(a + b)``.
    of_a, of_b = a[0] * a[2] - a[1] * a[1], b[0] * b[2] - b[1] * b[1]
    covariance = tuple((of_b * p + of_a * q) / size for p, q in zip(a, b, strict=True))
    return correction, covariance, change[0] * u + change[1] * v


@kernel(line=UNIT_LINE, start=SCALAR, end=SCALAR, p=POINT, q=POINT, returns=(SCALAR, SCALAR, SCALAR, SCALAR))
def overlap_of_segments(line, start, end, p, q):
    """Compare a segment of a line, between two positions along it, with the segment from p to q.

    Returns
    -------
    overlap
        The length that both cover along the line; negative, it is the gap between them.
    sine
        The sine of the angle from the line to the segment, from its point p to its point q.
    first, second
        The signed distances from the line at the ends of what both cover, or of the gap.
    """
    a, b = position_along_line(p, line), position_along_line(q, line)
    from_p, from_q = p & line, q & line
    low, high = ga.maximum(start, ga.minimum(a, b)), ga.minimum(end, ga.maximum(a, b))
    along, length = b - a, ga.norm(p & q)
    safe = ga.select(length <= 0, 1, length)
    share = ga.select(ga.absolute(along) <= length / 1000, 0, 1)
    slope = share * (from_q - from_p) / ga.select(share > 0, along, 1)
    return high - low, (from_q - from_p) / safe, from_p + slope * (low - a), from_p + slope * (high - a)
