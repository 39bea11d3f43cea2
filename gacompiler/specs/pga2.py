"""The Euclidean plane by plane-based geometric algebra G(2,0,1): points, lines and rigid motions.

Lines are vectors: ``a e1 + b e2 + c e0`` is the line ``a x + b y + c = 0``. Points are bivectors:
``x e20 + y e01 + e12``. Without the term ``e12`` that is a direction, which translations leave alone.

A motor ``m`` moves everything by the same product ``m x ~m``. ``exp(-angle/2 p)`` turns about the point ``p`` from x
towards y, and ``1 + (y e20 - x e01)/2`` translates by (x, y). ``m n`` does ``n`` first. ``m`` and ``-m`` are the same
motion. Angles are in radians; lengths are in the units of the coordinates.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import PGA2

POINT, DIRECTION, LINE, UNIT_LINE = PGA2.POINT, PGA2.DIRECTION, PGA2.LINE, PGA2.UNIT_LINE
MOTOR, ROTOR, TRANSLATOR, EVEN = PGA2.MOTOR, PGA2.ROTOR, PGA2.TRANSLATOR, PGA2.EVEN
BIVECTOR, FULL = PGA2.BIVECTOR, PGA2.full
VECTOR, MATRIX = array(SCALAR, 2), array(SCALAR, 3, 3)

ORIGIN = PGA2.multivector({"e12": 1})
AXES = tuple(PGA2.multivector({name: 1}) for name in ("e20", "e01"))
NEARLY_ZERO = Fraction(1, 10**18)


def _rotor(angle):
    return ga.assemble(PGA2, {"1": ga.cos(angle / 2), "e12": -ga.sin(angle / 2)})


def _translator(v):
    return ga.assemble(PGA2, {"1": 1, "e20": v[1] / 2, "e01": -v[0] / 2})


def _coordinates(point):
    return point["e20"], point["e01"]


# Products, involutions and duals of any two elements.


@kernel(a=FULL, b=FULL)
def geometric_product(a, b):
    """The geometric product ``a b`` of any two elements."""
    return a * b


@kernel(a=FULL, b=FULL)
def outer_product(a, b):
    """The outer product ``a ^ b`` of any two elements: the meet of lines."""
    return a ^ b


@kernel(a=FULL, b=FULL)
def regressive_product(a, b):
    """The regressive product ``a & b`` of any two elements: the join of points."""
    return a & b


@kernel(a=FULL, b=FULL)
def inner_product(a, b):
    """The inner product of any two elements: of grades p and q, the part of grade \\|p - q\\| of ``a b``."""
    return ga.inner_product(a, b)


@kernel(a=FULL)
def reverse(a):
    """The reverse ``~a`` of any element: the order of vectors in every product turned round."""
    return ~a


@kernel(a=FULL)
def grade_involution(a):
    """Any element with its odd part negated."""
    return ga.grade_involution(a)


@kernel(a=FULL)
def dual(a):
    """The right complement of any element, which needs no metric: ``b ^ dual(b) = e012`` for basis blades."""
    return ga.dual(a)


@kernel(a=FULL)
def undual(a):
    """The inverse of `dual`."""
    return ga.undual(a)


@kernel(a=FULL)
def norm(a):
    """The norm ``sqrt(<a ~a>)`` of any element, which does not see ``e0``; 0 for what lies at infinity."""
    return ga.norm(a)


# Points and lines.


@kernel(b=BIVECTOR, returns=POINT)
def point_from_bivector(b):
    """The point with weight 1 of a bivector. The weight, the coefficient of e12, must not be 0."""
    return b / b["e12"]


@kernel(line=LINE)
def normalize_line(line):
    """The line divided by the length of its normal, which must not be 0."""
    return ga.normalize(line)


@kernel(a=POINT, b=POINT)
def join_points(a, b):
    """The line from `a` to `b`, its normal a quarter turn to the left; its norm is their distance.

    It is 0 where the points are the same.
    """
    return a & b


@kernel(p=POINT, d=DIRECTION)
def join_point_direction(p, d):
    """The line through the point `p` along the direction `d`; its norm is the length of `d`."""
    return p & d


@kernel(line=LINE, other=LINE)
def meet_lines(line, other):
    """The point, with a weight, in which two lines meet. The weight is the sine of the angle from `line` to `other`.

    Parallel lines meet in a direction (weight 0); a line with itself gives 0.
    """
    return line ^ other


@kernel(p=POINT, line=LINE)
def line_orthogonal_to_line(p, line):
    """The line through the point `p` along the normal of the line; of the same norm."""
    return ga.inner_product(p, line)


@kernel(a=POINT, b=POINT)
def distance_squared_points(a, b):
    """The squared distance of two points."""
    return ga.norm_squared(a & b)


@kernel(a=POINT, b=POINT)
def distance_points(a, b):
    """The distance of two points."""
    return ga.norm(a & b)


@kernel(p=POINT, line=UNIT_LINE)
def signed_distance_point_line(p, line):
    """The distance of a point to a normalised line, positive on the side of the normal."""
    return p & line


@kernel(a=POINT, b=POINT, c=POINT)
def signed_area(a, b, c):
    """Twice the area of a triangle, positive where its corners are counter-clockwise."""
    return a & b & c


@kernel(line=LINE, other=LINE)
def angle_between_lines(line, other):
    """The angle from the normal of `line` to that of `other`, in (-pi, pi], positive from x towards y."""
    return ga.atan2((line ^ other)["e12"], ga.scalar_product(line, other))


@kernel(p=POINT, line=LINE)
def project_point_on_line(p, line):
    """The point of the line, of any norm but 0, that is nearest to the point `p`."""
    return ga.inner_product(p, line) * ga.inverse(line)


@kernel(p=POINT, line=UNIT_LINE)
def project_point_on_unit_line(p, line):
    """The point of the normalised line that is nearest to the point `p`."""
    return ga.inner_product(p, line) * line


@kernel(p=POINT, line=UNIT_LINE)
def reflect_point(p, line):
    """The mirror image of the point `p` in the normalised line."""
    return -(line * p * line)


# Motors.


@kernel(a=MOTOR, b=MOTOR, returns=MOTOR)
def motor_product(a, b):
    """The motor that does `b` first and then `a`."""
    return a * b


@kernel(a=EVEN, b=EVEN)
def even_product(a, b):
    """The geometric product of two even elements, which need not be motors."""
    return a * b


@kernel(m=MOTOR, returns=MOTOR)
def motor_inverse(m):
    """The inverse of a unit motor, which is its reverse."""
    return ~m


@kernel(x=EVEN, returns=MOTOR)
def normalize_motor(x):
    """The unit motor of an even element. The rotational part, of 1 and e12, must not be 0."""
    return ga.normalize(x)


@kernel(m=MOTOR, p=POINT)
def move_point(m, p):
    """The point `p` moved by the unit motor `m`: ``m p ~m``."""
    return m * p * ~m


@kernel(m=MOTOR, d=DIRECTION)
def move_direction(m, d):
    """The direction `d` turned by the unit motor `m`: ``m d ~m``. Translations leave directions alone."""
    return m * d * ~m


@kernel(m=MOTOR, line=LINE)
def move_line(m, line):
    """The line moved by the unit motor `m`: ``m line ~m``."""
    return m * line * ~m


@kernel(m=MOTOR, p=POINT)
def move_point_back(m, p):
    """The point `p` moved by the inverse of the unit motor `m`: ``~m p m``."""
    return ~m * p * m


@kernel(angle=SCALAR, returns=ROTOR)
def rotor_from_angle(angle):
    """The rotation about the origin by an angle in radians, from x towards y."""
    return _rotor(angle)


@kernel(v=VECTOR, returns=TRANSLATOR)
def translator_from_vector(v):
    """The translation by a vector."""
    return _translator(v)


@kernel(p=POINT, angle=SCALAR, returns=MOTOR)
def motor_from_point(p, angle):
    """The rotation about a point by an angle in radians, from x towards y: ``exp(-angle/2 p)``."""
    return ga.cos(angle / 2) - ga.sin(angle / 2) * p


@kernel(angle=SCALAR, v=VECTOR, returns=MOTOR)
def motor_from_angle_translation(angle, v):
    """The motor that turns about the origin by an angle and then translates by the vector `v`."""
    return _translator(v) * _rotor(angle)


@kernel(m=MOTOR, returns=(SCALAR, VECTOR))
def motor_to_angle_translation(m):
    """Angle in [-pi, pi] and translation of a unit motor: what `motor_from_angle_translation` puts together."""
    flipped = m["1"] < 0
    angle = 2 * ga.atan2(ga.select(flipped, m["e12"], -m["e12"]), ga.absolute(m["1"]))
    return angle, _coordinates(m * ORIGIN * ~m)


@kernel(m=MOTOR, returns=MATRIX)
def motor_to_matrix(m):
    """The homogeneous 3 x 3 matrix of a unit motor, which acts on columns (x, y, 1)."""
    columns = [_coordinates(m * axis * ~m) for axis in AXES] + [_coordinates(m * ORIGIN * ~m)]
    return (*zip(*columns, strict=True), (0, 0, 1))


@kernel(matrix=MATRIX, returns=MOTOR)
def motor_from_matrix(matrix):
    """The motor, with scalar part not negative, of a homogeneous 3 x 3 matrix of a rigid motion.

    The last row is not looked at. Where the rest is no rotation, the nearest rotation is taken.
    """
    cosine, sine = matrix[0][0] + matrix[1][1], matrix[1][0] - matrix[0][1]
    length = ga.sqrt(cosine * cosine + sine * sine)
    sharp, left = cosine >= 0, ga.select(sine < 0, -1, 1)
    w = ga.select(sharp, length + cosine, left * sine)
    z = ga.select(sharp, sine, left * (length - cosine))
    rotor = ga.assemble(PGA2, {"1": w, "e12": -z}) / ga.sqrt(w * w + z * z)
    return _translator([matrix[0][2], matrix[1][2]]) * rotor


@kernel(b=BIVECTOR, returns=MOTOR)
def motor_exponential(b):
    """``exp(b)`` of any bivector; ``exp(-angle/2 p)`` turns about the point p. Smooth at 0 and for translations."""
    return ga.exp(b)


@kernel(m=MOTOR)
def motor_logarithm(m):
    """The bivector of least angle whose exponential is `m` or `-m`, the same motion; also of pure translations."""
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
    return a * ga.power(~a * b, t)


@kernel(v=BIVECTOR, p=POINT)
def twist_on_point(v, p):
    """The velocity of the point `p` under the twist `v`: the derivative at 0 of ``m p ~m`` with ``m = exp(-t/2 v)``."""
    return ga.commutator(p, v)
