"""Points in space from their pixels in two views, and whether the pixels determine them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import projective3

from ..arguments import Reals, check_pixels, listed
from ..evidence import gate_of, largest_ratio
from ..precision import ROUNDING
from .camera import Camera, pinhole_pixels
from .centring import centred_cameras
from .status import VisionStatus

_SIDE = 0.01
"""From floating point: differences of pixels by this number give slopes of distortion to a millionth."""


@dataclass(frozen=True, slots=True, eq=False)
class Triangulation:
    """Result of `triangulation`."""

    points: Reals
    """(..., 3) World coordinates, also of points that are behind a camera or undetermined."""
    status: Reals
    """(...) int, a `VisionStatus` each: DEGENERATE if the lines of sight are parallel up to the noise, BEHIND if the
    point is behind a camera, NO_CONSENSUS if the lines of sight do not meet within the noise, and NOT_FINITE."""
    deviation: Reals
    """(...) The standard deviation of the distance from the first camera, for the stated noise or for rounding. Divided
    by the square of the distance it is that of the inverse distance, which is normally distributed also far away."""


def triangulate(cameras: Sequence[Camera | ArrayLike], pixels: Sequence[ArrayLike]) -> Reals:
    """Triangulate the points that two cameras see at the given pixels.

    The line of sight in the first camera is intersected with the plane through the centre of the second camera and the
    line in its image through the pixel and perpendicular to the epipolar line. For noisy pixels, the result is the
    point on the first line of sight whose image is nearest to the second pixel. `triangulation` also says whether the
    point is determined and in front of the cameras.

    Parameters
    ----------
    cameras : sequence of Camera or of array_like, (..., 3, 4)
        Two cameras. The distortion of a lens is removed from its pixels first.
    pixels : sequence of array_like, (..., 2)
        One for each camera; leading axes broadcast.

    Returns
    -------
    array, (..., 3)
        World coordinates; not finite if the lines of sight are parallel.

    Raises
    ------
    TypeError, ValueError
        If there are not two cameras and two arrays of pixels.
    """
    one, two, first, second, place = _two(cameras, pixels)
    return np.asarray(_points(one, two, first, second) + place)


def triangulation(
    cameras: Sequence[Camera | ArrayLike], pixels: Sequence[ArrayLike], noise: float | None = None
) -> Triangulation:
    """Triangulate points as `triangulate` does, and test whether the pixels determine them.

    Parameters
    ----------
    cameras : sequence of Camera or of array_like, (..., 3, 4)
        Two cameras. The distortion of a lens is removed from its pixels first.
    pixels : sequence of array_like, (..., 2)
        One for each camera; leading axes broadcast.
    noise : float, optional
        The standard deviation of pixels. By default only rounding errors are taken into account, and pixels that are
        off their epipolar lines are not reported.

    Returns
    -------
    Triangulation

    Raises
    ------
    TypeError, ValueError
        If there are not two cameras and two arrays of pixels, or `noise` is not positive.
    """
    check_pixels(noise, "noise")
    one, two, first, second, place = _two(cameras, pixels)
    views, images = (one, two), (first, second)
    points = _points(one, two, first, second)
    size = np.max([np.abs(image).max(-1) for image in np.broadcast_arrays(*images)], axis=0)
    sigma = np.maximum(ROUNDING * size, np.finfo(float).tiny) if noise is None else np.full(size.shape, float(noise))
    # The larger of the magnifications of both lenses bounds the noise of either image.
    larger = np.broadcast_arrays(size, *map(_magnification, cameras, pixels))[1:]
    sigma = sigma * np.maximum(*larger)
    homogeneous = np.concatenate([points, np.ones((*points.shape[:-1], 1))], -1)
    information, behind = np.zeros((*points.shape, 3)), np.zeros(points.shape[:-1])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for view in views:
            there = (view @ homogeneous[..., None])[..., 0]
            seen = there[..., :2] / there[..., 2:]
            rows = (view[..., :2, :3] - seen[..., :, None] * view[..., 2:, :3]) / there[..., 2:, None]
            information = information + np.swapaxes(rows, -1, -2) @ rows
            behind = behind + (there[..., 2] * np.sign(np.linalg.det(view[..., :3])) < 0)
        centre = projective3.camera_centre(views[0])
        ray = points - centre[..., :3] / centre[..., 3:]
        distance = np.sqrt((ray**2).sum(-1))
        usable = np.isfinite(information).all((-1, -2)) & np.isfinite(distance)
        values, vectors = np.linalg.eigh(np.where(usable[..., None, None], information, np.eye(3)))
        along = np.swapaxes(vectors, -1, -2) @ (ray / distance[..., None])[..., None]
        deviation = sigma * np.sqrt((along[..., 0] ** 2 / np.maximum(values, 0)).sum(-1))
        # The inverse distance of a point that is infinitely far away is 0.
        parallel = ~(deviation * np.sqrt(largest_ratio(1)) < distance)
    status = np.where(behind > 0, VisionStatus.BEHIND, VisionStatus.OK)
    if noise is not None:
        # Four pixel coordinates leave one residual, the distance from the nearest pair whose lines of sight meet.
        off = projective3.sampson_distance(projective3.fundamental_matrix_from_cameras(*views), *images)
        status = np.where(off**2 > gate_of(1) * sigma**2, VisionStatus.NO_CONSENSUS, status)
    status = np.where(parallel | ~usable, VisionStatus.DEGENERATE, status)
    finite = np.isfinite(images[0]).all(-1) & np.isfinite(images[1]).all(-1)
    status = np.where(finite, status, VisionStatus.NOT_FINITE)
    return Triangulation(points + place, status, np.where(usable, deviation, np.inf))


def _two(cameras: Sequence[Camera | ArrayLike], pixels: Sequence[ArrayLike]) -> tuple[Reals, ...]:
    """Return the matrices of two pinhole cameras, the pixels of both, and what the matrices are relative to."""
    cameras, pixels = listed(cameras, "cameras", "two cameras"), listed(pixels, "pixels", "two arrays (..., 2)")
    if len(cameras) != 2 or len(pixels) != 2:
        raise ValueError(f"triangulate: {len(cameras)} cameras, {len(pixels)} arrays of pixels; expected 2 and 2")
    plain = [camera.pinhole if isinstance(camera, Camera) else camera for camera in cameras]
    (one, two), place = centred_cameras(plain, "cameras")
    first, second = (
        pinhole_pixels(camera, part, f"pixels[{k}]")[1]
        for k, (camera, part) in enumerate(zip(cameras, pixels, strict=True))
    )
    return one, two, first, second, place


def _magnification(camera: Camera | ArrayLike, pixels: ArrayLike) -> Reals:
    """Return the factors by which the noise of pixels (..., 2) is larger in the image of the pinhole camera."""
    array = np.asarray(pixels, np.float64)
    if not isinstance(camera, Camera) or camera.distortion is None:
        return np.ones(array.shape[:-1])
    columns = [camera.undistort(array + side) - camera.undistort(array - side) for side in _SIDE * np.eye(2)]
    slope = np.stack(columns, -1) / (2 * _SIDE)
    usable = np.asarray(np.isfinite(slope).all((-1, -2)))
    return np.where(usable, np.linalg.norm(np.where(usable[..., None, None], slope, 0), ord=2, axis=(-2, -1)), np.inf)


def _points(one: Reals, two: Reals, first: Reals, second: Reals) -> Reals:
    homogeneous: Reals = projective3.triangulate(one, two, first, second)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(homogeneous[..., :3] / homogeneous[..., 3:])
