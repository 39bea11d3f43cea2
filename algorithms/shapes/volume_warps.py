"""Volumes and masks moved by registered models of spheres."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arguments import Reals
from ..scaling import back_in_range
from .images import image_in_range
from .rasterising import checked_spacing
from .sphere_matching import SphereRegistration

_STEP = 4
"""Voxels between the points at which the map is evaluated; it is interpolated between them."""


def warp_volume(
    volume: ArrayLike,
    back: SphereRegistration,
    shape: tuple[int, int, int],
    spacing: ArrayLike = (1, 1, 1),
    to_spacing: ArrayLike | None = None,
) -> Reals:
    """Move a volume by a registration, onto the grid of another volume.

    The value of each voxel of the result is looked up in the volume, so that the map has to lead back.

    Parameters
    ----------
    volume : array_like, three axes
        Booleans or real numbers.
    back : SphereRegistration
        The map from the other volume to this one: ``register_spheres(balls_of_other, balls_of_volume)``.
    shape : tuple of int
        Of the other volume.
    spacing, to_spacing : array_like, (3,), optional
        The edges of the voxels of the volume, and of the other one, which are the same by default.

    Returns
    -------
    array
        Booleans for booleans, otherwise numbers by linear interpolation, and 0 for what is outside of the volume. They
        are float32, or float64 if the numbers are far from the range of float32.
    """
    values, exponent = image_in_range(volume, "volume", (3,))
    edges = checked_spacing(spacing)
    others = edges if to_spacing is None else checked_spacing(to_spacing)
    if len(shape) != 3 or min(shape) < 1:
        raise ValueError(f"shape: {tuple(shape)}; expected three positive numbers of voxels")
    coarse = tuple(-(-(n - 1) // _STEP) + 1 for n in shape)
    grid = np.moveaxis(np.indices(coarse), 0, -1) * (_STEP * others)
    places = back.warp(grid.reshape(-1, 3)).reshape(grid.shape) / edges
    result = np.empty(shape, np.float32)
    inner = np.stack(np.meshgrid(*(np.arange(n) / _STEP for n in shape[1:]), indexing="ij"))
    for i in range(shape[0]):
        # One slice at a time, because coordinates need much more memory than the volume.
        at = np.concatenate([np.full((1, *inner.shape[1:]), i / _STEP), inner])
        sources = [scipy.ndimage.map_coordinates(places[..., axis], at, order=1, mode="nearest") for axis in range(3)]
        result[i] = scipy.ndimage.map_coordinates(values.astype(np.float32, copy=False), sources, order=1)
    if values.dtype == np.bool_:
        return result > 0.5
    return back_in_range(result.astype(float), np.array(exponent), "volume") if exponent else result
