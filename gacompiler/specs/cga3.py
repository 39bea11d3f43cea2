"""Conformal geometry of space in G(4,1) with the null basis ``e0, einf`` and ``einf . e0 = -1``.

The point at x is ``x + e0 + x**2/2 einf``; three coordinates are stored, the other two are known. Rounds and flats are
outer products of points: point pairs of 2, circles of 3, spheres of 4; lines are ``a ^ b ^ einf`` and planes ``a ^ b ^
c ^ einf``. A *dual* sphere is the vector ``c - r**2/2 einf`` of its centre c and radius r, and a *dual* plane is ``n +
d einf`` for the plane ``n . x = d``. `polarity`, multiplication by ``e0123inf**-1``, takes a sphere or plane to a
multiple of its dual.

A `kind` is 1 for real, 0 for tangent (of radius 0), -1 for imaginary, 2 for flat, parallel or concentric, and 3 for
coinciding objects. It is determined with a tolerance of 1e-12 relative to the squares of the radii and of the distances
from the origin; `radius_squared` of a result gives the same information without a tolerance.

Even versors transform every element by ``v x ~v``: the rotor ``exp(-angle/2 B)``, the translator ``1 - t einf/2``, the
dilator ``exp(log(scale)/2 e0inf)``. A motor combines rotation and translation; its eight coefficients are, in order,
those of the same motor in G(3,0,1). Angles are in radians; lengths are in the units of the coordinates.
"""

from fractions import Fraction
from typing import Any, NamedTuple

import gacompiler as ga
from gacompiler import SCALAR, array, each, iterate, kernel
from gacompiler.algebra.catalog import CGA3
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

POINT, VECTOR, DUAL_PLANE = CGA3.POINT, CGA3.VECTOR, CGA3.DUAL_PLANE
POINT_PAIR, LINE, CIRCLE, PLANE, SPHERE = CGA3.POINT_PAIR, CGA3.LINE, CGA3.CIRCLE, CGA3.PLANE, CGA3.SPHERE
ROTOR, MOTOR, UNIT_EVEN = CGA3.ROTOR, CGA3.MOTOR, CGA3.UNIT_EVEN
COORDINATES = array(SCALAR, 3)
GENERATOR = CGA3.layout("GENERATOR", "e12 e13 e23 e1inf e2inf e3inf")
"""Bivectors of rigid motions."""

E1, E2, E3, E0, EINF = CGA3.basis()
SPACE, PSEUDOSCALAR = E1 * E2 * E3, CGA3.pseudoscalar
AXES = ("e1", "e2", "e3")
BISECTIONS, POLISH = 20, 3
space = ConformalSpace(CGA3)
PRODUCTS = products(CGA3)
POINTS = points(space, coordinates="three", coefficients="five", sphere="sphere")
LINES_AND_ROUNDS = lines_and_rounds(space, circle_dual=POINT_PAIR, coefficients="ten")
MOTORS = motors(CGA3, GENERATOR, motion="screw motion")
VERSORS = versors(space, sphere="sphere", coefficients="sixteen")
CONFORMAL_MAPS = conformal_maps(space, sphere="sphere", plane="plane")


def _cross(a, b):
    return -(a ^ b) * SPACE


def _perpendicular(n):
    """Return a unit vector orthogonal to `n` and to the coordinate axis of its smallest component."""
    x, y, z = (n[name] * n[name] for name in AXES)
    axis = ga.select(x <= ga.minimum(y, z), E1, ga.select(y <= z, E2, E3))
    return ga.normalize(_cross(n, axis))


# Flats and rounds from vectors: direction and moment, normal and distance, centre and squared radius.


def _line(direction, moment):
    return (moment * SPACE + (E0 ^ direction)) ^ EINF


def _line_moment(line):
    return line["e23inf"] * E1 - line["e13inf"] * E2 + line["e12inf"] * E3


def _line_through(p, direction):
    return _line(direction, _cross(p, direction))


def _line_parts(line):
    """Return the unit direction of a line and its point nearest to the origin."""
    direction, moment = space.line_direction(line), _line_moment(line)
    square = dot(direction, direction)
    return direction / ga.sqrt(square), _cross(direction, moment) / square


def _plane(normal, distance):
    return -(distance * EINF + normal) * PSEUDOSCALAR


def _plane_normal(plane):
    return plane["e230inf"] * E1 - plane["e130inf"] * E2 + plane["e120inf"] * E3


def _plane_parts(plane):
    """Return the unit normal of a plane and its distance from the origin along the normal."""
    normal = _plane_normal(plane)
    length = length_of(normal)
    return normal / length, plane["e123inf"] / length


def _circle(centre, normal, radius_squared):
    """Return a circle that is right-handed about the normal."""
    return -((space.at(centre) - radius_squared / 2 * EINF) ^ (normal + dot(centre, normal) * EINF)) * PSEUDOSCALAR


def _circle_normal(circle):
    return circle["e230"] * E1 - circle["e130"] * E2 + circle["e120"] * E3


def _circle_parts(circle):
    """Return centre, unit normal and squared radius of a circle."""
    return space.coordinates(space.centre(circle)), ga.normalize(_circle_normal(circle)), space.radius_squared(circle)


def _circle_frame(circle):
    """Return centre, radius, and a right-handed orthonormal frame with the normal as its last vector."""
    centre, normal, square = _circle_parts(circle)
    u = _perpendicular(normal)
    return centre, ga.sqrt(square), u, _cross(normal, u), normal


# Kinds.


def _moved_squared(sphere):
    return sphere["e230inf"] ** 2 + sphere["e130inf"] ** 2 + sphere["e120inf"] ** 2


def _sphere_sign(sphere):
    return sign_of(-dot(sphere, sphere), _moved_squared(sphere))


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


# Points.

embed_point = POINTS.embed_point
extract_point = POINTS.extract_point
normalize_vector = POINTS.normalize_vector
inner_product_of_points = POINTS.inner_product_of_points
distance_squared_points = POINTS.distance_squared_points
distance_points = POINTS.distance_points
inner_product_of_vectors = POINTS.inner_product_of_vectors
power_of_point = POINTS.power_of_point


@kernel(p=POINT, plane=DUAL_PLANE)
def signed_distance_point_plane(p, plane):
    """Compute the distance from a point to a dual plane of any nonzero norm, positive on the side of its normal."""
    return ga.scalar_product(p, plane) / ga.norm(plane)


@kernel(p=POINT, line=LINE)
def distance_point_line(p, line):
    """Compute the distance from a point to a line, whose square may be any nonzero number."""
    return ga.sqrt(ga.norm_squared(p ^ line) / ga.norm_squared(line))


# Rounds and flats.

point_pair_from_points = LINES_AND_ROUNDS.point_pair_from_points
circle_from_points = LINES_AND_ROUNDS.circle_from_points


@kernel(a=POINT, b=POINT, c=POINT, d=POINT)
def sphere_from_points(a, b, c, d):
    """Construct the sphere ``a ^ b ^ c ^ d``; a plane if the points are coplanar, 0 if they are on a circle."""
    return a ^ b ^ c ^ d


line_from_points = LINES_AND_ROUNDS.line_from_points.documented(
    "Construct the line ``a ^ b ^ einf`` from `a` to `b`; its square is their squared distance."
)
line_from_point_direction = LINES_AND_ROUNDS.line_from_point_direction.documented(
    "Construct the line through the point `p` along the direction `d`; its square is that of `d`."
)


@kernel(a=POINT, b=POINT, c=POINT)
def plane_from_points(a, b, c):
    """Construct the plane ``a ^ b ^ c ^ einf``; its square is minus the square of twice the triangle's area.

    Its polarity is the dual plane with the normal ``-(b - a) x (c - a)``.
    """
    return a ^ b ^ c ^ EINF


@kernel(centre=POINT, radius=SCALAR, returns=VECTOR)
def dual_sphere_from_centre(centre, radius):
    """Construct the dual sphere ``centre - radius**2/2 einf``."""
    return centre - radius * radius / 2 * EINF


@kernel(centre=POINT, p=POINT, returns=VECTOR)
def dual_sphere_through_point(centre, p):
    """Construct the dual sphere with a given centre through a point."""
    return centre + ga.scalar_product(centre, p) * EINF


@kernel(centre=POINT, radius=SCALAR, returns=SPHERE)
def sphere_from_centre(centre, radius):
    """Construct the sphere with the polarity ``centre - radius**2/2 einf``, a dual sphere."""
    return (centre - radius * radius / 2 * EINF) * CGA3.pseudoscalar


@kernel(normal=COORDINATES, distance=SCALAR)
def dual_plane_from_normal(normal, distance):
    """Construct the dual plane ``normal + distance einf`` of all x with ``normal . x = distance``."""
    return space.vector(normal) + distance * EINF


@kernel(a=POINT, b=POINT)
def bisector_plane(a, b):
    """Compute the dual plane equidistant from `a` and `b`: the difference ``b - a``, with the normal towards `b`."""
    return b - a


@kernel(sphere=SPHERE)
def sphere_polarity(sphere):
    """Compute the dual of a sphere, with a weight."""
    return ga.polarity(sphere)


@kernel(plane=PLANE)
def plane_polarity(plane):
    """Compute the dual of a plane; for ``a ^ b ^ c ^ einf`` the normal is ``-(b - a) x (c - a)``."""
    return ga.polarity(plane)


@kernel(sphere=SPHERE, returns=POINT)
def sphere_centre(sphere):
    """Compute the centre of a sphere. A plane has none: division by 0."""
    return space.normalized(ga.polarity(sphere))


@kernel(sphere=SPHERE)
def sphere_radius_squared(sphere):
    """Compute the squared radius of a sphere, negative for an imaginary one. A plane has none: division by 0."""
    return space.radius_squared(sphere)


@kernel(circle=CIRCLE, returns=POINT)
def circle_centre(circle):
    """Compute the centre of a circle. A line has none: division by 0."""
    return space.centre(circle)


circle_radius_squared = LINES_AND_ROUNDS.circle_radius_squared


@kernel(circle=CIRCLE)
def circle_plane(circle):
    """Compute the plane of a circle: ``circle ^ einf``."""
    return circle ^ EINF


@kernel(circle=CIRCLE)
def circle_axis(circle):
    """Compute the axis of a circle: the line through its centre orthogonal to its plane."""
    return ga.polarity(circle) ^ EINF


point_pair_centre = LINES_AND_ROUNDS.point_pair_centre
point_pair_radius_squared = LINES_AND_ROUNDS.point_pair_radius_squared


@kernel(pair=POINT_PAIR, returns=(POINT, POINT))
def point_pair_points(pair):
    """Extract the two points of a pair, for ``a ^ b`` first `a` and then `b`. They are NaN if the pair is imaginary."""
    root = ga.sqrt(ga.scalar_product(pair, pair))
    carrier = ga.left_contraction(EINF, pair)
    return space.normalized((pair - root) * carrier), space.normalized((pair + root) * carrier)


# Meets.


@kernel(a=SPHERE, b=SPHERE)
def meet_spheres(a, b):
    """Compute the circle in which two spheres meet, imaginary if they do not meet; not a circle if concentric."""
    return a & b


@kernel(sphere=SPHERE, plane=PLANE)
def meet_sphere_plane(sphere, plane):
    """Compute the circle in which a sphere meets a plane, imaginary (negative squared radius) if they do not meet."""
    return sphere & plane


@kernel(a=SPHERE, b=SPHERE, c=SPHERE)
def meet_three_spheres(a, b, c):
    """Compute the point pair in which three spheres meet, imaginary if they have no common point."""
    return a & b & c


@kernel(line=LINE, sphere=SPHERE)
def meet_line_sphere(line, sphere):
    """Compute the point pair in which a line meets a sphere, imaginary if they do not meet."""
    return line & sphere


@kernel(circle=CIRCLE, plane=PLANE)
def meet_circle_plane(circle, plane):
    """Compute the point pair in which a circle meets a plane, imaginary if they do not meet."""
    return circle & plane


@kernel(circle=CIRCLE, sphere=SPHERE)
def meet_circle_sphere(circle, sphere):
    """Compute the point pair in which a circle meets a sphere, imaginary if they do not meet."""
    return circle & sphere


@kernel(a=PLANE, b=PLANE)
def meet_planes(a, b):
    """Compute the line in which two planes meet."""
    return a & b


@kernel(line=LINE, plane=PLANE, returns=POINT)
def meet_line_plane(line, plane):
    """Compute the point in which a line meets a plane; division by 0 if they are parallel."""
    flat = line & plane
    return space.point(*(flat[name] / flat["e0inf"] for name in ("e1inf", "e2inf", "e3inf")))


# Flats from points and directions, in direct and dual form.

flat_point_from_point = POINTS.flat_point_from_point
point_from_flat_point = POINTS.point_from_flat_point


@kernel(d=COORDINATES, m=COORDINATES, returns=LINE)
def line_from_direction_moment(d, m):
    """Construct a line from its Pluecker coordinates: direction `d` and moment `m`, ``p x d`` for all p on it."""
    return _line(space.vector(d), space.vector(m))


@kernel(line=LINE, returns=(COORDINATES, COORDINATES))
def line_to_direction_moment(line):
    """Extract the direction and the moment of a line, its Pluecker coordinates, without normalisation."""
    return space.components(space.line_direction(line)), space.components(_line_moment(line))


@kernel(normal=COORDINATES, distance=SCALAR, returns=PLANE)
def plane_from_normal(normal, distance):
    """Construct the plane of all x with ``normal . x = distance``."""
    return _plane(space.vector(normal), distance)


@kernel(plane=PLANE, returns=(COORDINATES, SCALAR))
def plane_to_normal(plane):
    """Extract the unit normal of a plane and its signed distance from the origin along the normal.

    The normal of the plane through a, b, c is along ``(b - a) x (c - a)``.
    """
    normal, distance = _plane_parts(plane)
    return space.components(normal), distance


@kernel(p=POINT, normal=COORDINATES, returns=PLANE)
def plane_from_point_normal(p, normal):
    """Construct the plane through `p` orthogonal to a vector."""
    return _plane(space.vector(normal), dot(p, space.vector(normal)))


@kernel(p=POINT, line=LINE, returns=PLANE)
def join_point_line(p, line):
    """Compute the plane through a point and a line; 0 if the point is on the line."""
    return p ^ line


line_polarity = LINES_AND_ROUNDS.line_polarity.documented(
    "Compute the dual of a line, a bivector. It is twice a generator of rotations, of square -1 if normalised."
)
line_from_dual = LINES_AND_ROUNDS.line_from_dual


@kernel(dual=DUAL_PLANE, returns=PLANE)
def plane_from_dual(dual):
    """Construct the plane with the given polarity; its normal is opposite to that of the dual."""
    return dual * PSEUDOSCALAR


circle_from_line = LINES_AND_ROUNDS.circle_from_line


@kernel(plane=PLANE, returns=SPHERE)
def sphere_from_plane(plane):
    """Convert a plane to a sphere with all five coefficients, for functions of spheres."""
    return plane


@kernel(dual=VECTOR, returns=SPHERE)
def sphere_from_dual(dual):
    """Construct the sphere with the given polarity."""
    return dual * PSEUDOSCALAR


circle_from_dual = LINES_AND_ROUNDS.circle_from_dual.documented(
    "Construct the circle with the given polarity; ``a ^ b`` of two dual spheres gives their intersection."
)


@kernel(dual=CIRCLE, returns=POINT_PAIR)
def point_pair_from_dual(dual):
    """Construct the point pair with the given polarity; ``a ^ b ^ c`` of three dual spheres gives their meet."""
    return dual * PSEUDOSCALAR


circle_polarity = LINES_AND_ROUNDS.circle_polarity.documented("Compute the dual of a circle, a bivector.")


@kernel(pair=POINT_PAIR, returns=CIRCLE)
def point_pair_polarity(pair):
    """Compute the dual of a point pair, a trivector."""
    return ga.polarity(pair)


# Rounds from centres and radii. The squared radius is negative for an imaginary round and 0 for a tangent one.

point_pair_from_centre = LINES_AND_ROUNDS.point_pair_from_centre


@kernel(centre=POINT, normal=COORDINATES, radius_squared=SCALAR, returns=CIRCLE)
def circle_from_centre(centre, normal, radius_squared):
    """Construct the circle about a centre that is right-handed about a normal of any nonzero length."""
    return _circle(space.coordinates(centre), space.vector(normal), radius_squared)


@kernel(centre=POINT, radius_squared=SCALAR, returns=SPHERE)
def sphere_from_centre_radius_squared(centre, radius_squared):
    """Construct the sphere with polarity ``centre - radius_squared/2 einf``; imaginary if `radius_squared` < 0."""
    return (centre - radius_squared / 2 * EINF) * PSEUDOSCALAR


@kernel(a=VECTOR, b=VECTOR, returns=CIRCLE)
def circle_from_dual_spheres(a, b):
    """Compute the circle in which two dual spheres meet; a line for two dual planes."""
    return -(a ^ b) * PSEUDOSCALAR


@kernel(sphere=SPHERE, p=POINT, returns=PLANE)
def tangent_plane_of_sphere(sphere, p):
    """Compute the tangent plane of a sphere at one of its points."""
    return ga.left_contraction(p, sphere) ^ EINF


# Parameters of objects.


@kernel(plane=PLANE, returns=POINT)
def plane_support(plane):
    """Compute the point of a plane that is nearest to the origin."""
    normal = _plane_normal(plane)
    return space.at(plane["e123inf"] / dot(normal, normal) * normal)


@kernel(line=LINE, returns=POINT)
def line_support(line):
    """Compute the point of a line that is nearest to the origin."""
    return space.at(_line_parts(line)[1])


@kernel(circle=CIRCLE, returns=COORDINATES)
def circle_normal(circle):
    """Compute the unit normal about which a circle is right-handed."""
    return space.components(ga.normalize(_circle_normal(circle)))


@kernel(circle=CIRCLE)
def circle_weight(circle):
    """Compute the weight of a circle, the length of its unnormalised normal: for three points, twice their area."""
    return length_of(_circle_normal(circle))


@kernel(circle=CIRCLE, returns=VECTOR)
def circle_surround_sphere(circle):
    """Compute the dual sphere of weight 1 with the centre and the radius of a circle."""
    return space.centre(circle) - space.radius_squared(circle) / 2 * EINF


point_pair_direction = LINES_AND_ROUNDS.point_pair_direction
point_pair_weight = LINES_AND_ROUNDS.point_pair_weight
point_pair_line = LINES_AND_ROUNDS.point_pair_line


@kernel(pair=POINT_PAIR, returns=VECTOR)
def point_pair_surround_sphere(pair):
    """Compute the dual sphere of weight 1 of which a point pair is a diameter."""
    return space.centre(pair) - space.radius_squared(pair) / 2 * EINF


@kernel(sphere=SPHERE)
def sphere_weight(sphere):
    """Compute the weight of a sphere; its sign is the orientation. For four points it is minus six times the volume."""
    return space.weight(ga.polarity(sphere))


@kernel(s=VECTOR)
def dual_sphere_radius_squared(s):
    """Compute the squared radius of a dual sphere of any nonzero weight, negative for an imaginary one."""
    return dot(s, s) / space.weight(s) ** 2


@kernel(pair=POINT_PAIR)
def point_pair_kind(pair):
    """Classify a point pair: 1 two points, 0 a double point (a tangent vector), -1 imaginary, 2 a flat point."""
    carrier = ga.left_contraction(EINF, pair)
    inner = pair["e12"] ** 2 + pair["e13"] ** 2 + pair["e23"] ** 2 + pair["e0inf"] ** 2
    direction = space.coordinates(carrier)
    return kind_of_round(dot(direction, direction), inner, dot(pair, pair))


@kernel(circle=CIRCLE)
def circle_kind(circle):
    """Classify a circle: 1 real, 0 of radius 0, -1 imaginary, 2 a line."""
    normal = _circle_normal(circle)
    moved = sum(circle[name] ** 2 for name in ("e123", "e10inf", "e20inf", "e30inf"))
    return kind_of_round(dot(normal, normal), moved, dot(circle, circle))


@kernel(sphere=SPHERE)
def sphere_kind(sphere):
    """Classify a sphere: 1 real, 0 a point, -1 imaginary, 2 a plane."""
    return kind_of_round(sphere["e1230"] ** 2, _moved_squared(sphere), -dot(sphere, sphere))


# Distances, in the units of the coordinates: the minimum over all pairs of points of the two objects.


@kernel(p=POINT, sphere=SPHERE)
def signed_distance_point_sphere(p, sphere):
    """Compute the distance from a point to a sphere, negative inside; NaN for an imaginary sphere."""
    centre, square = space.sphere_parts(sphere)
    return length_of(space.coordinates(p) - centre) - ga.sqrt(square)


def _to_circle(p, centre, normal):
    """Return the height above the plane of a circle, the in-plane vector from its centre, and the vector's length."""
    away = p - centre
    height = dot(away, normal)
    inside = away - height * normal
    return height, inside, length_of(inside)


@kernel(p=POINT, circle=CIRCLE)
def distance_point_circle(p, circle):
    """Compute the distance from a point to a circle; NaN for an imaginary circle."""
    centre, normal, square = _circle_parts(circle)
    height, _, length = _to_circle(space.coordinates(p), centre, normal)
    gap = length - ga.sqrt(square)
    return ga.sqrt(height * height + gap * gap)


def _parts_of_lines(a, b):
    """Return directions, support points, the cross product of the directions and its square, and a flag.

    The flag is true if the lines are parallel.
    """
    (d, p), (e, q) = _line_parts(a), _line_parts(b)
    across = _cross(d, e)
    square = dot(across, across)
    return d, p, e, q, across, square, square <= NEARLY_ZERO**2


@kernel(a=LINE, b=LINE)
def distance_lines(a, b):
    """Compute the distance between two lines, including parallel lines."""
    (d, m), (e, k) = ((space.line_direction(line), _line_moment(line)) for line in (a, b))
    across, first, second = _cross(d, e), dot(d, d), dot(e, e)
    square = dot(across, across)
    parallel = square <= NEARLY_ZERO**2 * first * second
    skew = ga.absolute(dot(d, k) + dot(m, e)) / ga.sqrt(ga.select(parallel, 1, square))
    beside = (dot(d, e) / second) * k - m
    return ga.select(parallel, ga.sqrt(dot(beside, beside) / first), skew)


@kernel(line=LINE, plane=PLANE)
def signed_distance_line_plane(line, plane):
    """Compute the signed distance from a plane to a parallel line, positive on the normal's side; otherwise 0."""
    (direction, point), (normal, distance) = _line_parts(line), _plane_parts(plane)
    return ga.select(ga.absolute(dot(direction, normal)) <= NEARLY_ZERO, dot(point, normal) - distance, 0)


@kernel(a=PLANE, b=PLANE)
def signed_distance_planes(a, b):
    """Compute the signed distance from the plane `a` to a parallel plane `b` along the normal of `a`; otherwise 0."""
    (n, distance), (m, other) = _plane_parts(a), _plane_parts(b)
    across = _cross(n, m)
    along = ga.select(dot(n, m) < 0, -other, other)
    return ga.select(dot(across, across) <= NEARLY_ZERO**2, along - distance, 0)


def _point_to_line(p, direction, support):
    away = p - support
    return away - dot(away, direction) * direction


@kernel(line=LINE, sphere=SPHERE)
def distance_line_sphere(line, sphere):
    """Compute the distance between a line and a sphere; 0 if they meet."""
    direction, (centre, square) = space.line_direction(line), space.sphere_parts(sphere)
    moment = _cross(centre, direction) - _line_moment(line)
    return ga.maximum(0, ga.sqrt(dot(moment, moment) / dot(direction, direction)) - ga.sqrt(square))


@kernel(plane=PLANE, circle=CIRCLE)
def distance_plane_circle(plane, circle):
    """Compute the distance between a plane and a circle; 0 if they meet."""
    (normal, distance), (centre, axis, square) = _plane_parts(plane), _circle_parts(circle)
    height = ga.absolute(dot(centre, normal) - distance)
    return ga.maximum(0, height - ga.sqrt(square) * length_of(_cross(axis, normal)))


@kernel(plane=PLANE, sphere=SPHERE)
def distance_plane_sphere(plane, sphere):
    """Compute the distance between a plane and a sphere; 0 if they meet."""
    (normal, distance), (centre, square) = _plane_parts(plane), space.sphere_parts(sphere)
    return ga.maximum(0, ga.absolute(dot(centre, normal) - distance) - ga.sqrt(square))


@kernel(circle=CIRCLE, sphere=SPHERE)
def distance_circle_sphere(circle, sphere):
    """Compute the distance between a circle and the surface of a sphere; 0 if they meet."""
    (centre, normal, square), (middle, other) = _circle_parts(circle), space.sphere_parts(sphere)
    height, _, length = _to_circle(middle, centre, normal)
    radius, ball = ga.sqrt(square), ga.sqrt(other)
    near, far = (ga.sqrt(height * height + (length + sign * radius) ** 2) for sign in (-1, 1))
    return ga.maximum(0, ga.maximum(near - ball, ball - far))


@kernel(a=SPHERE, b=SPHERE)
def distance_spheres(a, b):
    """Compute the distance between two spheres, which may be nested; 0 if they meet."""
    return distance_of_spheres(*space.sphere_parts(a), *space.sphere_parts(b))


def _nearest_on_circle_to_line(line, circle):
    """Return the point of a circle that is nearest to a line, and the corresponding point of the line.

    In the frame u, v of the circle's plane with v orthogonal to the line, the point is ``c + r (C u + S v)``, and ``-2
    (A C + B S) - e C**2`` is minimised. C and S have the signs of A and B. In terms of the tangent t of half the angle,
    ``B t**4 + 2 (A - e) t**3 + 2 (A + e) t - B`` has one root in [0, 1]: the polynomial is -B at 0 and 4 A at 1.
    """
    (d, q), (centre, normal, square) = _line_parts(line), _circle_parts(circle)
    radius = ga.sqrt(square)
    across = _cross(d, normal)
    sine = dot(across, across)
    v = ga.normalize(ga.select(sine <= NEARLY_ZERO**2, _perpendicular(normal), across))
    u = _cross(v, normal)
    to_line = -_point_to_line(centre, d, q)
    a, b = dot(to_line, u), dot(to_line, v)
    e = radius * dot(u, d) ** 2
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


# Angles in [0, pi], and conformal invariants.


def _angle(a, b):
    return ga.atan2(length_of(_cross(a, b)), dot(a, b))


@kernel(a=COORDINATES, b=COORDINATES)
def angle_between_directions(a, b):
    """Compute the angle between two vectors of any nonzero length, such as directions of lines or normals of circles.

    Small angles and angles near pi are accurate.
    """
    return _angle(space.vector(a), space.vector(b))


@kernel(a=LINE, b=LINE)
def angle_between_lines(a, b):
    """Compute the angle between the directions of two lines."""
    return _angle(space.line_direction(a), space.line_direction(b))


@kernel(a=PLANE, b=PLANE)
def angle_between_planes(a, b):
    """Compute the angle between the normals of two planes."""
    return _angle(_plane_normal(a), _plane_normal(b))


@kernel(line=LINE, plane=PLANE)
def signed_angle_line_plane(line, plane):
    """Compute the angle between a line and a plane, in [-pi/2, pi/2], positive along the normal."""
    d, n = space.line_direction(line), _plane_normal(plane)
    return ga.atan2(dot(d, n), length_of(_cross(d, n)))


@kernel(a=CIRCLE, b=CIRCLE)
def angle_between_circles(a, b):
    """Compute the angle between the normals of two circles."""
    return _angle(_circle_normal(a), _circle_normal(b))


inversive_distance = POINTS.inversive_distance.documented(
    """Compute the inversive distance ``-a . b / (|a| |b|)`` of dual spheres or planes, a conformal invariant.

    For spheres with centres at the distance d it is ``(d**2 - r**2 - s**2) / (2 r s)``: minus the cosine of the angle
    between the radii if they meet, 1 if they touch from outside, -1 from inside, larger if they are separate. The signs
    of the weights matter. For a sphere and a plane it is the distance from centre to plane divided by the radius.
    """
)


@kernel(a=VECTOR, b=VECTOR)
def angle_between_dual_spheres(a, b):
    """Compute the angle between the radii of two dual spheres, or between normals, where they meet; otherwise NaN."""
    return ga.acos(dot(a, b) / ga.sqrt(dot(a, a) * dot(b, b)))


@kernel(a=CIRCLE, b=CIRCLE)
def inner_product_of_circles(a, b):
    """Compute the inner product of two circles or lines.

    Its square is the square of `a` times the square of `b` times ``cos**2`` of an angle: if the circles meet twice, of
    the angle between their orientations, equal in both points. The angle is a conformal invariant.
    """
    return ga.scalar_product(a, b)


inner_product_of_point_pairs = LINES_AND_ROUNDS.inner_product_of_point_pairs


@kernel(circle=CIRCLE, s=VECTOR)
def conformal_sine_circle_sphere(circle, s):
    """Compute the sine of the angle at which a circle or line crosses a dual sphere or plane.

    ``|s ^ circle*| / (|s| |circle|)`` is a conformal invariant. It is 0 if the circle lies on the sphere, and if they
    do not meet; `meet_circle_dual_sphere_kind` distinguishes these cases.
    """
    joint = s ^ ga.polarity(circle)
    joint_squared = -ga.scalar_product(joint, joint)
    return ga.sqrt(ga.maximum(0, joint_squared) / (dot(s, s) * ga.scalar_product(circle, circle)))


# Closest points, projections, rejections.


@kernel(a=LINE, b=LINE, returns=(POINT, POINT))
def closest_points_of_lines(a, b):
    """Compute the closest points of two lines, the ends of their common perpendicular.

    For parallel lines, these are the point of `a` nearest to the origin and its projection on `b`.
    """
    d, p, e, q, across, square, parallel = _parts_of_lines(a, b)
    along = dot(_cross(q - p, e), across) / ga.select(parallel, 1, square)
    one = p + ga.select(parallel, 0, along) * d
    return space.at(one), space.at(one - _point_to_line(one, e, q))


@kernel(line=LINE, circle=CIRCLE, returns=(POINT, POINT))
def closest_points_line_circle(line, circle):
    """Compute the closest points of a line and a circle; one pair if there are several."""
    on_circle, on_line = _nearest_on_circle_to_line(line, circle)
    return space.at(on_line), space.at(on_circle)


@kernel(p=POINT, plane=PLANE, returns=POINT)
def project_point_on_plane(p, plane):
    """Project a point orthogonally onto a plane."""
    normal, distance = _plane_parts(plane)
    return space.at(space.coordinates(p) - (dot(p, normal) - distance) * normal)


@kernel(p=POINT, line=LINE, returns=POINT)
def project_point_on_line(p, line):
    """Project a point orthogonally onto a line."""
    direction = space.line_direction(line)
    moment = _line_moment(line) - _cross(space.coordinates(p), direction)
    return space.at(space.coordinates(p) + _cross(direction, moment) / dot(direction, direction))


@kernel(p=POINT, sphere=SPHERE, returns=POINT)
def project_point_on_sphere(p, sphere):
    """Compute the point of a sphere nearest to a point; NaN for the centre, where it is not unique."""
    centre, square = space.sphere_parts(sphere)
    away = space.coordinates(p) - centre
    return space.at(centre + ga.sqrt(square) / length_of(away) * away)


@kernel(p=POINT, circle=CIRCLE, returns=POINT)
def project_point_on_circle(p, circle):
    """Compute the point of a circle nearest to a point; NaN on its axis, where it is not unique."""
    centre, normal, square = _circle_parts(circle)
    _, inside, length = _to_circle(space.coordinates(p), centre, normal)
    return space.at(centre + ga.sqrt(square) / length * inside)


@kernel(circle=CIRCLE, s=VECTOR)
def project_circle_on_sphere(circle, s):
    """Project a circle onto a sphere or plane with the dual `s`: ``(circle . S) S**-1``.

    The result is orthogonal to a sphere that passes through the given circle and is orthogonal to `s`.
    """
    return (circle - (s ^ ga.left_contraction(s, circle)) / dot(s, s)).grade(3)


# Inversions in spheres and reflections in planes. Weights are preserved; orientations are transformed, too.

invert_vector = CONFORMAL_MAPS.invert_vector
invert_point_pair = CONFORMAL_MAPS.invert_point_pair
invert_circle = CONFORMAL_MAPS.invert_circle


@kernel(x=SPHERE, s=VECTOR)
def invert_sphere(x, s):
    """Invert a sphere in a dual sphere or reflect it in a dual plane: ``s x s**-1``."""
    return s * x * s / dot(s, s)


# Meets that need more than the regressive product, and the kinds of all meets.


@kernel(p=PLANE, q=PLANE, r=PLANE, returns=POINT)
def meet_three_planes(p, q, r):
    """Compute the point in which three planes meet; division by 0 unless there is exactly one."""
    flat = p & q & r
    return space.point(*(flat[name] / flat["e0inf"] for name in ("e1inf", "e2inf", "e3inf")))


@kernel(line=LINE, circle=CIRCLE)
def meet_line_circle(line, circle):
    """Compute the point pair in which a line meets a coplanar circle, using the sphere about the circle."""
    return line & ((space.centre(circle) - space.radius_squared(circle) / 2 * EINF) * PSEUDOSCALAR)


@kernel(a=CIRCLE, b=CIRCLE)
def meet_circles(a, b):
    """Compute the point pair in which two circles on one sphere or in one plane meet, imaginary if they do not meet.

    For circles in different planes, it is the meet of `a` with the plane of `b`.
    """
    n, m = ga.normalize(_circle_normal(a)), ga.normalize(_circle_normal(b))
    across = _cross(n, m)
    around = (space.centre(b) - space.radius_squared(b) / 2 * EINF) * PSEUDOSCALAR
    return a & ga.select(dot(across, across) <= NEARLY_ZERO**2, around, b ^ EINF)


# Kinds of meets. The meet of two objects is a blade whose coefficients have degree 1, 2 and 3 in lengths. Each is
# treated as 0 up to a tolerance relative to the sizes of its operands.


def _sum_of_squares(x, names):
    return sum(x[name] ** 2 for name in names.split())


def _sizes_of_vector(s):
    """Return the squared sizes of a dual sphere's coefficients of degree 0, 1 and 2; its radius counts as degree 1."""
    return s["e0"] ** 2, _sum_of_squares(s, "e1 e2 e3") + 2 * ga.absolute(s["e0"] * s["einf"]), s["einf"] ** 2


CIRCLE_DEGREES = ("e120 e130 e230", "e123 e10inf e20inf e30inf", "e12inf e13inf e23inf")
"""Coefficients of circles by their degree in lengths."""


def _sizes_of_circle(circle):
    first, middle, last = (_sum_of_squares(circle, names) for names in CIRCLE_DEGREES)
    return first, middle + 2 * ga.sqrt(first * last), last


def _sizes_of_meet(a, b):
    """Return the squared sizes of the coefficients of degree 1, 2 and 3 of the meet of objects of these sizes."""
    one, two, three = a[0] * b[1] + a[1] * b[0], a[1] * b[1], a[1] * b[2] + a[2] * b[1]
    return one, two + a[0] * b[2] + a[2] * b[0], three


def _both(a, b):
    return ga.minimum(a, b)


def _sign_of_square(value, parts, sizes):
    """Return the sign of the square of a blade with these squared coefficients of degree 1, 2 and 3."""
    known = parts[0] * sizes[2] + parts[1] * sizes[1] + parts[2] * sizes[0]
    return sign_of(value, 4 * ga.sqrt(known + NEARLY_ZERO**2 * (sizes[0] * sizes[2] + sizes[1] * sizes[1])))


def _sign_of_pencil(a, b, product, sizes):
    """Return the sign of ``a**2 b**2 - (a . b)**2`` for two squares and the inner product; the last size is squared."""
    one, two, mixed = sizes[0], sizes[1], ga.sqrt(sizes[2])
    size = one * ga.absolute(b) + two * ga.absolute(a) + mixed * (2 * ga.absolute(product) + NEARLY_ZERO * mixed)
    return sign_of(a * b - product * product, size)


@kernel(a=VECTOR, b=VECTOR)
def meet_dual_spheres_kind(a, b):
    """Classify the intersection of two dual spheres or dual planes, a circle or line.

    1: they meet; 0: they touch; -1: they do not meet; 2: concentric spheres or parallel planes; 3: the same object,
    with any weights.
    """
    sizes, others = _sizes_of_vector(a), _sizes_of_vector(b)
    both = _sizes_of_meet(sizes, others)
    (v, w), (x, y) = (space.coordinates(a), space.coordinates(b)), (a["e0"], b["e0"])
    one, three = x * w - y * v, a["einf"] * w - b["einf"] * v
    across, gap = _cross(v, w), x * b["einf"] - y * a["einf"]
    same = _both(vanishes(gap * gap, both[1]), vanishes(dot(three, three), both[2]))
    level = ga.select(vanishes(dot(across, across), both[1]), ga.select(same, 3, 2), 1)
    sign = _sign_of_pencil(dot(a, a), dot(b, b), dot(a, b), (sizes[1], others[1], both[1]))
    return ga.select(vanishes(dot(one, one), both[0]), level, sign)


@kernel(circle=CIRCLE, s=VECTOR)
def meet_circle_dual_sphere_kind(circle, s):
    """Classify the intersection of a circle or line with a dual sphere or dual plane, a point pair.

    1: they meet; 0: they touch; -1: they do not meet; 2: parallel, or the sphere cuts the plane of the circle in a
    concentric circle; 3: the circle lies on the sphere or plane.
    """
    sizes = _sizes_of_meet(_sizes_of_circle(circle), _sizes_of_vector(s))
    pair = ga.left_contraction(s, circle)
    weight, inner = _sum_of_squares(pair, "e10 e20 e30"), _sum_of_squares(pair, "e12 e13 e23 e0inf")
    outer = _sum_of_squares(pair, "e1inf e2inf e3inf")
    inside = _both(vanishes(inner, sizes[1]), vanishes(outer, sizes[2]))
    level = ga.select(vanishes(pair["e0inf"] ** 2, sizes[1]), ga.select(inside, 3, 2), 1)
    sign = _sign_of_square(dot(pair, pair), (weight, inner, outer), sizes)
    return ga.select(vanishes(weight, sizes[0]), level, sign)


@kernel(a=CIRCLE, b=CIRCLE)
def meet_circles_kind(a, b):
    """Classify the intersection of two circles or lines.

    1: two points, for lines one point and infinity; 0: one point; -1: no point; 2: parallel lines, or concentric
    circles in one plane; 3: the same object, with either orientation.
    """
    sizes, others = _sizes_of_circle(a), _sizes_of_circle(b)
    both = _sizes_of_meet(sizes, others)
    joint = ga.polarity(a) ^ ga.polarity(b)
    parts = joint["e1230"] ** 2, _sum_of_squares(joint, "e120inf e130inf e230inf"), joint["e123inf"] ** 2
    finite = ga.select(vanishes(parts[0], both[0]), 0, 1)
    spherical = _both(_both(1 - finite, vanishes(parts[1], both[1])), vanishes(parts[2], both[2]))
    null = ga.equal(_sign_of_square(dot(joint, joint), parts, both), 0)
    single = ga.select(_both(finite, null), 0, -1)
    lines = [vanishes(size[0], size[1]) for size in (sizes, others)]
    first, second = (
        sum(a[n] * b[n] for n in names.split()) / _sum_of_squares(b, names) for names in CIRCLE_DEGREES[:2]
    )
    scale = ga.select(lines[1], second, first)
    differences = [sum((a[n] - scale * b[n]) ** 2 for n in names.split()) for names in CIRCLE_DEGREES]
    zero = [
        vanishes(difference, size + scale * scale * other)
        for difference, size, other in zip(differences, sizes, others, strict=True)
    ]
    sign = _sign_of_pencil(dot(a, a), dot(b, b), dot(a, b), (sizes[1], others[1], both[1]))
    crossing = ga.select(_both(*lines), 1, sign)
    parallel = ga.select(zero[2], 3, 2)
    common = ga.select(_both(zero[0], zero[1]), parallel, crossing)
    return ga.select(spherical, common, single)


@kernel(circle=CIRCLE, angle=SCALAR, returns=POINT)
def point_on_circle(circle, angle):
    """Compute the point of a real circle at an angle about its normal.

    The angle is measured from the ray that is orthogonal to the normal and to the coordinate axis farthest from it.
    """
    centre, radius, u, v, _ = _circle_frame(circle)
    return space.at(centre + radius * (ga.cos(angle) * u + ga.sin(angle) * v))


@kernel(a=CIRCLE, b=CIRCLE, returns=(SCALAR, array(SCALAR, 3, 3)))
def circle_relative_to_circle(a, b):
    """Compute the radius of `b`, and a matrix that maps the angle of a point on `a` to coordinates in the frame of `b`.

    The 3 x 3 matrix acts on ``(1, cos angle, sin angle)`` of `point_on_circle` for `a`. The coordinates are taken from
    the centre of `b`: two in its plane, the first along its own angle 0, and the height.
    """
    p, r, u, v, _ = _circle_frame(a)
    q, s, *axes = _circle_frame(b)
    parts = p - q, r * u, r * v
    return s, tuple(tuple(dot(axis, part) for part in parts) for axis in axes)


@kernel(curve=array(SCALAR, 3, 3), radius=SCALAR, angle=SCALAR, returns=(SCALAR, SCALAR, SCALAR))
def distance_to_circle(curve, radius, angle):
    """Compute half the squared distance from a point of one circle to another, with first and second derivative.

    It is ``(h**2 + (l - r)**2) / 2``, where h is the height above the plane of the other circle and l the distance from
    its axis. `curve` and `radius` are returned by `circle_relative_to_circle`; the derivatives are with respect to the
    angle of the point.
    """
    sine, cosine = ga.sin(angle), ga.cos(angle)
    # The point from the centre of its circle is the negative of the second derivative.
    px, py, ph = (row[1] * cosine + row[2] * sine for row in curve)
    dx, dy, dh = (row[2] * cosine - row[1] * sine for row in curve)
    x, y, h = curve[0][0] + px, curve[1][0] + py, curve[2][0] + ph
    length = ga.sqrt(x * x + y * y)
    reciprocal = 1 / ga.select(length > 0, length, 1)
    dl = (x * dx + y * dy) * reciprocal
    ddl = (dx * dx + dy * dy - x * px - y * py - dl * dl) * reciprocal
    gap = length - radius
    return (h * h + gap * gap) / 2, h * dh + gap * dl, dh * dh - h * ph + dl * dl + gap * ddl


class _Nearest(NamedTuple):
    """A step of Newton's method for the least distance to a circle."""

    angle: Any
    value: Any
    slope: Any
    bend: Any
    span: Any
    done: Any


@kernel(
    curve=array(SCALAR, 3, 3), radius=SCALAR, angles=array(SCALAR, "n"), span=SCALAR,
    returns=(array(SCALAR, "n"), array(SCALAR, "n")),
)  # fmt: skip
def least_distances_to_circle(curve, radius, angles, span):
    """Compute the angles of least distances near given angles, and half the squared distances, by Newton's method.

    Steps have at most the length `span`, and are shortened if they do not reduce the distance. Quadratic convergence
    takes about five steps, circles that touch along a curve take more; the maximum is 40. `curve` must be scaled to
    size 1.
    """
    rounding = Fraction(1, 10**16)

    def step(now):
        straight = -now.slope / ga.select(ga.equal(now.bend, 0), 1, ga.absolute(now.bend))
        by = ga.select(straight < -now.span, -now.span, ga.select(straight > now.span, now.span, straight))
        value, slope, bend = distance_to_circle.function(curve, radius, now.angle + by)
        is_flatter = (value <= now.value + rounding) * (ga.absolute(slope) < ga.absolute(now.slope))
        better = ga.maximum(value < now.value - rounding, is_flatter)
        moving = ga.absolute(by) > rounding
        taken = better * moving
        return _Nearest(
            ga.select(taken, now.angle + by, now.angle),
            ga.select(taken, value, now.value),
            ga.select(taken, slope, now.slope),
            ga.select(taken, bend, now.bend),
            ga.select(better, now.span, now.span / 8),
            1 - moving,
        )

    def refined(angle):
        value, slope, bend = distance_to_circle.function(curve, radius, angle)
        start = _Nearest(angle, value, slope, bend, span, 0)
        found, _, _ = iterate(step, start, lambda _, new: new.done > 0, 40)
        return found.angle, found.value

    return each(refined, angles)


@kernel(p=POINT, d=COORDINATES, sphere=SPHERE)
def hit_ray_sphere(p, d, sphere):
    """Compute the least nonnegative `t` for which ``p + t d`` is on a sphere, from either side; NaN if there is none.

    No digits are lost for a small sphere that is far away.
    """
    return hit_ray(space.coordinates(p), space.vector(d), *space.sphere_parts(sphere))


# Versors.

motor_product = MOTORS.motor_product
motor_inverse = MOTORS.motor_inverse


@kernel(axis=COORDINATES, angle=SCALAR, returns=ROTOR)
def rotor_from_axis_angle(axis, angle):
    """Construct the right-handed rotation about an axis through the origin of any nonzero length."""
    axis = space.vector(axis)
    return ga.cos(angle / 2) - ga.sin(angle / 2) / ga.norm(axis) * axis * E1 * E2 * E3


translator_from_vector = VERSORS.translator_from_vector
dilator_from_scale = VERSORS.dilator_from_scale
motor_from_rotor_translation = VERSORS.motor_from_rotor_translation


@kernel(line=LINE, angle=SCALAR, returns=MOTOR)
def motor_from_line(line, angle):
    """Construct the right-handed rotation about a line, whose square may be any nonzero number."""
    return ga.cos(angle / 2) + ga.sin(angle / 2) / ga.sqrt(ga.scalar_product(line, line)) * ga.polarity(line)


motor_exponential = MOTORS.motor_exponential.documented(
    "Compute ``exp(b)`` of the bivector of a rigid motion: rotation, translation or screw. Smooth everywhere."
)
motor_logarithm = MOTORS.motor_logarithm
motor_square_root = MOTORS.motor_square_root
motor_power = MOTORS.motor_power
interpolate_motors = MOTORS.interpolate_motors
versor_exponential = VERSORS.versor_exponential
versor_logarithm = VERSORS.versor_logarithm.documented(
    """Compute the bivector of least angles with exponential `v` or `-v`, the same conformal map.

    Every unit versor has such a logarithm. At half turns, where the scalar part is 0, the two signs are equally near
    and the result is discontinuous. Half turns in two planes at once (`v` is a 4-vector) have many logarithms, and the
    result is NaN.
    """
)
versor_square_root = VERSORS.versor_square_root
motor_to_matrix = VERSORS.motor_to_matrix.documented(
    "Compute the homogeneous 4 x 4 matrix of a unit motor, which acts on columns (x, y, z, 1)."
)
move_point = MOTORS.move_point
rotate_point = CONFORMAL_MAPS.rotate_point
translate_point = CONFORMAL_MAPS.translate_point
dilate_point = CONFORMAL_MAPS.dilate_point
move_vector = CONFORMAL_MAPS.move_vector
move_point_pair = CONFORMAL_MAPS.move_point_pair
move_line = CONFORMAL_MAPS.move_line
move_circle = CONFORMAL_MAPS.move_circle


@kernel(m=MOTOR, x=PLANE)
def move_plane(m, x):
    """Move a plane by the unit motor `m`: ``m x ~m``."""
    return m * x * ~m


@kernel(m=MOTOR, x=SPHERE)
def move_sphere(m, x):
    """Move a sphere by the unit motor `m`: ``m x ~m``."""
    return m * x * ~m


transform_vector = CONFORMAL_MAPS.transform_vector


@kernel(p=POINT, plane=DUAL_PLANE, returns=POINT)
def reflect_point(p, plane):
    """Reflect a point in a dual plane, whose normal may have any nonzero length."""
    return space.normalized(-(plane * p * plane))


invert_point = CONFORMAL_MAPS.invert_point


# Versors of all conformal maps.

transversor_from_vector = VERSORS.transversor_from_vector
dilator_to_scale = VERSORS.dilator_to_scale
motor_to_rotor_translation = VERSORS.motor_to_rotor_translation
normalize_versor = VERSORS.normalize_versor
versor_from_motor = VERSORS.versor_from_motor
versor_from_dilator = VERSORS.versor_from_dilator
versor_from_transversor = VERSORS.versor_from_transversor
translator_between_points = VERSORS.translator_between_points
versor_decomposition = VERSORS.versor_decomposition


# Versors between two objects of one kind: the square root of their ratio. Nearly opposite objects are reversed first.


def _half_turn(point, direction):
    """Return the half turn about the line through a point along a unit direction."""
    return ga.polarity(_line_through(point, direction))


@kernel(a=LINE, b=LINE, returns=MOTOR)
def motor_between_lines(a, b):
    """Compute the motor that takes the line `a` to the line `b`, including its direction; it exists for every pair.

    It rotates about the common perpendicular and translates along it. Nearly opposite lines are reversed first.
    """
    d, p = _line_parts(a)
    return versor_between(unit_blade(a), unit_blade(b), _half_turn(p, _perpendicular(d)))


@kernel(a=PLANE, b=PLANE, returns=MOTOR)
def motor_between_planes(a, b):
    """Compute the motor that takes the plane `a` to the plane `b`, including its normal; it exists for every pair.

    It rotates about the line in which they meet, or translates along the common normal of parallel planes. Nearly
    opposite planes are reversed first.
    """
    n, distance = _plane_parts(a)
    return versor_between(unit_blade(a), unit_blade(b), _half_turn(distance * n, _perpendicular(n)))


@kernel(a=SPHERE, b=SPHERE, returns=UNIT_EVEN)
def versor_between_spheres(a, b):
    """Compute the versor that takes the sphere `a` to `b`, including the signs of the weights.

    Both must be real, or both imaginary with weights of the same sign; otherwise the result is NaN. If real spheres are
    separate and have weights of the same sign, `a` is first turned inside out by an inversion and a reflection.
    """
    one, two = unit_blade(a), unit_blade(b)
    centre, _ = space.sphere_parts(a)
    mirror = E1 + dot(centre, E1) * EINF
    wrong = ga.minimum(_sphere_sign(a), _sphere_sign(b)) <= 0
    other = ga.maximum(ga.maximum(_sphere_sign(a), _sphere_sign(b)) >= 0, ga.scalar_product(a, b) < 0)
    wrong = ga.minimum(wrong, other)
    turn = (ga.polarity(one) * mirror).grade(0, 2)
    return undefined_where(wrong, versor_between(one, two, turn))


@kernel(a=CIRCLE, b=CIRCLE, returns=UNIT_EVEN)
def versor_between_circles(a, b):
    """Compute the versor that takes the circle `a` to the circle or line `b`, including its orientation.

    It is the square root of the ratio ``b a**-1``, which rotates or scales the least. Point pairs have the same versor
    as their polarities. The result is NaN if `a` is a line, if one circle is real and the other imaginary, and for
    circles linked so that ``b a**-1`` is a 4-vector, such as a circle and its axis.
    """
    centre, normal, _ = _circle_parts(a)
    wrong = ga.scalar_product(a, a) * ga.scalar_product(b, b) <= 0
    return undefined_where(
        wrong, versor_between(unit_blade(a), unit_blade(b), _half_turn(centre, _perpendicular(normal)))
    )


@kernel(a=POINT, b=POINT, n=COORDINATES, m=COORDINATES, scale=SCALAR, returns=UNIT_EVEN)
def similarity_between_rounds(a, b, n, m, scale):
    """Compute the versor that rotates, scales and translates a round into another one of the same kind.

    It takes the centre `a` to the centre `b`, the unit direction or normal `n` to `m` (use equal directions for
    spheres), and scales by the positive ratio `scale` of the radii. The rotation is the smaller one; if the cosine
    between `n` and `m` is below -0.9, it is the rotation from ``-n`` to `m` after a half turn about a line orthogonal
    to `n`.
    """
    n, m = space.vector(n), space.vector(m)
    rotor = versor_between(n, m, _perpendicular(n) * SPACE)
    back = 1 + space.coordinates(a) * EINF / 2
    return space.translator(space.coordinates(b)) * rotor * space.dilator(scale) * back


# Action of versors on every kind of object.

transform_point = CONFORMAL_MAPS.transform_point
transform_point_pair = CONFORMAL_MAPS.transform_point_pair.documented(
    "Transform a point pair, dual circle or dual line by a unit even versor: ``v x ~v``."
)
transform_circle = CONFORMAL_MAPS.transform_circle


@kernel(v=UNIT_EVEN, x=SPHERE)
def transform_sphere(v, x):
    """Transform a sphere by a unit even versor: ``v x ~v``."""
    return v * x * ~v
