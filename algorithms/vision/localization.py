"""Localization of a camera: its pose from known points in space and their pixels."""

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
    """Result of `localize`: the pose of a camera, and how well points determine it."""

    pose: Reals
    """(8,) The unit motor from the camera frame to the world frame; NaN if the status is not OK."""
    status: VisionStatus
    residual: float
    """The root mean square distance of pixels over the inliers, in pixels."""
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
    """Estimate the pose of a camera from known points and their pixels, by least squares of distances in the image.

    This is the perspective-n-point problem (PnP, resection). Initial poses come from linear equations for points in
    space and for points near a plane, and for few points from triples. Levenberg-Marquardt iterations on the manifold
    of motors lead from each of them to a minimum; the least one with all points in front of the camera is returned.
    Coordinates are taken relative to the centroid of the points, so the origin of the world is arbitrary.

    Parameters
    ----------
    points : array_like, (n, 3)
        World coordinates of at least four points, in space or on a plane, in any unit of length.
    pixels : array_like, (n, 2)
    intrinsics : array_like, (3, 3)
        As in `Camera`.
    threshold : float, optional
        Distance in pixels from which a pixel counts as wrong. If given, inliers are found by random samples of three
        points.
    seed : int
        Seed of the random samples.
    confidence : float
        Probability, between 0 and 1, that a sample without wrong points is drawn.
    max_samples : int
        Maximum number of samples, at least 1.
        At least 1.

    Returns
    -------
    Localization
        The status OK guarantees that a minimum was reached, that all inliers are in front of the camera, that they
        determine the pose, and that the residual is that of an image of them: of random pixels, one set in a thousand
        passes, and never one that leaves more than 3 % of the squares of pixels about their centroid. TOO_FEW is
        returned for fewer than four distinct points, DEGENERATE for points on a line and others that do not determine
        the pose, NOT_CONVERGED if the best pose violates one of the other conditions, and NO_CONSENSUS, with
        `threshold`, if no pose has more inliers than expected by chance.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points and pixels differ, if `intrinsics` is not upper triangular and regular, if `threshold`
        is not positive, if `confidence` is not between 0 and 1, or if `max_samples` is less than 1.

    Notes
    -----
    With half a pixel of noise, for boards of 9 x 6 points bent by 0 to 5 mm, for 4 to 12 points of any thickness and
    for origins up to 1e6 units away, errors equal those of the best of OpenCV's IPPE and SQPNP with refinement.
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
    """Return the problem of poses [R | t] from samples of three points, for points relative to their centroid."""

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
    """Return the matrix K after validation; raise ValueError if it is invalid."""
    k = real_array(intrinsics, "intrinsics", (3, 3), "the matrix K")
    if k.ndim != 2 or not np.isfinite(k).all() or np.tril(k, -1).any() or not np.diag(k).all():
        raise ValueError("intrinsics: not an upper triangular matrix with inverse; expected that of a camera")
    return np.asarray(k / k[2, 2])
