"""Motions of a camera between two images of a plane, from their homography."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import camera_poses

from ..arguments import Reals, real_array
from ..precision import ROOT
from .camera import Camera, pinhole_pixels
from .localization import intrinsics_of_camera
from .normalization import homogeneous
from .status import VisionStatus, check_points, one_set, refuse


class PlaneMotions(NamedTuple):
    """Result of `motions_of_plane`."""

    motors: Reals
    """(m, 8) Unit motors, in the order of `generated.pga3`, that map coordinates of the first camera to those of the
    second, in units of the distance of the plane from the first camera; m is 1 or 2."""
    normals: Reals
    """(m, 3) Unit normals of the plane in the frame of the first camera, away from it."""


def motions_of_plane(
    homography: ArrayLike,
    camera: Camera | ArrayLike,
    second_camera: Camera | ArrayLike | None = None,
    *,
    pixels: ArrayLike | None = None,
) -> PlaneMotions:
    """Return the motions between two views of a plane from their homography (`decomposeHomographyMat`).

    Two planes and motions have the same homography. Pixels can rule out one of them: that of which a point would be
    behind the first camera.

    Parameters
    ----------
    homography : array_like, (3, 3)
        The matrix, of any scale, that maps pixels of the first image to those of the second, without distortion.
    camera : Camera or array_like, (3, 3)
        The first camera, or its matrix K. The pose of a `Camera` is not used.
    second_camera : Camera or array_like, (3, 3), optional
        The second camera; by default the first.
    pixels : array_like, (n, 2), optional
        Pixels of the plane in the first image. By default, the plane is seen in the principal point.

    Returns
    -------
    PlaneMotions
        One motion if both coincide, as for a rotation, or if pixels rule out the other one.

    Raises
    ------
    TypeError, ValueError
        If an array has the wrong shape.
    DegenerateError
        If the matrix is singular or not finite, or if no plane in front of the camera contains all pixels.

    Notes
    -----
    Errors of 10,000 random motions were below 2e-14. Where both solutions nearly coincide, they grow to the square root
    of the error of the matrix.
    """
    matrix = real_array(homography, "homography", (3, 3), "a homography").astype(np.float64)
    k, other = (intrinsics_of_camera(each) for each in (camera, camera if second_camera is None else second_camera))
    inner = np.linalg.inv(other) @ matrix @ k
    if matrix.ndim != 2:
        raise ValueError(f"homography: shape {matrix.shape}; expected (3, 3), one homography")
    expected = "a finite homography with an inverse"
    if not np.isfinite(inner).all():
        refuse(VisionStatus.NOT_FINITE, "motions_of_plane", expected)
    if np.linalg.cond(inner) > 1 / np.finfo(float).eps:
        refuse(VisionStatus.DEGENERATE, "motions_of_plane", expected)
    seen = np.array([[0.0, 0, 1]])
    if pixels is not None:
        seen = homogeneous(np.atleast_2d(one_set(pinhole_pixels(camera, pixels, "pixels")[1]))) @ np.linalg.inv(k).T
        refuse(
            check_points({"pixels": seen}, 1, "pixels"), "motions_of_plane", "finite pixels of the plane, at least one"
        )
    *motors, normals = camera_poses.motions_of_homography(inner, seen.mean(0))
    found, possible = np.array(motors), (seen @ normals.T > 0).all(0)
    if not possible.any():
        refuse(VisionStatus.DEGENERATE, "motions_of_plane", "pixels of a plane in front of the camera")
    found, normals = found[possible], normals[possible]
    if len(found) == 2 and np.abs(found[0] - found[1] * np.sign(found[0] @ found[1])).max() < ROOT:
        found, normals = found[:1], normals[:1]
    return PlaneMotions(found, normals)
