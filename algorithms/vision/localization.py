"""Localization of a camera: its pose from known points in space and their pixels."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import camera_poses, projective2

from ..arguments import Reals, check_pixels, real_array
from ..evidence import Freedom, Noise, Problem, all_or_some_sets, check_sampling, checked_scores, likely
from ..evidence.consensus import Indices, without_repeats
from ..evidence.sampling import without_copies
from .camera import Camera, pinhole_pixels
from .camera_misfits import NO_DOUBT, Doubt, camera_misfits, doubt_of
from .line_poses import line_arrays, localize_with_lines
from .localization_results import Localization, no_localization
from .pose_agreement import FEWEST, SAMPLES, SIGMAS, agreeing_items
from .pose_refinement import (
    Poses,
    all_poses,
    camera_motors,
    deviations,
    growth_of_poses,
    pixel_noise,
    pose_status,
)
from .pose_starts import three_points
from .robust import ALL, robust_estimate
from .starts import STEPS
from .status import VisionStatus, check_points, one_set

_SOME = 64
"""A limit on work: the number of pixels with which the pose of a mirror image is searched for."""
_NARROWING = 16.0, 4.0, 1.0
"""A limit on work: multiples of the threshold with which the pose of a mirror image is followed, one by one."""
_FREEDOM = Freedom(sample_size=3, parameters=6, codimension=2, solutions=4, false_alarms=1e-2)


def localize(
    points: ArrayLike,
    pixels: ArrayLike,
    intrinsics: ArrayLike | Camera,
    threshold: float | None = None,
    seed: int = 0,
    confidence: float = 0.999,
    max_samples: int = 10000,
    noise: float | None = None,
    *,
    lines: ArrayLike | None = None,
    image_lines: ArrayLike | None = None,
    scores: ArrayLike | None = None,
) -> Localization:
    """Estimate the pose of a camera from known points and their pixels, by least squares of distances in the image.

    This is the perspective-n-point problem (PnP, resection). Initial poses come from linear equations for points in
    space and for points near a plane, and for few points from triples. Levenberg-Marquardt iterations on the manifold
    of motors lead from each of them to a minimum; the least one with all points in front of the camera is returned.
    Coordinates are taken relative to the centroid of the points, so the origin of the world is arbitrary. Exact copies
    of points with their pixels are not further measurements, and count once.

    Parameters
    ----------
    points : array_like, (n, 3)
        World coordinates of at least four points, in space or on a plane, in any unit of length.
    pixels : array_like, (n, 2) or (n, 1, 2)
    intrinsics : array_like, (3, 3), or Camera
        As in `Camera`. The pose of a camera is not used; the distortion of its lens is removed from the pixels first,
        and distances are those in the image of its pinhole. Pixels that the lens shows for no point are not finite.
    threshold : float, optional
        Distance in pixels from which a pixel counts as wrong. If given, inliers are found by random samples of three
        points and lines. By default all are used, unless the residuals of six or more show that some are wrong: inliers
        are then those that are least likely by chance, and noise explains the distances of these.
    seed : int
        Seed of the random samples.
    confidence : float
        Probability, between 0 and 1, that a sample without wrong points is drawn.
    max_samples : int
        Maximum number of samples, at least 1.
    noise : float, optional
        The standard deviation of pixels. By default it follows from the residuals and a prior: about a thousandth of
        the focal length, as well known as by four residuals.
    lines : array_like, (m, 2, 3), optional
        Two points of each of some lines in space, on what is seen of it. Together with points they must be at least
        four; there may be no points, with shapes (0, 3) and (0, 2).
    image_lines : array_like, (m, 2, 2), optional
        Two pixels of the image of each line, as far apart as it is seen; they need not be those of the points of
        `lines`. Their distances from the image of the line count as those of pixels.
    scores : array_like, (n,), optional
        How likely pixels are right, in relation to each other, such as 1 minus the ratio of distances of descriptors:
        half of the samples are drawn by them, so that misleading ones at most double the work. Not with lines.

    Returns
    -------
    Localization
        The status OK guarantees that a minimum was reached, that all inliers are in front of the camera, and that they
        determine the pose. No other pose is then likely, and the residual is that of an image of them. Of random
        pixels, one set in a thousand passes, and never one that leaves more than 3 % of the squares of pixels about
        their centroid. AMBIGUOUS means that another pose, as the mirror image of a small or distant plane, has a
        likelihood of more than a thousandth of the best one; both are in `poses`. TOO_FEW is returned for fewer than
        four distinct points, and DEGENERATE for points on a line and others that do not determine the pose. The status
        is NOT_CONVERGED if the best pose violates one of the other conditions, or if structure in the distances is more
        than the rest of them, and than noise would show: what other parameters of the camera explain, what each has in
        common with that of the nearest other point, and a direction that prevails. Less of it makes `deviation` larger.
        It is NO_CONSENSUS if two poses explain all pixels, each some of them, or if no pose has more inliers than
        expected by chance, or than of pixels as near their places as those that disagree with the pose. With a
        threshold, this is also the status if the mirror image of the points explains the pixels better, or if so many
        pixels are within one and two thresholds that their noise is not less than the threshold.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points and pixels differ, if `intrinsics` is not upper triangular and regular, if `threshold`
        or `noise` is not positive, if `confidence` is not between 0 and 1, or if `max_samples` is less than 1.

    Notes
    -----
    With half a pixel of noise, for boards of 9 x 6 points bent by 0 to 5 mm, for 4 to 12 points of any thickness and
    for origins up to 1e6 units away, errors equal those of the best of OpenCV's IPPE and SQPNP with refinement.
    """
    places = one_set(real_array(points, "points", (3,), "x y z"))
    if (lines is None) != (image_lines is None):
        raise ValueError("lines, image_lines: one of both; expected lines and what is seen of them, or neither")
    matrix, image = pinhole_pixels(intrinsics, pixels, "pixels")
    image = one_set(image)
    k = checked_intrinsics(matrix)
    if threshold is not None:
        check_sampling(threshold, confidence, max_samples)
    check_pixels(noise, "noise")
    if lines is not None and image_lines is not None:
        check_points({"points": places, "pixels": image}, 0, "points")
        both = line_arrays(lines, image_lines, intrinsics)
        if len(both[0]):
            if scores is not None:
                raise ValueError("scores: with lines; expected points only, or no scores")
            items = places.astype(np.float64), image.astype(np.float64), *both
            return localize_with_lines(*items, k, threshold, seed, confidence, max_samples, noise)
    scene, again = _scene_of(places, image, k, noise, scores)
    if isinstance(scene, VisionStatus):
        return no_localization(scene, len(places))
    found = scene.localized(threshold, seed, confidence, max_samples)
    return replace(found, inliers=found.inliers[again]) if len(found.inliers) < len(places) else found


def _scene_of(
    places: Reals, image: Reals, k: Reals, noise: float | None, scores: ArrayLike | None
) -> tuple[_Scene | VisionStatus, Reals]:
    """Return the scene of points and pixels without copies, or why there is none, and the numbers of points in it."""
    status = check_points({"points": places, "pixels": image}, 4, "points")
    if status != VisionStatus.OK:
        return status, np.empty(0)
    weights = checked_scores(scores, len(places))
    kept, again = without_copies(image, places)
    if len(kept) < 4:
        return VisionStatus.TOO_FEW, again
    if len(kept) < len(places):
        places, image, weights = places[kept], image[kept], weights if weights is None else weights[kept]
    places = places.astype(np.float64)
    centroid = places.sum(0) / len(places)
    return _Scene(places - centroid, image.astype(np.float64), k, pixel_noise(k, noise), centroid, weights), again


class _Judged(NamedTuple):
    """Minima of the distances of some points, and what these say about them."""

    status: VisionStatus
    found: Poses
    """(1, s)"""
    likely: Reals
    """(1, s) bool"""
    doubt: Doubt


@dataclass(frozen=True, slots=True, eq=False)
class _Scene:
    """The points (n, 3) about their centroid, their pixels (n, 2), and the camera."""

    places: Reals
    image: Reals
    k: Reals
    noise: Noise
    centroid: Reals
    """(3,)"""
    scores: Reals | None
    """(n,) How likely pixels are right."""

    def localized(self, threshold: float | None, seed: int, confidence: float, max_samples: int) -> Localization:
        """Return the pose."""
        n = len(self.places)
        inliers: Reals = np.ones(n, bool)
        if threshold is not None:
            problem = _problem(self)
            estimate = robust_estimate(problem, threshold, np.random.default_rng(seed), confidence, max_samples)
            if estimate.status != VisionStatus.OK:
                return no_localization(estimate.status, n)
            inliers = estimate.inliers
            if not inliers.all() and _is_of_mirror_image(problem, estimate.model, self, threshold):
                return no_localization(VisionStatus.NO_CONSENSUS, n)
        own = self.judged(inliers)
        undetermined = own.status in (VisionStatus.TOO_FEW, VisionStatus.DEGENERATE)
        if (
            threshold is None
            and n >= FEWEST
            and not undetermined
            and (own.doubt.is_certain or self.suspicious(own.found))
        ):
            agreed = _without_wrong_pixels(self)
            if agreed is None:
                return no_localization(VisionStatus.NO_CONSENSUS if own.status == VisionStatus.OK else own.status, n)
            inliers, own = agreed, self.judged(agreed)
        if own.status not in (VisionStatus.OK, VisionStatus.AMBIGUOUS):
            return no_localization(own.status, n)
        if own.doubt.refused:
            return no_localization(VisionStatus.NOT_CONVERGED, n)
        rows, best, n_used = own.found.matrix[0, own.likely[0]], own.found.at((0, 0)), int(inliers.sum())
        growth = own.doubt.growth * (1.0 if threshold is None else growth_of_poses(self.squares(rows[0]), threshold))
        if not isfinite(growth):
            return no_localization(VisionStatus.NO_CONSENSUS, n)
        poses = camera_motors(rows, self.centroid)
        pose = poses[0] if own.status == VisionStatus.OK else np.full(8, np.nan)
        spread = deviations(best, n_used, self.noise, growth=growth)
        if own.doubt is not NO_DOUBT:
            spread = np.sqrt(spread**2 + own.doubt.more)
        return Localization(pose, own.status, sqrt(best.cost / n_used), inliers, poses, spread)

    def judged(self, inliers: Reals) -> _Judged:
        """Return what some of the points say."""
        places, image = self._some(inliers)
        found = all_poses(places, image, self.k, STEPS, self.noise)
        states, likely = pose_status(found, places, image, self.k, self.noise)
        status = VisionStatus(int(states[0]))
        doubt = NO_DOUBT
        if status in (VisionStatus.OK, VisionStatus.AMBIGUOUS):
            pose = found.matrix[0, 0]
            doubt = doubt_of(*camera_misfits(pose, self.k, places[0], image[0]), places.shape[1], self.noise)
            if doubt is not NO_DOUBT:
                doubt = doubt._replace(more=doubt.more * [1, float(pose[:, 3] @ pose[:, 3])])
        return _Judged(status, found, likely, doubt)

    def minima(self, inliers: Reals) -> Poses:
        """Return all minima (1, s) of the distances of some of the points."""
        return all_poses(*self._some(inliers), self.k, STEPS, self.noise)

    def _some(self, inliers: Reals) -> tuple[Reals, Reals]:
        """Return some of the points (1, k, 3) and their pixels (1, k, 2)."""
        if inliers.all():
            return self.places[None], self.image[None]
        return self.places[None, inliers], self.image[None, inliers]

    def squares(self, pose: Reals) -> Reals:
        """Return the squared distances (..., n) of all pixels in poses (..., 3, 4)."""
        return np.asarray(camera_poses.pixel_squares(pose, self.k, self.places, self.image))

    def suspicious(self, found: Poses) -> bool:
        """Return whether the residuals of the best of the minima exceed the usual noise."""
        freedom = 2 * len(self.places) - 6
        return bool(Noise(self.noise.variance).contradicted(found.cost[0, 0], freedom))


def _without_wrong_pixels(scene: _Scene) -> Indices | None:
    """Return which pixels agree with a pose; unrelated ones are anywhere in the part of the image that pixels cover."""
    with np.errstate(divide="ignore"):
        shares = np.full(len(scene.places), np.pi / np.prod(np.ptp(scene.image, axis=0)))
    once = without_repeats(scene.places, scene.image, SIGMAS * float(np.sqrt(scene.noise.variance)))

    def minimum(_: Reals, inliers: Indices) -> tuple[Reals, Reals]:
        found = scene.minima(inliers).at((0, 0))
        return found.matrix, found.cost

    poses = _problem(scene).solve(all_or_some_sets(len(scene.places), 3, SAMPLES))
    return agreeing_items(poses, scene.squares, minimum, shares, once, scene.noise, _FREEDOM)


def _is_of_mirror_image(problem: Problem, pose: Reals, scene: _Scene, threshold: float) -> bool:
    """Return whether a pose of the mirror image of the points explains the pixels so much better that it is unlikely.

    Axes of the pixels or of the world are then mirrored. Far from the points, both have the same image if the depths of
    one are reversed, which is where the search starts: with all pixels, which wrong ones disturb, and with near ones.
    """
    mirror = np.array([1.0, 1.0, -1.0])
    start = (mirror[:, None] * pose) * np.append(mirror, 1.0)
    start[2, 3] = pose[2, 3]
    places, image, k, n = problem.first * mirror, problem.second, scene.k, len(problem.first)
    some = slice(None, None, -(-n // _SOME))
    own_first, first, second = (np.ascontiguousarray(each[some]) for each in (problem.first, places, image))
    everywhere, _, _ = camera_poses.descend_pose(start[None], k, first, second, ALL, STEPS)
    found = np.concatenate([start[None], np.asarray(everywhere)])
    for factor in _NARROWING:
        found = np.asarray(camera_poses.descend_pose(found, k, first, second, (factor * threshold) ** 2, STEPS)[0])
    costs = np.fmin(problem.costs(found, first, second, threshold), np.inf)
    if costs.min() >= problem.costs(pose[None], own_first, second, threshold)[0]:
        return False
    best = found[int(costs.argmin())]
    found, _, numbers = camera_poses.descend_pose(best[None], k, places, image, threshold**2, STEPS)
    own = float(problem.costs(pose[None], problem.first, image, threshold)[0])
    freedom = 2 * n - _FREEDOM.parameters
    return not likely(np.array([own, float(np.asarray(numbers)[0, 0])]), 2 * n, freedom, scene.noise)[0]


def _problem(scene: _Scene) -> Problem:
    """Return the problem of poses [R | t] from samples of three points, for points relative to their centroid."""
    places, image, k = scene.places, scene.image, scene.k
    seen = np.asarray(projective2.transform_point(np.linalg.inv(k), image))

    def solve(sets: Reals) -> Reals:
        return three_points(places.take(sets, axis=0), seen.take(sets, axis=0)).reshape(-1, 3, 4)

    def distances(models: Reals, points: Reals, pixels: Reals) -> Reals:
        return np.sqrt(camera_poses.pixel_squares(models, k, points, pixels))

    def costs(models: Reals, points: Reals, pixels: Reals, threshold: float) -> Reals:
        return np.asarray(camera_poses.truncated_pixel_squares(models, k, points, pixels, threshold * threshold))

    def descend(models: Reals, threshold: float, at_most: float) -> Reals:
        found, _, _ = camera_poses.descend_pose(models, k, places, image, threshold * threshold, at_most)
        return np.asarray(found)

    return Problem(places, image, _FREEDOM, solve, distances, costs, descend, scene.scores)


def checked_intrinsics(intrinsics: ArrayLike) -> Reals:
    """Return the matrix K after validation; raise ValueError if it is invalid."""
    k = real_array(intrinsics, "intrinsics", (3, 3), "the matrix K")
    if k.ndim != 2 or not _is_triangular(k.tolist()):
        raise ValueError("intrinsics: not an upper triangular matrix with inverse; expected that of a camera")
    return np.asarray(k / k[2, 2])


def _is_triangular(rows: list[list[float]]) -> bool:
    """Return whether a matrix is upper triangular and regular, with finite numbers."""
    (a, _, _), (below, b, _), (left, right, c) = rows
    return bool(not (below or left or right) and a and b and c and all(isfinite(x) for row in rows for x in row))


def intrinsics_of_camera(camera: Camera | ArrayLike) -> Reals:
    """Return the matrix K of a camera, or the matrix that is given in its place, after validation."""
    return np.asarray(checked_intrinsics(camera.intrinsics if isinstance(camera, Camera) else camera), np.float64)
