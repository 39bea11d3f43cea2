"""Vectors and rotations of the plane in the geometric algebra G(2); its even elements are the complex numbers.

The rotor ``exp(-angle/2 e12)``, stored as (scalar, e12), rotates from ``e1`` towards ``e2`` and acts by ``r v ~r``.
``r`` and ``-r`` represent the same rotation. Angles are in radians.
"""

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import VGA2
from gacompiler.specs.families.euclidean import rotors, vectors
from gacompiler.specs.families.products import products
from gacompiler.specs.families.rotations import direction_of_matrix, rotations_of_the_plane

VECTOR, ROTOR, EVEN, FULL = VGA2.VECTOR, VGA2.ROTOR, VGA2.EVEN, VGA2.full
COMPLEX, MATRIX = array(SCALAR, 2), array(SCALAR, 2, 2)

E1, E2 = VGA2.basis()
PRODUCTS, VECTORS, ROTORS = products(VGA2, EVEN), vectors(VGA2, hyperplane="line"), rotors(VGA2)
ROTATIONS = rotations_of_the_plane(VGA2)


def _rotor(cosine, sine):
    """Return the rotor, with nonnegative scalar part, of the angle of (cosine, sine), of any nonzero length."""
    length = ga.sqrt(cosine * cosine + sine * sine)
    sharp, left = cosine >= 0, ga.select(sine < 0, -1, 1)
    w = ga.select(sharp, length + cosine, left * sine)
    z = ga.select(sharp, sine, left * (length - cosine))
    return (w - z * E1 * E2) / ga.sqrt(w * w + z * z)


geometric_product = PRODUCTS.geometric_product
outer_product = PRODUCTS.outer_product
regressive_product = PRODUCTS.regressive_product
inner_product = PRODUCTS.inner_product
reverse = PRODUCTS.reverse.documented("Compute the reverse ``~a`` of an element.")
dual = PRODUCTS.dual
norm = PRODUCTS.norm
inverse = PRODUCTS.inverse
vector_product = VECTORS.vector_product
dot_product = VECTORS.dot_product


@kernel(a=VECTOR, b=VECTOR)
def signed_area(a, b):
    """Compute the signed area of the parallelogram of two vectors, positive if `b` is on the left of `a`."""
    return (a ^ b)["e12"]


@kernel(v=VECTOR)
def quarter_turn(v):
    """Rotate a vector from e1 towards e2 by a right angle: its dual."""
    return ga.dual(v)


normalize_vector = VECTORS.normalize_vector


@kernel(a=VECTOR, b=VECTOR)
def angle_between_vectors(a, b):
    """Compute the angle from `a` to `b`, both nonzero, in (-pi, pi], positive from e1 towards e2."""
    return ga.atan2((a ^ b)["e12"], ga.scalar_product(a, b))


project_vector_on_vector = VECTORS.project_vector_on_vector
reflect_vector = VECTORS.reflect_vector
rotor_product = ROTORS.rotor_product.documented("Compose two rotors; they commute.")
even_product = PRODUCTS.even_product.documented(
    "Compute the product of two even elements: of two complex numbers, real part first."
)
rotor_inverse = ROTORS.rotor_inverse
normalize_rotor = ROTORS.normalize_rotor
rotate_vector = ROTORS.rotate_vector
rotate_vector_back = ROTORS.rotate_vector_back


rotor_from_angle = ROTATIONS.rotor_from_angle


@kernel(r=ROTOR)
def rotor_to_angle(r):
    """Compute the angle of a unit rotor, in [-pi, pi], equal for `r` and `-r`."""
    flipped = r["1"] < 0
    return 2 * ga.atan2(ga.select(flipped, r["e12"], -r["e12"]), ga.absolute(r["1"]))


rotor_exponential = ROTORS.rotor_exponential.documented(
    "Compute ``exp(b)`` of a bivector; ``exp(-angle/2 e12)`` rotates from e1 towards e2."
)
rotor_logarithm = ROTORS.rotor_logarithm.documented(
    "Compute the bivector of least angle, in [-pi/2, pi/2], with exponential `r` or `-r`, the same rotation."
)
rotor_square_root = ROTORS.rotor_square_root
rotor_power = ROTORS.rotor_power
interpolate_rotors = ROTORS.interpolate_rotors


@kernel(x=EVEN)
def even_exponential(x):
    """Compute ``exp(x)`` of an even element, a complex number with the real part first."""
    return ga.exp(x)


@kernel(x=EVEN)
def even_logarithm(x):
    """Compute the principal logarithm of a nonzero even element, a complex number: its angle is in [-pi, pi]."""
    return ga.log(x)


@kernel(x=EVEN)
def even_square_root(x):
    """Compute the principal square root of an even element, a complex number: its real part is nonnegative."""
    return ga.sqrt(x)


@kernel(a=VECTOR, b=VECTOR, returns=ROTOR)
def rotor_between_vectors(a, b):
    """Compute the rotor that takes the direction of `a` to that of `b` by the smaller angle, both nonzero.

    For opposite vectors it is a half turn from e1 towards e2.
    """
    return _rotor(ga.scalar_product(a, b), (a ^ b)["e12"])


@kernel(r=ROTOR, returns=MATRIX)
def rotor_to_matrix(r):
    """Compute the 2 x 2 matrix of a unit rotor, which acts on columns."""
    x, y = r * E1 * ~r, r * E2 * ~r
    return (x["e1"], y["e1"]), (x["e2"], y["e2"])


@kernel(matrix=MATRIX, returns=ROTOR)
def rotor_from_matrix(matrix):
    """Convert a 2 x 2 matrix to the rotor, with nonnegative scalar part, of the nearest rotation.

    The result is NaN if the determinant is not positive, as that of a reflection.
    """
    return _rotor(*direction_of_matrix(matrix))


# Fields.


@kernel(a=FULL, returns=(COMPLEX, COMPLEX))
def pack_field(a):
    """Extract the two complex numbers ``z = x + i y`` of ``a = z_0 + e1 z_1`` with ``i = e12``, real parts first.

    Multiplication of `a` from the right by ``exp(e12 s)`` multiplies both by ``exp(i s)``; multiplication from the left
    multiplies the first and divides the second.
    """
    return (a["1"], a["e12"]), (a["e1"], a["e2"])


@kernel(even=COMPLEX, odd=COMPLEX, returns=FULL)
def unpack_field(even, odd):
    """Construct an element from two complex numbers, real parts first: the inverse of `pack_field`."""
    return ga.assemble(VGA2, {"1": even[0], "e12": even[1], "e1": odd[0], "e2": odd[1]})
