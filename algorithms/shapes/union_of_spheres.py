"""The union of spheres: spheres through four neighbouring points of a surface (section 22.1.1)."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import ArrayLike

from generated import sphere_models

from ..arguments import Reals
from ..precision import NEGLIGIBLE
from .rasterising import checked_mask, checked_spacing

_EQUAL = 6
"""Decimals, in edges of voxels, of centres and radii that count as equal."""


def union_of_spheres(mask: ArrayLike, spacing: ArrayLike = (1, 1, 1), *, distinct: bool = True) -> Reals:
    """Return the spheres (k, 4) through the corners of the Delaunay tetrahedra of the boundary voxels.

    Spheres with their centre outside the object are removed. No boundary voxel is inside a sphere.

    Parameters
    ----------
    mask : array_like, three axes
        The object, where voxels are not zero.
    spacing : array_like, (3,), optional
        The edges of a voxel, and the unit of the result.
    distinct : bool, optional
        Whether to return one of the equal spheres of tetrahedra with more than four corners on a sphere. On a grid most
        are such; published counts include all of them.

    Raises
    ------
    ValueError
        If the boundary voxels are in a plane, so that there are no tetrahedra.
    """
    inside, edges = checked_mask(mask), checked_spacing(spacing)
    border = inside & ~scipy.ndimage.binary_erosion(inside)
    points = np.argwhere(border) * edges
    try:
        corners = points[scipy.spatial.Delaunay(points).simplices]
    except (scipy.spatial.QhullError, ValueError):
        raise ValueError(
            f"mask: {len(points)} boundary voxels without a tetrahedron; expected an object with three dimensions"
        ) from None
    # Relative to the first corner, because squares of distances from a far origin lose digits.
    origin = corners[:, 0]
    centre, square, volume = sphere_models.circumsphere(
        np.zeros(3), *np.moveaxis(corners[:, 1:] - origin[:, None], 1, 0)
    )
    place = np.rint((np.asarray(centre) + origin) / edges)
    regular = np.abs(volume) > NEGLIGIBLE * np.prod(edges)
    regular &= ((place >= 0) & (place < inside.shape)).all(1)
    regular[regular] = inside[tuple(place[regular].astype(int).T)]
    balls = np.column_stack([np.asarray(centre) + origin, np.sqrt(np.maximum(square, 0))])[regular]
    if distinct and len(balls):
        _, first = np.unique(np.round(balls / edges.min(), _EQUAL), axis=0, return_index=True)
        balls = balls[np.sort(first)]
    return np.asarray(balls)
