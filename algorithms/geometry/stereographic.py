"""The stereographic projection of the unit sphere from its pole, and its inverse, in any dimension."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, real_array

_ON_SPHERE = 1e-6
"""Squares of lengths may differ so much from 1; float32 gives 1e-7."""


def stereographic_projection(points: ArrayLike) -> Reals:
    """The points of the equator's plane that are on a line with the pole and points of the unit sphere.

    The pole is the last basis vector ``e``. With ``x = p + z e`` the image is ``p / (1 - z)``; this is the inversion in
    the sphere about the pole through the equator, which keeps angles and takes circles to circles and lines.

    Parameters
    ----------
    points : array_like, (..., n + 1)
        On the unit sphere, the pole's coordinate last.

    Returns
    -------
    array, (..., n)
        Infinite for the pole itself, each coordinate; not a number where a coordinate is not.

    Raises
    ------
    TypeError, ValueError
        Where these are not arrays of real numbers with at least two coordinates, or a square is not 1 to 1e-6.

    Notes
    -----
    Near the pole ``1 - z`` is taken as ``p**2 / (1 + z)``, so that no digits are lost: images are right to 1e-15 of
    their size (`tests/geometry/test_stereographic.py`).
    """
    array = real_array(points, "points")
    if not array.ndim or array.shape[-1] < 2:
        raise ValueError(f"points: shape {array.shape}; expected (..., n + 1), n at least 1, points of the unit sphere")
    squares = (array * array).sum(-1)
    if (np.abs(squares - 1) > _ON_SPHERE).any():
        worst = float(squares[np.abs(squares - 1) > _ON_SPHERE].flat[0])
        raise ValueError(f"points: a square of {worst:.6g}; expected points of the unit sphere")
    flat, height = array[..., :-1], array[..., -1:]
    square = (flat * flat).sum(-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.where(height > 0, flat / (square / (1 + height)), flat / (1 - height))
    pole = (square == 0) & (height > 0)
    return np.asarray(np.where(pole, array.dtype.type(np.inf), found))


def inverse_stereographic_projection(points: ArrayLike) -> Reals:
    """The points of the unit sphere that `stereographic_projection` takes to points of a plane or space.

    ``x = (2 y + (y**2 - 1) e) / (y**2 + 1)``; the part of the conformal embedding of `y` that is a unit vector.

    Parameters
    ----------
    points : array_like, (..., n)
        Of any size; where a coordinate is infinite the result is the pole.

    Returns
    -------
    array, (..., n + 1)
        The pole's coordinate last; of length 1 to rounding.

    Raises
    ------
    TypeError, ValueError
        Where these are not arrays of real numbers with at least one coordinate.
    """
    array = real_array(points, "points")
    if not array.ndim or array.shape[-1] < 1:
        raise ValueError(f"points: shape {array.shape}; expected (..., n), n at least 1")
    largest = np.abs(array).max(-1, keepdims=True)
    outside = largest > 1
    with np.errstate(divide="ignore", invalid="ignore", under="ignore"):
        scaled = array / np.where(outside, largest, 1)
        # outside, the same formula for y / y**2, whose point is the mirror image at the equator
        inner = np.where(outside, scaled / (scaled * scaled).sum(-1, keepdims=True) / largest, array)
        inner = np.where(np.isinf(largest), array.dtype.type(0), inner)
        square = (inner * inner).sum(-1, keepdims=True)
        height = np.where(outside, 1 - square, square - 1) / (1 + square)
        return np.asarray(np.concatenate([2 * inner / (1 + square), height], -1))
