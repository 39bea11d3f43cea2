"""The vector derivative of multivector fields on regular grids, by finite differences or by Fourier transforms."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..arguments import real_array
from .products import bitmaps_of

Floats = NDArray[np.float64]
_BLOCK = 1 << 14
"""Number of coefficients that remain in a cache."""
PARTS = ("whole", "outer", "inner")


def grid_derivative(
    values: ArrayLike,
    spacing: ArrayLike,
    order: int | str = 2,
    *,
    periodic: bool = True,
    part: str = "whole",
    squares: ArrayLike | None = None,
) -> Floats:
    """Compute the vector derivative ``D F = sum e^k d_k F`` of a field on a grid of n axes, in any signature.

    Applied twice, it is the Laplacian or the wave operator. For scalars the outer part is the gradient; for vectors the
    inner part is the divergence and the outer part the curl, as a bivector.

    Parameters
    ----------
    values : array_like, (*grid, 2**n)
        Coefficients by grade, each grade ordered by bitmap: the order of full layouts such as that of
        ``vga3.geometric_product``, with the vectors of blades ascending.
    spacing : array_like, (n,)
        Distance of neighbours along each axis.
    order : 2, 4 or "spectral"
        Order of the error in the spacing; "spectral" is exact for resolved frequencies and requires a periodic field.
    periodic : bool, optional
        If False, one-sided differences of the same order are used at the ends.
    part : "whole", "outer" or "inner"
        ``D F``, ``D ^ F`` or ``D . F``.
    squares : array_like, (n,), optional
        Squares of the basis vectors, 1 or -1; the default is 1 for all.

    Returns
    -------
    array, (*grid, 2**n)

    Raises
    ------
    TypeError, ValueError
        If shapes are inconsistent, if steps are not positive, if options are unknown, or if an axis has fewer points
        than the differences require.
    """
    steps = real_array(spacing, "spacing", (-1,), "steps along the axes").astype(np.float64, copy=False)
    n = len(steps)
    if steps.ndim != 1 or not n or not (steps > 0).all():
        raise ValueError(f"spacing: {steps.tolist()}; expected positive steps, one for each axis")
    array = real_array(values, "values", (*(-1,) * n, 1 << n), f"multivectors on a grid of {n} axes")
    if array.ndim != n + 1 or not array.size:
        expected = f"{n} axes of at least one point, and {1 << n} coefficients"
        raise ValueError(f"values: shape {array.shape}; expected {expected}")
    array = np.ascontiguousarray(array, np.float64)
    signs = real_array(np.ones(n) if squares is None else squares, "squares", (n,), "squares of vectors")
    if part not in PARTS:
        raise ValueError(f"part: {part!r}; expected one of {', '.join(PARTS)}")
    if order not in (2, 4, "spectral") or (order == "spectral" and not periodic):
        raise ValueError(f"order: {order!r}; expected 2, 4 or, for periodic fields, 'spectral'")
    if not (np.abs(signs) == 1).all():
        raise ValueError(f"squares: {signs.tolist()}; expected 1 and -1")
    out = np.zeros_like(array)
    for axis, step in enumerate(steps):
        target, sign = _multiplied(n, axis, part, float(signs[axis]))
        length = array.shape[axis]
        shape = (int(np.prod(array.shape[:axis])), length, int(np.prod(array.shape[axis + 1 : n])), 1 << n)
        if order == "spectral":
            out[..., target] += sign * _spectral(array, axis, step)
        else:
            at, weight = _stencils(length, int(order), periodic)
            _add(array.reshape(shape), at, weight / step, target, sign, out.reshape(shape))
    return out


def _spectral(array: Floats, axis: int, step: float) -> Floats:
    length = array.shape[axis]
    wave = 2j * np.pi * scipy.fft.rfftfreq(length, step)
    if length % 2 == 0:
        wave[-1] = 0.0
    wave = wave.reshape([-1 if k == axis else 1 for k in range(array.ndim)])
    return np.asarray(scipy.fft.irfft(wave * scipy.fft.rfft(array, axis=axis), length, axis=axis))


@cache
def _multiplied(n: int, axis: int, part: str, square: float) -> tuple[NDArray[np.int64], Floats]:
    """Return the place and the sign of each coefficient after multiplication by the reciprocal vector of an axis."""
    bitmaps = bitmaps_of(n)
    at = np.empty(1 << n, np.int64)
    at[bitmaps] = np.arange(1 << n)
    sign = 1.0 - 2.0 * (np.bitwise_count(bitmaps & ((1 << axis) - 1)) & 1)
    inside = (bitmaps >> axis & 1).astype(bool)
    # the reciprocal vector is e_k / e_k**2, and e_k e_k is e_k**2
    sign[~inside] *= square
    if part != "whole":
        sign[inside if part == "outer" else ~inside] = 0.0
    return at[bitmaps ^ (1 << axis)], sign


@cache
def _stencils(length: int, order: int, periodic: bool) -> tuple[NDArray[np.int64], Floats]:
    """Return, for each point, the indices and weights whose weighted sum is the derivative at spacing 1."""
    if length == 1 and periodic:
        return np.zeros((1, 1), np.int64), np.zeros((1, 1))
    if length <= order:
        raise ValueError(f"values: an axis of {length} points; expected {order + 1} or more for order {order}")
    half = order // 2
    middle = np.arange(length)
    first = middle - half if periodic else np.clip(middle - half, 0, length - 1 - order)
    at = first[:, None] + np.arange(order + 1)
    weight = np.array([_weights(tuple((row - i).tolist())) for i, row in enumerate(at)])
    return at % length, weight


@cache
def _weights(offsets: tuple[int, ...]) -> Floats:
    """Return the weights of the derivative at 0 of the polynomial through values at integers."""
    powers = np.vander(offsets, increasing=True).T
    found = np.linalg.solve(powers, np.eye(len(offsets))[1])
    return np.asarray(np.where(np.abs(found) < 1e-12, 0.0, found))


def _add(
    values: Floats, at: NDArray[np.int64], weight: Floats, target: NDArray[np.int64], sign: Floats, out: Floats
) -> None:
    """Add differences along the second of four axes to ``out``, a few lines at a time, to use the cache."""
    outer, length, inner, size = values.shape
    source = np.argsort(target)
    factors = sign[source]
    several, step = (max(1, _BLOCK // (k * inner * size)) for k in (length, 1))
    # Ranges of points with equal stencils, which nearly all points have.
    starts = [
        0,
        *(np.flatnonzero((np.diff(weight, axis=0) != 0).any(1) | (np.diff(at, axis=0) != 1).any(1)) + 1),
        length,
    ]
    parts = [(i, min(i + step, stop)) for start, stop in pairwise(starts) for i in range(start, stop, step)]
    for o in range(0, outer, several):
        for start, stop in parts:
            total: Any = 0.0
            for k in np.flatnonzero(weight[start]):
                first = at[start, k]
                total = total + weight[start, k] * values[o : o + several, first : first + stop - start]
            if isinstance(total, np.ndarray):
                out[o : o + several, start:stop] += factors * np.take(total, source, -1)
