"""Macros of qga (G(6,3), quadrics of space) and gac (G(5,3), conics of the plane).

qga: J. Zamora-Esquivel, *Adv. Appl. Clifford Algebras* 24, 2014. gac: J. Hrdina, A. Návrat & P. Vašík, *Geometric
Algebra for Conics*, ibid. 28, 2018.
"""

from __future__ import annotations

from typing import Any

from ...algebra.algebra import Algebra
from ...algebra.operations import Operation
from ...frontend.expression import node
from ...frontend.operations import inverse
from ..values import acos, cos, sin, sqrt
from .common import HALF, Table, basis, combination, dot, times, total, wedge

DEGREE = 180
"""Rotations of gac are in degrees."""


def _weight(a: Any) -> Any:
    """Return the inverse square of a semi-axis, which must be a scalar."""
    return node(Operation.DIVIDE, 1, a * a)


def quadrics(algebra: Algebra) -> Table:
    """Return the macros of qga: every Euclidean axis has a null pair of its own."""
    e = basis(algebra)
    flat = [e["e1"], e["e2"], e["e3"]]
    far, near = [e["einfx"], e["einfy"], e["einfz"]], [e["e0x"], e["e0y"], e["e0z"]]
    e0, einf = total(*near), total(*far) / 3

    def point(x: Any, y: Any, z: Any) -> Any:
        return combination(flat, (x, y, z)) + HALF * combination(far, (x * x, y * y, z * z)) + e0

    def quadric(weights: tuple[Any, ...], centre: tuple[Any, ...], constant: Any) -> Any:
        """Return the zero set of ``sum w (x - c)**2 - constant``."""
        inner = total(*(w * c * c for w, c in zip(weights, centre, strict=True))) - constant
        moved = tuple(w * c for w, c in zip(weights, centre, strict=True))
        k = len(weights)
        return combination(flat[:k], moved) + HALF * inner * einf + combination(near[:k], weights)

    def sphere(x: Any, y: Any, z: Any, r: Any) -> Any:
        return quadric((1, 1, 1), (x, y, z), r * r)

    def ellipsoid(a: Any, b: Any, c: Any, x: Any, y: Any, z: Any) -> Any:
        return quadric(tuple(map(_weight, (a, b, c))), (x, y, z), 1)

    return {
        ("e0", 0): lambda: e0,
        ("einf", 0): lambda: einf,
        ("ds", 1): lambda x: dot(x, wedge(*flat, *far, e0)),
        ("sd", 1): lambda x: dot(x, wedge(*flat, *near, einf)),
        ("createPoint", 3): point,
        ("createEllipsoid", 6): ellipsoid,
        ("createSphere", 4): sphere,
        ("createCylinder", 4): lambda a, b, x, y: quadric((_weight(a), _weight(b)), (x, y), 1),
    }


def conics(algebra: Algebra) -> Table:
    """Return the macros of gac: the three null pairs represent x**2 + y**2, x**2 - y**2 and x y."""
    e = basis(algebra)
    e1, e2 = e["e1"], e["e2"]
    near, far = [e["e0p"], e["e0m"], e["e0c"]], [e["einfp"], e["einfm"], e["einfc"]]
    (np, nm, nc), (fp, fm, fc) = near, far

    def axes(p: Any, m: Any, c: Any) -> Any:
        return p * np + m * nm + c * fp

    def rotor(degrees: Any) -> Any:
        t = pi() / DEGREE * degrees
        first = cos(HALF * t) - sin(HALF * t) * wedge(e1, e2)
        return wedge(cos(t) + sin(t) * wedge(nm, fc), cos(t) - sin(t) * wedge(nc, fm)) * first

    def translator(d: Any, along: Any, across: Any, sign: int) -> Any:
        p = 1 - HALF * d * wedge(along, fp)
        m = 1 - sign * HALF * d * wedge(along, fm) + sign * HALF * HALF * d * d * wedge(fp, fm)
        return p * m * (1 - HALF * d * wedge(across, fc))

    def dilator(a: Any) -> Any:
        root = 2 * sqrt(a)
        parts = [(a + 1) / root + (a - 1) / root * wedge(n, f) for n, f in zip(near, far, strict=True)]
        return parts[0] * parts[1] * parts[2]

    return {
        ("createPoint", 3): lambda x, y, z: _conic_point(e, x, y) + 0 * z,
        ("createPoint", 2): lambda x, y: _conic_point(e, x, y),
        ("Dual", 1): times(inverse(wedge(*near, e1, e2, *far))),
        ("DualIO", 1): lambda x: dot(x, wedge(np, e1, e2, fp, fm, fc)),
        ("DualOI", 1): lambda x: dot(x, wedge(np, nm, nc, e1, e2, fp)),
        ("Ellipse", 2): lambda a, b: axes(a * a + b * b, b * b - a * a, -(a * a * b * b)),
        ("Hyperbola", 2): lambda a, b: axes(a * a - b * b, -(a * a + b * b), a * a * b * b),
        ("Parabola", 1): lambda p: np + nm + p * e2,
        ("Circle", 3): lambda x, y, r: x * e1 + y * e2 + HALF * (x * x + y * y - r * r) * fp + np,
        ("Rotor", 1): rotor,
        ("TranslatorX", 1): lambda d: translator(d, e1, e2, 1),
        ("TranslatorY", 1): lambda d: translator(d, e2, e1, -1),
        ("Dilator", 1): dilator,
    }


def _conic_point(e: dict[str, Any], x: Any, y: Any) -> Any:
    squares = HALF * (x * x + y * y) * e["einfp"] + HALF * (x * x - y * y) * e["einfm"]
    return e["e0p"] + x * e["e1"] + y * e["e2"] + squares + x * y * e["einfc"]


def pi() -> Any:
    """Return the number pi as an expression, so that its precision is chosen at evaluation."""
    return acos(-1)
