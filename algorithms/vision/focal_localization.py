"""The pose and the focal length of a camera from known points and their pixels."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike

from generated import camera_poses, focal_poses

from ..arguments import Reals, check_pixels, real_array
from ..evidence import (
    WRONG,
    Freedom,
    Noise,
    Problem,
    all_or_some_sets,
    check_sampling,
    checked_scores,
    differ,
    largest_likely,
    largest_ratio,
    likely,
    rank,
)
from ..evidence.triangles import from_triangle
from ..precision import ROOT, TINY
from .degeneracy import usual_noise
from .pose_refinement import EXPLAINED, camera_motors, motions_between
from .pose_starts import reversed_pose
from .robust import ALL, robust_estimate
from .starts import BEST, REAL, SETS, real_roots
from .status import VisionStatus, check_points, distinct, one_set

_STEPS = 100.0
"""A limit on work: the number of iterations from each start."""
_PARAMETERS = 7
"""The number of parameters of a pose and a focal length."""
_FREEDOM = Freedom(sample_size=4, parameters=_PARAMETERS, codimension=2, solutions=8, false_alarms=1e-2)
_GOLDEN = np.pi * (3 - np.sqrt(5))
"""Multiples of this angle are evenly distributed."""
FACTOR = 2.0
"""A focal length is undetermined if one that is larger or smaller by this factor is likely."""


@dataclass(frozen=True, slots=True, eq=False)
class FocalLocalization:
    """Result of `localize_unknown_focal`: the pose and focal length of a camera, and how well points determine them."""

    pose: Reals
    """(8,) The unit motor from the camera frame to the world frame; NaN if the status is not OK."""
    focal: float
    """The focal length in pixels; NaN if the status is not OK."""
    intrinsics: Reals
    """(3, 3) The matrix K of the camera."""
    status: VisionStatus
    residual: float
    """The root mean square distance of pixels over the inliers, in pixels."""
    inliers: Reals
    """(n,) bool"""
    poses: Reals
    """(m, 8) All poses that the data cannot separate, the most likely one first: one if the status is OK, two or more
    if it is AMBIGUOUS, otherwise none,"""
    focals: Reals
    """(m,) and their focal lengths."""
    covariance: Reals
    """(7, 7) Covariance of a rotation vector and of a translation of the camera, along the axes of its frame, and of
    the focal length in pixels, for the most likely pose."""


def localize_unknown_focal(
    points: ArrayLike,
    pixels: ArrayLike,
    centre: ArrayLike,
    threshold: float | None = None,
    seed: int = 0,
    confidence: float = 0.999,
    max_samples: int = 10000,
    noise: float | None = None,
    *,
    scores: ArrayLike | None = None,
) -> FocalLocalization:
    """Estimate the pose and the focal length of a camera from known points and their pixels (P4Pf, PnPf).

    Four points have up to eight cameras. Levenberg-Marquardt iterations on motions and focal lengths lead from these to
    minima of the squares of distances in the image. Pixels are square, and the lens has no distortion.

    Parameters
    ----------
    points : array_like, (n, 3)
        World coordinates of at least five points, in space or on a plane.
    pixels : array_like, (n, 2) or (n, 1, 2)
    centre : array_like, (2,)
        The principal point, in pixels: usually the middle of the image.
    threshold : float, optional
        Distance in pixels from which a pixel counts as wrong. If given, inliers are found by random samples of four
        points. By default all pixels are used.
    seed, confidence, max_samples : int, float, int
        As in `localize`.
    noise : float, optional
        The standard deviation of pixels. By default it follows from the residuals and a prior: about a thousandth of
        the extent of the pixels, as well known as by four residuals.
    scores : array_like, (n,), optional
        As in `localize`.

    Returns
    -------
    FocalLocalization
        The statuses are those of `localize`. DEGENERATE includes a focal length that may as well be twice or half as
        large, as that of points on a plane parallel to the image or of distant points, for which only the ratio of the
        focal length and the distance is known. AMBIGUOUS means that several minima are likely. Without a threshold, the
        status is NOT_CONVERGED if residuals contradict the noise.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points and pixels differ, if `centre` is not a finite point, or if an option is invalid, as in
        `localize`.
    """
    places = one_set(real_array(points, "points", (3,), "x y z")).astype(np.float64)
    image = one_set(real_array(pixels, "pixels", (2,), "x y in pixels")).astype(np.float64)
    middle = checked_centre(centre)
    if threshold is not None:
        check_sampling(threshold, confidence, max_samples)
    check_pixels(noise, "noise")
    status = check_points({"points": places, "pixels": image}, 5, "points")
    if status == VisionStatus.OK and distinct(places, 5) < 5:
        status = VisionStatus.TOO_FEW
    if status != VisionStatus.OK:
        return _nothing(status, len(places))
    scene = _Scene(places, image - middle, noise)
    inliers: Reals = np.ones(len(places), bool)
    starts = np.empty((0, 3, 4))
    if threshold is not None:
        problem = replace(scene.problem(), scores=checked_scores(scores, len(places)))
        estimate = robust_estimate(problem, threshold, seed, confidence, max_samples)
        if estimate.status != VisionStatus.OK:
            return _nothing(estimate.status, len(places))
        inliers, starts = estimate.inliers, estimate.model[None]
    return scene.result(inliers, starts, middle)


def checked_centre(centre: ArrayLike) -> Reals:
    """Return a principal point (2,) after validation."""
    middle = real_array(centre, "centre", (2,), "x y in pixels").astype(np.float64)
    if middle.shape != (2,) or not np.isfinite(middle).all():
        raise ValueError(f"centre: {centre!r}; expected the two finite coordinates of the principal point")
    return middle


def focal_matrix(focal: float, centre: Reals | None = None) -> Reals:
    """Return the matrix K of a focal length and a principal point."""
    k = np.diag([focal, focal, 1.0])
    if centre is not None:
        k[:2, 2] = centre
    return k


def _nothing(status: VisionStatus, n_points: int) -> FocalLocalization:
    return FocalLocalization(
        np.full(8, np.nan),
        np.nan,
        np.full((3, 3), np.nan),
        status,
        np.nan,
        np.zeros(n_points, bool),
        np.empty((0, 8)),
        np.empty(0),
        np.full((_PARAMETERS, _PARAMETERS), np.nan),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Cameras:
    """Minima of the squares of distances, the least with all points in front of the camera first."""

    matrix: Reals
    """(m, 3, 4) Poses [R | t]."""
    focal: Reals
    cost: Reals
    normal: Reals
    """(m, 7, 7)"""
    converged: Reals
    in_front: Reals

    def ordered(self) -> _Cameras:
        order = np.lexsort((np.where(np.isfinite(self.cost), self.cost, np.inf), ~self.in_front))
        return _Cameras(*(getattr(self, each.name)[order] for each in fields(self)))


class _Scene:
    """Points relative to their centroid, in units of their extent, and pixels relative to the principal point."""

    def __init__(self, places: Reals, image: Reals, noise: float | None) -> None:
        self.centroid = places.mean(0)
        centred = places - self.centroid
        self.unit = max(float(np.sqrt((centred**2).sum(1).mean())), np.finfo(float).tiny)
        self.places, self.image = centred / self.unit, image
        self.size = max(float(np.sqrt((image**2).sum(1).mean())), np.finfo(float).tiny)
        self.noise = usual_noise(image) if noise is None else Noise(noise * noise)

    def of_sets(self, sets: Reals) -> Reals:
        """Return the cameras (m, 3, 4) of sets of four points, with all of these in front."""
        return cameras_of_sets(self.places[sets], self.image[sets], self.size)

    def problem(self) -> Problem:
        """Return the problem of cameras from samples of four points."""
        one = np.eye(3)

        def distances(models: Reals, places: Reals, pixels: Reals) -> Reals:
            return np.sqrt(camera_poses.pixel_squares(models, one, places, pixels))

        def costs(models: Reals, places: Reals, pixels: Reals, threshold: float) -> Reals:
            return np.asarray(camera_poses.truncated_pixel_squares(models, one, places, pixels, threshold**2))

        def descend(models: Reals, threshold: float, at_most: float) -> Reals:
            poses, focal, _, _ = focal_poses.descend_camera(models, self.places, self.image, threshold**2, at_most)
            scale = np.where(np.arange(3) < 2, np.asarray(focal)[:, None], 1)
            return np.asarray(scale[:, :, None] * poses)

        return Problem(self.places, self.image, _FREEDOM, self.of_sets, distances, costs, descend)

    def result(self, inliers: Reals, starts: Reals, centre: Reals) -> FocalLocalization:
        """Return the result for some of the points."""
        n, some = len(self.places), np.flatnonzero(inliers)
        places, image = self.places[some], self.image[some]
        extent = np.linalg.svd(places - places.mean(0), compute_uv=False)
        if len(some) < 5 or not extent[1] > ROOT * extent[0]:
            return _nothing(VisionStatus.DEGENERATE, n)
        candidates = self.of_sets(some[all_or_some_sets(len(some), 4, SETS)])
        squares = np.asarray(camera_poses.pixel_squares(candidates, np.eye(3), places, image))
        order = np.argsort(np.median(squares, axis=1) + squares.mean(1) / len(some), kind="stable")
        candidates = np.concatenate([starts, candidates[order[:BEST]]])
        if not len(candidates):
            return _nothing(VisionStatus.DEGENERATE if len(some) == 5 else VisionStatus.NOT_CONVERGED, n)
        found = _minima(candidates, places, image)
        again = np.asarray(reversed_pose(found.matrix[:1], (places - places.mean(0))[None]))
        mirrored = _minima(focal_matrix(found.focal[0]) @ again, places, image)
        found = _Cameras(
            *(np.concatenate([getattr(found, e.name), getattr(mirrored, e.name)]) for e in fields(_Cameras))
        ).ordered()
        status, rivals = self._judged(found, places, image)
        if status not in (VisionStatus.OK, VisionStatus.AMBIGUOUS):
            return _nothing(status, n)
        rows = found.matrix[rivals].copy()
        rows[..., 3] *= self.unit
        poses = camera_motors(rows, np.broadcast_to(self.centroid, (len(rows), 3)))
        focals, is_ok = found.focal[rivals], status == VisionStatus.OK
        return FocalLocalization(
            poses[0] if is_ok else np.full(8, np.nan),
            float(focals[0]) if is_ok else np.nan,
            focal_matrix(float(focals[0]), centre) if is_ok else np.full((3, 3), np.nan),
            status,
            float(np.sqrt(found.cost[0] / len(some))),
            inliers,
            poses,
            focals,
            self._covariance(found, len(some)),
        )

    def _covariance(self, found: _Cameras, n: int) -> Reals:
        variance = float(self.noise.raised(found.cost[0], 2 * n - _PARAMETERS))
        depth = float(np.linalg.norm(found.matrix[0, :, 3]))
        scale = np.array([-1, -1, -1, *[-depth * self.unit] * 3, found.focal[0]])
        return np.asarray(variance * np.linalg.inv(found.normal[0]) * np.outer(scale, scale))

    def _judged(self, found: _Cameras, places: Reals, image: Reals) -> tuple[VisionStatus, Reals]:
        """Return the status of the first of the minima, and which of them are likely."""
        n, freedom, noise = len(places), 2 * len(places) - _PARAMETERS, self.noise
        rivals = np.zeros(len(found.cost), bool)
        rivals[0] = True
        cost, normal, focal = float(found.cost[0]), found.normal[0], float(found.focal[0])
        usable = np.isfinite(cost) and np.isfinite(normal).all() and np.isfinite(found.matrix[0]).all()
        if not usable or rank(normal) < _PARAMETERS:
            return VisionStatus.DEGENERATE, rivals
        squares = np.asarray(camera_poses.pixel_squares(found.matrix[0], focal_matrix(focal), places, image))
        spread = float(((image - image.mean(0)) ** 2).sum())
        # Random pixels leave less than a fraction x of their squares with a probability of about x^(freedom / 2).
        explained = cost <= min(WRONG ** (2 / freedom), EXPLAINED) * spread
        explained = explained and not noise.contradicted(found.cost[0], freedom)
        explained = explained and not noise.outlying(squares, 2, cost - squares, freedom - 2).any()
        if not (found.in_front[0] and explained):
            return VisionStatus.NOT_CONVERGED, rivals
        variance = float(noise.raised(found.cost[0], freedom))
        bound = np.sqrt(np.linalg.inv(normal)[-1, -1] * variance * largest_ratio(1))
        limit = float(largest_likely(np.array(cost), 2 * n, freedom, noise))
        if not bound < np.log(FACTOR) or self._with_other_focal(found, places, image, limit):
            return VisionStatus.DEGENERATE, rivals
        if not found.converged[0]:
            return VisionStatus.NOT_CONVERGED, rivals
        rivals = likely(np.where(found.in_front, found.cost, np.inf), 2 * n, freedom, noise)
        rivals[0] = True
        for i in range(len(rivals) - 1):
            if rivals[i]:
                apart = differ(_offsets(found, i), found.normal[i], np.array(variance))
                rivals[i + 1 :] &= apart[i + 1 :]
        return (VisionStatus.AMBIGUOUS if rivals[1:].any() else VisionStatus.OK), rivals

    def _with_other_focal(self, found: _Cameras, places: Reals, image: Reals, limit: float) -> bool:
        """Return whether a pose with a focal length larger or smaller by `FACTOR` has squares below a limit."""
        for factor in (FACTOR, 1 / FACTOR):
            pose = found.matrix[0].copy()
            pose[2, 3] *= factor
            k = focal_matrix(found.focal[0] * factor)
            _, _, numbers = camera_poses.descend_pose(pose, k, places, image, ALL, _STEPS)
            if numbers[0] < limit:
                return True
        return False


def cameras_of_sets(places: Reals, image: Reals, size: float, every: bool = False) -> Reals:
    """Return the cameras (m, 3, 4) of sets of four points, with all of these in front.

    Places (b, 4, 3) are of the order of 1, and pixels (b, 4, 2) relative to the principal point of that of `size`. With
    `every`, there are eight cameras of each set: also those with points behind, and the real parts of complex ones,
    near which noise may leave a minimum.
    """
    # The equation that is left out depends on the axes of the image, which are turned by another angle for each set.
    angle = _GOLDEN * np.arange(len(places))
    turns = np.moveaxis(np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]), 2, 0)
    coefficients, pencil, basis = focal_poses.equations_of_four(places, image @ turns / size)
    which, roots = real_roots(np.asarray(coefficients), np.inf if every else REAL)
    own_pencil, own_basis = np.asarray(pencil)[which], np.asarray(basis)[which]
    cameras, there = focal_poses.camera_of_root(roots, own_pencil, own_basis, places[which])
    cameras = np.asarray(cameras)
    cameras[:, :2] = size * turns[which] @ cameras[:, :2]
    return np.asarray(cameras[((np.asarray(there) > 0) | every) & np.isfinite(cameras).all((1, 2))])


def _minima(cameras: Reals, places: Reals, image: Reals) -> _Cameras:
    """Return the minima near cameras (m, 3, 4)."""
    found, lengths, triangle, numbers = focal_poses.descend_camera(cameras, places, image, ALL, _STEPS)
    pose, focal = np.asarray(found), np.asarray(lengths)
    cost = np.where(numbers[:, 0] < ALL, numbers[:, 0], np.nan)
    in_front: Reals = np.asarray(((places @ pose[:, 2, :3, None])[..., 0] + pose[:, 2, 3:] > 0).all(1))
    normal = from_triangle(np.asarray(triangle), _PARAMETERS)
    return _Cameras(pose, focal, cost, normal, numbers[:, 1] > 0, in_front).ordered()


def _offsets(found: _Cameras, i: int) -> Reals:
    """Return the steps (m, 7) from one of the cameras to all."""
    unit = max(float(np.linalg.norm(np.nan_to_num(found.matrix[i, :, 3]))), TINY)
    with np.errstate(all="ignore"):
        change = np.log(found.focal / found.focal[i])
    motions = motions_between(found.matrix[i], found.matrix, unit)
    return np.concatenate([motions, np.where(np.isfinite(change), change, 1e3)[:, None]], 1)
