"""Checks of masks and balls, and balls drawn into volumes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, finite, moderate, real_array, unmasked

Mask = NDArray[np.bool_]

MOST_VOXELS = 2**29
"""Voxels of the largest accepted volume; computations need about 16 bytes for each."""


def checked_mask(mask: ArrayLike) -> Mask:
    """Return a volume as booleans, true where a voxel is not zero.

    Raises
    ------
    TypeError
        If the elements are not real numbers.
    ValueError
        If there are not three axes, a number is not finite, no voxel is set, or the volume is too large.
    """
    array = np.asarray(unmasked(mask, "mask"))
    if array.dtype.kind not in "biuf":
        raise TypeError(f"mask: dtype {array.dtype}; expected booleans or real numbers")
    if array.ndim != 3:
        raise ValueError(f"mask: shape {array.shape}; expected three axes")
    if array.size > MOST_VOXELS:
        need = array.size * 16 / 2**30
        raise ValueError(
            f"mask: shape {array.shape} has {array.size} voxels, which need about {need:.0f} GiB; expected at most "
            f"{MOST_VOXELS}; crop the volume, or use every second voxel"
        )
    if array.dtype.kind == "f":
        finite(array, "mask")
    found = array if array.dtype == bool else array != 0
    if not found.any():
        raise ValueError(f"mask: no voxel of shape {array.shape} is set; expected an object")
    return np.asarray(found)


def checked_spacing(spacing: ArrayLike) -> Reals:
    """Return the lengths of the edges of a voxel, which must be positive."""
    edges = finite(real_array(spacing, "spacing", (3,), "the edges of a voxel").astype(float), "spacing")
    if edges.shape != (3,) or not (edges > 0).all():
        raise ValueError(f"spacing: {edges.tolist()}; expected three positive lengths")
    return edges


def checked_balls(balls: ArrayLike, name: str = "balls") -> Reals:
    """Return rows of centres and radii as floats; radii must not be negative."""
    rows = moderate(finite(real_array(balls, name, (4,), "centre and radius").astype(float), name), name)
    if rows.ndim != 2:
        raise ValueError(f"{name}: shape {rows.shape}; expected (k, 4), centres and radii")
    if (rows[:, 3] < 0).any():
        at = int(np.argmax(rows[:, 3] < 0))
        raise ValueError(f"{name}: radius {rows[at, 3]} in row {at}; expected radii of at least 0")
    return rows


def ball_in_grid(
    centre: Reals, radius: float, shape: tuple[int, ...], spacing: Reals
) -> tuple[tuple[slice, slice, slice], Mask]:
    """Return the part of a grid around a ball, and which of its voxels have their centre inside the ball."""
    low = np.clip(np.ceil((centre - radius) / spacing), 0, shape).astype(int)
    high = np.maximum(np.minimum(np.floor((centre + radius) / spacing) + 1, shape).astype(int), low)
    i, j, k = ((np.arange(a, b) * h - c) ** 2 for a, b, h, c in zip(low, high, spacing, centre, strict=True))
    # One comparison of the whole box: the sum of the squares is needed in a plane only.
    inside = i[:, None, None] < radius * radius - (j[:, None] + k)
    return (slice(low[0], high[0]), slice(low[1], high[1]), slice(low[2], high[2])), inside


def filled(balls: ArrayLike, shape: tuple[int, int, int], spacing: ArrayLike = (1, 1, 1)) -> Mask:
    """Draw balls into a volume: true for voxels with their centre inside a ball.

    Parameters
    ----------
    balls : array_like, (k, 4)
        Centres and radii, in the unit of the spacing; the centre of the first voxel is the origin.
    shape : tuple of int
        The shape of the volume.
    spacing : array_like, (3,), optional
        The edges of a voxel.
    """
    rows, edges = checked_balls(balls), checked_spacing(spacing)
    volume = np.zeros(shape, bool)
    for row in rows:
        part, inside = ball_in_grid(row[:3], float(row[3]), shape, edges)
        volume[part] |= inside
    return volume


def overlap(a: Mask, b: Mask) -> float:
    """Return the number of voxels in both volumes divided by that in either."""
    either = np.count_nonzero(a | b)
    return np.count_nonzero(a & b) / either if either else 1.0
