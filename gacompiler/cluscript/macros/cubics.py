"""Macros of ccga, G(9,7): cubic curves of the plane.

E. Hitzer & D. Hildenbrand, *Cubic Curves and Cubic Surfaces from Contact Points in Conformal Geometric Algebra*, 2019.
"""

from __future__ import annotations

from typing import Any

from ...algebra.algebra import Algebra
from .common import HALF, Table, basis, combination, wedge


def cubics(algebra: Algebra) -> Table:
    """Return the macros of ccga: seven null pairs for the monomials of degree 2 and 3."""
    e = basis(algebra)
    e1, e2 = e["e1"], e["e2"]
    near, far = [e[f"eo{k}"] for k in range(1, 8)], [e[f"ei{k}"] for k in range(1, 8)]
    eo, ei = near[0] + near[1], HALF * (far[0] + far[1])
    order = (0, 1, 2, 3, 4, 5, 6)
    infinity, origin = wedge(*(far[k] for k in order)), wedge(*(near[k] for k in order))
    everything = wedge(e1, e2, infinity, origin)

    def point(x: Any, y: Any) -> Any:
        monomials = (HALF * x * x, HALF * y * y, x * y, x * x * x, x * x * y, x * y * y, y * y * y)
        return x * e1 + y * e2 + combination(far, monomials) + eo

    constants = {
        "ei": ei, "eo": eo, "E": wedge(ei, eo), "Ieps": wedge(e1, e2),
        "Ii12": wedge(*far[:2]), "Iic": wedge(*far[3:]), "Iib": wedge(*far[2:]), "Ii": infinity,
        "Io12": wedge(*near[:2]), "Ioc": wedge(*near[3:]), "Iob": wedge(*near[2:]), "Io": origin,
        "Iio": wedge(infinity, origin), "I": everything,
        "eo12T": near[0] - near[1], "IoT": wedge(near[0] - near[1], *near[2:]),
        "ei12T": far[0] - far[1], "IiT": wedge(far[0] - far[1], *far[2:]),
        **{f"E{k + 1}": wedge(far[k], near[k]) for k in order},
    }  # fmt: skip

    def constant(value: Any) -> Any:
        return lambda: value

    return {(name, 0): constant(value) for name, value in constants.items()} | {
        # Viewers work in space: a third coordinate is accepted, but not used.
        ("createPoint", 3): lambda x, y, z: point(x, y) + 0 * z,
        ("createPoint", 2): point,
        ("Dual", 1): lambda x: -(x * everything),
        ("CubicFromPoints", 9): wedge,
    }
