"""Localization of a rig of several cameras from known points, each seen by one or more of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3, rig_poses

from ..arguments import Reals, as_given, check_pixels, listed, real_array
from ..evidence import Freedom, Noise, Problem, all_or_some_sets, check_sampling, checked_scores
from ..evidence.sampling import without_copies
from ..evidence.triangles import from_triangle
from .camera import Camera
from .camera_misfits import N_CAMERA_TERMS, Doubt, Offsets, camera_misfits, doubt_of
from .localization_results import Localization, no_localization
from .pose_refinement import Poses, camera_motors, deviations, growth_of_poses, judged_poses, ordered, pixel_noise
from .robust import ALL, robust_estimate
from .starts import BEST, SETS, STEPS, real_roots
from .status import VisionStatus, check_points, distinct, one_set

_FREEDOM = Freedom(sample_size=3, parameters=6, codimension=2, solutions=8, false_alarms=1e-2)


def localize_rig(
    points: ArrayLike,
    pixels: ArrayLike,
    cameras: Sequence[Camera],
    camera: ArrayLike,
    threshold: float | None = None,
    seed: int = 0,
    confidence: float = 0.999,
    max_samples: int = 10000,
    noise: float | None = None,
    *,
    scores: ArrayLike | None = None,
) -> Localization:
    """Estimate the pose of a rig of cameras from known points and their pixels (generalised absolute pose).

    Lines of sight do not meet in one centre. Three points, each seen by any of the cameras, have up to eight poses:
    the depths of the points are the roots of a polynomial. Levenberg-Marquardt iterations on the manifold of motors
    lead from these poses to the least squares of distances in the images.

    Parameters
    ----------
    points : array_like, (n, 3)
        World coordinates of at least four points. A point that several cameras see is repeated.
    pixels : array_like, (n, 2) or (n, 1, 2)
    cameras : sequence of Camera
        The cameras of the rig, with poses in the frame of the rig, such as those of `calibrate_stereo`. The distortion
        of their lenses is removed from the pixels first.
    camera : array_like of int, (n,)
        The number of the camera that sees a point.
    threshold, seed, confidence, max_samples, noise, scores
        As in `localize`. Without a threshold, all pixels are used.

    Returns
    -------
    Localization
        Its poses are those of the rig: unit motors from the frame of the rig to the world frame. The statuses are those
        of `localize`, except that without a threshold, a wrong pixel makes the status NOT_CONVERGED. Other poses of the
        cameras are among what may explain structure in the residuals.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points, pixels and `camera` differ, if `camera` is not the number of a camera, or if an option
        is invalid, as in `localize`.
    """
    places = one_set(real_array(points, "points", (3,), "x y z")).astype(np.float64)
    image = one_set(real_array(pixels, "pixels", (2,), "x y in pixels")).astype(np.float64)
    which = _checked_numbers(camera, cameras, len(places))
    if threshold is not None:
        check_sampling(threshold, confidence, max_samples)
    check_pixels(noise, "noise")
    status = check_points({"points": places, "pixels": image}, 4, "points")
    if status == VisionStatus.OK:
        image = image.copy()
        for k, each in enumerate(cameras):
            image[which == k] = each.undistort(image[which == k])
        status = check_points({"points": places, "pixels": image}, 4, "points")
    if status == VisionStatus.OK and distinct(places, 4) < 4:
        status = VisionStatus.TOO_FEW
    if status != VisionStatus.OK:
        return no_localization(status, len(places))
    weights = checked_scores(scores, len(places))
    kept, again = without_copies(image, places, which[:, None])
    scene = _Rig(places[kept], image[kept], cameras, which[kept], noise)
    inliers: Reals = np.ones(len(kept), bool)
    starts = None
    if threshold is not None:
        problem = replace(scene.problem(), scores=weights if weights is None else weights[kept])
        estimate = robust_estimate(problem, threshold, seed, confidence, max_samples)
        if estimate.status != VisionStatus.OK:
            return no_localization(estimate.status, len(places))
        inliers, starts = estimate.inliers, estimate.model[None]
    found = scene.result(inliers, starts, threshold)
    return replace(found, inliers=found.inliers[again])


class _Rig:
    """Points relative to their centroid, in units of their extent, and their sights."""

    def __init__(
        self, places: Reals, image: Reals, cameras: Sequence[Camera], which: Reals, noise: float | None
    ) -> None:
        self.centroid = places.mean(0)
        centred = places - self.centroid
        self.unit = max(float(np.sqrt((centred**2).sum(1).mean())), np.finfo(float).tiny)
        self.places = centred / self.unit
        frames = np.array([pga3.motor_to_matrix(pga3.motor_inverse(each.pose))[:3] for each in cameras])
        frames[..., 3] /= self.unit
        lenses = np.array([each.intrinsics / each.intrinsics[2, 2] for each in cameras], float)
        self.frames, self.lenses = frames, lenses
        whole = (lenses @ frames)[which].reshape(-1, 12)
        self.sights = np.ascontiguousarray(np.concatenate([image, whole], 1))
        back = np.swapaxes(frames[..., :3], 1, 2)
        self.centres = -(back @ frames[..., 3:])[which, :, 0]
        rays = np.linalg.solve(lenses[which], np.insert(image, 2, 1, axis=1)[..., None])
        rays = (back[which] @ rays)[..., 0]
        self.rays = rays / np.linalg.norm(rays, axis=1, keepdims=True)
        variances = np.array([pixel_noise(k, noise).variance for k in lenses])[which]
        self.noise = Noise(float(variances.mean()), pixel_noise(lenses[0], noise).weight)
        self.which = which

    def of_sets(self, sets: Reals) -> Reals:
        """Return the poses (m, 3, 4) of triples of points."""
        own = self.places[sets], self.centres[sets], self.rays[sets]
        return poses_of_triples(*own)

    def problem(self) -> Problem:
        """Return the problem of poses from samples of three points."""

        def distances(models: Reals, places: Reals, sights: Reals) -> Reals:
            return np.sqrt(rig_poses.sight_squares(models, places, sights))

        def costs(models: Reals, places: Reals, sights: Reals, threshold: float) -> Reals:
            return np.asarray(rig_poses.truncated_sight_squares(models, places, sights, threshold**2))

        def descend(models: Reals, threshold: float, at_most: float) -> Reals:
            found, _, _ = rig_poses.descend_rig_pose(models, self.places, self.sights, threshold**2, at_most)
            return np.asarray(found)

        return Problem(self.places, self.sights, _FREEDOM, self.of_sets, distances, costs, descend)

    def result(self, inliers: Reals, starts: Reals | None, threshold: float | None) -> Localization:
        """Return the result for some of the points."""
        n = len(self.places)
        places, sights = self.places[inliers], self.sights[inliers]
        some = np.flatnonzero(inliers)
        candidates = self.of_sets(some[all_or_some_sets(len(some), 3, SETS)])
        squares = np.asarray(rig_poses.sight_squares(candidates, places, sights))
        # Some pixels may be behind a camera in a pose that three of them give.
        order = np.argsort(np.median(squares, axis=1) + squares.mean(1) / len(some), kind="stable")
        candidates = candidates[order[:BEST]]
        if starts is not None:
            candidates = np.concatenate([starts, candidates])
        if not len(candidates):
            return no_localization(VisionStatus.DEGENERATE, n)
        found = self._refined(candidates, places, sights)
        best = found.at((slice(None), 0))
        squares = np.asarray(rig_poses.sight_squares(best.matrix, places, sights))
        units = np.ones(found.cost.shape)
        states, likely = judged_poses(found, places[None], squares, self._spread(inliers), self.noise, units)
        status = VisionStatus(int(states[0]))
        if status not in (VisionStatus.OK, VisionStatus.AMBIGUOUS):
            return no_localization(status, n)
        rows = found.matrix[0, likely[0]].copy()
        doubt = self._doubt(rows[0], inliers)
        if doubt.refused:
            return no_localization(VisionStatus.NOT_CONVERGED, n)
        growth = doubt.growth
        if threshold is not None:
            squares = np.asarray(rig_poses.sight_squares(rows[:1], self.places, self.sights))
            growth *= growth_of_poses(squares, threshold)
        if not np.isfinite(growth):
            return no_localization(VisionStatus.NO_CONSENSUS, n)
        rows[..., 3] *= self.unit
        poses = camera_motors(rows, np.broadcast_to(self.centroid, (len(rows), 3)))
        pose = poses[0] if status == VisionStatus.OK else np.full(8, np.nan)
        first = found.at((0, 0))
        residual = float(np.sqrt(first.cost / len(some)))
        spread = deviations(first, len(some), self.noise, self.unit, growth)
        spread = np.sqrt(spread**2 + doubt.more * [1, self.unit**2])
        return Localization(pose, status, residual, inliers, poses, spread)

    def _refined(self, starts: Reals, places: Reals, sights: Reals) -> Poses:
        """Return the minima (1, s) near starts (s, 3, 4)."""
        found, triangle, numbers = rig_poses.descend_rig_pose(starts, places, sights, ALL, float(STEPS))
        cost = np.where(numbers[:, 0] < ALL, numbers[:, 0], np.nan)
        in_front = (np.asarray(rig_poses.sight_squares(found, places, sights)) < ALL).all(1)
        normal = from_triangle(np.asarray(triangle), 6)
        parts = np.asarray(found), cost, normal, numbers[:, 1] > 0, in_front, numbers[:, 3]
        return ordered(Poses(*(np.asarray(each)[None] for each in parts)))

    def _doubt(self, pose: Reals, inliers: Reals) -> Doubt:
        """Return what cameras with other poses and lenses would explain of the residuals of a pose (3, 4)."""
        seen, total, found = np.flatnonzero(np.bincount(self.which[inliers])), Offsets(np.zeros(5), 0), []
        frames, n = self.frames[seen], len(seen)
        there = frames[..., :3] @ pose
        there[..., 3] += frames[..., 3]
        for k, own in zip(seen, there, strict=True):
            some = inliers & (self.which == k)
            sums, _, offsets = camera_misfits(own, self.lenses[k], self.places[some], self.sights[some, :2])
            found.append(sums)
            total = total.plus(offsets)
        sums = np.array(found)
        # The steps of a camera by those of the rig.
        depth, steps, across = np.linalg.norm(there[..., 3:], axis=1)[:, None], np.zeros((n, 6, 6)), np.zeros((n, 3, 3))
        (x, y, z), turns = frames[..., 3].T, frames[..., :3]
        across[:, 0, 1], across[:, 0, 2], across[:, 1, 2] = -z, y, -x
        across -= np.swapaxes(across, 1, 2)
        steps[:, :3, :3], steps[:, 3:, 3:], steps[:, 3:, :3] = turns, turns / depth, across @ turns / depth
        moved, width = sums[..., :6] @ steps, 6 + N_CAMERA_TERMS
        normal = np.zeros((7 + n * width,) * 2)
        normal[:6, :6] = (np.swapaxes(steps, 1, 2) @ moved[:, :6]).sum(0)
        normal[6:-1, :6], normal[-1, :6] = moved[:, :-1].reshape(-1, 6), moved[:, -1].sum(0)
        for i, each in enumerate(sums):
            part = slice(6 + i * width, 6 + (i + 1) * width)
            normal[part, part], normal[-1, part] = each[:-1, :-1], each[-1, :-1]
        normal[-1, -1] = sums[:, -1, -1].sum()
        normal[:6, 6:], normal[6:-1, -1] = normal[6:, :6].T, normal[-1, 6:-1]
        return doubt_of(normal, None, total, int(inliers.sum()), self.noise)

    def _spread(self, inliers: Reals) -> Reals:
        """Return the sum of squares of pixels about the centroid of those of each camera."""
        total = 0.0
        for k in np.unique(self.which[inliers]):
            own = self.sights[inliers & (self.which == k), :2]
            total += float(((own - own.mean(0)) ** 2).sum())
        return np.array([total])


def poses_of_triples(places: Reals, centres: Reals, rays: Reals) -> Reals:
    """Return the poses [R | t] (m, 3, 4) of rigs that see triples (b, 3, 3) in front of their cameras.

    `places` are of the order of 1, and `centres` and `rays`, of length 1, are in the frame of the rig.
    """
    coefficients = np.asarray(rig_poses.depth_polynomial(places, centres, rays))
    sets, roots = real_roots(coefficients)
    poses, there = rig_poses.pose_of_depth(roots, places[sets], centres[sets], rays[sets])
    poses = np.asarray(poses)
    return np.asarray(poses[(np.asarray(there) > 0) & np.isfinite(poses).all((1, 2))])


def _checked_numbers(camera: ArrayLike, cameras: Sequence[Camera], n: int) -> Reals:
    """Return the numbers of cameras (n,) after validation."""
    for k, each in enumerate(listed(cameras, "cameras", "Camera")):
        if not isinstance(each, Camera):
            raise TypeError(f"cameras[{k}]: {type(each).__name__}; expected a Camera")
    if not len(cameras):
        raise ValueError("cameras: none; expected at least one Camera")
    which = as_given(camera, "camera")
    if which.dtype.kind not in "iu" and which.size:
        raise TypeError(f"camera: dtype {which.dtype}; expected whole numbers of cameras")
    if which.shape != (n,):
        raise ValueError(f"camera: shape {which.shape}; expected ({n},), one number for each point")
    if n and not (which.min() >= 0 and which.max() < len(cameras)):
        raise ValueError(f"camera: numbers from {which.min()} to {which.max()}; expected 0 to {len(cameras) - 1}")
    return which.astype(np.intp)
