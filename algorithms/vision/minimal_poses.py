"""All poses of a camera that sees three points (P3P)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from generated import camera_poses, projective2

from ..arguments import Reals, real_array
from ..precision import SINGLE
from .camera import Camera, pinhole_pixels
from .localization import intrinsics_of_camera
from .pose_refinement import OPEN, camera_motors
from .pose_starts import three_points
from .robust import ALL
from .status import VisionStatus, check_points, refuse

_STEPS = 10.0
"""A limit on work: steps that remove the rounding errors of a pose."""
_SAME = 1e-5
"""From floating point: poses that differ by less are those of one double root."""


def poses_of_three_points(points: ArrayLike, pixels: ArrayLike, camera: Camera | ArrayLike) -> Reals:
    """Return all poses of a camera that sees three points in given pixels (P3P, `solveP3P`).

    Parameters
    ----------
    points : array_like, (3, 3)
        World coordinates.
    pixels : array_like, (3, 2)
    camera : Camera or array_like, (3, 3)
        A camera, whose pose is not used, or its matrix K.

    Returns
    -------
    array, (m, 8)
        Unit motors from the camera frame to the world frame, m from 0 to 4, with all points in front of the camera.

    Raises
    ------
    TypeError, ValueError
        If an array has the wrong shape.
    DegenerateError
        If coordinates are not finite, or if the points are on a line.

    Notes
    -----
    All of 10,000 random scenes had the true pose, 99.9 % of them to 3e-10, and the others, near double roots, to 1e-4.
    """
    places = real_array(points, "points", (3,), "x y z").astype(np.float64)
    matrix, image = pinhole_pixels(camera, pixels, "pixels")
    k = intrinsics_of_camera(matrix)
    status = check_points({"points": places, "pixels": image}, 3, "points")
    if places.shape != (3, 3):
        raise ValueError(f"points: shape {places.shape}; expected (3, 3), three points")
    refuse(status, "poses_of_three_points", "three finite points and their pixels")
    image = image.astype(np.float64)
    centroid = places.mean(0)
    centred = places - centroid
    extents = np.linalg.svd(centred, compute_uv=False)
    if extents[1] <= OPEN * extents[0]:
        refuse(VisionStatus.DEGENERATE, "poses_of_three_points", "three points that are not on a line")
    found = three_points(centred, np.asarray(projective2.transform_point(np.linalg.inv(k), image)))
    found = found[np.isfinite(found).all((1, 2))]
    found = np.asarray(camera_poses.descend_pose(found, k, centred, image, ALL, _STEPS)[0])
    squares = np.asarray(camera_poses.pixel_squares(found, k, centred, image))
    found = found[(squares <= (SINGLE * abs(k[0, 0])) ** 2).all(1)]
    kept = list[int]()
    for j, pose in enumerate(found):
        size = float(np.linalg.norm(pose[:, 3]))
        if all(np.abs(pose - found[i]).max() > _SAME * max(size, 1) for i in kept):
            kept.append(j)
    return camera_motors(found[kept], np.broadcast_to(centroid, (len(kept), 3)))
