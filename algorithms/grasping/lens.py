"""Radial distortion of a lens: pixels of pinhole cameras and the pixels at which they are seen."""

from __future__ import annotations

import numpy as np

from ..arguments import Reals

_STEPS = 6
"""Number of Newton steps that remove distortion."""


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
    x, y = bent[..., 0], bent[..., 1]
    squares = x * x + y * y
    # Newton steps for the factor f of normalised coordinates, ``f + k f**3 r**2 = 1``.
    scaled, factor = coefficient * squares, np.ones_like(squares)
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            cubed = scaled * factor * factor
            factor = factor - (factor + cubed * factor - 1) / (1 + 3 * cubed)
        cubed = scaled * factor * factor
        is_found = (np.abs(factor + cubed * factor - 1) < 1e-9) & (1 + 3 * cubed > 0) & (factor > 0)
    return _in_pixels(bent * np.where(is_found, factor, np.nan)[..., None], intrinsics)


def _normalised(pixels: Reals, intrinsics: Reals) -> Reals:
    inverse = np.linalg.inv(intrinsics)
    return np.asarray(pixels @ inverse[:2, :2].T + inverse[:2, 2])


def _in_pixels(places: Reals, intrinsics: Reals) -> Reals:
    return np.asarray(places @ intrinsics[:2, :2].T + intrinsics[:2, 2])
