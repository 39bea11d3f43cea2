"""Vectors and rotors of the algebras of a vector space."""

import gacompiler as ga
from gacompiler import SCALAR, Family


def vectors(algebra, hyperplane="hyperplane"):
    """Declare products, projections and reflections of vectors; `hyperplane` names what is orthogonal to a vector."""
    family = Family("vectors", hyperplane=hyperplane)
    VECTOR = algebra.VECTOR

    @family.kernel(a=VECTOR, b=VECTOR, returns=algebra.EVEN)
    def vector_product(a, b):
        """Compute the geometric product of two vectors: the sum of their dot product and their outer product."""
        return a * b

    @family.kernel(a=VECTOR, b=VECTOR)
    def dot_product(a, b):
        """Compute the dot product of two vectors."""
        return ga.scalar_product(a, b)

    @family.kernel(a=VECTOR, b=VECTOR)
    def wedge_vectors(a, b):
        """Compute the bivector ``a ^ b`` of two vectors."""
        return a ^ b

    @family.kernel(v=VECTOR)
    def normalize_vector(v):
        """Divide a vector by its length, which must not be 0."""
        return ga.normalize(v)

    @family.kernel(v=VECTOR, n=VECTOR)
    def project_vector_on_vector(v, n):
        """Compute the component of `v` along `n`, which must not be 0."""
        return ga.scalar_product(v, n) / ga.norm_squared(n) * n

    @family.kernel(v=VECTOR, n=VECTOR)
    def reflect_vector(v, n):
        """Reflect `v` in the {hyperplane} orthogonal to `n`, which must not be 0: ``-n v n / n**2``."""
        return -(n * v * n) / ga.norm_squared(n)

    return family


def rotors(algebra):
    """Declare rotors, their exponentials, logarithms and powers, and their action on vectors."""
    family = Family("rotors")
    ROTOR, BIVECTOR, VECTOR = algebra.ROTOR, algebra.BIVECTOR, algebra.VECTOR

    @family.kernel(a=ROTOR, b=ROTOR, returns=ROTOR)
    def rotor_product(a, b):
        """Compose two rotors; the product applies `b` first and then `a`."""
        return a * b

    @family.kernel(r=ROTOR, returns=ROTOR)
    def rotor_inverse(r):
        """Compute the inverse of a unit rotor, which is its reverse."""
        return ~r

    @family.kernel(b=BIVECTOR, returns=ROTOR)
    def rotor_exponential(b):
        """Compute ``exp(b)`` of a bivector."""
        return ga.exp(b)

    @family.kernel(r=ROTOR)
    def rotor_logarithm(r):
        """Compute the bivector of least angle with exponential `r` or `-r`, the same rotation."""
        return ga.log(r)

    @family.kernel(r=ROTOR, returns=ROTOR)
    def rotor_square_root(r):
        """Compute the rotor of half the rotation of `r`, by the smaller angle; a half turn's sign decides."""
        return ga.sqrt(r)

    @family.kernel(r=ROTOR, t=SCALAR, returns=ROTOR)
    def rotor_power(r, t):
        """Compute the power ``exp(t log(r))`` of a rotor, or of ``-r`` if nearer to 1: the smaller rotation times `t`.

        `t` is any real number: 0 gives no rotation, 1 the rotation itself, -1 its inverse. The orientation is
        discontinuous at half turns.
        """
        return ga.power(r, t)

    @family.kernel(a=ROTOR, b=ROTOR, t=SCALAR, returns=ROTOR)
    def interpolate_rotors(a, b, t):
        """Interpolate between the rotors `a` (``t = 0``) and `b` or `-b` (``t = 1``), at constant speed."""
        return ga.interpolate(a, b, t)

    @family.kernel(x=algebra.EVEN, returns=ROTOR)
    def normalize_rotor(x):
        """Divide an even element by its norm, which must not be 0."""
        return ga.normalize(x)

    @family.kernel(r=ROTOR, v=VECTOR)
    def rotate_vector(r, v):
        """Rotate a vector by a unit rotor: ``r v ~r``."""
        return r * v * ~r

    @family.kernel(r=ROTOR, v=VECTOR)
    def rotate_vector_back(r, v):
        """Rotate a vector by the inverse of a unit rotor: ``~r v r``."""
        return ~r * v * r

    return family
