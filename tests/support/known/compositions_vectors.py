"""Compositions of rotations with products and invariants in vector algebras, quaternions and complex numbers."""

from gacompiler import (
    clifford_conjugate,
    commutator,
    inner_product,
    kernel,
    left_contraction,
    norm_squared,
    sandwich,
    scalar_product,
)
from gacompiler.algebra.catalog import COMPLEX, DOUBLE_NUMBERS, QUATERNIONS, VGA2, VGA3, orthogonal

VECTOR, UNIT_VECTOR, BIVECTOR, ROTOR, EVEN = VGA3.VECTOR, VGA3.UNIT_VECTOR, VGA3.BIVECTOR, VGA3.ROTOR, VGA3.EVEN
UNIT_QUATERNION, PURE = QUATERNIONS.UNIT_QUATERNION, QUATERNIONS.VECTOR
VGA4 = orthogonal(4, name="VGA4")
VECTOR4, BIVECTOR4 = VGA4.layout("VECTOR", "e1 e2 e3 e4"), VGA4.layout("BIVECTOR", "e12 e13 e14 e23 e24 e34")


@kernel(r=ROTOR, a=VECTOR, b=VECTOR)
def inner_product_of_turned_vectors(r, a, b):
    """The inner product of two vectors that were turned together."""
    return scalar_product(sandwich(r, a), sandwich(r, b))


@kernel(r=ROTOR, s=ROTOR, a=VECTOR, b=VECTOR)
def inner_product_under_two_rotors(r, s, a, b):
    """The inner product of two vectors, each turned by its own rotor."""
    return scalar_product(sandwich(r, a), sandwich(s, b))


@kernel(r=ROTOR, a=VECTOR, b=VECTOR)
def outer_product_of_turned_vectors(r, a, b):
    """The plane of two vectors that were turned together."""
    return sandwich(r, a) ^ sandwich(r, b)


@kernel(r=ROTOR, a=VECTOR, b=VECTOR)
def geometric_product_of_turned_vectors(r, a, b):
    """The geometric product of two vectors that were turned together."""
    return sandwich(r, a) * sandwich(r, b)


@kernel(r=ROTOR, a=VECTOR, b=VECTOR)
def squared_area_of_turned_vectors(r, a, b):
    """The squared area that two vectors span after they were turned."""
    return norm_squared(sandwich(r, a) ^ sandwich(r, b))


@kernel(r=ROTOR, a=VECTOR, b=VECTOR, c=VECTOR)
def double_cross_of_turned_vectors(r, a, b, c):
    """The contraction of one turned vector with the plane of two others."""
    return left_contraction(sandwich(r, a), sandwich(r, b) ^ sandwich(r, c))


@kernel(r=ROTOR, s=ROTOR, b=BIVECTOR)
def two_rotors_bivector(r, s, b):
    """An angular velocity turned by two rotors."""
    return sandwich(r * s, b)


@kernel(r=ROTOR, a=BIVECTOR, b=BIVECTOR)
def commutator_of_turned_bivectors(r, a, b):
    """The Lie bracket of two angular velocities that were turned together."""
    return commutator(sandwich(r, a), sandwich(r, b))


@kernel(r=ROTOR, s=ROTOR, v=VECTOR)
def conjugated_rotation_of_vector(r, s, v):
    """A vector turned by a rotor that was carried to another frame."""
    return sandwich(r * s * ~r, v)


@kernel(r=ROTOR, v=VECTOR)
def vector_turned_twice(r, v):
    """A vector turned by the same rotor twice."""
    return sandwich(r, sandwich(r, v))


@kernel(r=ROTOR, s=ROTOR, t=ROTOR, v=VECTOR)
def three_rotors_vector(r, s, t, v):
    """A vector turned by three rotors, as by Euler angles."""
    return sandwich(r * s * t, v)


@kernel(r=ROTOR, v=VECTOR)
def change_of_turned_vector(r, v):
    """The difference of a turned vector and the vector."""
    return sandwich(r, v) - v


@kernel(r=ROTOR, s=ROTOR, v=VECTOR)
def mean_of_turned_vectors(r, s, v):
    """The mean of a vector turned by two rotors."""
    return (sandwich(r, v) + sandwich(s, v)) / 2


@kernel(r=ROTOR, a=VECTOR, b=VECTOR)
def sum_of_turned_vectors(r, a, b):
    """The sum of two vectors that were turned together."""
    return sandwich(r, a) + sandwich(r, b)


@kernel(r=ROTOR, s=ROTOR)
def commutator_of_rotors(r, s):
    """The group commutator of two rotations."""
    return r * s * ~r * ~s


@kernel(a=UNIT_VECTOR, b=UNIT_VECTOR, c=UNIT_VECTOR, v=VECTOR)
def reflect_vector_three_times(a, b, c, v):
    """A vector reflected in three planes."""
    return sandwich(c, sandwich(b, sandwich(a, v)))


@kernel(n=UNIT_VECTOR, a=VECTOR, b=VECTOR)
def inner_product_of_reflected_vectors(n, a, b):
    """The inner product of two vectors reflected in one plane."""
    return scalar_product(sandwich(n, a), sandwich(n, b))


@kernel(r=ROTOR, w=BIVECTOR)
def rotor_rate(r, w):
    """The derivative of a rotation under an angular velocity in the body."""
    return r * w / 2


@kernel(a=VECTOR, b=VECTOR, c=VECTOR)
def product_of_three_vectors(a, b, c):
    """The geometric product of three vectors."""
    return a * b * c


@kernel(a=VECTOR, b=VECTOR)
def vector_reflected_in_any(a, b):
    """A vector reflected in another of any length, times the squared length."""
    return b * a * b


@kernel(a=VECTOR, b=VECTOR, c=VECTOR, d=VECTOR)
def product_of_two_planes(a, b, c, d):
    """The inner product of two planes of two vectors each."""
    return inner_product(a ^ b, c ^ d)


@kernel(a=VECTOR, b=VECTOR)
def identity_of_lagrange(a, b):
    """The squared area that two vectors span."""
    return norm_squared(a ^ b)


@kernel(r=VGA2.ROTOR, s=VGA2.ROTOR, v=VGA2.VECTOR)
def two_rotors_vector_2d(r, s, v):
    """A vector of the plane turned by two rotors."""
    return sandwich(r * s, v)


@kernel(r=VGA2.ROTOR, a=VGA2.VECTOR, b=VGA2.VECTOR)
def inner_product_of_turned_vectors_2d(r, a, b):
    """The inner product of two vectors of the plane that were turned together."""
    return scalar_product(sandwich(r, a), sandwich(r, b))


@kernel(r=VGA2.ROTOR, a=VGA2.VECTOR, b=VGA2.VECTOR)
def area_of_turned_vectors_2d(r, a, b):
    """The area that two vectors of the plane span after they were turned."""
    return sandwich(r, a) ^ sandwich(r, b)


@kernel(q=UNIT_QUATERNION, a=PURE, b=PURE)
def product_of_turned_quaternions(q, a, b):
    """The product of two vectors that were turned by a unit quaternion."""
    return q * a * clifford_conjugate(q) * (q * b * clifford_conjugate(q))


@kernel(p=UNIT_QUATERNION, q=UNIT_QUATERNION, r=UNIT_QUATERNION, v=PURE)
def three_quaternions_vector(p, q, r, v):
    """A vector turned by three unit quaternions."""
    return p * q * r * v * clifford_conjugate(p * q * r)


@kernel(p=UNIT_QUATERNION, q=UNIT_QUATERNION)
def conjugated_quaternion(p, q):
    """An attitude seen from another frame."""
    return p * q * clifford_conjugate(p)


@kernel(z=COMPLEX.UNIT_NUMBER, w=COMPLEX.NUMBER)
def complex_conjugation(z, w):
    """The product of a complex number with a unit number and its conjugate."""
    return z * w * clifford_conjugate(z)


@kernel(a=COMPLEX.NUMBER, b=COMPLEX.NUMBER, c=COMPLEX.NUMBER)
def three_complex_numbers(a, b, c):
    """The product of three complex numbers."""
    return a * b * c


@kernel(a=DOUBLE_NUMBERS.NUMBER, b=DOUBLE_NUMBERS.NUMBER)
def two_double_numbers(a, b):
    """The product of two double numbers."""
    return a * b


@kernel(r=VGA4.UNIT_EVEN, a=VECTOR4, b=VECTOR4)
def inner_product_of_turned_vectors_4d(r, a, b):
    """The inner product of two vectors of four dimensions that were turned together."""
    return scalar_product(sandwich(r, a), sandwich(r, b))


@kernel(r=VGA4.UNIT_EVEN, b=BIVECTOR4)
def rotor_bivector_4d(r, b):
    """A generator of so(4) carried to another frame."""
    return sandwich(r, b)
