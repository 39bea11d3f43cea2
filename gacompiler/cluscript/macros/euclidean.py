"""Macros of 2d, 3d and sta: the dual, and the vectors and rotors of older scripts."""

from __future__ import annotations

from typing import Any

from ...algebra.algebra import Algebra
from ...frontend.operations import inverse
from ..values import cos, sin
from .common import HALF, Table, basis, combination, length, times, wedge


def euclidean(algebra: Algebra) -> Table:
    """Return ``Dual(x) = x / I``, ``I`` the product of all basis vectors; for three dimensions also VecE3, RotorE3."""
    vectors = list(basis(algebra).values())
    table = {("Dual", 1): times(inverse(wedge(*vectors)))}
    if len(vectors) == 3:
        e1, e2, e3 = vectors

        def rotor(x: Any, y: Any, z: Any, angle: Any) -> Any:
            plane = combination([wedge(e2, e3), wedge(e3, e1), wedge(e1, e2)], (x, y, z))
            return cos(HALF * angle) - sin(HALF * angle) * plane / length(x, y, z)

        table[("VecE3", 3)] = lambda x, y, z: combination(vectors, (x, y, z))
        table[("RotorE3", 4)] = rotor
    return table


def space_time(algebra: Algebra) -> Table:
    """Return ``Dual(x) = x / I``."""
    return {("Dual", 1): times(inverse(wedge(*basis(algebra).values())))}
