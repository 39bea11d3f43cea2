"""Macros of cga and cra: conformal points, spheres, versors, and the points of a pair."""

from __future__ import annotations

from typing import Any

from ...algebra.algebra import Algebra
from ...frontend.operations import inverse
from ..division import quotient
from ..values import absolute, cos, sin, sqrt
from .common import HALF, Table, basis, combination, dot, length, times, total, wedge


def conformal(algebra: Algebra) -> Table:
    """Return the macros of cga, or with two Euclidean vectors those of cra."""
    e = basis(algebra)
    e0, einf = e["e0"], e["einf"]
    flat = [vector for name, vector in e.items() if name not in ("e0", "einf")]
    n = len(flat)
    dual = times(inverse(wedge(*flat, einf, e0)))  # x / I; in five dimensions that is -x I

    def point(*components: Any) -> Any:
        square = total(*(c * c for c in components))
        return combination(flat, components) + HALF * square * einf + e0

    def points_of(pair: Any, sign: int) -> Any:
        """Return a point of an outer product of spheres: ``(d +- sqrt|p . p|) / (einf . d)``, d the dual of p."""
        other = dual(pair)
        root = sqrt(absolute(dot(pair, pair)))
        return quotient(other + sign * root, dot(einf, other))

    def sphere(centre: Any, radius: Any) -> Any:
        return dual(centre - HALF * radius * radius * einf)

    def translator(*components: Any) -> Any:
        return 1 - HALF * (combination(flat, components) * einf)

    table: Table = {
        ("Dual", 1): dual,
        ("VecN3", n): point,
        ("createPoint", n): point,
        ("SphereN3", 2): sphere,
        ("SphereN3", n + 1): lambda *a: sphere(point(*a[:-1]), a[-1]),
        ("TranslatorN3", n): translator,
        ("ExtractFirstPoint", 1): lambda pair: points_of(pair, 1),
        ("ExtractSecondPoint", 1): lambda pair: points_of(pair, -1),
        ("Normalize", 1): lambda x: quotient(-x, dot(x, einf)),
    }
    return table | (_in_space(flat) if n == 3 else _in_plane(point, dual, e0))


def _in_space(flat: list[Any]) -> dict[tuple[str, int], Any]:
    e1, e2, e3 = flat

    def rotor(x: Any, y: Any, z: Any, angle: Any) -> Any:
        plane = combination([wedge(e2, e3), wedge(e3, e1), wedge(e1, e2)], (x, y, z))
        return cos(HALF * angle) - sin(HALF * angle) * plane / length(x, y, z)

    return {("RotorN3", 4): rotor}


def _in_plane(point: Any, dual: Any, e0: Any) -> dict[tuple[str, int], Any]:
    def points_of(pair: Any, sign: int) -> Any:
        other = dual(pair)
        return quotient(other + sign * sqrt(dot(other, other)), dot(e0, other))

    return {
        # Viewers work in space: a third coordinate is accepted, but not used.
        ("VecN3", 3): lambda x, y, z: point(x, y) + 0 * z,
        ("createPoint", 3): lambda x, y, z: point(x, y) + 0 * z,
        ("extractPoint1", 1): lambda pair: points_of(pair, 1),
        ("extractPoint2", 1): lambda pair: points_of(pair, -1),
    }
