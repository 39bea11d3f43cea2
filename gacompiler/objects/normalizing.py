"""Unit elements along given ones, and which have none: elements whose norm is zero, up to rounding."""

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
"""Squared norms between these lose nothing to the smallest and the largest doubles."""
ROUNDINGS = 4
"""So many units of the last place, of the terms of a squared norm, are rounding."""


@cache
def _squared_norm(layout: Layout) -> tuple[tuple[float, tuple[int, ...]], ...]:
    """The terms of the scalar part of ``x ~x``: a number, and the places of the stored coefficients in the product."""
    ring = PolynomialRing()
    element = layout.element([ring.variable(f"x{k}") for k in range(layout.size)])
    polynomial = ring.lift(norm_squared(element).scalar)
    return tuple((float(factor), tuple(monomial)) for monomial, factor in polynomial.terms.items())


def _measured(layout: Layout, coefficients: Sequence[Any]) -> tuple[Any, Any]:
    """The squared norm, and the sum of the sizes of its terms: of numbers, or of arrays one for each coefficient."""
    total: Any = 0.0
    size: Any = 0.0
    for factor, places in _squared_norm(layout):
        term = factor
        for place in places:
            term = term * coefficients[place]
        total, size = total + term, size + abs(term)
    return total, size


def _in_range(layout: Layout, values: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Elements along the given ones whose squares are neither too large nor too small for doubles."""
    if layout.fixed or layout.implied:
        return values
    largest = np.max(np.abs(values), axis=-1, initial=0.0)
    with np.errstate(all="ignore"):
        _, exponents = np.frexp(largest)
        far = np.isfinite(largest) & ((largest < SMALL**0.25) | (largest > LARGE**0.25))
    return np.ldexp(values, -np.where(far, exponents, 0)[..., None]) if np.any(far) else values


def normalized(x: Elements, run: Callable[[Any], Any], wrap: Callable[[Layout, Any], Any]) -> Any:
    """`x` divided by its norm.

    Parameters
    ----------
    x : MultivectorArray
    run : callable
        The compiled quotient.
    wrap : callable
        Objects from a layout and coefficients.

    Returns
    -------
    MultivectorArray
        Not a number where an element of an array is null.

    Raises
    ------
    ZeroDivisorError
        When `x` is a single null element.
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
