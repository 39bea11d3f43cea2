"""Plane-based geometric algebra G(2,0,1) of the Euclidean plane: points, lines and rigid motions.

Lines are vectors: ``a e1 + b e2 + c e0`` is the line ``a x + b y + c = 0``. Points are bivectors: ``x e20 + y e01 +
e12``. A bivector without the term ``e12`` is a direction, which is invariant under translations.

A motor ``m`` moves every element by the same product ``m x ~m``. The motor ``exp(-angle/2 p)`` rotates about the point
``p`` from x towards y, and ``1 + (y e20 - x e01)/2`` translates by (x, y). The product ``m n`` applies ``n`` first.
``m`` and ``-m`` represent the same motion. Angles are in radians; lengths are in the units of the coordinates.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import PGA2
from gacompiler.specs.families.motors import motors
from gacompiler.specs.families.plane_based import (
    coordinates,
    dot,
    gap_of_parallels,
    motions,
    points_and_lines,
    products,
    twists,
)
from gacompiler.specs.families.rotations import direction_of_matrix

POINT, DIRECTION, LINE, UNIT_LINE = PGA2.POINT, PGA2.DIRECTION, PGA2.LINE, PGA2.UNIT_LINE
MOTOR, ROTOR, EVEN, BIVECTOR = PGA2.MOTOR, PGA2.ROTOR, PGA2.EVEN, PGA2.BIVECTOR
VECTOR, MATRIX = array(SCALAR, 2), array(SCALAR, 3, 3)

ORIGIN = PGA2.multivector({"e12": 1})
AXES = tuple(PGA2.multivector({name: 1}) for name in ("e20", "e01"))
PARALLEL = Fraction(1, 10**24)
"""Squared sines up to this value are treated as rounding errors."""
NEARLY_OPPOSITE = Fraction(1, 10**4)


def _rotor(angle):
    return ga.assemble(PGA2, {"1": ga.cos(angle / 2), "e12": -ga.sin(angle / 2)})


def _translator(v):
    return ga.assemble(PGA2, {"1": 1, "e20": v[1] / 2, "e01": -v[0] / 2})


def _bivector(v):
    return ga.assemble(PGA2, {"e20": v[0], "e01": v[1]})


def _line(n, e0):
    return ga.assemble(PGA2, {"e1": n[0], "e2": n[1], "e0": e0})


PRODUCTS = products(PGA2, hyperplanes="lines")
POINTS_AND_LINES, MOTORS = points_and_lines(PGA2), motors(PGA2, BIVECTOR, motion="motion")
MOTIONS, TWISTS = motions(PGA2, _translator), twists(PGA2, BIVECTOR)


# Products, involutions and duals of general elements.

geometric_product = PRODUCTS.geometric_product
outer_product = PRODUCTS.outer_product
regressive_product = PRODUCTS.regressive_product
inner_product = PRODUCTS.inner_product
reverse = PRODUCTS.reverse
grade_involution = PRODUCTS.grade_involution
dual = PRODUCTS.dual
undual = PRODUCTS.undual
norm = PRODUCTS.norm


# Points and lines.


@kernel(b=BIVECTOR, returns=POINT)
def point_from_bivector(b):
    """Scale a bivector to the point of weight 1. The weight, the coefficient of e12, must not be 0."""
    return b / b["e12"]


normalize_line = POINTS_AND_LINES.normalize_line.documented(
    "Divide a line by the length of its normal, which must not be 0."
)
join_points = POINTS_AND_LINES.join_points.documented(
    """Compute the line from `a` to `b`, with the normal on its left; its norm is their distance.

    It is 0 if the points coincide.
    """
)
join_point_direction = POINTS_AND_LINES.join_point_direction


@kernel(line=LINE, other=LINE)
def meet_lines(line, other):
    """Compute the weighted point in which two lines meet. The weight is the sine of the angle from `line` to `other`.

    Parallel lines meet in a direction (weight 0). The result is 0 if the lines coincide.
    """
    return line ^ other


@kernel(p=POINT, line=LINE)
def line_orthogonal_to_line(p, line):
    """Compute the line through the point `p` along the normal of a line, with the same norm."""
    return ga.inner_product(p, line)


distance_squared_points = POINTS_AND_LINES.distance_squared_points
distance_points = POINTS_AND_LINES.distance_points


@kernel(p=POINT, line=UNIT_LINE)
def signed_distance_point_line(p, line):
    """Compute the distance from a point to a normalised line, positive on the side of the normal."""
    return p & line


@kernel(a=POINT, b=POINT, c=POINT)
def signed_area(a, b, c):
    """Compute twice the signed area of a triangle, positive if its vertices are in counter-clockwise order."""
    return a & b & c


@kernel(line=LINE, other=LINE)
def angle_between_lines(line, other):
    """Compute the angle from the normal of `line` to that of `other`, in (-pi, pi], positive from x towards y."""
    return ga.atan2((line ^ other)["e12"], ga.scalar_product(line, other))


@kernel(p=POINT, line=LINE)
def project_point_on_line(p, line):
    """Project the point `p` orthogonally onto a line of any nonzero norm."""
    return ga.inner_product(p, line) * ga.inverse(line)


@kernel(p=POINT, line=UNIT_LINE)
def project_point_on_unit_line(p, line):
    """Project the point `p` orthogonally onto a normalised line."""
    return ga.inner_product(p, line) * line


@kernel(p=POINT, line=UNIT_LINE)
def reflect_point(p, line):
    """Reflect the point `p` in a normalised line."""
    return -(line * p * line)


# Conversion of coordinates to lines, and back.


@kernel(normal=DIRECTION, distance=SCALAR, returns=LINE)
def line_from_normal(normal, distance):
    """Construct the line ``normal . x = distance``; for a unit normal, the signed distance from the origin."""
    return _line(coordinates(normal), -distance)


@kernel(p=POINT, normal=DIRECTION, returns=LINE)
def line_from_point_normal(p, normal):
    """Construct the line through the point `p` with a given normal; the norm of the line is the normal's length."""
    n = coordinates(normal)
    return _line(n, -dot(coordinates(p), n))


@kernel(line=LINE, returns=(DIRECTION, SCALAR))
def line_to_normal(line):
    """Extract the unit normal of a line and its signed distance from the origin: ``normal . x = distance``."""
    length = ga.sqrt(line["e1"] * line["e1"] + line["e2"] * line["e2"])
    return _bivector([line["e1"] / length, line["e2"] / length]), -line["e0"] / length


@kernel(line=LINE, returns=DIRECTION)
def line_direction(line):
    """Compute the direction of a line, with the norm of the line; the normal is a quarter turn to its left."""
    return _bivector([line["e2"], -line["e1"]])


@kernel(line=LINE, returns=POINT)
def line_support(line):
    """Compute the point of a line, of any nonzero norm, that is nearest to the origin."""
    return ga.inner_product(ORIGIN, line) * ga.inverse(line)


@kernel(line=UNIT_LINE, t=SCALAR, returns=POINT)
def point_on_line(line, t):
    """Compute the point of a normalised line at the signed distance `t` from its support point, along its direction."""
    return ga.inner_product(ORIGIN, line) * line + t * _bivector([line["e2"], -line["e1"]])


@kernel(p=POINT, line=UNIT_LINE, returns=SCALAR)
def position_along_line(p, line):
    """Compute the parameter `t`, as in `point_on_line`, of the point of a normalised line nearest to `p`."""
    x, y = coordinates(p)
    return x * line["e2"] - y * line["e1"]


@kernel(a=POINT, b=POINT, returns=LINE)
def bisector_line(a, b):
    """Compute the line equidistant from `a` and `b`, with normal ``b - a``; 0 if the points coincide."""
    difference = coordinates(b - a)
    return _line(difference, -dot(difference, coordinates(a + b)) / 2)


@kernel(a=UNIT_LINE, b=UNIT_LINE, returns=(LINE, LINE))
def bisectors_of_lines(a, b):
    """Compute the bisector lines ``a - b`` and ``a + b`` of two normalised lines.

    They contain the points of equal and of opposite signed distances. For parallel lines, one is the line halfway
    between them and the other is the line at infinity; for coinciding lines, one is 0.
    """
    return a - b, a + b


midpoint = POINTS_AND_LINES.midpoint


# Distances, relations, projections and reflections.


@kernel(a=UNIT_LINE, b=UNIT_LINE, returns=SCALAR)
def signed_distance_lines(a, b):
    """Compute the signed distance from the normalised line `a` to the normalised line `b` along the normal of `a`.

    It is 0 if they meet, that is, if the sine of the angle is more than 1e-12.
    """
    sine = (a ^ b)["e12"]
    same = ga.select(ga.scalar_product(a, b) < 0, -1, 1)
    return ga.select(sine * sine <= PARALLEL, a["e0"] - same * b["e0"], 0)


@kernel(a=UNIT_LINE, b=UNIT_LINE, distance=SCALAR, sine=SCALAR, returns=SCALAR)
def relation_of_lines(a, b, distance, sine):
    """Classify the relative position of two normalised lines: 0 coincident, 1 parallel, 2 intersecting.

    Distances up to `distance`, and angles with a sine up to `sine`, count as 0. The directions may be opposite.
    """
    same = ga.select(ga.scalar_product(a, b) < 0, -1, 1)
    off = distance < ga.absolute(a["e0"] - same * b["e0"])
    return ga.select(ga.absolute((a ^ b)["e12"]) <= sine, ga.select(off, 1, 0), 2)


@kernel(a=UNIT_LINE, b=UNIT_LINE, c=UNIT_LINE, distance=SCALAR, sine=SCALAR, returns=SCALAR)
def relation_of_three_lines(a, b, c, distance, sine):
    """Classify the intersection of three normalised lines: 0 a line, 1 or 3 empty, 2 a point.

    With 1 all lines are parallel. With 3 they enclose a triangle, or two of them are parallel. Distances up to
    `distance`, measured from the third line to the intersection of the two lines with the largest sine, and angles with
    a sine up to `sine`, count as 0.
    """
    ab, bc, ca = a ^ b, b ^ c, c ^ a
    sines = [ga.absolute(x["e12"]) for x in (ab, bc, ca)]
    widest = ga.maximum(sines[0], ga.maximum(sines[1], sines[2]))
    off = distance * ga.select(widest <= 0, 1, widest) < ga.absolute((ab ^ c)["e012"])
    apart = [gap_of_parallels(a, b), gap_of_parallels(b, c), gap_of_parallels(c, a)]
    beside = distance < ga.maximum(apart[0], ga.maximum(apart[1], apart[2]))
    return ga.select(widest <= sine, ga.select(beside, 1, 0), ga.select(off, 3, 2))


@kernel(line=LINE, p=POINT, returns=LINE)
def project_line_on_point(line, p):
    """Compute the line through the point `p` that is parallel to a line, with the same norm."""
    n = [line["e1"], line["e2"]]
    return _line(n, -dot(coordinates(p), n))


@kernel(p=POINT, line=UNIT_LINE, returns=DIRECTION)
def reject_point_from_line(p, line):
    """Compute the direction from the nearest point of a normalised line to the point `p`."""
    return (p ^ line) * line


@kernel(a=LINE, line=UNIT_LINE, returns=LINE)
def reflect_line(a, line):
    """Reflect the line `a` in a normalised line: its points and its normal are reflected."""
    return -(line * a * line)


@kernel(a=POINT, p=POINT, returns=POINT)
def reflect_point_in_point(a, p):
    """Reflect the point `a` in the point `p`, the midpoint of `a` and the result: a half turn about `p`."""
    return p * a * ~p


@kernel(line=LINE, p=POINT, returns=LINE)
def reflect_line_in_point(line, p):
    """Rotate a line by a half turn about the point `p`."""
    return p * line * ~p


@kernel(a=POINT, b=POINT, c=POINT, returns=SCALAR)
def collinearity_residual(a, b, c):
    """Compute the smallest height of a triangle, positive if its vertices are in counter-clockwise order.

    It is 0 if three points are collinear or if points coincide.
    """
    longest = ga.maximum(ga.norm_squared(a & b), ga.maximum(ga.norm_squared(b & c), ga.norm_squared(c & a)))
    return (a & b & c) / ga.sqrt(ga.select(longest <= 0, 1, longest))


@kernel(p=POINT, line=UNIT_LINE, returns=MOTOR)
def motor_from_flag(p, line):
    """Compute the motor that takes the origin to the point `p` and the x axis to a directed line through `p`."""
    return _translator(coordinates(p)) * _rotor_of_direction(line["e2"], -line["e1"])


@kernel(m=MOTOR, returns=(POINT, LINE))
def flag_from_motor(m):
    """Move the flag of origin and x axis, a point on a line, by the unit motor `m`."""
    return m * ORIGIN * ~m, m * PGA2.multivector({"e2": 1}) * ~m


@kernel(p=POINT, d=DIRECTION, line=LINE, returns=(SCALAR, POINT))
def hit_ray_line(p, d, line):
    """Compute the `t` for which ``p + t d`` is on a line of any nonzero norm, and that point.

    The ray hits the line if ``t >= 0``. If they are parallel, `t` is infinite, or NaN if the ray lies in the line.
    """
    t = -(p & line) / (d & line)
    return t, p + t * d


@kernel(p=POINT, d=DIRECTION, a=POINT, b=POINT, returns=(SCALAR, SCALAR))
def hit_ray_segment(p, d, a, b):
    """Compute `t` and `s` with ``p + t d = a + s (b - a)``: the ray hits if ``t >= 0`` and ``0 <= s <= 1``.

    No result is finite if they are parallel.
    """
    line, ray = a & b, p & d
    along = d & line
    return -(p & line) / along, (ray & a) / along


# Motors.

motor_product = MOTORS.motor_product
even_product = PRODUCTS.even_product
motor_inverse = MOTORS.motor_inverse


@kernel(x=EVEN, returns=MOTOR)
def normalize_motor(x):
    """Normalise an even element to a unit motor. The rotational part, of 1 and e12, must not be 0."""
    return ga.normalize(x)


move_point = MOTORS.move_point
move_direction = MOTIONS.move_direction
move_line = MOTIONS.move_line
move_point_back = MOTIONS.move_point_back


@kernel(angle=SCALAR, returns=ROTOR)
def rotor_from_angle(angle):
    """Construct the rotation about the origin by an angle in radians, from x towards y."""
    return _rotor(angle)


translator_from_vector = MOTIONS.translator_from_vector


@kernel(p=POINT, angle=SCALAR, returns=MOTOR)
def motor_from_point(p, angle):
    """Construct the rotation about a point by an angle in radians, from x towards y: ``exp(-angle/2 p)``."""
    return ga.cos(angle / 2) - ga.sin(angle / 2) * p


@kernel(angle=SCALAR, v=VECTOR, returns=MOTOR)
def motor_from_angle_translation(angle, v):
    """Construct the motor that rotates about the origin by an angle and then translates by the vector `v`."""
    return _translator(v) * _rotor(angle)


@kernel(m=MOTOR, returns=(SCALAR, VECTOR))
def motor_to_angle_translation(m):
    """Extract the angle in [-pi, pi] and the translation of a unit motor: inverse of `motor_from_angle_translation`."""
    flipped = m["1"] < 0
    angle = 2 * ga.atan2(ga.select(flipped, m["e12"], -m["e12"]), ga.absolute(m["1"]))
    return angle, coordinates(m * ORIGIN * ~m)


@kernel(m=MOTOR, returns=MATRIX)
def motor_to_matrix(m):
    """Compute the homogeneous 3 x 3 matrix of a unit motor, which acts on columns (x, y, 1)."""
    columns = [coordinates(m * axis * ~m) for axis in AXES] + [coordinates(m * ORIGIN * ~m)]
    return (*zip(*columns, strict=True), (0, 0, 1))


@kernel(matrix=MATRIX, returns=MOTOR)
def motor_from_matrix(matrix):
    """Convert a homogeneous 3 x 3 matrix of a rigid motion to the motor with nonnegative scalar part.

    The last row is not read. If the rest is not a rotation, the nearest rotation is used; the result is NaN if its
    determinant is not positive, as that of a reflection.
    """
    return _translator([matrix[0][2], matrix[1][2]]) * _rotor_of_direction(*direction_of_matrix(matrix))


motor_exponential = MOTORS.motor_exponential.documented(
    "Compute ``exp(b)`` of a bivector; ``exp(-angle/2 p)`` rotates about p. Smooth at 0 and for translations."
)
motor_logarithm = MOTORS.motor_logarithm.documented(
    "Compute the bivector of least angle with exponential `m` or `-m`, the same motion; also for pure translations."
)
motor_square_root = MOTORS.motor_square_root
motor_power = MOTORS.motor_power
interpolate_motors = MOTORS.interpolate_motors
twist_on_point = TWISTS.twist_on_point


# Screws, twists and motors in other forms.

translator_between_points = MOTIONS.translator_between_points


@kernel(a=LINE, b=LINE, returns=MOTOR)
def motor_between_lines(a, b):
    """Compute the motor that takes the normalised line `a` to `b`: a rotation about their meet, or a translation.

    If the normals are opposite to within 0.01 radians, the motor is instead the product of two reflections: in the
    bisector of `a` and the reversed `b`, and in a line orthogonal to `b`.
    """
    squared = ga.norm_squared(a + b)
    opposite = squared < NEARLY_OPPOSITE
    across = _line([b["e2"], -b["e1"]], 0)
    middle = ga.select(opposite, a - b, PGA2.multivector({"e1": 1}))
    half = ga.select(opposite, 1, 1 + b * a)
    return ga.select(opposite, across * ga.normalize(middle), ga.normalize(half))


motor_between_frames = MOTIONS.motor_between_frames
motor_relative = MOTIONS.motor_relative


@kernel(a=MOTOR, b=MOTOR, t=SCALAR, returns=MOTOR)
def blend_motors(a, b, t):
    """Normalise ``(1 - t) a + t b``, or with ``-b`` if that is nearer, to a unit motor (NLERP)."""
    near = ga.select(ga.scalar_product(a, ~b) < 0, -t, t)
    return ga.normalize((1 - t) * a + near * b)


@kernel(m=MOTOR, returns=(BIVECTOR, SCALAR))
def motor_to_point(m):
    """Decompose a unit motor into its weighted centre and its angle in [0, pi]: ``exp(-angle/2 centre)``.

    For a rotation the centre is a point with weight 1, or with weight -1 if the rotation is from y to x. For a
    translation the angle is 0 and the centre is the translation vector rotated by a quarter turn to the right.
    """
    b = -2 * ga.log(m)
    angle = ga.absolute(b["e12"])
    length = ga.select(angle <= 0, 1, angle)
    return b / length, angle


motor_from_twist = TWISTS.motor_from_twist
motor_to_twist = TWISTS.motor_to_twist


@kernel(w=SCALAR, v=VECTOR, returns=BIVECTOR)
def twist_from_velocities(w, v):
    """Construct a twist from an angular velocity, from x towards y, and the velocity of the point at the origin."""
    return ga.assemble(PGA2, {"e12": w, "e20": -v[1], "e01": v[0]})


@kernel(twist=BIVECTOR, returns=(SCALAR, VECTOR))
def twist_to_velocities(twist):
    """Extract the angular velocity of a twist, from x towards y, and the velocity of the point at the origin."""
    return twist["e12"], (twist["e01"], -twist["e20"])


motor_derivative = TWISTS.motor_derivative
twist_from_motor_derivative = TWISTS.twist_from_motor_derivative
motor_to_adjoint = TWISTS.motor_to_adjoint.documented(
    "Compute the 3 x 3 matrix by which a unit motor acts on the coefficients e12 e20 e01 of twists."
)


even_inverse = MOTIONS.even_inverse.documented(
    "Compute the inverse of an even element. The rotational part, of 1 and e12, must not be 0."
)


@kernel(z=VECTOR, returns=ROTOR)
def rotor_from_complex(z):
    """Construct the rotation by the angle of the nonzero complex number ``z[0] + z[1] i``."""
    return _rotor_of_direction(z[0], z[1])


@kernel(r=ROTOR, returns=VECTOR)
def rotor_to_complex(r):
    """Convert a rotor to the complex number of length 1, as real and imaginary part, with the angle of the rotation."""
    return r["1"] * r["1"] - r["e12"] * r["e12"], -2 * r["1"] * r["e12"]


def _rotor_of_direction(cosine, sine):
    """Return the rotor, with nonnegative scalar part, of the angle of (cosine, sine), of any nonzero length."""
    length = ga.sqrt(cosine * cosine + sine * sine)
    sharp, left = cosine >= 0, ga.select(sine < 0, -1, 1)
    w = ga.select(sharp, length + cosine, left * sine)
    z = ga.select(sharp, sine, left * (length - cosine))
    return ga.assemble(PGA2, {"1": w, "e12": -z}) / ga.sqrt(w * w + z * z)


twist_on_line = TWISTS.twist_on_line
