"""Further expressions of vector algebras without a null direction: 2D, 3D, 4D, split signature, quaternions."""

from gacompiler import (
    assemble,
    clifford_conjugate,
    commutator,
    inner_product,
    kernel,
    left_contraction,
    norm_squared,
    sandwich,
)
from gacompiler.algebra.catalog import QUATERNIONS, VGA2, VGA3, null_pairs, orthogonal

VECTOR, UNIT_VECTOR, BIVECTOR, ROTOR = VGA3.VECTOR, VGA3.UNIT_VECTOR, VGA3.BIVECTOR, VGA3.ROTOR
QUATERNION, UNIT_QUATERNION, PURE = QUATERNIONS.QUATERNION, QUATERNIONS.UNIT_QUATERNION, QUATERNIONS.VECTOR
VGA4, SPLIT4, G33 = orthogonal(4, name="VGA4"), orthogonal(2, 2, name="G22"), null_pairs(3)
VECTOR4 = VGA4.layout("VECTOR", "e1 e2 e3 e4")
BIVECTOR4 = VGA4.layout("BIVECTOR", "e12 e13 e14 e23 e24 e34")
SPLIT_VECTOR = SPLIT4.layout("VECTOR", "e1 e2 e3 e4")
SHEAR = G33.layout("SHEAR", "w1v2 w1v3 w2v3", fixed={"1": 1})  # a homography near the identity: an upper triangle


@kernel(r=VGA2.ROTOR, v=VGA2.VECTOR)
def rotor_vector_2d(r, v):
    """A vector of the plane turned by a rotor."""
    return sandwich(r, v)


@kernel(a=UNIT_VECTOR, v=VECTOR)
def reflect_vector(a, v):
    """A vector reflected in the plane at a right angle to a unit vector."""
    return sandwich(a, v)


@kernel(a=UNIT_VECTOR, b=UNIT_VECTOR, v=VECTOR)
def reflect_vector_twice(a, b, v):
    """A vector reflected in two planes."""
    return sandwich(b, sandwich(a, v))


@kernel(r=ROTOR, s=ROTOR, v=VECTOR)
def two_rotors_vector(r, s, v):
    """A vector turned by two rotors."""
    return sandwich(r * s, v)


@kernel(r=ROTOR, b=BIVECTOR)
def rotor_bivector(r, b):
    """An angular velocity turned by a rotor."""
    return sandwich(r, b)


@kernel(r=ROTOR, a=VECTOR, b=VECTOR, c=VECTOR)
def volume_of_rotated_vectors(r, a, b, c):
    """The volume that three vectors span after they were turned."""
    return sandwich(r, a) ^ sandwich(r, b) ^ sandwich(r, c)


@kernel(r=ROTOR, a=VECTOR, b=VECTOR)
def residual_of_rotation(r, a, b):
    """The squared distance of a turned vector from its partner."""
    return norm_squared(sandwich(r, a) - b)


@kernel(v=VECTOR, b=BIVECTOR)
def project_vector_on_bivector(v, b):
    """The part of a vector in a plane of any weight, times the squared weight."""
    return left_contraction(v, b) * ~b


@kernel(moments=VECTOR, w=BIVECTOR)
def gyroscopic_torque(moments, w):
    """The torque that turns the angular momentum of a body with these principal moments of inertia."""
    momentum = assemble(
        VGA3, {"e23": moments["e1"] * w["e23"], "e13": moments["e2"] * w["e13"], "e12": moments["e3"] * w["e12"]}
    )
    return commutator(momentum, w)


@kernel(a=UNIT_VECTOR, b=UNIT_VECTOR)
def rotor_between_vectors(a, b):
    """The rotor that takes one direction to another, times ``2 cos(angle / 2)``."""
    return 1 + b * a


@kernel(q=UNIT_QUATERNION, v=PURE)
def quaternion_vector(q, v):
    """A vector turned by a unit quaternion."""
    return q * v * clifford_conjugate(q)


@kernel(p=UNIT_QUATERNION, q=UNIT_QUATERNION)
def quaternion_difference(p, q):
    """The rotation from one attitude to another."""
    return clifford_conjugate(p) * q


@kernel(p=UNIT_QUATERNION, q=UNIT_QUATERNION)
def quaternion_chord_squared(p, q):
    """The squared chord between two attitudes."""
    return (p - q) * clifford_conjugate(p - q)


@kernel(p=UNIT_QUATERNION, q=UNIT_QUATERNION, v=PURE)
def two_quaternions_vector(p, q, v):
    """A vector turned by two unit quaternions."""
    return p * q * v * clifford_conjugate(p * q)


@kernel(q=UNIT_QUATERNION, w=PURE)
def quaternion_rate(q, w):
    """The derivative of an attitude under an angular velocity in the body."""
    return q * w / 2


@kernel(a=QUATERNION, b=QUATERNION, c=QUATERNION)
def three_quaternions(a, b, c):
    """The product of three quaternions."""
    return a * b * c


@kernel(r=VGA4.UNIT_EVEN, v=VECTOR4)
def rotor_vector_4d(r, v):
    """A vector of four dimensions turned by a rotor."""
    return sandwich(r, v)


@kernel(a=VGA4.even, b=VGA4.even)
def even_product_4d(a, b):
    """The product of two even elements in four dimensions: two products of quaternions."""
    return a * b


@kernel(a=BIVECTOR4, b=BIVECTOR4)
def commutator_of_bivectors_4d(a, b):
    """The Lie bracket of so(4)."""
    return commutator(a, b)


@kernel(r=SPLIT4.UNIT_EVEN, v=SPLIT_VECTOR)
def rotor_vector_split(r, v):
    """A vector of G(2, 2) turned by a rotor: two 2 x 2 matrices."""
    return sandwich(r, v)


@kernel(a=G33.VECTOR, b=G33.VECTOR)
def vector_sandwich_null_pairs(a, b):
    """A vector of G(3, 3) reflected in another of any length, in a basis of null pairs."""
    return a * b * a


@kernel(b=G33.BIVECTOR, v=G33.VECTOR)
def bivector_on_vector_null_pairs(b, v):
    """A generator of so(3, 3) on a vector."""
    return commutator(b, v)


@kernel(a=G33.BIVECTOR, b=G33.BIVECTOR)
def commutator_of_bivectors_null_pairs(a, b):
    """The Lie bracket of so(3, 3)."""
    return commutator(a, b)


@kernel(s=SHEAR, v=G33.VECTOR)
def shear_of_vector_null_pairs(s, v):
    """The left action of a sum of shears and 1 on a vector."""
    return inner_product(s, v)
