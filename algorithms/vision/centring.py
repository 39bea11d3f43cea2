"""Coordinates relative to a place of the scene, so that no digits are lost far from the origin of the world.

The sum of products of large coordinates cancels in brackets and in products with camera matrices. Differences of nearby
coordinates are exact in floating point, so that a translation to one of the places removes this error.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3, projective3

from ..arguments import Reals
from ..precision import EIGENVALUE
from .camera import Camera, camera_matrix


def centred_cameras(cameras: Sequence[Camera | ArrayLike], names: Sequence[str] | str) -> tuple[list[Reals], Reals]:
    """Return the matrices (..., 3, 4) of cameras relative to the centre of the first one, and this centre (..., 3).

    The centre is 0 if the first camera is at infinity, or has none. `names` are those of the cameras in messages, or
    that of the sequence.
    """
    if isinstance(names, str):
        names = [f"{names}[{k}]" for k in range(len(cameras))]
    if all(isinstance(each, Camera) for each in cameras):
        for each, name in zip(cameras, names, strict=True):
            camera_matrix(each, name)  # refuses distortion
        frames = np.array([pga3.motor_to_matrix(each.pose) for each in cameras])  # type: ignore[union-attr]
        place = frames[0, :3, 3].copy()
        frames[:, :3, 3] -= place
        back = np.swapaxes(frames[:, :3, :3], 1, 2)
        rows = np.concatenate([back, -back @ frames[:, :3, 3:]], 2)
        return [each.intrinsics @ row for each, row in zip(cameras, rows, strict=True)], place  # type: ignore[union-attr]
    matrices = [camera_matrix(each, name) for each, name in zip(cameras, names, strict=True)]
    centre = projective3.camera_centre(matrices[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        place = centre[..., :3] / centre[..., 3:]
        is_far = np.abs(centre[..., 3:]) <= EIGENVALUE * np.abs(centre).max(-1, keepdims=True)
    place = np.where(is_far | ~np.isfinite(place), 0, place)
    moved = [np.concatenate([m[..., :3], m[..., 3:] + m[..., :3] @ place[..., None]], -1) for m in matrices]
    return moved, place


def centred_points(points: Reals) -> Reals:
    """Return points (..., n, d) relative to the first one, in units of a power of two near their extent.

    Projective invariants of the results are the same, and neither step rounds if the points are near each other.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        moved = points - points[..., :1, :]
        size = np.abs(moved).max((-1, -2), keepdims=True)
    usable = np.isfinite(size) & (size > 0)
    return np.asarray(np.ldexp(moved, -np.frexp(np.where(usable, size, 1))[1]))
