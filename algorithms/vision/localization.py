"""Where a camera stands: its pose from points of space that are known, and their pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import projective2

from ..arguments import Reals, real_array
from .chance import Freedom
from .normalization import homogeneous
from .pose_refinement import best_poses, camera_motors, pose_status, refined_poses
from .pose_starts import three_points
from .robust import Problem, check_sampling, consensus
from .status import VisionStatus, check_points

_STEPS = 200
_FREEDOM = Freedom(sample_size=3, parameters=6, codimension=2, solutions=4, false_alarms=1e-2)


@dataclass(frozen=True, slots=True, eq=False)
class Localization:
    """The pose of a camera, and how well points determine it."""

    pose: Reals
    """(8,) The unit motor from the camera frame to the world frame; NaN where the status is not OK."""
    status: VisionStatus
    residual: float
    """The root of the mean square of the distances of pixels, in pixels, over inliers."""
    inliers: Reals
    """(n,) bool"""


def localize(
    points: ArrayLike,
    pixels: ArrayLike,
    intrinsics: ArrayLike,
    threshold: float | None = None,
    seed: int = 0,
    confidence: float = 0.999,
    max_samples: int = 10000,
) -> Localization:
    """Return the pose from which a camera sees points in given pixels, with the least squares of distances in the image.

    This is the perspective-n-point problem (PnP, resection). Linear equations for points in space and for points near a
    plane, and for few points those of three, give starts; Levenberg and Marquardt's steps on the manifold of motors
    lead from each to a minimum, and the least one with all points before the camera is taken. Coordinates are taken
    about the centroid of the points: the world may have its origin anywhere.

    Parameters
    ----------
    points : array_like, (n, 3)
        World coordinates of four and more points, in space or on a plane, in any unit of length.
    pixels : array_like, (n, 2)
    intrinsics : array_like, (3, 3)
        As in `Camera`.
    threshold : float, optional
        Where given, in pixels: the distance from which a pixel counts as wrong. Then random samples of three points
        find the points that agree.
    seed : int
        Of the random samples.
    confidence : float
        With which a sample without wrong points is among those drawn, between 0 and 1.
    max_samples : int
        At least 1.

    Returns
    -------
    Localization
        OK promises that a minimum was reached, that all points (of the inliers) lie before the camera, that they
        determine the pose, and that what is left is an image of them: of random pixels one set in a thousand passes,
        and never one that leaves more than 3 % of the squares of pixels about their centroid. TOO_FEW for less than
        four different points, DEGENERATE for points on a line and others that leave the pose open, NOT_CONVERGED where
        the best pose breaks one of the other promises; NO_CONSENSUS, with `threshold`, where no pose has more inliers
        than chance would give.

    Raises
    ------
    TypeError, ValueError
        If these are not as many points as pixels, `intrinsics` is not upper triangular and regular, `threshold` is
        not positive, `confidence` not between 0 and 1, or `max_samples` less than 1.

    Notes
    -----
    With half a pixel of noise, on boards of 9 x 6 points bent by 0 to 5 mm, on 4 to 12 points of any thickness and with
    origins up to 1e6 units away, errors are those of the best of OpenCV's IPPE and SQPNP after its own refinement.
    """
    places, image = real_array(points, "points", (3,), "x y z"), real_array(pixels, "pixels", (2,), "x y")
    k = checked_intrinsics(intrinsics)
    if threshold is not None:
        check_sampling(threshold, confidence, max_samples)
    status = check_points({"points": places, "pixels": image}, 4, "points")
    if status != VisionStatus.OK:
        return _nothing(status, len(places))
    places, image = places.astype(np.float64), image.astype(np.float64)
    centroid = places.mean(0)
    about = places - centroid
    seen = np.asarray(projective2.transform_point(np.linalg.inv(k), image))
    if threshold is None:
        inliers = np.ones(len(places), bool)
        found = best_poses(about[None], image[None], seen[None], k, _STEPS)
    else:
        problem = _problem(about, image, seen, k)
        estimate = consensus(problem, threshold, seed, confidence, max_samples)
        if estimate.status != VisionStatus.OK:
            return _nothing(estimate.status, len(places))
        inliers = estimate.inliers
        found = refined_poses(estimate.model[None], about[None, inliers], image[None, inliers], k, _STEPS)
    status = VisionStatus(int(pose_status(found, about[None, inliers], image[None, inliers])[0]))
    if status != VisionStatus.OK:
        return _nothing(status, len(places))
    pose = camera_motors(found.matrix, centroid[None])[0]
    return Localization(pose, status, float(np.sqrt(found.cost[0] / inliers.sum())), inliers)


def _nothing(status: VisionStatus, n_points: int) -> Localization:
    return Localization(np.full(8, np.nan), status, np.nan, np.zeros(n_points, bool))


def _problem(places: Reals, image: Reals, seen: Reals, k: Reals) -> Problem:
    """Poses [R | t] from samples of three points, for points about their centroid."""

    def solve(sets: Reals) -> Reals:
        return three_points(places[sets], seen[sets]).reshape(-1, 3, 4)

    def distances(models: Reals, points: Reals, pixels: Reals) -> Reals:
        in_camera = np.einsum("mij,nj->mni", models, homogeneous(points))
        with np.errstate(divide="ignore", invalid="ignore"):
            off = np.linalg.norm(in_camera[..., :2] / in_camera[..., 2:] @ k[:2, :2].T + k[:2, 2] - pixels, axis=-1)
        return np.where(in_camera[..., 2] > 0, off, np.inf)

    def improve(model: Reals, inliers: Reals) -> Reals | None:
        if inliers.sum() < 4:
            return None
        return np.asarray(refined_poses(model[None], places[None, inliers], image[None, inliers], k, _STEPS).matrix[0])

    return Problem(places, image, _FREEDOM, solve, distances, improve)


def checked_intrinsics(intrinsics: ArrayLike) -> Reals:
    """Return the matrix K; ValueError where it is not one."""
    k = real_array(intrinsics, "intrinsics", (3, 3), "the matrix K")
    if k.ndim != 2 or not np.isfinite(k).all() or np.tril(k, -1).any() or not np.diag(k).all():
        raise ValueError("intrinsics: not an upper triangular matrix with inverse; expected that of a camera")
    return np.asarray(k / k[2, 2])
