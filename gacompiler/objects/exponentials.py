"""Exponentials with many blades, computed by products of objects; a single kernel would need a million operations.

The method is that of `gacompiler.frontend.scaling`: a Taylor polynomial followed by squarings, the first of which use
double-word arithmetic. Here the number of squarings depends on the arguments, so that these can be arbitrarily large.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from ..algebra.layout import Layout
from ..frontend.scaling import HEAD, PLAIN, SCALED, TAYLOR, weights
from ..gac_runtime.array_element import Element
from .caches import cached_by_name
from .tables import product_table

MOST_VECTORS = 5
"""Dimension of an algebra up to which every exponential is one kernel."""
LARGEST = 16
"""Number of coefficients up to which an exponential is one kernel; one of 32 takes ten seconds to compile."""
FEW = 1 << 14
"""Number of coefficients up to which products are computed by a table. Beyond it a kernel is worth its compilation."""
RESIDUAL = 2.0**-36
"""Largest difference between the exponential of a logarithm and the versor, relative to the largest coefficient. The
rounding error of boosts grows with the square of their coefficients, and exceeds it if these are several hundreds."""
_MOST = 1100
"""Largest number of squarings for arguments that are doubles."""


@cached_by_name
def layout_of_exponential(layout: Layout) -> Layout | None:
    """Return the layout of exponentials that are computed by products; None if they are one kernel."""
    vectors, blades = 0, sorted(layout.support)
    for blade in blades:
        vectors |= blade
    even = all(blade.bit_count() % 2 == 0 for blade in blades)
    if 1 << (vectors.bit_count() - even) <= LARGEST:
        return None
    return layout.algebra.even if even else layout.algebra.full


@cache
def _weights(layout: Layout) -> tuple[tuple[str, float], ...]:
    """Return weights of the blades other than 1 for which the weighted sum of squares bounds the norm of products."""
    algebra, blades = layout.algebra, sorted(layout.support - {0})
    found = zip(blades, weights(algebra, blades), strict=True)
    return tuple((algebra.spelling(blade)[1], float(weight)) for blade, weight in found)


def exponential(x: Element, whole: Layout, wrap: Callable[[Layout, Any], Any]) -> Any:
    """Compute ``exp(x)`` in a layout that is closed under products."""
    start = np.stack([np.broadcast_to(x[name], x.shape) for name in whole.blades], -1).astype(float)
    table = product_table(whole, whole) if start.size <= FEW else None
    scalar = whole.blades.index("1")
    factor = np.exp(start[..., scalar])
    start[..., scalar] = 0

    def product(a: Any, b: Any) -> Any:
        if table is not None:
            return table.product(a, b)
        found = wrap(whole, a) * wrap(whole, b)
        assert found.layout == whole
        return found.values

    with np.errstate(over="ignore", invalid="ignore"):
        size = np.sqrt(sum(weight * np.square(np.asarray(x[name], float)) for name, weight in _weights(x.layout)))
        largest = np.max(size, where=np.isfinite(size), initial=0.0)
        squarings = PLAIN + max(int(np.frexp(largest / float(SCALED))[1]) - PLAIN, 0)
        small = np.ldexp(start, -min(squarings, _MOST))
        rest = _beyond_first(small, product, scalar)
        head = _head(small + rest)
        tail = (small - head) + rest
        for _ in range(squarings - PLAIN):
            square = product(head, head)
            error = 2 * tail + product(head, tail) + product(tail, head + tail)
            following = _head(2 * head + square + error)
            head, tail = following, ((2 * head - following) + square) + error
        y = head + tail
        for _ in range(PLAIN):
            y = 2 * y + product(y, y)
        y[..., scalar] += 1
        return wrap(whole, factor[..., None] * y)


def longer(versor: Any, logarithm: Any, wrap: Callable[[Layout, Any], Any]) -> Any:
    """Return the logarithm of versors with a negative scalar part, given that of their negatives.

    With a part ``B`` that is a unit plane of rotation, ``exp(-pi B)`` is -1. The result is NaN where there is no such
    part, or where it is not determined: for -1, for equal angles in two planes, and for a plane that is known from
    rounding errors alone. This is so if the exponential of the result is not the versor.
    """
    negative = np.broadcast_to(np.asarray(versor["1"]) < 0, logarithm.shape)
    if not np.any(negative):
        return logarithm
    values = np.atleast_2d(logarithm.values).copy()
    chosen = np.atleast_1d(negative)
    with np.errstate(all="ignore"):
        short = wrap(logarithm.layout, values[chosen])
        long = (short - np.pi * _plane_of(short)).as_layout(logarithm.layout)
        given = np.stack([np.broadcast_to(versor[name], logarithm.shape) for name in versor.layout.blades], -1)
        given, power = np.atleast_2d(given)[chosen], long.exp()
        found = np.stack([np.broadcast_to(power[name], long.shape) for name in versor.layout.blades], -1)
        size = np.max(np.abs(given), axis=-1)
        right = np.max(np.abs(found - given), axis=-1) <= RESIDUAL * size
        values[chosen] = np.where(right[:, None], np.asarray(long.values), np.nan)
    return wrap(logarithm.layout, values.reshape(logarithm.values.shape))


def _plane_of(b: Any) -> Any:
    """Return the unit plane of the largest angle of rotation in bivectors over up to five basis vectors, or NaN.

    For ``b = b1 + b2`` with commuting parts whose squares are ``x1 < x2``, ``b b`` is ``s + p`` with ``s = x1 + x2``
    and ``p = 2 b1 b2``. Then ``p p = 4 x1 x2``, and ``x1 b - p b / 2 = (x1 - x2) b1``.
    """
    s, p = -b.norm_squared(), b ^ b
    squared = s * s - (p.norm_squared() if isinstance(p, type(b)) else 0.0)
    # Its rounding error is eps s**2, so that half of the digits of its root are right above this limit.
    difference = np.where(squared > s * s * np.sqrt(np.finfo(np.float64).eps), np.sqrt(squared), np.nan)
    x1 = (s - difference) / 2
    part = x1 * b - (p * b / 2).grade(2) if isinstance(p, type(b)) else x1 * b
    return part / (-difference * np.sqrt(-x1))


def _beyond_first(x: Any, product: Callable[[Any, Any], Any], scalar: int) -> Any:
    """Compute ``exp(x) - 1 - x`` by Horner's rule."""
    one = np.zeros(x.shape[-1])
    one[scalar] = 1
    found = np.broadcast_to(float(TAYLOR[-1]) * one, x.shape)
    for coefficient in TAYLOR[-2:1:-1]:
        found = product(x, found) + float(coefficient) * one
    return product(x, product(x, found))


def _head(x: Any) -> Any:
    """Round coefficients to about twenty bits, with the same unit for all coefficients of an element."""
    shift = float(HEAD) * np.max(np.abs(x), axis=-1, keepdims=True)
    return (x + shift) - shift
