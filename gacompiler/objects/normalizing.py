"""Normalization of elements, and detection of elements whose norm is zero up to rounding."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..algebra.layout import Layout
from ..algebra.versors import norm_squared
from ..errors import ZeroDivisorError
from ..gac_runtime.array_element import Element
from ..rings.polynomial import PolynomialRing
from .caches import cached_by_name
from .definitions import has_scalar_square

SMALL, LARGE = 1e-200, 1e200
"""Squared norms between these limits neither overflow nor lose precision by underflow."""
ROUNDINGS = 4
"""Rounding error of a squared norm, in units in the last place of the sum of its terms' absolute values."""


@cached_by_name
def _squared_norm(layout: Layout) -> tuple[tuple[float, tuple[int, ...]], ...]:
    """Return the terms of the scalar part of ``x ~x``, each a factor and the indices of the stored coefficients."""
    ring = PolynomialRing()
    element = layout.element([ring.variable(f"x{k}") for k in range(layout.size)])
    polynomial = ring.lift(norm_squared(element).scalar)
    return tuple((float(factor), tuple(monomial)) for monomial, factor in polynomial.terms.items())


@cached_by_name
def largest_factor(layout: Layout) -> float:
    """Return the largest sum of absolute factors of a coefficient in ``x ~x``, or 0 if that is not a quadratic form."""
    sums = [0.0] * layout.size
    for factor, places in _squared_norm(layout):
        if len(places) != 2:
            return 0.0
        for place in places:
            sums[place] += abs(factor) / 2
    return max(sums)


def _measured(layout: Layout, coefficients: Sequence[Any]) -> tuple[Any, Any]:
    """Return the squared norm and the sum of the absolute values of its terms, for numbers or arrays."""
    total: Any = 0.0
    size: Any = 0.0
    for factor, places in _squared_norm(layout):
        term = factor
        for place in places:
            term = term * coefficients[place]
        total, size = total + term, size + abs(term)
    return total, size


def range_exponents(layout: Layout, values: np.ndarray[Any, Any]) -> np.ndarray[Any, Any] | None:
    """Return the exponents of elements whose squares are too large or too small for doubles, and 0 for others.

    The result is None if there are no such elements, or if they cannot be scaled because a coefficient is fixed.
    """
    if layout.fixed or layout.implied:
        return None
    largest = np.max(np.abs(values), axis=-1, initial=0.0)
    with np.errstate(all="ignore"):
        _, exponents = np.frexp(largest)
        far = np.isfinite(largest) & ((largest < SMALL**0.25) | (largest > LARGE**0.25))
    return np.where(far, exponents, 0) if np.any(far) else None


@cached_by_name
def is_simple(layout: Layout) -> bool:
    """Whether ``x ~x`` is a number for every element, so that ``~x / (x ~x)`` has an error of a few roundings.

    Layouts with more blades than vectors and a number are not examined in many dimensions, where that takes long.
    """
    n = layout.algebra.dimension
    return (n <= 5 or layout.size <= n + 1) and has_scalar_square(layout)


@cached_by_name
def limits_of_divisor(layout: Layout) -> bytes:
    """Return what the extension compares in place of `is_clearly_not_null`; empty if ``x ~x`` is no quadratic form."""
    if layout.fixed or layout.implied or not is_simple(layout) or not largest_factor(layout):
        return b""
    terms = [(factor, *places) for factor, places in _squared_norm(layout)]
    limits = (SMALL, LARGE, ROUNDINGS * sys.float_info.epsilon)
    return np.array([limits, *terms], float).tobytes()


def is_clearly_not_null(layout: Layout, numbers: Sequence[float], epsilon: float = sys.float_info.epsilon) -> bool:
    """Whether ``x ~x`` of a single element is in the range of doubles, and not 0 up to rounding; fast."""
    total, size = _measured(layout, numbers)
    return bool(SMALL < size < LARGE and abs(total) > ROUNDINGS * epsilon * size)


def is_null(layout: Layout, values: np.ndarray[Any, Any], limit: float | None = None) -> np.ndarray[Any, Any]:
    """Whether ``x ~x`` is 0 up to rounding, or the limit, for each element with squares in the range of doubles."""
    if limit is None:
        limit = ROUNDINGS * float(np.finfo(values.dtype).eps)
    with np.errstate(all="ignore"):
        total, size = _measured(layout, list(np.moveaxis(values, -1, 0)))
        return np.broadcast_to(np.isfinite(size) & (np.abs(total) <= limit * size), values.shape[:-1])


def normalized(x: Element, run: Callable[[Any], Any], wrap: Callable[[Layout, Any], Any]) -> Any:
    """Divide `x` by its norm.

    Parameters
    ----------
    x : MultivectorArray
    run : callable
        The compiled normalization.
    wrap : callable
        Creates objects from a layout and coefficients.

    Returns
    -------
    MultivectorArray
        The normalized elements; NaN for null elements of an array.

    Raises
    ------
    ZeroDivisorError
        If `x` is a single null element.
    """
    layout, values = x.layout, x.values
    if values.dtype.kind == "c":
        return run(x)
    if values.ndim == 1 and is_clearly_not_null(layout, values.tolist(), float(np.finfo(values.dtype).eps)):
        return run(x)
    exponents = range_exponents(layout, values)
    scaled = values if exponents is None else np.ldexp(values, -exponents[..., None])
    null = is_null(layout, scaled)
    if values.ndim == 1 and null:
        raise ZeroDivisorError("normalize", f"{x}, which is null: x ~x = 0", "an element whose norm is not 0")
    if not _squared_norm(layout):
        return wrap(layout, np.full_like(values, np.nan))
    found = run(x if scaled is values else wrap(layout, scaled))
    if not np.any(null):
        return found
    if not hasattr(found, "layout"):  # numbers
        return np.where(null, np.nan, found)
    return wrap(found.layout, np.where(null[..., None], np.nan, found.values))
