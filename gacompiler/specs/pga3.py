"""Euclidean space by plane-based geometric algebra G(3,0,1): points, lines, planes and rigid motions.

Planes are vectors: ``a e1 + b e2 + c e3 + d e0`` is the plane ``a x + b y + c z + d = 0``. Lines are bivectors: that
of direction ``d`` through ``p`` is ``d1 e23 - d2 e13 + d3 e12 + m1 e01 + m2 e02 + m3 e03``, where ``m = p x d`` is the
moment. Points are trivectors: ``x e032 + y e013 + z e021 + e123``. Without the term ``e123`` that is a direction,
which translations leave alone.

A motor ``m`` moves everything by the same product ``m x ~m``. The motor ``exp(-angle/2 line)`` turns by the right-hand
rule about the unit line ``line``, and ``1 - (x e01 + y e02 + z e03)/2`` translates by (x, y, z). ``m n`` does ``n``
first. ``m`` and ``-m`` are the same motion. Angles are in radians; lengths are in the units of the coordinates.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import PGA3

POINT, DIRECTION, LINE, PLANE, TRIVECTOR = PGA3.POINT, PGA3.DIRECTION, PGA3.LINE, PGA3.PLANE, PGA3.TRIVECTOR
MOTOR, ROTOR, TRANSLATOR, EVEN = PGA3.MOTOR, PGA3.ROTOR, PGA3.TRANSLATOR, PGA3.EVEN
UNIT_LINE, UNIT_PLANE, FULL = PGA3.UNIT_LINE, PGA3.UNIT_PLANE, PGA3.full
VECTOR, QUATERNION, MATRIX = array(SCALAR, 3), array(SCALAR, 4), array(SCALAR, 4, 4)

ORIGIN = PGA3.multivector({"e123": 1})
AXES = tuple(PGA3.multivector({name: 1}) for name in ("e032", "e013", "e021"))
PSEUDOSCALAR = PGA3.multivector({"e0123": 1})
NEARLY_ZERO = Fraction(1, 10**18)
HALF = Fraction(1, 2)


def _rotor(w, x, y, z):
    """The rotor whose quaternion is ``w + x i + y j + z k``."""
    return ga.assemble(PGA3, {"1": w, "e12": -z, "e13": y, "e23": -x})


def _translator(v):
    return ga.assemble(PGA3, {"1": 1, "e01": -v[0] / 2, "e02": -v[1] / 2, "e03": -v[2] / 2})


def _coordinates(point):
    return point["e032"], point["e013"], point["e021"]


def _study_unit(x):
    """`x` times ``(x ~x)**(-1/2)``, which is a dual number ``s + p I`` to the power -1/2 because `x` is even."""
    study = x * ~x
    s = study["1"]
    return x * (1 - study["e0123"] / (2 * s) * PSEUDOSCALAR) / ga.sqrt(s)


# Products, involutions and duals of any two elements.


@kernel(a=FULL, b=FULL)
def geometric_product(a, b):
    """The geometric product ``a b`` of any two elements."""
    return a * b


@kernel(a=FULL, b=FULL)
def outer_product(a, b):
    """The outer product ``a ^ b`` of any two elements: the meet of planes."""
    return a ^ b


@kernel(a=FULL, b=FULL)
def regressive_product(a, b):
    """The regressive product ``a & b`` of any two elements: the join of points."""
    return a & b


@kernel(a=FULL, b=FULL)
def inner_product(a, b):
    """The inner product of any two elements: of grades p and q, the part of grade \\|p - q\\| of ``a b``."""
    return ga.inner_product(a, b)


@kernel(a=FULL, b=FULL)
def commutator(a, b):
    """``(a b - b a) / 2`` for any two elements."""
    return ga.commutator(a, b)


@kernel(a=FULL)
def reverse(a):
    """The reverse ``~a`` of any element: the order of vectors in every product turned round."""
    return ~a


@kernel(a=FULL)
def grade_involution(a):
    """Any element with its odd part negated."""
    return ga.grade_involution(a)


@kernel(a=FULL)
def clifford_conjugate(a):
    """The reverse of the grade involution of any element."""
    return ga.clifford_conjugate(a)


@kernel(a=FULL)
def dual(a):
    """The right complement of any element, which needs no metric: ``b ^ dual(b) = e0123`` for basis blades."""
    return ga.dual(a)


@kernel(a=FULL)
def undual(a):
    """The inverse of `dual`."""
    return ga.undual(a)


@kernel(a=FULL)
def norm(a):
    """The norm ``sqrt(<a ~a>)`` of any element, which does not see ``e0``; 0 for what lies at infinity."""
    return ga.norm(a)


@kernel(a=FULL)
def ideal_norm(a):
    """The norm of the dual of any element: of a point its distance to the origin, of a direction its length."""
    return ga.norm(ga.dual(a))


# Points, lines and planes.


@kernel(t=TRIVECTOR, returns=POINT)
def point_from_trivector(t):
    """The point with weight 1 of a trivector. The weight, the coefficient of e123, must not be 0."""
    return t / t["e123"]


@kernel(line=LINE)
def normalize_line(line):
    """The line divided by the length of its direction. A line at infinity has length 0 and cannot be normalised."""
    return ga.normalize(line)


@kernel(plane=PLANE)
def normalize_plane(plane):
    """The plane divided by the length of its normal. The plane at infinity has length 0 and cannot be normalised."""
    return ga.normalize(plane)


@kernel(a=POINT, b=POINT)
def join_points(a, b):
    """The line from `a` to `b`; its norm is their distance. It is 0 where the points are the same."""
    return a & b


@kernel(p=POINT, d=DIRECTION)
def join_point_direction(p, d):
    """The line through the point `p` along the direction `d`; its norm is the length of `d`."""
    return p & d


@kernel(p=POINT, line=LINE)
def join_point_line(p, line):
    """The plane that contains the point and the line; 0 where the point lies on the line.

    Its norm is the distance of the point times the norm of the line.
    """
    return p & line


@kernel(a=POINT, b=POINT, c=POINT)
def join_three_points(a, b, c):
    """The plane through three points, seen counter-clockwise from where its normal points; 0 if they are on a line.

    Its norm is twice the area of the triangle.
    """
    return a & b & c


@kernel(a=POINT, b=POINT, c=POINT, d=POINT)
def join_four_points(a, b, c, d):
    """Six times the signed volume ``det[b - a, c - a, d - a]`` of a tetrahedron; 0 where the points lie in one plane.

    It is positive where `d` is on the side of the normal of ``join_three_points(a, b, c)``.
    """
    return a & b & c & d


@kernel(p=PLANE, q=PLANE)
def meet_planes(p, q):
    """The line in which two planes meet, along the vector product of the normals.

    Parallel planes meet in a line at infinity (direction 0); a plane with itself gives 0.
    """
    return p ^ q


@kernel(line=LINE, plane=PLANE)
def meet_line_plane(line, plane):
    """The point, with a weight, in which a line meets a plane.

    The weight is the inner product of direction and normal: 0, a direction, where they are parallel; all is 0 where
    the line lies in the plane.
    """
    return line ^ plane


@kernel(p=PLANE, q=PLANE, r=PLANE)
def meet_three_planes(p, q, r):
    """The point, with a weight, that three planes have in common. The weight is the determinant of the normals."""
    return p ^ q ^ r


@kernel(p=POINT, plane=PLANE)
def line_orthogonal_to_plane(p, plane):
    """The line through the point `p` along the normal of the plane; its norm is that of the plane."""
    return ga.inner_product(plane, p)


@kernel(p=POINT, line=LINE)
def plane_orthogonal_to_line(p, line):
    """The plane through the point `p` whose normal is the direction of the line; its norm is that of the line."""
    return ga.inner_product(p, ~line)


@kernel(p=POINT, plane=PLANE)
def plane_through_point(p, plane):
    """The plane through the point `p` that is parallel to the plane, of the same norm."""
    return ga.inner_product(p, plane) * ~p


@kernel(a=POINT, b=POINT)
def distance_squared_points(a, b):
    """The squared distance of two points."""
    return ga.norm_squared(a & b)


@kernel(a=POINT, b=POINT)
def distance_points(a, b):
    """The distance of two points."""
    return ga.norm(a & b)


@kernel(p=POINT, plane=UNIT_PLANE)
def signed_distance_point_plane(p, plane):
    """The distance of a point to a normalised plane, positive on the side of the normal."""
    return plane & p


@kernel(p=POINT, line=UNIT_LINE)
def distance_point_line(p, line):
    """The distance of a point to a normalised line."""
    return ga.norm(p & line)


@kernel(line=UNIT_LINE, other=UNIT_LINE)
def mutual_moment(line, other):
    """Distance times sine of the angle of two normalised lines; 0 exactly where they meet or are parallel.

    With points p, q and directions d, e it is ``(p - q) . (d x e)``.
    """
    return line & other


@kernel(p=UNIT_PLANE, q=UNIT_PLANE)
def angle_between_planes(p, q):
    """The angle between the normals of two normalised planes, in [0, pi], accurate also where it is small."""
    return ga.atan2(ga.norm(p ^ q), ga.scalar_product(p, q))


@kernel(line=UNIT_LINE, other=UNIT_LINE)
def angle_between_lines(line, other):
    """The angle between the directions of two normalised lines, in [0, pi], accurate also where it is small."""
    return ga.atan2(ga.norm(ga.commutator(line, other)), ga.scalar_product(line, ~other))


@kernel(p=POINT, plane=PLANE)
def project_point_on_plane(p, plane):
    """The point of the plane, of any norm but 0, that is nearest to the point `p`."""
    return ga.right_contraction(p, plane) * ga.inverse(plane)


@kernel(p=POINT, plane=UNIT_PLANE)
def project_point_on_unit_plane(p, plane):
    """The point of the normalised plane that is nearest to the point `p`."""
    return ga.right_contraction(p, plane) * plane


@kernel(p=POINT, line=LINE)
def project_point_on_line(p, line):
    """The point of the line that is nearest to the point `p`: where the plane through `p` orthogonal to it meets it.

    The line may have any norm but 0.
    """
    foot = ga.inner_product(p, line) ^ line
    return foot / foot["e123"]


@kernel(p=POINT, line=UNIT_LINE)
def project_point_on_unit_line(p, line):
    """The point of the normalised line that is nearest to the point `p`."""
    return ga.right_contraction(p, line) * ~line


@kernel(line=LINE, plane=UNIT_PLANE)
def project_line_on_unit_plane(line, plane):
    """The orthogonal projection of a line on a normalised plane; at infinity where the line is orthogonal to it."""
    return ga.right_contraction(line, plane) * plane


@kernel(p=POINT, plane=UNIT_PLANE)
def reflect_point(p, plane):
    """The mirror image of the point `p` in the normalised plane."""
    return plane * p * plane


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


@kernel(x=EVEN)
def even_inverse(x):
    """The inverse of an even element. Its rotational part must not be 0."""
    return ga.inverse(x)


@kernel(x=EVEN, returns=MOTOR)
def normalize_motor(x):
    """The unit motor of an even element: ``x (x ~x)**(-1/2)``.

    ``x ~x`` is a dual number ``s + p e0123``, so that both conditions, norm 1 and the Study quadric, hold afterwards,
    and a motor times any dual number gives the motor back. The rotational part must not be 0.
    """
    return _study_unit(x)


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
    """The line, or any bivector such as a twist, moved by the unit motor `m`: ``m line ~m``."""
    return m * line * ~m


@kernel(m=MOTOR, plane=PLANE)
def move_plane(m, plane):
    """The plane moved by the unit motor `m`: ``m plane ~m``."""
    return m * plane * ~m


@kernel(m=MOTOR, n=MOTOR, returns=MOTOR)
def move_motor(m, n):
    """The motion `n` carried along by the unit motor `m`: ``m n ~m``, the same motion about the moved screw axis."""
    return m * n * ~m


@kernel(m=MOTOR, p=POINT)
def move_point_back(m, p):
    """The point `p` moved by the inverse of the unit motor `m`: ``~m p m``."""
    return ~m * p * m


@kernel(axis=VECTOR, angle=SCALAR, returns=ROTOR)
def rotor_from_axis_angle(axis, angle):
    """The rotation about an axis through the origin, right-handed, in radians. The axis may have any length but 0."""
    x, y, z = axis
    factor = ga.sin(angle / 2) / ga.sqrt(x * x + y * y + z * z)
    return _rotor(ga.cos(angle / 2), factor * x, factor * y, factor * z)


@kernel(v=VECTOR, returns=ROTOR)
def rotor_from_rotation_vector(v):
    """The rotation about `v` by its length in radians, through the origin; smooth where the vector is 0."""
    return ga.exp(ga.assemble(PGA3, {"e12": -v[2] / 2, "e13": v[1] / 2, "e23": -v[0] / 2}))


@kernel(v=VECTOR, returns=TRANSLATOR)
def translator_from_vector(v):
    """The translation by a vector."""
    return _translator(v)


@kernel(line=UNIT_LINE, angle=SCALAR, returns=MOTOR)
def motor_from_line(line, angle):
    """The right-handed rotation about a normalised line: ``exp(-angle/2 line)``."""
    return ga.cos(angle / 2) - ga.sin(angle / 2) * line


@kernel(line=UNIT_LINE, angle=SCALAR, distance=SCALAR, returns=MOTOR)
def motor_from_screw(line, angle, distance):
    """The screw motion about a normalised line: right-handed by `angle`, along it by `distance`."""
    rotation = ga.cos(angle / 2) - ga.sin(angle / 2) * line
    return (1 + distance / 2 * PSEUDOSCALAR * line) * rotation


@kernel(r=ROTOR, v=VECTOR, returns=MOTOR)
def motor_from_rotor_translation(r, v):
    """The motor that turns by the rotor `r` and then translates by the vector `v`."""
    return _translator(v) * r


@kernel(m=MOTOR, returns=(ROTOR, VECTOR))
def motor_to_rotor_translation(m):
    """The rotor and the translation vector of a unit motor: what `motor_from_rotor_translation` puts together."""
    rotor = ga.assemble(PGA3, {name: m[name] for name in ROTOR.blades})
    return rotor, _coordinates(m * ORIGIN * ~m)


@kernel(q=QUATERNION, returns=ROTOR)
def rotor_from_quaternion(q):
    """The rotor of a unit quaternion (w, x, y, z), scalar first: ``w - x e23 + y e13 - z e12``."""
    return _rotor(*q)


@kernel(r=ROTOR, returns=QUATERNION)
def rotor_to_quaternion(r):
    """The unit quaternion (w, x, y, z), scalar first, of a rotor."""
    return r["1"], -r["e23"], r["e13"], -r["e12"]


@kernel(q=array(SCALAR, 8), returns=MOTOR)
def motor_from_dual_quaternion(q):
    """The motor of a unit dual quaternion ``r + eps d``, stored as (r_w, r_x, r_y, r_z, d_w, d_x, d_y, d_z).

    Scalars first, and ``d = t r / 2`` for a translation by `t` after the rotation `r`. The dual unit eps is -e0123.
    """
    return _rotor(*q[:4]) - PSEUDOSCALAR * _rotor(*q[4:])


@kernel(m=MOTOR, returns=array(SCALAR, 8))
def motor_to_dual_quaternion(m):
    """The unit dual quaternion of a motor as (r_w, r_x, r_y, r_z, d_w, d_x, d_y, d_z), scalars first.

    The inverse of `motor_from_dual_quaternion`: ``d = t r / 2`` for a translation by `t` after the rotation `r`.
    """
    return m["1"], -m["e23"], m["e13"], -m["e12"], -m["e0123"], -m["e01"], -m["e02"], -m["e03"]


@kernel(m=MOTOR, returns=MATRIX)
def motor_to_matrix(m):
    """The homogeneous 4 x 4 matrix of a unit motor, which acts on columns (x, y, z, 1)."""
    columns = [_coordinates(m * axis * ~m) for axis in AXES] + [_coordinates(m * ORIGIN * ~m)]
    return (*zip(*columns, strict=True), (0, 0, 0, 1))


@kernel(r=ROTOR, returns=array(SCALAR, 3, 3))
def rotor_to_matrix(r):
    """The 3 x 3 matrix of a rotor, which acts on columns (x, y, z)."""
    return tuple(zip(*(_coordinates(r * axis * ~r) for axis in AXES), strict=True))


@kernel(matrix=MATRIX, returns=MOTOR)
def motor_from_matrix(matrix):
    """The motor of a homogeneous 4 x 4 matrix of a rigid motion, the one of two whose scalar part is not negative.

    The largest of the four squares of the quaternion's coefficients, which is at least 1/4, says which row of
    products of coefficients is divided by its length (Shepperd, *J. Guidance and Control* 1:223, 1978), so that all
    rotations, half turns among them, are equally accurate and the result is a unit motor also where the matrix is
    orthogonal only nearly. The last row of the matrix is not looked at. At an exact half turn both signs are right.
    """
    return _translator([matrix[i][3] for i in range(3)]) * _rotor_of_matrix(matrix)


@kernel(matrix=array(SCALAR, 3, 3), returns=ROTOR)
def rotor_from_matrix(matrix):
    """The rotor of a 3 x 3 rotation matrix, the one of two whose scalar part is not negative.

    All rotations, half turns among them, are equally accurate, and the result is a unit rotor also where the matrix
    is orthogonal only nearly. At an exact half turn both signs are right.
    """
    return _rotor_of_matrix(matrix)


def _rotor_of_matrix(t):
    """Rows of the matrix ``4 q q^T`` of the quaternion q; the one with the largest diagonal entry is normalised."""
    x, y, z = t[2][1] - t[1][2], t[0][2] - t[2][0], t[1][0] - t[0][1]
    xy, xz, yz = t[0][1] + t[1][0], t[0][2] + t[2][0], t[1][2] + t[2][1]
    ww, xx = 1 + t[0][0] + t[1][1] + t[2][2], 1 + t[0][0] - t[1][1] - t[2][2]
    yy, zz = 1 - t[0][0] + t[1][1] - t[2][2], 1 - t[0][0] - t[1][1] + t[2][2]
    rows = ((ww, x, y, z), (x, xx, xy, xz), (y, xy, yy, yz), (z, xz, yz, zz))
    first_of_upper, first_of_lower = xx <= ww, zz <= yy
    upper = [ga.select(first_of_upper, a, b) for a, b in zip(rows[0], rows[1], strict=True)]
    lower = [ga.select(first_of_lower, a, b) for a, b in zip(rows[2], rows[3], strict=True)]
    in_upper = ga.maximum(yy, zz) <= ga.maximum(ww, xx)
    row = [ga.select(in_upper, a, b) for a, b in zip(upper, lower, strict=True)]
    length = ga.sqrt(sum(a * a for a in row))
    factor = ga.select(row[0] < 0, -1, 1) / length
    return _rotor(*(factor * a for a in row))


@kernel(theta=SCALAR, d=SCALAR, a=SCALAR, alpha=SCALAR, returns=MOTOR)
def motor_from_denavit_hartenberg(theta, d, a, alpha):
    """The motor of a row of a standard Denavit-Hartenberg table.

    Turn about z by `theta`, move along z by `d`, along the new x by `a`, and turn about it by `alpha`.
    """
    turn_z = _rotor(ga.cos(theta / 2), 0, 0, ga.sin(theta / 2))
    turn_x = _rotor(ga.cos(alpha / 2), ga.sin(alpha / 2), 0, 0)
    return turn_z * _translator([a, 0, d]) * turn_x


@kernel(theta=SCALAR, d=SCALAR, a=SCALAR, alpha=SCALAR, returns=MOTOR)
def motor_from_modified_denavit_hartenberg(theta, d, a, alpha):
    """The motor of a row of a modified (Craig's) Denavit-Hartenberg table.

    Turn about x by `alpha`, move along x by `a`, turn about the new z by `theta`, and move along it by `d`.
    """
    turn_z = _rotor(ga.cos(theta / 2), 0, 0, ga.sin(theta / 2))
    turn_x = _rotor(ga.cos(alpha / 2), ga.sin(alpha / 2), 0, 0)
    return turn_x * _translator([a, 0, d]) * turn_z


@kernel(b=LINE, returns=MOTOR)
def motor_exponential(b):
    """``exp(b)`` of any bivector; ``exp(-angle/2 line)`` is a rotation. Smooth at 0 and for pure translations."""
    return ga.exp(b)


@kernel(m=MOTOR)
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


@kernel(a=UNIT_LINE, b=UNIT_LINE, returns=MOTOR)
def motor_between_lines(a, b):
    """The motor that takes the normalised line `a` to `b` about their common perpendicular by the smaller angle.

    Undefined where the directions are opposite: then every half turn about a perpendicular does it.
    """
    return _study_unit(1 + b * ~a)


@kernel(a=UNIT_PLANE, b=UNIT_PLANE, returns=MOTOR)
def motor_between_planes(a, b):
    """The motor that takes the normalised plane `a` to `b`: a rotation about their meet, or a translation.

    Undefined where the normals are opposite.
    """
    return _study_unit(1 + b * a)


@kernel(m=MOTOR, returns=array(SCALAR, 6, 6))
def motor_to_adjoint(m):
    """The 6 x 6 matrix of a unit motor on lines and twists: on columns of their coefficients in a line's order."""
    moved = [m * PGA3.multivector({name: 1}) * ~m for name in LINE.blades]
    return tuple(tuple(column[name] for column in moved) for name in LINE.blades)


# Velocities.


@kernel(a=LINE, b=LINE)
def line_commutator(a, b):
    """The commutator ``(a b - b a) / 2`` of two lines, twists or wrenches: the Lie bracket of the motor group."""
    return ga.commutator(a, b)


@kernel(v=LINE, p=POINT)
def twist_on_point(v, p):
    """The velocity of the point `p` under the twist `v`: the derivative at 0 of ``m p ~m`` with ``m = exp(-t/2 v)``."""
    return ga.commutator(p, v)


@kernel(v=LINE, line=LINE)
def twist_on_line(v, line):
    """The rate of change of the line under the twist `v`, as in `twist_on_point`."""
    return ga.commutator(line, v)


@kernel(v=LINE, plane=PLANE)
def twist_on_plane(v, plane):
    """The rate of change of the plane under the twist `v`, as in `twist_on_point`."""
    return ga.commutator(plane, v)
