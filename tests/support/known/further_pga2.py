"""Further expressions of 2D plane-based geometric algebra: lines are vectors, points are bivectors."""

from gacompiler import join, kernel, left_contraction, meet, norm_squared, right_contraction, sandwich
from gacompiler.algebra.catalog import PGA2

MOTOR, POINT, LINE, UNIT_LINE = PGA2.MOTOR, PGA2.POINT, PGA2.LINE, PGA2.UNIT_LINE


@kernel(m=MOTOR, p=POINT)
def motor_point_2d(m, p):
    """A point moved by a motor."""
    return sandwich(m, p)


@kernel(m=MOTOR, line=LINE)
def motor_line_2d(m, line):
    """A line moved by a motor."""
    return sandwich(m, line)


@kernel(m=MOTOR, n=MOTOR)
def relative_motor_2d(m, n):
    """The motor that takes pose `m` to pose `n`, in the frame of `m`."""
    return ~m * n


@kernel(m=MOTOR, n=MOTOR, p=POINT)
def two_motors_point_2d(m, n, p):
    """A point at the end of two links."""
    return sandwich(m * n, p)


@kernel(line=UNIT_LINE, p=POINT)
def reflect_point_in_line_2d(line, p):
    """The mirror image of a point."""
    return -sandwich(line, p)


@kernel(a=POINT, b=POINT, c=POINT, d=POINT)
def crossing_of_segments_2d(a, b, c, d):
    """The intersection of two lines through two points each, with its weight."""
    return meet(join(a, b), join(c, d))


@kernel(m=MOTOR, a=POINT, b=POINT, c=POINT)
def area_of_moved_triangle_2d(m, a, b, c):
    """Twice the area of a triangle after it was moved."""
    return join(join(sandwich(m, a), sandwich(m, b)), sandwich(m, c))


@kernel(p=POINT, line=LINE)
def foot_on_line_2d(p, line):
    """The point of a line of any weight that is nearest to a point."""
    return right_contraction(p, line) * line / norm_squared(line)


@kernel(p=POINT, line=UNIT_LINE)
def perpendicular_through_point_2d(p, line):
    """The line through a point at a right angle to a line."""
    return left_contraction(line, p)
