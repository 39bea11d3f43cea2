"""Conformal geometry of space in G(4,1) with the null basis ``e0, einf`` and ``einf . e0 = -1``.

The point at x is ``x + e0 + x**2/2 einf``; three coordinates are stored, the other two are known. Rounds and flats are
outer products of points: point pairs of 2, circles of 3, spheres of 4; lines are ``a ^ b ^ einf`` and planes
``a ^ b ^ c ^ einf``. A *dual* sphere is the vector ``c - r**2/2 einf`` of its centre c and radius r, a *dual* plane is
``n + d einf`` for the plane ``n . x = d``. `polarity`, multiplication by ``e0123inf**-1``, takes a sphere or plane to a
multiple of its dual.

A `kind` is 1 for what is real, 0 for what is tangent (of radius 0), -1 for what is imaginary, 2 for what is flat,
parallel or concentric, 3 where two objects are the same. It is decided with a tolerance, 1e-12 of the squares of radii
and distances from the origin that enter; `radius_squared` of a result says the same without one.

Even versors move everything by ``v x ~v``: the rotor ``exp(-angle/2 B)``, the translator ``1 - t einf/2``, the dilator
``exp(log(scale)/2 e0inf)``. A motor has rotation and translation; its eight coefficients are, in order, those of the
same motor in G(3,0,1). Angles are in radians; lengths are in the units of the coordinates.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import CGA3

POINT, VECTOR, DUAL_PLANE = CGA3.POINT, CGA3.VECTOR, CGA3.DUAL_PLANE
POINT_PAIR, LINE, CIRCLE, PLANE, SPHERE = CGA3.POINT_PAIR, CGA3.LINE, CGA3.CIRCLE, CGA3.PLANE, CGA3.SPHERE
ROTOR, TRANSLATOR, MOTOR, DILATOR = CGA3.ROTOR, CGA3.TRANSLATOR, CGA3.MOTOR, CGA3.DILATOR
EVEN, UNIT_EVEN, FULL = CGA3.even, CGA3.UNIT_EVEN, CGA3.full
COORDINATES = array(SCALAR, 3)
GENERATOR = CGA3.layout("GENERATOR", "e12 e13 e23 e1inf e2inf e3inf")
"""Bivectors of rigid motions."""

FLAT_POINT, DUAL_LINE, TRANSVERSOR = CGA3.FLAT_POINT, CGA3.DUAL_LINE, CGA3.TRANSVERSOR

E1, E2, E3, E0, EINF = CGA3.basis()
SPACE, PSEUDOSCALAR = E1 * E2 * E3, CGA3.pseudoscalar
AXES = ("e1", "e2", "e3")
NEARLY_ZERO = Fraction(1, 10**12)
NEARLY_OPPOSITE = Fraction(-9, 10)
BISECTIONS, POLISH = 20, 3


def _vector(x):
    return x[0] * E1 + x[1] * E2 + x[2] * E3


def _point(x, y, z):
    return x * E1 + y * E2 + z * E3 + E0 + (x * x + y * y + z * z) / 2 * EINF


def _weight(x):
    """What is 1 for a normalised vector: the coefficient of e0."""
    return -ga.scalar_product(EINF, x)


def _normalized(x):
    """The point with weight 1 of a null vector."""
    weight = _weight(x)
    return _point(*(x[name] / weight for name in ("e1", "e2", "e3")))


def _centre(x):
    """Centre of a round: the point at infinity reflected in it."""
    return _normalized((x * EINF * x).grade(1))


def _radius_squared(x):
    """Squared radius of a round, negative for an imaginary one."""
    carrier = ga.left_contraction(EINF, x)
    return ga.scalar_product(x, ga.grade_involution(x)) / ga.scalar_product(carrier, carrier)


def _dot(a, b):
    return ga.scalar_product(a, b)


def _cross(a, b):
    return -(a ^ b) * SPACE


def _length(a):
    return ga.sqrt(_dot(a, a))


def _coordinates(x):
    """The Euclidean part of a vector or point."""
    return x["e1"] * E1 + x["e2"] * E2 + x["e3"] * E3


def _tuple(x):
    return tuple(x[name] for name in AXES)


def _at(x):
    """The point at a Euclidean vector."""
    return _point(*_tuple(x))


def _unless(wrong, x):
    """`x`, not a number where `wrong`."""
    return x * ga.sqrt(ga.select(wrong, -1, 1))


def _perpendicular(n):
    """A unit vector orthogonal to `n`: to the axis of least coordinate as well."""
    x, y, z = (n[name] * n[name] for name in AXES)
    axis = ga.select(x <= ga.minimum(y, z), E1, ga.select(y <= z, E2, E3))
    return ga.normalize(_cross(n, axis))


# Flats and rounds by vectors: direction and moment, normal and distance, centre and squared radius.


def _line(direction, moment):
    return (moment * SPACE + (E0 ^ direction)) ^ EINF


def _line_direction(line):
    return -line["e10inf"] * E1 - line["e20inf"] * E2 - line["e30inf"] * E3


def _line_moment(line):
    return line["e23inf"] * E1 - line["e13inf"] * E2 + line["e12inf"] * E3


def _line_through(p, direction):
    return _line(direction, _cross(p, direction))


def _line_parts(line):
    """Unit direction and the point nearest to the origin."""
    direction, moment = _line_direction(line), _line_moment(line)
    square = _dot(direction, direction)
    return direction / ga.sqrt(square), _cross(direction, moment) / square


def _plane(normal, distance):
    return -(distance * EINF + normal) * PSEUDOSCALAR


def _plane_normal(plane):
    return plane["e230inf"] * E1 - plane["e130inf"] * E2 + plane["e120inf"] * E3


def _plane_parts(plane):
    """Unit normal and the distance from the origin along it."""
    normal = _plane_normal(plane)
    length = _length(normal)
    return normal / length, plane["e123inf"] / length


def _pair(centre, direction, radius_squared):
    """From ``centre - radius direction`` to ``centre + radius direction``."""
    return (_at(centre) + radius_squared / 2 * EINF) ^ (direction + _dot(centre, direction) * EINF)


def _circle(centre, normal, radius_squared):
    """Right-handed about the normal."""
    return -((_at(centre) - radius_squared / 2 * EINF) ^ (normal + _dot(centre, normal) * EINF)) * PSEUDOSCALAR


def _sphere_parts(sphere):
    dual = ga.polarity(sphere)
    return _coordinates(_normalized(dual)), _radius_squared(sphere)


def _circle_normal(circle):
    return circle["e230"] * E1 - circle["e130"] * E2 + circle["e120"] * E3


def _circle_parts(circle):
    """Centre, unit normal, squared radius."""
    return _coordinates(_centre(circle)), ga.normalize(_circle_normal(circle)), _radius_squared(circle)


def _circle_frame(circle):
    """Centre, radius, and a right-handed orthonormal frame whose last vector is the normal."""
    centre, normal, square = _circle_parts(circle)
    u = _perpendicular(normal)
    return centre, ga.sqrt(square), u, _cross(normal, u), normal


def _pair_direction(pair):
    return -pair["e10"] * E1 - pair["e20"] * E2 - pair["e30"] * E3


# Kinds.


def _sign(value, size):
    """1, 0 or -1; 0 up to a tolerance relative to `size`, not a number where `value` is none."""
    tolerance = NEARLY_ZERO * size
    small = ga.select(ga.absolute(value) <= tolerance, 0, ga.sqrt(ga.select(value < 0, -1, value)))
    return ga.select(value > tolerance, 1, ga.select(value < -tolerance, -1, small))


def _kind_of_round(weight_squared, moved_squared, square):
    """`square` is the weight's square times that of the radius, `moved_squared` times that of the centre."""
    flat = weight_squared <= NEARLY_ZERO**2 * moved_squared
    return ga.select(flat, 2, _sign(square, moved_squared))


def _moved_squared(sphere):
    return sphere["e230inf"] ** 2 + sphere["e130inf"] ** 2 + sphere["e120inf"] ** 2


def _sphere_sign(sphere):
    return _sign(-_dot(sphere, sphere), _moved_squared(sphere))


# Products, involutions and duals of any two elements.


@kernel(a=FULL, b=FULL)
def geometric_product(a, b):
    """The geometric product ``a b`` of any two elements."""
    return a * b


@kernel(a=FULL, b=FULL)
def outer_product(a, b):
    """The outer product ``a ^ b`` of any two elements."""
    return a ^ b


@kernel(a=FULL, b=FULL)
def regressive_product(a, b):
    """The regressive product ``a & b`` of any two elements: the meet of things that together span everything."""
    return a & b


@kernel(a=FULL, b=FULL)
def inner_product(a, b):
    """The inner product of any two elements: of grades p and q, the part of grade \\|p - q\\| of ``a b``."""
    return ga.inner_product(a, b)


@kernel(a=EVEN, b=EVEN)
def even_product(a, b):
    """The geometric product of two even elements: of versors, the one that does `b` first."""
    return a * b


@kernel(a=FULL)
def reverse(a):
    """The reverse ``~a`` of any element: the order of vectors in every product turned round."""
    return ~a


@kernel(a=EVEN)
def even_reverse(a):
    """The reverse of an even element: the inverse of a unit versor."""
    return ~a


@kernel(a=FULL)
def grade_involution(a):
    """Any element with its odd part negated."""
    return ga.grade_involution(a)


@kernel(a=FULL)
def dual(a):
    """The right complement of any element, which needs no metric: ``b ^ dual(b) = e0123inf`` for basis blades."""
    return ga.dual(a)


@kernel(a=FULL)
def undual(a):
    """The inverse of `dual`."""
    return ga.undual(a)


@kernel(a=FULL)
def polarity(a):
    """The metric dual ``a e0123inf**-1``."""
    return ga.polarity(a)


# Points.


@kernel(x=COORDINATES, returns=VECTOR)
def embed_point(x):
    """The point at three coordinates, all five coefficients: ``x + e0 + x**2/2 einf``."""
    return _point(*x)


@kernel(x=VECTOR, returns=POINT)
def extract_point(x):
    """The coordinates of a point of any weight but 0; of a dual sphere, its centre."""
    return _normalized(x)


@kernel(x=VECTOR, returns=VECTOR)
def normalize_vector(x):
    """The vector divided by its coefficient of e0, so that a point or dual sphere has weight 1."""
    return x / _weight(x)


@kernel(a=POINT, b=POINT)
def inner_product_of_points(a, b):
    """The inner product of two points: minus half their squared distance."""
    return ga.scalar_product(a, b)


@kernel(a=POINT, b=POINT)
def distance_squared_points(a, b):
    """The squared distance of two points."""
    return -2 * ga.scalar_product(a, b)


@kernel(a=POINT, b=POINT)
def distance_points(a, b):
    """The distance of two points: the length of the line through them."""
    line = a ^ b ^ EINF
    return ga.sqrt(ga.scalar_product(line, line))


@kernel(a=VECTOR, b=VECTOR)
def inner_product_of_vectors(a, b):
    """The inner product of two vectors: for normalised dual spheres ``(r**2 + s**2 - distance**2) / 2``."""
    return ga.scalar_product(a, b)


@kernel(p=POINT, s=VECTOR)
def power_of_point(p, s):
    """Squared distance of a point to the centre of a dual sphere, minus the squared radius; negative inside."""
    return -2 * ga.scalar_product(p, s) / _weight(s)


@kernel(p=POINT, plane=DUAL_PLANE)
def signed_distance_point_plane(p, plane):
    """The distance of a point to a dual plane, positive on the side of its normal, which may have any length but 0."""
    return ga.scalar_product(p, plane) / ga.norm(plane)


@kernel(p=POINT, line=LINE)
def distance_point_line(p, line):
    """The distance of a point to a line, whose square may be any but 0."""
    return ga.sqrt(ga.norm_squared(p ^ line) / ga.norm_squared(line))


# Rounds and flats.


@kernel(a=POINT, b=POINT)
def point_pair_from_points(a, b):
    """The point pair ``a ^ b``."""
    return a ^ b


@kernel(a=POINT, b=POINT, c=POINT)
def circle_from_points(a, b, c):
    """The circle ``a ^ b ^ c`` through three points; a line where they are on one."""
    return a ^ b ^ c


@kernel(a=POINT, b=POINT, c=POINT, d=POINT)
def sphere_from_points(a, b, c, d):
    """The sphere ``a ^ b ^ c ^ d`` through four points; a plane where they are in one, 0 where they are on a circle."""
    return a ^ b ^ c ^ d


@kernel(a=POINT, b=POINT)
def line_from_points(a, b):
    """The line ``a ^ b ^ einf`` from `a` to `b`; its square is their squared distance."""
    return a ^ b ^ EINF


@kernel(p=POINT, d=COORDINATES)
def line_from_point_direction(p, d):
    """The line through the point `p` along the direction `d`; its square is that of `d`."""
    return p ^ _vector(d) ^ EINF


@kernel(a=POINT, b=POINT, c=POINT)
def plane_from_points(a, b, c):
    """The plane ``a ^ b ^ c ^ einf``; its square is minus the square of twice the triangle's area.

    Its polarity is the dual plane with the normal ``-(b - a) x (c - a)``.
    """
    return a ^ b ^ c ^ EINF


@kernel(centre=POINT, radius=SCALAR, returns=VECTOR)
def dual_sphere_from_centre(centre, radius):
    """The dual sphere ``centre - radius**2/2 einf``."""
    return centre - radius * radius / 2 * EINF


@kernel(centre=POINT, p=POINT, returns=VECTOR)
def dual_sphere_through_point(centre, p):
    """The dual sphere with a centre and a point on it."""
    return centre + ga.scalar_product(centre, p) * EINF


@kernel(centre=POINT, radius=SCALAR, returns=SPHERE)
def sphere_from_centre(centre, radius):
    """The sphere whose polarity is the dual sphere ``centre - radius**2/2 einf``."""
    return (centre - radius * radius / 2 * EINF) * CGA3.pseudoscalar


@kernel(normal=COORDINATES, distance=SCALAR)
def dual_plane_from_normal(normal, distance):
    """The dual plane ``normal + distance einf``: all x with ``normal . x = distance``."""
    return _vector(normal) + distance * EINF


@kernel(a=POINT, b=POINT)
def bisector_plane(a, b):
    """The dual plane of all points as far from `a` as from `b`: the difference ``b - a``, its normal towards `b`."""
    return b - a


@kernel(sphere=SPHERE)
def sphere_polarity(sphere):
    """The dual sphere of a sphere, with a weight."""
    return ga.polarity(sphere)


@kernel(plane=PLANE)
def plane_polarity(plane):
    """The dual plane of a plane: for ``a ^ b ^ c ^ einf``, with the normal ``-(b - a) x (c - a)``."""
    return ga.polarity(plane)


@kernel(sphere=SPHERE, returns=POINT)
def sphere_centre(sphere):
    """The centre of a sphere. A plane has none: division by 0."""
    return _normalized(ga.polarity(sphere))


@kernel(sphere=SPHERE)
def sphere_radius_squared(sphere):
    """The squared radius of a sphere, negative for an imaginary one. A plane has none: division by 0."""
    return _radius_squared(sphere)


@kernel(circle=CIRCLE, returns=POINT)
def circle_centre(circle):
    """The centre of a circle. A line has none: division by 0."""
    return _centre(circle)


@kernel(circle=CIRCLE)
def circle_radius_squared(circle):
    """The squared radius of a circle, negative for an imaginary one. A line has none: division by 0."""
    return _radius_squared(circle)


@kernel(circle=CIRCLE)
def circle_plane(circle):
    """The plane of a circle: ``circle ^ einf``."""
    return circle ^ EINF


@kernel(circle=CIRCLE)
def circle_axis(circle):
    """The line through the centre of a circle, orthogonal to its plane."""
    return ga.polarity(circle) ^ EINF


@kernel(pair=POINT_PAIR, returns=POINT)
def point_pair_centre(pair):
    """The point midway between the points of a pair."""
    return _centre(pair)


@kernel(pair=POINT_PAIR)
def point_pair_radius_squared(pair):
    """The square of half the distance of the points of a pair, negative for an imaginary one."""
    return _radius_squared(pair)


@kernel(pair=POINT_PAIR, returns=(POINT, POINT))
def point_pair_points(pair):
    """The two points of a pair, for ``a ^ b`` first `a` and then `b`. Not numbers where the pair is imaginary."""
    root = ga.sqrt(ga.scalar_product(pair, pair))
    carrier = ga.left_contraction(EINF, pair)
    return _normalized((pair - root) * carrier), _normalized((pair + root) * carrier)


# Meets.


@kernel(a=SPHERE, b=SPHERE)
def meet_spheres(a, b):
    """The circle in which two spheres meet, imaginary where they do not meet; no circle if concentric."""
    return a & b


@kernel(sphere=SPHERE, plane=PLANE)
def meet_sphere_plane(sphere, plane):
    """The circle in which a sphere meets a plane, imaginary (negative squared radius) where it does not."""
    return sphere & plane


@kernel(a=SPHERE, b=SPHERE, c=SPHERE)
def meet_three_spheres(a, b, c):
    """The pair of points that three spheres have in common, imaginary where they have none."""
    return a & b & c


@kernel(line=LINE, sphere=SPHERE)
def meet_line_sphere(line, sphere):
    """The pair of points in which a line meets a sphere, imaginary where it does not."""
    return line & sphere


@kernel(circle=CIRCLE, plane=PLANE)
def meet_circle_plane(circle, plane):
    """The pair of points in which a circle meets a plane, imaginary where it does not."""
    return circle & plane


@kernel(circle=CIRCLE, sphere=SPHERE)
def meet_circle_sphere(circle, sphere):
    """The pair of points in which a circle meets a sphere, imaginary where it does not."""
    return circle & sphere


@kernel(a=PLANE, b=PLANE)
def meet_planes(a, b):
    """The line in which two planes meet."""
    return a & b


@kernel(line=LINE, plane=PLANE, returns=POINT)
def meet_line_plane(line, plane):
    """The point in which a line meets a plane; division by 0 where they are parallel."""
    flat = line & plane
    return _point(*(flat[name] / flat["e0inf"] for name in ("e1inf", "e2inf", "e3inf")))


# Flats by points and directions, in direct and dual form.


@kernel(p=POINT, returns=FLAT_POINT)
def flat_point_from_point(p):
    """The flat point ``p ^ einf``: a point together with infinity."""
    return p ^ EINF


@kernel(flat=FLAT_POINT, returns=POINT)
def point_from_flat_point(flat):
    """The point of a flat point of any weight but 0."""
    return _point(*(flat[name] / flat["e0inf"] for name in ("e1inf", "e2inf", "e3inf")))


@kernel(d=COORDINATES, m=COORDINATES, returns=LINE)
def line_from_direction_moment(d, m):
    """The line of Pluecker coordinates `d`, its direction, and `m`, its moment ``p x d`` for all p on it."""
    return _line(_vector(d), _vector(m))


@kernel(line=LINE, returns=(COORDINATES, COORDINATES))
def line_to_direction_moment(line):
    """Direction and moment of a line, its Pluecker coordinates, with the length that its coefficients have."""
    return _tuple(_line_direction(line)), _tuple(_line_moment(line))


@kernel(normal=COORDINATES, distance=SCALAR, returns=PLANE)
def plane_from_normal(normal, distance):
    """The plane of all x with ``normal . x = distance``."""
    return _plane(_vector(normal), distance)


@kernel(plane=PLANE, returns=(COORDINATES, SCALAR))
def plane_to_normal(plane):
    """The unit normal of a plane, of that through a, b, c along ``(b - a) x (c - a)``, and its distance from the origin
    along it."""
    normal, distance = _plane_parts(plane)
    return _tuple(normal), distance


@kernel(p=POINT, normal=COORDINATES, returns=PLANE)
def plane_from_point_normal(p, normal):
    """The plane through `p` orthogonal to a vector."""
    return _plane(_vector(normal), _dot(p, _vector(normal)))


@kernel(p=POINT, line=LINE, returns=PLANE)
def join_point_line(p, line):
    """The plane through a point and a line; 0 where the point is on the line."""
    return p ^ line


@kernel(line=LINE, returns=DUAL_LINE)
def line_polarity(line):
    """The dual line, a bivector: along the unit direction d, with the square -1, twice the generator of rotations."""
    return ga.polarity(line)


@kernel(dual=DUAL_LINE, returns=LINE)
def line_from_dual(dual):
    """The line whose polarity is given."""
    return dual * PSEUDOSCALAR


@kernel(dual=DUAL_PLANE, returns=PLANE)
def plane_from_dual(dual):
    """The plane whose polarity is given; its normal is the opposite one."""
    return dual * PSEUDOSCALAR


@kernel(line=LINE, returns=CIRCLE)
def circle_from_line(line):
    """A line as the circle that it is, all ten coefficients, for what is written for circles."""
    return line


@kernel(plane=PLANE, returns=SPHERE)
def sphere_from_plane(plane):
    """A plane as the sphere that it is, all five coefficients, for what is written for spheres."""
    return plane


@kernel(dual=VECTOR, returns=SPHERE)
def sphere_from_dual(dual):
    """The sphere whose polarity is given."""
    return dual * PSEUDOSCALAR


@kernel(dual=POINT_PAIR, returns=CIRCLE)
def circle_from_dual(dual):
    """The circle whose polarity is given: of two dual spheres, ``a ^ b`` gives that in which they meet."""
    return dual * PSEUDOSCALAR


@kernel(dual=CIRCLE, returns=POINT_PAIR)
def point_pair_from_dual(dual):
    """The point pair whose polarity is given: of three dual spheres, ``a ^ b ^ c`` gives what they have in common."""
    return dual * PSEUDOSCALAR


@kernel(circle=CIRCLE, returns=POINT_PAIR)
def circle_polarity(circle):
    """The dual circle, a bivector."""
    return ga.polarity(circle)


@kernel(pair=POINT_PAIR, returns=CIRCLE)
def point_pair_polarity(pair):
    """The dual of a point pair, a trivector."""
    return ga.polarity(pair)


# Rounds by centres and radii; a negative squared radius is that of an imaginary round, 0 that of a tangent one.


@kernel(centre=POINT, direction=COORDINATES, radius_squared=SCALAR, returns=POINT_PAIR)
def point_pair_from_centre(centre, direction, radius_squared):
    """The pair of points at one distance from a centre, before and behind it along a direction of any length but 0."""
    return _pair(_coordinates(centre), _vector(direction), radius_squared)


@kernel(centre=POINT, normal=COORDINATES, radius_squared=SCALAR, returns=CIRCLE)
def circle_from_centre(centre, normal, radius_squared):
    """The circle about a centre, orthogonal to a normal of any length but 0 and right-handed about it."""
    return _circle(_coordinates(centre), _vector(normal), radius_squared)


@kernel(centre=POINT, radius_squared=SCALAR, returns=SPHERE)
def sphere_from_centre_radius_squared(centre, radius_squared):
    """The sphere, imaginary for a negative squared radius, whose polarity is ``centre - radius_squared/2 einf``."""
    return (centre - radius_squared / 2 * EINF) * PSEUDOSCALAR


@kernel(a=VECTOR, b=VECTOR, returns=CIRCLE)
def circle_from_dual_spheres(a, b):
    """The circle in which two dual spheres meet; a line for two dual planes."""
    return -(a ^ b) * PSEUDOSCALAR


@kernel(sphere=SPHERE, p=POINT, returns=PLANE)
def tangent_plane_of_sphere(sphere, p):
    """The plane that touches a sphere in a point of it."""
    return ga.left_contraction(p, sphere) ^ EINF


# What objects are made of.


@kernel(plane=PLANE, returns=POINT)
def plane_support(plane):
    """The point of a plane that is nearest to the origin."""
    normal = _plane_normal(plane)
    return _at(plane["e123inf"] / _dot(normal, normal) * normal)


@kernel(line=LINE, returns=POINT)
def line_support(line):
    """The point of a line that is nearest to the origin."""
    return _at(_line_parts(line)[1])


@kernel(circle=CIRCLE, returns=COORDINATES)
def circle_normal(circle):
    """The unit normal of a circle, about which it is right-handed."""
    return _tuple(ga.normalize(_circle_normal(circle)))


@kernel(circle=CIRCLE)
def circle_weight(circle):
    """The length of the normal that the coefficients of a circle contain: for three points, twice their area."""
    return _length(_circle_normal(circle))


@kernel(circle=CIRCLE, returns=VECTOR)
def circle_surround_sphere(circle):
    """The dual sphere with the centre and the radius of a circle, of weight 1."""
    return _centre(circle) - _radius_squared(circle) / 2 * EINF


@kernel(pair=POINT_PAIR, returns=COORDINATES)
def point_pair_direction(pair):
    """The unit direction of a point pair, for ``a ^ b`` from `a` to `b`."""
    return _tuple(ga.normalize(_pair_direction(pair)))


@kernel(pair=POINT_PAIR)
def point_pair_weight(pair):
    """The length of the direction that the coefficients of a pair contain: for two points, their distance."""
    return _length(_pair_direction(pair))


@kernel(pair=POINT_PAIR, returns=LINE)
def point_pair_line(pair):
    """The line through a point pair: ``pair ^ einf``."""
    return pair ^ EINF


@kernel(pair=POINT_PAIR, returns=VECTOR)
def point_pair_surround_sphere(pair):
    """The dual sphere of weight 1 of which a point pair is a diameter."""
    return _centre(pair) - _radius_squared(pair) / 2 * EINF


@kernel(sphere=SPHERE)
def sphere_weight(sphere):
    """The weight of a sphere, whose sign is its orientation: minus six times the volume for four points."""
    return _weight(ga.polarity(sphere))


@kernel(s=VECTOR)
def dual_sphere_radius_squared(s):
    """The squared radius of a dual sphere of any weight but 0, negative for an imaginary one."""
    return _dot(s, s) / _weight(s) ** 2


@kernel(pair=POINT_PAIR)
def point_pair_kind(pair):
    """1 for two points, 0 for a double one (a tangent vector), -1 for an imaginary pair, 2 for a flat point."""
    carrier = ga.left_contraction(EINF, pair)
    inner = pair["e12"] ** 2 + pair["e13"] ** 2 + pair["e23"] ** 2 + pair["e0inf"] ** 2
    direction = _coordinates(carrier)
    return _kind_of_round(_dot(direction, direction), inner, _dot(pair, pair))


@kernel(circle=CIRCLE)
def circle_kind(circle):
    """1 for a real circle, 0 for one of radius 0, -1 for an imaginary one, 2 for a line."""
    normal = _circle_normal(circle)
    moved = sum(circle[name] ** 2 for name in ("e123", "e10inf", "e20inf", "e30inf"))
    return _kind_of_round(_dot(normal, normal), moved, _dot(circle, circle))


@kernel(sphere=SPHERE)
def sphere_kind(sphere):
    """1 for a real sphere, 0 for a point, -1 for an imaginary sphere, 2 for a plane."""
    return _kind_of_round(sphere["e1230"] ** 2, _moved_squared(sphere), -_dot(sphere, sphere))


# Distances, in the units of the coordinates; of points, lines and circles to others, the least of any two points.


@kernel(p=POINT, sphere=SPHERE)
def signed_distance_point_sphere(p, sphere):
    """The distance of a point to a sphere, negative inside; not a number for an imaginary one."""
    centre, square = _sphere_parts(sphere)
    return _length(_coordinates(p) - centre) - ga.sqrt(square)


def _to_circle(p, centre, normal):
    """Height above the plane of a circle, the vector in that plane from its centre, its length."""
    away = p - centre
    height = _dot(away, normal)
    inside = away - height * normal
    return height, inside, _length(inside)


@kernel(p=POINT, circle=CIRCLE)
def distance_point_circle(p, circle):
    """The distance of a point to a circle; not a number for an imaginary one."""
    centre, normal, square = _circle_parts(circle)
    height, _, length = _to_circle(_coordinates(p), centre, normal)
    gap = length - ga.sqrt(square)
    return ga.sqrt(height * height + gap * gap)


def _parts_of_lines(a, b):
    """Directions, support points, the vector product of the directions, its square, whether they are parallel."""
    (d, p), (e, q) = _line_parts(a), _line_parts(b)
    across = _cross(d, e)
    square = _dot(across, across)
    return d, p, e, q, across, square, square <= NEARLY_ZERO**2


@kernel(a=LINE, b=LINE)
def distance_lines(a, b):
    """The distance of two lines, parallel ones too."""
    (d, m), (e, k) = ((_line_direction(line), _line_moment(line)) for line in (a, b))
    across, first, second = _cross(d, e), _dot(d, d), _dot(e, e)
    square = _dot(across, across)
    parallel = square <= NEARLY_ZERO**2 * first * second
    skew = ga.absolute(_dot(d, k) + _dot(m, e)) / ga.sqrt(ga.select(parallel, 1, square))
    beside = (_dot(d, e) / second) * k - m
    return ga.select(parallel, ga.sqrt(_dot(beside, beside) / first), skew)


@kernel(line=LINE, plane=PLANE)
def signed_distance_line_plane(line, plane):
    """The distance of a line to a plane that is parallel to it, positive on the side of the normal; else 0."""
    (direction, point), (normal, distance) = _line_parts(line), _plane_parts(plane)
    return ga.select(ga.absolute(_dot(direction, normal)) <= NEARLY_ZERO, _dot(point, normal) - distance, 0)


@kernel(a=PLANE, b=PLANE)
def signed_distance_planes(a, b):
    """How far the plane `b` is from a plane `a` parallel to it, along the normal of `a`; else 0."""
    (n, distance), (m, other) = _plane_parts(a), _plane_parts(b)
    across = _cross(n, m)
    along = ga.select(_dot(n, m) < 0, -other, other)
    return ga.select(_dot(across, across) <= NEARLY_ZERO**2, along - distance, 0)


def _point_to_line(p, direction, support):
    away = p - support
    return away - _dot(away, direction) * direction


@kernel(line=LINE, sphere=SPHERE)
def distance_line_sphere(line, sphere):
    """The distance of a line to a sphere: 0 where they meet."""
    direction, (centre, square) = _line_direction(line), _sphere_parts(sphere)
    moment = _cross(centre, direction) - _line_moment(line)
    return ga.maximum(0, ga.sqrt(_dot(moment, moment) / _dot(direction, direction)) - ga.sqrt(square))


@kernel(plane=PLANE, circle=CIRCLE)
def distance_plane_circle(plane, circle):
    """The distance of a plane to a circle: 0 where they meet."""
    (normal, distance), (centre, axis, square) = _plane_parts(plane), _circle_parts(circle)
    height = ga.absolute(_dot(centre, normal) - distance)
    return ga.maximum(0, height - ga.sqrt(square) * _length(_cross(axis, normal)))


@kernel(plane=PLANE, sphere=SPHERE)
def distance_plane_sphere(plane, sphere):
    """The distance of a plane to a sphere: 0 where they meet."""
    (normal, distance), (centre, square) = _plane_parts(plane), _sphere_parts(sphere)
    return ga.maximum(0, ga.absolute(_dot(centre, normal) - distance) - ga.sqrt(square))


@kernel(circle=CIRCLE, sphere=SPHERE)
def distance_circle_sphere(circle, sphere):
    """The distance of a circle to the surface of a sphere: 0 where they meet."""
    (centre, normal, square), (middle, other) = _circle_parts(circle), _sphere_parts(sphere)
    height, _, length = _to_circle(middle, centre, normal)
    radius, ball = ga.sqrt(square), ga.sqrt(other)
    near, far = (ga.sqrt(height * height + (length + sign * radius) ** 2) for sign in (-1, 1))
    return ga.maximum(0, ga.maximum(near - ball, ball - far))


@kernel(a=SPHERE, b=SPHERE)
def distance_spheres(a, b):
    """The distance of two spheres: 0 where they meet; one may be inside the other."""
    (p, r), (q, s) = _sphere_parts(a), _sphere_parts(b)
    distance, r, s = _length(q - p), ga.sqrt(r), ga.sqrt(s)
    return ga.maximum(0, ga.maximum(distance - r - s, ga.absolute(r - s) - distance))


def _nearest_on_circle_to_line(line, circle):
    """The point of a circle that is nearest to a line, and that of the line.

    In the frame u, v of the circle's plane with v orthogonal to the line the point is ``c + r (C u + S v)``, and
    ``-2 (A C + B S) - e C**2`` is to be least. Signs of C and S are those of A and B, and half an angle later
    ``B t**4 + 2 (A - e) t**3 + 2 (A + e) t - B`` has one root in [0, 1]: -B at 0, 4 A at 1.
    """
    (d, q), (centre, normal, square) = _line_parts(line), _circle_parts(circle)
    radius = ga.sqrt(square)
    across = _cross(d, normal)
    sine = _dot(across, across)
    v = ga.normalize(ga.select(sine <= NEARLY_ZERO**2, _perpendicular(normal), across))
    u = _cross(v, normal)
    to_line = -_point_to_line(centre, d, q)
    a, b = _dot(to_line, u), _dot(to_line, v)
    e = radius * _dot(u, d) ** 2
    left, right = ga.absolute(a), ga.absolute(b)
    cubic, linear = 2 * (left - e), 2 * (left + e)

    def value(t):
        return ((right * t + cubic) * t * t + linear) * t - right

    t, step = Fraction(1, 2), Fraction(1, 4)
    for _ in range(BISECTIONS):
        t, step = ga.select(value(t) > 0, t - step, t + step), step / 2
    for _ in range(POLISH):
        slope = (4 * right * t + 3 * cubic) * t * t + linear
        better = t - value(t) / ga.select(slope > 0, slope, 1)
        t = ga.select(slope > 0, ga.maximum(0, ga.minimum(1, better)), t)
    whole = 1 + t * t
    cosine = ga.select(a < 0, -1, 1) * (1 - t * t) / whole
    sine = ga.select(b < 0, -1, 1) * 2 * t / whole
    point = centre + radius * (cosine * u + sine * v)
    return point, point - _point_to_line(point, d, q)


# Angles in [0, pi], and what conformal maps leave alone.


def _angle(a, b):
    return ga.atan2(_length(_cross(a, b)), _dot(a, b))


@kernel(a=COORDINATES, b=COORDINATES)
def angle_between_directions(a, b):
    """The angle of two vectors of any length but 0: directions of lines and point pairs, normals of planes and circles.

    Accurate where it is small and where it is nearly pi.
    """
    return _angle(_vector(a), _vector(b))


@kernel(a=LINE, b=LINE)
def angle_between_lines(a, b):
    """The angle of the directions of two lines."""
    return _angle(_line_direction(a), _line_direction(b))


@kernel(a=PLANE, b=PLANE)
def angle_between_planes(a, b):
    """The angle of the normals of two planes."""
    return _angle(_plane_normal(a), _plane_normal(b))


@kernel(line=LINE, plane=PLANE)
def signed_angle_line_plane(line, plane):
    """The angle of a line to a plane, in [-pi/2, pi/2], positive along the normal."""
    d, n = _line_direction(line), _plane_normal(plane)
    return ga.atan2(_dot(d, n), _length(_cross(d, n)))


@kernel(a=CIRCLE, b=CIRCLE)
def angle_between_circles(a, b):
    """The angle of the normals of two circles."""
    return _angle(_circle_normal(a), _circle_normal(b))


@kernel(a=VECTOR, b=VECTOR)
def inversive_distance(a, b):
    """The inversive distance ``-a . b / (|a| |b|)`` of two dual spheres or dual planes, which conformal maps keep.

    Of spheres with centres at the distance d, ``(d**2 - r**2 - s**2) / (2 r s)``: -cos of the angle between radii
    where they meet, 1 where they touch from outside, -1 from inside, larger where they are apart. The sign of
    a weight counts. Of a sphere and a plane, the distance from centre to plane over the radius.
    """
    return -_dot(a, b) / ga.sqrt(_dot(a, a) * _dot(b, b))


@kernel(a=VECTOR, b=VECTOR)
def angle_between_dual_spheres(a, b):
    """The angle of the radii of two dual spheres, or of normals, where they meet; not a number where they do not."""
    return ga.acos(_dot(a, b) / ga.sqrt(_dot(a, a) * _dot(b, b)))


@kernel(a=CIRCLE, b=CIRCLE)
def inner_product_of_circles(a, b):
    """The inner product of two circles or lines: its square is that of `a` times that of `b` times ``cos**2``.

    The angle is that of their senses where they meet twice, the same in both points; conformal maps keep it.
    """
    return ga.scalar_product(a, b)


@kernel(a=POINT_PAIR, b=POINT_PAIR)
def inner_product_of_point_pairs(a, b):
    """The inner product of two point pairs. By those of `a` and of `b` with themselves, ``a . b / (|a| |b|)``
    is ``(1 + x) / (1 - x)``, up to its sign, by the cross-ratio x of four points on a circle."""
    return ga.scalar_product(a, b)


@kernel(circle=CIRCLE, s=VECTOR)
def conformal_sine_circle_sphere(circle, s):
    """The sine of the angle at which a circle or line crosses a dual sphere or plane.

    ``|s ^ circle*| / (|s| |circle|)``, which conformal maps keep: 0 where the circle is on the sphere, and where they
    do not meet; `meet_circle_dual_sphere_kind` tells which.
    """
    joint = s ^ ga.polarity(circle)
    joint_squared = -ga.scalar_product(joint, joint)
    return ga.sqrt(ga.maximum(0, joint_squared) / (_dot(s, s) * ga.scalar_product(circle, circle)))


# Closest points, projections, rejections.


@kernel(a=LINE, b=LINE, returns=(POINT, POINT))
def closest_points_of_lines(a, b):
    """The points of two lines that are nearest to each other, ends of their common perpendicular.

    Of parallel lines, the point of `a` nearest to the origin and its foot on `b`.
    """
    d, p, e, q, across, square, parallel = _parts_of_lines(a, b)
    along = _dot(_cross(q - p, e), across) / ga.select(parallel, 1, square)
    one = p + ga.select(parallel, 0, along) * d
    return _at(one), _at(one - _point_to_line(one, e, q))


@kernel(line=LINE, circle=CIRCLE, returns=(POINT, POINT))
def closest_points_line_circle(line, circle):
    """The points of a line and of a circle that are nearest to each other; one pair where there are several."""
    on_circle, on_line = _nearest_on_circle_to_line(line, circle)
    return _at(on_line), _at(on_circle)


@kernel(p=POINT, plane=PLANE, returns=POINT)
def project_point_on_plane(p, plane):
    """The foot of a point on a plane."""
    normal, distance = _plane_parts(plane)
    return _at(_coordinates(p) - (_dot(p, normal) - distance) * normal)


@kernel(p=POINT, line=LINE, returns=POINT)
def project_point_on_line(p, line):
    """The foot of a point on a line."""
    direction = _line_direction(line)
    moment = _line_moment(line) - _cross(_coordinates(p), direction)
    return _at(_coordinates(p) + _cross(direction, moment) / _dot(direction, direction))


@kernel(p=POINT, sphere=SPHERE, returns=POINT)
def project_point_on_sphere(p, sphere):
    """The nearest point of a sphere. For the centre, all are as near: not a number."""
    centre, square = _sphere_parts(sphere)
    away = _coordinates(p) - centre
    return _at(centre + ga.sqrt(square) / _length(away) * away)


@kernel(p=POINT, circle=CIRCLE, returns=POINT)
def project_point_on_circle(p, circle):
    """The nearest point of a circle. For points of its axis, all are as near: not a number."""
    centre, normal, square = _circle_parts(circle)
    _, inside, length = _to_circle(_coordinates(p), centre, normal)
    return _at(centre + ga.sqrt(square) / length * inside)


@kernel(circle=CIRCLE, s=VECTOR)
def project_circle_on_sphere(circle, s):
    """The circle ``(circle . S) S**-1`` in a sphere or plane, given by its dual `s`, that is orthogonal to a sphere
    through the given one and orthogonal to it."""
    return (circle - (s ^ ga.left_contraction(s, circle)) / _dot(s, s)).grade(3)


# Inversions in spheres and reflections in planes. Objects keep their weight and turn with their sense.


@kernel(x=VECTOR, s=VECTOR)
def invert_vector(x, s):
    """A vector, such as a dual sphere or dual plane, inverted in a dual sphere or mirrored in a dual plane."""
    return (2 * _dot(x, s) / _dot(s, s)) * s - x


@kernel(x=POINT_PAIR, s=VECTOR)
def invert_point_pair(x, s):
    """A point pair inverted in a dual sphere or mirrored in a dual plane: ``s x s**-1``."""
    return s * x * s / _dot(s, s)


@kernel(x=CIRCLE, s=VECTOR)
def invert_circle(x, s):
    """A circle inverted in a dual sphere or mirrored in a dual plane: ``-s x s**-1``; a line if through its centre."""
    return -(s * x * s) / _dot(s, s)


@kernel(x=SPHERE, s=VECTOR)
def invert_sphere(x, s):
    """A sphere inverted in a dual sphere or mirrored in a dual plane: ``s x s**-1``."""
    return s * x * s / _dot(s, s)


# Meets of what needs more than the regressive product, and the kinds of all.


@kernel(p=PLANE, q=PLANE, r=PLANE, returns=POINT)
def meet_three_planes(p, q, r):
    """The point that three planes have in common; division by 0 where there is none or more than one."""
    flat = p & q & r
    return _point(*(flat[name] / flat["e0inf"] for name in ("e1inf", "e2inf", "e3inf")))


@kernel(line=LINE, circle=CIRCLE)
def meet_line_circle(line, circle):
    """The point pair in which a line in the plane of a circle meets it: that on the sphere about the circle."""
    return line & ((_centre(circle) - _radius_squared(circle) / 2 * EINF) * PSEUDOSCALAR)


@kernel(a=CIRCLE, b=CIRCLE)
def meet_circles(a, b):
    """The point pair that two circles on one sphere, or in one plane, have in common, imaginary where there is none.

    Of circles in different planes, what `a` has in common with the plane of `b`.
    """
    n, m = ga.normalize(_circle_normal(a)), ga.normalize(_circle_normal(b))
    across = _cross(n, m)
    around = (_centre(b) - _radius_squared(b) / 2 * EINF) * PSEUDOSCALAR
    return a & ga.select(_dot(across, across) <= NEARLY_ZERO**2, around, b ^ EINF)


# Kinds of meets. What two objects have in common is a blade whose coefficients have degree 1, 2 and 3 in lengths; each
# is 0 up to a tolerance relative to the sizes of what it is computed from.


def _sum_of_squares(x, names):
    return sum(x[name] ** 2 for name in names.split())


def _sizes_of_vector(s):
    """Squared sizes of a dual sphere's coefficients of degree 0, 1 and 2, those of degree 1 with its radius."""
    return s["e0"] ** 2, _sum_of_squares(s, "e1 e2 e3") + 2 * ga.absolute(s["e0"] * s["einf"]), s["einf"] ** 2


CIRCLE_DEGREES = ("e120 e130 e230", "e123 e10inf e20inf e30inf", "e12inf e13inf e23inf")
"""Coefficients of circles by their degree in lengths."""


def _sizes_of_circle(circle):
    first, middle, last = (_sum_of_squares(circle, names) for names in CIRCLE_DEGREES)
    return first, middle + 2 * ga.sqrt(first * last), last


def _sizes_of_meet(a, b):
    """Squared sizes of the coefficients of degree 1, 2 and 3 in products of what has these sizes."""
    one, two, three = a[0] * b[1] + a[1] * b[0], a[1] * b[1], a[1] * b[2] + a[2] * b[1]
    return one, two + a[0] * b[2] + a[2] * b[0], three


def _vanishes(square, size):
    return square <= NEARLY_ZERO**2 * size


def _both(a, b):
    return ga.minimum(a, b)


def _sign_of_square(value, parts, sizes):
    """The sign of the square of a blade with these squared coefficients of degree 1, 2 and 3."""
    known = parts[0] * sizes[2] + parts[1] * sizes[1] + parts[2] * sizes[0]
    return _sign(value, 4 * ga.sqrt(known + NEARLY_ZERO**2 * (sizes[0] * sizes[2] + sizes[1] * sizes[1])))


def _sign_of_pencil(a, b, product, sizes):
    """The sign of ``a**2 b**2 - (a . b)**2`` for two squares and the inner product; the last size is squared."""
    one, two, mixed = sizes[0], sizes[1], ga.sqrt(sizes[2])
    size = one * ga.absolute(b) + two * ga.absolute(a) + mixed * (2 * ga.absolute(product) + NEARLY_ZERO * mixed)
    return _sign(a * b - product * product, size)


@kernel(a=VECTOR, b=VECTOR)
def meet_dual_spheres_kind(a, b):
    """How two dual spheres or dual planes meet, in a circle or line. 1: they do; 0: they touch; -1: they do not;
    2: concentric spheres or parallel planes; 3: the same, of any weights."""
    sizes, others = _sizes_of_vector(a), _sizes_of_vector(b)
    both = _sizes_of_meet(sizes, others)
    (v, w), (x, y) = (_coordinates(a), _coordinates(b)), (a["e0"], b["e0"])
    one, three = x * w - y * v, a["einf"] * w - b["einf"] * v
    across, gap = _cross(v, w), x * b["einf"] - y * a["einf"]
    same = _both(_vanishes(gap * gap, both[1]), _vanishes(_dot(three, three), both[2]))
    level = ga.select(_vanishes(_dot(across, across), both[1]), ga.select(same, 3, 2), 1)
    sign = _sign_of_pencil(_dot(a, a), _dot(b, b), _dot(a, b), (sizes[1], others[1], both[1]))
    return ga.select(_vanishes(_dot(one, one), both[0]), level, sign)


@kernel(circle=CIRCLE, s=VECTOR)
def meet_circle_dual_sphere_kind(circle, s):
    """How a circle or line meets a dual sphere or dual plane, in a pair of points. 1: it does; 0: it touches; -1: it
    does not; 2: parallel, or the plane of the circle is cut in one about the same centre; 3: it lies there."""
    sizes = _sizes_of_meet(_sizes_of_circle(circle), _sizes_of_vector(s))
    pair = ga.left_contraction(s, circle)
    weight, inner = _sum_of_squares(pair, "e10 e20 e30"), _sum_of_squares(pair, "e12 e13 e23 e0inf")
    outer = _sum_of_squares(pair, "e1inf e2inf e3inf")
    inside = _both(_vanishes(inner, sizes[1]), _vanishes(outer, sizes[2]))
    level = ga.select(_vanishes(pair["e0inf"] ** 2, sizes[1]), ga.select(inside, 3, 2), 1)
    sign = _sign_of_square(_dot(pair, pair), (weight, inner, outer), sizes)
    return ga.select(_vanishes(weight, sizes[0]), level, sign)


@kernel(a=CIRCLE, b=CIRCLE)
def meet_circles_kind(a, b):
    """How two circles or lines meet. 1: in two points, lines in one and at infinity; 0: in one; -1: in none;
    2: parallel lines, or circles in one plane about one centre; 3: the same, in either sense."""
    sizes, others = _sizes_of_circle(a), _sizes_of_circle(b)
    both = _sizes_of_meet(sizes, others)
    joint = ga.polarity(a) ^ ga.polarity(b)
    parts = joint["e1230"] ** 2, _sum_of_squares(joint, "e120inf e130inf e230inf"), joint["e123inf"] ** 2
    finite = ga.select(_vanishes(parts[0], both[0]), 0, 1)
    spherical = _both(_both(1 - finite, _vanishes(parts[1], both[1])), _vanishes(parts[2], both[2]))
    null = ga.equal(_sign_of_square(_dot(joint, joint), parts, both), 0)
    single = ga.select(_both(finite, null), 0, -1)
    lines = [_vanishes(size[0], size[1]) for size in (sizes, others)]
    first, second = (
        sum(a[n] * b[n] for n in names.split()) / _sum_of_squares(b, names) for names in CIRCLE_DEGREES[:2]
    )
    scale = ga.select(lines[1], second, first)
    differences = [sum((a[n] - scale * b[n]) ** 2 for n in names.split()) for names in CIRCLE_DEGREES]
    zero = [
        _vanishes(difference, size + scale * scale * other)
        for difference, size, other in zip(differences, sizes, others, strict=True)
    ]
    sign = _sign_of_pencil(_dot(a, a), _dot(b, b), _dot(a, b), (sizes[1], others[1], both[1]))
    crossing = ga.select(_both(*lines), 1, sign)
    parallel = ga.select(zero[2], 3, 2)
    common = ga.select(_both(zero[0], zero[1]), parallel, crossing)
    return ga.select(spherical, common, single)


@kernel(circle=CIRCLE, angle=SCALAR, returns=POINT)
def point_on_circle(circle, angle):
    """The point of a real circle at an angle about its normal, from the ray that is orthogonal to the normal and to the
    coordinate axis farthest from it."""
    centre, radius, u, v, _ = _circle_frame(circle)
    return _at(centre + radius * (ga.cos(angle) * u + ga.sin(angle) * v))


@kernel(a=CIRCLE, b=CIRCLE, returns=(SCALAR, array(SCALAR, 3, 3)))
def circle_relative_to_circle(a, b):
    """The radius of `b`, and a 3 x 3 matrix that takes ``(1, cos angle, sin angle)`` of `point_on_circle` on `a` to its
    coordinates in the frame of `b`: from its centre, two in its plane, the first along its own angle 0, and the height.
    """
    p, r, u, v, _ = _circle_frame(a)
    q, s, *axes = _circle_frame(b)
    parts = p - q, r * u, r * v
    return s, tuple(tuple(_dot(axis, part) for part in parts) for axis in axes)


@kernel(p=POINT, d=COORDINATES, sphere=SPHERE)
def hit_ray_sphere(p, d, sphere):
    """The least `t`, at least 0, for which ``p + t d`` is on a sphere, from either side; not a number if there is none.

    No digits are lost for a small sphere that is far away.
    """
    d, (centre, square) = _vector(d), _sphere_parts(sphere)
    towards, along = centre - _coordinates(p), _dot(d, d)
    middle = _dot(towards, d) / along
    beside = towards - middle * d
    half = ga.sqrt((square - _dot(beside, beside)) / along)
    near, far = middle - half, middle + half
    return _unless(far < 0, ga.select(near >= 0, near, far))


# Versors.


@kernel(a=MOTOR, b=MOTOR, returns=MOTOR)
def motor_product(a, b):
    """The motor that does `b` first and then `a`."""
    return a * b


@kernel(m=MOTOR, returns=MOTOR)
def motor_inverse(m):
    """The inverse of a unit motor, which is its reverse."""
    return ~m


@kernel(axis=COORDINATES, angle=SCALAR, returns=ROTOR)
def rotor_from_axis_angle(axis, angle):
    """The rotation about an axis through the origin, right-handed. The axis may have any length but 0."""
    axis = _vector(axis)
    return ga.cos(angle / 2) - ga.sin(angle / 2) / ga.norm(axis) * axis * E1 * E2 * E3


@kernel(t=COORDINATES, returns=TRANSLATOR)
def translator_from_vector(t):
    """The translation by a vector: ``1 - t einf/2``."""
    return 1 - _vector(t) * EINF / 2


@kernel(scale=SCALAR, returns=DILATOR)
def dilator_from_scale(scale):
    """The dilation about the origin by a positive factor: ``exp(log(scale)/2 e0inf)``."""
    return (1 + scale + (scale - 1) * (E0 ^ EINF)) / (2 * ga.sqrt(scale))


@kernel(r=ROTOR, t=COORDINATES, returns=MOTOR)
def motor_from_rotor_translation(r, t):
    """The motor that turns by the rotor `r` and then translates by the vector `t`."""
    return (1 - _vector(t) * EINF / 2) * r


@kernel(line=LINE, angle=SCALAR, returns=MOTOR)
def motor_from_line(line, angle):
    """The right-handed rotation about a line, whose square may be any but 0."""
    return ga.cos(angle / 2) + ga.sin(angle / 2) / ga.sqrt(ga.scalar_product(line, line)) * ga.polarity(line)


@kernel(b=GENERATOR, returns=MOTOR)
def motor_exponential(b):
    """``exp(b)`` of the bivector of a rigid motion: rotation, translation or screw. Smooth everywhere."""
    return ga.exp(b)


@kernel(m=MOTOR, returns=GENERATOR)
def motor_logarithm(m):
    """The bivector of least angle whose exponential is `m` or `-m`, the same motion.

    Pure translations are no exception. At half turns, where the scalar part is 0, the two signs are equally near
    and the result jumps.
    """
    return ga.log(m)


@kernel(m=MOTOR, returns=MOTOR)
def motor_square_root(m):
    """The motor that, done twice, is the motion of `m`, by the smaller angle; a half turn's sign decides its sense."""
    return ga.sqrt(m)


@kernel(m=MOTOR, t=SCALAR, returns=MOTOR)
def motor_power(m, t):
    """The part `t` of the motion of `m`, by the smaller angle: ``exp(t log(m))``, of ``-m`` where that is nearer to 1.

    Any real `t`: 0 gives no motion, 1 the motion itself, -1 its inverse. At half turns the sense jumps.
    """
    return ga.power(m, t)


@kernel(a=MOTOR, b=MOTOR, t=SCALAR, returns=MOTOR)
def interpolate_motors(a, b, t):
    """The screw motion that starts as `a` at ``t = 0`` and is `b` (or `-b`) at ``t = 1``, at constant twist."""
    return ga.interpolate(a, b, t)


@kernel(b=POINT_PAIR, returns=UNIT_EVEN)
def versor_exponential(b):
    """``exp(b)`` of any bivector: motions, dilations, transversions and all other conformal maps near the identity.

    Every sum of a rotation, translation or dilation and a commuting rotation, isoclinic ones among them. Errors are a
    few units of the last place of the largest coefficient of the result or, far from the origin, of ``b b``.
    """
    return ga.exp(b)


@kernel(v=UNIT_EVEN)
def versor_logarithm(v):
    """The bivector of least angles whose exponential is the unit versor `v` or `-v`, the same conformal map.

    Every one has a logarithm. Where the scalar part is 0, at half turns, the two signs are equally near and the result
    jumps; half turns in two planes at once (`v` is a 4-vector) have many logarithms, and the result is not a number.
    """
    return ga.log(v)


@kernel(v=UNIT_EVEN, returns=UNIT_EVEN)
def versor_square_root(v):
    """The unit versor half way to `v` or `-v`: ``exp(log(v) / 2)`` without angles, where that is defined."""
    return ga.sqrt(v)


@kernel(m=MOTOR, returns=array(SCALAR, 4, 4))
def motor_to_matrix(m):
    """The homogeneous 4 x 4 matrix of a unit motor, which acts on columns (x, y, z, 1)."""
    origin = m * E0 * ~m
    columns = [m * axis * ~m for axis in (E1, E2, E3)] + [origin]
    return (*(tuple(column[name] for column in columns) for name in ("e1", "e2", "e3")), (0, 0, 0, 1))


@kernel(m=MOTOR, p=POINT, returns=POINT)
def move_point(m, p):
    """The point `p` moved by the unit motor `m`: ``m p ~m``."""
    return m * p * ~m


@kernel(r=ROTOR, p=POINT, returns=POINT)
def rotate_point(r, p):
    """The point `p` turned by the unit rotor `r`: ``r p ~r``."""
    return r * p * ~r


@kernel(t=TRANSLATOR, p=POINT, returns=POINT)
def translate_point(t, p):
    """The point `p` moved by the translator `t`: ``t p ~t``."""
    return t * p * ~t


@kernel(d=DILATOR, p=POINT, returns=POINT)
def dilate_point(d, p):
    """The point `p` scaled about the origin by the dilator `d`: ``d p ~d``, normalised."""
    return _normalized(d * p * ~d)


@kernel(m=MOTOR, x=VECTOR)
def move_vector(m, x):
    """A vector, such as a dual sphere or dual plane, moved by the unit motor `m`: ``m x ~m``."""
    return m * x * ~m


@kernel(m=MOTOR, x=POINT_PAIR)
def move_point_pair(m, x):
    """A point pair moved by the unit motor `m`: ``m x ~m``."""
    return m * x * ~m


@kernel(m=MOTOR, x=LINE)
def move_line(m, x):
    """A line moved by the unit motor `m`: ``m x ~m``."""
    return m * x * ~m


@kernel(m=MOTOR, x=CIRCLE)
def move_circle(m, x):
    """A circle moved by the unit motor `m`: ``m x ~m``."""
    return m * x * ~m


@kernel(m=MOTOR, x=PLANE)
def move_plane(m, x):
    """A plane moved by the unit motor `m`: ``m x ~m``."""
    return m * x * ~m


@kernel(m=MOTOR, x=SPHERE)
def move_sphere(m, x):
    """A sphere moved by the unit motor `m`: ``m x ~m``."""
    return m * x * ~m


@kernel(v=UNIT_EVEN, x=VECTOR)
def transform_vector(v, x):
    """A vector transformed by any unit even versor, a conformal map: ``v x ~v``."""
    return v * x * ~v


@kernel(p=POINT, plane=DUAL_PLANE, returns=POINT)
def reflect_point(p, plane):
    """The mirror image of a point in a dual plane, whose normal may have any length but 0."""
    return _normalized(-(plane * p * plane))


@kernel(p=POINT, s=VECTOR, returns=POINT)
def invert_point(p, s):
    """The inversion of a point in a dual sphere: on the same ray from the centre, distances multiply to r**2.

    The centre goes to infinity: division by 0.
    """
    return _normalized(-(s * p * s))


# Versors of all conformal maps.


@kernel(b=COORDINATES, returns=TRANSVERSOR)
def transversor_from_vector(b):
    """The transversion ``1 + b e0``: inversion in the unit sphere, translation by ``-b``, inversion again.

    It takes x to ``(x - x**2 b) / (1 - 2 b . x + b**2 x**2)``.
    """
    return 1 + _vector(b) * E0


@kernel(d=DILATOR)
def dilator_to_scale(d):
    """The factor of a dilator: ``exp`` of twice the coefficient of its logarithm."""
    return (d["1"] + d["e0inf"]) ** 2


@kernel(m=MOTOR, returns=(ROTOR, COORDINATES))
def motor_to_rotor_translation(m):
    """The rotor and the vector of the translation after it."""
    return (m["1"] + m["e12"] * E1 * E2 + m["e13"] * E1 * E3 + m["e23"] * E2 * E3), _tuple(m * E0 * ~m)


def _square_root_inverse(s):
    """``s**(-1/2)`` of a scalar and a 4-vector: of what a versor's sum with 1 is off from a unit one."""
    scalar, four = s.grade(0), s.grade(4)
    number = scalar["1"]
    root = ga.sqrt(number * number - ga.scalar_product(four, four))
    return (number + root - four) / (root * ga.sqrt(2 * (number + root)))


@kernel(x=EVEN, returns=EVEN)
def normalize_versor(x):
    """The unit versor nearest to an even element: ``(x ~x)**(-1/2) x``. Sums of versors become versors."""
    return _square_root_inverse(x * ~x) * x


@kernel(m=MOTOR, returns=UNIT_EVEN)
def versor_from_motor(m):
    """A motor with all sixteen coefficients of a versor, for products with versors of other kinds."""
    return m


@kernel(d=DILATOR, returns=UNIT_EVEN)
def versor_from_dilator(d):
    """A dilator with all sixteen coefficients of a versor."""
    return d


@kernel(k=TRANSVERSOR, returns=UNIT_EVEN)
def versor_from_transversor(k):
    """A transversor with all sixteen coefficients of a versor."""
    return k


@kernel(a=POINT, b=POINT, returns=TRANSLATOR)
def translator_between_points(a, b):
    """The translation that takes the point `a` to `b`."""
    return 1 - (_coordinates(b) - _coordinates(a)) * EINF / 2


@kernel(x=UNIT_EVEN, returns=(SCALAR, ROTOR, COORDINATES, COORDINATES))
def versor_decomposition(x):
    """A conformal map as a transversion, then a dilation, a rotation and a translation: scale, rotor, and the vectors
    of the translation and of the transversion.

    ``translator * rotor * dilator * transversor`` is `x` again, its sign in the rotor. A map that takes the origin to
    infinity, or nearly, has no such form: division by 0.
    """
    moved, back = (x * E0 * ~x).grade(1), (~x * EINF * x).grade(1)
    weight = _weight(moved)
    t, b = _coordinates(moved) / weight, _coordinates(back) / (2 * weight)
    scale = 1 / weight
    rest = (1 + t * EINF / 2) * x
    factor = 2 * ga.sqrt(scale) / (1 + scale)
    rotor = {name: factor * rest[name] for name in ("1", "e12", "e13", "e23")}
    return scale, ga.assemble(CGA3, rotor), _tuple(t), _tuple(b)


# Versors between two objects of one kind: the square root of their ratio. Nearly opposite ones are turned over first.


def _root(ratio):
    """The versor half way to a ratio ``b a**-1`` of objects, which takes `a` to `b`."""
    sum_ = 1 + ratio
    return sum_ * _square_root_inverse(2 + ratio + ~ratio)


def _between(a, b, turn):
    """From `a` to `b`, unit ones, where `turn` takes `a` to ``-a``."""
    square = ga.scalar_product(a, a)
    ratio = b * a / square
    ratio = ratio.grade(0, 2, 4)
    opposite = ratio["1"] < NEARLY_OPPOSITE
    root = _root(ga.select(opposite, -ratio, ratio))
    return root * ga.select(opposite, turn, 1)


def _half_turn(point, direction):
    """About the line through a point along a unit direction."""
    return ga.polarity(_line_through(point, direction))


def _unit_blade(x):
    return x / ga.sqrt(ga.absolute(ga.scalar_product(x, x)))


@kernel(a=LINE, b=LINE, returns=MOTOR)
def motor_between_lines(a, b):
    """The motor that takes the line `a` to the line `b` along with its direction; it exists for every pair.

    It turns about the common perpendicular and moves along it; nearly opposite lines are turned over first.
    """
    d, p = _line_parts(a)
    return _between(_unit_blade(a), _unit_blade(b), _half_turn(p, _perpendicular(d)))


@kernel(a=PLANE, b=PLANE, returns=MOTOR)
def motor_between_planes(a, b):
    """The motor that takes the plane `a` to the plane `b` along with its normal; it exists for every pair.

    It turns about the line in which they meet, or translates along the normal of parallel ones; nearly opposite ones
    are turned over first.
    """
    n, distance = _plane_parts(a)
    return _between(_unit_blade(a), _unit_blade(b), _half_turn(distance * n, _perpendicular(n)))


@kernel(a=SPHERE, b=SPHERE, returns=UNIT_EVEN)
def versor_between_spheres(a, b):
    """The versor that takes the sphere `a` to `b` along with the signs of their weights.

    Both are real, or both imaginary with weights of one sign, else the result is not a number. Of real spheres apart
    from each other, with weights of one sign, `a` is turned inside out by an inversion and a reflection first.
    """
    one, two = _unit_blade(a), _unit_blade(b)
    centre, _ = _sphere_parts(a)
    mirror = E1 + _dot(centre, E1) * EINF
    wrong = ga.minimum(_sphere_sign(a), _sphere_sign(b)) <= 0
    other = ga.maximum(ga.maximum(_sphere_sign(a), _sphere_sign(b)) >= 0, ga.scalar_product(a, b) < 0)
    wrong = ga.minimum(wrong, other)
    turn = (ga.polarity(one) * mirror).grade(0, 2)
    return _unless(wrong, _between(one, two, turn))


@kernel(a=CIRCLE, b=CIRCLE, returns=UNIT_EVEN)
def versor_between_circles(a, b):
    """The versor that takes the circle `a` to the circle `b` along with its sense, lines among them as `b`.

    The root of the ratio ``b a**-1``, which turns or scales the least; point pairs and their polarities have the same
    one. Not a number where `a` is a line, where one is
    real and the other imaginary, and for circles linked so that ``b a**-1`` is a 4-vector, such as a circle and its
    axis.
    """
    centre, normal, _ = _circle_parts(a)
    wrong = ga.scalar_product(a, a) * ga.scalar_product(b, b) <= 0
    return _unless(wrong, _between(_unit_blade(a), _unit_blade(b), _half_turn(centre, _perpendicular(normal))))


@kernel(a=POINT, b=POINT, n=COORDINATES, m=COORDINATES, scale=SCALAR, returns=UNIT_EVEN)
def similarity_between_rounds(a, b, n, m, scale):
    """The versor that turns, scales and translates a round into another of its kind, and nothing else.

    From the centre `a` to the centre `b`, from the unit direction or normal `n` to `m` (the same of both for spheres),
    and by the ratio `scale` of the radii, positive. The rotation is the smaller one; where the cosine of `n` and `m` is
    below -0.9, that from ``-n`` to `m` after a half turn about a line orthogonal to `n`.
    """
    n, m = _vector(n), _vector(m)
    rotor = _between(n, m, _perpendicular(n) * SPACE)
    dilator = (1 + scale + (scale - 1) * (E0 ^ EINF)) / (2 * ga.sqrt(scale))
    return (1 - _coordinates(b) * EINF / 2) * rotor * dilator * (1 + _coordinates(a) * EINF / 2)


# Versors on every kind of object.


@kernel(v=UNIT_EVEN, p=POINT, returns=POINT)
def transform_point(v, p):
    """A point transformed by any unit even versor, a conformal map. What goes to infinity: division by 0."""
    return _normalized(v * p * ~v)


@kernel(v=UNIT_EVEN, x=POINT_PAIR)
def transform_point_pair(v, x):
    """A point pair, dual circle or dual line transformed by any unit even versor: ``v x ~v``."""
    return v * x * ~v


@kernel(v=UNIT_EVEN, x=CIRCLE)
def transform_circle(v, x):
    """A circle transformed by any unit even versor: ``v x ~v``."""
    return v * x * ~v


@kernel(v=UNIT_EVEN, x=SPHERE)
def transform_sphere(v, x):
    """A sphere transformed by any unit even versor: ``v x ~v``."""
    return v * x * ~v
