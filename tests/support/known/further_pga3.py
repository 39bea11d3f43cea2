"""Further expressions of 3D plane-based geometric algebra, as kinematics and registration use them."""

from gacompiler import (
    commutator,
    inner_product,
    inverse,
    join,
    kernel,
    meet,
    norm_squared,
    right_contraction,
    sandwich,
    scalar_product,
)
from gacompiler.algebra.catalog import PGA3

MOTOR, POINT, DIRECTION, LINE, PLANE = PGA3.MOTOR, PGA3.POINT, PGA3.DIRECTION, PGA3.LINE, PGA3.PLANE
UNIT_LINE, UNIT_PLANE = PGA3.UNIT_LINE, PGA3.UNIT_PLANE


@kernel(p=UNIT_PLANE, m=MOTOR)
def reflect_motor_in_plane(p, m):
    """The mirror image of a motion."""
    return sandwich(p, m)


@kernel(m=MOTOR, n=MOTOR)
def relative_motor(m, n):
    """The motor that takes pose `m` to pose `n`, in the frame of `m`."""
    return ~m * n


@kernel(m=MOTOR, n=MOTOR, p=POINT)
def relative_motor_point(m, n, p):
    """A point of frame `n` in the coordinates of frame `m`."""
    return sandwich(~m * n, p)


@kernel(m=MOTOR, n=MOTOR)
def motor_in_moved_frame(m, n):
    """The motion `n` carried out in a frame moved by `m`."""
    return sandwich(m, n)


@kernel(m=MOTOR, b=LINE)
def twist_in_body_frame(m, b):
    """The inverse adjoint: a twist given in space, seen from the body."""
    return sandwich(~m, b)


@kernel(p=POINT, b=LINE)
def velocity_of_point(p, b):
    """The velocity of a point under a twist."""
    return commutator(p, b)


@kernel(m=MOTOR, p=POINT, b=LINE)
def velocity_of_moved_point(m, p, b):
    """The velocity under a twist in space of a point given in the body."""
    return commutator(sandwich(m, p), b)


@kernel(m=MOTOR, b=LINE)
def motor_rate(m, b):
    """The derivative of a pose under a twist in the body."""
    return m * b / 2


@kernel(a=LINE, b=LINE)
def commutator_of_screws(a, b):
    """The Lie bracket of two screws."""
    return commutator(a, b)


@kernel(m=MOTOR, a=LINE, b=LINE)
def commutator_of_moved_screws(m, a, b):
    """The Lie bracket of two screws that were moved together."""
    return commutator(sandwich(m, a), sandwich(m, b))


@kernel(m=MOTOR, a=LINE, b=LINE)
def power_of_moved_screws(m, a, b):
    """The reciprocal product of a wrench and a twist after a change of frame."""
    return join(sandwich(m, a), sandwich(m, b))


@kernel(m=MOTOR, a=LINE, b=LINE)
def cosine_between_moved_lines(m, a, b):
    """The inner product of two lines that were moved together."""
    return scalar_product(sandwich(m, a), sandwich(m, b))


@kernel(p=POINT, b=LINE)
def momentum_of_point_mass(p, b):
    """The inertia map of a unit mass: the line of its momentum under a twist."""
    return join(p, commutator(p, b))


@kernel(p=POINT, b=LINE)
def kinetic_energy_of_point_mass(p, b):
    """Twice the kinetic energy of a unit mass under a twist."""
    return join(join(p, commutator(p, b)), b)


@kernel(m=MOTOR, n=MOTOR, b=LINE)
def two_motors_line(m, n, b):
    """A joint axis after two joints."""
    return sandwich(m, sandwich(n, b))


@kernel(a=MOTOR, b=MOTOR, c=MOTOR, p=POINT)
def three_motors_point(a, b, c, p):
    """A point at the end of three links."""
    return sandwich(a * b * c, p)


@kernel(m=MOTOR, n=MOTOR, p=POINT, q=POINT)
def distance_squared_under_two_motors(m, n, p, q):
    """The squared distance of two points, each moved by its own motor."""
    return norm_squared(join(sandwich(m, p), sandwich(n, q)))


@kernel(m=MOTOR, a=POINT, b=POINT, c=POINT, d=POINT)
def volume_of_moved_points(m, a, b, c, d):
    """Six times the volume of a tetrahedron that was moved."""
    return join(join(join(sandwich(m, a), sandwich(m, b)), sandwich(m, c)), sandwich(m, d))


@kernel(m=MOTOR, p=POINT, n=PLANE)
def moved_point_to_plane(m, p, n):
    """The residual of point-to-plane registration."""
    return join(sandwich(m, p), n)


@kernel(m=MOTOR, a=PLANE, b=PLANE)
def meet_of_moved_planes(m, a, b):
    """The line that two planes share after they were moved."""
    return meet(sandwich(m, a), sandwich(m, b))


@kernel(a=POINT, b=POINT, n=PLANE)
def line_through_points_meets_plane(a, b, n):
    """The intersection of a ray through two points and a plane, with its weight."""
    return meet(join(a, b), n)


@kernel(line=LINE, n=UNIT_PLANE)
def project_line_on_unit_plane(line, n):
    """The shadow of a line on a plane."""
    return inner_product(line, n) * n


@kernel(line=LINE, n=PLANE)
def project_line_on_plane(line, n):
    """The shadow of a line on a plane of any weight."""
    return inner_product(line, n) * inverse(n)


@kernel(p=POINT, line=LINE)
def plane_across_line(p, line):
    """The plane through a point at a right angle to a line."""
    return right_contraction(p, line)


@kernel(p=POINT, line=UNIT_LINE)
def point_line_distance_squared(p, line):
    """The squared distance of a point from a line."""
    return norm_squared(join(p, line))


@kernel(line=UNIT_LINE, p=POINT)
def half_turn_of_point(line, p):
    """A point turned by half a turn about a line."""
    return sandwich(line, p)


@kernel(n=UNIT_PLANE, line=LINE)
def reflect_line_in_plane(n, line):
    """The mirror image of a ray."""
    return sandwich(n, line)


@kernel(a=UNIT_LINE, b=UNIT_LINE)
def ratio_of_lines(a, b):
    """The square of the motor that takes one line to another."""
    return b * ~a
