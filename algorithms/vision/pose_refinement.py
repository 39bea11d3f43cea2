"""Poses with the least squares of distances in the image, over leading axes, and tests of their reliability."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from generated import camera_poses, pga3

from ..arguments import Reals
from ..evidence import WRONG, Noise, differ, growth_by_threshold, likely, likely_bounds
from ..evidence.noise import USUAL_WEIGHT
from ..precision import TINY
from .plane_adjustment import N_POSE
from .pose_starts import pose_starts
from .robust import ALL
from .status import VisionStatus

EXPLAINED = 0.03
"""Maximum fraction of the squares of pixels about their centroid that a valid pose leaves. It was tuned on random
pixels and points: an image of points that leaves more is as bad as none."""
_USUAL = 1e-3
"""The usual noise of pixels, in focal lengths: most points are located to half a pixel, by cameras of 500 pixels."""
_SOON = 25.0
"""A limit on work: the number of iterations between tests whether a start can still lead to a likely minimum."""


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """Poses [R | t] of sets of points, and their properties, over leading axes."""

    matrix: Reals
    """(..., 3, 4)"""
    cost: Reals
    """(...) The sum of squared distances in the image, in pixels."""
    normal: Reals
    """(..., 6, 6) The normal equations at the pose, with translations in units of the depth."""
    converged: Reals
    """(...) bool: whether no step decreases the cost any further."""
    in_front: Reals
    """(...) bool: whether all points are in front of the camera."""
    lowest: Reals
    """(...) The cost of the linear problem at the pose: a minimum near it has no less."""

    def at(self, index: Reals | int | tuple[Reals | slice | int, ...]) -> Poses:
        """Return the poses at an index of the leading axes."""
        return Poses(*(part[index] for part in self.parts()))

    def parts(self) -> tuple[Reals, Reals, Reals, Reals, Reals, Reals]:
        """Return all arrays."""
        return self.matrix, self.cost, self.normal, self.converged, self.in_front, self.lowest


def pixel_noise(k: Reals, noise: float | None = None) -> Noise:
    """Return what is known of the noise of pixels: the variance that the caller states, or the usual one."""
    if noise is not None:
        return Noise(noise * noise)
    return Noise(_USUAL * _USUAL * abs(float(k[0, 0] * k[1, 1])), USUAL_WEIGHT)


def all_poses(places: Reals, image: Reals, k: Reals, n_steps: int, noise: Noise) -> Poses:
    """Return the minima (b, s) from all starts: first those with all points in front of the camera, the least first.

    `places` (b, n, 3) are relative to their centroids, `image` (b, n, 2) are pixels. The last start is the reversal of
    the best minimum that the others lead to.

    Iterations end if the cost of the linear problem at a pose is larger than that of any likely minimum. That is
    bounded by the least cost of poses with all points in front of the camera, which have yet to decrease. In 1,200
    scenes of markers, boards and 4 to 30 points, statuses equal those of 1,000 iterations from all starts.
    """
    n, starts = places.shape[1], pose_starts(places, image, k)
    starts = np.concatenate([starts, starts[:, :1]], 1)
    bounds = np.array(likely_bounds(2 * n, 2 * n - N_POSE, noise))
    found, normal, numbers = camera_poses.follow_poses(starts, k, places, image, bounds, _SOON, float(n_steps))
    cost, reached = numbers[..., 0], numbers[..., 1:] > 0
    return Poses(found, np.where(cost < ALL, cost, np.nan), normal, reached[..., 0], reached[..., 2], numbers[..., 2])


def ordered(found: Poses) -> Poses:
    """Return poses (b, s), first those with all points in front of the camera, the least first."""
    order = np.lexsort((np.fmin(found.cost, np.inf), ~found.in_front), axis=1)
    return found.at((np.arange(len(order))[:, None], order))


def pose_status(found: Poses, places: Reals, image: Reals, k: Reals, noise: Noise) -> tuple[Reals, Reals]:
    """Return a `VisionStatus` (b,) for the first of each set of minima (b, s), and which of these are likely (b, s).

    The status is TOO_FEW for fewer than four distinct points and DEGENERATE if they are on a line or if a motion is
    undetermined. It is NOT_CONVERGED if iterations ended early, if points are behind the camera, if the residual of
    all points or of one is more than noise, or if it is larger than for an image of the points: for random pixels the
    residual is below a fraction x of their squares with a probability of about x^(n - 3). It is AMBIGUOUS if another
    minimum, farther from the first than its bound, is likely as well, or if one that was not reached may be.
    """
    squares = np.asarray(camera_poses.pixel_squares(found.matrix[:, 0], k, places, image))
    centred = image - image.sum(1, keepdims=True) / image.shape[1]
    spread = np.vecdot(centred, centred).sum(1)
    return judged_poses(found, places, squares, spread, noise, _depth(found.matrix))


def judged_poses(
    found: Poses,
    places: Reals,
    squares: Reals,
    spread: Reals,
    noise: Noise,
    unit: Reals,
    ends: Reals | None = None,
) -> tuple[Reals, Reals]:
    """Return what `pose_status` does for cameras of any kind.

    `squares` (b, n) are the squared distances of pixels for the best poses, `spread` (b,) the sum of squares that an
    image of other points leaves, and `unit` (b, s) that of translations in the normal equations. If lines are among the
    `places`, `ends` (b, m, 3) are points of all of them.
    """
    n = places.shape[1]
    cost, freedom = found.cost[:, 0], 2 * n - N_POSE
    undetermined = np.asarray(camera_poses.undetermined_pose(places if ends is None else ends, found.normal[:, 0])) > 0
    explained = cost <= min(WRONG ** (1 / (n - 3)), EXPLAINED) * spread
    explained &= ~noise.contradicted(cost, freedom)
    explained &= ~noise.outlying(squares, 2, cost[:, None] - squares, freedom - 2).any(1)
    # A minimum that was not reached may be as likely as the linear problem says.
    costs = np.where(found.converged, found.cost, np.maximum(found.lowest, cost[:, None]))
    rivals = likely(np.where(found.in_front, costs, np.inf), 2 * n, freedom, noise)
    rivals[:, 0] = True
    for i in range(rivals.shape[1] - 1):
        if not rivals[:, i + 1 :].any():
            break
        known = np.where(np.isfinite(found.normal[:, i : i + 1]), found.normal[:, i : i + 1], 0)
        offsets = _offsets(found, i, unit[:, i : i + 1])
        apart = differ(offsets, known, noise.raised(found.cost[:, i : i + 1], freedom))
        rivals[:, i + 1 :] &= (apart | ~rivals[:, i : i + 1])[:, i + 1 :]
    status = np.zeros(len(rivals), int)
    status[rivals[:, 1:].any(1)] = VisionStatus.AMBIGUOUS
    status[~(found.converged[:, 0] & found.in_front[:, 0] & explained)] = VisionStatus.NOT_CONVERGED
    status[undetermined[:, 1]] = VisionStatus.DEGENERATE
    status[undetermined[:, 0]] = VisionStatus.TOO_FEW
    return status, rivals


def growth_of_poses(squares: Reals, threshold: float) -> float:
    """Return the factor by which a threshold makes the variance of a pose larger.

    `squares` are those of the distances of all pixels.
    """
    within, twice = (int((squares <= limit * limit).sum()) for limit in (threshold, 2 * threshold))
    return growth_by_threshold(within, twice - within, 2)


def deviations(pose: Poses, n_points: int, noise: Noise, unit: float | None = None, growth: float = 1.0) -> Reals:
    """Return the standard deviations (2,) of rotation and centre, in the least certain directions, of one pose.

    The unit of translations is the distance of the centroid of the points from the camera, unless it is given. The
    variance is multiplied by a growth.
    """
    variance = growth * noise.raised(pose.cost, 2 * n_points - N_POSE)
    largest = np.maximum(camera_poses.largest_variances(pose.normal), 0)
    found = np.asarray(np.sqrt(variance * largest))
    found[1] *= _depth(pose.matrix) if unit is None else unit
    return found


def _offsets(found: Poses, i: int, unit: Reals) -> Reals:
    """Return the motions (b, s, 6) from poses (b, i) to all, as vectors of steps, with translations in units (b, 1)."""
    return motions_between(found.matrix[:, i : i + 1], found.matrix, unit[..., None])


def motions_between(first: Reals, second: Reals, unit: Reals | float) -> Reals:
    """Return motions (..., 6) between poses (..., 3, 4) as vectors of steps; numbers that are not finite count as 0."""
    first, second = (np.where(np.isfinite(matrix), matrix, 0) for matrix in (first, second))
    turn = second[..., :3] @ np.swapaxes(first[..., :3], -1, -2)
    rotation = pga3.rotor_to_rotation_vector(pga3.rotor_from_matrix(turn))
    shift = second[..., 3] - (turn @ first[..., 3:])[..., 0]
    return np.concatenate([rotation, shift / unit], -1)


def _depth(matrix: Reals) -> Reals:
    """Return the distances of the centroids of points from cameras (..., 3, 4): the unit of translations."""
    shift = matrix[..., 3]
    return np.asarray(np.maximum(np.sqrt(np.vecdot(shift, shift)), TINY))


def camera_motors(matrix: Reals, centroid: Reals) -> Reals:
    """Return unit motors (b, 8) from camera to world frame, for poses (b, 3, 4) of points about a centroid (..., 3).

    The centre of the camera is computed relative to the centroid, which preserves accuracy far from the origin.
    """
    return np.asarray(camera_poses.motor_of_pose(matrix, centroid))
