"""Rotations of space as rotors, quaternions and matrices, and rotations of the plane by angles."""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, Family, array

NEARLY_OPPOSITE = Fraction(1, 10**8)
"""Unit vectors are nearly opposite if the square of their sum is less than this value."""
ROUNDING = Fraction(1, 10**28)
"""Squares less than this value are treated as rounding errors."""


def coordinates(v):
    """Return the coordinates of a vector of G(3)."""
    return v["e1"], v["e2"], v["e3"]


def choose(condition, these, those):
    """Return the numbers `these` where a condition holds, else `those`."""
    return tuple(ga.select(condition, a, b) for a, b in zip(these, those, strict=True))


def quaternion_of_matrix(t, is_proper=True):
    """Return the quaternion (w, x, y, z), with nonnegative w, of a rotation matrix.

    The row of the matrix ``4 q q^T`` of the quaternion q with the largest diagonal entry is normalised (Shepperd, *J.
    Guidance and Control* 1:223, 1978). Reflections and singular matrices give a quaternion too; `is_proper` is the
    condition under which it is not NaN.
    """
    x, y, z = t[2][1] - t[1][2], t[0][2] - t[2][0], t[1][0] - t[0][1]
    xy, xz, yz = t[0][1] + t[1][0], t[0][2] + t[2][0], t[1][2] + t[2][1]
    ww, xx = 1 + t[0][0] + t[1][1] + t[2][2], 1 + t[0][0] - t[1][1] - t[2][2]
    yy, zz = 1 - t[0][0] + t[1][1] - t[2][2], 1 - t[0][0] - t[1][1] + t[2][2]
    upper = choose(xx <= ww, (ww, x, y, z), (x, xx, xy, xz))
    lower = choose(zz <= yy, (y, xy, yy, yz), (z, xz, yz, zz))
    row = choose(ga.maximum(yy, zz) <= ga.maximum(ww, xx), upper, lower)
    squared = sum(a * a for a in row)
    factor = ga.select(row[0] < 0, -1, 1) / ga.sqrt(squared if is_proper is True else ga.select(is_proper, squared, -1))
    return tuple(factor * a for a in row)


def quaternion_of_motion(t):
    """Return `quaternion_of_matrix`, NaN if the determinant of the first three rows and columns is not positive."""
    minors = (t[1][i] * t[2][j] - t[1][j] * t[2][i] for i, j in ((1, 2), (2, 0), (0, 1)))
    return quaternion_of_matrix(t, sum(t[0][k] * minor for k, minor in enumerate(minors)) > 0)


def direction_of_matrix(t):
    """Return multiples of the cosine and the sine of the rotation of the plane that is nearest to a 2 x 2 matrix.

    Both are 0 if the determinant is not positive.
    """
    is_proper = t[0][0] * t[1][1] - t[0][1] * t[1][0] > 0
    return (ga.select(is_proper, part, 0) for part in (t[0][0] + t[1][1], t[1][0] - t[0][1]))


def rotor_between(a, b):
    """Return the rotor in G(3) of the smallest rotation that takes the direction of one vector to that of another.

    It is ``1 + b a`` for unit vectors, normalised. If they are nearly opposite, it is the product of two reflections:
    along ``a - b``, and along a vector orthogonal to `b` that is in the plane of both, if that plane is defined.
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
    """Declare conversions of rotors of space to quaternions and matrices.

    `rotor` constructs a rotor from the four numbers of a quaternion; `components` extracts the three coordinates of one
    of the `axes` after a rotation.
    """
    family = Family("rotations of space")
    ROTOR, QUATERNION, MATRIX = algebra.ROTOR, array(SCALAR, 4), array(SCALAR, 3, 3)

    @family.kernel(q=QUATERNION, returns=ROTOR)
    def rotor_from_quaternion(q):
        """Convert a unit quaternion (w, x, y, z), scalar first, to a rotor: ``w - x e23 + y e13 - z e12``."""
        return rotor(*q)

    @family.kernel(r=ROTOR, returns=QUATERNION)
    def rotor_to_quaternion(r):
        """Convert a rotor to a unit quaternion (w, x, y, z), scalar first."""
        return r["1"], -r["e23"], r["e13"], -r["e12"]

    @family.kernel(matrix=MATRIX, returns=ROTOR)
    def rotor_from_matrix(matrix):
        """Convert a 3 x 3 rotation matrix to the rotor with nonnegative scalar part.

        All rotations, including half turns, are equally accurate, and the result is a unit rotor even if the matrix is
        only nearly orthogonal. If its determinant is not positive, as that of a reflection, the result is NaN. At an
        exact half turn both signs are correct.
        """
        return rotor(*quaternion_of_motion(matrix))

    @family.kernel(r=ROTOR, returns=MATRIX)
    def rotor_to_matrix(r):
        """Compute the 3 x 3 matrix of a rotor, which acts on columns (x, y, z)."""
        return tuple(zip(*(components(r * axis * ~r) for axis in axes), strict=True))

    return family


def rotations_of_the_plane(algebra):
    """Declare rotors of the plane from angles."""
    family = Family("rotations of the plane")
    e1, e2 = algebra.basis()[:2]

    @family.kernel(angle=SCALAR, returns=algebra.ROTOR)
    def rotor_from_angle(angle):
        """Construct the rotation by an angle in radians, from e1 towards e2."""
        return ga.cos(angle / 2) - ga.sin(angle / 2) * e1 * e2

    return family
