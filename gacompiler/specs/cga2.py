"""Conformal geometry of the plane in G(3,1) with the null basis ``e0, einf`` and ``einf . e0 = -1``.

The point at x is ``x + e0 + x**2/2 einf``; its two coordinates are stored. Point pairs are ``a ^ b``, circles ``a ^ b ^
c``, lines ``a ^ b ^ einf``. A *dual* circle is the vector ``c - r**2/2 einf`` of its centre c and radius r, and a
*dual* line is ``n + d einf`` for the line ``n . x = d``. `polarity`, multiplication by ``e012inf**-1``, takes one to a
multiple of the other. The normal of a line is its direction rotated counter-clockwise by a right angle.

A `kind` is 1 for real, 0 for tangent (of radius 0), -1 for imaginary, 2 for flat, parallel or concentric, and 3 for
coinciding objects. It is determined with a tolerance of 1e-12 relative to the squares of the radii and of the distances
from the origin; `radius_squared` of a result gives the same information without a tolerance.

Even versors transform every element by ``v x ~v``: the rotor ``exp(-angle/2 e12)``, the translator ``1 - t einf/2``,
the dilator ``exp(log(scale)/2 e0inf)``, the transversor ``1 + b e0``. Angles are in radians, counter-clockwise.
"""

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import CGA2
from gacompiler.specs.families.conformal import lines_and_rounds, points, products
from gacompiler.specs.families.conformal_space import (
    NEARLY_ZERO,
    ConformalSpace,
    distance_of_spheres,
    dot,
    hit_ray,
    kind_of_round,
    length_of,
    sign_of,
    undefined_where,
    unit_blade,
    vanishes,
    versor_between,
)
from gacompiler.specs.families.conformal_versors import conformal_maps, versors
from gacompiler.specs.families.motors import motors
from gacompiler.specs.families.rotations import rotations_of_the_plane

POINT, VECTOR, DUAL_LINE, POINT_PAIR = CGA2.POINT, CGA2.VECTOR, CGA2.DUAL_LINE, CGA2.POINT_PAIR
LINE, CIRCLE = CGA2.LINE, CGA2.CIRCLE
ROTOR, MOTOR, UNIT_EVEN = CGA2.ROTOR, CGA2.MOTOR, CGA2.UNIT_EVEN
COORDINATES = array(SCALAR, 2)
GENERATOR = CGA2.layout("GENERATOR", "e12 e1inf e2inf")

E1, E2, E0, EINF = CGA2.basis()
PSEUDOSCALAR = CGA2.pseudoscalar
space = ConformalSpace(CGA2)
PRODUCTS = products(CGA2)
POINTS = points(space, coordinates="two", coefficients="four", sphere="circle")
LINES_AND_ROUNDS = lines_and_rounds(space, circle_dual=VECTOR, coefficients="four")
MOTORS = motors(CGA2, GENERATOR, motion="motion")
VERSORS = versors(space, sphere="circle", coefficients="eight")
CONFORMAL_MAPS = conformal_maps(space, sphere="circle", plane="line")
ROTATIONS = rotations_of_the_plane(CGA2)


def _cross(a, b):
    return (a ^ b)["e12"]


def _left(a):
    """Return a vector rotated counter-clockwise by a right angle."""
    return a["e1"] * E2 - a["e2"] * E1


def _line(direction, moment):
    return moment * E1 * E2 * EINF + (E0 ^ direction ^ EINF)


def _line_parts(line):
    """Return unit direction, unit normal on the left, and distance from the origin along the normal."""
    direction = space.line_direction(line)
    length = length_of(direction)
    return direction / length, _left(direction) / length, -line["e12inf"] / length


def _pair_ends(pair):
    centre, half = space.coordinates(space.centre(pair)), ga.sqrt(space.radius_squared(pair))
    direction = ga.normalize(space.pair_direction(pair))
    return centre - half * direction, centre + half * direction


def _moved_squared(circle):
    return circle["e10inf"] ** 2 + circle["e20inf"] ** 2


# Products, involutions and duals of general elements.

geometric_product = PRODUCTS.geometric_product
outer_product = PRODUCTS.outer_product
regressive_product = PRODUCTS.regressive_product
inner_product = PRODUCTS.inner_product
even_product = PRODUCTS.even_product
reverse = PRODUCTS.reverse
even_reverse = PRODUCTS.even_reverse
grade_involution = PRODUCTS.grade_involution
dual = PRODUCTS.dual
undual = PRODUCTS.undual
polarity = PRODUCTS.polarity


# Points and flat points.

embed_point = POINTS.embed_point
extract_point = POINTS.extract_point
normalize_vector = POINTS.normalize_vector
inner_product_of_points = POINTS.inner_product_of_points
distance_squared_points = POINTS.distance_squared_points
distance_points = POINTS.distance_points
inner_product_of_vectors = POINTS.inner_product_of_vectors
flat_point_from_point = POINTS.flat_point_from_point
point_from_flat_point = POINTS.point_from_flat_point


# Flats and rounds, in direct and dual form. Imaginary rounds have a negative squared radius.

line_from_points = LINES_AND_ROUNDS.line_from_points.documented(
    "Construct the line ``a ^ b ^ einf`` from `a` to `b`; its square is minus their squared distance."
)
line_from_point_direction = LINES_AND_ROUNDS.line_from_point_direction


@kernel(normal=COORDINATES, distance=SCALAR, returns=LINE)
def line_from_normal(normal, distance):
    """Construct the line of all x with ``normal . x = distance``, with that normal on its left."""
    return _line(-_left(space.vector(normal)), -distance)


@kernel(p=POINT, normal=COORDINATES, returns=LINE)
def line_from_point_normal(p, normal):
    """Construct the line through `p` orthogonal to a vector, which is on its left."""
    return _line(-_left(space.vector(normal)), -dot(p, space.vector(normal)))


@kernel(a=POINT, b=POINT, returns=DUAL_LINE)
def bisector_line(a, b):
    """Compute the dual line equidistant from `a` and `b`: the difference ``b - a``, with the normal towards `b`."""
    return b - a


@kernel(normal=COORDINATES, distance=SCALAR, returns=DUAL_LINE)
def dual_line_from_normal(normal, distance):
    """Construct the dual line ``normal + distance einf`` of all x with ``normal . x = distance``."""
    return space.vector(normal) + distance * EINF


line_polarity = LINES_AND_ROUNDS.line_polarity.documented("Compute the dual of a line, with the normal on its left.")
line_from_dual = LINES_AND_ROUNDS.line_from_dual
circle_from_line = LINES_AND_ROUNDS.circle_from_line
point_pair_from_points = LINES_AND_ROUNDS.point_pair_from_points
point_pair_from_centre = LINES_AND_ROUNDS.point_pair_from_centre
circle_from_points = LINES_AND_ROUNDS.circle_from_points


@kernel(centre=POINT, radius=SCALAR, returns=VECTOR)
def dual_circle_from_centre(centre, radius):
    """Construct the dual circle ``centre - radius**2/2 einf``."""
    return centre - radius * radius / 2 * EINF


@kernel(centre=POINT, p=POINT, returns=VECTOR)
def dual_circle_through_point(centre, p):
    """Construct the dual circle with a given centre through a point."""
    return centre + ga.scalar_product(centre, p) * EINF


@kernel(centre=POINT, radius=SCALAR, returns=CIRCLE)
def circle_from_centre(centre, radius):
    """Construct the circle with the polarity ``centre - radius**2/2 einf``, a dual circle."""
    return (centre - radius * radius / 2 * EINF) * PSEUDOSCALAR


@kernel(centre=POINT, radius_squared=SCALAR, returns=CIRCLE)
def circle_from_centre_radius_squared(centre, radius_squared):
    """Construct the circle about a centre with a squared radius; imaginary if that is negative."""
    return (centre - radius_squared / 2 * EINF) * PSEUDOSCALAR


circle_polarity = LINES_AND_ROUNDS.circle_polarity.documented("Compute the dual of a circle, with a weight.")
circle_from_dual = LINES_AND_ROUNDS.circle_from_dual


@kernel(circle=CIRCLE, p=POINT, returns=LINE)
def tangent_line_of_circle(circle, p):
    """Compute the tangent line of a circle at one of its points."""
    return ga.left_contraction(p, circle) ^ EINF


# Parameters of objects.


@kernel(line=LINE, returns=COORDINATES)
def line_direction(line):
    """Compute the direction of a line, unnormalised; the normal is on its left."""
    return space.components(space.line_direction(line))


@kernel(line=LINE, returns=(COORDINATES, SCALAR))
def line_to_normal(line):
    """Extract the unit normal of a line, on its left, and its distance from the origin: ``normal . x = distance``."""
    _, normal, distance = _line_parts(line)
    return space.components(normal), distance


@kernel(line=LINE, returns=POINT)
def line_support(line):
    """Compute the point of a line that is nearest to the origin."""
    _, normal, distance = _line_parts(line)
    return space.at(distance * normal)


@kernel(circle=CIRCLE, returns=POINT)
def circle_centre(circle):
    """Compute the centre of a circle. A line has none: division by 0."""
    return space.normalized(ga.polarity(circle))


circle_radius_squared = LINES_AND_ROUNDS.circle_radius_squared


@kernel(s=VECTOR)
def dual_circle_radius_squared(s):
    """Compute the squared radius of a dual circle of any nonzero weight, negative for an imaginary one."""
    return dot(s, s) / space.weight(s) ** 2


@kernel(circle=CIRCLE)
def circle_weight(circle):
    """Compute the weight of a circle. For three points it is twice the signed area; its sign is the orientation."""
    return space.weight(ga.polarity(circle))


@kernel(circle=CIRCLE)
def circle_kind(circle):
    """Classify a circle: 1 real circle, 0 point, -1 imaginary circle, 2 line."""
    return kind_of_round(circle["e120"] ** 2, _moved_squared(circle), dot(circle, circle))


point_pair_centre = LINES_AND_ROUNDS.point_pair_centre
point_pair_radius_squared = LINES_AND_ROUNDS.point_pair_radius_squared


@kernel(pair=POINT_PAIR, returns=(POINT, POINT))
def point_pair_points(pair):
    """Extract the two points of a pair, for ``a ^ b`` first `a` and then `b`. They are NaN if the pair is imaginary."""
    a, b = _pair_ends(pair)
    return space.at(a), space.at(b)


point_pair_direction = LINES_AND_ROUNDS.point_pair_direction
point_pair_weight = LINES_AND_ROUNDS.point_pair_weight
point_pair_line = LINES_AND_ROUNDS.point_pair_line


@kernel(pair=POINT_PAIR, returns=VECTOR)
def point_pair_surround_circle(pair):
    """Compute the dual circle of weight 1 of which a point pair is a diameter."""
    return space.centre(pair) - space.radius_squared(pair) / 2 * EINF


@kernel(pair=POINT_PAIR)
def point_pair_kind(pair):
    """Classify a point pair: 1 two points, 0 a double point (a tangent vector), -1 imaginary, 2 a flat point."""
    direction = space.pair_direction(pair)
    return kind_of_round(dot(direction, direction), pair["e12"] ** 2 + pair["e0inf"] ** 2, dot(pair, pair))


# Distances, in the units of the coordinates, and angles in [0, pi].


@kernel(p=POINT, line=LINE)
def signed_distance_point_line(p, line):
    """Compute the distance from a point to a line, positive on the left of the line."""
    _, normal, distance = _line_parts(line)
    return dot(p, normal) - distance


@kernel(p=POINT, circle=CIRCLE)
def signed_distance_point_circle(p, circle):
    """Compute the distance from a point to a circle, negative inside; NaN for an imaginary circle."""
    centre, square = space.sphere_parts(circle)
    return length_of(space.coordinates(p) - centre) - ga.sqrt(square)


power_of_point = POINTS.power_of_point


@kernel(a=LINE, b=LINE)
def signed_distance_lines(a, b):
    """Compute the signed distance from the line `a` to the line `b` along the normal of `a`; 0 unless parallel."""
    (d, _, p), (e, _, q) = _line_parts(a), _line_parts(b)
    return ga.select(ga.absolute(_cross(d, e)) <= NEARLY_ZERO, ga.select(dot(d, e) < 0, -q, q) - p, 0)


@kernel(line=LINE, circle=CIRCLE)
def distance_line_circle(line, circle):
    """Compute the distance between a line and a circle; 0 if they meet."""
    (_, normal, distance), (centre, square) = _line_parts(line), space.sphere_parts(circle)
    return ga.maximum(0, ga.absolute(dot(centre, normal) - distance) - ga.sqrt(square))


@kernel(a=CIRCLE, b=CIRCLE)
def distance_circles(a, b):
    """Compute the distance between two circles, which may be nested; 0 if they meet."""
    return distance_of_spheres(*space.sphere_parts(a), *space.sphere_parts(b))


@kernel(line=LINE, other=LINE)
def angle_between_lines(line, other):
    """Compute the counter-clockwise angle from the direction of `line` to that of `other`, in (-pi, pi]."""
    d, e = space.line_direction(line), space.line_direction(other)
    return ga.atan2(_cross(d, e), dot(d, e))


inversive_distance = POINTS.inversive_distance.documented(
    """Compute the inversive distance ``-a . b / (|a| |b|)`` of dual circles or lines, a conformal invariant.

    For circles with centres at the distance d it is ``(d**2 - r**2 - s**2) / (2 r s)``: 1 if they touch from outside,
    -1 from inside. The signs of the weights matter.
    """
)
inner_product_of_point_pairs = LINES_AND_ROUNDS.inner_product_of_point_pairs


@kernel(a=VECTOR, b=VECTOR)
def angle_between_dual_circles(a, b):
    """Compute the angle between the radii of two dual circles, or between normals, where they meet; otherwise NaN."""
    return ga.acos(dot(a, b) / ga.sqrt(dot(a, a) * dot(b, b)))


# Projections and reflections.


@kernel(p=POINT, line=LINE, returns=POINT)
def project_point_on_line(p, line):
    """Project a point orthogonally onto a line."""
    _, normal, distance = _line_parts(line)
    return space.at(space.coordinates(p) - (dot(p, normal) - distance) * normal)


@kernel(p=POINT, circle=CIRCLE, returns=POINT)
def project_point_on_circle(p, circle):
    """Compute the point of a circle nearest to a point; NaN for the centre, where it is not unique."""
    centre, square = space.sphere_parts(circle)
    away = space.coordinates(p) - centre
    return space.at(centre + ga.sqrt(square) / length_of(away) * away)


@kernel(p=POINT, line=DUAL_LINE, returns=POINT)
def reflect_point(p, line):
    """Reflect a point in a dual line, whose normal may have any nonzero length."""
    return space.normalized(-(line * p * line))


# Meets.


@kernel(a=LINE, b=LINE, returns=POINT)
def meet_lines(a, b):
    """Compute the point in which two lines meet; division by 0 if they are parallel."""
    flat = a & b
    return space.point(*(flat[name] / flat["e0inf"] for name in ("e1inf", "e2inf")))


@kernel(line=LINE, circle=CIRCLE)
def meet_line_circle(line, circle):
    """Compute the point pair in which a line meets a circle, imaginary if they do not meet."""
    return line & circle


@kernel(a=CIRCLE, b=CIRCLE)
def meet_circles(a, b):
    """Compute the point pair in which two circles meet, imaginary if they do not meet."""
    return a & b


# Kinds of meets. The meet of two objects is a blade whose coefficients have degree 1, 2 and 3 in lengths. Each is
# treated as 0 up to a tolerance relative to the sizes of its operands.


def _sizes_of_vector(s):
    """Return the squared sizes of a dual circle's coefficients of degree 0, 1 and 2; its radius counts as degree 1."""
    return s["e0"] ** 2, s["e1"] ** 2 + s["e2"] ** 2 + 2 * ga.absolute(s["e0"] * s["einf"]), s["einf"] ** 2


@kernel(a=VECTOR, b=VECTOR)
def meet_dual_circles_kind(a, b):
    """Classify the intersection of two dual circles or dual lines.

    1: they meet; 0: they touch; -1: they do not meet; 2: concentric circles or parallel lines; 3: the same object, with
    any weights.
    """
    sizes, others = _sizes_of_vector(a), _sizes_of_vector(b)
    first = sizes[0] * others[1] + sizes[1] * others[0]
    middle = sizes[1] * others[1] + sizes[0] * others[2] + sizes[2] * others[0]
    last = sizes[1] * others[2] + sizes[2] * others[1]
    (v, w), (x, y) = (space.coordinates(a), space.coordinates(b)), (a["e0"], b["e0"])
    one, three = x * w - y * v, a["einf"] * w - b["einf"] * v
    across, gap = _cross(v, w), x * b["einf"] - y * a["einf"]
    same = ga.minimum(vanishes(gap * gap, middle), vanishes(dot(three, three), last))
    level = ga.select(vanishes(across * across, middle), ga.select(same, 3, 2), 1)
    squares, product, mixed = (dot(a, a), dot(b, b)), dot(a, b), ga.sqrt(middle)
    size = sizes[1] * ga.absolute(squares[1]) + others[1] * ga.absolute(squares[0])
    size = size + mixed * (2 * ga.absolute(product) + NEARLY_ZERO * mixed)
    sign = sign_of(squares[0] * squares[1] - product * product, size)
    return ga.select(vanishes(dot(one, one), first), level, sign)


@kernel(p=POINT, d=COORDINATES, circle=CIRCLE)
def hit_ray_circle(p, d, circle):
    """Compute the least nonnegative `t` for which ``p + t d`` is on a circle, from either side; NaN if there is none.

    No digits are lost for a small circle that is far away.
    """
    return hit_ray(space.coordinates(p), space.vector(d), *space.sphere_parts(circle))


# Versors.

rotor_from_angle = ROTATIONS.rotor_from_angle.documented("Construct the counter-clockwise rotation about the origin.")


@kernel(r=ROTOR)
def rotor_to_angle(r):
    """Compute the angle of a rotor, in (-2 pi, 2 pi]; `r` and ``-r``, the same rotation, differ by a full turn."""
    return 2 * ga.atan2(-r["e12"], r["1"])


@kernel(p=POINT, angle=SCALAR, returns=MOTOR)
def motor_from_point(p, angle):
    """Construct the counter-clockwise rotation about a point by an angle."""
    return ga.cos(angle / 2) - ga.sin(angle / 2) * _turn_about(space.coordinates(p))


def _turn_about(p):
    """Return a clockwise half turn about a point."""
    return E1 * E2 - (_left(p) ^ EINF)


translator_from_vector = VERSORS.translator_from_vector
dilator_from_scale = VERSORS.dilator_from_scale
dilator_to_scale = VERSORS.dilator_to_scale
transversor_from_vector = VERSORS.transversor_from_vector
motor_from_rotor_translation = VERSORS.motor_from_rotor_translation
motor_to_rotor_translation = VERSORS.motor_to_rotor_translation
motor_to_matrix = VERSORS.motor_to_matrix.documented(
    "Compute the homogeneous 3 x 3 matrix of a unit motor, which acts on columns (x, y, 1)."
)
motor_product = MOTORS.motor_product
motor_inverse = MOTORS.motor_inverse
motor_exponential = MOTORS.motor_exponential.documented(
    "Compute ``exp(b)`` of a bivector: a rotation about any point, or a translation. Smooth everywhere."
)
motor_logarithm = MOTORS.motor_logarithm
motor_square_root = MOTORS.motor_square_root
motor_power = MOTORS.motor_power
interpolate_motors = MOTORS.interpolate_motors
versor_exponential = VERSORS.versor_exponential
versor_logarithm = VERSORS.versor_logarithm
versor_square_root = VERSORS.versor_square_root
normalize_versor = VERSORS.normalize_versor
versor_from_motor = VERSORS.versor_from_motor
versor_from_dilator = VERSORS.versor_from_dilator
versor_from_transversor = VERSORS.versor_from_transversor
translator_between_points = VERSORS.translator_between_points
versor_decomposition = VERSORS.versor_decomposition
move_point = MOTORS.move_point
rotate_point = CONFORMAL_MAPS.rotate_point
translate_point = CONFORMAL_MAPS.translate_point
dilate_point = CONFORMAL_MAPS.dilate_point
move_vector = CONFORMAL_MAPS.move_vector
move_point_pair = CONFORMAL_MAPS.move_point_pair
move_line = CONFORMAL_MAPS.move_line
move_circle = CONFORMAL_MAPS.move_circle
transform_vector = CONFORMAL_MAPS.transform_vector
transform_point = CONFORMAL_MAPS.transform_point
transform_point_pair = CONFORMAL_MAPS.transform_point_pair
transform_circle = CONFORMAL_MAPS.transform_circle
invert_vector = CONFORMAL_MAPS.invert_vector
invert_point_pair = CONFORMAL_MAPS.invert_point_pair
invert_circle = CONFORMAL_MAPS.invert_circle
invert_point = CONFORMAL_MAPS.invert_point


# Versors between two objects of one kind: the square root of their ratio. Nearly opposite objects are reversed first.


@kernel(a=LINE, b=LINE, returns=MOTOR)
def motor_between_lines(a, b):
    """Compute the motor that takes the line `a` to the line `b`, including its direction; it exists for every pair.

    It rotates about their common point, or translates between parallel lines. Nearly opposite lines are reversed first.
    """
    _, normal, distance = _line_parts(a)
    return versor_between(unit_blade(a), unit_blade(b), _turn_about(distance * normal))


@kernel(a=CIRCLE, b=CIRCLE, returns=UNIT_EVEN)
def versor_between_circles(a, b):
    """Compute the versor that takes the real circle `a` to the real circle `b`, including the signs of the weights.

    If the circles are separate and have weights of the same sign, `a` is first turned inside out by an inversion and a
    reflection. The result is NaN for imaginary circles and for circles of radius 0.
    """
    one, two = unit_blade(a), unit_blade(b)
    centre, _ = space.sphere_parts(a)
    mirror = E1 + dot(centre, E1) * EINF
    signs = [sign_of(dot(circle, circle), _moved_squared(circle)) for circle in (a, b)]
    turn = (ga.polarity(one) * mirror).grade(0, 2)
    return undefined_where(ga.minimum(*signs) <= 0, versor_between(one, two, turn))


@kernel(a=POINT_PAIR, b=POINT_PAIR, returns=UNIT_EVEN)
def versor_between_point_pairs(a, b):
    """Compute the versor that takes the point pair `a` to `b`, the first point to the first.

    It is the square root of the ratio ``b a**-1``, and NaN if one pair is real and the other imaginary.
    """
    wrong = dot(a, a) * dot(b, b) <= 0
    return undefined_where(
        wrong, versor_between(unit_blade(a), unit_blade(b), _turn_about(space.coordinates(space.centre(a))))
    )


@kernel(a=POINT, b=POINT, n=COORDINATES, m=COORDINATES, scale=SCALAR, returns=UNIT_EVEN)
def similarity_between_rounds(a, b, n, m, scale):
    """Compute the versor that rotates, scales and translates a round into another one of the same kind.

    It takes the centre `a` to the centre `b`, the unit direction `n` of a point pair to `m` (use equal directions for
    circles), and scales by the positive ratio `scale` of the radii.
    """
    n, m = space.vector(n), space.vector(m)
    rotor = versor_between(n, m, E1 * E2)
    back = 1 + space.coordinates(a) * EINF / 2
    return space.translator(space.coordinates(b)) * rotor * space.dilator(scale) * back
