"""Vectors and rotations of the plane in the geometric algebra G(2); its even elements are the complex numbers.

The rotor ``exp(-angle/2 e12)``, stored as (scalar, e12), turns from ``e1`` towards ``e2`` and acts by ``r v ~r``.
``r`` and ``-r`` are the same rotation. Angles are in radians.
"""

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import VGA2

VECTOR, BIVECTOR, ROTOR = VGA2.VECTOR, VGA2.BIVECTOR, VGA2.ROTOR
EVEN, FULL = VGA2.EVEN, VGA2.full
COMPLEX, MATRIX = array(SCALAR, 2), array(SCALAR, 2, 2)

E1, E2 = VGA2.basis()


def _rotor(cosine, sine):
    """The rotor, scalar part not negative, by the angle of the direction (cosine, sine), of any length but 0."""
    length = ga.sqrt(cosine * cosine + sine * sine)
    sharp, left = cosine >= 0, ga.select(sine < 0, -1, 1)
    w = ga.select(sharp, length + cosine, left * sine)
    z = ga.select(sharp, sine, left * (length - cosine))
    return (w - z * E1 * E2) / ga.sqrt(w * w + z * z)


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
    """The regressive product ``a & b`` of any two elements."""
    return a & b


@kernel(a=FULL, b=FULL)
def inner_product(a, b):
    """The inner product of any two elements: of grades p and q, the part of grade \\|p - q\\| of ``a b``."""
    return ga.inner_product(a, b)


@kernel(a=FULL)
def reverse(a):
    """The reverse ``~a`` of any element."""
    return ~a


@kernel(a=FULL)
def dual(a):
    """The right complement of any element: ``b ^ dual(b) = e12`` for basis blades."""
    return ga.dual(a)


@kernel(a=FULL)
def norm(a):
    """The norm ``sqrt(<a ~a>)`` of any element."""
    return ga.norm(a)


@kernel(a=FULL)
def inverse(a):
    """The inverse of any element that has one."""
    return ga.inverse(a)


@kernel(a=VECTOR, b=VECTOR)
def vector_product(a, b):
    """The geometric product of two vectors: their dot product plus their outer product."""
    return a * b


@kernel(a=VECTOR, b=VECTOR)
def dot_product(a, b):
    """The dot product of two vectors."""
    return ga.scalar_product(a, b)


@kernel(a=VECTOR, b=VECTOR)
def signed_area(a, b):
    """The signed area of the parallelogram of two vectors, positive where `b` is on the left of `a`."""
    return (a ^ b)["e12"]


@kernel(v=VECTOR)
def quarter_turn(v):
    """The vector turned from e1 towards e2 by a right angle: its dual."""
    return ga.dual(v)


@kernel(v=VECTOR)
def normalize_vector(v):
    """The vector divided by its length, which must not be 0."""
    return ga.normalize(v)


@kernel(a=VECTOR, b=VECTOR)
def angle_between_vectors(a, b):
    """The angle from `a` to `b`, both of any length but 0, in (-pi, pi], positive from e1 towards e2."""
    return ga.atan2((a ^ b)["e12"], ga.scalar_product(a, b))


@kernel(v=VECTOR, n=VECTOR)
def project_vector_on_vector(v, n):
    """The part of `v` along `n`, which must not be 0."""
    return ga.scalar_product(v, n) / ga.norm_squared(n) * n


@kernel(v=VECTOR, n=VECTOR)
def reflect_vector(v, n):
    """The mirror image ``-n v n / n**2`` of `v` in the line orthogonal to `n`, which must not be 0."""
    return -(n * v * n) / ga.norm_squared(n)


@kernel(a=ROTOR, b=ROTOR, returns=ROTOR)
def rotor_product(a, b):
    """The rotor that does both rotations, whose order is all the same."""
    return a * b


@kernel(a=EVEN, b=EVEN)
def even_product(a, b):
    """The product of two even elements: of two complex numbers, real part first."""
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


@kernel(angle=SCALAR, returns=ROTOR)
def rotor_from_angle(angle):
    """The rotation by an angle in radians, from e1 towards e2."""
    return ga.cos(angle / 2) - ga.sin(angle / 2) * E1 * E2


@kernel(r=ROTOR)
def rotor_to_angle(r):
    """The angle of a unit rotor, in [-pi, pi]; `r` and `-r` give the same."""
    flipped = r["1"] < 0
    return 2 * ga.atan2(ga.select(flipped, r["e12"], -r["e12"]), ga.absolute(r["1"]))


@kernel(b=BIVECTOR, returns=ROTOR)
def rotor_exponential(b):
    """``exp(b)`` of any bivector; ``exp(-angle/2 e12)`` turns from e1 towards e2."""
    return ga.exp(b)


@kernel(r=ROTOR)
def rotor_logarithm(r):
    """The bivector of least angle, in [-pi/2, pi/2], whose exponential is `r` or `-r`, the same rotation."""
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


@kernel(x=EVEN)
def even_exponential(x):
    """``exp(x)`` of any even element, a complex number with the real part first."""
    return ga.exp(x)


@kernel(x=EVEN)
def even_logarithm(x):
    """The principal logarithm of any even element but 0, a complex number: its angle is in [-pi, pi]."""
    return ga.log(x)


@kernel(x=EVEN)
def even_square_root(x):
    """The principal square root of any even element, a complex number: its real part is not negative."""
    return ga.sqrt(x)


@kernel(a=VECTOR, b=VECTOR, returns=ROTOR)
def rotor_between_vectors(a, b):
    """The rotor that takes the direction of `a` to that of `b` the short way, both of any length but 0.

    Opposite vectors are turned by half a turn from e1 towards e2.
    """
    return _rotor(ga.scalar_product(a, b), (a ^ b)["e12"])


@kernel(r=ROTOR, returns=MATRIX)
def rotor_to_matrix(r):
    """The 2 x 2 matrix of a unit rotor, which acts on columns."""
    x, y = r * E1 * ~r, r * E2 * ~r
    return (x["e1"], y["e1"]), (x["e2"], y["e2"])


@kernel(matrix=MATRIX, returns=ROTOR)
def rotor_from_matrix(matrix):
    """The rotor, with scalar part not negative, of a 2 x 2 rotation matrix; of the nearest rotation of any other."""
    return _rotor(matrix[0][0] + matrix[1][1], matrix[1][0] - matrix[0][1])


# Fields.


@kernel(a=FULL, returns=(COMPLEX, COMPLEX))
def pack_field(a):
    """The two complex numbers ``z = x + i y`` of ``a = z_0 + e1 z_1`` with ``i = e12``, real parts first.

    Multiplying `a` from the right by ``exp(e12 s)`` multiplies both by ``exp(i s)``; from the left, it divides the
    second one by it.
    """
    return (a["1"], a["e12"]), (a["e1"], a["e2"])


@kernel(even=COMPLEX, odd=COMPLEX, returns=FULL)
def unpack_field(even, odd):
    """The element of two complex numbers, real parts first: the inverse of `pack_field`."""
    return ga.assemble(VGA2, {"1": even[0], "e12": even[1], "e1": odd[0], "e2": odd[1]})
