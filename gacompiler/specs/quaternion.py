"""Quaternions (w, x, y, z), scalar first, as the even elements of G(3): ``i = e32, j = e13, k = e21``.

``i i = j j = k k = i j k = -1``. The unit quaternion ``cos(angle/2) + sin(angle/2) (x i + y j + z k)`` rotates vectors
by the right-hand rule about the unit vector (x, y, z) and acts by ``q v ~q``; ``p q`` applies ``q`` first; ``q`` and
``-q`` represent the same rotation. Angles are in radians. Kernels that require a unit quaternion say so; the others
accept any quaternion. Kernels for Fourier transforms and local phases are included because they use the same layouts.
"""

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import VGA3
from gacompiler.specs.families.rotations import coordinates, quaternion_of_motion, rotor_between

QUATERNION = VGA3.layout("QUATERNION", "1 e32 e13 e21")
UNIT_QUATERNION = VGA3.layout("UNIT_QUATERNION", "1 e32 e13 e21", unit=True)
VECTOR = VGA3.VECTOR
COMPLEX, MATRIX = array(SCALAR, 2), array(SCALAR, 3, 3)

AXES = VGA3.basis()
UNIT_I = VGA3.multivector({"e32": 1})


def _quaternion(w, x, y, z):
    return ga.assemble(VGA3, {"1": w, "e32": x, "e13": y, "e21": z})


@kernel(p=QUATERNION, q=QUATERNION, returns=QUATERNION)
def product(p, q):
    """Compute the product ``p q`` of two quaternions; as rotations, `q` is applied first."""
    return p * q


@kernel(p=QUATERNION, q=QUATERNION, r=QUATERNION, returns=QUATERNION)
def product_of_three(p, q, r):
    """Compute the product ``p q r`` of three quaternions."""
    return p * q * r


@kernel(q=QUATERNION, returns=QUATERNION)
def conjugate(q):
    """Negate i, j and k of a quaternion: the inverse of a unit quaternion."""
    return ~q


@kernel(q=QUATERNION)
def norm(q):
    """Compute the norm ``sqrt(w**2 + x**2 + y**2 + z**2)``."""
    return ga.norm(q)


@kernel(q=QUATERNION, returns=QUATERNION)
def inverse(q):
    """Compute the inverse of a nonzero quaternion."""
    return ga.inverse(q)


@kernel(q=QUATERNION, returns=UNIT_QUATERNION)
def normalize(q):
    """Divide a quaternion by its norm, which must not be 0."""
    return ga.normalize(q)


@kernel(q=UNIT_QUATERNION, v=VECTOR)
def rotate_vector(q, v):
    """Rotate a vector by a unit quaternion: ``q v ~q``."""
    return q * v * ~q


@kernel(q=UNIT_QUATERNION, v=VECTOR)
def rotate_vector_back(q, v):
    """Rotate a vector by the inverse of a unit quaternion: ``~q v q``."""
    return ~q * v * q


@kernel(q=UNIT_QUATERNION, returns=MATRIX)
def to_matrix(q):
    """Compute the 3 x 3 rotation matrix of a unit quaternion, which acts on columns."""
    return tuple(zip(*(coordinates(q * axis * ~q) for axis in AXES), strict=True))


@kernel(matrix=MATRIX, returns=UNIT_QUATERNION)
def from_matrix(matrix):
    """Convert a 3 x 3 rotation matrix to the unit quaternion with nonnegative scalar part.

    The largest squared coefficient, which is at least 1/4, selects the row of coefficient products that is normalised
    (Shepperd, *J. Guidance and Control* 1:223, 1978). All rotations, including half turns, are therefore equally
    accurate, and the result has norm 1 even if the matrix is only nearly orthogonal. It is NaN if the determinant is
    not positive, as that of a reflection. At an exact half turn both signs are correct.
    """
    return _quaternion(*quaternion_of_motion(matrix))


@kernel(axis=VECTOR, angle=SCALAR, returns=UNIT_QUATERNION)
def from_axis_angle(axis, angle):
    """Construct the right-handed rotation, in radians, about an axis of any nonzero length."""
    return ga.cos(angle / 2) - ga.sin(angle / 2) / ga.norm(axis) * ga.dual(axis)


@kernel(v=VECTOR, returns=UNIT_QUATERNION)
def from_rotation_vector(v):
    """Construct the rotation about `v` by its length in radians; smooth at 0."""
    return ga.exp(-ga.dual(v) / 2)


@kernel(q=UNIT_QUATERNION)
def to_rotation_vector(q):
    """Compute the rotation vector of a unit quaternion, axis times angle in [0, pi]; ambiguous at half turns."""
    return -2 * ga.dual(ga.log(q))


@kernel(roll=SCALAR, pitch=SCALAR, yaw=SCALAR, returns=UNIT_QUATERNION)
def from_roll_pitch_yaw(roll, pitch, yaw):
    """Construct the rotation about x by `roll`, then about the fixed y by `pitch`, then about the fixed z by `yaw`."""
    turn_x = _quaternion(ga.cos(roll / 2), ga.sin(roll / 2), 0, 0)
    turn_y = _quaternion(ga.cos(pitch / 2), 0, ga.sin(pitch / 2), 0)
    turn_z = _quaternion(ga.cos(yaw / 2), 0, 0, ga.sin(yaw / 2))
    return turn_z * turn_y * turn_x


@kernel(a=VECTOR, b=VECTOR, returns=UNIT_QUATERNION)
def between_vectors(a, b):
    """Compute the smallest rotation that takes the direction of `a` to that of `b`, both nonzero.

    It is ``1 + b a`` for unit vectors, normalised. If they are opposite to within 1e-4 radians, it is instead the
    product of two reflections: along ``a - b``, which takes `a` to `b` however ill-conditioned their plane is, and
    along a vector orthogonal to `b` in the plane of `a` and `b`, if that plane is defined. Exactly opposite vectors
    thus give a half turn about some axis orthogonal to them.
    """
    return rotor_between(a, b)


@kernel(p=UNIT_QUATERNION, q=UNIT_QUATERNION)
def angle_between(p, q):
    """Compute the angle of the rotation from `p` to `q` or `-q`, in [0, pi], accurate also near 0."""
    difference = ~p * q
    return 2 * ga.atan2(ga.norm(difference.grade(2)), ga.absolute(difference["1"]))


@kernel(q=QUATERNION, returns=QUATERNION)
def exponential(q):
    """Compute ``exp(q) = exp(w) (cos u + v sin(u)/u)`` of a quaternion with vector part v of norm u."""
    return ga.exp(q)


@kernel(q=QUATERNION, returns=QUATERNION)
def logarithm(q):
    """Compute the principal logarithm of a nonzero quaternion.

    It is ``log |q|`` plus the angle in [0, pi] along the vector part. A negative number has no vector part; its angle
    pi is taken along i.
    """
    return ga.log(q, along=UNIT_I)


@kernel(q=QUATERNION, returns=QUATERNION)
def square_root(q):
    """Compute the principal square root of a quaternion: its scalar part is nonnegative; the root of -1 is i."""
    return ga.sqrt(q, along=UNIT_I)


@kernel(q=QUATERNION, t=SCALAR, returns=QUATERNION)
def power(q, t):
    """Compute ``exp(t log(q))`` of a nonzero quaternion, with the principal logarithm."""
    return ga.power(q, t, along=UNIT_I)


@kernel(p=UNIT_QUATERNION, q=UNIT_QUATERNION, t=SCALAR, returns=UNIT_QUATERNION)
def slerp(p, q, t):
    """Interpolate between the rotations `p` (``t = 0``) and `q` or `-q` (``t = 1``) at constant speed.

    The rotation from one to the other is by the smaller angle.
    """
    return ga.interpolate(p, q, t)


def _packed(q):
    w, x, y, z = (q[name] for name in QUATERNION.blades)
    return (w + z, x - y), (w - z, x + y)


def _unpacked(z_plus, z_minus):
    w, x = (z_plus[0] + z_minus[0]) / 2, (z_minus[1] + z_plus[1]) / 2
    y, z = (z_minus[1] - z_plus[1]) / 2, (z_plus[0] - z_minus[0]) / 2
    return _quaternion(w, x, y, z)


@kernel(q=QUATERNION, returns=(COMPLEX, COMPLEX))
def pack_two_sided(q):
    """Extract the two complex numbers that represent a quaternion in the two-sided Fourier transform, real parts first.

    ``q = (z_plus (1 + k) + z_minus (1 - k)) / 2`` with ``z_plus = (w + z) + i (x - y)`` and ``z_minus = (w - z) + i (x
    + y)``. Then ``exp(-i s) q exp(-j t)`` multiplies ``z_plus`` by ``exp(-i (s - t))`` and ``z_minus`` by ``exp(-i (s +
    t))``, so that one complex transform of each gives the transform of the quaternion.
    """
    return _packed(q)


@kernel(z_plus=COMPLEX, z_minus=COMPLEX, returns=QUATERNION)
def unpack_two_sided(z_plus, z_minus):
    """Construct a quaternion from two complex numbers, real parts first: the inverse of `pack_two_sided`."""
    return _unpacked(z_plus, z_minus)


@kernel(p=QUATERNION, q=QUATERNION, r=QUATERNION, returns=(COMPLEX, COMPLEX))
def pack_turned(p, q, r):
    """Extract the two complex numbers of ``p q r``, as defined in `pack_two_sided`."""
    return _packed(p * q * r)


@kernel(z_plus=COMPLEX, z_minus=COMPLEX, p=QUATERNION, r=QUATERNION, returns=QUATERNION)
def unpack_turned(z_plus, z_minus, p, r):
    """Compute the product ``p q r``, with the quaternion q given by two complex numbers as in `unpack_two_sided`."""
    return p * _unpacked(z_plus, z_minus) * r


@kernel(w=COMPLEX, mirrored=COMPLEX, mu=VECTOR, nu=VECTOR, returns=QUATERNION)
def unpack_real(w, mirrored, mu, nu):
    """Compute the two-sided Fourier transform of a real image at (u, v) from the complex ones at (u, v) and (-u, v).

    `mu` and `nu` are the axes, unit vectors for the imaginary quaternions of the same coordinates. With the cosine and
    sine sums of the image the result is ``CC - mu SC - nu CS + mu nu SS``; ``-nu`` instead of nu gives the value at (u,
    -v). Complex numbers have their real part first.
    """
    mu, nu = -ga.dual(mu), -ga.dual(nu)
    even, odd = (w[0] + mirrored[0]) / 2, (w[0] - mirrored[0]) / 2
    return even + (w[1] - mirrored[1]) / 2 * mu + (w[1] + mirrored[1]) / 2 * nu - odd * mu * nu


@kernel(q=QUATERNION, mu=VECTOR, nu=VECTOR, returns=COMPLEX)
def pack_real(q, mu, nu):
    """Compute the complex Fourier transform of a real image at (u, v) from the two-sided one: inverse of `unpack_real`.

    The axes may be equal, but not opposite; the precision decreases as they approach opposite directions.
    """
    mu, nu = -ga.dual(mu), -ga.dual(nu)
    both = mu * nu
    share = 1 / (1 - both["1"])
    return q["1"] + ga.scalar_product(q, both.grade(2)) * share, -ga.scalar_product(q, mu + nu) * share


@kernel(q=QUATERNION, returns=(SCALAR, SCALAR, SCALAR, SCALAR, SCALAR))
def to_phases(q):
    """Compute norm, phi, theta and psi of ``q = norm exp(i phi) exp(k psi) exp(j theta)``, and the cosine of 2 psi.

    phi is in [-pi, pi], theta in [-pi/2, pi/2], psi in [-pi/4, pi/4] (Buelow, *Hypercomplex spectral signal
    representations*, 1999). If ``cos(2 psi)`` is 0, only the sum or the difference of phi and theta is determined;
    theta is computed from phi, so that the product is always `q`. For ``q = 0`` all are 0 and the cosine is 1.
    """
    a, b, c, d = (q[name] for name in QUATERNION.blades)
    size = ga.norm(q)
    sine, cosine = 2 * (c * d + a * b), a * a - b * b + c * c - d * d
    flat = ga.sqrt(sine * sine + cosine * cosine)
    phi = ga.atan2(sine, cosine) / 2
    psi = -ga.atan2(2 * (b * c - a * d), flat) / 2
    along, across = ga.cos(phi), ga.sin(phi)
    turned = _quaternion(ga.cos(psi), 0, 0, -ga.sin(psi)) * _quaternion(along, -across, 0, 0) * q
    opposite = turned["1"] < 0
    phi = ga.select(opposite, ga.atan2(-across, -along), phi)
    sign = ga.select(opposite, -1, 1)
    theta = ga.atan2(sign * turned["e13"], sign * turned["1"])
    none = ga.equal(size, 0)
    return size, phi, theta, psi, ga.select(none, 1, flat / ga.select(none, 1, size * size))


@kernel(size=SCALAR, phi=SCALAR, theta=SCALAR, psi=SCALAR, returns=QUATERNION)
def from_phases(size, phi, theta, psi):
    """Construct the quaternion ``size exp(i phi) exp(k psi) exp(j theta)``."""
    turn_i = _quaternion(ga.cos(phi), ga.sin(phi), 0, 0)
    turn_k = _quaternion(ga.cos(psi), 0, 0, ga.sin(psi))
    return size * turn_i * turn_k * _quaternion(ga.cos(theta), 0, ga.sin(theta), 0)
