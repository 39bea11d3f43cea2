"""Contractions of blades, their symmetric parts and squares, and expanded polynomials, which have shorter forms."""

from gacompiler import (
    SCALAR,
    commutator,
    inner_product,
    kernel,
    left_contraction,
    norm_squared,
    sandwich,
)
from gacompiler.algebra.catalog import CGA2, CGA3, PGA3, STA, orthogonal

POINT2, POINT, SPHERE, SPHERE_VECTOR, EVENT = CGA2.POINT, CGA3.POINT, CGA3.SPHERE, CGA3.VECTOR, STA.VECTOR
VGA4, VGA5, VGA6 = (orthogonal(n, name=f"VGA{n}") for n in (4, 5, 6))
VECTOR4, VECTOR5 = VGA4.layout("VECTOR", "e1 e2 e3 e4"), VGA5.layout("VECTOR", "e1 e2 e3 e4 e5")
VECTOR6 = VGA6.layout("VECTOR", "e1 e2 e3 e4 e5 e6")
SPLIT = orthogonal(2, 2).layout("VECTOR", "e1 e2 e3 e4")
PLANE, EUCLIDEAN, MOTOR = PGA3.PLANE, PGA3.POINT, PGA3.MOTOR
MOTOR4 = orthogonal(4, 0, 1).even


@kernel(a=POINT2, b=POINT2, c=POINT2, d=POINT2)
def product_of_two_bivectors_2d(a, b, c, d):
    """The inner product of two outer products of conformal points of the plane."""
    return inner_product(a ^ b, c ^ d)


@kernel(a=POINT2, b=POINT2, x=POINT2)
def commutator_with_bivector_2d(a, b, x):
    """The commutator of an outer product and a third element, of conformal points of the plane."""
    return commutator(a ^ b, x)


@kernel(a=POINT2, b=POINT2, c=POINT2)
def squared_contraction_2d(a, b, c):
    """The squared norm of a contraction of conformal points of the plane."""
    return norm_squared(left_contraction(c, a ^ b))


@kernel(a=POINT2, b=POINT2, c=POINT2, d=POINT2)
def nested_contraction_2d(a, b, c, d):
    """A contraction within a contraction of conformal points of the plane."""
    return left_contraction(a, left_contraction(b, c ^ d))


@kernel(a=POINT2, b=POINT2, c=POINT2)
def squared_trivector_2d(a, b, c):
    """The squared norm of the outer product of conformal points of the plane."""
    return norm_squared((a * b * c).grade(3))


@kernel(a=POINT2, b=POINT2, c=POINT2, d=POINT2)
def commutator_of_bivectors_2d(a, b, c, d):
    """The commutator of two outer products of conformal points of the plane."""
    return commutator(a ^ b, c ^ d)


@kernel(a=POINT2, b=POINT2, c=POINT2)
def symmetric_product_2d(a, b, c):
    """The sum of a product of three and its reverse, of conformal points of the plane."""
    return a * b * c + c * b * a


@kernel(a=POINT, b=POINT, c=POINT, d=POINT)
def product_of_two_bivectors(a, b, c, d):
    """The inner product of two outer products of conformal points."""
    return inner_product(a ^ b, c ^ d)


@kernel(a=POINT, b=POINT, x=POINT)
def commutator_with_bivector(a, b, x):
    """The commutator of an outer product and a third element, of conformal points."""
    return commutator(a ^ b, x)


@kernel(a=POINT, b=POINT, c=POINT)
def squared_contraction(a, b, c):
    """The squared norm of a contraction of conformal points."""
    return norm_squared(left_contraction(c, a ^ b))


@kernel(a=POINT, b=POINT, c=POINT, d=POINT)
def nested_contraction(a, b, c, d):
    """A contraction within a contraction of conformal points."""
    return left_contraction(a, left_contraction(b, c ^ d))


@kernel(a=POINT, b=POINT, c=POINT)
def squared_trivector(a, b, c):
    """The squared norm of the outer product of conformal points."""
    return norm_squared((a * b * c).grade(3))


@kernel(a=POINT, b=POINT, c=POINT, d=POINT)
def commutator_of_bivectors(a, b, c, d):
    """The commutator of two outer products of conformal points."""
    return commutator(a ^ b, c ^ d)


@kernel(a=POINT, b=POINT, c=POINT)
def symmetric_product(a, b, c):
    """The sum of a product of three and its reverse, of conformal points."""
    return a * b * c + c * b * a


@kernel(a=VECTOR4, b=VECTOR4, c=VECTOR4, d=VECTOR4)
def product_of_two_bivectors_4(a, b, c, d):
    """The inner product of two outer products of vectors in four dimensions."""
    return inner_product(a ^ b, c ^ d)


@kernel(a=VECTOR4, b=VECTOR4, x=VECTOR4)
def commutator_with_bivector_4(a, b, x):
    """The commutator of an outer product and a third element, of vectors in four dimensions."""
    return commutator(a ^ b, x)


@kernel(a=VECTOR4, b=VECTOR4, c=VECTOR4)
def squared_contraction_4(a, b, c):
    """The squared norm of a contraction of vectors in four dimensions."""
    return norm_squared(left_contraction(c, a ^ b))


@kernel(a=VECTOR4, b=VECTOR4, c=VECTOR4, d=VECTOR4)
def nested_contraction_4(a, b, c, d):
    """A contraction within a contraction of vectors in four dimensions."""
    return left_contraction(a, left_contraction(b, c ^ d))


@kernel(a=VECTOR4, b=VECTOR4, c=VECTOR4)
def squared_trivector_4(a, b, c):
    """The squared norm of the outer product of vectors in four dimensions."""
    return norm_squared((a * b * c).grade(3))


@kernel(a=VECTOR4, b=VECTOR4, c=VECTOR4, d=VECTOR4)
def commutator_of_bivectors_4(a, b, c, d):
    """The commutator of two outer products of vectors in four dimensions."""
    return commutator(a ^ b, c ^ d)


@kernel(a=VECTOR4, b=VECTOR4, c=VECTOR4)
def symmetric_product_4(a, b, c):
    """The sum of a product of three and its reverse, of vectors in four dimensions."""
    return a * b * c + c * b * a


@kernel(a=VECTOR5, b=VECTOR5, c=VECTOR5, d=VECTOR5)
def product_of_two_bivectors_5(a, b, c, d):
    """The inner product of two outer products of vectors in five dimensions."""
    return inner_product(a ^ b, c ^ d)


@kernel(a=VECTOR5, b=VECTOR5, x=VECTOR5)
def commutator_with_bivector_5(a, b, x):
    """The commutator of an outer product and a third element, of vectors in five dimensions."""
    return commutator(a ^ b, x)


@kernel(a=VECTOR5, b=VECTOR5, c=VECTOR5)
def squared_contraction_5(a, b, c):
    """The squared norm of a contraction of vectors in five dimensions."""
    return norm_squared(left_contraction(c, a ^ b))


@kernel(a=VECTOR5, b=VECTOR5, c=VECTOR5, d=VECTOR5)
def nested_contraction_5(a, b, c, d):
    """A contraction within a contraction of vectors in five dimensions."""
    return left_contraction(a, left_contraction(b, c ^ d))


@kernel(a=VECTOR5, b=VECTOR5, c=VECTOR5)
def squared_trivector_5(a, b, c):
    """The squared norm of the outer product of vectors in five dimensions."""
    return norm_squared((a * b * c).grade(3))


@kernel(a=VECTOR5, b=VECTOR5, c=VECTOR5, d=VECTOR5)
def commutator_of_bivectors_5(a, b, c, d):
    """The commutator of two outer products of vectors in five dimensions."""
    return commutator(a ^ b, c ^ d)


@kernel(a=VECTOR5, b=VECTOR5, c=VECTOR5)
def symmetric_product_5(a, b, c):
    """The sum of a product of three and its reverse, of vectors in five dimensions."""
    return a * b * c + c * b * a


@kernel(a=VECTOR6, b=VECTOR6, c=VECTOR6, d=VECTOR6)
def product_of_two_bivectors_6(a, b, c, d):
    """The inner product of two outer products of vectors in six dimensions."""
    return inner_product(a ^ b, c ^ d)


@kernel(a=VECTOR6, b=VECTOR6, x=VECTOR6)
def commutator_with_bivector_6(a, b, x):
    """The commutator of an outer product and a third element, of vectors in six dimensions."""
    return commutator(a ^ b, x)


@kernel(a=VECTOR6, b=VECTOR6, c=VECTOR6)
def squared_contraction_6(a, b, c):
    """The squared norm of a contraction of vectors in six dimensions."""
    return norm_squared(left_contraction(c, a ^ b))


@kernel(a=VECTOR6, b=VECTOR6, c=VECTOR6, d=VECTOR6)
def nested_contraction_6(a, b, c, d):
    """A contraction within a contraction of vectors in six dimensions."""
    return left_contraction(a, left_contraction(b, c ^ d))


@kernel(a=VECTOR6, b=VECTOR6, c=VECTOR6)
def squared_trivector_6(a, b, c):
    """The squared norm of the outer product of vectors in six dimensions."""
    return norm_squared((a * b * c).grade(3))


@kernel(a=VECTOR6, b=VECTOR6, c=VECTOR6, d=VECTOR6)
def commutator_of_bivectors_6(a, b, c, d):
    """The commutator of two outer products of vectors in six dimensions."""
    return commutator(a ^ b, c ^ d)


@kernel(a=VECTOR6, b=VECTOR6, c=VECTOR6)
def symmetric_product_6(a, b, c):
    """The sum of a product of three and its reverse, of vectors in six dimensions."""
    return a * b * c + c * b * a


@kernel(a=EVENT, b=EVENT, c=EVENT, d=EVENT)
def product_of_two_bivectors_spacetime(a, b, c, d):
    """The inner product of two outer products of vectors of space-time."""
    return inner_product(a ^ b, c ^ d)


@kernel(a=EVENT, b=EVENT, x=EVENT)
def commutator_with_bivector_spacetime(a, b, x):
    """The commutator of an outer product and a third element, of vectors of space-time."""
    return commutator(a ^ b, x)


@kernel(a=EVENT, b=EVENT, c=EVENT)
def squared_contraction_spacetime(a, b, c):
    """The squared norm of a contraction of vectors of space-time."""
    return norm_squared(left_contraction(c, a ^ b))


@kernel(a=EVENT, b=EVENT, c=EVENT, d=EVENT)
def nested_contraction_spacetime(a, b, c, d):
    """A contraction within a contraction of vectors of space-time."""
    return left_contraction(a, left_contraction(b, c ^ d))


@kernel(a=EVENT, b=EVENT, c=EVENT)
def squared_trivector_spacetime(a, b, c):
    """The squared norm of the outer product of vectors of space-time."""
    return norm_squared((a * b * c).grade(3))


@kernel(a=EVENT, b=EVENT, c=EVENT, d=EVENT)
def commutator_of_bivectors_spacetime(a, b, c, d):
    """The commutator of two outer products of vectors of space-time."""
    return commutator(a ^ b, c ^ d)


@kernel(a=EVENT, b=EVENT, c=EVENT)
def symmetric_product_spacetime(a, b, c):
    """The sum of a product of three and its reverse, of vectors of space-time."""
    return a * b * c + c * b * a


@kernel(a=SPLIT, b=SPLIT, c=SPLIT, d=SPLIT)
def product_of_two_bivectors_split(a, b, c, d):
    """The inner product of two outer products of vectors of G(2, 2)."""
    return inner_product(a ^ b, c ^ d)


@kernel(a=SPLIT, b=SPLIT, x=SPLIT)
def commutator_with_bivector_split(a, b, x):
    """The commutator of an outer product and a third element, of vectors of G(2, 2)."""
    return commutator(a ^ b, x)


@kernel(a=SPLIT, b=SPLIT, c=SPLIT)
def squared_contraction_split(a, b, c):
    """The squared norm of a contraction of vectors of G(2, 2)."""
    return norm_squared(left_contraction(c, a ^ b))


@kernel(a=SPLIT, b=SPLIT, c=SPLIT, d=SPLIT)
def nested_contraction_split(a, b, c, d):
    """A contraction within a contraction of vectors of G(2, 2)."""
    return left_contraction(a, left_contraction(b, c ^ d))


@kernel(a=SPLIT, b=SPLIT, c=SPLIT)
def squared_trivector_split(a, b, c):
    """The squared norm of the outer product of vectors of G(2, 2)."""
    return norm_squared((a * b * c).grade(3))


@kernel(a=SPLIT, b=SPLIT, c=SPLIT, d=SPLIT)
def commutator_of_bivectors_split(a, b, c, d):
    """The commutator of two outer products of vectors of G(2, 2)."""
    return commutator(a ^ b, c ^ d)


@kernel(a=SPLIT, b=SPLIT, c=SPLIT)
def symmetric_product_split(a, b, c):
    """The sum of a product of three and its reverse, of vectors of G(2, 2)."""
    return a * b * c + c * b * a


@kernel(a=POINT2, b=POINT2, c=POINT2, d=POINT2)
def squared_sum_of_pairs_2d(a, b, c, d):
    """The squared norm of the sum of two pairs of points."""
    return norm_squared((a ^ b) + (c ^ d))


@kernel(a=POINT, b=POINT, c=POINT, d=POINT)
def squared_sum_of_pairs(a, b, c, d):
    """The squared norm of the sum of two pairs of points."""
    return norm_squared((a ^ b) + (c ^ d))


@kernel(a=POINT, b=POINT, s=SPHERE)
def pair_of_points_and_sphere(a, b, s):
    """The meet of a pair of points and a sphere."""
    return (a ^ b) & s


@kernel(a=SPHERE_VECTOR, b=SPHERE_VECTOR, c=POINT)
def two_spheres_and_point(a, b, c):
    """The squared norm of the outer product of two spheres and a point."""
    return norm_squared(c ^ a ^ b)


@kernel(a=POINT, b=POINT, c=POINT, d=POINT)
def cross_ratio_of_points(a, b, c, d):
    """The cross ratio of four points."""
    return inner_product(a, b) * inner_product(c, d) / (inner_product(a, c) * inner_product(b, d))


@kernel(a=POINT, b=POINT, c=POINT, d=POINT)
def product_of_circles(a, b, c, d):
    """The inner product of two circles through two common points."""
    return inner_product(a ^ b ^ c, b ^ c ^ d)


@kernel(a=VECTOR6, b=VECTOR6, c=VECTOR6)
def squared_product_of_vectors_6(a, b, c):
    """The squared norm of the product of three vectors in six dimensions."""
    return norm_squared(a * b * c)


@kernel(a=PLANE, b=PLANE, c=EUCLIDEAN, d=EUCLIDEAN)
def planes_meet_line_of_points(a, b, c, d):
    """The incidence of the meet of two planes and the line through two points."""
    return (a ^ b) & (c & d)


@kernel(m=MOTOR, a=PLANE, b=PLANE, c=PLANE)
def three_moved_planes_meet(m, a, b, c):
    """The point of three planes that were moved together."""
    return sandwich(m, a) ^ sandwich(m, b) ^ sandwich(m, c)


@kernel(a=MOTOR4, b=MOTOR4)
def motors_of_four_dimensions(a, b):
    """The product of two motors of four dimensions."""
    return a * b


@kernel(x=SCALAR, y=SCALAR)
def fourth_power_of_difference(x, y):
    """The fourth power of a difference, expanded."""
    return x**4 - 4 * x**3 * y + 6 * x**2 * y**2 - 4 * x * y**3 + y**4


@kernel(x=SCALAR, y=SCALAR, z=SCALAR)
def three_differences(x, y, z):
    """The product of three differences, expanded."""
    return x * x * y - x * x * z - x * y * y + x * z * z + y * y * z - y * z * z


@kernel(x=SCALAR, y=SCALAR, u=SCALAR, v=SCALAR)
def product_of_two_sums_of_squares(x, y, u, v):
    """The product of two sums of squares, expanded."""
    return x * x * u * u + x * x * v * v + y * y * u * u + y * y * v * v
