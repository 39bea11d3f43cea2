"""Conformal geometry of space in G(4,1) with the null basis ``e0, einf`` and ``einf . e0 = -1``.

The point at x is ``x + e0 + x**2/2 einf``; three coordinates are stored, the other two are known. Rounds and flats are
outer products of points: point pairs of 2, circles of 3, spheres of 4; lines are ``a ^ b ^ einf`` and planes
``a ^ b ^ c ^ einf``. A *dual* sphere is the vector ``c - r**2/2 einf`` of its centre c and radius r, a *dual* plane is
``n + d einf`` for the plane ``n . x = d``. `polarity`, multiplication by ``e0123inf**-1``, takes a sphere or plane to a
multiple of its dual.

Even versors move everything by ``v x ~v``: the rotor ``exp(-angle/2 B)``, the translator ``1 - t einf/2``, the dilator
``exp(log(scale)/2 e0inf)``. A motor has rotation and translation; its eight coefficients are, in order, those of the
same motor in G(3,0,1). Angles are in radians; lengths are in the units of the coordinates.
"""

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

E1, E2, E3, E0, EINF = CGA3.basis()


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
    return a * ga.power(~a * b, t)


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
