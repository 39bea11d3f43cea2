"""Numerical checks: relations of a layout, blades, and finite results."""

from __future__ import annotations

import cmath
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..algebra.algebra import Algebra
from ..algebra.layout import Layout
from ..errors import AlgebraError, LayoutError, OperandError
from .caches import cached_by_name


def check_relations(where: str, layout: Layout, values: np.ndarray[Any, Any], tolerance: float = 1e-9) -> None:
    """Raise `LayoutError` if coefficients do not satisfy the relations of a layout."""
    element = layout.element([values[..., k] for k in range(layout.size)])
    size = np.maximum(1.0, np.max(np.abs(values), axis=-1, initial=0.0)) ** 2
    tolerance = max(tolerance, rounding_of(values))
    for relation in layout.relations(element):
        worst = np.max(np.abs(np.asarray(relation)) / size, initial=0.0)
        if not worst <= tolerance:
            what = "x ~x - 1" if layout.unit else "its relation"
            raise LayoutError(
                where, f"{what} = {worst:.3g}", f"0, as {layout} is declared",
                "call normalize() on it first, or use a layout without relations",
            )  # fmt: skip


def rounding_of(values: np.ndarray[Any, Any]) -> float:
    """Return the error of a relation of 16 rounded terms, relative to the square of the largest coefficient.

    It is above the tolerances of doubles, 1e-9, in single precision only.
    """
    return 64 * float(np.finfo(values.dtype).eps) if values.dtype.kind in "fc" else 0.0


def require_blade(where: str, x: Any) -> None:
    """Raise `AlgebraError` if an object has several grades or is not an outer product of vectors.

    Vectors, bivectors and their duals can be checked, which covers all grades in up to five dimensions: a bivector is a
    blade if ``b ^ b = 0``.
    """
    if not hasattr(x, "layout"):
        raise AlgebraError(where, f"a {type(x).__name__}", "a blade")
    n, grades = x.algebra.dimension, _grades_of(x.layout)
    if len(grades) != 1:
        raise AlgebraError(where, f"a {x.layout} of grades {grades}", "a blade, of one grade", "select it by .grade()")
    (k,) = grades
    if k in (0, 1, n - 1, n):
        return
    if k not in (2, n - 2):
        raise AlgebraError(where, f"grade {k} in {n} dimensions", f"grade 1, 2, {n - 2} or {n - 1}")
    square = x.outer_product(x) if k == 2 else x.regressive_product(x)
    worst, size = largest(getattr(square, "values", square)), largest(x.values)
    if worst > max(1e-9, rounding_of(x.values)) * max(size, 1e-300) ** 2:
        product = "^" if k == 2 else "&"
        found_text = f"a {x.layout} that is not a blade: x {product} x = {worst:.3g}"
        raise AlgebraError(where, found_text, "an outer product of vectors")


def require_element(where: str, x: Any, algebra: Algebra | None = None) -> None:
    """Raise `OperandError` if an object is not a multivector, or not one of an algebra."""
    if not hasattr(x, "algebra"):
        raise OperandError(where, f"a {type(x).__name__}", "multivectors, such as points")
    if algebra is not None and x.algebra != algebra:
        raise OperandError(where, f"an element of {x.algebra}", f"one of {algebra}")


@cached_by_name
def _grades_of(layout: Layout) -> list[int]:
    return sorted({blade.bit_count() for blade in layout.support})


def number_of(values: Any) -> Any:
    """Return an array without axes as a number, and one with axes unchanged."""
    return values.item() if values.ndim == 0 else values


def largest(values: Any) -> float:
    """Return the largest absolute value of an array or a number; lists are faster than numpy for single elements."""
    if isinstance(values, float):
        return abs(values)
    if values.ndim == 1:
        return max(map(abs, values.tolist()), default=0.0)
    return float(np.max(np.abs(values), initial=0.0))


def refuse(where: str, made: Any, bad: Any, found: str, expected: str) -> Any:
    """Return the result of a constructor, with NaN for invalid elements of an array; raise if a single one is invalid.

    Parameters
    ----------
    where : str
        The name of the constructor.
    made : MultivectorArray
    bad : array_like of bool
        Whether each element is invalid; broadcasts with the shape of `made`.
    found, expected : str
        Texts of the error message.

    Raises
    ------
    LayoutError
        If a single element is invalid.
    """
    if bad is False or (isinstance(bad, (bool, np.bool_)) and not bad) or not np.any(bad):
        return made
    if not made.shape:
        raise LayoutError(where, found, expected)
    return type(made)(made.layout, np.where(np.asarray(bad)[..., None], np.nan, made.values))


def require_finite(where: str, made: Any, operands: Sequence[Any], found: str = "no finite result") -> Any:
    """Return `refuse` for coefficients that are not finite; NaN in the operands is propagated without an error."""
    values = np.asarray(getattr(made, "values", made))
    is_single = not getattr(made, "shape", ())
    if is_single and values.ndim == 1 and cmath.isfinite(sum(values.tolist())):  # a sum with inf or NaN is not finite
        return made
    if all(map(cmath.isfinite, np.ravel(values).tolist())) if is_single else np.all(np.isfinite(values)):
        return made
    if is_single:
        if any(np.isnan(np.asarray(getattr(each, "values", each))).any() for each in operands):
            return made
        raise LayoutError(where, found, "other arguments")
    return refuse(where, made, np.any(np.isnan(values), axis=-1), found, "other arguments")
