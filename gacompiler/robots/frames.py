"""Frames of the joints of a chain, exactly: vectors of rationals.

Frames are parallel to the base frame where every joint variable is 0, one for each joint, with an origin on the joint's
axis: most coordinates of the vectors between them vanish.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from ..algebra.catalog import PGA3
from ..algebra.multivector import Multivector
from .chains import Chain, exact

Vector = tuple[Fraction, Fraction, Fraction]

ZERO = (Fraction(0),) * 3
LINE = ("e23", "e31", "e12", "e01", "e02", "e03")
"""Basis lines: the coordinates of a direction, and of a moment."""
LENGTHS = 15
"""Decimals of coordinates in metres: those of a chain are rounded in the sixteenth."""


def dot(a: Sequence[Fraction], b: Sequence[Fraction]) -> Fraction:
    """The scalar product."""
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def cross(a: Sequence[Any], b: Sequence[Any]) -> tuple[Any, Any, Any]:
    """The vector product, of numbers or expressions."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def plus(a: Vector, b: Vector, factor: Fraction | int = 1) -> Vector:
    """``a + factor b``."""
    x, y, z = (p + factor * q for p, q in zip(a, b, strict=True))
    return x, y, z


def rounded(x: Fraction, digits: int = 17) -> Fraction:
    """Rounded to a number of decimals, which removes what sums of rounded decimals leave in place of 0."""
    return Fraction(round(x * 10**digits), 10**digits)


def line_of(d: Vector, m: Vector) -> Multivector:
    """The line with direction `d` and moment `m`."""
    return PGA3.multivector(dict(zip(LINE, (*d, *m), strict=True)))


def directions_and_moments(chain: Chain) -> list[tuple[Vector, Vector]]:
    """Direction and moment of each joint's axis."""
    found: list[tuple[Vector, Vector]] = []
    for axis in chain.axes:
        e12, e13, e23, *m = map(exact, axis)
        found.append(((e23, -e13, e12), (m[0], m[1], m[2])))
    return found


def origins(chain: Chain) -> list[Vector]:
    """A point on each axis: the one nearest to the origin of its parent, so that offsets have few coordinates."""
    points: list[Vector] = []
    for (d, m), parent in zip(directions_and_moments(chain), chain.parents, strict=True):
        before = points[parent] if parent >= 0 else ZERO
        foot = plus(cross(d, m), d, dot(d, before))
        x, y, z = (rounded(coordinate, LENGTHS) for coordinate in foot)
        points.append((x, y, z))
    return points
