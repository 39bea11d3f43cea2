"""Frames of the joints of a chain, exactly: vectors of rationals.

Frames are parallel to the base frame where every joint variable is 0, one for each joint, with an origin on the joint's
axis: most coordinates of the vectors between them vanish.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from .chains import Chain, exact

Vector = tuple[Fraction, Fraction, Fraction]

ZERO = (Fraction(0),) * 3


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


def rounded(x: Fraction) -> Fraction:
    """Rounded to 17 decimals, which removes what sums of rounded decimals leave in place of 0."""
    return Fraction(round(x * 10**17), 10**17)


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
        points.append((rounded(foot[0]), rounded(foot[1]), rounded(foot[2])))
    return points
