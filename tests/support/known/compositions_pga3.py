"""Compositions of motions with joins, meets, projections and invariants in 3D plane-based geometric algebra."""

from gacompiler import (
    commutator,
    inner_product,
    join,
    kernel,
    meet,
    norm_squared,
    right_contraction,
    sandwich,
    scalar_product,
)
from gacompiler.algebra.catalog import PGA3

MOTOR, ROTOR, TRANSLATOR, POINT, DIRECTION = PGA3.MOTOR, PGA3.ROTOR, PGA3.TRANSLATOR, PGA3.POINT, PGA3.DIRECTION
LINE, PLANE, UNIT_LINE, UNIT_PLANE, TRIVECTOR = PGA3.LINE, PGA3.PLANE, PGA3.UNIT_LINE, PGA3.UNIT_PLANE, PGA3.TRIVECTOR


@kernel(m=MOTOR, a=POINT, b=POINT, c=POINT)
def plane_of_moved_points(m, a, b, c):
    """The plane through three points after they were moved."""
    return join(join(sandwich(m, a), sandwich(m, b)), sandwich(m, c))


@kernel(m=MOTOR, a=POINT, b=POINT)
def moved_line_through_points(m, a, b):
    """The line through two points, moved."""
    return sandwich(m, join(a, b))


@kernel(m=MOTOR, a=POINT, b=POINT, c=POINT)
def moved_plane_through_points(m, a, b, c):
    """The plane through three points, moved."""
    return sandwich(m, join(join(a, b), c))


@kernel(m=MOTOR, a=PLANE, b=PLANE, c=PLANE)
def meet_of_three_moved_planes(m, a, b, c):
    """The common point of three planes after they were moved."""
    return meet(meet(sandwich(m, a), sandwich(m, b)), sandwich(m, c))


@kernel(m=MOTOR, a=PLANE, b=PLANE, c=PLANE)
def moved_meet_of_three_planes(m, a, b, c):
    """The common point of three planes, moved."""
    return sandwich(m, meet(meet(a, b), c))


@kernel(m=MOTOR, line=LINE, n=PLANE)
def moved_line_meets_plane(m, line, n):
    """The point where a moved ray meets a fixed plane."""
    return meet(sandwich(m, line), n)


@kernel(m=MOTOR, line=LINE, n=PLANE)
def moved_line_meets_moved_plane(m, line, n):
    """The point where a ray meets a plane after both were moved."""
    return meet(sandwich(m, line), sandwich(m, n))


@kernel(m=MOTOR, p=POINT, line=LINE)
def plane_of_moved_point_and_line(m, p, line):
    """The plane through a point and a line after both were moved."""
    return join(sandwich(m, p), sandwich(m, line))


@kernel(m=MOTOR, p=POINT, n=PLANE)
def moved_point_to_moved_plane(m, p, n):
    """The distance of a point from a plane after both were moved."""
    return join(sandwich(m, p), sandwich(m, n))


@kernel(m=MOTOR, p=POINT, line=UNIT_LINE)
def moved_point_line_distance_squared(m, p, line):
    """The squared distance of a moved point from a fixed line."""
    return norm_squared(join(sandwich(m, p), line))


@kernel(m=MOTOR, p=POINT, line=UNIT_LINE)
def distance_squared_moved_together(m, p, line):
    """The squared distance of a point from a line after both were moved."""
    return norm_squared(join(sandwich(m, p), sandwich(m, line)))


@kernel(m=MOTOR, a=LINE, b=LINE)
def distance_of_moved_line(m, a, b):
    """The reciprocal product of a moved line and a fixed line."""
    return join(sandwich(m, a), b)


@kernel(m=MOTOR, n=MOTOR, a=LINE, b=LINE)
def distance_of_lines_of_two_bodies(m, n, a, b):
    """The reciprocal product of two lines, each moved with its own body."""
    return join(sandwich(m, a), sandwich(n, b))


@kernel(m=MOTOR, n=MOTOR, p=POINT, q=POINT)
def line_of_points_of_two_bodies(m, n, p, q):
    """The line through two points, each moved with its own body."""
    return join(sandwich(m, p), sandwich(n, q))


@kernel(m=MOTOR, n=MOTOR, a=PLANE, b=PLANE)
def cosine_between_planes_of_two_bodies(m, n, a, b):
    """The inner product of two planes, each moved with its own body."""
    return scalar_product(sandwich(m, a), sandwich(n, b))


@kernel(m=MOTOR, a=PLANE, b=PLANE)
def cosine_between_moved_planes(m, a, b):
    """The inner product of two planes that were moved together."""
    return scalar_product(sandwich(m, a), sandwich(m, b))


@kernel(m=MOTOR, n=MOTOR, p=PLANE)
def two_motors_plane(m, n, p):
    """A plane after two joints."""
    return sandwich(m, sandwich(n, p))


@kernel(m=MOTOR, n=MOTOR, d=DIRECTION)
def two_motors_direction(m, n, d):
    """A direction after two joints."""
    return sandwich(m, sandwich(n, d))


@kernel(m=MOTOR, n=MOTOR, a=POINT, b=POINT)
def line_moved_twice(m, n, a, b):
    """The line through two points after two joints."""
    return sandwich(m, sandwich(n, join(a, b)))


@kernel(m=MOTOR, n=MOTOR, a=POINT, b=POINT)
def distance_squared_moved_twice(m, n, a, b):
    """The squared distance of two points after both were moved by two motors."""
    return norm_squared(join(sandwich(m, sandwich(n, a)), sandwich(m, sandwich(n, b))))


@kernel(m=MOTOR, p=POINT)
def displacement_of_point(m, p):
    """The displacement of a point by a motor."""
    return sandwich(m, p) - p


@kernel(m=MOTOR, p=POINT)
def midpoint_of_displacement(m, p):
    """The midpoint of a point and its image."""
    return (sandwich(m, p) + p) / 2


@kernel(m=MOTOR, p=POINT)
def displacement_squared(m, p):
    """The squared length of the displacement of a point."""
    return norm_squared(join(sandwich(m, p), p))


@kernel(m=MOTOR, p=POINT)
def line_to_moved_point(m, p):
    """The line through a point and its image."""
    return join(p, sandwich(m, p))


@kernel(m=MOTOR, a=POINT, b=POINT)
def sum_of_moved_points(m, a, b):
    """The sum of two points that were moved by one motor."""
    return sandwich(m, a) + sandwich(m, b)


@kernel(m=MOTOR, n=MOTOR, p=POINT)
def mean_of_two_motions(m, n, p):
    """The mean of the images of a point under two motors."""
    return (sandwich(m, p) + sandwich(n, p)) / 2


@kernel(m=MOTOR, n=MOTOR, p=POINT)
def difference_of_two_motions(m, n, p):
    """The difference of the images of a point under two motors."""
    return sandwich(m, p) - sandwich(n, p)


@kernel(m=MOTOR, p=POINT)
def point_moved_twice(m, p):
    """A point moved by the same motor twice."""
    return sandwich(m, sandwich(m, p))


@kernel(m=MOTOR, p=POINT)
def point_moved_by_square(m, p):
    """A point moved by the square of a motor."""
    return sandwich(m * m, p)


@kernel(m=MOTOR, n=MOTOR, p=POINT)
def conjugated_motion_of_point(m, n, p):
    """A point moved by a motor that was carried to another frame."""
    return sandwich(m * n * ~m, p)


@kernel(m=MOTOR, n=MOTOR)
def commutator_of_motors(m, n):
    """The group commutator of two motions."""
    return m * n * ~m * ~n


@kernel(m=MOTOR, n=MOTOR, k=MOTOR)
def three_motors(m, n, k):
    """The pose after three links."""
    return m * n * k


@kernel(m=MOTOR, b=LINE, c=LINE)
def acceleration_of_pose(m, b, c):
    """The second derivative of a pose under a twist and its rate in the body."""
    return (m * b * b + 2 * m * c) / 4


@kernel(t=TRANSLATOR, r=ROTOR, p=POINT)
def rotation_then_translation_of_point(t, r, p):
    """A point turned about the origin and then translated."""
    return sandwich(t * r, p)


@kernel(t=TRANSLATOR, r=ROTOR, line=LINE)
def rotation_then_translation_of_line(t, r, line):
    """A line turned about the origin and then translated."""
    return sandwich(t * r, line)


@kernel(r=ROTOR, t=TRANSLATOR, p=POINT)
def point_turned_about_another(r, t, p):
    """A point turned about an axis through another point than the origin."""
    return sandwich(t * r * ~t, p)


@kernel(r=ROTOR, s=ROTOR, p=POINT)
def two_rotors_point(r, s, p):
    """A point turned by two rotors about the origin."""
    return sandwich(r * s, p)


@kernel(r=ROTOR, a=POINT, b=POINT)
def distance_squared_of_turned_points(r, a, b):
    """The squared distance of two points that were turned together."""
    return norm_squared(join(sandwich(r, a), sandwich(r, b)))


@kernel(a=UNIT_PLANE, b=UNIT_PLANE, p=POINT)
def point_reflected_twice(a, b, p):
    """A point reflected in two planes."""
    return sandwich(b, sandwich(a, p))


@kernel(a=UNIT_PLANE, b=UNIT_PLANE, line=LINE)
def line_reflected_twice(a, b, line):
    """A ray reflected in two mirrors."""
    return sandwich(b, sandwich(a, line))


@kernel(a=UNIT_LINE, b=UNIT_LINE, p=POINT)
def point_after_two_half_turns(a, b, p):
    """A point after half turns about two lines."""
    return sandwich(b, sandwich(a, p))


@kernel(n=UNIT_PLANE, a=POINT, b=POINT)
def distance_squared_of_mirrored_points(n, a, b):
    """The squared distance of the mirror images of two points."""
    return norm_squared(join(sandwich(n, a), sandwich(n, b)))


@kernel(n=UNIT_PLANE, a=POINT, b=POINT)
def mirrored_line_through_points(n, a, b):
    """The line through the mirror images of two points."""
    return join(sandwich(n, a), sandwich(n, b))


@kernel(n=UNIT_PLANE, a=POINT, b=POINT, c=POINT)
def mirrored_plane_through_points(n, a, b, c):
    """The plane through the mirror images of three points."""
    return join(join(sandwich(n, a), sandwich(n, b)), sandwich(n, c))


@kernel(p=POINT, q=POINT, n=UNIT_PLANE)
def distance_squared_of_shadows(p, q, n):
    """The squared distance of the projections of two points on a plane."""
    return norm_squared(join(right_contraction(p, n) * n, right_contraction(q, n) * n))


@kernel(m=MOTOR, p=POINT, n=UNIT_PLANE)
def shadow_of_moved_point(m, p, n):
    """The projection of a moved point on a plane."""
    return right_contraction(sandwich(m, p), n) * n


@kernel(m=MOTOR, p=POINT, n=UNIT_PLANE)
def mirror_image_of_moved_point(m, p, n):
    """The mirror image of a moved point."""
    return sandwich(n, sandwich(m, p))


@kernel(m=MOTOR, p=POINT, line=UNIT_LINE)
def foot_of_moved_point_on_line(m, p, line):
    """The projection of a moved point on a line."""
    return right_contraction(sandwich(m, p), line) * ~line


@kernel(m=MOTOR, b=LINE)
def twist_power(m, b):
    """The reciprocal product of a twist with itself in another frame."""
    return join(sandwich(m, b), sandwich(m, b))


@kernel(m=MOTOR, b=LINE)
def squared_rate_in_moved_frame(m, b):
    """The squared angular velocity of a twist in another frame."""
    return norm_squared(sandwich(m, b))


@kernel(m=MOTOR, a=LINE, b=LINE, c=LINE)
def jacobi_term_of_moved_screws(m, a, b, c):
    """The nested Lie bracket of three screws that were moved together."""
    return commutator(sandwich(m, a), commutator(sandwich(m, b), sandwich(m, c)))


@kernel(m=MOTOR, p=POINT, b=LINE)
def kinetic_energy_of_moved_mass(m, p, b):
    """Twice the kinetic energy of a unit mass at a moved point under a moved twist."""
    q, w = sandwich(m, p), sandwich(m, b)
    return join(join(q, commutator(q, w)), w)


@kernel(m=MOTOR, p=POINT, b=LINE)
def momentum_of_moved_mass(m, p, b):
    """The momentum of a unit mass at a moved point under a twist in space."""
    q = sandwich(m, p)
    return join(q, commutator(q, b))


@kernel(a=POINT, b=POINT, c=POINT, d=POINT)
def squared_distance_of_lines_through_points(a, b, c, d):
    """The square of the reciprocal product of two lines through two points each."""
    volume = join(join(a, b), join(c, d))
    return volume * volume


@kernel(a=POINT, b=POINT, c=POINT, d=POINT, e=POINT)
def line_meets_plane_of_points(a, b, c, d, e):
    """The intersection of a line through two points with a plane through three."""
    return meet(join(a, b), join(join(c, d), e))


@kernel(a=POINT, b=POINT, c=POINT, n=UNIT_PLANE)
def plane_meets_plane_of_points(a, b, c, n):
    """The line that a plane shares with the plane through three points."""
    return meet(join(join(a, b), c), n)


@kernel(a=POINT, b=POINT, c=POINT)
def cosine_of_angle_at_point(a, b, c):
    """The inner product of the lines from one point to two others."""
    return scalar_product(join(a, b), join(a, c))


@kernel(a=POINT, b=POINT, c=POINT, d=POINT)
def cosine_of_dihedral_angle(a, b, c, d):
    """The inner product of two planes that share a line through two points."""
    return scalar_product(join(join(a, b), c), join(join(a, b), d))


@kernel(m=MOTOR, t=TRIVECTOR, n=PLANE)
def moved_weighted_point_to_plane(m, t, n):
    """The residual of a weighted point that was moved, with respect to a plane."""
    return join(sandwich(m, t), n)


@kernel(m=MOTOR, line=LINE, n=UNIT_PLANE)
def shadow_of_moved_line(m, line, n):
    """The projection of a moved line on a plane."""
    return inner_product(sandwich(m, line), n) * n
