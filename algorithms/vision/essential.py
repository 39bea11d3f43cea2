"""Essential matrices of five pairs, or of eight or more, and their motions."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from generated import projective2, relative_poses

from ..arguments import Reals, real_array
from .camera import Camera
from .localization import intrinsics_of_camera
from .relative_motions import essential_of_sets
from .relative_pose import undistorted
from .status import VisionStatus, check_points, refuse
from .two_views import fundamental_matrix


def essential_matrices(
    first: ArrayLike,
    second: ArrayLike,
    camera: Camera | ArrayLike,
    second_camera: Camera | ArrayLike | None = None,
) -> Reals:
    """Return all essential matrices that pairs of pixels fit (`relpose_5pt`, `essential_matrix_8pt`).

    Five pairs have up to ten matrices (Nister's five-point problem). Eight or more have the one that is nearest to
    their `fundamental_matrix` by linear equations. `relative_pose` minimises distances, and handles wrong pairs.

    Parameters
    ----------
    first, second : array_like, (n, 2) or (n, 1, 2)
        Pixels of the same points in both images, n either 5 or at least 8.
    camera : Camera or array_like, (3, 3)
        The first camera, or its matrix K. The pose of a `Camera` is not used.
    second_camera : Camera or array_like, (3, 3), optional
        The second camera; by default the first.

    Returns
    -------
    array, (m, 3, 3)
        Matrices E of norm ``sqrt(2)`` with ``x' E x = 0`` for directions x and x' in both cameras.

    Raises
    ------
    TypeError, ValueError
        If there are six or seven pairs, if the numbers of pixels differ, or if a matrix K is invalid.
    DegenerateError
        If there are fewer than five pairs, if pixels are not finite, or if eight or more are those of a plane.
    """
    other = camera if second_camera is None else second_camera
    one, two = undistorted(first, "first", camera), undistorted(second, "second", other)
    status = check_points({"first": one, "second": two}, 5, "points")
    if len(one) in (6, 7):
        raise ValueError(f"first: {len(one)} points; expected five, or eight or more")
    refuse(status, "essential_matrices", "five finite pairs, or eight or more")
    sides = [
        np.asarray(projective2.transform_point(np.linalg.inv(intrinsics_of_camera(each)), pixels))
        for each, pixels in ((camera, one), (other, two))
    ]
    if len(one) == 5:
        return essential_of_sets(sides[0][None], sides[1][None])[0]
    u, _, v = np.linalg.svd(fundamental_matrix(sides[0], sides[1], refine=False))
    return np.asarray((u[:, :2] @ v[:2])[None])


def motions_of_essential(essential: ArrayLike) -> Reals:
    """Return the four motions of an essential matrix (`decomposeEssentialMat`).

    Pairs decide between them: points are in front of both cameras for one of the four, as in `relative_pose`.

    Parameters
    ----------
    essential : array_like, (..., 3, 3)
        Of any norm and sign.

    Returns
    -------
    array, (..., 4, 8)
        Unit motors that map coordinates of the first camera to those of the second, with translations of length 1.

    Raises
    ------
    TypeError, ValueError
        If the shape differs.
    DegenerateError
        If a number is not finite, or a matrix is 0.
    """
    matrix = real_array(essential, "essential", (3, 3), "an essential matrix").astype(np.float64)
    expected = "finite matrices that are not 0"
    if not np.isfinite(matrix).all():
        refuse(VisionStatus.NOT_FINITE, "motions_of_essential", expected)
    largest = np.abs(matrix).max((-2, -1), keepdims=True)
    if not largest.all():
        refuse(VisionStatus.DEGENERATE, "motions_of_essential", expected)
    matrix = matrix / largest
    sizes = np.linalg.norm(matrix, axis=(-2, -1), keepdims=True)
    return np.stack(relative_poses.motions_of_essential(np.sqrt(2) / sizes * matrix), -2)
