"""Normalization of elements, and detection of elements whose norm is zero up to rounding."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np

from ..algebra.layout import Layout
from ..algebra.versors import norm_squared
from ..errors import ZeroDivisorError
from ..rings.polynomial import PolynomialRing
from .elements import Elements

SMALL, LARGE = 1e-200, 1e200
"""Squared norms between these limits neither overflow nor lose precision by underflow."""
ROUNDINGS = 4
"""Rounding error of a squared norm, in units in the last place of the sum of its terms' absolute values."""


@cache
def _squared_norm(layout: Layout) -> tuple[tuple[float, tuple[int, ...]], ...]:
    """Return the terms of the scalar part of ``x ~x``, each a factor and the indices of the stored coefficients."""
    ring = PolynomialRing()
    element = layout.element([ring.variable(f"x{k}") for k in range(layout.size)])
    polynomial = ring.lift(norm_squared(element).scalar)
    return tuple((float(factor), tuple(monomial)) for monomial, factor in polynomial.terms.items())


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


def _in_range(layout: Layout, values: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Scale elements whose squares are too large or too small for doubles."""
    if layout.fixed or layout.implied:
        return values
    largest = np.max(np.abs(values), axis=-1, initial=0.0)
    with np.errstate(all="ignore"):
        _, exponents = np.frexp(largest)
        far = np.isfinite(largest) & ((largest < SMALL**0.25) | (largest > LARGE**0.25))
    return np.ldexp(values, -np.where(far, exponents, 0)[..., None]) if np.any(far) else values


def normalized(x: Elements, run: Callable[[Any], Any], wrap: Callable[[Layout, Any], Any]) -> Any:
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
    limit = ROUNDINGS * float(np.finfo(values.dtype).eps)
    if values.ndim == 1:
        total, size = _measured(layout, values.tolist())
        if SMALL < size < LARGE and abs(total) > limit * size:
            return run(x)
    scaled = _in_range(layout, values)
    with np.errstate(all="ignore"):
        total, size = _measured(layout, list(np.moveaxis(scaled, -1, 0)))
        null = np.broadcast_to(np.isfinite(size) & (np.abs(total) <= limit * size), values.shape[:-1])
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
