"""Frames of the joints of a chain in exact rational coordinates.

Each joint has a frame whose origin is on the axis of the joint, parallel to the base frame when all joint variables are
0. With this choice, most coordinates of the vectors between the origins vanish.
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
"""Basis lines: the coordinates of the direction and of the moment of a line."""
LENGTHS = 15
"""Number of decimals of coordinates in metres: the numbers of a chain have rounding errors in the sixteenth."""


def dot(a: Sequence[Fraction], b: Sequence[Fraction]) -> Fraction:
    """Return the scalar product."""
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def cross(a: Sequence[Any], b: Sequence[Any]) -> tuple[Any, Any, Any]:
    """Return the cross product of vectors of numbers or expressions."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def plus(a: Vector, b: Vector, factor: Fraction | int = 1) -> Vector:
    """Return ``a + factor b``."""
    x, y, z = (p + factor * q for p, q in zip(a, b, strict=True))
    return x, y, z


def rounded(x: Fraction, digits: int = 17) -> Fraction:
    """Round to a number of decimals, so that differences that should be 0 vanish in spite of rounded decimals."""
    return Fraction(round(x * 10**digits), 10**digits)


def line_of(d: Vector, m: Vector) -> Multivector:
    """Return the line with direction `d` and moment `m`."""
    return PGA3.multivector(dict(zip(LINE, (*d, *m), strict=True)))


def directions_and_moments(chain: Chain) -> list[tuple[Vector, Vector]]:
    """Return the direction and the moment of the axis of each joint."""
    found: list[tuple[Vector, Vector]] = []
    for axis in chain.axes:
        e12, e13, e23, *m = map(exact, axis)
        found.append(((e23, -e13, e12), (m[0], m[1], m[2])))
    return found


def origins(chain: Chain) -> list[Vector]:
    """Return the point on each axis that is nearest to the origin of its parent: offsets then have few coordinates."""
    points: list[Vector] = []
    for (d, m), parent in zip(directions_and_moments(chain), chain.parents, strict=True):
        before = points[parent] if parent >= 0 else ZERO
        foot = plus(cross(d, m), d, dot(d, before))
        x, y, z = (rounded(coordinate, LENGTHS) for coordinate in foot)
        points.append((x, y, z))
    return points
