"""Scripts of Gaalop's language: their results by arrays, C, numba and the algebra layer, and errors of invalid scripts.

Every file of `cluscript` names its algebra in its first line. Expected results are closed forms in coordinates and
products of multivectors.
"""

from __future__ import annotations

import math
import random
import re
from collections.abc import Callable, Iterable
from fractions import Fraction
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from selection import some_slow
from unmeasured import errors_are_not_measured

import gacompiler
from gacompiler import Multivector, read_cluscript
from gacompiler.algebra.catalog import CGA2, CGA3, GAC, PGA2, PGA3, STA, VGA2, VGA3
from gacompiler.algebra.versors import inverse
from gacompiler.backends import build_library
from gacompiler.backends.module import ModuleSource
from gacompiler.cli import main
from gacompiler.cluscript import NAMES, Script, ScriptError
from gacompiler.errors import SpecError
from gacompiler.generation.files import write
from gacompiler.generation.rendering import render
from gacompiler.generation.sources import kernel_source
from gacompiler.generation.spec_files import load_spec
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.passes.record import Compilation
from gacompiler.runtime import load_module
from tests.support.all_cases import all_cases
from tests.support.unoptimised import without_optimisation

FOLDER = Path(__file__).parent / "scripts"
FILES = {path.stem: path for path in sorted(FOLDER.glob("*.clu"))}
REFUSED = {path.stem: path for path in sorted((FOLDER / "refused").glob("*.clu"))}
INPUTS: dict[str, dict[str, float]] = {
    "gps": {
        "sat1x": 0.0, "sat1y": 0.0, "sat1z": 0.0, "sat2x": 3.0, "sat2y": 0.5, "sat2z": 0.0, "sat3x": 0.5, "sat3y": 2.5,
        "sat3z": 0.3, "d1": 2.0, "d2": 2.2, "d3": 1.9,
    },
    "pair": {"r": 1.5, "c": 1.2}, "circles_2d": {"r": 1.5, "d": 1.2}, "plane_sphere": {"h": 0.5, "r": 1.3},
    "boost": {"cosh2": math.cosh(0.3), "sinh2": math.sinh(0.3), "t": 1.5, "x": 0.4},
    "circle_2d": {"ax": 0.0, "ay": 0.3, "bx": 1.5, "by": 0.2, "cx": 0.4, "cy": 1.7},
}  # fmt: skip


def algebra_of(path: Path) -> str:
    name = path.read_text().split()[1]
    return str(FOLDER / name) if (FOLDER / name).is_dir() else name


def script(name: str) -> Script:
    return read_cluscript(FILES[name].read_text(), algebra_of(FILES[name]), name, f"{name}.clu")


def inputs_of(one: Script) -> dict[str, float]:
    """Reproducible numbers for the inputs of a script."""
    given = INPUTS.get(one.name, {})
    return {name: given.get(name, random.Random(name).randint(20, 90) / 64) for name in one.inputs}


LARGE = ("conic_versors", "dcga_quadrics", "dcga_versors", "gps", "long_sum")
"""Scripts that take as long to compile as all others together."""
COMPILED = ("constant", "functions", "macro_outputs", "names", "pragma_output")
"""Small scripts that are run by C and numba too, which take their time to compile."""


@cache
def compiled(name: str) -> tuple[Script, Compilation]:
    """Small scripts without a search for cheaper programs, which the large ones and the random ones have."""
    one = script(name)
    return one, compile_kernel(one, effort=int(name in LARGE))


def modules_of(names: Iterable[str], module: str, folder: Path, *backends: str) -> dict[str, ModuleType]:
    """Scripts in one module, run by each of the backends; without a compiler, not by C."""
    with errors_are_not_measured():
        sources = tuple(kernel_source(compiled(name)[1]) for name in names)
    write(render(ModuleSource(module, "Scripts.", "gac generate", "", sources)), folder)
    with without_optimisation():
        missing = "c" if "c" in backends and build_library(folder / f"{module}.c") is None else ""
    return {
        backend: load_module(folder / f"{module}.py", f"_{module}_{backend}", backend)
        for backend in backends
        if backend != missing
    }


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ModuleType]:
    folder, names = tmp_path_factory.mktemp("scripts"), [name for name in FILES if name not in LARGE]
    return modules_of(COMPILED, "few", folder, "c", "numba") | modules_of(names, "small", folder, "arrays")


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ModuleType]:
    return modules_of(LARGE, "large", tmp_path_factory.mktemp("scripts"), "c", "arrays")


def blades_of(layout: Any) -> tuple[str, ...]:
    return layout.blades or ("1",)


def as_dict(values: Any, layout: Any) -> dict[str, float]:
    return dict(zip(blades_of(layout), np.atleast_1d(values).tolist(), strict=True))


# Expected results: each function maps the inputs to the value of every output, a multivector or a number.

Truth = Callable[..., dict[str, Any]]
TRUTH: dict[str, Truth] = {}


def truth(function: Truth) -> Truth:
    TRUTH[function.__name__] = function
    return function


E2, E3, P2, P3, C3, C2 = (
    dict(zip(algebra.vectors, algebra.basis(), strict=True)) for algebra in (VGA2, VGA3, PGA2, PGA3, CGA3, CGA2)
)
a1, a2 = E2.values()
b1, b2, b3 = E3.values()
c1, c2, c3, o, inf = C3.values()
p1, p2, p3, p0 = P3.values()
l1, l2, l0 = P2.values()
I3 = b1 * b2 * b3


def vector(*x: float) -> Multivector:
    return x[0] * b1 + x[1] * b2 + x[2] * b3


def point(x: float, y: float, z: float) -> Multivector:
    return x * c1 + y * c2 + z * c3 + (x * x + y * y + z * z) / 2 * inf + o


def point2(x: float, y: float) -> Multivector:
    return CGA2.multivector({"e1": x, "e2": y, "einf": (x * x + y * y) / 2, "e0": 1})


def pga_point(x: float, y: float, z: float) -> Multivector:
    return PGA3.multivector({"e032": x, "e013": y, "e021": z, "e123": 1})


@truth
def add() -> dict[str, Any]:
    return {"c": 3}


@truth
def basis() -> dict[str, Any]:
    return {"m": CGA3.multivector({"e1": 1, "e0": 2, "e12": 3})}


@truth
def products() -> dict[str, Any]:
    e12 = CGA3.multivector({"e12": 1})
    return {"g": 1, "o": e12, "i": 1, "r": -e12, "n": -1, "s": c2 - c1}


@truth
def priorities(x: float, y: float) -> dict[str, Any]:
    return {
        "a": -inf, "b": -inf, "c": x - y + 2 * x * y, "d": 2, "f": CGA3.multivector({"e12": -x}),
        "g": CGA3.multivector({"e123": 1}), "h": (-1 * c1 * (c1 ^ c2 ^ c3 ^ inf ^ o)) ^ c2,
        "k": x * x * y / 2, "l": -y - 1, "m": c2,
    }  # fmt: skip


@truth
def inner_product(x: float, y: float) -> dict[str, Any]:
    return {"z": 0, "v": x * b2 - y * b1, "t": -1 * b1, "u": x * y}


@truth
def complex_numbers(a: float, b: float, c: float, d: float) -> dict[str, Any]:
    z, w = a + 1j * b, c + 1j * d
    return {k: VGA2.multivector({"1": v.real, "e12": v.imag}) for k, v in (("p", z * w), ("q", z / w))}


@truth
def dual_3d(x: float, y: float) -> dict[str, Any]:
    return {"d": -1 * (x * b1 + y * b2) * I3, "v": -1 * (x * b1 * b2 + y * b2 * b3) * I3, "twice": -1 * b1}


@truth
def cross(**k: float) -> dict[str, Any]:
    found = np.cross([k["ax"], k["ay"], k["az"]], [k["bx"], k["by"], k["bz"]])
    return {"c": vector(*found.tolist())}


def turned(x: float, y: float, t: float) -> tuple[float, float]:
    return x * math.cos(t) - y * math.sin(t), x * math.sin(t) + y * math.cos(t)


@truth
def rotate_3d(t: float, x: float, y: float, z: float) -> dict[str, Any]:
    return {"v": vector(*turned(x, y, t), z)}


@truth
def reflect(nx: float, ny: float, nz: float, x: float, y: float, z: float) -> dict[str, Any]:
    n, v = np.array([nx, ny, nz]), np.array([x, y, z])
    return {"r": vector(*(v - 2 * (v @ n) / (n @ n) * n).tolist())}


@truth
def inverse_(a: float, b: float, c: float) -> dict[str, Any]:
    n = a * a + b * b + c * c
    return {"i": VGA3.multivector({"1": a / n, "e12": -b / n, "e23": -c / n}), "one": 1}


TRUTH["inverse"] = TRUTH.pop("inverse_")


@truth
def literals() -> dict[str, Any]:
    return {"a": 1, "b": 0.5, "c": 1e-3, "d": 2, "f": 3, "g": 150, "h": 20, "k": 7}


@truth
def comments(x: float) -> dict[str, Any]:
    return {"a": x + 1, "c": 2 * x}


@truth
def long_sum(x: float) -> dict[str, Any]:
    return {"s": 1200 * x}


@truth
def line_2d(ax: float, ay: float, bx: float, by: float) -> dict[str, Any]:
    """A line ``a e1 + b e2 + c e0`` is ``a x + b y + c = 0``; the point on x = 1 by the rule of three."""
    a, b, c = ay - by, bx - ax, ax * by - bx * ay
    line = a * l1 + b * l2 + c * l0
    return {"l": line, "n": line / math.hypot(a, b), "X": line ^ (l1 - l0)}


@truth
def dual_2dpga() -> dict[str, Any]:
    blades = {"e012": 1, "e12": 2, "e20": 3, "e01": 4, "e2": 5, "e1": 6, "e0": 7, "1": 8}
    return {"d": PGA2.multivector(blades), "r": PGA2.multivector({"e01": -1, "e2": 1})}


@truth
def turn_2d(cx: float, cy: float, angle: float, x: float, y: float) -> dict[str, Any]:
    dx, dy = turned(x - cx, y - cy, -angle)
    return {"q": PGA2.multivector({"e12": 1, "e20": cx + dx, "e01": cy + dy})}


@truth
def join_3d(**k: float) -> dict[str, Any]:
    """Pluecker coordinates: direction b - a, moment a x b; a plane through the line and the point (0, 0, 1)."""
    a, b, c = (np.array([k.get(n + axis, 0.0) for axis in "xyz"]) for n in "abc")
    c = np.array([0.0, 0.0, 1.0])
    d, m = (b - a), np.cross(a, b)
    line = {"e23": d[0], "e31": d[1], "e12": d[2], "e01": m[0], "e02": m[1], "e03": m[2]}
    line = {name: float(x) for name, x in line.items()}
    n = np.cross(b - a, c - a)
    # As the dual is its own inverse, a plane comes with the sign that three points on the axes give: -e3 for x and y.
    plane = {"e1": -n[0], "e2": -n[1], "e3": -n[2], "e0": n @ a}
    length = float(np.linalg.norm(d))
    return {
        "l": PGA3.multivector(line),
        "u": PGA3.multivector({name: x / length for name, x in line.items()}),
        "p": PGA3.multivector({name: float(x) for name, x in plane.items()}),
    }


@truth
def motor_3d(t: float, d: float, x: float, y: float, z: float) -> dict[str, Any]:
    u, v = turned(x, y, -t)
    return {"q": pga_point(u + d, v, z)}


@truth
def dual_3dpga() -> dict[str, Any]:
    names = ["e0123", "e123", "e032", "e013", "e021", "e23", "e31", "e12"]
    names += ["e03", "e02", "e01", "e3", "e2", "e1", "e0", "1"]
    return {"d": PGA3.multivector({name: k + 1 for k, name in enumerate(names)})}


@truth
def ideal_3d(x: float, y: float, z: float) -> dict[str, Any]:
    n = math.sqrt(x * x + y * y + z * z)
    line = PGA3.multivector({"e01": x / n, "e02": y / n, "e03": z / n})
    return {"n": line, "s": n * n, "a": math.sqrt(13), "D": PGA3.multivector({"e032": x, "e013": y, "e021": z})}


@truth
def between_points(**k: float) -> dict[str, Any]:
    """The translator is the square root of B / A up to a factor, so it moves A to B."""
    a, b = (np.array([k[n + axis] for axis in "xyz"]) for n in "ab")
    ratio = 1 + pga_point(*b.tolist()) * inverse(pga_point(*a.tolist()))
    return {"V": ratio / 2, "C": pga_point(*b.tolist())}


@truth
def point_cga(x: float, y: float, z: float) -> dict[str, Any]:
    return {"p": point(x, y, z), "q": 0}


@truth
def distance(**k: float) -> dict[str, Any]:
    return {"d": math.dist([k["ax"], k["ay"], k["az"]], [k["bx"], k["by"], k["bz"]])}


@truth
def sphere(cx: float, cy: float, cz: float, r: float, x: float, y: float, z: float) -> dict[str, Any]:
    s = point(cx, cy, cz) - r * r / 2 * inf
    d2 = (x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2
    return {"inside": (r * r - d2) / 2, "S": -1 * s * (c1 ^ c2 ^ c3 ^ inf ^ o), "T": 0, "R": r}


@truth
def circle(a: float) -> dict[str, Any]:
    """Three points at distance a from the origin: the image of infinity in the circle is its centre."""
    blade = point(a, 0, 0) ^ point(-a, 0, 0) ^ point(0, a, 0)
    return {"m": o, "D": -1 * blade * (c1 ^ c2 ^ c3 ^ inf ^ o)}


@truth
def gps(**k: float) -> dict[str, Any]:
    """Trilateration: the two points by linear algebra."""
    s = [np.array([k[f"sat{n}{axis}"] for axis in "xyz"]) for n in (1, 2, 3)]
    d = [k[f"d{n}"] for n in (1, 2, 3)]
    rows = np.array([s[1] - s[0], s[2] - s[0]])
    right = np.array([(d[0] ** 2 - d[n] ** 2 + s[n] @ s[n] - s[0] @ s[0]) / 2 for n in (1, 2)])
    base = np.linalg.lstsq(rows, right, rcond=None)[0]
    along = np.cross(*rows)
    along /= np.linalg.norm(along)
    offset = base - s[0]
    b, c = along @ offset, offset @ offset - d[0] ** 2
    roots = [-b + sign * math.sqrt(b * b - c) for sign in (1, -1)]
    found = [(base + t * along).tolist() for t in roots]
    return {"rc1N": ("either", found), "rc2N": ("either", found)}


@truth
def pair(r: float, c: float) -> dict[str, Any]:
    x = c / 2
    h = math.sqrt(r * r - x * x)
    return {name: ("either", [[x, h, 1, r * r / 2], [x, -h, 1, r * r / 2]]) for name in "ab"}


@truth
def rotate_cga(t: float, x: float, y: float, z: float) -> dict[str, Any]:
    return {"q": point(*turned(x, y, t), z)}


@truth
def translate(a: float, b: float, c: float, x: float, y: float, z: float) -> dict[str, Any]:
    return {"q": point(x + a, y + b, z + c), "same": point(x, y, z), "again": point(x, y, z)}


@truth
def horizon(px: float, py: float, pz: float, mx: float, my: float, mz: float, r: float) -> dict[str, Any]:
    s = point(mx, my, mz) - r * r / 2 * inf
    p = point(px, py, pz)
    power = (r * r - (px - mx) ** 2 - (py - my) ** 2 - (pz - mz) ** 2) / 2
    return {"C": s ^ (p + power * inf)}


@truth
def orthogonal() -> dict[str, Any]:
    return {"p": inf / 2.0 - o, "m": inf / 2.0 + o, "s": 1, "t": -1, "u": inf, "v": o}


@truth
def plane_sphere(h: float, r: float) -> dict[str, Any]:
    return {"radius2": r * r - h * h}


@truth
def circles_2d(r: float, d: float) -> dict[str, Any]:
    x = d / 2
    h = math.sqrt(r * r - x * x)
    return {name: ("either", [[x, h, 1, r * r / 2], [x, -h, 1, r * r / 2]]) for name in "ab"}


@truth
def circle_2d(**k: float) -> dict[str, Any]:
    """The centre is as far from a as from b and c."""
    a, b, c = (np.array([k[n + "x"], k[n + "y"]]) for n in "abc")
    centre = np.linalg.solve([b - a, c - a], [(b @ b - a @ a) / 2, (c @ c - a @ a) / 2])
    return {"m": point2(*centre.tolist())}


@truth
def boost(cosh2: float, sinh2: float, t: float, x: float) -> dict[str, Any]:
    """The rotor of half the rapidity boosts with the whole one."""
    c, s = math.cosh(0.6), math.sinh(0.6)
    g0, g1, g2, g3 = STA.basis()
    return {
        "v": (c * t + s * x) * g0 + (s * t + c * x) * g1,
        "s": 1 + 2 * (-1) * (g2 ^ g1),
        "d": g0 * inverse(g0 ^ g1 ^ g2 ^ g3),
    }


@truth
def ellipse(x: float, y: float, a: float, b: float, c: float) -> dict[str, Any]:
    """Each is a multiple of the equation of the conic."""
    return {
        "v": a * a * b * b - b * b * x * x - a * a * y * y,
        "h": b * b * x * x - a * a * y * y - a * a * b * b,
        "p": c * y - x * x,
        "k": (c * c - (x - a) ** 2 - (y - b) ** 2) / 2,
    }


@truth
def conic_points(x: float, y: float, h: float, k: float) -> dict[str, Any]:
    """The determinant of six points in the monomials of conics vanishes where they lie on one."""
    given = [(2, 0), (-2, 0), (0, 1), (0, -1), (h, k)]

    def row(u: float, v: float) -> list[float]:
        return [1, u, v, (u * u + v * v) / 2, (u * u - v * v) / 2, u * v]

    names = ["e0p", "e1", "e2", "einfp", "einfm", "einfc"]
    volume = np.linalg.det([row(x, y), *(row(*each) for each in given)])
    blade = None
    for each in given:
        vector_ = GAC.multivector(dict(zip(names, map(float, row(*each)), strict=True)))
        blade = vector_ if blade is None else blade ^ vector_
    assert blade is not None
    weight = GAC.multivector({"1": volume}) * GAC.multivector({"^".join(names): 1})
    dual = blade.product("hestenes_product", GAC.multivector({"e0p^e0m^e0c^e1^e2^einfp": 1}))
    here = GAC.multivector(dict(zip(names, row(x, y), strict=True)))
    return {"v": weight, "i": dual, "w": here.product("hestenes_product", dual).scalar}


@truth
def conic_versors(x: float, y: float, a: float, b: float) -> dict[str, Any]:
    """The ellipse moved, turned by a right angle, and grown to four times its size."""

    def at(u: float, v: float) -> float:
        return 4 - u * u - 4 * v * v

    return {"v": at(x - a, y - b), "w": at(y, -x), "u": 4 * at(x / 4, y / 4)}


@truth
def quadrics(x: float, y: float, z: float, a: float, b: float, c: float, r: float) -> dict[str, Any]:
    return {
        "s": (r * r - (x - a) ** 2 - (y - b) ** 2 - (z - c) ** 2) / 2,
        "e": (1 - (x - a) ** 2 / 4 - (y - b) ** 2 / 9 - (z - c) ** 2 / 16) / 2,
        "k": (1 - (x - a) ** 2 / 4 - (y - b) ** 2 / 9) / 2,
        "n": 0, "o": -1,
    }  # fmt: skip


@truth
def dcga_points(x: float, y: float, z: float) -> dict[str, Any]:
    d = x * x + y * y + z * z
    plain = {
        "x1": x, "y1": y, "z1": z, "xx": x * x, "xy": x * y, "yz": y * z, "zx": z * x, "one": 1, "t2": d, "t4": d * d,
        "xt2": x * d,
    }  # fmt: skip
    return plain | {"v": ("vector", {"e1": x, "e2": y, "e3": z}), "n": 0}


@truth
def dcga_quadrics(x: float, y: float, z: float) -> dict[str, Any]:
    """Equations of quadrics with the centre (1, 2, 3) and the radii 4, 5, 6."""
    u, v, w = (x - 1) / 4, (y - 2) / 5, (z - 3) / 6
    found = {
        "Ellipsoid": u * u + v * v + w * w - 1, "CylinderX": v * v + w * w - 1, "CylinderY": u * u + w * w - 1,
        "CylinderZ": u * u + v * v - 1, "ConeX": v * v + w * w - u * u, "ConeY": u * u + w * w - v * v,
        "ConeZ": u * u + v * v - w * w, "ParaboloidX": v * v + w * w - u, "ParaboloidY": u * u + w * w - v,
        "ParaboloidZ": u * u + v * v - w, "HParaboloidZ": u * u - v * v - w, "Hyperboloid1": u * u + v * v - w * w - 1,
        "Hyperboloid2": w * w - u * u - v * v - 1, "PCylinderX": v * v - w, "PCylinderY": u * u - w,
        "PCylinderZ": u * u - v, "HCylinderX": v * v - w * w - 1, "HCylinderY": w * w - u * u - 1,
        "HCylinderZ": u * u - v * v - 1, "XPlanesX": ((y - 1) / 4) ** 2 - ((z - 2) / 5) ** 2,
        "XPlanesY": ((z - 2) / 5) ** 2 - ((x - 1) / 4) ** 2, "XPlanesZ": ((x - 1) / 4) ** 2 - ((y - 2) / 5) ** 2,
        "PPlanesY": (y - 1) * (y - 2),
    }  # fmt: skip
    return {f"v{name}": value for name, value in found.items()}


@truth
def dcga_cyclides(x: float, y: float, z: float) -> dict[str, Any]:
    """Quartics of tori and Dupin cyclides (Maxwell 1868); the square of a sphere's equation."""
    d = x * x + y * y + z * z
    big, u, c = 3, 1.5, -0.5
    b2 = big * big - c * c
    s = (4 - (x - 1) ** 2 - (y - 2) ** 2 - (z - 3) ** 2) / 2
    return {
        "torus": (d + 9 - 1) ** 2 - 36 * (x * x + y * y),
        "cyclide": (d + b2 - u * u) ** 2 - 4 * (big * x - c * u) ** 2 - 4 * b2 * y * y,
        "sphere": -s * s,
        "same": 0,
        "derivative": 2 * x / 4,
    }


@truth
def dcga_versors(x: float, y: float, z: float) -> dict[str, Any]:
    def at(u: float, v: float, w: float) -> float:
        return u * u / 4 + v * v / 9 + w * w / 16 - 1

    return {"moved": at(x - 1, y - 2, z - 3), "turned": at(y, -x, z)}


@truth
def cubic(x: float, y: float, t: float) -> dict[str, Any]:
    """Points on one cubic are dependent with nine others of it: y = x**3 holds nine points and every tenth."""
    return {"n": 0, "d": -(x * x + y * y) / 2, "one": -1, "on": 0}


@truth
def macro_arity(x: float, y: float) -> dict[str, Any]:
    return {"a": x * x, "b": x + 2 * y, "c": 7, "d": x * x + 2 * y * y}


@truth
def macro_locals(t: float) -> dict[str, Any]:
    return {"v": math.cos(t) * a1 + math.sin(t) * a2, "h": 3}


@truth
def macro_global() -> dict[str, Any]:
    def macro(value: float) -> float:
        return 5 * 3 * value

    return {"r": macro(macro(2) * macro(2)) * 3 * macro(3)}


@truth
def macro_outputs(b: float, x: float) -> dict[str, Any]:
    d = 2 * b + x
    return {"a": b, "c": b + x, "macro_myMac_k": d, "d": d, "macro_myMac_k1": 3, "f": d - b + 3}


@truth
def macro_override(a: float) -> dict[str, Any]:
    return {"d": 2 * c1, "n": 2 * c2, "x": 1 + a}


@truth
def coefficient_of(x: float) -> dict[str, Any]:
    return {"a": 2, "b": 5, "c": -7, "d": -1, "f": 0, "g": 3 * x}


@truth
def functions(x: float) -> dict[str, Any]:
    names = dict(zip("abcdfghij", ["sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "sqrt"], strict=True))
    plain = {letter: getattr(math, name)(x) for letter, name in names.items()}
    more = {"k": x, "l": math.sin(x) * math.cos(x), "m": math.atan2(x, -1), "n": math.sqrt(2) + math.sin(1)}
    return plain | more


@truth
def folded(x: float) -> dict[str, Any]:
    return {"a": 3, "b": -1, "c": 120, "d": 3, "f": 3 * x}


@truth
def length(x: float, y: float) -> dict[str, Any]:
    return {"a": math.hypot(x, y), "b": 3, "c": math.sqrt(abs(x * x - y * y)), "d": math.sqrt(5), "f": x}


@truth
def exponential(t: float) -> dict[str, Any]:
    w = VGA3.multivector({"1": math.cos(0.5), "e12": math.sin(0.5)})
    return {"v": vector(math.cos(t), math.sin(t), 0), "w": w}


@truth
def evaluate_only(x: float) -> dict[str, Any]:
    return {"r": (x * x + 2) * (x * c1 + c2)}


@truth
def pragma_output(x: float, y: float, z: float) -> dict[str, Any]:
    return {
        "q": ("listed", ["e2^e1", "1"], [-x * y, 3]),
        "p": ("listed", ["e1", "e2"], [x, y]),
        "w": ("listed", ["e2^e1", "1"], [-5, z]),
        "s": 2 * x,
    }


@truth
def pragma_in2out(a: float, b: float) -> dict[str, Any]:
    return {"second": b * a, "first": a + a1}


@truth
def pragma_others(t: float, s: float) -> dict[str, Any]:
    return {"A": point(t, 0, 0), "B": point(0, s, 0)}


@truth
def pragma_normalize(x: float, y: float) -> dict[str, Any]:
    b = x * a1 + y * a2
    return {"a": 3 * a1 + 4 * a2, "c": b / math.hypot(x, y), "d": b / math.hypot(x, y), "b": b}


@truth
def drawing(x: float) -> dict[str, Any]:
    return {"c": point(x, 0, 0) ^ (point(x, 0, 0) - 0.5 * inf)}


@truth
def names(**k: float) -> dict[str, Any]:
    return {
        "lambda_": 2 * k["out_"], "v_y": k["in_"] * k["v_z"], "double": k["REAL"] + k["t0"],
        "z": k["nothing_"] + k["self"],
    }  # fmt: skip


@truth
def constant() -> dict[str, Any]:
    return {"a": -1 * b1 * I3, "b": 1, "zero": 0}


@truth
def blades(x: float) -> dict[str, Any]:
    return {"a": PGA3.multivector({"e12": x, "e032": 1}), "b": PGA3.multivector({"e01": 2})}


@truth
def input_out(x: float) -> dict[str, Any]:
    return {"x": x, "y": x + 1}


@truth
def user_algebra(x: float, y: float) -> dict[str, Any]:
    return {"d": abs(x - y), "s": ("vector", {"n^m": 1}), "k": 1, "t": -1}


def expected_blades(value: Any, layout: Any) -> dict[str, float]:
    """A truth in the spelling of a layout; the layout must have its blades and no more."""
    if not isinstance(value, Multivector):
        return {"1": float(value)}
    spelled = {value.algebra.blade(name)[1]: name for name in blades_of(layout)}
    significant = {blade for blade, x in value.terms.items() if abs(x) > 1e-12}
    assert significant <= set(spelled), (value, layout.blades)
    return {name: float(value[name]) for name in blades_of(layout)}


def check(found: Any, layout: Any, value: Any) -> None:
    got = as_dict(found, layout)
    kind, *rest = value if isinstance(value, tuple) else ("value", value)
    if kind == "either":
        near = min(rest[0], key=lambda one: float(np.abs(np.subtract(list(got.values()), one)).max()))
        np.testing.assert_allclose(list(got.values()), near, rtol=1e-9, atol=1e-9)
    elif kind == "vector":
        assert {name.replace("^", ""): x for name, x in got.items()} == pytest.approx(
            {name.replace("^", ""): x for name, x in rest[0].items()}
        )
    elif kind == "listed":
        assert list(got) == rest[0]
        assert list(got.values()) == pytest.approx(rest[1])
    else:
        assert got == pytest.approx(expected_blades(rest[0], layout), rel=1e-9, abs=1e-11)


def test_there_are_enough_scripts() -> None:
    assert set(TRUTH) == set(FILES)
    assert len(FILES) >= 40 and len(REFUSED) >= 10
    assert {algebra_of(path) for path in FILES.values()} > set(NAMES)


@pytest.mark.parametrize("name", some_slow(FILES, *LARGE))
def test_results_of_scripts(name: str, request: pytest.FixtureRequest) -> None:
    modules = request.getfixturevalue("large" if name in LARGE else "small")
    one, record = compiled(name)
    values = inputs_of(one)
    expected = TRUTH[name](**values)
    assert list(expected) == list(one.outputs)
    for backend, module in modules.items():
        if backend != "arrays" and name not in (*COMPILED, *LARGE):
            continue
        function = getattr(module, name)
        for _ in range(2):
            results = function(**values)
        assert results._fields == one.outputs
        for field, value in expected.items():
            check(getattr(results, field), function.layouts[field], value)
    exact = one.multivectors(**{each: Fraction(value) for each, value in values.items()})
    for field, layout in zip(one.outputs, record.decision.layouts, strict=True):
        multivector = getattr(exact, field)
        listed = {multivector.algebra.blade(blade)[1] for blade in blades_of(layout)}
        restricted = isinstance(expected[field], tuple) and expected[field][0] == "listed"
        assert restricted or all(blade in listed or abs(x) < 1e-9 for blade, x in multivector.terms.items())
        own = [float(multivector[blade]) for blade in blades_of(layout)]
        ours = getattr(getattr(modules["arrays"], name)(**values), field)
        np.testing.assert_allclose(np.atleast_1d(ours), own, rtol=1e-9, atol=1e-9)


@all_cases("name", REFUSED)
def test_invalid_scripts_are_rejected(name: str) -> None:
    text = REFUSED[name].read_text()
    _, algebra, place = text.split()[:3]
    with pytest.raises(ScriptError) as caught:
        read_cluscript(text, algebra, name, f"{name}.clu")
    assert f"{caught.value.line}:{caught.value.column}" == place
    assert str(caught.value).startswith(f"{name}.clu:{place}: ")


# The script as an object, and the command line.


def test_arguments_broadcast() -> None:
    one = script("distance")
    x = np.linspace(0, 1, 5)
    found = one(ax=x, ay=0.0, az=0.0, bx=x[:, None], by=1.0, bz=0.0).d
    assert found.shape == (5, 5)
    np.testing.assert_allclose(found, np.hypot(x - x[:, None], 1.0))
    point_of = script("point_cga")(x=x, y=x[:, None], z=0.0)
    assert point_of.p.shape == (5, 5, 5) and point_of.q.shape == (5, 5)


def test_a_script_is_a_kernel() -> None:
    inner = script("distance")

    @gacompiler.kernel(x=gacompiler.SCALAR)
    def from_origin(x: Any) -> Any:
        return inner(x, 0, 0, bx=0, by=0, bz=0)[0]

    assert float(gacompiler.compile(from_origin)(3.0)) == pytest.approx(3.0)
    slope = gacompiler.compile(gacompiler.jvp(from_origin, "x"))
    assert float(np.asarray(slope(3.0, 1.0)[1])) == pytest.approx(1.0)


def test_drawn_objects() -> None:
    one = script("drawing")
    assert [(each.name, each.null_space) for each in one.drawn] == [("a", "IPNS"), ("b", "IPNS"), ("c", "OPNS")]
    assert one.background == (1.0, 1.0, 1.0, 1.0)
    assert one.drawn[0].colour is None and one.drawn[1].colour == (1.0, 0.0, 0.0, 1.0)
    a, b, c = one.draw(x=2)
    assert a.value == point(2, 0, 0) and c.colour == (0.0, 0.5, 2.0, 0.25)
    assert b.value - a.value == inf * Fraction(-1, 2)
    only = read_cluscript(":Green;\n:a = e1;", "cga")
    assert only.outputs == () and only.draw()[0].value == c1


def test_pragmas() -> None:
    one = script("pragma_others")
    assert one.ranges == {"t": (0.0, 1.0), "s": (-2.5, 10.0)}
    assert one.segments == (("A", "B"), ("B", "C")) and one.triangles == (("A", "B", "C"),)
    assert one.insertions == ("using Godot",)
    (returned,) = one.returned
    assert returned.names == ("A", "B") and returned.type == "Godot.Vector3"
    assert script("evaluate_only").evaluated == ("t", "w", "q")
    assert script("pragma_in2out").inputs == ("b", "a")


def test_inputs_are_in_order_of_first_appearance() -> None:
    text = "k = { _P(1) + late*u }\n?a = z + y;\n?b = k(x) + y;"
    assert read_cluscript(text, "2d").inputs == ("late", "u", "z", "y", "x")
    assert read_cluscript("?b = k(x);\nk = { _P(1) }\nunused = w;", "2d").inputs == ("x", "w")


def test_time_has_three_names() -> None:
    """In Gaalop's own definition of space-time the first of four vectors is time."""
    for text in ("?s = e1*e1 + 10*e2*e2 + 100*e4*e4;", "?s = e0*e0 + 10*e1*e1 + 100*e3*e3;", "?s = g0*g0 - 110;"):
        assert read_cluscript(text, "sta").multivectors().s == 1 - 10 - 100
    assert read_cluscript("?d = *e1;", "sta").multivectors().d == STA.multivector({"g123": -1})


def test_messages_name_a_remedy() -> None:
    with pytest.raises(ScriptError, match="did you mean createPoint"):
        read_cluscript("?x = createPiont(1, 2, 3);", "cga")
    with pytest.raises(ScriptError, match=r"Dual = \{"):
        read_cluscript("?x = *e1;", gacompiler.Algebra("G4", "e1 e2 e3 e4", [1, 1, 1, 1]))
    with pytest.raises(SpecError, match="no such algebra"):
        read_cluscript("?x = 1;", "8d")
    with pytest.raises(SpecError, match="no algebra"):
        read_cluscript("?x = 1;")


def test_older_scripts_name_their_algebra() -> None:
    assert read_cluscript("DefVarsN3();\n?p = VecN3(1, 2, 3);").algebra == CGA3
    assert read_cluscript(":DefVarsE3();\n:N3_OPNS;\n?p = VecE3(1, 2, 3);").algebra == VGA3
    assert read_cluscript("?p = e1;", "CGA3").algebra == read_cluscript("?p = e1;", CGA3).algebra == CGA3


@pytest.mark.parametrize(
    ("line", "text", "place"),
    [(0, "e1,n,m", ":1"), (3, "e1=1,p=1", ":4"), (3, "e1=1,p=1,q=x", ":4"), (4, "n=0.5*q", ":5"),
     (4, "n=0.5*z,m=p", ":5"), (1, "p=2*w", ":2")],
)  # fmt: skip
def test_invalid_definitions(line: int, text: str, place: str, tmp_path: Path) -> None:
    lines = (FOLDER / "oblique" / "definition.csv").read_text().splitlines()
    lines[line] = text
    (tmp_path / "definition.csv").write_text("\n".join(lines))
    with pytest.raises(SpecError) as caught:
        read_cluscript("?x = 1;", tmp_path)
    assert f"definition.csv{place}:" in str(caught.value)


def test_the_definition_of_conformal_space(tmp_path: Path) -> None:
    """The five lines of Gaalop give the algebra of the catalog, up to the order of vectors, with irrational factors."""
    (tmp_path / "definition.csv").write_text(
        "1,e1,e2,e3,einf,e0\nep=0.5*einf-e0,em=0.5*einf+e0\n1,e1,e2,e3,ep,em\n"
        "e1=1,e2=1,e3=1,ep=1,em=-1\ne0=0.5*em-0.5*ep,einf=em+ep\n"
    )
    one = read_cluscript("?a = e0.einf; ?b = e0*e0; ?c = ep*ep;", tmp_path)
    assert [value.scalar for value in one.multivectors()] == [-1, 0, 1]
    root = "0.7071067811865475"
    (tmp_path / "definition.csv").write_text(
        f"1,e1,n,m\n\n1,e1,p,q\ne1=1,p=1,q=-1\nn={root}*q-{root}*p,m={root}*p+{root}*q\n"
    )
    assert read_cluscript("?g = n.m;", tmp_path).algebra.gram[1:] == ((0, 0, -1), (0, -1, 0))


@pytest.mark.slow
def test_the_command_line(tmp_path: Path) -> None:
    path = tmp_path / "moved.clu"
    path.write_text("T = TranslatorN3(a, b, 0);\n?q = T*createPoint(x, 0, 0)*~T;\n?n = sqrt(x)*e1;\n")
    runner, out = CliRunner(), str(tmp_path / "out")
    done = runner.invoke(main, ["generate", str(path), "--algebra", "cga3", "-o", out, "--no-build"])
    assert done.exit_code == 0, done.output
    module = load_module(tmp_path / "out" / "moved.py", "_moved_script", "arrays")
    found = module.moved(a=1.0, b=2.0, x=4.0)
    assert found._fields == ("q", "n") and found.n.tolist() == [2.0]
    assert as_dict(found.q, module.moved.layouts["q"]) == {"e1": 5.0, "e2": 2.0, "e0": 1.0, "einf": 14.5}
    assert module.moved.kernel.signature == "(),(),()->(4),(1)"
    for command in (["verify", str(path), "-o", out], ["cost", str(path)], ["show", str(path), "--stage", "trace"]):
        done = runner.invoke(main, [*command, "--algebra", "cga3"])
        assert done.exit_code == 0, done.output
    done = runner.invoke(main, ["generate", str(path), "-o", out])
    assert done.exit_code == 1 and "--algebra" in done.output
    path.write_text("?q = createPiont(x, 0, 0);")
    done = runner.invoke(main, ["generate", str(path), "--algebra", "cga3", "-o", out])
    assert done.exit_code == 1 and "moved.clu:1:6: no macro or function named createPiont" in done.output


def test_the_page_runs() -> None:
    """Execute the page in one namespace, from top to bottom, including its assertions."""
    blocks = re.findall(r"```python\n(.*?)```", (FOLDER.parents[2] / "docs" / "cluscript.md").read_text(), re.DOTALL)
    assert len(blocks) == 2
    exec(compile("\n".join(blocks), "docs/cluscript.md", "exec"), {"__name__": "cluscript"})


def test_files_that_name_no_function(tmp_path: Path) -> None:
    path = tmp_path / "a-b.clu"
    path.write_text("?x = 1;")
    with pytest.raises(SpecError, match="cannot name"):
        load_spec(path, algebra="cga")
    with pytest.raises(SpecError, match="no such file"):
        load_spec(tmp_path / "none.clu", algebra="cga")


def test_other_languages(tmp_path: Path) -> None:
    done = CliRunner().invoke(
        main, ["generate", str(FILES["distance"]), "--algebra", "cga", "--target", "rust", "-o", str(tmp_path)]
    )
    assert done.exit_code == 0 and "fn distance" in (tmp_path / "distance.rs").read_text()
