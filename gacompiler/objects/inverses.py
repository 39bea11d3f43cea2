"""Inverses of elements, and detection of elements that have none up to rounding."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..algebra.layout import SCALAR, Layout
from ..errors import ZeroDivisorError
from ..gac_runtime.array_element import Element
from .caches import cached_by_name
from .normalizing import (
    LARGE,
    ROUNDINGS,
    SMALL,
    is_clearly_not_null,
    is_null,
    is_simple,
    largest_factor,
    range_exponents,
)
from .tables import inverse_by_equations


def inverted(
    x: Element, run: Callable[[Any], Any], wrap: Callable[[Layout, Any], Any], numbers: Sequence[float] | None = None
) -> Any:
    """Return the inverses of elements.

    Parameters
    ----------
    x : MultivectorArray
    run : callable
        The compiled inverse.
    wrap : callable
        Creates objects from a layout and coefficients.
    numbers : sequence of float, optional
        The coefficients of a single element that the extension stores.

    Returns
    -------
    MultivectorArray
        NaN for elements of an array that have no inverse.

    Raises
    ------
    ZeroDivisorError
        If `x` is a single element without an inverse, up to rounding errors.
    """
    layout = x.layout
    if layout.unit:
        return run(x)
    if numbers is not None and is_simple(layout) and is_clearly_not_null(layout, numbers):
        return run(x)
    values = x.values
    has_norm = is_simple(layout) and values.dtype.kind != "c"
    found = _of_array(x, run) if has_norm else inverse_by_equations(x, wrap)
    if found is None and not x.shape and values.dtype == np.float64:
        found = _of_single(x, run, has_norm)
    if found is not None:
        return found
    exponents = range_exponents(layout, values) if values.dtype.kind != "c" else None
    scaled = x if exponents is None else wrap(layout, np.ldexp(values, -exponents[..., None]))
    try:
        found = run(scaled)
    except ZeroDivisorError:  # no element of this layout has an inverse
        return _refused(x, x, np.ones(x.shape, bool), wrap)
    without = is_null(layout, scaled.values) if has_norm else ~_is_inverse(scaled, found)
    if exponents is not None:
        found = _mapped(found, lambda rows: np.ldexp(rows, -exponents[..., None]), wrap)
    return _refused(x, found, without, wrap) if np.any(without) else found


def _of_single(x: Any, run: Callable[[Any], Any], has_norm: bool) -> Any:
    """Return the inverse of a single element if it clearly has one in the range of doubles, else None; fast."""
    if has_norm:
        return run(x) if is_clearly_not_null(x.layout, x.values.tolist()) else None
    try:
        found = run(x)
    except ZeroDivisorError:
        return None
    residual = sum(map(abs, (x * found - 1).values.tolist()))
    size = _scalar_size(x.layout, found.layout, x.values.tolist(), found.values.tolist())
    return found if residual < 1 and ROUNDINGS * sys.float_info.epsilon * size < 1 else None


def _of_array(x: Any, run: Callable[[Any], Any]) -> Any:
    """Return the inverses ``y = ~x / (x ~x)`` of an array if all elements clearly have one, else None; fast.

    The absolute terms of ``t = x ~x`` have a sum of at most ``c |x|^2``, where c is the largest sum of absolute factors
    of one coefficient, and ``|y| = |x| / |t|``. So their sum is at most ``c |x| |y|`` times ``|t|``, which is at least
    ``1 / (c |y|^2)``. Sums over the whole array are bounds for each element.
    """
    layout, values = x.layout, x.values
    if values.ndim < 2 or layout.fixed or layout.implied or values.dtype != np.float64:
        return None
    factor = largest_factor(layout)
    if not factor:
        return None
    found = run(x)
    size, other = (float(np.vdot(each, each)) for each in (values.ravel("K"), found.values.ravel("K")))
    is_in_range = factor * size < LARGE and factor * other < 1 / SMALL
    return found if is_in_range and size * other * (ROUNDINGS * sys.float_info.epsilon * factor) ** 2 < 1 else None


def _is_inverse(x: Any, found: Any) -> Any:
    """Whether ``x x^-1 = 1`` holds well enough to show that `x` has an inverse.

    If the absolute coefficients of ``r = x x^-1 - 1`` have a sum below 1, the series of ``1 / (1 + r)`` converges. The
    rounding errors of the scalar part must be below 1 as well, since `found` was computed with the same ones.
    """
    columns = [list(np.moveaxis(_rows(each), -1, 0)) for each in (x, found)]
    with np.errstate(all="ignore"):
        residual = np.sum(np.abs(_rows(x * found - 1)), axis=-1)
        size = _scalar_size(x.layout, getattr(found, "layout", SCALAR), *columns)
        return (residual < 1) & (ROUNDINGS * float(np.finfo(x.values.dtype).eps) * size < 1)


def _scalar_size(a: Layout, b: Layout, left: list[Any], right: list[Any]) -> Any:
    """Return the sum of absolute terms of the scalar part of a product, from coefficients or columns of them."""
    return sum(abs(left[i] * right[j]) * factor for i, j, factor in _scalar_terms(a, b))


@cached_by_name
def _scalar_terms(a: Layout, b: Layout) -> list[tuple[int, int, float]]:
    """Return the indices and absolute factors of the products of stored coefficients in the scalar part of a product.

    A fixed coefficient, such as a weight of 1, is as accurate as any, and has no part in the result.
    """
    pairs = [(i, j, one.blade, two.blade) for i, one in enumerate(a.stored) for j, two in enumerate(b.stored)]
    terms = [(i, j, abs(float(a.algebra.blade_product(p, q).get(0, 0)))) for i, j, p, q in pairs]
    return [term for term in terms if term[2]]


def _rows(found: Any) -> Any:
    """Return coefficients along the last axis, which numbers do not have."""
    return found.values if hasattr(found, "layout") else np.asarray(found)[..., None]


def _mapped(found: Any, function: Callable[[Any], Any], wrap: Callable[[Layout, Any], Any]) -> Any:
    rows = function(_rows(found))
    return wrap(found.layout, rows) if hasattr(found, "layout") else rows[..., 0]


def _refused(x: Any, found: Any, without: Any, wrap: Callable[[Layout, Any], Any]) -> Any:
    """Return the inverses with NaN for elements that have none; raise if there is a single one, unless it is NaN."""
    if not x.shape and np.isfinite(x.values).all():
        raise ZeroDivisorError(
            "inverse", f"{x}, whose determinant is 0 up to rounding", "an invertible element",
            "in an array, such elements give NaN",
        )  # fmt: skip
    return _mapped(found, lambda rows: np.where(np.asarray(without)[..., None], np.nan, rows), wrap)
