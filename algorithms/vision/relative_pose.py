"""The relative pose of two calibrated cameras from pairs of pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import relative_poses

from ..arguments import Reals, real_array
from ..evidence import Freedom, Noise, check_sampling, consensus, largest_likely, largest_ratio, rank
from ..evidence.observability import spectrum
from .camera import Camera
from .localization import checked_intrinsics
from .normalization import extents
from .pose_refinement import pixel_noise
from .relative_motions import Scene
from .robust_fundamental import displaced_by_chance, hidden_by_a_line
from .status import VisionStatus, check_points, distinct

_CONFIDENCE = 0.999
"""A probability: that a sample without wrong pairs is drawn."""
_MAX_SAMPLES = 100000
"""A limit on work: enough samples for 86 % of wrong pairs."""
_OFF_A_ROTATION = Freedom(sample_size=2, parameters=2, codimension=1, solutions=1, false_alarms=1e-2)
"""A rotation leaves the translation undetermined,"""
_OFF_A_LINE = Freedom(sample_size=2, parameters=2, codimension=1, solutions=10, false_alarms=1e-2)
"""and a line two of five parameters."""
_APART = 3.0
"""From the noise: minima are sought for distances up to this many thresholds, beyond which the sum has many minima."""
_WIDE = 2.0
"""From the noise: distances of two coordinates, in thresholds of one, up to which a rotation is fitted."""
_NOTHING: Reals = np.full(8, np.nan)


@dataclass(frozen=True, slots=True, eq=False)
class RelativePose:
    """Result of `relative_pose`: the motion from the first camera to the second, and how well pairs determine it."""

    motor: Reals
    """(8,) The unit motor, in the order of `generated.pga3`, that maps coordinates of the first camera to those of the
    second. Its translation has the length 1. NaN if the status is not OK."""
    status: VisionStatus
    inliers: Reals
    """(n,) bool: the pairs that the motion explains."""
    points: Reals
    """(n, 3) The points of inliers in the frame of the first camera, in baselines; NaN for other pairs, and for inliers
    that cannot be distinguished from points at infinity."""
    essential: Reals
    """(3, 3) The matrix E of norm ``sqrt(2)`` with ``x' E x = 0`` for directions x and x' in both cameras."""
    covariance: Reals
    """(6, 6) Covariance of the rotation vector that follows the motor, in radians, and of its translation. Its rank is
    5, since the length of the translation is fixed."""
    motors: Reals
    """(m, 8) All motions that the data cannot separate, the most likely first: one if the status is OK, two or more if
    it is AMBIGUOUS, otherwise none."""
    rotation: Reals
    """(8,) A rotation that explains the pairs as well as any motion does: not NaN only if the status is DEGENERATE
    because there is no parallax, for example after a pure rotation."""
    residual: float
    """The root mean square Sampson distance of the inliers, in pixels."""
    n_samples: int
    """The number of samples that were drawn."""


def relative_pose(
    first: ArrayLike,
    second: ArrayLike,
    camera: Camera | ArrayLike,
    second_camera: Camera | ArrayLike | None = None,
    *,
    threshold: float | None = None,
    seed: int = 0,
) -> RelativePose:
    """Estimate the motion between two calibrated views from pairs of pixels (`recoverPose`, `findEssentialMat`).

    Samples of five pairs have up to ten essential matrices (Nister's five-point problem). The best ones lead, by
    Levenberg-Marquardt iterations on the five-dimensional manifold of motions, to minima of the squares of Sampson
    distances, in pixels. The four motions of each minimum are compared by the pairs whose points would be behind a
    camera, which are as far off as from points at infinity. All motions that the noise cannot rule out are returned.

    Parameters
    ----------
    first, second : array_like, (n, 2) or (n, 1, 2)
        Pixels of the same points in both images, n at least 5.
    camera : Camera or array_like, (3, 3)
        The first camera, or its matrix K. The pose of a `Camera` is not used.
    second_camera : Camera or array_like, (3, 3), optional
        The second camera; by default the first.
    threshold : float, optional
        The Sampson distance, in pixels, from which a pair counts as wrong: two to three times the standard deviation of
        pixels. By default all pairs are used.
    seed : int
        Seed of the random samples; the same seed gives the same result.

    Returns
    -------
    RelativePose
        The status OK guarantees that a minimum was reached, that the pairs determine the motion, and that noise does
        not explain another one. AMBIGUOUS means that other motions have a likelihood of more than a thousandth of the
        best one, for example the second motion of a plane; all are in `motors`. TOO_FEW is returned for fewer than five
        distinct pairs. DEGENERATE means that a rotation alone explains the pairs, which is then in `rotation`, that
        the points are on a line, or that the direction of the translation is uncertain by a right angle. With a
        threshold, the status is NO_CONSENSUS if chance explains the inliers, and NOT_CONVERGED if too few samples were
        drawn. Without one, it is NOT_CONVERGED if the residuals contradict the usual noise of pixels, a thousandth of
        the focal length as well known as by four residuals, or those of the other pairs.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points differ, if a matrix K is not upper triangular and regular, or if `threshold` is not
        positive.
    """
    one, two = _pixels(first, "first"), _pixels(second, "second")
    k = _intrinsics(camera)
    k_two = k if second_camera is None else _intrinsics(second_camera)
    if threshold is not None:
        check_sampling(threshold, _CONFIDENCE, _MAX_SAMPLES)
    status = check_points({"first": one, "second": two}, 5, "points")
    if status == VisionStatus.OK and distinct(np.concatenate([one, two], 1), 5) < 5:
        status = VisionStatus.TOO_FEW
    if status != VisionStatus.OK:
        return _no_pose(status, len(one))
    scene = _scene(one, two, k, k_two)
    if threshold is None:
        return _estimate(scene, np.ones(len(one), bool), np.empty((0, 3, 3)), None, seed, 0)
    problem = scene.problem()
    found = consensus(problem, threshold, seed, _CONFIDENCE, _MAX_SAMPLES)
    if not found.hypotheses or found.by_chance:
        return _no_pose(VisionStatus.NO_CONSENSUS, len(one), n_samples=found.n_samples)
    if not found.reached:
        return _no_pose(VisionStatus.NOT_CONVERGED, len(one), n_samples=found.n_samples)
    best = found.hypotheses[0]
    return _estimate(scene, np.asarray(best.inliers), best.model[None], threshold, seed, found.n_samples)


def _estimate(
    scene: Scene, inliers: Reals, starts: Reals, threshold: float | None, seed: int, n_samples: int
) -> RelativePose:
    """Return the result for pairs that agree with a motion, or for all pairs if there is no threshold."""
    limit = np.inf if threshold is None else threshold * threshold
    found = scene.some(inliers).minima(starts, min(_APART**2 * limit, 1e20))
    if not len(found.motors):
        return _no_pose(VisionStatus.DEGENERATE, len(inliers), n_samples=n_samples)
    rivals, squares, costs = _compared(scene, found.motors, inliers, limit)
    if threshold is not None:
        improved = scene.descended(rivals[:1], limit)
        again, _, _ = scene.explained(improved.motors)
        rivals[0], squares = improved.motors[0], again[0]
        inliers = squares <= limit
    n, best = int(inliers.sum()), scene.some(inliers).descended(rivals[:1], min(limit, 1e20), 1)
    cost, information = float(squares[inliers].sum()), best.information[0]
    variance = float(scene.noise.raised(np.array(cost), n - 5))
    known = Noise(variance, scene.noise.weight + max(n - 5, 0))
    used = scene.some(inliers)
    rotation = _without_parallax(scene, inliers, rivals[0], cost, known, threshold, seed)
    if rotation is not None:
        return _no_pose(VisionStatus.DEGENERATE, len(inliers), rotation, n_samples)
    status = _status(used, squares[inliers], information, known, threshold is None)
    if status == VisionStatus.OK and threshold is not None:
        model = np.asarray(relative_poses.essential_of_motion(rivals[0]))
        if hidden_by_a_line(scene.problem(), model, inliers, threshold, seed, _OFF_A_LINE):
            status = VisionStatus.DEGENERATE
    if status == VisionStatus.OK and not found.converged.any():
        status = VisionStatus.NOT_CONVERGED
    if status != VisionStatus.OK:
        return _no_pose(status, len(inliers), n_samples=n_samples)
    motors = _likely(used, rivals, costs)
    _, points, ahead = (each[0] for each in scene.explained(rivals[:1]))
    shown = inliers & ahead
    return RelativePose(
        motors[0] if len(motors) == 1 else _NOTHING.copy(),
        VisionStatus.OK if len(motors) == 1 else VisionStatus.AMBIGUOUS,
        inliers,
        np.where(shown[:, None], points, np.nan),
        np.asarray(relative_poses.essential_of_motion(motors[0])),
        _covariance(motors[0], information, variance),
        motors,
        _NOTHING.copy(),
        float(np.sqrt(cost / n)),
        n_samples,
    )


def _compared(scene: Scene, motors: Reals, inliers: Reals, limit: float) -> tuple[Reals, Reals, Reals]:
    """Return motions of minima, the most likely first, the squares (n,) of the first, and the sums (m,) over inliers.

    Minima whose squares exceed those of the best motion by too much to be likely are left out.
    """
    n, used = int(inliers.sum()), scene.some(inliers)
    matrices = np.asarray(relative_poses.essential_of_motion(motors))
    lower = relative_poses.truncated_squares(used.fundamental(matrices), used.first, used.second, min(limit, 1e20))
    order = np.argsort(lower, kind="stable")
    all_motors, sums, wholes, first, least = list[Reals](), list[Reals](), list[float](), np.empty(0), np.inf
    for k in order:
        if lower[k] > largest_likely(np.array(least), n, max(n - 5, 0), scene.noise, n):
            break
        options = np.asarray(relative_poses.motions_of_essential(matrices[k]))
        squares, _, _ = scene.explained(options)
        truncated = np.minimum(squares, limit)
        whole = truncated.sum(1)
        best = int(np.argmin(whole))
        if not len(first) or whole[best] < min(wholes):
            first = squares[best]
        all_motors.append(options)
        wholes.extend(whole)
        sums.append(truncated[:, inliers].sum(1))
        least = min(least, float(sums[-1].min()))
    order = np.argsort(wholes, kind="stable")
    return np.concatenate(all_motors)[order], first, np.concatenate(sums)[order]


def _likely(used: Scene, motors: Reals, costs: Reals) -> Reals:
    """Return the motions that noise can make as bad as they are, if the first one is the best by chance."""
    n = len(used.first)
    freedom, kept = max(n - 5, 0), [0]
    normals = used.normals(motors[0])
    for k in range(1, len(motors)):
        if costs[k] < largest_likely(costs[0], n, freedom, used.noise, n):
            unlike = float((1 - (normals * used.normals(motors[k])).sum(1) ** 2).sum())
            if costs[k] < largest_likely(costs[0], n, freedom, used.noise, max(unlike, 0.0)):
                kept.append(k)
    return motors[kept]


def _status(used: Scene, squares: Reals, information: Reals, known: Noise, all_pairs: bool) -> VisionStatus:
    """Return whether noise determines the motion, and whether residuals contradict the noise if all pairs are used."""
    n = len(squares)
    if not np.isfinite(information).all() or rank(information) < 5:
        return VisionStatus.DEGENERATE
    directions = np.linalg.inv(information)[3:, 3:] * known.variance
    if np.linalg.eigvalsh(directions)[-1] * largest_ratio(1) > (np.pi / 2) ** 2:
        return VisionStatus.DEGENERATE
    allowed = (n - 2) * largest_ratio(n - 2, known.weight) * known.variance
    if max(extents(used.first)[0], extents(used.second)[0]) ** 2 <= allowed:
        return VisionStatus.DEGENERATE
    if all_pairs and n > 5:
        cost = squares.sum()
        wrong = used.noise.contradicted(cost, n - 5)
        if n > 6:
            wrong |= used.noise.outlying(squares, 1, cost - squares, n - 6).any()
        if wrong:
            return VisionStatus.NOT_CONVERGED
    return VisionStatus.OK


def _without_parallax(
    scene: Scene, inliers: Reals, motor: Reals, cost: float, known: Noise, threshold: float | None, seed: int
) -> Reals | None:
    """Return a rotation that explains the inliers up to the noise and to chance, or None.

    A translation removes one residual of each pair, the parallax. If that is noise, so is the translation.
    """
    n = int(inliers.sum())
    starts = np.asarray(relative_poses.motions_of_essential(relative_poses.essential_of_motion(motor)))[[0, 2]]
    wide = 1e20 if threshold is None else (_WIDE * threshold) ** 2
    rotation, _ = scene.some(inliers).rotation(starts, wide)
    far = np.minimum(scene.far(rotation), 1e20)
    if threshold is None:
        return None if known.contradicted(far.sum(), 2 * n - 3) else rotation
    off = known.outlying(far, 2, np.array([0.0]), 0)
    near = inliers & ~off
    if near.sum() > 2 and known.contradicted(far[near].sum(), 2 * int(near.sum()) - 3):
        return None
    if off.sum() <= _OFF_A_ROTATION.sample_size:
        return rotation
    rest = scene.some(off)
    turned = relative_poses.turned_pixels(rotation, scene.left, scene.two, rest.first)
    model = np.asarray(relative_poses.essential_of_motion(motor))
    problem = rest.problem()
    return rotation if displaced_by_chance(problem, model, turned, threshold, seed, _OFF_A_ROTATION) else None


def _covariance(motor: Reals, information: Reals, variance: float) -> Reals:
    """Return the covariance (6, 6) of the rotation vector and the translation."""
    values, vectors, scale = spectrum(information)
    inverse = (vectors / values) @ vectors.T * np.outer(scale, scale)
    shift = relative_poses.translation_of_motion(motor)
    onto = np.zeros((6, 5))
    onto[:3, :3] = np.eye(3)
    onto[3:, 3:] = np.stack(relative_poses.tangents_of_direction(shift), -1)
    return np.asarray(variance * onto @ inverse @ onto.T)


def _no_pose(status: VisionStatus, n_points: int, rotation: Reals | None = None, n_samples: int = 0) -> RelativePose:
    return RelativePose(
        _NOTHING.copy(),
        status,
        np.zeros(n_points, bool),
        np.full((n_points, 3), np.nan),
        np.full((3, 3), np.nan),
        np.full((6, 6), np.nan),
        np.empty((0, 8)),
        _NOTHING.copy() if rotation is None else rotation,
        np.nan,
        n_samples,
    )


def _pixels(value: ArrayLike, name: str) -> Reals:
    """Return pixels (n, 2), also from (n, 1, 2)."""
    array = real_array(value, name, (2,), "x y in pixels")
    if array.ndim == 3 and array.shape[1] == 1:
        array = array[:, 0]
    return array.astype(np.float64)


def _intrinsics(camera: Camera | ArrayLike) -> Reals:
    return np.asarray(checked_intrinsics(camera.intrinsics if isinstance(camera, Camera) else camera), np.float64)


def _scene(one: Reals, two: Reals, k: Reals, k_two: Reals) -> Scene:
    """Return pixels relative to the principal points, and the noise of both cameras."""
    matrices = [np.array([[m[0, 0], m[0, 1], 0], [0, m[1, 1], 0], [0, 0, 1]]) for m in (k, k_two)]
    noises = [pixel_noise(matrix) for matrix in matrices]
    noise = Noise((noises[0].variance + noises[1].variance) / 2, noises[0].weight)
    return Scene(one - k[:2, 2], two - k_two[:2, 2], *matrices, noise)
