"""Calibration of a camera under a tracker: hand-eye calibration with a tracked body as the hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import real_array
from .camera import Camera
from .hand_eye import hand_eye_from_poses
from .hand_eye_results import HandEyeOfPoses
from .localization import localize
from .status import VisionStatus

_FEWEST = 3
"""Number of poses that determine the result."""


def calibrate_endoscope(
    bodies: ArrayLike, points: ArrayLike, views: ArrayLike, intrinsics: ArrayLike | Camera
) -> HandEyeOfPoses:
    """Estimate the pose of an endoscope camera in the frame of the body on it that a tracker observes.

    Images of a pattern give the poses of the camera (`localize`); `hand_eye_from_poses` computes the result.

    Parameters
    ----------
    bodies : array_like, (n, 8)
        Unit motors from the frame of the body to the frame of the tracker, one for each image.
    points : array_like, (m, 3)
        Points of the pattern, in its own frame and the tracker's unit of length.
    views : array_like, (n, m, 2)
        Their pixels.
    intrinsics : array_like, (3, 3), or Camera
        As in `localize`; without a lens, pixels are those of a pinhole camera.

    Returns
    -------
    HandEyeOfPoses
        X from the camera to the body, and Z from the pattern to the tracker. Points that were not seen, which are not
        finite, are left out, and so are images that do not determine the pose of the camera, and those without a pose
        of the body; `inliers` says which images were used. The status is NOT_FINITE if fewer than three are left.

    Raises
    ------
    TypeError, ValueError
        If arguments have different shapes or types.
    """
    images = real_array(views, "views", (-1, -1, 2), "images, points, x y")
    motors = real_array(bodies, "bodies", (-1, 8), "motors")
    if images.ndim != 3 or motors.ndim != 2 or len(images) != len(motors):
        raise ValueError(f"views: shape {images.shape}; expected ({len(motors)}, m, 2), one image for each body")
    places = real_array(points, "points", (images.shape[1], 3), "x y z")
    if places.ndim != 2:
        raise ValueError(f"points: shape {places.shape}; expected ({images.shape[1]}, 3), those of one pattern")
    seen = np.asarray(np.isfinite(images).all(-1) & np.isfinite(places).all(-1))
    found = [localize(places[some], image[some], intrinsics) for image, some in zip(images, seen, strict=True)]
    poses = np.reshape([each.pose for each in found], (len(found), 8))
    used = np.array([each.status == VisionStatus.OK for each in found], bool) & np.isfinite(motors).all(1)
    if used.sum() < _FEWEST:
        used[:] = True  # The status then says that a pose is missing.
    result = hand_eye_from_poses(motors[used], poses[used], noise="hand")
    inliers = np.zeros(len(used), np.bool_)
    inliers[used] = result.inliers
    return replace(result, inliers=inliers)
