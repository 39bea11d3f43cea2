"""Conformal geometry of the plane in G(3,1) with the null basis ``e0, einf`` and ``einf . e0 = -1``.

The point at x is ``x + e0 + x**2/2 einf``; two coordinates are stored. Point pairs are ``a ^ b``, circles
``a ^ b ^ c``, lines ``a ^ b ^ einf``. A *dual* circle is the vector ``c - r**2/2 einf`` of its centre c and radius r,
a *dual* line ``n + d einf`` for the line ``n . x = d``. `polarity`, multiplication by ``e012inf**-1``, takes one to a
multiple of the other. The normal of a line is its direction turned by a right angle, counterclockwise.

A `kind` is 1 for what is real, 0 for what is tangent (of radius 0), -1 for what is imaginary, 2 for what is flat,
parallel or concentric, 3 where two objects are the same. It is decided with a tolerance, 1e-12 of the squares of radii
and distances from the origin that enter; `radius_squared` of a result says the same without one.

Even versors move everything by ``v x ~v``: the rotor ``exp(-angle/2 e12)``, the translator ``1 - t einf/2``, the
dilator ``exp(log(scale)/2 e0inf)``, the transversor ``1 + b e0``. Angles are in radians, counterclockwise.
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
    """A vector turned by a right angle, counterclockwise."""
    return a["e1"] * E2 - a["e2"] * E1


def _line(direction, moment):
    return moment * E1 * E2 * EINF + (E0 ^ direction ^ EINF)


def _line_parts(line):
    """Unit direction, unit normal to the left, distance from the origin along the normal."""
    direction = space.line_direction(line)
    length = length_of(direction)
    return direction / length, _left(direction) / length, -line["e12inf"] / length


def _pair_ends(pair):
    centre, half = space.coordinates(space.centre(pair)), ga.sqrt(space.radius_squared(pair))
    direction = ga.normalize(space.pair_direction(pair))
    return centre - half * direction, centre + half * direction


def _moved_squared(circle):
    return circle["e10inf"] ** 2 + circle["e20inf"] ** 2


# Products, involutions and duals of any two elements.

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


# Flats and rounds, in direct and dual form; a negative squared radius is that of an imaginary round.

line_from_points = LINES_AND_ROUNDS.line_from_points.documented(
    "The line ``a ^ b ^ einf`` from `a` to `b`; its square is minus their squared distance."
)
line_from_point_direction = LINES_AND_ROUNDS.line_from_point_direction


@kernel(normal=COORDINATES, distance=SCALAR, returns=LINE)
def line_from_normal(normal, distance):
    """The line of all x with ``normal . x = distance``, with that normal on its left."""
    return _line(-_left(space.vector(normal)), -distance)


@kernel(p=POINT, normal=COORDINATES, returns=LINE)
def line_from_point_normal(p, normal):
    """The line through `p` orthogonal to a vector, which is to its left."""
    return _line(-_left(space.vector(normal)), -dot(p, space.vector(normal)))


@kernel(a=POINT, b=POINT, returns=DUAL_LINE)
def bisector_line(a, b):
    """The dual line of all points as far from `a` as from `b`: the difference ``b - a``, its normal towards `b`."""
    return b - a


@kernel(normal=COORDINATES, distance=SCALAR, returns=DUAL_LINE)
def dual_line_from_normal(normal, distance):
    """The dual line ``normal + distance einf``: all x with ``normal . x = distance``."""
    return space.vector(normal) + distance * EINF


line_polarity = LINES_AND_ROUNDS.line_polarity.documented("The dual line of a line, with the normal to its left.")
line_from_dual = LINES_AND_ROUNDS.line_from_dual
circle_from_line = LINES_AND_ROUNDS.circle_from_line
point_pair_from_points = LINES_AND_ROUNDS.point_pair_from_points
point_pair_from_centre = LINES_AND_ROUNDS.point_pair_from_centre
circle_from_points = LINES_AND_ROUNDS.circle_from_points


@kernel(centre=POINT, radius=SCALAR, returns=VECTOR)
def dual_circle_from_centre(centre, radius):
    """The dual circle ``centre - radius**2/2 einf``."""
    return centre - radius * radius / 2 * EINF


@kernel(centre=POINT, p=POINT, returns=VECTOR)
def dual_circle_through_point(centre, p):
    """The dual circle with a centre and a point on it."""
    return centre + ga.scalar_product(centre, p) * EINF


@kernel(centre=POINT, radius=SCALAR, returns=CIRCLE)
def circle_from_centre(centre, radius):
    """The circle whose polarity is the dual circle ``centre - radius**2/2 einf``."""
    return (centre - radius * radius / 2 * EINF) * PSEUDOSCALAR


@kernel(centre=POINT, radius_squared=SCALAR, returns=CIRCLE)
def circle_from_centre_radius_squared(centre, radius_squared):
    """The circle, imaginary for a negative squared radius, about a centre."""
    return (centre - radius_squared / 2 * EINF) * PSEUDOSCALAR


circle_polarity = LINES_AND_ROUNDS.circle_polarity.documented("The dual circle of a circle, with a weight.")
circle_from_dual = LINES_AND_ROUNDS.circle_from_dual


@kernel(circle=CIRCLE, p=POINT, returns=LINE)
def tangent_line_of_circle(circle, p):
    """The line that touches a circle in a point of it."""
    return ga.left_contraction(p, circle) ^ EINF


# What objects are made of.


@kernel(line=LINE, returns=COORDINATES)
def line_direction(line):
    """The direction of a line, of the length that its coefficients have; the normal is to the left of it."""
    return space.components(space.line_direction(line))


@kernel(line=LINE, returns=(COORDINATES, SCALAR))
def line_to_normal(line):
    """The unit normal of a line, on its left, and its distance from the origin along it: ``normal . x = distance``."""
    _, normal, distance = _line_parts(line)
    return space.components(normal), distance


@kernel(line=LINE, returns=POINT)
def line_support(line):
    """The point of a line that is nearest to the origin."""
    _, normal, distance = _line_parts(line)
    return space.at(distance * normal)


@kernel(circle=CIRCLE, returns=POINT)
def circle_centre(circle):
    """The centre of a circle. A line has none: division by 0."""
    return space.normalized(ga.polarity(circle))


circle_radius_squared = LINES_AND_ROUNDS.circle_radius_squared


@kernel(s=VECTOR)
def dual_circle_radius_squared(s):
    """The squared radius of a dual circle of any weight but 0, negative for an imaginary one."""
    return dot(s, s) / space.weight(s) ** 2


@kernel(circle=CIRCLE)
def circle_weight(circle):
    """The weight of a circle, whose sign is its orientation: twice the signed area for three points."""
    return space.weight(ga.polarity(circle))


@kernel(circle=CIRCLE)
def circle_kind(circle):
    """1 for a real circle, 0 for a point, -1 for an imaginary circle, 2 for a line."""
    return kind_of_round(circle["e120"] ** 2, _moved_squared(circle), dot(circle, circle))


point_pair_centre = LINES_AND_ROUNDS.point_pair_centre
point_pair_radius_squared = LINES_AND_ROUNDS.point_pair_radius_squared


@kernel(pair=POINT_PAIR, returns=(POINT, POINT))
def point_pair_points(pair):
    """The two points of a pair, for ``a ^ b`` first `a` and then `b`. Not numbers where the pair is imaginary."""
    a, b = _pair_ends(pair)
    return space.at(a), space.at(b)


point_pair_direction = LINES_AND_ROUNDS.point_pair_direction
point_pair_weight = LINES_AND_ROUNDS.point_pair_weight
point_pair_line = LINES_AND_ROUNDS.point_pair_line


@kernel(pair=POINT_PAIR, returns=VECTOR)
def point_pair_surround_circle(pair):
    """The dual circle of weight 1 of which a point pair is a diameter."""
    return space.centre(pair) - space.radius_squared(pair) / 2 * EINF


@kernel(pair=POINT_PAIR)
def point_pair_kind(pair):
    """1 for two points, 0 for a double one (a tangent vector), -1 for an imaginary pair, 2 for a flat point."""
    direction = space.pair_direction(pair)
    return kind_of_round(dot(direction, direction), pair["e12"] ** 2 + pair["e0inf"] ** 2, dot(pair, pair))


# Distances, in the units of the coordinates, and angles in [0, pi].


@kernel(p=POINT, line=LINE)
def signed_distance_point_line(p, line):
    """The distance of a point to a line, positive on its left."""
    _, normal, distance = _line_parts(line)
    return dot(p, normal) - distance


@kernel(p=POINT, circle=CIRCLE)
def signed_distance_point_circle(p, circle):
    """The distance of a point to a circle, negative inside; not a number for an imaginary one."""
    centre, square = space.sphere_parts(circle)
    return length_of(space.coordinates(p) - centre) - ga.sqrt(square)


power_of_point = POINTS.power_of_point


@kernel(a=LINE, b=LINE)
def signed_distance_lines(a, b):
    """How far the line `b` is from the line `a`, parallel to it, along the normal of `a`; 0 for others."""
    (d, _, p), (e, _, q) = _line_parts(a), _line_parts(b)
    return ga.select(ga.absolute(_cross(d, e)) <= NEARLY_ZERO, ga.select(dot(d, e) < 0, -q, q) - p, 0)


@kernel(line=LINE, circle=CIRCLE)
def distance_line_circle(line, circle):
    """The distance of a line to a circle: 0 where they meet."""
    (_, normal, distance), (centre, square) = _line_parts(line), space.sphere_parts(circle)
    return ga.maximum(0, ga.absolute(dot(centre, normal) - distance) - ga.sqrt(square))


@kernel(a=CIRCLE, b=CIRCLE)
def distance_circles(a, b):
    """The distance of two circles: 0 where they meet; one may be inside the other."""
    return distance_of_spheres(*space.sphere_parts(a), *space.sphere_parts(b))


@kernel(line=LINE, other=LINE)
def angle_between_lines(line, other):
    """The angle from the direction of `line` to that of `other`, counterclockwise, in (-pi, pi]."""
    d, e = space.line_direction(line), space.line_direction(other)
    return ga.atan2(_cross(d, e), dot(d, e))


inversive_distance = POINTS.inversive_distance.documented(
    """The inversive distance ``-a . b / (|a| |b|)`` of two dual circles or dual lines, which conformal maps keep.

    Of circles with centres at the distance d, ``(d**2 - r**2 - s**2) / (2 r s)``: 1 where they touch from outside, -1
    from inside. The sign of a weight counts.
    """
)
inner_product_of_point_pairs = LINES_AND_ROUNDS.inner_product_of_point_pairs


@kernel(a=VECTOR, b=VECTOR)
def angle_between_dual_circles(a, b):
    """The angle of the radii of two dual circles, or of normals, where they meet; not a number where they do not."""
    return ga.acos(dot(a, b) / ga.sqrt(dot(a, a) * dot(b, b)))


# Projections and reflections.


@kernel(p=POINT, line=LINE, returns=POINT)
def project_point_on_line(p, line):
    """The foot of a point on a line."""
    _, normal, distance = _line_parts(line)
    return space.at(space.coordinates(p) - (dot(p, normal) - distance) * normal)


@kernel(p=POINT, circle=CIRCLE, returns=POINT)
def project_point_on_circle(p, circle):
    """The nearest point of a circle. For the centre, all are as near: not a number."""
    centre, square = space.sphere_parts(circle)
    away = space.coordinates(p) - centre
    return space.at(centre + ga.sqrt(square) / length_of(away) * away)


@kernel(p=POINT, line=DUAL_LINE, returns=POINT)
def reflect_point(p, line):
    """The mirror image of a point in a dual line, whose normal may have any length but 0."""
    return space.normalized(-(line * p * line))


# Meets.


@kernel(a=LINE, b=LINE, returns=POINT)
def meet_lines(a, b):
    """The point in which two lines meet; division by 0 where they are parallel."""
    flat = a & b
    return space.point(*(flat[name] / flat["e0inf"] for name in ("e1inf", "e2inf")))


@kernel(line=LINE, circle=CIRCLE)
def meet_line_circle(line, circle):
    """The pair of points in which a line meets a circle, imaginary where it does not."""
    return line & circle


@kernel(a=CIRCLE, b=CIRCLE)
def meet_circles(a, b):
    """The pair of points in which two circles meet, imaginary where they do not."""
    return a & b


# Kinds of meets. What two objects have in common is a blade whose coefficients have degree 1, 2 and 3 in lengths; each
# is 0 up to a tolerance relative to the sizes of what it is computed from.


def _sizes_of_vector(s):
    """Squared sizes of a dual circle's coefficients of degree 0, 1 and 2, those of degree 1 with its radius."""
    return s["e0"] ** 2, s["e1"] ** 2 + s["e2"] ** 2 + 2 * ga.absolute(s["e0"] * s["einf"]), s["einf"] ** 2


@kernel(a=VECTOR, b=VECTOR)
def meet_dual_circles_kind(a, b):
    """How two dual circles or dual lines meet, in a pair of points or a point. 1: they do; 0: they touch; -1: they do
    not; 2: concentric circles or parallel lines; 3: the same, of any weights."""
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
    """The least `t`, at least 0, for which ``p + t d`` is on a circle, from either side; not a number if there is none.

    No digits are lost for a small circle that is far away.
    """
    return hit_ray(space.coordinates(p), space.vector(d), *space.sphere_parts(circle))


# Versors.

rotor_from_angle = ROTATIONS.rotor_from_angle.documented("The rotation about the origin, counterclockwise.")


@kernel(r=ROTOR)
def rotor_to_angle(r):
    """The angle of a rotor, in (-2 pi, 2 pi]; `r` and ``-r``, the same rotation, differ by a whole turn."""
    return 2 * ga.atan2(-r["e12"], r["1"])


@kernel(p=POINT, angle=SCALAR, returns=MOTOR)
def motor_from_point(p, angle):
    """The rotation about a point, counterclockwise."""
    return ga.cos(angle / 2) - ga.sin(angle / 2) * _turn_about(space.coordinates(p))


def _turn_about(p):
    """Half a turn about a point, clockwise."""
    return E1 * E2 - (_left(p) ^ EINF)


translator_from_vector = VERSORS.translator_from_vector
dilator_from_scale = VERSORS.dilator_from_scale
dilator_to_scale = VERSORS.dilator_to_scale
transversor_from_vector = VERSORS.transversor_from_vector
motor_from_rotor_translation = VERSORS.motor_from_rotor_translation
motor_to_rotor_translation = VERSORS.motor_to_rotor_translation
motor_to_matrix = VERSORS.motor_to_matrix.documented(
    "The homogeneous 3 x 3 matrix of a unit motor, which acts on columns (x, y, 1)."
)
motor_product = MOTORS.motor_product
motor_inverse = MOTORS.motor_inverse
motor_exponential = MOTORS.motor_exponential.documented(
    "``exp(b)`` of the bivector of a rigid motion: a rotation about any point, or a translation. Smooth everywhere."
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


# Versors between two objects of one kind: the square root of their ratio. Nearly opposite ones are turned over first.


@kernel(a=LINE, b=LINE, returns=MOTOR)
def motor_between_lines(a, b):
    """The motor that takes the line `a` to the line `b` along with its direction; it exists for every pair.

    It turns about their common point or translates across parallel ones; nearly opposite lines are turned over first.
    """
    _, normal, distance = _line_parts(a)
    return versor_between(unit_blade(a), unit_blade(b), _turn_about(distance * normal))


@kernel(a=CIRCLE, b=CIRCLE, returns=UNIT_EVEN)
def versor_between_circles(a, b):
    """The versor that takes the real circle `a` to the real circle `b` along with the signs of their weights.

    Of circles apart from each other, with weights of one sign, `a` is turned inside out by an inversion and
    a reflection first. Not a number for imaginary circles and for those of radius 0.
    """
    one, two = unit_blade(a), unit_blade(b)
    centre, _ = space.sphere_parts(a)
    mirror = E1 + dot(centre, E1) * EINF
    signs = [sign_of(dot(circle, circle), _moved_squared(circle)) for circle in (a, b)]
    turn = (ga.polarity(one) * mirror).grade(0, 2)
    return undefined_where(ga.minimum(*signs) <= 0, versor_between(one, two, turn))


@kernel(a=POINT_PAIR, b=POINT_PAIR, returns=UNIT_EVEN)
def versor_between_point_pairs(a, b):
    """The versor that takes the point pair `a` to `b`, the first point to the first.

    The root of the ratio ``b a**-1``. Not a number where one is real and the other imaginary.
    """
    wrong = dot(a, a) * dot(b, b) <= 0
    return undefined_where(
        wrong, versor_between(unit_blade(a), unit_blade(b), _turn_about(space.coordinates(space.centre(a))))
    )


@kernel(a=POINT, b=POINT, n=COORDINATES, m=COORDINATES, scale=SCALAR, returns=UNIT_EVEN)
def similarity_between_rounds(a, b, n, m, scale):
    """The versor that turns, scales and translates a round into another of its kind, and nothing else.

    From the centre `a` to the centre `b`, by the rotation from the unit direction `n` of a point pair to `m` (the same
    of both for circles), and by the ratio `scale` of the radii, positive.
    """
    n, m = space.vector(n), space.vector(m)
    rotor = versor_between(n, m, E1 * E2)
    back = 1 + space.coordinates(a) * EINF / 2
    return space.translator(space.coordinates(b)) * rotor * space.dilator(scale) * back
