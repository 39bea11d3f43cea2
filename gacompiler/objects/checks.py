"""What must hold of numbers: relations of a layout, blades where blades are needed."""

from __future__ import annotations

import cmath
from collections.abc import Sequence
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
    rounding = max(1e-9, 64 * float(np.finfo(x.values.dtype).eps))  # of numbers in single precision
    if worst > rounding * np.max(np.abs(x.values), initial=1e-300) ** 2:
        product = "^" if k == 2 else "&"
        found_text = f"a {x.layout} that is no blade: x {product} x = {worst:.3g}"
        raise AlgebraError(where, found_text, "an outer product of vectors")


def refuse(where: str, made: Any, bad: Any, found: str, expected: str) -> Any:
    """What a constructor has made; where that does not exist an error, or in an array elements that are not a number.

    Parameters
    ----------
    where : str
        The constructor.
    made : MultivectorArray
    bad : array_like of bool
        Where it does not exist; broadcasts with the shape of `made`.
    found, expected : str
        What there was instead, for the message.
    """
    if bad is False or not np.any(bad):
        return made
    if not made.shape:
        raise LayoutError(where, found, expected)
    return type(made)(made.layout, np.where(np.asarray(bad)[..., None], np.nan, made.values))


def require_finite(where: str, made: Any, operands: Sequence[Any], found: str = "no finite result") -> Any:
    """As `refuse` where coefficients are not finite; one of the operands that is not a number makes no error."""
    values = np.asarray(getattr(made, "values", made))
    is_single = not getattr(made, "shape", ())
    if all(map(cmath.isfinite, np.ravel(values).tolist())) if is_single else np.all(np.isfinite(values)):
        return made
    if is_single:
        if any(np.isnan(np.asarray(getattr(each, "values", each))).any() for each in operands):
            return made
        raise LayoutError(where, found, "other arguments")
    return refuse(where, made, np.any(np.isnan(values), axis=-1), found, "other arguments")
