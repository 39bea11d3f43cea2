"""Initial poses of cameras, from linear equations and from three points, for least squares in the image.

Points are given relative to their centroid, so that the effect of noise on rotations does not depend on the origin of
the world. All functions take leading axes.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from generated import camera_poses, linear_views, matrices, projective2

from ..arguments import Reals
from .normalization import homogeneous

FEW = 7
"""Number of points up to which linear equations are ill-conditioned or underdetermined; triples are tried too."""
_TRIPLES = 10
"""A limit on work: the number of triples of few points whose poses are starts."""


def pose_starts(places: Reals, image: Reals, k: Reals) -> Reals:
    """Return candidates [R | t] (..., s, 3, 4) for centred points (..., n, 3) and their pixels (..., n, 2).

    Two candidates are for points near a plane and agree with its homography to first order, one is for points in space
    (n at least 6), and for few points the best of those that fit three points exactly are added. Missing ones are NaN.
    """
    n = places.shape[-2]
    found = np.asarray(linear_views.starts_of_pose(places, image, k))
    if n > FEW:
        return found
    seen = np.asarray(projective2.transform_point(np.linalg.inv(k), image))
    return np.concatenate([found if n >= 6 else found[..., :2, :, :], _from_triples(places, seen)], -3)


def reversed_pose(pose: Reals, places: Reals) -> Reals:
    """Return poses (..., 3, 4) whose plane of largest extent is mirrored in the plane orthogonal to the line of sight.

    Both have the same image under parallel projection (Necker reversal): the other minimum of the distances in the
    image is near the reversed pose of points that are in a plane, and are small or distant.
    """
    return np.asarray(linear_views.reversed_pose(pose, places))


def three_points(places: Reals, seen: Reals) -> Reals:
    """Return the four [R | t] (..., 4, 3, 4) of three points (..., 3, 3) with images (..., 3, 2); missing ones are NaN.

    For complex roots, which noise makes of double roots, the real part is used.
    """
    poses, is_there = camera_poses.poses_of_three(places, seen)
    return np.where(np.asarray(is_there)[..., None, None] > 0, poses, np.nan)


def linear_camera_and_gap(places: Reals, pixels: Reals) -> tuple[Reals, float]:
    """Return the camera matrix of one set of points, and the ratio of the eleventh to the first singular value."""
    equations, left, right = linear_views.camera_equations(places, pixels)
    entries, gap, _ = matrices.null_vector(equations.reshape(*equations.shape[:-3], -1, 12))
    return np.asarray(linear_views.camera_of_entries(entries, left, right)), float(gap)


def _from_triples(places: Reals, seen: Reals) -> Reals:
    """Return the poses (..., 4, 3, 4) of triples with all points in front of the camera and the least residuals."""
    every = np.array(list(combinations(range(places.shape[-2]), 3)))
    triples = every[np.linspace(0, len(every) - 1, min(_TRIPLES, len(every))).round().astype(int)]
    found = three_points(places[..., triples, :], seen[..., triples, :])
    found = found.reshape(*places.shape[:-2], -1, 3, 4)
    in_camera = homogeneous(places)[..., None, :, :] @ np.swapaxes(found, -1, -2)
    with np.errstate(all="ignore"):
        off = ((in_camera[..., :2] / in_camera[..., 2:] - seen[..., None, :, :]) ** 2).sum((-1, -2))
    off = np.where((in_camera[..., 2] > 0).all(-1), off, np.inf)
    best = np.argsort(off, axis=-1)[..., :4]
    return np.take_along_axis(found, best[..., None, None], -3)
