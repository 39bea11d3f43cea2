"""The motion that satisfies the equations of all pixels and is smooth except at few places.

Loops are written for numba by hand: successive overrelaxation is a stencil that works in place, which is no kernel.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.ndimage
from numba import njit

from ..arguments import Reals

_KNEE = 0.04**2
"""Squared difference of motions of neighbours, in pixels, beyond which a jump costs its size instead of its square."""
_DEGREES = 4.0
"""Of freedom of the t distribution of residuals: equations that fit badly count little."""
_ROUNDS = 3
"""In each of which weights are computed from the motion so far."""
_SWEEPS = 12
"""Of all pixels in each round; more change the motion little, as it is followed from coarse to fine."""
_FILLING = 90
"""Sweeps for hidden pixels, as their motion comes from far."""
_OVER = 1.7
"""Overrelaxation."""


def solved(sums: Reals, uv: Reals, noise: float, bands: int, stiffness: float) -> Reals:
    """The motion by equations and smoothness.

    Parameters
    ----------
    sums : array, (6, M, N)
        Of `images.phase_equations`, for what is added to `uv`.
    uv : array, (2, M, N)
        The motion so far.
    noise : float
        Squared residual of one band. The larger it is, the farther the neighbours that a motion is taken from.
    bands : int
        How many squared residuals a sum has.
    stiffness : float
        Weight of squared differences of neighbours beside squared residuals in units of the noise.

    Returns
    -------
    array, (2, M, N)

    Notes
    -----
    The least of ``sum w r / noise + stiffness sum rho(difference of neighbours)``, where r is the squared residual,
    ``w = 1 / (1 + r / (bands noise degrees))``, and rho is quadratic for small and linear for large differences
    (Charbonnier et al., *IEEE Trans. Image Processing* 6:298, 1997), by iteratively reweighted least squares and
    successive overrelaxation of pixels in the order of a chessboard, so that no order of rows matters.
    """
    result = uv.copy()
    rows, columns = uv.shape[1:]
    data = np.empty((5, rows, columns), uv.dtype)
    across, down = np.zeros((rows, columns), uv.dtype), np.zeros((rows, columns), uv.dtype)
    for _ in range(_ROUNDS):
        _weighted_data(sums, uv, result, noise, bands * noise * _DEGREES, data)
        _smoothness(result, stiffness, across, down)
        _relax(data, across, down, result, _SWEEPS)
    return result


def filled(uv: Reals, known: Any, image: Reals, contrast: float) -> Reals:
    """The motion, replaced where it is not known by that of neighbours of like brightness.

    Parameters
    ----------
    uv : array, (2, M, N)
    known : array of bool, (M, N)
    image : array, (M, N)
    contrast : float
        The difference of neighbours across which little is taken over.

    Returns
    -------
    array, (2, M, N)
    """
    if known.all() or not known.any():
        return uv
    # Boundaries are right to a pixel or two, so that the next pixels may have the motion of the wrong side.
    sure = scipy.ndimage.binary_erosion(known, iterations=2, border_value=1)
    firm = np.where(sure, np.float32(1e6), np.float32(0))
    data = np.stack([firm, 0 * firm, firm, firm * uv[0], firm * uv[1]])
    across, down = np.zeros_like(image), np.zeros_like(image)
    across[:, :-1] = np.exp(-((np.diff(image, axis=1) / contrast) ** 2) / 2) + 1e-3
    down[:-1] = np.exp(-((np.diff(image, axis=0) / contrast) ** 2) / 2) + 1e-3
    result = uv.copy()
    _relax(data, across, down, result, _FILLING)
    return np.where(known, uv, result)


@njit(cache=True, nogil=True)
def _weighted_data(sums: Any, before: Any, uv: Any, noise: Any, scale: Any, data: Any) -> None:
    """Normal equations of the whole motion: xx, xy, yy of the matrix, and the right-hand sides x and y."""
    rows, columns = uv.shape[1:]
    for y in range(rows):
        for x in range(columns):
            xx, xy, yy = sums[0, y, x], sums[1, y, x], sums[2, y, x]
            bx, by = sums[3, y, x], sums[4, y, x]
            u0, v0 = before[0, y, x], before[1, y, x]
            u, v = uv[0, y, x] - u0, uv[1, y, x] - v0
            left = sums[5, y, x] - 2 * (bx * u + by * v) + xx * u * u + 2 * xy * u * v + yy * v * v
            weight = 1 / (noise * (1 + max(left, 0) / scale))
            data[0, y, x], data[1, y, x], data[2, y, x] = weight * xx, weight * xy, weight * yy
            data[3, y, x] = weight * (bx + xx * u0 + xy * v0)
            data[4, y, x] = weight * (by + xy * u0 + yy * v0)


@njit(cache=True, nogil=True)
def _smoothness(uv: Any, stiffness: Any, across: Any, down: Any) -> None:
    """Weights between each pixel and the next one of its row, and of its column."""
    rows, columns = uv.shape[1:]
    for y in range(rows):
        for x in range(columns):
            if x < columns - 1:
                u, v = uv[0, y, x + 1] - uv[0, y, x], uv[1, y, x + 1] - uv[1, y, x]
                across[y, x] = stiffness / np.sqrt(1 + (u * u + v * v) / _KNEE)
            if y < rows - 1:
                u, v = uv[0, y + 1, x] - uv[0, y, x], uv[1, y + 1, x] - uv[1, y, x]
                down[y, x] = stiffness / np.sqrt(1 + (u * u + v * v) / _KNEE)


@njit(cache=True, nogil=True)
def _relax(data: Any, across: Any, down: Any, uv: Any, sweeps: Any) -> None:
    rows, columns = uv.shape[1:]
    over, tiny = np.float32(_OVER), np.float32(1e-30)
    for sweep in range(2 * sweeps):
        for y in range(rows):
            for x in range((y + sweep) % 2, columns, 2):
                w, p, q = tiny, data[3, y, x], data[4, y, x]
                if x > 0:
                    weight = across[y, x - 1]
                    w, p, q = w + weight, p + weight * uv[0, y, x - 1], q + weight * uv[1, y, x - 1]
                if x < columns - 1:
                    weight = across[y, x]
                    w, p, q = w + weight, p + weight * uv[0, y, x + 1], q + weight * uv[1, y, x + 1]
                if y > 0:
                    weight = down[y - 1, x]
                    w, p, q = w + weight, p + weight * uv[0, y - 1, x], q + weight * uv[1, y - 1, x]
                if y < rows - 1:
                    weight = down[y, x]
                    w, p, q = w + weight, p + weight * uv[0, y + 1, x], q + weight * uv[1, y + 1, x]
                a, b, c = data[0, y, x] + w, data[1, y, x], data[2, y, x] + w
                determinant = a * c - b * b
                if determinant > 0:
                    uv[0, y, x] += over * ((c * p - b * q) / determinant - uv[0, y, x])
                    uv[1, y, x] += over * ((a * q - b * p) / determinant - uv[1, y, x])
