"""Radial distortion of a lens: pixels of pinhole cameras and the pixels at which they are seen."""

from __future__ import annotations

import numpy as np

from ..arguments import Reals

_STEPS = 20
"""Number of steps of the iteration that removes distortion; each reduces the error by about 2 k r**2."""


def distorted_pixels(pixels: Reals, intrinsics: Reals, coefficient: float) -> Reals:
    """Return where a lens shows the pixels (..., 2) of a pinhole camera: ``1 + k r**2`` times normalised coordinates.

    Parameters
    ----------
    pixels : array, (..., 2)
    intrinsics : array, (3, 3)
    coefficient : float
        The coefficient k, for normalised coordinates.
    """
    if not coefficient:
        return pixels
    seen = _normalised(pixels, intrinsics)
    return _in_pixels(seen * (1 + coefficient * np.square(seen).sum(-1, keepdims=True)), intrinsics)


def undistorted_pixels(pixels: Reals, intrinsics: Reals, coefficient: float) -> Reals:
    """Return the pixels (..., 2) of a pinhole camera that a lens shows at given pixels: see `distorted_pixels`.

    Pixels that the lens shows for no point, as they are beyond the turning point of the polynomial, are NaN.
    """
    if not coefficient:
        return pixels
    bent = _normalised(pixels, intrinsics)
    seen = bent
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            seen = bent / (1 + coefficient * np.square(seen).sum(-1, keepdims=True))
        squares = np.square(seen).sum(-1, keepdims=True)
        again = seen * (1 + coefficient * squares)
    # The iteration ends between two values where there is no solution.
    is_found = (np.abs(again - bent).max(-1, keepdims=True) < 1e-9) & (1 + 3 * coefficient * squares > 0)
    return _in_pixels(np.where(is_found, seen, np.nan), intrinsics)


def _normalised(pixels: Reals, intrinsics: Reals) -> Reals:
    inverse = np.linalg.inv(intrinsics)
    return np.asarray(pixels @ inverse[:2, :2].T + inverse[:2, 2])


def _in_pixels(places: Reals, intrinsics: Reals) -> Reals:
    return np.asarray(places @ intrinsics[:2, :2].T + intrinsics[:2, 2])
