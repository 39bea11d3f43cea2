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

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import CGA2

POINT, VECTOR, DUAL_LINE, FLAT_POINT = CGA2.POINT, CGA2.VECTOR, CGA2.DUAL_LINE, CGA2.FLAT_POINT
POINT_PAIR, LINE, CIRCLE = CGA2.POINT_PAIR, CGA2.LINE, CGA2.CIRCLE
ROTOR, TRANSLATOR, MOTOR = CGA2.ROTOR, CGA2.TRANSLATOR, CGA2.MOTOR
DILATOR, TRANSVERSOR, EVEN, UNIT_EVEN, FULL = CGA2.DILATOR, CGA2.TRANSVERSOR, CGA2.even, CGA2.UNIT_EVEN, CGA2.full
COORDINATES = array(SCALAR, 2)
GENERATOR = CGA2.layout("GENERATOR", "e12 e1inf e2inf")

E1, E2, E0, EINF = CGA2.basis()
PSEUDOSCALAR = CGA2.pseudoscalar
AXES = ("e1", "e2")
NEARLY_ZERO = Fraction(1, 10**12)
NEARLY_OPPOSITE = Fraction(-9, 10)


def _vector(x):
    return x[0] * E1 + x[1] * E2


def _point(x, y):
    return x * E1 + y * E2 + E0 + (x * x + y * y) / 2 * EINF


def _coordinates(x):
    """The Euclidean part of a vector or point."""
    return x["e1"] * E1 + x["e2"] * E2


def _tuple(x):
    return x["e1"], x["e2"]


def _cross(a, b):
    return (a ^ b)["e12"]


def _left(a):
    """A vector turned by a right angle, counterclockwise."""
    return a["e1"] * E2 - a["e2"] * E1


def _weight(x):
    """What is 1 for a normalised vector: the coefficient of e0."""
    return -ga.scalar_product(EINF, x)


def _normalized(x):
    """The point with weight 1 of a null vector."""
    weight = _weight(x)
    return _point(*(x[name] / weight for name in AXES))


def _centre(x):
    """Centre of a round: the point at infinity reflected in it."""
    return _normalized((x * EINF * x).grade(1))


def _radius_squared(x):
    """Squared radius of a round, negative for an imaginary one."""
    carrier = ga.left_contraction(EINF, x)
    return ga.scalar_product(x, ga.grade_involution(x)) / ga.scalar_product(carrier, carrier)


def _dot(a, b):
    return ga.scalar_product(a, b)


def _length(a):
    return ga.sqrt(_dot(a, a))


def _at(x):
    """The point at a Euclidean vector."""
    return _point(*_tuple(x))


def _unless(wrong, x):
    """`x`, not a number where `wrong`."""
    return x * ga.sqrt(ga.select(wrong, -1, 1))


def _sign(value, size):
    """1, 0 or -1; 0 up to a tolerance relative to `size`, not a number where `value` is none."""
    tolerance = NEARLY_ZERO * size
    small = ga.select(ga.absolute(value) <= tolerance, 0, ga.sqrt(ga.select(value < 0, -1, value)))
    return ga.select(value > tolerance, 1, ga.select(value < -tolerance, -1, small))


def _kind_of_round(weight_squared, moved_squared, square):
    """`square` is the weight's square times that of the radius, `moved_squared` times that of the centre."""
    flat = weight_squared <= NEARLY_ZERO**2 * moved_squared
    return ga.select(flat, 2, _sign(square, moved_squared))


def _pair(centre, direction, radius_squared):
    """From ``centre - radius direction`` to ``centre + radius direction``."""
    return (_at(centre) + radius_squared / 2 * EINF) ^ (direction + _dot(centre, direction) * EINF)


def _line(direction, moment):
    return moment * E1 * E2 * EINF + (E0 ^ direction ^ EINF)


def _line_direction(line):
    return -line["e10inf"] * E1 - line["e20inf"] * E2


def _line_parts(line):
    """Unit direction, unit normal to the left, distance from the origin along the normal."""
    direction = _line_direction(line)
    length = _length(direction)
    return direction / length, _left(direction) / length, -line["e12inf"] / length


def _circle_parts(circle):
    return _coordinates(_normalized(ga.polarity(circle))), _radius_squared(circle)


def _pair_direction(pair):
    return -pair["e10"] * E1 - pair["e20"] * E2


def _pair_ends(pair):
    centre, half = _coordinates(_centre(pair)), ga.sqrt(_radius_squared(pair))
    direction = ga.normalize(_pair_direction(pair))
    return centre - half * direction, centre + half * direction


def _moved_squared(circle):
    return circle["e10inf"] ** 2 + circle["e20inf"] ** 2


def _square_root_inverse(s):
    """``s**(-1/2)`` of a scalar and a 4-vector: of what a versor's sum with 1 is off from a unit one."""
    scalar, four = s.grade(0), s.grade(4)
    number = scalar["1"]
    root = ga.sqrt(number * number - ga.scalar_product(four, four))
    return (number + root - four) / (root * ga.sqrt(2 * (number + root)))


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


def _unit_blade(x):
    return x / ga.sqrt(ga.absolute(ga.scalar_product(x, x)))


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
    """The right complement of any element, which needs no metric: ``b ^ dual(b) = e012inf`` for basis blades."""
    return ga.dual(a)


@kernel(a=FULL)
def undual(a):
    """The inverse of `dual`."""
    return ga.undual(a)


@kernel(a=FULL)
def polarity(a):
    """The metric dual ``a e012inf**-1``."""
    return ga.polarity(a)


# Points and flat points.


@kernel(x=COORDINATES, returns=VECTOR)
def embed_point(x):
    """The point at two coordinates, all four coefficients: ``x + e0 + x**2/2 einf``."""
    return _point(*x)


@kernel(x=VECTOR, returns=POINT)
def extract_point(x):
    """The coordinates of a point of any weight but 0; of a dual circle, its centre."""
    return _normalized(x)


@kernel(x=VECTOR, returns=VECTOR)
def normalize_vector(x):
    """The vector divided by its coefficient of e0, so that a point or dual circle has weight 1."""
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
    """The inner product of two vectors: for normalised dual circles ``(r**2 + s**2 - distance**2) / 2``."""
    return ga.scalar_product(a, b)


@kernel(p=POINT, returns=FLAT_POINT)
def flat_point_from_point(p):
    """The flat point ``p ^ einf``: a point together with infinity."""
    return p ^ EINF


@kernel(flat=FLAT_POINT, returns=POINT)
def point_from_flat_point(flat):
    """The point of a flat point of any weight but 0."""
    return _point(*(flat[name] / flat["e0inf"] for name in ("e1inf", "e2inf")))


# Flats and rounds, in direct and dual form; a negative squared radius is that of an imaginary round.


@kernel(a=POINT, b=POINT, returns=LINE)
def line_from_points(a, b):
    """The line ``a ^ b ^ einf`` from `a` to `b`; its square is minus their squared distance."""
    return a ^ b ^ EINF


@kernel(p=POINT, d=COORDINATES, returns=LINE)
def line_from_point_direction(p, d):
    """The line through the point `p` along the direction `d`."""
    return p ^ _vector(d) ^ EINF


@kernel(normal=COORDINATES, distance=SCALAR, returns=LINE)
def line_from_normal(normal, distance):
    """The line of all x with ``normal . x = distance``, with that normal on its left."""
    return _line(-_left(_vector(normal)), -distance)


@kernel(p=POINT, normal=COORDINATES, returns=LINE)
def line_from_point_normal(p, normal):
    """The line through `p` orthogonal to a vector, which is to its left."""
    return _line(-_left(_vector(normal)), -_dot(p, _vector(normal)))


@kernel(a=POINT, b=POINT, returns=DUAL_LINE)
def bisector_line(a, b):
    """The dual line of all points as far from `a` as from `b`: the difference ``b - a``, its normal towards `b`."""
    return b - a


@kernel(normal=COORDINATES, distance=SCALAR, returns=DUAL_LINE)
def dual_line_from_normal(normal, distance):
    """The dual line ``normal + distance einf``: all x with ``normal . x = distance``."""
    return _vector(normal) + distance * EINF


@kernel(line=LINE, returns=DUAL_LINE)
def line_polarity(line):
    """The dual line of a line, with the normal to its left."""
    return ga.polarity(line)


@kernel(dual=DUAL_LINE, returns=LINE)
def line_from_dual(dual):
    """The line whose polarity is given."""
    return dual * PSEUDOSCALAR


@kernel(line=LINE, returns=CIRCLE)
def circle_from_line(line):
    """A line as the circle that it is, all four coefficients, for what is written for circles."""
    return line


@kernel(a=POINT, b=POINT)
def point_pair_from_points(a, b):
    """The point pair ``a ^ b``."""
    return a ^ b


@kernel(centre=POINT, direction=COORDINATES, radius_squared=SCALAR, returns=POINT_PAIR)
def point_pair_from_centre(centre, direction, radius_squared):
    """The pair of points at one distance from a centre, before and behind it along a direction of any length but 0."""
    return _pair(_coordinates(centre), _vector(direction), radius_squared)


@kernel(a=POINT, b=POINT, c=POINT)
def circle_from_points(a, b, c):
    """The circle ``a ^ b ^ c`` through three points; a line where they are on one."""
    return a ^ b ^ c


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


@kernel(circle=CIRCLE, returns=VECTOR)
def circle_polarity(circle):
    """The dual circle of a circle, with a weight."""
    return ga.polarity(circle)


@kernel(dual=VECTOR, returns=CIRCLE)
def circle_from_dual(dual):
    """The circle whose polarity is given."""
    return dual * PSEUDOSCALAR


@kernel(circle=CIRCLE, p=POINT, returns=LINE)
def tangent_line_of_circle(circle, p):
    """The line that touches a circle in a point of it."""
    return ga.left_contraction(p, circle) ^ EINF


# What objects are made of.


@kernel(line=LINE, returns=COORDINATES)
def line_direction(line):
    """The direction of a line, of the length that its coefficients have; the normal is to the left of it."""
    return _tuple(_line_direction(line))


@kernel(line=LINE, returns=(COORDINATES, SCALAR))
def line_to_normal(line):
    """The unit normal of a line, on its left, and its distance from the origin along it: ``normal . x = distance``."""
    _, normal, distance = _line_parts(line)
    return _tuple(normal), distance


@kernel(line=LINE, returns=POINT)
def line_support(line):
    """The point of a line that is nearest to the origin."""
    _, normal, distance = _line_parts(line)
    return _at(distance * normal)


@kernel(circle=CIRCLE, returns=POINT)
def circle_centre(circle):
    """The centre of a circle. A line has none: division by 0."""
    return _normalized(ga.polarity(circle))


@kernel(circle=CIRCLE)
def circle_radius_squared(circle):
    """The squared radius of a circle, negative for an imaginary one. A line has none: division by 0."""
    return _radius_squared(circle)


@kernel(s=VECTOR)
def dual_circle_radius_squared(s):
    """The squared radius of a dual circle of any weight but 0, negative for an imaginary one."""
    return _dot(s, s) / _weight(s) ** 2


@kernel(circle=CIRCLE)
def circle_weight(circle):
    """The weight of a circle, whose sign is its orientation: twice the signed area for three points."""
    return _weight(ga.polarity(circle))


@kernel(circle=CIRCLE)
def circle_kind(circle):
    """1 for a real circle, 0 for a point, -1 for an imaginary circle, 2 for a line."""
    return _kind_of_round(circle["e120"] ** 2, _moved_squared(circle), _dot(circle, circle))


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
    a, b = _pair_ends(pair)
    return _at(a), _at(b)


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
def point_pair_surround_circle(pair):
    """The dual circle of weight 1 of which a point pair is a diameter."""
    return _centre(pair) - _radius_squared(pair) / 2 * EINF


@kernel(pair=POINT_PAIR)
def point_pair_kind(pair):
    """1 for two points, 0 for a double one (a tangent vector), -1 for an imaginary pair, 2 for a flat point."""
    direction = _pair_direction(pair)
    return _kind_of_round(_dot(direction, direction), pair["e12"] ** 2 + pair["e0inf"] ** 2, _dot(pair, pair))


# Distances, in the units of the coordinates, and angles in [0, pi].


@kernel(p=POINT, line=LINE)
def signed_distance_point_line(p, line):
    """The distance of a point to a line, positive on its left."""
    _, normal, distance = _line_parts(line)
    return _dot(p, normal) - distance


@kernel(p=POINT, circle=CIRCLE)
def signed_distance_point_circle(p, circle):
    """The distance of a point to a circle, negative inside; not a number for an imaginary one."""
    centre, square = _circle_parts(circle)
    return _length(_coordinates(p) - centre) - ga.sqrt(square)


@kernel(p=POINT, s=VECTOR)
def power_of_point(p, s):
    """Squared distance of a point to the centre of a dual circle, minus the squared radius; negative inside."""
    return -2 * _dot(p, s) / _weight(s)


@kernel(a=LINE, b=LINE)
def signed_distance_lines(a, b):
    """How far the line `b` is from the line `a`, parallel to it, along the normal of `a`; 0 for others."""
    (d, _, p), (e, _, q) = _line_parts(a), _line_parts(b)
    return ga.select(ga.absolute(_cross(d, e)) <= NEARLY_ZERO, ga.select(_dot(d, e) < 0, -q, q) - p, 0)


@kernel(line=LINE, circle=CIRCLE)
def distance_line_circle(line, circle):
    """The distance of a line to a circle: 0 where they meet."""
    (_, normal, distance), (centre, square) = _line_parts(line), _circle_parts(circle)
    return ga.maximum(0, ga.absolute(_dot(centre, normal) - distance) - ga.sqrt(square))


@kernel(a=CIRCLE, b=CIRCLE)
def distance_circles(a, b):
    """The distance of two circles: 0 where they meet; one may be inside the other."""
    (p, r), (q, s) = _circle_parts(a), _circle_parts(b)
    distance, r, s = _length(q - p), ga.sqrt(r), ga.sqrt(s)
    return ga.maximum(0, ga.maximum(distance - r - s, ga.absolute(r - s) - distance))


@kernel(line=LINE, other=LINE)
def angle_between_lines(line, other):
    """The angle from the direction of `line` to that of `other`, counterclockwise, in (-pi, pi]."""
    d, e = _line_direction(line), _line_direction(other)
    return ga.atan2(_cross(d, e), _dot(d, e))


@kernel(a=VECTOR, b=VECTOR)
def inversive_distance(a, b):
    """The inversive distance ``-a . b / (|a| |b|)`` of two dual circles or dual lines, which conformal maps keep.

    Of circles with centres at the distance d, ``(d**2 - r**2 - s**2) / (2 r s)``: 1 where they touch from outside, -1
    from inside. The sign of a weight counts.
    """
    return -_dot(a, b) / ga.sqrt(_dot(a, a) * _dot(b, b))


@kernel(a=POINT_PAIR, b=POINT_PAIR)
def inner_product_of_point_pairs(a, b):
    """The inner product of two point pairs. By those of `a` and of `b` with themselves, ``a . b / (|a| |b|)``
    is ``(1 + x) / (1 - x)``, up to its sign, by the cross-ratio x of four points on a circle."""
    return _dot(a, b)


@kernel(a=VECTOR, b=VECTOR)
def angle_between_dual_circles(a, b):
    """The angle of the radii of two dual circles, or of normals, where they meet; not a number where they do not."""
    return ga.acos(_dot(a, b) / ga.sqrt(_dot(a, a) * _dot(b, b)))


# Projections and reflections.


@kernel(p=POINT, line=LINE, returns=POINT)
def project_point_on_line(p, line):
    """The foot of a point on a line."""
    _, normal, distance = _line_parts(line)
    return _at(_coordinates(p) - (_dot(p, normal) - distance) * normal)


@kernel(p=POINT, circle=CIRCLE, returns=POINT)
def project_point_on_circle(p, circle):
    """The nearest point of a circle. For the centre, all are as near: not a number."""
    centre, square = _circle_parts(circle)
    away = _coordinates(p) - centre
    return _at(centre + ga.sqrt(square) / _length(away) * away)


@kernel(p=POINT, line=DUAL_LINE, returns=POINT)
def reflect_point(p, line):
    """The mirror image of a point in a dual line, whose normal may have any length but 0."""
    return _normalized(-(line * p * line))


# Meets.


@kernel(a=LINE, b=LINE, returns=POINT)
def meet_lines(a, b):
    """The point in which two lines meet; division by 0 where they are parallel."""
    flat = a & b
    return _point(*(flat[name] / flat["e0inf"] for name in ("e1inf", "e2inf")))


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


def _vanishes(square, size):
    return square <= NEARLY_ZERO**2 * size


@kernel(a=VECTOR, b=VECTOR)
def meet_dual_circles_kind(a, b):
    """How two dual circles or dual lines meet, in a pair of points or a point. 1: they do; 0: they touch; -1: they do
    not; 2: concentric circles or parallel lines; 3: the same, of any weights."""
    sizes, others = _sizes_of_vector(a), _sizes_of_vector(b)
    first = sizes[0] * others[1] + sizes[1] * others[0]
    middle = sizes[1] * others[1] + sizes[0] * others[2] + sizes[2] * others[0]
    last = sizes[1] * others[2] + sizes[2] * others[1]
    (v, w), (x, y) = (_coordinates(a), _coordinates(b)), (a["e0"], b["e0"])
    one, three = x * w - y * v, a["einf"] * w - b["einf"] * v
    across, gap = _cross(v, w), x * b["einf"] - y * a["einf"]
    same = ga.minimum(_vanishes(gap * gap, middle), _vanishes(_dot(three, three), last))
    level = ga.select(_vanishes(across * across, middle), ga.select(same, 3, 2), 1)
    squares, product, mixed = (_dot(a, a), _dot(b, b)), _dot(a, b), ga.sqrt(middle)
    size = sizes[1] * ga.absolute(squares[1]) + others[1] * ga.absolute(squares[0])
    size = size + mixed * (2 * ga.absolute(product) + NEARLY_ZERO * mixed)
    sign = _sign(squares[0] * squares[1] - product * product, size)
    return ga.select(_vanishes(_dot(one, one), first), level, sign)


@kernel(p=POINT, d=COORDINATES, circle=CIRCLE)
def hit_ray_circle(p, d, circle):
    """The least `t`, at least 0, for which ``p + t d`` is on a circle, from either side; not a number if there is none.

    No digits are lost for a small circle that is far away.
    """
    d, (centre, square) = _vector(d), _circle_parts(circle)
    towards, along = centre - _coordinates(p), _dot(d, d)
    middle = _dot(towards, d) / along
    beside = towards - middle * d
    half = ga.sqrt((square - _dot(beside, beside)) / along)
    near, far = middle - half, middle + half
    return _unless(far < 0, ga.select(near >= 0, near, far))


# Versors.


@kernel(angle=SCALAR, returns=ROTOR)
def rotor_from_angle(angle):
    """The rotation about the origin, counterclockwise."""
    return ga.cos(angle / 2) - ga.sin(angle / 2) * E1 * E2


@kernel(r=ROTOR)
def rotor_to_angle(r):
    """The angle of a rotor, in (-2 pi, 2 pi]; `r` and ``-r``, the same rotation, differ by a whole turn."""
    return 2 * ga.atan2(-r["e12"], r["1"])


@kernel(p=POINT, angle=SCALAR, returns=MOTOR)
def motor_from_point(p, angle):
    """The rotation about a point, counterclockwise."""
    return ga.cos(angle / 2) - ga.sin(angle / 2) * _turn_about(_coordinates(p))


def _turn_about(p):
    """Half a turn about a point, clockwise."""
    return E1 * E2 - (_left(p) ^ EINF)


@kernel(t=COORDINATES, returns=TRANSLATOR)
def translator_from_vector(t):
    """The translation by a vector: ``1 - t einf/2``."""
    return 1 - _vector(t) * EINF / 2


@kernel(scale=SCALAR, returns=DILATOR)
def dilator_from_scale(scale):
    """The dilation about the origin by a positive factor: ``exp(log(scale)/2 e0inf)``."""
    return (1 + scale + (scale - 1) * (E0 ^ EINF)) / (2 * ga.sqrt(scale))


@kernel(d=DILATOR)
def dilator_to_scale(d):
    """The factor of a dilator: ``exp`` of twice the coefficient of its logarithm."""
    return (d["1"] + d["e0inf"]) ** 2


@kernel(b=COORDINATES, returns=TRANSVERSOR)
def transversor_from_vector(b):
    """The transversion ``1 + b e0``: inversion in the unit circle, translation by ``-b``, inversion again.

    It takes x to ``(x - x**2 b) / (1 - 2 b . x + b**2 x**2)``.
    """
    return 1 + _vector(b) * E0


@kernel(r=ROTOR, t=COORDINATES, returns=MOTOR)
def motor_from_rotor_translation(r, t):
    """The motor that turns by the rotor `r` and then translates by the vector `t`."""
    return (1 - _vector(t) * EINF / 2) * r


@kernel(m=MOTOR, returns=(ROTOR, COORDINATES))
def motor_to_rotor_translation(m):
    """The rotor and the vector of the translation after it."""
    return m["1"] + m["e12"] * E1 * E2, _tuple(m * E0 * ~m)


@kernel(m=MOTOR, returns=array(SCALAR, 3, 3))
def motor_to_matrix(m):
    """The homogeneous 3 x 3 matrix of a unit motor, which acts on columns (x, y, 1)."""
    columns = [m * axis * ~m for axis in (E1, E2, E0)]
    return (*(tuple(column[name] for column in columns) for name in AXES), (0, 0, 1))


@kernel(a=MOTOR, b=MOTOR, returns=MOTOR)
def motor_product(a, b):
    """The motor that does `b` first and then `a`."""
    return a * b


@kernel(m=MOTOR, returns=MOTOR)
def motor_inverse(m):
    """The inverse of a unit motor, which is its reverse."""
    return ~m


@kernel(b=GENERATOR, returns=MOTOR)
def motor_exponential(b):
    """``exp(b)`` of the bivector of a rigid motion: a rotation about any point, or a translation. Smooth everywhere."""
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
    """The motion that starts as `a` at ``t = 0`` and is `b` (or `-b`) at ``t = 1``, at constant twist."""
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
    jumps.
    """
    return ga.log(v)


@kernel(v=UNIT_EVEN, returns=UNIT_EVEN)
def versor_square_root(v):
    """The unit versor half way to `v` or `-v`: ``exp(log(v) / 2)`` without angles, where that is defined."""
    return ga.sqrt(v)


@kernel(x=EVEN, returns=EVEN)
def normalize_versor(x):
    """The unit versor nearest to an even element: ``(x ~x)**(-1/2) x``. Sums of versors become versors."""
    return _square_root_inverse(x * ~x) * x


@kernel(m=MOTOR, returns=UNIT_EVEN)
def versor_from_motor(m):
    """A motor with all eight coefficients of a versor, for products with versors of other kinds."""
    return m


@kernel(d=DILATOR, returns=UNIT_EVEN)
def versor_from_dilator(d):
    """A dilator with all eight coefficients of a versor."""
    return d


@kernel(k=TRANSVERSOR, returns=UNIT_EVEN)
def versor_from_transversor(k):
    """A transversor with all eight coefficients of a versor."""
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
    rotor = {name: factor * rest[name] for name in ("1", "e12")}
    return scale, ga.assemble(CGA2, rotor), _tuple(t), _tuple(b)


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
    """A vector, such as a dual circle or dual line, moved by the unit motor `m`: ``m x ~m``."""
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


@kernel(v=UNIT_EVEN, x=VECTOR)
def transform_vector(v, x):
    """A vector transformed by any unit even versor, a conformal map: ``v x ~v``."""
    return v * x * ~v


@kernel(v=UNIT_EVEN, p=POINT, returns=POINT)
def transform_point(v, p):
    """A point transformed by any unit even versor, a conformal map. What goes to infinity: division by 0."""
    return _normalized(v * p * ~v)


@kernel(v=UNIT_EVEN, x=POINT_PAIR)
def transform_point_pair(v, x):
    """A point pair transformed by any unit even versor: ``v x ~v``."""
    return v * x * ~v


@kernel(v=UNIT_EVEN, x=CIRCLE)
def transform_circle(v, x):
    """A circle transformed by any unit even versor: ``v x ~v``."""
    return v * x * ~v


@kernel(x=VECTOR, s=VECTOR)
def invert_vector(x, s):
    """A vector, such as a dual circle or dual line, inverted in a dual circle or mirrored in a dual line."""
    return (2 * _dot(x, s) / _dot(s, s)) * s - x


@kernel(x=POINT_PAIR, s=VECTOR)
def invert_point_pair(x, s):
    """A point pair inverted in a dual circle or mirrored in a dual line: ``s x s**-1``."""
    return s * x * s / _dot(s, s)


@kernel(x=CIRCLE, s=VECTOR)
def invert_circle(x, s):
    """A circle inverted in a dual circle or mirrored in a dual line: ``-s x s**-1``; a line if through its centre."""
    return -(s * x * s) / _dot(s, s)


@kernel(p=POINT, s=VECTOR, returns=POINT)
def invert_point(p, s):
    """The inversion of a point in a dual circle: on the same ray from the centre, distances multiply to r**2.

    The centre goes to infinity: division by 0.
    """
    return _normalized(-(s * p * s))


# Versors between two objects of one kind: the square root of their ratio. Nearly opposite ones are turned over first.


@kernel(a=LINE, b=LINE, returns=MOTOR)
def motor_between_lines(a, b):
    """The motor that takes the line `a` to the line `b` along with its direction; it exists for every pair.

    It turns about their common point or translates across parallel ones; nearly opposite lines are turned over first.
    """
    _, normal, distance = _line_parts(a)
    return _between(_unit_blade(a), _unit_blade(b), _turn_about(distance * normal))


@kernel(a=CIRCLE, b=CIRCLE, returns=UNIT_EVEN)
def versor_between_circles(a, b):
    """The versor that takes the real circle `a` to the real circle `b` along with the signs of their weights.

    Of circles apart from each other, with weights of one sign, `a` is turned inside out by an inversion and
    a reflection first. Not a number for imaginary circles and for those of radius 0.
    """
    one, two = _unit_blade(a), _unit_blade(b)
    centre, _ = _circle_parts(a)
    mirror = E1 + _dot(centre, E1) * EINF
    signs = [_sign(_dot(circle, circle), _moved_squared(circle)) for circle in (a, b)]
    turn = (ga.polarity(one) * mirror).grade(0, 2)
    return _unless(ga.minimum(*signs) <= 0, _between(one, two, turn))


@kernel(a=POINT_PAIR, b=POINT_PAIR, returns=UNIT_EVEN)
def versor_between_point_pairs(a, b):
    """The versor that takes the point pair `a` to `b`, the first point to the first.

    The root of the ratio ``b a**-1``. Not a number where one is real and the other imaginary.
    """
    wrong = _dot(a, a) * _dot(b, b) <= 0
    return _unless(wrong, _between(_unit_blade(a), _unit_blade(b), _turn_about(_coordinates(_centre(a)))))


@kernel(a=POINT, b=POINT, n=COORDINATES, m=COORDINATES, scale=SCALAR, returns=UNIT_EVEN)
def similarity_between_rounds(a, b, n, m, scale):
    """The versor that turns, scales and translates a round into another of its kind, and nothing else.

    From the centre `a` to the centre `b`, by the rotation from the unit direction `n` of a point pair to `m` (the same
    of both for circles), and by the ratio `scale` of the radii, positive.
    """
    n, m = _vector(n), _vector(m)
    rotor = _between(n, m, E1 * E2)
    dilator = (1 + scale + (scale - 1) * (E0 ^ EINF)) / (2 * ga.sqrt(scale))
    return (1 - _coordinates(b) * EINF / 2) * rotor * dilator * (1 + _coordinates(a) * EINF / 2)
