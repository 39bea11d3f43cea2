"""The motion between two views of cameras with the same unknown focal length."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from generated import focal_poses, relative_poses

from ..arguments import Reals, real_array
from ..evidence import (
    Freedom,
    Problem,
    all_or_some_sets,
    check_sampling,
    checked_scores,
    consensus,
    growth_by_threshold,
    largest_likely,
    rank,
)
from ..evidence.consensus import Indices
from ..evidence.noise import largest_ratio
from ..evidence.triangles import from_triangle
from ..precision import NEGLIGIBLE
from .degeneracy import usual_noise
from .focal_localization import FACTOR, checked_centre, focal_matrix
from .relative_motions import Scene
from .relative_pose import CONFIDENCE, MAX_SAMPLES, estimate_motion, lost_by_chance, share_of_wrong_pairs
from .robust import ALL, consensus_status
from .starts import BEST, SETS
from .status import VisionStatus, check_points, distinct, one_set

_STEPS = 60.0
"""A limit on work: the number of iterations from each start,"""
_SOON = 10.0
"""and that of iterations from a sample."""
_PARTS = 8
"""A limit on work: a motion is followed to other focal lengths in this number of parts."""
_SAME = 1e-3
"""From floating point: focal lengths of one minimum differ by a smaller fraction, even if the minimum is flat."""
_NEAREST, _FARTHEST = 1e-2, 1e2
"""Focal lengths, in units of the extent of the pixels: angles of view from half a degree to 179 degrees."""
_FREEDOM = Freedom(sample_size=6, parameters=6, codimension=1, solutions=15, false_alarms=1.0)
"""As for the fundamental matrix, the bound is conservative by a factor of more than 50."""
_MONOMIALS = ((3, 0), (2, 1), (1, 2), (0, 3), (2, 0), (1, 1), (0, 2), (1, 0), (0, 1), (0, 0))
"""Exponents of the monomials of degree 3 in two unknowns,"""
_QUADRATIC = ((2, 0), (1, 1), (0, 2), (1, 0), (0, 1), (0, 0))
"""and of those of degree 2."""
_PLACES = np.array(
    [[_MONOMIALS.index((a + c, b + d)) for c, d in ((1, 0), (0, 1), (0, 0))] for a, b in _QUADRATIC], np.intp
)
"""The monomials of the products of quadratic ones with x, y and 1."""


@dataclass(frozen=True, slots=True, eq=False)
class FocalMotion:
    """Result of `relative_pose_unknown_focal`: a motion and a focal length, and how well pairs determine them."""

    motor: Reals
    """(8,) The unit motor that maps coordinates of the first camera to those of the second, with a translation of
    length 1; NaN if the status is not OK."""
    focal: float
    """The focal length of both cameras in pixels; NaN if the status is not OK."""
    intrinsics: Reals
    """(3, 3) The matrix K of both cameras."""
    status: VisionStatus
    inliers: Reals
    """(n,) bool: the pairs that the motion explains."""
    points: Reals
    """(n, 3) As in `RelativePose`."""
    covariance: Reals
    """(7, 7) Covariance of the rotation vector that follows the motor, in radians, of its translation, and of the focal
    length in pixels. Its rank is 6, since the length of the translation is fixed."""
    focals: Reals
    """(m,) The focal lengths of all minima that the data cannot separate, the most likely one first: one if the status
    is OK, two or more if it is AMBIGUOUS and the focal length is the reason, otherwise none."""
    residual: float
    """The root mean square Sampson distance of the inliers, in pixels."""
    n_samples: int
    """The number of samples that were drawn."""


def relative_pose_unknown_focal(
    first: ArrayLike,
    second: ArrayLike,
    centre: ArrayLike,
    *,
    threshold: float | None = None,
    seed: int = 0,
    scores: ArrayLike | None = None,
) -> FocalMotion:
    """Estimate the motion between two views and the focal length of both from pairs of pixels (six-point problem).

    Six pairs have up to fifteen motions with focal lengths. The best ones lead, by Levenberg-Marquardt iterations, to
    minima of the squares of Sampson distances. The motion is then judged as in `relative_pose`. Pixels are square, the
    lens has no distortion, and both cameras have the same focal length and principal point.

    Parameters
    ----------
    first, second : array_like, (n, 2) or (n, 1, 2)
        Pixels of the same points in both images, n at least 6.
    centre : array_like, (2,)
        The principal point, in pixels: usually the middle of the image.
    threshold, seed, scores
        As in `relative_pose`.

    Returns
    -------
    FocalMotion
        The statuses are those of `relative_pose`. DEGENERATE includes a focal length that may as well be twice or half
        as large: that of cameras with parallel axes, of cameras at the same distance from a point at which both look,
        and of points on a plane. AMBIGUOUS also means that several focal lengths are likely, as for six pairs.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points differ, if `centre` is not a finite point, or if `threshold` is not positive.
    """
    one, two = (
        one_set(real_array(value, name, (2,), "x y in pixels")).astype(np.float64)
        for value, name in ((first, "first"), (second, "second"))
    )
    middle = checked_centre(centre)
    if threshold is not None:
        check_sampling(threshold, CONFIDENCE, MAX_SAMPLES)
    status = check_points({"first": one, "second": two}, 6, "points")
    if status == VisionStatus.OK and distinct(np.concatenate([one, two], 1), 6) < 6:
        status = VisionStatus.TOO_FEW
    if status != VisionStatus.OK:
        return _nothing(status, len(one))
    pairs = _Pairs(one - middle, two - middle)
    n_samples, starts, inliers = 0, np.empty((0, 10)), np.ones(len(one), bool)
    if threshold is not None:
        problem = replace(pairs.problem(), scores=checked_scores(scores, len(one)))
        found = consensus(problem, threshold, seed, CONFIDENCE, MAX_SAMPLES)
        n_samples, status = found.n_samples, consensus_status(problem, found, threshold, seed)
        if status != VisionStatus.OK or found.best is None:
            return _nothing(status, len(one), n_samples)
        starts, inliers = found.best.model[None], np.asarray(found.best.inliers)
    return pairs.result(inliers, starts, middle, threshold, seed, n_samples)


def motions_of_six(first: Reals, second: Reals) -> tuple[Reals, Reals, Reals]:
    """Return the essential matrices (m, 3, 3) and focal lengths (m,) of sets (b, 6, 2) of pairs, and their sets (m,).

    Pixels are relative to the principal point and of the order of the focal length. The norm of a matrix is the square
    root of 2. With ``u = f^2``, ten equations ``(u^2 A + u B + C) v = 0`` have the monomials v in the two factors of
    the matrix. C has the rank 6, since ``C = Q D`` for quadratic monomials, so that these are eigenvectors of a matrix
    of 16 rows.
    """
    equations, basis = (np.asarray(each) for each in focal_poses.equations_of_six(first, second))
    usable: Reals = np.asarray(np.isfinite(equations).all((1, 2, 3)))
    which = np.flatnonzero(usable)
    (high, middle, low), basis = np.moveaxis(equations[usable], 1, 0), basis[usable]
    n = len(basis)
    factors = np.zeros((n, 6, 10))
    for k, place in enumerate(_PLACES):
        factors[:, k, place] = basis[:, :, 8]
    # Pseudoinverses also exist where noise or the arrangement of points makes the equations singular.
    quadratic = low @ np.linalg.pinv(factors)
    system = np.zeros((n, 16, 16))
    with np.errstate(all="ignore"):
        try:
            system[:, :10] = -np.linalg.solve(high, np.concatenate([middle, quadratic], 2))
        except np.linalg.LinAlgError:
            system[:, :10] = -np.linalg.pinv(high) @ np.concatenate([middle, quadratic], 2)
    system[:, 10:, :10] = factors
    finite: Reals = np.asarray(np.isfinite(system).all((1, 2)))
    system[~finite] = 0
    values, vectors = np.linalg.eig(system)
    real = (np.abs(values.imag) <= NEGLIGIBLE * np.abs(values)) & finite[:, None]
    real &= (values.real > _NEAREST**2) & (values.real < _FARTHEST**2)
    sets, root = np.nonzero(real)
    with np.errstate(all="ignore"):
        monomials = vectors.real[sets, :10, root]
        places = monomials[:, 7:9] / monomials[:, 9:]
    focal = np.sqrt(values.real[sets, root])
    matrices = (np.insert(places, 2, 1, axis=1)[:, None] @ basis[sets])[:, 0].reshape(-1, 3, 3)
    scale = np.stack([focal, focal, np.ones_like(focal)], 1)
    essential = matrices * scale[:, :, None] * scale[:, None]
    with np.errstate(all="ignore"):
        essential *= np.sqrt(2) / np.linalg.norm(essential, axis=(1, 2), keepdims=True)
    good = np.isfinite(essential).all((1, 2))
    return essential[good], focal[good], which[sets[good]]


def _nothing(status: VisionStatus, n_points: int, n_samples: int = 0) -> FocalMotion:
    return FocalMotion(
        np.full(8, np.nan),
        np.nan,
        np.full((3, 3), np.nan),
        status,
        np.zeros(n_points, bool),
        np.full((n_points, 3), np.nan),
        np.full((7, 7), np.nan),
        np.empty(0),
        np.nan,
        n_samples,
    )


def _fundamental(models: Reals) -> Reals:
    """Return fundamental matrices (..., 3, 3) for models (..., 10): the essential matrix and the focal length."""
    inverse = 1 / models[..., 9:]
    scale = np.concatenate([inverse, inverse, np.ones_like(inverse)], -1)
    matrices = models[..., :9].reshape(*models.shape[:-1], 3, 3)
    return np.asarray(matrices * scale[..., :, None] * scale[..., None, :])


@dataclass(frozen=True, slots=True, eq=False)
class _Minimum:
    """A motion and a focal length with the least squares."""

    motor: Reals
    focal: float
    cost: float
    information: Reals
    """(6, 6)"""
    converged: bool

    @property
    def model(self) -> Reals:
        """(10,) The essential matrix and the focal length."""
        return np.append(np.asarray(relative_poses.essential_of_motion(self.motor)).ravel(), self.focal)


class _Pairs:
    """Pairs of pixels relative to the principal point."""

    def __init__(self, first: Reals, second: Reals) -> None:
        self.first, self.second = first, second
        both = np.concatenate([first, second])
        self.size = max(float(np.sqrt((both**2).sum(1).mean())), np.finfo(float).tiny)
        self.noise = usual_noise(both)

    def of_sets(self, sets: Indices) -> Reals:
        """Return the models (m, 10) of sets of six pairs."""
        essential, focal, _ = motions_of_six(self.first[sets] / self.size, self.second[sets] / self.size)
        return np.concatenate([essential.reshape(-1, 9), focal[:, None] * self.size], 1)

    def problem(self) -> Problem:
        """Return the problem of models from samples of six pairs."""

        def distances(models: Reals, first: Reals, second: Reals) -> Reals:
            return np.sqrt(relative_poses.squared_distances(_fundamental(models), first, second))

        def costs(models: Reals, first: Reals, second: Reals, threshold: float) -> Reals:
            return np.asarray(relative_poses.truncated_squares(_fundamental(models), first, second, threshold**2))

        def descend(models: Reals, threshold: float, at_most: float) -> Reals:
            motors = relative_poses.motions_of_essential(models[:, :9].reshape(-1, 3, 3))[0]
            motors, focal, _, _ = focal_poses.descend_motion_and_focal(
                motors, models[:, 9], self.first, self.second, threshold**2, at_most
            )
            essential = np.asarray(relative_poses.essential_of_motion(motors))
            return np.concatenate([essential.reshape(-1, 9), np.asarray(focal)[:, None]], 1)

        return Problem(self.first, self.second, _FREEDOM, self.of_sets, distances, costs, descend)

    def minima(self, models: Reals, which: Indices, limit: float) -> list[_Minimum]:
        """Return the minima near models (m, 10) for some of the pairs, the least first."""
        motors = relative_poses.motions_of_essential(models[:, :9].reshape(-1, 3, 3))[0]
        found, focal, triangle, numbers = focal_poses.descend_motion_and_focal(
            motors, models[:, 9], self.first[which], self.second[which], limit, _STEPS
        )
        information = from_triangle(np.asarray(triangle), 6)
        usable = np.isfinite(numbers[:, 0]) & np.isfinite(found).all(1) & np.isfinite(information).all((1, 2))
        usable &= np.isfinite(focal)
        order = np.argsort(numbers[:, 0], kind="stable")
        return [
            _Minimum(found[k], float(focal[k]), float(numbers[k, 0]), information[k], bool(numbers[k, 1] > 0))
            for k in order
            if usable[k]
        ]

    def scene(self, focal: float) -> Scene:
        """Return the scene of `relative_pose` for a focal length."""
        return Scene(self.first, self.second, focal_matrix(focal), focal_matrix(focal), self.noise)

    def result(
        self, inliers: Reals, starts: Reals, centre: Reals, threshold: float | None, seed: int, n_samples: int
    ) -> FocalMotion:
        """Return the result for pairs that agree with a model, or for all pairs if there is no threshold."""
        n_all, some = len(self.first), np.flatnonzero(inliers)
        limit = ALL if threshold is None else threshold * threshold
        candidates = self.of_sets(some[all_or_some_sets(len(some), 6, SETS)])
        squares = relative_poses.truncated_squares(
            _fundamental(candidates), self.first[inliers], self.second[inliers], limit
        )
        candidates = np.concatenate([starts, candidates[np.argsort(squares, kind="stable")[:BEST]]])
        found = self.minima(candidates, some, limit)
        if not found:
            return _nothing(VisionStatus.DEGENERATE, n_all, n_samples)
        best = found[0]
        if not self._determined(best, inliers, threshold):
            return _nothing(VisionStatus.DEGENERATE, n_all, n_samples)
        essential = np.asarray(relative_poses.essential_of_motion(best.motor))
        motion = estimate_motion(self.scene(best.focal), inliers, essential[None], threshold, seed, n_samples)
        if motion.status not in (VisionStatus.OK, VisionStatus.AMBIGUOUS):
            return _nothing(motion.status, n_all, n_samples)
        focals = self._likely(found, inliers)
        if len(focals) > 1 or motion.status == VisionStatus.AMBIGUOUS:
            return replace(_nothing(VisionStatus.AMBIGUOUS, n_all, n_samples), focals=focals)
        if not best.converged:
            return _nothing(VisionStatus.NOT_CONVERGED, n_all, n_samples)
        return FocalMotion(
            motion.motor,
            best.focal,
            focal_matrix(best.focal, centre),
            VisionStatus.OK,
            motion.inliers,
            motion.points,
            self._covariance(best, motion.motor, some, limit),
            focals,
            motion.residual,
            n_samples,
        )

    def _likely(self, found: list[_Minimum], inliers: Indices) -> Reals:
        """Return the focal lengths of likely minima, the best first, without those within the bounds of others."""
        kept, which = list[_Minimum](), np.flatnonzero(inliers)
        n = len(which)
        first = _fundamental(found[0].model)
        for each in found:
            unlike = self._unlike(first, _fundamental(each.model), which)
            if each.cost >= largest_likely(np.array(found[0].cost), n, max(n - 6, 0), self.noise, unlike):
                continue
            if all(abs(np.log(each.focal / other.focal)) > max(self._bound(other, n), _SAME) for other in kept):
                kept.append(each)
        return np.array([each.focal for each in kept])

    def _unlike(self, one: Reals, two: Reals, which: Indices) -> float:
        """Return of how many residuals two fundamental matrices do not see the same noise."""
        normals = [relative_poses.epipolar_normals(f, self.first[which], self.second[which]) for f in (one, two)]
        return max(float((1 - (normals[0] * normals[1]).sum(1) ** 2).sum()), 0.0)

    def _bound(self, found: _Minimum, n: int) -> float:
        """Return the bound of the logarithm of the focal length, infinite if it is undetermined."""
        if rank(found.information) < 6:
            return np.inf
        variance = float(self.noise.raised(np.array(found.cost), n - 6))
        return float(np.sqrt(max(np.linalg.inv(found.information)[5, 5], 0) * variance * largest_ratio(1)))

    def _determined(self, best: _Minimum, inliers: Reals, threshold: float | None) -> bool:
        """Return whether no motion with a focal length larger or smaller by `FACTOR` is likely."""
        n = int(inliers.sum())
        if not self._bound(best, n) < np.log(FACTOR):
            return False
        limit = ALL if threshold is None else threshold * threshold
        model = best.model
        own = np.asarray(relative_poses.squared_distances(_fundamental(model), self.first, self.second))
        share = 0.0 if threshold is None else share_of_wrong_pairs(self.scene(best.focal), best.motor, limit)
        for sign in (1, -1):
            motor, squares = best.motor, own
            for part in range(1, _PARTS + 1):
                scene = self.scene(best.focal * FACTOR ** (sign * part / _PARTS))
                motor = scene.some(inliers).descended(motor[None], limit).motors[0]
            matrix = scene.fundamental(np.asarray(relative_poses.essential_of_motion(motor)))
            squares = np.asarray(relative_poses.squared_distances(matrix, self.first, self.second))
            both = (squares <= limit) & inliers
            costs, m = (own[both].sum(), squares[both].sum()), int(both.sum())
            unlike = self._unlike(_fundamental(model), matrix, np.flatnonzero(both))
            if m < 6 or costs[1] >= largest_likely(np.array(costs[0]), m, max(m - 6, 0), self.noise, unlike):
                continue
            if m == n or lost_by_chance(share, np.stack([own, squares]), limit):
                return False
        return True

    def _covariance(self, best: _Minimum, motor: Reals, which: Indices, limit: float) -> Reals:
        """Return the covariance at the one of the four motions of a minimum that has points in front of the cameras."""
        _, _, triangle, numbers = focal_poses.descend_motion_and_focal(
            motor, best.focal, self.first[which], self.second[which], limit, _SOON
        )
        variance = float(self.noise.raised(np.asarray(numbers[0]), len(which) - 6))
        squares = np.asarray(relative_poses.squared_distances(_fundamental(best.model), self.first, self.second))
        counts = [int((squares <= each).sum()) for each in (limit, 4 * limit)]
        variance *= growth_by_threshold(counts[0], counts[1] - counts[0])
        onto = np.zeros((7, 6))
        onto[:3, :3], onto[6, 5] = np.eye(3), best.focal
        onto[3:6, 3:5] = np.stack(relative_poses.tangents_of_direction(relative_poses.translation_of_motion(motor)), -1)
        return np.asarray(variance * onto @ np.linalg.inv(from_triangle(np.asarray(triangle), 6)) @ onto.T)
