"""Rotations of space as rotors, quaternions and matrices, and those of the plane by their angles."""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, Family, array

NEARLY_OPPOSITE = Fraction(1, 10**8)
"""Squares of sums of unit vectors less than this are those of nearly opposite ones."""
ROUNDING = Fraction(1, 10**28)
"""Squares less than this are rounding."""


def coordinates(v):
    """The coordinates of a vector of G(3)."""
    return v["e1"], v["e2"], v["e3"]


def choose(condition, these, those):
    """These numbers where a condition holds, else those."""
    return tuple(ga.select(condition, a, b) for a, b in zip(these, those, strict=True))


def quaternion_of_matrix(t):
    """The quaternion (w, x, y, z), with w not negative, of a rotation matrix.

    Rows of the matrix ``4 q q^T`` of the quaternion q; the one with the largest diagonal entry is normalised (Shepperd,
    *J. Guidance and Control* 1:223, 1978).
    """
    x, y, z = t[2][1] - t[1][2], t[0][2] - t[2][0], t[1][0] - t[0][1]
    xy, xz, yz = t[0][1] + t[1][0], t[0][2] + t[2][0], t[1][2] + t[2][1]
    ww, xx = 1 + t[0][0] + t[1][1] + t[2][2], 1 + t[0][0] - t[1][1] - t[2][2]
    yy, zz = 1 - t[0][0] + t[1][1] - t[2][2], 1 - t[0][0] - t[1][1] + t[2][2]
    upper = choose(xx <= ww, (ww, x, y, z), (x, xx, xy, xz))
    lower = choose(zz <= yy, (y, xy, yy, yz), (z, xz, yz, zz))
    row = choose(ga.maximum(yy, zz) <= ga.maximum(ww, xx), upper, lower)
    factor = ga.select(row[0] < 0, -1, 1) / ga.sqrt(sum(a * a for a in row))
    return tuple(factor * a for a in row)


def rotor_between(a, b):
    """The rotor in G(3) of the smallest rotation that takes the direction of a vector to that of another.

    It is ``1 + b a`` for unit vectors, normalised. Where they are nearly opposite, it is the product of two
    reflections: along ``a - b``, and along a vector orthogonal to `b` that is in the plane of both, if there is one.
    """
    axes = a.algebra.basis()
    a, b = ga.normalize(a), ga.normalize(b)
    half = 1 + b * a
    sum_squared = ga.norm_squared(a + b)
    x, y, z = (ga.absolute(c) for c in coordinates(b))
    flattest = ga.select(x <= ga.minimum(y, z), axes[0], ga.select(y <= z, axes[1], axes[2]))
    opposite, exactly = sum_squared < NEARLY_OPPOSITE, sum_squared < ROUNDING
    towards = ga.select(opposite, ga.select(exactly, flattest, a + b), flattest)
    fixing = ga.normalize(towards - ga.scalar_product(towards, b) * b)
    reflections = fixing * ga.normalize(ga.select(opposite, a - b, axes[0]))
    return ga.select(opposite, reflections, half / ga.sqrt(ga.select(opposite, 1, ga.norm_squared(half))))


def rotations_of_space(algebra, rotor, axes, components):
    """Rotors of space as quaternions and matrices.

    `rotor` gives that of the four numbers of a quaternion; `components` gives the three coordinates of one of the
    `axes` after a rotation.
    """
    family = Family("rotations of space")
    ROTOR, QUATERNION, MATRIX = algebra.ROTOR, array(SCALAR, 4), array(SCALAR, 3, 3)

    @family.kernel(q=QUATERNION, returns=ROTOR)
    def rotor_from_quaternion(q):
        """The rotor of a unit quaternion (w, x, y, z), scalar first: ``w - x e23 + y e13 - z e12``."""
        return rotor(*q)

    @family.kernel(r=ROTOR, returns=QUATERNION)
    def rotor_to_quaternion(r):
        """The unit quaternion (w, x, y, z), scalar first, of a rotor."""
        return r["1"], -r["e23"], r["e13"], -r["e12"]

    @family.kernel(matrix=MATRIX, returns=ROTOR)
    def rotor_from_matrix(matrix):
        """The rotor of a 3 x 3 rotation matrix, the one of two whose scalar part is not negative.

        All rotations, half turns among them, are equally accurate, and the result is a unit rotor also where the matrix
        is orthogonal only nearly. At an exact half turn both signs are right.
        """
        return rotor(*quaternion_of_matrix(matrix))

    @family.kernel(r=ROTOR, returns=MATRIX)
    def rotor_to_matrix(r):
        """The 3 x 3 matrix of a rotor, which acts on columns (x, y, z)."""
        return tuple(zip(*(components(r * axis * ~r) for axis in axes), strict=True))

    return family


def rotations_of_the_plane(algebra):
    """Rotors of the plane by their angles."""
    family = Family("rotations of the plane")
    e1, e2 = algebra.basis()[:2]

    @family.kernel(angle=SCALAR, returns=algebra.ROTOR)
    def rotor_from_angle(angle):
        """The rotation by an angle in radians, from e1 towards e2."""
        return ga.cos(angle / 2) - ga.sin(angle / 2) * e1 * e2

    return family
