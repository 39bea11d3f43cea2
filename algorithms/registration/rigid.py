"""Rigid registration of two clouds of points from any pose, with all poses that explain them equally well."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals
from ..elements import MOTOR, POINT, elements
from .alignment import Found, Task, different, hypothesis_refined, inverted, reach_of, solved
from .clouds import Cloud, Shape, levels, shape_of, thickness, valid_points, without_stray
from .flat import flat_registered
from .hypotheses import correlated_poses, descended
from .lines import line_registered
from .refinement import Part, neighbours, planes_target
from .rigid_status import RegistrationStatus

_SEARCH, _FINISH = 2200, 11000
"""Points to which larger clouds are thinned, for the search and for the last refinement."""
_HYPOTHESES = 20
"""A limit on work: the number of motions of the search that are refined."""
_SCALES = 1.0, 1 / 2, 1 / 4, 1 / 8
"""Multiples of the scale of distances at which poses are compared."""
_UNEVEN = 1.05
"""How much less even than the source the target has to be for the target to be moved to the source."""
_LEAST_SUPPORT, _LEAST_GAIN = 0.45, 0.15
"""Least support of a pose, and by how much it has to exceed the support of poses beside it."""
_HOPELESS = 0.7
"""Part of the best score below which hypotheses are not refined."""
_EXACT = 0.5
"""Least score of clouds that contain the same points, without outliers."""
_MOST_RATIO = 3.0
"""Ratio of the sizes of clouds from which on they are taken for measured in different units."""
_THICK, _PLATE = 0.05, 0.3
"""Ratios of the third to the second extent: above the first one, flat clouds without support are registered as solid
ones; below the second one, solid clouds with several poses are registered as flat ones."""


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses that explain the data equally well, best first.

    Attributes
    ----------
    motors : array, (k, 8)
    scores : array, (k,)
        The support of each: the weighted share of the source's points near the target.
    """

    motors: Reals
    scores: Reals


@dataclass(frozen=True, eq=False)
class Registration:
    """The rigid motion between two clouds.

    Attributes
    ----------
    motor : array, (8,)
        Motor of `generated.pga3` that takes the source to the target; the identity if no pose was found.
    inliers : array of bool, (n,)
        The rows of the source that are on the target.
    status : RegistrationStatus
    poses : Poses
        All poses found that explain the data equally well, one of each family that free motions connect.
    covariance : array, (6, 6)
        Of the coefficients e12 e13 e23 e01 e02 e03 of the small bivector B for which ``exp(B) motor`` is true. It is
        large for free motions.
    residual : float
        Root mean square of the inliers' distances from the surface of the target, for flat clouds also from its
        outline, and for clouds on a line from the line.
    coverage : float
        The share of the target's points with a point of the source nearby.
    support, contrast : float
        The weighted share of the source near the target, and by which part of it shifted poses have less. If the
        target has more outliers, it is the share of the target near the source. For flat clouds four fifths of it are
        the share of the outline, and for clouds on a line it is the common part of the densities.
    free : array, (k, 6)
        Bivectors of motions that change nothing, as about the axis of a cylinder or of a line.
    """

    motor: Reals
    inliers: Any
    status: RegistrationStatus
    poses: Poses
    covariance: Reals
    residual: float
    coverage: float
    support: float
    contrast: float
    free: Reals


@elements({"motor": MOTOR}, source=POINT, target=POINT)
def register(source: ArrayLike, target: ArrayLike) -> Registration:
    """Find the rigid motion that takes one cloud of points to another, without a guess.

    Densities of the clouds are correlated for a grid of all rotations and all translations; the best poses descend in a
    batch to local optima of a robust distance, and are refined to the surface of the target. All poses of equal score
    are returned; compositions of the symmetries that were found complete them.

    Flat clouds are registered by their outlines, with both sides: a half turn about an axis in the plane has the effect
    of a mirror image. Clouds on a line are registered by their densities along the line, in both directions.

    Parameters
    ----------
    source : array_like, (n, 3)
    target : array_like, (m, 3)
        Rows with NaN or infinite numbers are left out.

    Returns
    -------
    Registration
        With the status OK, the pose is the only one that was found to explain the data, and it has more support than
        poses beside it.

    Raises
    ------
    TypeError, ValueError
        If an argument is not an array of real numbers with rows of three.
    """
    source_points, target_points = (
        without_stray(valid_points(cloud, name)[0]) for cloud, name in ((source, "source"), (target, "target"))
    )
    rows = np.asarray(source, float)
    shape, status = shape_of(source_points, target_points)
    if shape == Shape.MIXED:
        return _nothing(status, len(rows))
    # Lengths are relative to the size of the target, and places to the middles of the clouds.
    from_here, to_here = source_points.mean(0), target_points.mean(0)
    unit = float(np.linalg.norm(target_points.std(0)))
    ratio = float(np.linalg.norm(source_points.std(0))) / unit
    if not 1 / _MOST_RATIO < ratio < _MOST_RATIO:
        return _nothing(RegistrationStatus.DIFFERENT_UNITS, len(rows))
    method = {Shape.SOLID: _registered, Shape.FLAT: flat_registered, Shape.LINE: line_registered}[shape]
    points = (source_points - from_here) / unit, (target_points - to_here) / unit
    found = method(*points)
    thin = thickness(*points)
    if shape == Shape.FLAT and found.status == RegistrationStatus.NO_SUPPORT and thin > _THICK:
        found = _registered(*points)
    elif shape == Shape.SOLID and len(found.motors) > 1 and thin < _PLATE:
        # Thin plates slide along themselves with little loss, unless their outlines are aligned.
        other = flat_registered(*points)
        if other.status != RegistrationStatus.NO_SUPPORT and len(other.motors) < len(found.motors):
            found = other
    return _in_units(found, rows, from_here, to_here, unit)


def _registered(source_points: Reals, target_points: Reals) -> Found:
    """Register the cloud with more scattered points to the other one, whose surface is better known."""
    clouds = levels(source_points, target_points, _SEARCH)
    swapped = clouds[1].unevenness > _UNEVEN * clouds[0].unevenness
    task = last = _task(*clouds[::-1]) if swapped else _task(*clouds)
    motors, scores = descended(task.source, task.target, correlated_poses(task.source, task.target))
    rows = different(motors, scores, task, _HYPOTHESES)
    # If the clouds contain the same points, the best one has no rivals: they are compared with the second best.
    best = rows[:2][-1] if scores[rows[0]] > _EXACT else rows[0]
    rows = [row for row in rows if scores[row] >= _HOPELESS * scores[best]]
    fine = np.stack([hypothesis_refined(motors[row], task) for row in rows])
    if max(len(source_points), len(target_points)) > 2 * _SEARCH:
        clouds = levels(source_points, target_points, _FINISH)
        last = _task(*clouds[::-1]) if swapped else _task(*clouds)
    found = solved(fine, task, last, (_LEAST_SUPPORT, _LEAST_GAIN), None)
    return inverted(found, last) if swapped else found


def _task(source: Cloud, target: Cloud) -> Task:
    part = Part(source.points, source.weights, planes_target(target))
    reach = reach_of(target.spacing, min(source.size, target.size))
    return Task(source, target, (part,), (1.0,), reach, np.eye(3), scales=_SCALES)


def _nothing(status: RegistrationStatus, count: int) -> Registration:
    identity = np.eye(8)[0]
    return Registration(
        identity, np.zeros(count, bool), status, Poses(np.zeros((0, 8)), np.zeros(0)), np.diag(np.full(6, np.inf)),
        np.inf, 0.0, 0.0, 0.0, np.zeros((0, 6)),
    )  # fmt: skip


def _in_units(found: Found, rows: Reals, from_here: Reals, to_here: Reals, unit: float) -> Registration:
    """Return a registration in the units and places of the arguments."""
    if found.status == RegistrationStatus.NO_SUPPORT:
        nothing = _nothing(found.status, len(rows))
        return Registration(**{**vars(nothing), "support": float(found.scores[0]), "contrast": found.contrast})
    valid = np.isfinite(rows).all(1)
    moved = pga3.move_point(found.motors[0], (rows[valid] - from_here) / unit)
    own = neighbours(found.surface, moved, found.gate)[2]
    inliers = np.zeros(len(rows), bool)
    inliers[valid] = own < max(3 * found.residual, 1e-9)
    lengths = np.array([1, 1, 1, 1, unit, unit, unit, unit])

    def whole(motors: Reals) -> Reals:
        return between_places(motors * lengths, from_here, to_here)

    moves = _about(to_here) @ np.diag(lengths[1:7])
    free = found.free @ moves.T
    size = np.linalg.norm(free, axis=1, keepdims=True)
    motors = whole(found.motors)
    free = free / size if len(free) else free
    return Registration(
        motors[0], inliers, found.status, Poses(motors, found.scores), moves @ found.covariance @ moves.T,
        found.residual * unit, found.coverage, float(found.scores[0]), found.contrast, free,
    )  # fmt: skip


def _translator(shift: Reals) -> Reals:
    still = np.array([1.0, 0, 0, 0])
    return np.asarray(pga3.motor_from_rotor_translation(still, shift))


def between_places(motors: Reals, here: Reals, there: Reals) -> Reals:
    """Return motors from absolute coordinates, given those between coordinates relative to two places."""
    return np.asarray(pga3.motor_product(_translator(there), pga3.motor_product(motors, _translator(-here))))


def _about(place: Reals) -> Reals:
    """Return the matrix that takes bivectors of motions about the origin to those about a place."""
    moved = pga3.move_line(_translator(place), np.eye(6))
    return np.asarray(moved).T
