"""Macros of 2dpga and 3dpga: points, the dual that pairs complementary blades, norms, motors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...algebra.algebra import Algebra
from ...algebra.multivector import Multivector
from ...frontend.expression import Expression
from ...frontend.operations import assemble, reverse
from ..values import cos, sin, sqrt
from .common import HALF, Table, basis, combination, length, part, wedge

PAIRS_2D = (("1", "e0^e1^e2"), ("e0", "e1^e2"), ("e1", "e2^e0"), ("e2", "e0^e1"))
PAIRS_3D = (
    ("1", "e0^e1^e2^e3"), ("e0", "e1^e2^e3"), ("e1", "e0^e3^e2"), ("e2", "e0^e1^e3"), ("e3", "e0^e2^e1"),
    ("e0^e1", "e2^e3"), ("e0^e2", "e3^e1"), ("e0^e3", "e1^e2"),
)  # fmt: skip
"""Blades that the dual exchanges; the dual is an involution."""
TURNS = ("e1^e2", "e3^e1", "e2^e3")
"""The blades of a line with nonzero square."""


def _dual(algebra: Algebra, pairs: Sequence[tuple[str, str]]) -> Any:
    partner = {a: b for pair in pairs for a, b in (pair, pair[::-1])}
    by_blade = {algebra.blade(name)[1]: name for name in partner}

    def dual(x: Any) -> Any:
        if not isinstance(x, (Expression, Multivector)):
            return x * algebra.multivector({partner["1"]: 1})
        present = sorted(x.blades) if x.blades else [0]
        names = [by_blade[blade] for blade in present]
        return assemble(algebra, {partner[name]: _part(x, name) for name in names})

    return dual


def _part(x: Any, name: str) -> Any:
    return x["1"] if name == "1" else part(x, name)


def _shared(algebra: Algebra, pairs: Sequence[tuple[str, str]]) -> dict[tuple[str, int], Any]:
    dual = _dual(algebra, pairs)

    def normalized(x: Any) -> Any:
        return x / sqrt(x * reverse(x))

    return {
        ("Dual", 1): dual,
        ("reverse", 1): reverse,
        ("Normalize", 1): normalized,
        ("regProd", 2): lambda a, b: dual(wedge(dual(a), dual(b))),
    }


def plane(algebra: Algebra) -> Table:
    """Return the macros of 2dpga; lines are vectors, points bivectors."""
    e = basis(algebra)
    e0, e1, e2 = e["e0"], e["e1"], e["e2"]
    blades = [wedge(e2, e0), wedge(e0, e1)]
    return _shared(algebra, PAIRS_2D) | {
        ("createPoint", 2): lambda x, y: combination(blades, (x, y)) + wedge(e1, e2),
    }


def space(algebra: Algebra) -> Table:
    """Return the macros of 3dpga; planes are vectors, lines bivectors, points trivectors."""
    e = basis(algebra)
    e0, e1, e2, e3 = e["e0"], e["e1"], e["e2"], e["e3"]
    directions = [wedge(e0, e3, e2), wedge(e0, e1, e3), wedge(e0, e2, e1)]
    turns = [wedge(e2, e3), wedge(e3, e1), wedge(e1, e2)]
    shifts = [wedge(e0, e1), wedge(e0, e2), wedge(e0, e3)]

    def ideal_square(line: Any) -> Any:
        a, b, c = (part(line, name) for name in ("e0^e1", "e0^e2", "e0^e3"))
        return a * a + b * b + c * c

    def rotor(angle: Any, x: Any, y: Any, z: Any) -> Any:
        return cos(HALF * angle) + sin(HALF * angle) / length(x, y, z) * combination(turns, (x, y, z))

    def translator(distance: Any, x: Any, y: Any, z: Any) -> Any:
        return 1 - HALF * distance / length(x, y, z) * combination(shifts, (x, y, z))

    return _shared(algebra, PAIRS_3D) | {
        ("createPoint", 3): lambda x, y, z: combination(directions, (x, y, z)) + wedge(e1, e2, e3),
        ("createPointI", 3): lambda x, y, z: combination(directions, (x, y, z)),
        ("normalizeLineE", 1): lambda line: line / length(*(part(line, name) for name in TURNS)),
        ("normalizeLineI", 1): lambda line: line / sqrt(ideal_square(line)),
        ("normalizel", 1): ideal_square,
        ("createRotor", 4): rotor,
        ("createTranslator", 4): translator,
    }
