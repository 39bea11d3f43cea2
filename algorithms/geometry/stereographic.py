"""The stereographic projection of the unit sphere from its pole, and its inverse, in any dimension."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, real_array
from ..precision import SINGLE


def stereographic_projection(points: ArrayLike) -> Reals:
    """Project points of the unit sphere from the pole to the plane of the equator.

    The pole is the last basis vector ``e``. The image of ``x = p + z e`` is ``p / (1 - z)``. This is the inversion in
    the sphere about the pole through the equator. It preserves angles and maps circles to circles and lines.

    Parameters
    ----------
    points : array_like, (..., n + 1)
        On the unit sphere, the pole's coordinate last.

    Returns
    -------
    array, (..., n)
        All coordinates of the image of the pole are infinite. NaN coordinates give NaN.

    Raises
    ------
    TypeError, ValueError
        If `points` is not an array of real numbers with at least two coordinates, or a squared length differs from 1 by
        more than 1e-6.

    Notes
    -----
    Near the pole ``1 - z`` is computed as ``p**2 / (1 + z)`` to avoid cancellation. The relative error of images is
    1e-15 (`tests/geometry/test_stereographic.py`).
    """
    array = real_array(points, "points", (-1,), "points")
    if not array.ndim or array.shape[-1] < 2:
        raise ValueError(f"points: shape {array.shape}; expected (..., n + 1), n at least 1, points of the unit sphere")
    squares = (array * array).sum(-1)
    if (np.abs(squares - 1) > SINGLE).any():
        worst = float(squares[np.abs(squares - 1) > SINGLE].flat[0])
        raise ValueError(f"points: a squared length of {worst:.6g}; expected points of the unit sphere")
    flat, height = array[..., :-1], array[..., -1:]
    square = (flat * flat).sum(-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.where(height > 0, flat / (square / (1 + height)), flat / (1 - height))
    pole = (square == 0) & (height > 0)
    return np.asarray(np.where(pole, array.dtype.type(np.inf), found))


def inverse_stereographic_projection(points: ArrayLike) -> Reals:
    """Return the points of the unit sphere whose stereographic projections are given points.

    ``x = (2 y + (y**2 - 1) e) / (y**2 + 1)``, the normalised conformal embedding of `y` without its last component.

    Parameters
    ----------
    points : array_like, (..., n)
        Points of any size. If a coordinate is infinite the result is the pole.

    Returns
    -------
    array, (..., n + 1)
        Unit vectors up to rounding, the pole's coordinate last.

    Raises
    ------
    TypeError, ValueError
        If `points` is not an array of real numbers with at least one coordinate.
    """
    array = real_array(points, "points", (-1,), "points")
    if not array.ndim or array.shape[-1] < 1:
        raise ValueError(f"points: shape {array.shape}; expected (..., n), n at least 1")
    largest = np.abs(array).max(-1, keepdims=True)
    outside = largest > 1
    with np.errstate(divide="ignore", invalid="ignore", under="ignore"):
        scaled = array / np.where(outside, largest, 1)
        # for long vectors, the same formula for y / y**2, whose point is the mirror image in the equator
        inner = np.where(outside, scaled / (scaled * scaled).sum(-1, keepdims=True) / largest, array)
        inner = np.where(np.isinf(largest), array.dtype.type(0), inner)
        square = (inner * inner).sum(-1, keepdims=True)
        height = np.where(outside, 1 - square, square - 1) / (1 + square)
        return np.asarray(np.concatenate([2 * inner / (1 + square), height], -1))
