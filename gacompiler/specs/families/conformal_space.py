"""Building blocks of definitions in conformal geometry: points, rounds and versors of any dimension."""

from fractions import Fraction
from functools import reduce
from operator import add, sub

import gacompiler as ga

NEARLY_ZERO = Fraction(1, 10**12)
"""Squares up to this value, relative to the squares of the operands, are treated as rounding errors."""
NEARLY_OPPOSITE = Fraction(-9, 10)
"""Objects with a cosine less than this value are nearly opposite: one of them is reversed first."""


class ConformalSpace:
    """Points, vectors and rounds of a conformal algebra with the basis ``e1 ... en e0 einf``.

    Parameters
    ----------
    algebra : Algebra
        `CGA2`, `CGA3` or another one with ``einf . e0 = -1`` and Euclidean ``e1 ... en``.

    Attributes
    ----------
    axes : tuple of Multivector
        The vectors ``e1 ... en``.
    names : tuple of str
        Their names.
    """

    def __init__(self, algebra):
        *axes, self.e0, self.einf = algebra.basis()
        self.algebra, self.axes, self.names = algebra, tuple(axes), algebra.vectors[:-2]

    def vector(self, x):
        """Return the Euclidean vector with the given coordinates."""
        return reduce(add, (number * axis for number, axis in zip(x, self.axes, strict=True)))

    def point(self, *x):
        """Return the point at the given coordinates."""
        square = reduce(add, (number * number for number in x))
        return self.vector(x) + self.e0 + square / 2 * self.einf

    def at(self, x):
        """Return the point at a Euclidean vector."""
        return self.point(*self.components(x))

    def components(self, x):
        """Return the coordinates of a vector or point, a tuple of numbers."""
        return tuple(x[name] for name in self.names)

    def coordinates(self, x):
        """Return the Euclidean part of a vector or point."""
        return self.vector(self.components(x))

    def weight(self, x):
        """Return the coefficient of e0, which is 1 for a normalised vector."""
        return -ga.scalar_product(self.einf, x)

    def normalized(self, x):
        """Return the point with weight 1 of a null vector."""
        weight = self.weight(x)
        return self.point(*(number / weight for number in self.components(x)))

    def centre(self, x):
        """Return the centre of a round: the point at infinity reflected in it."""
        return self.normalized((x * self.einf * x).grade(1))

    def radius_squared(self, x):
        """Return the squared radius of a round, negative for an imaginary one."""
        carrier = ga.left_contraction(self.einf, x)
        return ga.scalar_product(x, ga.grade_involution(x)) / ga.scalar_product(carrier, carrier)

    def sphere_parts(self, x):
        """Return centre and squared radius of a round of highest dimension, a circle of the plane or a sphere."""
        return self.coordinates(self.normalized(ga.polarity(x))), self.radius_squared(x)

    def pair(self, centre, direction, radius_squared):
        """Return the point pair from ``centre - radius direction`` to ``centre + radius direction``."""
        middle = self.at(centre) + radius_squared / 2 * self.einf
        return middle ^ (direction + dot(centre, direction) * self.einf)

    def pair_direction(self, pair):
        """Return the direction of a point pair, from the first point to the second, with the length of its weight."""
        return self._against(pair, "0")

    def line_direction(self, line):
        """Return the direction of a line, unnormalised, as its coefficients contain it."""
        return self._against(line, "0inf")

    def _against(self, x, ending):
        first, *others = (x[name + ending] for name in self.names)
        parts = (number * axis for number, axis in zip(others, self.axes[1:], strict=True))
        return reduce(sub, parts, -first * self.axes[0])

    def translator(self, t):
        """Return the translation by a Euclidean vector."""
        return 1 - t * self.einf / 2

    def dilator(self, scale):
        """Return the dilation about the origin by a positive factor."""
        return (1 + scale + (scale - 1) * (self.e0 ^ self.einf)) / (2 * ga.sqrt(scale))


def dot(a, b):
    """Return the inner product of two vectors."""
    return ga.scalar_product(a, b)


def length_of(a):
    """Return the length of a Euclidean vector."""
    return ga.sqrt(dot(a, a))


def distance_of_spheres(p, r, q, s):
    """Return the distance between two spheres or circles, 0 if they meet, from their centres and squared radii."""
    distance, r, s = length_of(q - p), ga.sqrt(r), ga.sqrt(s)
    return ga.maximum(0, ga.maximum(distance - r - s, ga.absolute(r - s) - distance))


def hit_ray(p, d, centre, square):
    """Return the least nonnegative `t` for which ``p + t d`` is on a circle of the plane or a sphere, or NaN."""
    towards, along = centre - p, dot(d, d)
    middle = dot(towards, d) / along
    beside = towards - middle * d
    half = ga.sqrt((square - dot(beside, beside)) / along)
    near, far = middle - half, middle + half
    return undefined_where(far < 0, ga.select(near >= 0, near, far))


def undefined_where(wrong, x):
    """Return `x`, or NaN where `wrong`."""
    return x * ga.sqrt(ga.select(wrong, -1, 1))


def vanishes(square, size):
    """Return whether a square is 0 up to a tolerance relative to `size`, which is a square as well."""
    return square <= NEARLY_ZERO**2 * size


def sign_of(value, size):
    """Return 1, 0 or -1; 0 up to a tolerance relative to `size`, NaN if `value` is NaN."""
    tolerance = NEARLY_ZERO * size
    small = ga.select(ga.absolute(value) <= tolerance, 0, ga.sqrt(ga.select(value < 0, -1, value)))
    return ga.select(value > tolerance, 1, ga.select(value < -tolerance, -1, small))


def kind_of_round(weight_squared, moved_squared, square):
    """Return the kind of a round.

    `square` is the square of the weight times the squared radius, `moved_squared` the square of the weight times that
    of the distance of the centre from the origin.
    """
    return ga.select(vanishes(weight_squared, moved_squared), 2, sign_of(square, moved_squared))


def unit_blade(x):
    """Return a blade divided by the root of the absolute value of its square."""
    return x / ga.sqrt(ga.absolute(ga.scalar_product(x, x)))


def inverse_square_root(s):
    """Return ``s**(-1/2)`` of the sum of a scalar and a 4-vector, the normalising factor of an even element."""
    scalar, four = s.grade(0), s.grade(4)
    number = scalar["1"]
    root = ga.sqrt(number * number - ga.scalar_product(four, four))
    return (number + root - four) / (root * ga.sqrt(2 * (number + root)))


def versor_between(a, b, turn):
    """Return the versor from `a` to `b`, unit objects of the same kind, where `turn` takes `a` to ``-a``.

    It is the square root of the ratio ``b a**-1``; nearly opposite objects are reversed first.
    """
    square = ga.scalar_product(a, a)
    ratio = b * a / square
    ratio = ratio.grade(0, 2, 4)
    opposite = ratio["1"] < NEARLY_OPPOSITE
    return _half_way(ga.select(opposite, -ratio, ratio)) * ga.select(opposite, turn, 1)


def _half_way(ratio):
    """Return the versor that takes `a` to `b`, the square root of the ratio ``b a**-1``."""
    sum_ = 1 + ratio
    return sum_ * inverse_square_root(2 + ratio + ~ratio)
