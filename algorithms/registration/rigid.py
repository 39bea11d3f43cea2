"""Rigid registration of two clouds of points from any pose, with all poses that explain them equally well."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals
from .clouds import Cloud, cloud_of, shape_status, thinned, valid_points, voxel_for
from .hypotheses import correlated_poses, descended
from .refinement import Refined, Surface, neighbours, planes_target, refined
from .rigid_status import RegistrationStatus

_SEARCH, _FINISH = 2200, 11000
"""Points to which larger clouds are thinned, for the search and for the last refinement."""
_HYPOTHESES, _REPORTED = 20, 12
_APART, _APART_SHIFT = np.radians(8.0), 0.08
"""Angle, and shift relative to the size, up to which poses count as the same."""
_FINE_GATES = [3.0, 2.0, 1.4, 1.0]
"""Greatest distances of neighbours relative to the last one, while a hypothesis is refined."""
_GATE, _SCALE = 0.05, 0.012
"""Least of the greatest distance of neighbours, and of the scale of distances, relative to the size."""
_SPACINGS, _SCALE_OF_GATE = 1.0, 0.25
"""The greatest distance in spacings of the target, and the scale of distances in multiples of that."""
_MARGIN = 0.05
"""Part of the support by which two poses may differ and still explain the data equally well."""
_LEAST_SUPPORT, _LEAST_GAIN = 0.45, 0.15
"""Least support of a pose, and by how much it has to exceed the support of poses beside it."""
_SHIFTS = 1.2
"""Shift, in greatest distances of neighbours, with which the support of a pose is compared."""
_FREE, _NEARLY_FREE, _GAP = 0.004, 0.03, 0.1
"""A motion is free if its information is less than the first part of the greatest one, or if it is less than the second
part, and than the third part of the next one: normals of noisy points leave some."""
_HOPELESS = 0.7
"""Part of the best score below which hypotheses are not refined."""
_MOST_RATIO = 3.0


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
        All poses found that explain the data equally well.
    covariance : array, (6, 6)
        Of the coefficients e12 e13 e23 e01 e02 e03 of the small bivector B for which ``exp(B) motor`` is true.
    residual : float
        Root mean square of the inliers' distances from the surface of the target.
    coverage : float
        The share of the target's points with a point of the source nearby.
    support, contrast : float
        The weighted share of the source near the target, and by which part of it shifted poses have less.
    free : array, (k, 6)
        Bivectors of motions that change nothing, as about the axis of a cylinder.
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


def register(source: ArrayLike, target: ArrayLike) -> Registration:
    """Find the rigid motion that takes one cloud of points to another, without a guess.

    Densities of the clouds are correlated for a grid of all rotations and all translations; the best poses descend in a
    batch to local optima of a robust distance, and are refined to the surface of the target. All poses of equal support
    are returned.

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
    source_points, _ = valid_points(source, "source")
    target_points, _ = valid_points(target, "target")
    rows = np.asarray(source, float)
    for points in (source_points, target_points):
        status = shape_status(points)
        if status != RegistrationStatus.OK:
            return _nothing(status, len(rows))
    # Lengths are relative to the size of the target, and places to the middles of the clouds.
    from_here, to_here = source_points.mean(0), target_points.mean(0)
    unit = float(np.linalg.norm(target_points.std(0)))
    ratio = float(np.linalg.norm(source_points.std(0))) / unit
    if not 1 / _MOST_RATIO < ratio < _MOST_RATIO:
        return _nothing(RegistrationStatus.DIFFERENT_UNITS, len(rows))
    found = _registered((source_points - from_here) / unit, (target_points - to_here) / unit)
    return _in_units(found, rows, from_here, to_here, unit)


@dataclass(frozen=True, eq=False)
class _Found:
    """A registration in own units, without the rows of the source."""

    motor: Reals
    status: RegistrationStatus
    poses: Poses
    covariance: Reals
    residual: float
    coverage: float
    support: float
    contrast: float
    free: Reals
    surface: Surface
    gate: float


def _registered(source_points: Reals, target_points: Reals) -> _Found:
    source, target = _levels(source_points, target_points, _SEARCH)
    size = min(source.size, target.size)
    motors, scores = descended(source, target, correlated_poses(source, target))
    hopeful = scores > _HOPELESS * scores.max()
    motors = _different(motors[hopeful], scores[hopeful], source, size, _HYPOTHESES)
    surface = planes_target(target)
    reach = _reach(target, size)
    gates = [reach.gate * gate for gate in _FINE_GATES]
    fine = np.stack([
        refined(motor, source.points, source.weights, surface, gates, [gate / 2 for gate in gates]).motor
        for motor in motors
    ])  # fmt: skip
    support = np.array([_support(motor, source, surface, reach) for motor in fine])
    likely = support > (1 - 2 * _MARGIN) * support.max() - 2 / np.sqrt(len(source.points))
    fine = _different(fine[likely], support[likely], source, size, _REPORTED)
    if max(len(source_points), len(target_points)) > 2 * _SEARCH:
        source, target = _levels(source_points, target_points, _FINISH)
        surface, reach = planes_target(target), _reach(target, size)
    gate = reach.gate
    support = np.array([_support(motor, source, surface, reach) for motor in fine])
    equal = support > (1 - _MARGIN) * support.max() - 1 / np.sqrt(len(source.points))
    polished = [_polished(motor, source, surface, gate) for motor in fine[equal]]
    support = np.array([_support(pose.motor, source, surface, reach) for pose in polished])
    order = np.argsort(-support, kind="stable")
    best = polished[order[0]]
    poses = Poses(np.stack([polished[k].motor for k in order]), support[order])
    contrast = 1 - _beside(best.motor, source, surface, _SHIFTS * reach.gate, reach) / max(support[order[0]], 1e-12)
    covariance, free = _uncertainty(best, source, surface, gate)
    status = RegistrationStatus.OK
    if support[order[0]] < _LEAST_SUPPORT or contrast * support[order[0]] < _LEAST_GAIN:
        status = RegistrationStatus.NO_SUPPORT
    elif len(free):
        status = RegistrationStatus.FREE_MOTION
    elif len(order) > 1:
        status = RegistrationStatus.SYMMETRIC
    near = best.distances[np.isfinite(best.distances)]
    residual = float(np.sqrt(np.mean(np.minimum(near, 3 * np.median(near)) ** 2))) if len(near) else np.inf
    back = pga3.move_point(pga3.motor_inverse(best.motor), target.points)
    coverage = float(np.isfinite(source.tree.query(back, distance_upper_bound=gate)[0]).mean())
    return _Found(
        best.motor, status, poses, covariance, residual, coverage, float(support[order[0]]), float(contrast), free,
        surface, gate,
    )  # fmt: skip


class _Reach(NamedTuple):
    """The greatest distance of neighbours, and the scale at which they lose three quarters of their weight."""

    gate: float
    scale: float


def _reach(target: Cloud, size: float) -> _Reach:
    gate = max(_GATE * size, _SPACINGS * target.spacing)
    return _Reach(gate, max(_SCALE * size, _SCALE_OF_GATE * gate))


def _levels(source: Reals, target: Reals, most: int) -> tuple[Cloud, Cloud]:
    """Return clouds of at most about so many points, thinned by the same voxels."""
    larger = max(source, target, key=len)
    if len(larger) <= 2 * most:
        return cloud_of(source), cloud_of(target)
    voxel = voxel_for(larger, most)
    return cloud_of(thinned(source, voxel)), cloud_of(thinned(target, voxel))


def _different(motors: Reals, scores: Reals, source: Cloud, size: float, most: int) -> Reals:
    """Return the best of motors of which no two are about the same."""
    left = motors[np.argsort(-scores, kind="stable")]
    kept: list[Reals] = []
    middle = source.centre
    while len(left) and len(kept) < most:
        best = left[0]
        kept.append(best)
        between = pga3.motor_product(pga3.motor_inverse(best), left)
        angle = 2 * np.arctan2(np.linalg.norm(between[:, 1:4], axis=1), np.abs(between[:, 0]))
        shift = np.linalg.norm(pga3.move_point(between, middle) - middle, axis=1)
        left = left[(angle > _APART) | (shift > _APART_SHIFT * size)]
    return np.stack(kept)


def _support(motor: Reals, source: Cloud, surface: Surface, reach: _Reach) -> float:
    """Return the weighted share of the source's points near the surface, for a motor."""
    return _share(np.asarray(pga3.move_point(motor, source.points)), source, surface, reach)


def _share(moved: Reals, source: Cloud, surface: Surface, reach: _Reach) -> float:
    distances = neighbours(surface, moved, reach.gate)[2]
    return float(source.weights @ (1 + (distances / reach.scale) ** 2) ** -2.0 / source.weights.sum())


def _polished(motor: Reals, source: Cloud, surface: Surface, gate: float) -> Refined:
    first = refined(motor, source.points, source.weights, surface, [gate, 0.7 * gate, 0.5 * gate], [gate / 4] * 3)
    ones = np.ones(len(source.points))
    return refined(first.motor, source.points, ones, surface, [0.5 * gate] * 6, [0.0] * 6)


def _beside(motor: Reals, source: Cloud, surface: Surface, shift: float, reach: _Reach) -> float:
    """Return the mean support of a pose with the source shifted along each axis, both ways."""
    moved = np.asarray(pga3.move_point(motor, source.points))
    steps = shift * np.concatenate([np.eye(3), -np.eye(3)])
    return float(np.mean([_share(moved + step, source, surface, reach) for step in steps]))


def _uncertainty(pose: Refined, source: Cloud, surface: Surface, gate: float) -> tuple[Reals, Reals]:
    """Return the covariance of small bivectors, and those that are free: tangent planes do not resist them."""
    variance = pose.squares / max(pose.weight - 6, 1.0)
    values, vectors = np.linalg.eigh(pose.information)
    kept = np.maximum(values, 1e-12 * max(values[-1], 1e-300))
    covariance = variance * (vectors / kept) @ vectors.T
    still = np.zeros(len(surface.across))
    planes = replace(surface, across=still, along=still + 1)
    ones = np.ones(len(source.points))
    values, vectors = np.linalg.eigh(refined(pose.motor, source.points, ones, planes, [0.5 * gate], [0.0]).information)
    weak = values < _FREE * values[-1]
    weak[0] |= values[0] < min(_NEARLY_FREE * values[-1], _GAP * values[1])
    return covariance, vectors.T[weak]


def _nothing(status: RegistrationStatus, count: int) -> Registration:
    identity = np.eye(8)[0]
    return Registration(
        identity, np.zeros(count, bool), status, Poses(np.zeros((0, 8)), np.zeros(0)), np.diag(np.full(6, np.inf)),
        np.inf, 0.0, 0.0, 0.0, np.zeros((0, 6)),
    )  # fmt: skip


def _in_units(found: _Found, rows: Reals, from_here: Reals, to_here: Reals, unit: float) -> Registration:
    """Return a registration in the units and places of the arguments."""
    if found.status == RegistrationStatus.NO_SUPPORT:
        nothing = _nothing(found.status, len(rows))
        return Registration(**{**vars(nothing), "support": found.support, "contrast": found.contrast})
    valid = np.isfinite(rows).all(1)
    moved = pga3.move_point(found.motor, (rows[valid] - from_here) / unit)
    far, near = found.surface.cloud.tree.query(moved, distance_upper_bound=found.gate)
    near = np.where(np.isfinite(far), near, 0)
    own = np.abs(((moved - found.surface.cloud.points[near]) * found.surface.directions[near]).sum(1))
    inliers = np.zeros(len(rows), bool)
    inliers[valid] = np.isfinite(far) & (own < max(3 * found.residual, 1e-9))
    lengths = np.array([1, 1, 1, 1, unit, unit, unit, unit])

    def whole(motors: Reals) -> Reals:
        return between_places(motors * lengths, from_here, to_here)

    moves = _about(to_here) @ np.diag(lengths[1:7])
    free = found.free @ moves.T
    size = np.linalg.norm(free, axis=1, keepdims=True)
    poses = Poses(whole(found.poses.motors), found.poses.scores)
    return Registration(
        whole(found.motor), inliers, found.status, poses, moves @ found.covariance @ moves.T, found.residual * unit,
        found.coverage, found.support, found.contrast, free / size if len(free) else free,
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
