"""Spaces and operands of the comparisons with clifford, kingdon and galgebra, which all receive the same numbers."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from gacompiler.objects import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, STA, VGA2, VGA3, Space

SPACES: dict[str, Any] = {
    "VGA2": VGA2, "VGA3": VGA3, "PGA2": PGA2, "PGA3": PGA3, "CGA2": CGA2, "CGA3": CGA3, "STA": STA,
    "QUATERNIONS": QUATERNIONS, "G(4)": Space(4), "G(2,2)": Space(2, 2),
}  # fmt: skip
COUNT = 2
"""Number of operands of each kind."""


@cache
def operands(name: str) -> dict[str, Any]:
    """Return arrays of elements of each kind: general ones, vectors, products of vectors, blades, numbers."""
    space = SPACES[name]
    random = np.random.default_rng(sorted(SPACES).index(name))
    n = space.algebra.dimension

    def some(*grades: int) -> Any:
        blades = [space.algebra.spelling(blade)[1] for blade in space.algebra.blades(*grades)]
        return space.multivector({blade: random.normal(size=COUNT) for blade in blades})

    def vectors() -> Any:
        """Vectors whose squares are far from 0, so that their inverses have few rounding errors."""
        found = some(1)
        while np.any(np.abs(found * found) < 0.3):
            found = some(1)
        return found

    v, w, u = vectors(), vectors(), vectors()
    rotor = v * w
    found = {
        "a": some(), "b": some(), "c": 0.1 * some(), "v": v, "w": w, "B": some(2), "R": rotor, "P": v ^ w,
        "small": 0.7 * some(2), "s": random.uniform(1, 2, COUNT), "V": rotor * u, "simple": 0.6 * (v ^ w),
        "unit": rotor.normalize() if not np.any(np.abs(rotor * ~rotor) < 0.1) else rotor,
    }  # fmt: skip
    if n > 2:
        found["Q"] = (v ^ w ^ u) if n > 3 else (w ^ u)
    return found


def dense(name: str, x: Any) -> np.ndarray[Any, Any]:
    """Return all coefficients of elements or numbers, in the order of the blades of the space's full layout."""
    full = SPACES[name].algebra.full
    if hasattr(x, "as_layout") and not x.layout.is_scalar:
        return np.asarray(x.as_layout(full).values)
    found = np.zeros((*np.shape(x), full.size))
    found[..., full.blades.index("1")] = np.asarray(x, float)
    return found
