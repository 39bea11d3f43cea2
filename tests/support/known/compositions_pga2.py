"""Compositions of motions with joins, meets and invariants in 2D plane-based geometric algebra."""

from gacompiler import inner_product, join, kernel, meet, norm_squared, right_contraction, sandwich, scalar_product
from gacompiler.algebra.catalog import PGA2

MOTOR, ROTOR, TRANSLATOR, POINT = PGA2.MOTOR, PGA2.ROTOR, PGA2.TRANSLATOR, PGA2.POINT
LINE, UNIT_LINE = PGA2.LINE, PGA2.UNIT_LINE


@kernel(m=MOTOR, a=POINT, b=POINT)
def line_through_moved_points_2d(m, a, b):
    """The line through two points after they were moved."""
    return join(sandwich(m, a), sandwich(m, b))


@kernel(m=MOTOR, a=POINT, b=POINT)
def distance_squared_of_moved_points_2d(m, a, b):
    """The squared distance of two points after they were moved."""
    return norm_squared(join(sandwich(m, a), sandwich(m, b)))


@kernel(m=MOTOR, n=MOTOR, a=POINT, b=POINT)
def distance_squared_under_two_motors_2d(m, n, a, b):
    """The squared distance of two points, each moved by its own motor."""
    return norm_squared(join(sandwich(m, a), sandwich(n, b)))


@kernel(m=MOTOR, a=LINE, b=LINE)
def meet_of_moved_lines_2d(m, a, b):
    """The intersection of two lines after they were moved."""
    return meet(sandwich(m, a), sandwich(m, b))


@kernel(m=MOTOR, a=LINE, b=LINE)
def cosine_between_moved_lines_2d(m, a, b):
    """The inner product of two lines after they were moved."""
    return inner_product(sandwich(m, a), sandwich(m, b))


@kernel(m=MOTOR, p=POINT, line=LINE)
def moved_point_to_line_2d(m, p, line):
    """The residual of point-to-line registration."""
    return join(sandwich(m, p), line)


@kernel(m=MOTOR, p=POINT, line=LINE)
def moved_point_to_moved_line_2d(m, p, line):
    """The distance of a point from a line after both were moved."""
    return join(sandwich(m, p), sandwich(m, line))


@kernel(m=MOTOR, n=MOTOR, line=LINE)
def two_motors_line_2d(m, n, line):
    """A line after two joints."""
    return sandwich(m, sandwich(n, line))


@kernel(a=MOTOR, b=MOTOR, c=MOTOR, p=POINT)
def three_motors_point_2d(a, b, c, p):
    """A point at the end of three links."""
    return sandwich(a * b * c, p)


@kernel(m=MOTOR, p=POINT)
def displacement_of_point_2d(m, p):
    """The displacement of a point by a motor."""
    return sandwich(m, p) - p


@kernel(m=MOTOR, p=POINT)
def point_moved_twice_2d(m, p):
    """A point moved by the same motor twice."""
    return sandwich(m, sandwich(m, p))


@kernel(m=MOTOR, n=MOTOR)
def commutator_of_motors_2d(m, n):
    """The group commutator of two motions."""
    return m * n * ~m * ~n


@kernel(t=TRANSLATOR, r=ROTOR, p=POINT)
def point_turned_about_another_2d(t, r, p):
    """A point turned about another point than the origin."""
    return sandwich(t * r * ~t, p)


@kernel(a=UNIT_LINE, b=UNIT_LINE, p=POINT)
def point_reflected_twice_2d(a, b, p):
    """A point reflected in two lines."""
    return sandwich(b, sandwich(a, p))


@kernel(n=UNIT_LINE, a=POINT, b=POINT)
def distance_squared_of_mirrored_points_2d(n, a, b):
    """The squared distance of the mirror images of two points."""
    return norm_squared(join(sandwich(n, a), sandwich(n, b)))


@kernel(line=UNIT_LINE, m=MOTOR, p=POINT)
def shadow_of_moved_point_2d(line, m, p):
    """The projection of a moved point on a line."""
    return right_contraction(sandwich(m, p), line) * line


@kernel(m=MOTOR, a=POINT, b=POINT, c=POINT, d=POINT)
def crossing_of_moved_segments_2d(m, a, b, c, d):
    """The intersection of two lines through two moved points each."""
    return meet(join(sandwich(m, a), sandwich(m, b)), join(sandwich(m, c), sandwich(m, d)))


@kernel(a=POINT, b=POINT, c=POINT)
def cosine_of_angle_at_point_2d(a, b, c):
    """The inner product of the lines from one point to two others."""
    return scalar_product(join(a, b), join(a, c))
