"""The relative pose of two calibrated cameras from pairs of pixels."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from generated import relative_poses

from ..arguments import Reals, real_array
from ..evidence import (
    WRONG,
    Freedom,
    Noise,
    check_sampling,
    checked_scores,
    consensus,
    growth_by_threshold,
    largest_likely,
    largest_ratio,
    log_false_alarms,
    rank,
)
from ..evidence.consensus import unrelated
from ..evidence.observability import spectrum
from .camera import Camera
from .degeneracy import displaced_by_chance, few_places, hidden_by_a_line
from .localization import intrinsics_of_camera
from .normalization import extents
from .pose_refinement import pixel_noise
from .relative_motions import FREEDOM, Motions, Scene, halfway, joined, steps_to
from .robust import ALL, consensus_status
from .status import VisionStatus, check_points, distinct, one_set

CONFIDENCE = 0.999
"""A probability: that a sample without wrong pairs is drawn."""
MAX_SAMPLES = 200000
"""A limit on work: enough samples for 85 % of wrong pairs."""
_OFF_A_ROTATION = Freedom(sample_size=2, parameters=2, codimension=1, solutions=1, false_alarms=1e-2)
"""A rotation leaves the translation undetermined,"""
_OFF_A_LINE = Freedom(sample_size=2, parameters=2, codimension=1, solutions=10, false_alarms=1e-2)
"""and a line two of five parameters."""
_ANOTHER = Freedom(sample_size=1, parameters=1, codimension=1, solutions=16, false_alarms=WRONG)
"""The best one of as many minima as are sought, which can move a little to agree with more pairs."""
_APART = 3.0
"""From the noise: minima are sought for distances up to this many thresholds, beyond which the sum has many minima."""
_WIDE = 2.0
"""From the noise: distances of two coordinates, in thresholds of one, up to which a rotation is fitted."""
_NOTHING: Reals = np.full(8, np.nan)
"""No motion."""


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
    scores: ArrayLike | None = None,
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
        The first camera, or its matrix K. The pose of a `Camera` is not used; distances are those in the image without
        distortion.
    second_camera : Camera or array_like, (3, 3), optional
        The second camera; by default the first.
    threshold : float, optional
        The Sampson distance, in pixels, from which a pair counts as wrong: two to three times the standard deviation of
        pixels. By default all pairs are used.
    seed : int
        Seed of the random samples; the same seed gives the same result.
    scores : array_like, (n,), optional
        How likely pairs are right, in relation to each other, such as 1 minus the ratio of distances of descriptors:
        half of the samples are drawn by them, so that misleading ones at most double the work.

    Returns
    -------
    RelativePose
        The status OK guarantees that a minimum was reached, that the pairs determine the motion, and that noise does
        not explain another one. AMBIGUOUS means that other motions have a likelihood of more than a thousandth of the
        best one, for example the second motion of a plane; all are in `motors`. TOO_FEW is returned for fewer than five
        distinct pairs. DEGENERATE means that a rotation alone explains the pairs, which is then in `rotation`, that
        the points are on a line, or that the direction of the translation is uncertain by a right angle. With a
        threshold, the status is NO_CONSENSUS if chance explains the inliers, and NOT_CONVERGED if too few samples were
        drawn, or if distances up to twice the threshold show that it is smaller than the noise. Without one, it is
        NOT_CONVERGED if the residuals contradict the usual noise of pixels, a thousandth of the focal length as well
        known as by four residuals, or those of the other pairs.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points differ, if a matrix K is not upper triangular and regular, or if `threshold` is not
        positive.
    """
    other = camera if second_camera is None else second_camera
    one, two = undistorted(first, "first", camera), undistorted(second, "second", other)
    k, k_two = intrinsics_of_camera(camera), intrinsics_of_camera(other)
    if threshold is not None:
        check_sampling(threshold, CONFIDENCE, MAX_SAMPLES)
    status = check_points({"first": one, "second": two}, 5, "points")
    if status == VisionStatus.OK and distinct(np.concatenate([one, two], 1), 5) < 5:
        status = VisionStatus.TOO_FEW
    if status != VisionStatus.OK:
        return _no_pose(status, len(one))
    scene = _scene(one, two, k, k_two)
    if threshold is None:
        return estimate_motion(scene, np.ones(len(one), bool), np.empty((0, 3, 3)), None, seed, 0)
    problem = replace(scene.problem(), scores=checked_scores(scores, len(one)))
    found = consensus(problem, threshold, seed, CONFIDENCE, MAX_SAMPLES)
    status = consensus_status(problem, found, threshold, seed)
    if status != VisionStatus.OK or found.best is None:
        return _no_pose(status, len(one), n_samples=found.n_samples)
    return estimate_motion(
        scene, np.asarray(found.best.inliers), found.best.model[None], threshold, seed, found.n_samples
    )


def estimate_motion(
    scene: Scene, inliers: Reals, starts: Reals, threshold: float | None, seed: int, n_samples: int
) -> RelativePose:
    """Return the result for pairs that agree with a motion, or for all pairs if there is no threshold."""
    limit = ALL if threshold is None else threshold * threshold
    found = scene.minima(starts, inliers, limit, min(_APART**2 * limit, ALL))
    candidates = _in_front(scene, found.motors, inliers, limit)
    if not len(candidates.motors):
        return _no_pose(VisionStatus.DEGENERATE, len(inliers), n_samples=n_samples)
    squares, points, ahead = scene.explained(candidates.motors)
    if threshold is not None:
        inliers = squares[0] <= limit
    used, n = scene.some(inliers), int(inliers.sum())
    costs = np.minimum(squares, limit)[:, inliers].sum(1)
    variance = float(scene.noise.raised(costs[0], n - 5))
    known = Noise(variance, scene.noise.weight + max(n - 5, 0))
    if threshold is None and _contradicted(scene.noise, squares[0]):
        return _no_pose(VisionStatus.NOT_CONVERGED, n)
    rotation, explained = _without_parallax(scene, inliers, candidates.motors[0], known, threshold)
    if rotation is not None:
        if 2 * explained < n:
            return _no_pose(VisionStatus.NO_CONSENSUS, len(inliers), n_samples=n_samples)
        return _no_pose(VisionStatus.DEGENERATE, len(inliers), rotation, n_samples)
    status = _status(used, candidates.information[0], known)
    if status == VisionStatus.OK and threshold is not None:
        status = _beyond_chance(scene, inliers, candidates.motors[0], threshold, seed)
    if status == VisionStatus.OK and not candidates.converged[0]:
        status = VisionStatus.NOT_CONVERGED
    if status != VisionStatus.OK:
        return _no_pose(status, len(inliers), n_samples=n_samples)
    growth = 1.0 if threshold is None else growth_by_threshold(n, int((squares[0] <= 4 * limit).sum()) - n)
    if not np.isfinite(growth):
        return _no_pose(VisionStatus.NOT_CONVERGED, len(inliers), n_samples=n_samples)
    motors, near = _likely(scene, inliers, candidates.motors, squares, limit)
    return RelativePose(
        motors[0] if len(motors) == 1 else _NOTHING.copy(),
        VisionStatus.OK if len(motors) == 1 else VisionStatus.AMBIGUOUS,
        inliers,
        np.where((inliers & ahead[0])[:, None], points[0], np.nan),
        np.asarray(relative_poses.essential_of_motion(motors[0])),
        _covariance(motors[0], candidates.information[0], growth * variance, near),
        motors,
        _NOTHING.copy(),
        float(np.sqrt(costs[0] / n)),
        n_samples,
    )


def _in_front(scene: Scene, motors: Reals, inliers: Reals, limit: float) -> Motions:
    """Return motions of minima, the best for all pairs first, with points in front of the cameras.

    Each of the four motions of a minimum leads to a minimum with this condition. Minima whose squares exceed those of
    the best motion by too much to be likely are left out.
    """
    n, used = int(inliers.sum()), scene.some(inliers)
    matrices = np.asarray(relative_poses.essential_of_motion(motors))
    all_pairs, good = (
        relative_poses.truncated_squares(each.fundamental(matrices), each.first, each.second, limit)
        for each in (scene, used)
    )
    own = good.min(initial=np.inf)
    margin = largest_likely(own, n, max(n - 5, 0), scene.noise, n) - own
    found, least = list[Motions](), np.inf
    for k in np.argsort(all_pairs, kind="stable"):
        if all_pairs[k] > least + margin:
            break
        options = np.asarray(relative_poses.motions_of_essential(matrices[k]))
        found.append(scene.descended_in_front(options, limit))
        least = min(least, float(found[-1].cost.min()))
    return joined(found)


def _likely(scene: Scene, inliers: Reals, motors: Reals, squares: Reals, limit: float) -> tuple[Reals, Reals]:
    """Return the motions that noise and chance can make as bad as they are, if the first one is the best by chance.

    Of motions that are not separated by an unlikely one, which are within the uncertainty of one of them, the best is
    returned. The steps (k, 5) from the first motion to those that belong to it are returned, too.
    """
    used = scene.some(inliers)
    kept, near, normals = [0], [np.zeros(5)], used.normals(motors[0])
    share = share_of_wrong_pairs(scene, motors[0], limit) if len(motors) > 1 else 0.0
    for k in range(1, len(motors)):
        both = (squares[k] <= limit)[inliers]
        n = int(both.sum())
        costs = squares[0][inliers][both].sum(), squares[k][inliers][both].sum()
        if n < 5 or costs[1] >= largest_likely(costs[0], n, n - 5, scene.noise, n):
            continue
        unlike = max(float((1 - (normals * used.normals(motors[k])).sum(1)[both] ** 2).sum()), 0.0)
        if costs[1] >= largest_likely(costs[0], n, n - 5, scene.noise, unlike):
            continue
        if n < len(both) and not lost_by_chance(share, squares[[0, k]], limit):
            continue
        own = np.minimum(squares[[*kept, k]], limit)[:, inliers].sum(1)
        middle = np.minimum(used.explained(halfway(motors[kept], motors[k]))[0], limit).sum(1)
        joint = middle < largest_likely(np.maximum(own[:-1], own[-1]), len(both), max(len(both) - 5, 0), scene.noise)
        if not joint.any():
            kept.append(k)
        elif joint[0]:
            near.append(steps_to(motors[0], motors[k]))
    return motors[kept], np.array(near)


def lost_by_chance(share: float, squares: Reals, limit: float) -> bool:
    """Return whether pairs that only the first of two motions explains could be wrong pairs that agree by chance."""
    unexplained = squares[1] > limit
    count = int((squares[0][unexplained] <= limit).sum())
    logarithm = log_false_alarms(int(unexplained.sum()), np.array(count), np.array(share), _ANOTHER)
    return bool(logarithm > np.log(WRONG))


def share_of_wrong_pairs(scene: Scene, motor: Reals, limit: float) -> float:
    """Return the fraction of pairs with the partners of others that a motion explains."""
    matrix = scene.fundamental(np.asarray(relative_poses.essential_of_motion(motor)))
    wrong = relative_poses.squared_distances(matrix, *unrelated(scene.first, scene.second))
    return max(float(np.mean(wrong <= limit)), 1 / int(wrong.size))


def _contradicted(noise: Noise, squares: Reals) -> bool:
    """Return whether the squares (n,) of all pairs, or that of one, are larger than noise would leave."""
    n, cost = len(squares), squares.sum()
    if n <= 5:
        return False
    one = n > 6 and noise.outlying(squares, 1, cost - squares, n - 6).any()
    return bool(one or noise.contradicted(cost, n - 5))


def _beyond_chance(scene: Scene, inliers: Reals, motor: Reals, threshold: float, seed: int) -> VisionStatus:
    """Return whether the inliers are neither those of a line nor those of partners displaced at random."""
    problem, model = scene.problem(), np.asarray(relative_poses.essential_of_motion(motor))
    if displaced_by_chance(problem, model, scene.turned(motor), threshold, FREEDOM):
        return VisionStatus.NO_CONSENSUS
    hidden = hidden_by_a_line(problem, model, inliers, threshold, seed, _OFF_A_LINE)
    return VisionStatus.DEGENERATE if hidden else VisionStatus.OK


def _status(used: Scene, information: Reals, known: Noise) -> VisionStatus:
    """Return whether pairs determine the motion, up to noise."""
    n = len(used.first)
    if not np.isfinite(information).all() or rank(information) < 5:
        return VisionStatus.DEGENERATE
    directions = np.linalg.inv(information)[3:, 3:] * known.variance
    if np.linalg.eigvalsh(directions)[-1] * largest_ratio(1) > (np.pi / 2) ** 2:
        return VisionStatus.DEGENERATE
    allowed = (n - 2) * largest_ratio(n - 2, known.weight) * known.variance
    if max(extents(used.first)[0], extents(used.second)[0]) ** 2 <= allowed:
        return VisionStatus.DEGENERATE
    few = few_places(used.first, used.second, np.sqrt(known.variance), 5)
    return VisionStatus.DEGENERATE if few else VisionStatus.OK


def _without_parallax(
    scene: Scene, inliers: Reals, motor: Reals, known: Noise, threshold: float | None
) -> tuple[Reals | None, int]:
    """Return a rotation if chance and noise explain what it leaves, or None, and the number of inliers it explains.

    A translation removes one residual of each pair, the parallax. If that is noise, so is the translation.
    """
    n = int(inliers.sum())
    starts = np.asarray(relative_poses.motions_of_essential(relative_poses.essential_of_motion(motor)))[[0, 2]]
    rotation = scene.some(inliers).rotation(starts, ALL if threshold is None else (_WIDE * threshold) ** 2)
    far = np.minimum(scene.far(rotation), ALL)
    if threshold is None:
        return None if known.contradicted(far.sum(), 2 * n - 3) else rotation, n
    off = known.outlying(far, 2, np.array([0.0]), 0)
    near = inliers & ~off
    explained = int(near.sum())
    if explained > 2 and known.contradicted(far[near].sum(), 2 * explained - 3):
        return None, explained
    if off.sum() > _OFF_A_ROTATION.sample_size:
        rest = scene.some(off)
        model = np.asarray(relative_poses.essential_of_motion(motor))
        if not displaced_by_chance(rest.problem(), model, rest.turned(rotation), threshold, _OFF_A_ROTATION):
            return None, explained
    return rotation, explained


def _covariance(motor: Reals, information: Reals, variance: float, near: Reals) -> Reals:
    """Return the covariance (6, 6) of the rotation vector and the translation.

    It covers the steps (k, 5) to other minima that are as likely and not separate.
    """
    values, vectors, scale = spectrum(information)
    inverse = (vectors / values) @ vectors.T * np.outer(scale, scale)
    shift = relative_poses.translation_of_motion(motor)
    onto = np.zeros((6, 5))
    onto[:3, :3] = np.eye(3)
    onto[3:, 3:] = np.stack(relative_poses.tangents_of_direction(shift), -1)
    return np.asarray(onto @ (variance * inverse + near.T @ near) @ onto.T)


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


def undistorted(value: ArrayLike, name: str, camera: Camera | ArrayLike) -> Reals:
    """Return pixels (n, 2) of the camera without distortion, also from (n, 1, 2)."""
    array = one_set(real_array(value, name, (2,), "x y in pixels"))
    return np.asarray(camera.undistort(array) if isinstance(camera, Camera) else array, np.float64)


def _scene(one: Reals, two: Reals, k: Reals, k_two: Reals) -> Scene:
    """Return pixels relative to the principal points, and the noise of both cameras."""
    own, other = (np.array([[m[0, 0], m[0, 1], 0], [0, m[1, 1], 0], [0, 0, 1]]) for m in (k, k_two))
    noises = pixel_noise(own), pixel_noise(other)
    noise = Noise((noises[0].variance + noises[1].variance) / 2, noises[0].weight)
    return Scene(one - k[:2, 2], two - k_two[:2, 2], own, other, noise)
