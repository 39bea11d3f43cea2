"""Vectors and rotors of the algebras of a vector space."""

import gacompiler as ga
from gacompiler import SCALAR, Family


def vectors(algebra, hyperplane="hyperplane"):
    """Products, projections and reflections of vectors; `hyperplane` is what is orthogonal to one."""
    family = Family("vectors", hyperplane=hyperplane)
    VECTOR = algebra.VECTOR

    @family.kernel(a=VECTOR, b=VECTOR, returns=algebra.EVEN)
    def vector_product(a, b):
        """The geometric product of two vectors: their dot product plus their outer product."""
        return a * b

    @family.kernel(a=VECTOR, b=VECTOR)
    def dot_product(a, b):
        """The dot product of two vectors."""
        return ga.scalar_product(a, b)

    @family.kernel(a=VECTOR, b=VECTOR)
    def wedge_vectors(a, b):
        """The bivector ``a ^ b`` of two vectors."""
        return a ^ b

    @family.kernel(v=VECTOR)
    def normalize_vector(v):
        """The vector divided by its length, which must not be 0."""
        return ga.normalize(v)

    @family.kernel(v=VECTOR, n=VECTOR)
    def project_vector_on_vector(v, n):
        """The part of `v` along `n`, which must not be 0."""
        return ga.scalar_product(v, n) / ga.norm_squared(n) * n

    @family.kernel(v=VECTOR, n=VECTOR)
    def reflect_vector(v, n):
        """The mirror image ``-n v n / n**2`` of `v` in the {hyperplane} orthogonal to `n`, which must not be 0."""
        return -(n * v * n) / ga.norm_squared(n)

    return family


def rotors(algebra):
    """Rotors, their exponentials, logarithms and powers, and what they do to vectors."""
    family = Family("rotors")
    ROTOR, BIVECTOR, VECTOR = algebra.ROTOR, algebra.BIVECTOR, algebra.VECTOR

    @family.kernel(a=ROTOR, b=ROTOR, returns=ROTOR)
    def rotor_product(a, b):
        """The rotor that does `b` first and then `a`."""
        return a * b

    @family.kernel(r=ROTOR, returns=ROTOR)
    def rotor_inverse(r):
        """The inverse of a unit rotor, which is its reverse."""
        return ~r

    @family.kernel(b=BIVECTOR, returns=ROTOR)
    def rotor_exponential(b):
        """``exp(b)`` of any bivector."""
        return ga.exp(b)

    @family.kernel(r=ROTOR)
    def rotor_logarithm(r):
        """The bivector of least angle whose exponential is `r` or `-r`, the same rotation."""
        return ga.log(r)

    @family.kernel(r=ROTOR, returns=ROTOR)
    def rotor_square_root(r):
        """The rotor that, done twice, is the rotation of `r`, by the smaller angle; the sign of a half turn decides."""
        return ga.sqrt(r)

    @family.kernel(r=ROTOR, t=SCALAR, returns=ROTOR)
    def rotor_power(r, t):
        """The part `t` of the rotation of `r`, by the smaller angle: ``exp(t log(r))``, or of ``-r`` if nearer to 1.

        Any real `t`: 0 gives no rotation, 1 the rotation itself, -1 its inverse. At half turns the sense jumps.
        """
        return ga.power(r, t)

    @family.kernel(a=ROTOR, b=ROTOR, t=SCALAR, returns=ROTOR)
    def interpolate_rotors(a, b, t):
        """The rotation that is `a` at ``t = 0`` and `b` (or `-b`) at ``t = 1``, at constant speed along the short way."""  # noqa: E501
        return ga.interpolate(a, b, t)

    @family.kernel(x=algebra.EVEN, returns=ROTOR)
    def normalize_rotor(x):
        """The even element divided by its norm, which must not be 0."""
        return ga.normalize(x)

    @family.kernel(r=ROTOR, v=VECTOR)
    def rotate_vector(r, v):
        """The vector turned by the unit rotor: ``r v ~r``."""
        return r * v * ~r

    @family.kernel(r=ROTOR, v=VECTOR)
    def rotate_vector_back(r, v):
        """The vector turned by the inverse of the unit rotor: ``~r v r``."""
        return ~r * v * r

    return family
