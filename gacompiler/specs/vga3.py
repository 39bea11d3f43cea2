"""Vectors, planes through the origin and rotations of space in the geometric algebra G(3).

A bivector ``B12 e12 + B13 e13 + B23 e23`` is an oriented plane element. The rotor ``exp(-angle/2 B)`` of a unit
bivector rotates in its plane, from ``e1`` towards ``e2`` for ``e12``, and acts by ``r v ~r``. The product ``r s``
applies ``s`` first, and ``r`` and ``-r`` represent the same rotation. Angles are in radians.
"""

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import VGA3
from gacompiler.specs.families.euclidean import rotors, vectors
from gacompiler.specs.families.products import products
from gacompiler.specs.families.rotations import coordinates, rotations_of_space, rotor_between

VECTOR, BIVECTOR, ROTOR, EVEN, FULL = VGA3.VECTOR, VGA3.BIVECTOR, VGA3.ROTOR, VGA3.EVEN, VGA3.full
COMPLEX = array(SCALAR, 2)

AXES = VGA3.basis()
PRODUCTS = products(
    VGA3,
    EVEN,
    regressive_product=": the meet of subspaces that together span space",
    even_product=", which need not be rotors",
)
VECTORS, ROTORS = vectors(VGA3, hyperplane="plane"), rotors(VGA3)


def _rotor(w, x, y, z):
    """Return the rotor of the quaternion ``w + x i + y j + z k``."""
    return ga.assemble(VGA3, {"1": w, "e12": -z, "e13": y, "e23": -x})


ROTATIONS = rotations_of_space(VGA3, _rotor, AXES, coordinates)


# Products, involutions and duals of general elements.

geometric_product = PRODUCTS.geometric_product
outer_product = PRODUCTS.outer_product
regressive_product = PRODUCTS.regressive_product
inner_product = PRODUCTS.inner_product
reverse = PRODUCTS.reverse
grade_involution = PRODUCTS.grade_involution
clifford_conjugate = PRODUCTS.clifford_conjugate
dual = PRODUCTS.dual
norm = PRODUCTS.norm
inverse = PRODUCTS.inverse


# Vectors and bivectors.

vector_product = VECTORS.vector_product
dot_product = VECTORS.dot_product
wedge_vectors = VECTORS.wedge_vectors.documented(
    "Compute the bivector ``a ^ b`` of the parallelogram of two vectors; 0 if they are parallel."
)


@kernel(a=VECTOR, b=VECTOR)
def cross_product(a, b):
    """Compute the cross product, orthogonal to two vectors by the right-hand rule: the dual of ``a ^ b``."""
    return ga.undual(a ^ b)


@kernel(a=VECTOR, b=VECTOR, c=VECTOR)
def triple_product(a, b, c):
    """Compute the signed volume of the parallelepiped of three vectors: the determinant of their matrix."""
    return ga.undual(a ^ b ^ c)


@kernel(v=VECTOR)
def dual_vector(v):
    """Compute the bivector of the plane orthogonal to a vector, right-handed about it; for e3 it is e12."""
    return ga.dual(v)


@kernel(b=BIVECTOR)
def dual_bivector(b):
    """Compute the vector orthogonal to the plane of a bivector, right-handed; for e12 it is e3."""
    return ga.dual(b)


@kernel(v=VECTOR)
def vector_norm(v):
    """Compute the length of a vector."""
    return ga.norm(v)


@kernel(b=BIVECTOR)
def bivector_norm(b):
    """Compute the area of a bivector."""
    return ga.norm(b)


normalize_vector = VECTORS.normalize_vector


@kernel(a=VECTOR, b=VECTOR)
def angle_between_vectors(a, b):
    """Compute the angle between two nonzero vectors, in [0, pi], accurate also near 0 and pi."""
    return ga.atan2(ga.norm(a ^ b), ga.scalar_product(a, b))


project_vector_on_vector = VECTORS.project_vector_on_vector


@kernel(v=VECTOR, b=BIVECTOR)
def project_vector_on_plane(v, b):
    """Project `v` onto the plane of the bivector `b`, which must not be 0."""
    return ga.left_contraction(v, b) * ~b / ga.norm_squared(b)


reflect_vector = VECTORS.reflect_vector


@kernel(a=BIVECTOR, b=BIVECTOR)
def bivector_commutator(a, b):
    """Compute the commutator ``(a b - b a) / 2`` of two bivectors: the Lie bracket of the rotation group."""
    return ga.commutator(a, b)


# Rotors.

rotor_product = ROTORS.rotor_product
even_product = PRODUCTS.even_product
rotor_inverse = ROTORS.rotor_inverse
normalize_rotor = ROTORS.normalize_rotor
rotate_vector = ROTORS.rotate_vector
rotate_vector_back = ROTORS.rotate_vector_back


@kernel(r=ROTOR, b=BIVECTOR)
def rotate_bivector(r, b):
    """Rotate a bivector by a unit rotor: ``r b ~r``."""
    return r * b * ~r


@kernel(axis=VECTOR, angle=SCALAR, returns=ROTOR)
def rotor_from_axis_angle(axis, angle):
    """Construct the right-handed rotation, in radians, about an axis of any nonzero length."""
    return ga.cos(angle / 2) - ga.sin(angle / 2) / ga.norm(axis) * ga.dual(axis)


@kernel(v=VECTOR, returns=ROTOR)
def rotor_from_rotation_vector(v):
    """Construct the rotation about `v` by its length in radians; smooth at 0."""
    return ga.exp(-ga.dual(v) / 2)


@kernel(r=ROTOR)
def rotor_to_rotation_vector(r):
    """Compute the rotation vector of a unit rotor, axis times angle in [0, pi]; its sign is ambiguous at half turns."""
    return -2 * ga.dual(ga.log(r))


rotor_exponential = ROTORS.rotor_exponential.documented(
    "Compute ``exp(b)`` of a bivector; ``exp(-angle/2 B)`` rotates in the plane of the unit bivector B; smooth."
)
rotor_logarithm = ROTORS.rotor_logarithm
rotor_square_root = ROTORS.rotor_square_root
rotor_power = ROTORS.rotor_power
interpolate_rotors = ROTORS.interpolate_rotors


@kernel(a=VECTOR, b=VECTOR, returns=ROTOR)
def rotor_between_vectors(a, b):
    """Compute the rotor of the smallest rotation that takes the direction of `a` to that of `b`, both nonzero.

    It is ``1 + b a`` for unit vectors, normalised. If they are opposite to within 1e-4 radians, it is instead the
    product of two reflections: along ``a - b``, which takes `a` to `b` however ill-conditioned their plane is, and
    along a vector orthogonal to `b` in the plane of `a` and `b`, if that plane is defined. Exactly opposite vectors
    thus give a half turn about some axis orthogonal to them.
    """
    return rotor_between(a, b)


@kernel(roll=SCALAR, pitch=SCALAR, yaw=SCALAR, returns=ROTOR)
def rotor_from_roll_pitch_yaw(roll, pitch, yaw):
    """Construct the rotation about x by `roll`, then about the fixed y by `pitch`, then about the fixed z by `yaw`."""
    turn_x = _rotor(ga.cos(roll / 2), ga.sin(roll / 2), 0, 0)
    turn_y = _rotor(ga.cos(pitch / 2), 0, ga.sin(pitch / 2), 0)
    turn_z = _rotor(ga.cos(yaw / 2), 0, 0, ga.sin(yaw / 2))
    return turn_z * turn_y * turn_x


rotor_from_quaternion = ROTATIONS.rotor_from_quaternion
rotor_to_quaternion = ROTATIONS.rotor_to_quaternion
rotor_to_matrix = ROTATIONS.rotor_to_matrix.documented("Compute the 3 x 3 matrix of a unit rotor, acting on columns.")
rotor_from_matrix = ROTATIONS.rotor_from_matrix.documented(
    """Convert a 3 x 3 rotation matrix to the rotor with nonnegative scalar part.

    The largest squared coefficient of the quaternion, which is at least 1/4, selects the row of coefficient products
    that is normalised (Shepperd, *J. Guidance and Control* 1:223, 1978). All rotations, including half turns, are
    therefore equally accurate, and the result is a unit rotor even if the matrix is only nearly orthogonal. It is NaN
    if the determinant is not positive, as that of a reflection. At an exact half turn both signs are correct.
    """
)


# Fields.


@kernel(a=FULL, returns=(COMPLEX, COMPLEX, COMPLEX, COMPLEX))
def pack_field(a):
    """Extract the complex numbers of ``a = z_0 + z_1 e1 + z_2 e2 + z_3 e3`` with ``z = x + e123 y``, real parts first.

    e123 commutes with every element, so that multiplication by ``exp(e123 s)`` multiplies all four by ``exp(i s)``.
    """
    return (a["1"], a["e123"]), (a["e1"], a["e23"]), (a["e2"], -a["e13"]), (a["e3"], a["e12"])


@kernel(z0=COMPLEX, z1=COMPLEX, z2=COMPLEX, z3=COMPLEX, returns=FULL)
def unpack_field(z0, z1, z2, z3):
    """Construct an element from four complex numbers, real parts first: the inverse of `pack_field`."""
    numbers = (z[0] + z[1] * VGA3.pseudoscalar for z in (z0, z1, z2, z3))
    return sum(z * axis for z, axis in zip(numbers, (1, *AXES), strict=True))
