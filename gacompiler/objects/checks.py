"""What must hold of numbers: relations of a layout, blades where blades are needed."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..algebra.layout import Layout
from ..errors import AlgebraError, LayoutError


def check_relations(where: str, layout: Layout, values: np.ndarray[Any, Any], tolerance: float = 1e-9) -> None:
    """Raise `LayoutError` where coefficients do not satisfy what a layout says of them."""
    element = layout.element([values[..., k] for k in range(layout.size)])
    size = np.maximum(1.0, np.max(np.abs(values), axis=-1, initial=0.0)) ** 2
    for relation in layout.relations(element):
        worst = np.max(np.abs(np.asarray(relation)) / size, initial=0.0)
        if not worst <= tolerance:
            what = "x ~x - 1" if layout.unit else "its relation"
            raise LayoutError(
                where, f"{what} = {worst:.3g}", f"0, as {layout} is declared",
                "call normalize() on it first, or use a layout without relations",
            )  # fmt: skip


def require_blade(where: str, x: Any) -> None:
    """Raise `AlgebraError` where an object is not of one grade, or not an outer product of vectors.

    Vectors, bivectors and duals of such are decided, which is all there is over five vectors: ``b ^ b = 0`` tells.
    """
    if not hasattr(x, "layout"):
        raise AlgebraError(where, f"a {type(x).__name__}", "a blade")
    n, grades = x.algebra.dimension, sorted({blade.bit_count() for blade in x.layout.support})
    if len(grades) != 1:
        raise AlgebraError(where, f"a {x.layout} of grades {grades}", "a blade, of one grade", "take .grade() of it")
    (k,) = grades
    if k in (0, 1, n - 1, n):
        return
    if k not in (2, n - 2):
        raise AlgebraError(where, f"grade {k} of {n} vectors", "a grade of which blades can be told here")
    square = x.outer_product(x) if k == 2 else x.regressive_product(x)
    found = np.abs(np.asarray(getattr(square, "values", square)))
    worst = np.max(found, initial=0.0)
    if worst > 1e-9 * np.max(np.abs(x.values), initial=1e-300) ** 2:
        product = "^" if k == 2 else "&"
        found_text = f"a {x.layout} that is no blade: x {product} x = {worst:.3g}"
        raise AlgebraError(where, found_text, "an outer product of vectors")
