"""All poses of a camera that sees three points (P3P), or four with an unknown focal length (P4Pf)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from generated import camera_poses, focal_poses, projective2

from ..arguments import Reals, real_array
from ..precision import ROOT, SINGLE, TINY
from .camera import Camera, pinhole_pixels
from .focal_localization import cameras_of_sets, checked_centre
from .localization import intrinsics_of_camera
from .pose_refinement import camera_motors
from .pose_starts import three_points
from .robust import ALL
from .status import VisionStatus, check_points, one_set, refuse

_STEPS = 10.0
"""A limit on work: steps that remove the rounding errors of a pose."""
_TURNS = 4
"""A limit on work: how often another of the equations of four points is left out."""
_FAR = 100.0
"""A limit on work: steps to a minimum, if the equations of the starts are not all."""
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
    places = one_set(real_array(points, "points", (3,), "x y z")).astype(np.float64)
    matrix, image = pinhole_pixels(camera, pixels, "pixels")
    image = one_set(image)
    k = intrinsics_of_camera(matrix)
    status = check_points({"points": places, "pixels": image}, 3, "points")
    if places.shape != (3, 3):
        raise ValueError(f"points: shape {places.shape}; expected (3, 3), three points")
    refuse(status, "poses_of_three_points", "three finite points and their pixels")
    image = image.astype(np.float64)
    centroid = places.mean(0)
    centred = places - centroid
    extents = np.linalg.svd(centred, compute_uv=False)
    if extents[1] <= ROOT * extents[0]:
        refuse(VisionStatus.DEGENERATE, "poses_of_three_points", "three points that are not on a line")
    found = three_points(centred, np.asarray(projective2.transform_point(np.linalg.inv(k), image)))
    found = found[np.isfinite(found).all((1, 2))]
    found = np.asarray(camera_poses.descend_pose(found, k, centred, image, ALL, _STEPS)[0])
    squares = np.asarray(camera_poses.pixel_squares(found, k, centred, image))
    found = found[(squares <= (SINGLE * abs(k[0, 0])) ** 2).all(1)]
    kept = _different(found)
    return camera_motors(found[kept], np.broadcast_to(centroid, (len(kept), 3)))


def _different(poses: Reals) -> list[int]:
    """Return which poses (m, 3, 4) differ from all before them."""
    kept = list[int]()
    for j, pose in enumerate(poses):
        size = float(np.linalg.norm(pose[:, 3]))
        if all(np.abs(pose - poses[i]).max() > _SAME * max(size, 1) for i in kept):
            kept.append(j)
    return kept


def cameras_of_four_points(points: ArrayLike, pixels: ArrayLike, centre: ArrayLike) -> tuple[Reals, Reals, Reals]:
    """Return all poses and focal lengths of a camera that sees four points in given pixels (P4Pf).

    Four points give eight equations for seven unknowns. Eight cameras, some of them complex, solve seven of these. From
    those of several choices of seven, steps lead to minima of the squares of distances in the image. Exact pixels leave
    a residual of 0 in one of them, rarely in several. `localize_unknown_focal` judges such cameras for five or more
    points.

    Parameters
    ----------
    points : array_like, (4, 3)
        World coordinates, in space or on a plane.
    pixels : array_like, (4, 2)
        Of a camera with square pixels and no distortion.
    centre : array_like, (2,)
        The principal point, in pixels: usually the middle of the image.

    Returns
    -------
    poses : array, (m, 8)
        Unit motors from the camera frame to the world frame, with all points in front of the camera; the one with the
        least residual first.
    focals : array, (m,)
        In pixels.
    residuals : array, (m,)
        Root mean square distances of the pixels.

    Raises
    ------
    TypeError, ValueError
        If an array has the wrong shape, or if `centre` is not a finite point.
    DegenerateError
        If coordinates are not finite, or if the points are on a line.

    Notes
    -----
    With half a pixel of noise, the minimum near the true camera is among the results in 299 of 300 scenes with points
    in space, and in 289 of 300 with points of a tilted plane.
    """
    places = one_set(real_array(points, "points", (3,), "x y z")).astype(np.float64)
    image = one_set(real_array(pixels, "pixels", (2,), "x y in pixels")).astype(np.float64)
    middle = checked_centre(centre)
    status = check_points({"points": places, "pixels": image}, 4, "points")
    if places.shape != (4, 3):
        raise ValueError(f"points: shape {places.shape}; expected (4, 3), four points")
    refuse(status, "cameras_of_four_points", "four finite points and their pixels")
    centroid, image = places.mean(0), image - middle
    extents = np.linalg.svd(places - centroid, compute_uv=False)
    if extents[1] <= ROOT * extents[0]:
        refuse(VisionStatus.DEGENERATE, "cameras_of_four_points", "four points that are not on a line")
    unit, size = float(extents[0]), max(float(np.sqrt((image**2).sum(1).mean())), TINY)
    places = (places - centroid) / unit
    starts = cameras_of_sets(np.stack([places] * _TURNS), np.stack([image] * _TURNS), size, every=True)
    found, focals, _, numbers = focal_poses.descend_camera(starts, places, image, ALL, _FAR)
    poses, focals, costs = (np.asarray(each) for each in (found, focals, numbers[:, 0]))
    in_front = (places @ poses[:, 2, :3, None])[..., 0] + poses[:, 2, 3:] > 0
    order = np.argsort(costs)
    usable = in_front.all(1) & (costs < ALL) & (numbers[:, 1] > 0) & (focals * SINGLE < size)
    order = order[usable[order]]
    kept = order[_different(poses[order])]
    rows = poses[kept] * [1, 1, 1, unit]
    return (
        camera_motors(rows, np.broadcast_to(centroid, (len(kept), 3))),
        focals[kept],
        np.sqrt(costs[kept] / 4),
    )
