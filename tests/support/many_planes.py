"""Versors of several planes by known angles, and their bivectors, rounded from 40 digits."""

from __future__ import annotations

from functools import cache
from typing import Any

import mpmath
import numpy as np

from gacompiler import Cl
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.multivector import Multivector
from gacompiler.objects.arrays import wrap

PLANES = ["e12", "e34", "e56", "e78"]
PI = mpmath.mpf("3.14159265358979323846264338327950288419716939937510")
ANGLES = {
    "near zero": [1e-9, 2e-9, -1e-9, 3e-9],
    "of different sizes": [1e-12, 1.0, 2.0, 1e-8],
    "equal": [1.0, 1.0, 1.0, 1.0],
    "opposite": [1.0, -1.0, 1.0, -1.0],
    "nearly equal": [1.0, 1 + 1e-9, 1.0, 2.0],
    "pi - 1e-3": [PI - mpmath.mpf("1e-3"), 0.3, 0.5, -1.0],
    "pi - 1e-13": [PI - mpmath.mpf("1e-13"), 0.3, 0.5, -1.0],
    "two near pi": [PI - mpmath.mpf("0.1"), PI - mpmath.mpf("0.3"), 0.5, 1.0],
}


@cache
def frame(algebra: Algebra) -> Multivector:
    """A rotor of a few planes, which moves bivectors out of the coordinate planes."""
    found = algebra.scalar(mpmath.mpf(1))
    for k, (i, j) in enumerate([(0, 2), (1, 3), (2, algebra.dimension - 1), (0, algebra.dimension - 1)]):
        vectors = algebra.basis()
        generator = (vectors[i] * vectors[j]).map(lambda value, k=k: value * mpmath.mpf(k + 1) / 7)  # type: ignore[misc]
        found = exact_exp(generator) * found
    return found


def turn(algebra: Algebra, name: str, angle: Any) -> Multivector:
    """The exponential of a multiple of a blade whose square is 1 or -1."""
    blade = algebra.multivector({name: mpmath.mpf(1)})
    is_turn = (blade * blade).scalar < 0
    even, odd = (mpmath.cos, mpmath.sin) if is_turn else (mpmath.cosh, mpmath.sinh)
    return algebra.scalar(even(angle)) + blade.map(lambda value: value * odd(angle))


def exact_exp(x: Multivector) -> Multivector:
    term = total = x.algebra.scalar(mpmath.mpf(1))
    small = x.map(lambda value: value / 2**8)
    for k in range(1, 24):
        term = (term * small).map(lambda value, k=k: value / k)  # type: ignore[misc]
        total = total + term
    for _ in range(8):
        total = total * total
    return total


def example(signature: tuple[int, ...], angles: list[Any]) -> tuple[Any, Any]:
    """Return a bivector and its exponential as objects, both rounded from 40 digits."""
    with mpmath.workdps(40):
        algebra = Cl(*signature).algebra
        parts = {plane: mpmath.mpf(angle) / 2 for plane, angle in zip(PLANES, angles, strict=False)}
        known = {name: value for name, value in parts.items() if int(name[-1]) <= algebra.dimension}
        versor = algebra.scalar(mpmath.mpf(1))
        for name, value in known.items():
            versor = versor * turn(algebra, name, value)
        moved = frame(algebra)
        b, versor = ((moved * x) * ~moved for x in (algebra.multivector(known), versor))
        return rounded(algebra, b.grade(2), algebra.blades(2)), rounded(algebra, versor, algebra.even.support)


def rounded(algebra: Algebra, x: Multivector, blades: Any) -> Any:
    layout = algebra.layout("part", " ".join(algebra.spelling(b)[1] for b in sorted(blades)))
    return wrap(layout, np.array([float(x.terms.get(s.blade, 0)) * s.sign for s in layout.stored]))


def size(x: Any) -> float:
    return float(np.max(np.abs(x.values)))
