"""Descriptors of images of hands, which rotations about the centre shift cyclically."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arguments import Reals, real_array
from ..wavelets.checks import image_stack

SECTORS, _RINGS, _DIRECTIONS = 36, 5, 8
"""The shape of a descriptor: sectors and rings about the centre of the hand, and directions of edges."""
_SIGMA = 0.015
"""Standard deviation of the smoothing of images, as a share of their side."""


def hand_descriptor(images: ArrayLike) -> Reals:
    """Compute polar histograms of the gradients of images of hands.

    Parameters
    ----------
    images : array_like, (..., M, N)
        Grey images, at least 16 x 16.

    Returns
    -------
    array, (..., 36, 5, 8)
        The magnitudes of gradients by sector of 10 degrees, ring, and direction, modulo 180 degrees, relative to the
        radius. A rotation of the image by 10 degrees is a cyclic shift of the sectors, see `turned_descriptor`; a
        change of the contrast has no influence. Square roots of shares in neighbourhoods of sectors.

    Raises
    ------
    TypeError, ValueError
        If `images` is not an array of finite real numbers with two axes, has channels, is too small, or an image is the
        same everywhere.
    """
    array = image_stack(images, "images")
    height, width = array.shape[-2:]
    if min(height, width) < 16:
        raise ValueError(f"images: {height} x {width} pixels; expected at least 16 x 16")
    if (np.ptp(array, axis=(-2, -1)) == 0).any():
        raise ValueError("images: one is the same everywhere; expected images of hands")
    flat = array.reshape(-1, height, width).astype(np.float64, copy=False)
    found = np.stack([_histogram(image) for image in flat])
    return found.reshape(*array.shape[:-2], *found.shape[1:])


def turned_descriptor(descriptor: ArrayLike, sectors: int) -> Reals:
    """Return the descriptor of images that are rotated by a number of sectors, from x to y."""
    array = real_array(descriptor, "descriptor").astype(float)
    if array.shape[-3:] != (SECTORS, _RINGS, _DIRECTIONS):
        raise ValueError(f"descriptor: shape {array.shape}; expected (..., {SECTORS}, {_RINGS}, {_DIRECTIONS})")
    if isinstance(sectors, bool) or not isinstance(sectors, (int, np.integer)):
        raise TypeError(f"sectors: {sectors!r}; expected a whole number")
    return np.roll(array, sectors, -3)


def _histogram(image: Reals) -> Reals:
    height, width = image.shape
    sigma = _SIGMA * min(height, width)
    gy, gx = (scipy.ndimage.gaussian_filter(image, sigma, order) for order in ((1, 0), (0, 1)))
    y, x = np.mgrid[:height, :width]
    y, x = y - (height - 1) / 2, x - (width - 1) / 2
    r = np.hypot(x, y) / (min(height, width) / 2)
    # Pixels outside the largest disc leave the image in rotations.
    inside = (r < 1) & (r > 0.02)
    angle = np.arctan2(y, x)[inside]
    direction = np.arctan2(gy, gx)[inside] - angle
    places = (
        angle / (2 * np.pi) * SECTORS, r[inside] * _RINGS - 0.5, direction / np.pi * _DIRECTIONS
    )  # fmt: skip
    strength = np.hypot(gx, gy)[inside]
    found = np.zeros((SECTORS, _RINGS, _DIRECTIONS))
    lower = [np.floor(p).astype(int) for p in places]
    for corner in np.ndindex(2, 2, 2):
        at = [low + k for low, k in zip(lower, corner, strict=True)]
        weight = strength.copy()
        for p, index in zip(places, at, strict=True):
            weight *= 1 - np.abs(p - index)
        keys = at[0] % SECTORS, np.clip(at[1], 0, _RINGS - 1), at[2] % _DIRECTIONS
        np.add.at(found, keys, weight)
    near = scipy.ndimage.uniform_filter(found.sum(2), (9, 3), mode=("wrap", "nearest"))
    return np.asarray(np.sqrt(found / (near[..., None] + 0.2 * near.mean())))
