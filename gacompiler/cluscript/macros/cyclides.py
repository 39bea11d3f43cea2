"""Macros of dcga, G(8,2): quadrics, tori and cyclides as bivectors of two copies of conformal space.

R. B. Easter & E. Hitzer, *Double Conformal Geometric Algebra*, Adv. Appl. Clifford Algebras 27, 2017. An entity is a
sum of operators ``T`` that each read one monomial from a point ``p``: ``p . Txy`` is x y.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ...algebra.algebra import Algebra
from ...frontend.operations import anticommutator, commutator
from ..division import quotient
from ..values import cos, sin, sqrt
from .common import HALF, Table, basis, combination, dot, length, total, wedge
from .quadrics import DEGREE, pi

AXES = "xyz"


class _Copy:
    """One of the two conformal spaces."""

    def __init__(self, flat: list[Any], origin: Any, infinity: Any) -> None:
        self.flat, self.origin, self.infinity = flat, origin, infinity
        self.volume = wedge(*flat)

    def vector(self, *components: Any) -> Any:
        return combination(self.flat, components)

    def unit(self, *components: Any) -> Any:
        return self.vector(*components) / length(*components)

    def dual(self, x: Any) -> Any:
        return -dot(x, self.volume)

    def point(self, x: Any, y: Any, z: Any) -> Any:
        return self.vector(x, y, z) + HALF * (x * x + y * y + z * z) * self.infinity + self.origin

    def sphere(self, x: Any, y: Any, z: Any, r: Any) -> Any:
        return self.point(x, y, z) - HALF * r * r * self.infinity

    def plane(self, x: Any, y: Any, z: Any, d: Any) -> Any:
        return self.unit(x, y, z) + d * self.infinity

    def line(self, px: Any, py: Any, pz: Any, x: Any, y: Any, z: Any) -> Any:
        plane = self.dual(self.unit(x, y, z))
        return plane - dot(self.vector(px, py, pz), plane) * self.infinity

    def rotor(self, x: Any, y: Any, z: Any, degrees: Any) -> Any:
        t = pi() / DEGREE * degrees
        return cos(HALF * t) + sin(HALF * t) * self.dual(self.unit(x, y, z))

    def dilator(self, d: Any) -> Any:
        return HALF * (1 + d) + HALF * (1 - d) * wedge(self.infinity, self.origin)

    def translator(self, x: Any, y: Any, z: Any) -> Any:
        return 1 - HALF * self.vector(x, y, z) * self.infinity

    def normalized(self, x: Any) -> Any:
        return quotient(x, -dot(x, self.infinity))

    def projected(self, x: Any) -> Any:
        return -dot(dot(self.normalized(x), self.volume), self.volume)


def cyclides(algebra: Algebra) -> Table:
    """Return the macros of dcga."""
    e = basis(algebra)
    first = _Copy([e["e1"], e["e2"], e["e3"]], e["eo1"], e["ei1"])
    second = _Copy([e["e6"], e["e7"], e["e8"]], e["eo2"], e["ei2"])
    t = _operators(first, second)
    return _constants(t, first, second) | _versors(first, second) | _points(first, second) | _surfaces(t)


def _operators(a: _Copy, b: _Copy) -> dict[str, Any]:
    """Return the operators by their monomials: x, xx, xy, xt2 (x times the square of the distance), 1, t2, t4."""
    t = {"1": -wedge(a.infinity, b.infinity), "t4": -4 * wedge(a.origin, b.origin)}
    t["t2"] = wedge(b.origin, a.infinity) + wedge(b.infinity, a.origin)
    for name, u, v in zip(AXES, a.flat, b.flat, strict=True):
        t[name] = HALF * (wedge(u, b.infinity) + wedge(a.infinity, v))
        t[name * 2] = wedge(v, u)
        t[f"{name}t2"] = wedge(u, b.origin) + wedge(a.origin, v)
    for j, k in ((0, 1), (1, 2), (2, 0)):
        t[AXES[j] + AXES[k]] = HALF * (wedge(b.flat[k], a.flat[j]) + wedge(b.flat[j], a.flat[k]))
    return t


def _constants(t: dict[str, Any], a: _Copy, b: _Copy) -> Table:
    derivatives = [quotient(2 * t[name], t[name * 2]) for name in AXES]
    integrals = [quotient(t[f"{name}t2"], t[name * 2]) / 2 for name in AXES]
    ends = [(wedge(c.volume, HALF * c.infinity - c.origin, HALF * c.infinity + c.origin)) for c in (a, b)]
    everything = wedge(*ends)
    values = {f"T{name}": value for name, value in t.items()}
    values |= {f"D{name}": value for name, value in zip(AXES, derivatives, strict=True)}
    values |= {f"I{name}": value for name, value in zip(AXES, integrals, strict=True)}
    values |= {"eo": wedge(a.origin, b.origin), "ei": wedge(a.infinity, b.infinity), "IE1": a.volume, "IE2": b.volume}
    values |= {"IC1": ends[0], "IC2": ends[1], "ID": everything}

    def constant(value: Any) -> Callable[[], Any]:
        return lambda: value

    def along(parts: list[Any]) -> Callable[..., Any]:
        return lambda x, y, z: combination(parts, (x, y, z)) / length(x, y, z)

    return {(name, 0): constant(value) for name, value in values.items()} | {
        ("Dn", 3): along(derivatives),
        ("In", 3): along(integrals),
        ("com", 2): commutator,
        ("acom", 2): anticommutator,
        ("DD", 1): lambda x: -dot(x, everything),
        ("Dual", 1): lambda x: -dot(x, everything),
        ("C1D", 1): lambda x: -dot(x, ends[0]),
        ("C2D", 1): lambda x: -dot(x, ends[1]),
        ("E1D", 1): a.dual,
        ("E2D", 1): b.dual,
    }


def _both(name: str, arity: int, a: Callable[..., Any], b: Callable[..., Any], whole: str = "") -> Table:
    """Return the macros of one copy, of the other, and of their outer product."""
    return {
        (f"CGA1_{name}", arity): a,
        (f"CGA2_{name}", arity): b,
        (whole or name, arity): lambda *x: wedge(a(*x), b(*x)),
    }


def _versors(a: _Copy, b: _Copy) -> Table:
    table: Table = {}
    for name, arity in (("Rotor", 4), ("Dilator", 1), ("Translator", 3), ("Sphere", 4), ("Plane", 4), ("Line", 6)):
        table |= _both(name, arity, getattr(a, name.lower()), getattr(b, name.lower()))
    return table


def _points(a: _Copy, b: _Copy) -> Table:
    def point(*x: Any) -> Any:
        return wedge(a.point(*x), b.point(*x))

    def normalized(x: Any) -> Any:
        return x / sqrt(dot(x, x))

    infinity = wedge(a.infinity, b.infinity)
    table: Table = {
        ("DCGA_Point", 3): point,
        ("EV1", 3): a.point,
        ("EV2", 3): b.point,
        ("EV", 3): point,
        ("Normalize", 1): normalized,
        ("Deg2Rad", 1): lambda degrees: degrees * pi() / DEGREE,
        ("Normalize_CGA1_Point", 1): a.normalized,
        ("Normalize_CGA2_Point", 1): b.normalized,
        ("Normalize_DCGA_Point", 1): lambda x: quotient(x, -dot(x, infinity)),
        ("PV1", 1): a.projected,
        ("PV2", 1): b.projected,
        ("PV", 1): lambda x: a.projected(dot(x, b.infinity)),
    }
    return _both("Point", 3, a.point, b.point, "createPoint") | table


QUADRICS = {
    "Ellipsoid": ("+++", "", -1),
    "CylinderX": ("0++", "", -1), "CylinderY": ("+0+", "", -1), "CylinderZ": ("++0", "", -1),
    "ConeX": ("-++", "", 0), "ConeY": ("+-+", "", 0), "ConeZ": ("++-", "", 0),
    "ParaboloidX": ("0++", "x", 0), "ParaboloidY": ("+0+", "y", 0), "ParaboloidZ": ("++0", "z", 0),
    "HParaboloidZ": ("+-0", "z", 0), "Hyperboloid1": ("++-", "", -1), "Hyperboloid2": ("--+", "", -1),
    "PCylinderX": ("0+0", "z", 0), "PCylinderY": ("+00", "z", 0), "PCylinderZ": ("+00", "y", 0),
    "HCylinderX": ("0+-", "", -1), "HCylinderY": ("-0+", "", -1), "HCylinderZ": ("+-0", "", -1),
}  # fmt: skip
"""Of the squares of ``(x - px) / rx`` the signs; the axis of which the first power is subtracted; what is added."""
CROSSED = {"X": "yz", "Y": "zx", "Z": "xy"}
"""Pairs of planes: the square of the first less that of the second."""


def _surfaces(t: dict[str, Any]) -> Table:
    def square(axis: str, p: Any, r: Any) -> Any:
        return (t[axis * 2] - 2 * p * t[axis] + p * p * t["1"]) / (r * r)

    def quadric(signs: str, linear: str, constant: int) -> Callable[..., Any]:
        def function(*arguments: Any) -> Any:
            p, r = dict(zip(AXES, arguments[:3], strict=True)), dict(zip(AXES, arguments[3:], strict=True))
            terms = [square(x, p[x], r[x]) * int(f"{s}1") for x, s in zip(AXES, signs, strict=True) if s != "0"]
            terms += [(p[linear] * t["1"] - t[linear]) / r[linear]] if linear else []
            return total(*terms, constant * t["1"]) if constant else total(*terms)

        return function

    def crossed(axes: str) -> Callable[..., Any]:
        def function(*arguments: Any) -> Any:
            ordered = "".join(sorted(axes))
            p, r = dict(zip(ordered, arguments[:2], strict=True)), dict(zip(ordered, arguments[2:], strict=True))
            return square(axes[0], p[axes[0]], r[axes[0]]) - square(axes[1], p[axes[1]], r[axes[1]])

        return function

    def parallel(axis: str) -> Callable[..., Any]:
        return lambda p, q: t[axis * 2] - (p + q) * t[axis] + p * q * t["1"]

    def toroid(major: Any, minor: Any) -> Any:
        d = major * major - minor * minor
        return t["t4"] + 2 * d * t["t2"] + d * d * t["1"] - 4 * major * major * (t["xx"] + t["yy"])

    def cyclide(a: Any, u: Any, c: Any) -> Any:
        b = a * a - c * c
        d = b - u * u
        plain = t["t4"] + 2 * d * t["t2"] - 4 * a * a * t["xx"] - 4 * b * t["yy"]
        return plain + 8 * a * c * u * t["x"] + (d * d - 4 * c * c * u * u) * t["1"]

    def vertex(*p: Any) -> Any:
        squares = total(*(x * x for x in p)) * t["1"] + t["xx"] + t["yy"] + t["zz"]
        return total(*(x * t[name] for name, x in zip(AXES, p, strict=True))) - HALF * squares

    solids: Table = {("Toroid", 2): toroid, ("vertex", 3): vertex}
    return (
        {(name, 6): quadric(*what) for name, what in QUADRICS.items()}
        | solids
        | {(f"PPlanes{axis.upper()}", 2): parallel(axis) for axis in AXES}
        | {(f"XPlanes{axis}", 4): crossed(axes) for axis, axes in CROSSED.items()}
        | {
            ("DupinCyclide", 3): lambda a, r, s: cyclide(a, HALF * (r + s), HALF * (r - s)),
            ("hornedDupinCyclide", 3): lambda a, r, s: cyclide(a, HALF * (r - s), HALF * (r + s)),
        }
    )
