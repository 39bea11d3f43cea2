"""Vectors, planes through the origin and rotations of space in the geometric algebra G(3).

A bivector ``B12 e12 + B13 e13 + B23 e23`` is an oriented piece of plane. The rotor ``exp(-angle/2 B)`` of a unit
bivector turns in that plane, from ``e1`` towards ``e2`` for ``e12``, and acts by ``r v ~r``. ``r s`` does ``s`` first,
and ``r`` and ``-r`` are the same rotation. Angles are in radians.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import VGA3

VECTOR, BIVECTOR, ROTOR, EVEN, FULL = VGA3.VECTOR, VGA3.BIVECTOR, VGA3.ROTOR, VGA3.EVEN, VGA3.full
UNIT_VECTOR = VGA3.UNIT_VECTOR
COMPLEX, QUATERNION, MATRIX = array(SCALAR, 2), array(SCALAR, 4), array(SCALAR, 3, 3)

AXES = VGA3.basis()
NEARLY_ZERO = Fraction(1, 10**18)
NEARLY_OPPOSITE = Fraction(1, 10**8)
ROUNDING = Fraction(1, 10**28)


def _rotor(w, x, y, z):
    """The rotor whose quaternion is ``w + x i + y j + z k``."""
    return ga.assemble(VGA3, {"1": w, "e12": -z, "e13": y, "e23": -x})


def _coordinates(v):
    return v["e1"], v["e2"], v["e3"]


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
    """The regressive product ``a & b`` of any two elements: the meet of subspaces that together span space."""
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
def clifford_conjugate(a):
    """The reverse of the grade involution of any element."""
    return ga.clifford_conjugate(a)


@kernel(a=FULL)
def dual(a):
    """The right complement of any element: ``b ^ dual(b) = e123`` for basis blades."""
    return ga.dual(a)


@kernel(a=FULL)
def norm(a):
    """The norm ``sqrt(<a ~a>)`` of any element."""
    return ga.norm(a)


@kernel(a=FULL)
def inverse(a):
    """The inverse of any element that has one."""
    return ga.inverse(a)


# Vectors and bivectors.


@kernel(a=VECTOR, b=VECTOR)
def vector_product(a, b):
    """The geometric product of two vectors: their dot product plus their outer product."""
    return a * b


@kernel(a=VECTOR, b=VECTOR)
def dot_product(a, b):
    """The dot product of two vectors."""
    return ga.scalar_product(a, b)


@kernel(a=VECTOR, b=VECTOR)
def wedge_vectors(a, b):
    """The bivector ``a ^ b`` of the parallelogram of two vectors; 0 where they are parallel."""
    return a ^ b


@kernel(a=VECTOR, b=VECTOR)
def cross_product(a, b):
    """The vector orthogonal to two vectors by the right-hand rule: the dual of ``a ^ b``."""
    return ga.undual(a ^ b)


@kernel(a=VECTOR, b=VECTOR, c=VECTOR)
def triple_product(a, b, c):
    """The signed volume of the parallelepiped of three vectors: the determinant of their matrix."""
    return ga.undual(a ^ b ^ c)


@kernel(v=VECTOR)
def dual_vector(v):
    """The bivector of the plane orthogonal to a vector, right-handed about it: that of e3 is e12."""
    return ga.dual(v)


@kernel(b=BIVECTOR)
def dual_bivector(b):
    """The vector orthogonal to the plane of a bivector, right-handed: that of e12 is e3."""
    return ga.dual(b)


@kernel(v=VECTOR)
def vector_norm(v):
    """The length of a vector."""
    return ga.norm(v)


@kernel(b=BIVECTOR)
def bivector_norm(b):
    """The area of a bivector."""
    return ga.norm(b)


@kernel(v=VECTOR)
def normalize_vector(v):
    """The vector divided by its length, which must not be 0."""
    return ga.normalize(v)


@kernel(a=VECTOR, b=VECTOR)
def angle_between_vectors(a, b):
    """The angle between two vectors of any length but 0, in [0, pi], accurate also near 0 and pi."""
    return ga.atan2(ga.norm(a ^ b), ga.scalar_product(a, b))


@kernel(v=VECTOR, n=VECTOR)
def project_vector_on_vector(v, n):
    """The part of `v` along `n`, which must not be 0."""
    return ga.scalar_product(v, n) / ga.norm_squared(n) * n


@kernel(v=VECTOR, b=BIVECTOR)
def project_vector_on_plane(v, b):
    """The part of `v` in the plane of the bivector `b`, which must not be 0."""
    return ga.left_contraction(v, b) * ~b / ga.norm_squared(b)


@kernel(v=VECTOR, n=VECTOR)
def reflect_vector(v, n):
    """The mirror image ``-n v n / n**2`` of `v` in the plane orthogonal to `n`, which must not be 0."""
    return -(n * v * n) / ga.norm_squared(n)


@kernel(a=BIVECTOR, b=BIVECTOR)
def bivector_commutator(a, b):
    """The commutator ``(a b - b a) / 2`` of two bivectors: the Lie bracket of the rotation group."""
    return ga.commutator(a, b)


# Rotors.


@kernel(a=ROTOR, b=ROTOR, returns=ROTOR)
def rotor_product(a, b):
    """The rotor that does `b` first and then `a`."""
    return a * b


@kernel(a=EVEN, b=EVEN)
def even_product(a, b):
    """The geometric product of two even elements, which need not be rotors."""
    return a * b


@kernel(r=ROTOR, returns=ROTOR)
def rotor_inverse(r):
    """The inverse of a unit rotor, which is its reverse."""
    return ~r


@kernel(x=EVEN, returns=ROTOR)
def normalize_rotor(x):
    """The even element divided by its norm, which must not be 0."""
    return ga.normalize(x)


@kernel(r=ROTOR, v=VECTOR)
def rotate_vector(r, v):
    """The vector turned by the unit rotor: ``r v ~r``."""
    return r * v * ~r


@kernel(r=ROTOR, v=VECTOR)
def rotate_vector_back(r, v):
    """The vector turned by the inverse of the unit rotor: ``~r v r``."""
    return ~r * v * r


@kernel(r=ROTOR, b=BIVECTOR)
def rotate_bivector(r, b):
    """The bivector turned by the unit rotor: ``r b ~r``."""
    return r * b * ~r


@kernel(axis=VECTOR, angle=SCALAR, returns=ROTOR)
def rotor_from_axis_angle(axis, angle):
    """The rotation about an axis, right-handed, in radians. The axis may have any length but 0."""
    return ga.cos(angle / 2) - ga.sin(angle / 2) / ga.norm(axis) * ga.dual(axis)


@kernel(v=VECTOR, returns=ROTOR)
def rotor_from_rotation_vector(v):
    """The rotation about `v` by its length in radians; smooth where the vector is 0."""
    return ga.exp(-ga.dual(v) / 2)


@kernel(r=ROTOR)
def rotor_to_rotation_vector(r):
    """Axis times angle of a unit rotor, the angle in [0, pi]. At half turns the two signs are equally near."""
    return -2 * ga.dual(ga.log(r))


@kernel(b=BIVECTOR, returns=ROTOR)
def rotor_exponential(b):
    """``exp(b)`` of any bivector; ``exp(-angle/2 B)`` turns in the plane of the unit bivector B. Smooth at 0."""
    return ga.exp(b)


@kernel(r=ROTOR)
def rotor_logarithm(r):
    """The bivector of least angle whose exponential is `r` or `-r`, the same rotation."""
    return ga.log(r)


@kernel(r=ROTOR, returns=ROTOR)
def rotor_square_root(r):
    """The rotor that, done twice, is the rotation of `r`, by the smaller angle; the sign of a half turn decides."""
    return ga.sqrt(r)


@kernel(r=ROTOR, t=SCALAR, returns=ROTOR)
def rotor_power(r, t):
    """The part `t` of the rotation of `r`, by the smaller angle: ``exp(t log(r))``, or of ``-r`` if nearer to 1.

    Any real `t`: 0 gives no rotation, 1 the rotation itself, -1 its inverse. At half turns the sense jumps.
    """
    return ga.power(r, t)


@kernel(a=ROTOR, b=ROTOR, t=SCALAR, returns=ROTOR)
def interpolate_rotors(a, b, t):
    """The rotation that is `a` at ``t = 0`` and `b` (or `-b`) at ``t = 1``, at constant speed along the short way."""
    return ga.interpolate(a, b, t)


@kernel(a=VECTOR, b=VECTOR, returns=ROTOR)
def rotor_between_vectors(a, b):
    """The rotor of the smallest rotation that takes the direction of `a` to that of `b`, both of any length but 0.

    It is ``1 + b a`` for unit vectors, normalised. Where they are opposite to within 1e-4 radians, it is the product
    of two reflections instead: along ``a - b``, which takes `a` to `b` however ill-defined their plane is, and along
    a vector orthogonal to `b`, in the plane of `a` and `b` as long as they have one. So exactly opposite vectors give
    a half turn about some axis orthogonal to them.
    """
    a, b = ga.normalize(a), ga.normalize(b)
    half = 1 + b * a
    sum_squared = ga.norm_squared(a + b)
    x, y, z = (ga.absolute(c) for c in _coordinates(b))
    flattest = ga.select(x <= ga.minimum(y, z), AXES[0], ga.select(y <= z, AXES[1], AXES[2]))
    opposite, exactly = sum_squared < NEARLY_OPPOSITE, sum_squared < ROUNDING
    towards = ga.select(opposite, ga.select(exactly, flattest, a + b), flattest)
    fixing = ga.normalize(towards - ga.scalar_product(towards, b) * b)
    reflections = fixing * ga.normalize(ga.select(opposite, a - b, AXES[0]))
    return ga.select(opposite, reflections, half / ga.sqrt(ga.select(opposite, 1, ga.norm_squared(half))))


@kernel(roll=SCALAR, pitch=SCALAR, yaw=SCALAR, returns=ROTOR)
def rotor_from_roll_pitch_yaw(roll, pitch, yaw):
    """Turn about x by `roll`, then about the fixed y by `pitch`, then about the fixed z by `yaw`."""
    turn_x = _rotor(ga.cos(roll / 2), ga.sin(roll / 2), 0, 0)
    turn_y = _rotor(ga.cos(pitch / 2), 0, ga.sin(pitch / 2), 0)
    turn_z = _rotor(ga.cos(yaw / 2), 0, 0, ga.sin(yaw / 2))
    return turn_z * turn_y * turn_x


@kernel(q=QUATERNION, returns=ROTOR)
def rotor_from_quaternion(q):
    """The rotor of a unit quaternion (w, x, y, z), scalar first: ``w - x e23 + y e13 - z e12``."""
    return _rotor(*q)


@kernel(r=ROTOR, returns=QUATERNION)
def rotor_to_quaternion(r):
    """The unit quaternion (w, x, y, z), scalar first, of a rotor."""
    return r["1"], -r["e23"], r["e13"], -r["e12"]


@kernel(r=ROTOR, returns=MATRIX)
def rotor_to_matrix(r):
    """The 3 x 3 matrix of a unit rotor, which acts on columns."""
    return tuple(zip(*(_coordinates(r * axis * ~r) for axis in AXES), strict=True))


@kernel(matrix=MATRIX, returns=ROTOR)
def rotor_from_matrix(matrix):
    """The rotor of a rotation matrix, the one of two whose scalar part is not negative.

    The largest of the four squares of the quaternion's coefficients, which is at least 1/4, says which row of
    products of coefficients is divided by its length (Shepperd, *J. Guidance and Control* 1:223, 1978), so that all
    rotations, half turns among them, are equally accurate and the result is a unit rotor also where the matrix is
    orthogonal only nearly. At an exact half turn both signs are right.
    """
    t = matrix
    x, y, z = t[2][1] - t[1][2], t[0][2] - t[2][0], t[1][0] - t[0][1]
    xy, xz, yz = t[0][1] + t[1][0], t[0][2] + t[2][0], t[1][2] + t[2][1]
    ww, xx = 1 + t[0][0] + t[1][1] + t[2][2], 1 + t[0][0] - t[1][1] - t[2][2]
    yy, zz = 1 - t[0][0] + t[1][1] - t[2][2], 1 - t[0][0] - t[1][1] + t[2][2]
    upper = _choose(xx <= ww, (ww, x, y, z), (x, xx, xy, xz))
    lower = _choose(zz <= yy, (y, xy, yy, yz), (z, xz, yz, zz))
    row = _choose(ga.maximum(yy, zz) <= ga.maximum(ww, xx), upper, lower)
    factor = ga.select(row[0] < 0, -1, 1) / ga.sqrt(sum(a * a for a in row))
    return _rotor(*(factor * a for a in row))


def _choose(condition, these, those):
    return tuple(ga.select(condition, a, b) for a, b in zip(these, those, strict=True))


# Fields.


@kernel(a=FULL, returns=(COMPLEX, COMPLEX, COMPLEX, COMPLEX))
def pack_field(a):
    """The complex numbers of ``a = z_0 + z_1 e1 + z_2 e2 + z_3 e3`` with ``z = x + e123 y``, real parts first.

    e123 commutes with everything, so that multiplying by ``exp(e123 s)`` multiplies all four by ``exp(i s)``.
    """
    return (a["1"], a["e123"]), (a["e1"], a["e23"]), (a["e2"], -a["e13"]), (a["e3"], a["e12"])


@kernel(z0=COMPLEX, z1=COMPLEX, z2=COMPLEX, z3=COMPLEX, returns=FULL)
def unpack_field(z0, z1, z2, z3):
    """The element of four complex numbers, real parts first: the inverse of `pack_field`."""
    numbers = (z[0] + z[1] * VGA3.pseudoscalar for z in (z0, z1, z2, z3))
    return sum(z * axis for z, axis in zip(numbers, (1, *AXES), strict=True))
