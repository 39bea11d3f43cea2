"""From hypotheses of poses to all poses that explain two clouds equally well: refinement, support, symmetries.

More than 400 lines are in one file because tasks, scores, symmetries and statuses depend on each other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from generated import pga3

from ..arguments import Reals
from ..evidence import WRONG
from ..precision import NEGLIGIBLE, ROUNDING, TINY
from .clouds import Cloud
from .contradictions import contradiction
from .refinement import Part, Refined, Surface, moved_points, neighbours, planes_target, refined
from .rigid_status import RegistrationStatus

_REPORTED = 64
"""The most poses that are reported: a dodecahedron has 60."""
_TRIES = 48
"""The most candidates by symmetry that are refined."""
_POLISHED = 20
"""The most hypotheses that are refined to the end; further poses follow by symmetry."""
_APART, _APART_SHIFT = np.radians(8.0), 0.08
"""Angle, and shift relative to the size, up to which poses count as the same."""
_FINE_GATES = (3.0, 2.0, 1.4, 1.0)
"""Greatest distances of neighbours relative to the last one, while a hypothesis is refined."""
_GATE, _SCALE = 0.05, 0.012
"""Least of the greatest distance of neighbours, and of the scale of distances, relative to the size."""
_SPACINGS, _SCALE_OF_GATE = 1.0, 0.25
"""The greatest distance in spacings of the target, and the scale of distances in multiples of that."""
_MARGIN = 0.05
"""Part of the support by which two poses may differ and still explain the data equally well."""
_NOISE = 0.1
"""The most noise of a support that is assumed for few points."""
_PROMISING = 0.7
"""Part of the support of the best pose that a pose by symmetry needs before it is refined."""
OWN = 0.1
"""Distance in spacings up to which a neighbour is the same point."""
_COINCIDENT = 0.4
"""Distance of neighbours in spacings of the target, up to which they are the same points."""
_SHARP_MARGIN, _SELF = 0.075, 0.9
"""The same for scores at several scales, and the score of a cloud at its own place relative to another sample of the
same surface: normals are those of its own points."""
_COMPARED, _WORTH = 10, 0.5
"""The most hypotheses that are compared at finer scales, and the part of the best support that they need."""
_SHARP, _OF_SHARP = 0.3, 0.8
"""Ratio of the shares at the middle and the first scale from which surfaces coincide more than by chance, which is 0.23
or less for nearly all unrelated objects; then the bounds of the support are multiplied by the second number."""
_MIDDLE, _DULL = -2, 0.8
"""The scale at which the surfaces of both clouds are compared, and the part of the ratio to the first share of one
cloud with itself that a certain pose needs."""
_TURN, _HELD = 0.1, 0.5
"""The weakest motion is also free if the score is larger than the second part of the best one after a motion by the
first multiple of its unit bivector, in both senses: 0.55 to 0.9 for a scanned can, 0.45 or less for other objects."""
_DIFFERENT = 4.5
"""From a probability: standard deviations by which random counts differ with 1e-5, for 72 turns with a thousandth."""
_TURNS, _TRANSLATES = 72, 0.1
"""Limits on work: turns by the weakest motion, unless it is nearly a translation."""
_SHIFTS = 1.2
"""Shift, in greatest distances of neighbours, with which the support of a pose is compared."""
_FREE, _NEARLY_FREE, _GAP = 0.004, 0.03, 0.1
"""A motion is free if its information is less than the first part of the greatest one, or if it is less than the second
part, and than the third part of the next one: normals of noisy points leave some."""


class Reach(NamedTuple):
    """The greatest distance of neighbours, and the scale at which they lose three quarters of their weight."""

    gate: float
    scale: float


def reach_of(spacing: float, size: float) -> Reach:
    """Return the reach for the spacing of a target and the size of the smaller cloud."""
    gate = max(_GATE * size, _SPACINGS * spacing)
    return Reach(gate, max(_SCALE * size, _SCALE_OF_GATE * gate))


@dataclass(frozen=True, eq=False)
class Task:
    """What a pose has to align at one resolution.

    Attributes
    ----------
    source, target : Cloud
    parts : tuple of Part
        The first one is from all points of the source to the surface of the target.
    factors : tuple of float
        Of the shares of the parts in the support; their sum is 1.
    reach : Reach
    beside : array, (k, 3)
        Directions of the target in which displaced poses have less support.
    """

    source: Cloud
    target: Cloud
    parts: tuple[Part, ...]
    factors: tuple[float, ...]
    reach: Reach
    beside: Reals
    exact: Part | None = None
    """Points against points, for clouds that contain the same ones."""
    scales: tuple[float, ...] = (1.0,)
    """Multiples of the scale of the reach at which poses are compared."""

    @property
    def size(self) -> float:
        """The size of the smaller cloud."""
        return min(self.source.size, self.target.size)

    @property
    def noise(self) -> float:
        """The noise of a support."""
        noise = sum(factor / np.sqrt(len(part.points)) for factor, part in zip(self.factors, self.parts, strict=True))
        return min(float(noise), _NOISE)


@dataclass(frozen=True, eq=False)
class Found:
    """A registration in own units, without the rows of the source."""

    status: RegistrationStatus
    motors: Reals
    scores: Reals
    covariance: Reals
    residual: float
    coverage: float
    contrast: float
    free: Reals
    surface: Surface
    """From it, inliers have distances."""
    gate: float


def planes_of(surface: Surface) -> Surface:
    """Return a surface whose distances are only those from its planes."""
    still = np.zeros(len(surface.across))
    return replace(surface, across=still, along=still + 1)


def shares(motor: Reals, task: Task, *, own: bool = True) -> Reals:
    """Return the weighted share of the points near the surfaces for each scale of a task, for a motor.

    If the clouds contain the same points, the true pose has more support than any other pose of a symmetric object,
    only because points are at their own places. Without these, distances are those from other points.
    """
    total = np.zeros(len(task.scales))
    for factor, part in zip(task.factors, task.parts, strict=True):
        least = 0.0 if own else OWN * part.surface.cloud.spacing
        distances = neighbours(part.surface, moved_points(motor, part), task.reach.gate, least)[2]
        total += factor * _near(distances, part.weights, task)
    return total


def _near(distances: Reals, weights: Reals, task: Task) -> Reals:
    scales = task.reach.scale * np.array(task.scales)
    return np.asarray((1 + (distances / scales[:, None]) ** 2) ** -2.0 @ weights / weights.sum())


def score(motor: Reals, task: Task, *, own: bool = True) -> float:
    """Return the geometric mean of the shares over all scales.

    A pose with a smaller overlap whose surfaces coincide has a higher score than one in which they are only near.
    """
    return float(np.exp(np.log(np.maximum(shares(motor, task, own=own), TINY)).mean()))


def support(motor: Reals, task: Task) -> float:
    """Return the weighted share of the points near the surfaces at the first scale, for a motor."""
    return float(shares(motor, task)[0])


def least_score(motors: Reals, scores: Reals, task: Task, times: float = 1.0) -> float:
    """Return the score that poses need to explain the data as well as the best one, up to some times the margin.

    The best pose of clouds with the same points is compared by its score without points at their own places.
    """
    best = motors[int(np.argmax(scores))]
    most = float(scores.max())
    if len(task.scales) == 1:
        level = min(most, score(best, task, own=False))
        return (1 - times * _MARGIN) * level - times * task.noise
    part = task.parts[0]
    far = part.surface.cloud.tree.query(moved_points(best, part))[0]
    if np.median(far) < OWN * part.surface.cloud.spacing:
        most = min(most, _SELF * score(best, task, own=False))
    return (1 - times * (_SHARP_MARGIN + task.noise)) * most


def own_sharpness(task: Task) -> float:
    """Return the ratio of the shares at the middle and the first scale, of the less even cloud with itself."""
    ratios = []
    for surface in (task.parts[0].surface, planes_target(task.source)):
        cloud = surface.cloud
        distances = neighbours(surface, cloud.points, task.reach.gate, NEGLIGIBLE * cloud.spacing)[2]
        own = _near(distances, cloud.weights, task)
        ratios.append(float(own[_MIDDLE] / own[0]))
    return min(ratios)


def contrast_of(motor: Reals, task: Task, own: float) -> float:
    """Return by which part of its support a pose exceeds poses shifted along each direction, in both senses."""
    still = np.array([1.0, 0, 0, 0])
    steps = _SHIFTS * task.reach.gate * np.concatenate([task.beside, -task.beside])
    shifted = pga3.motor_product(pga3.motor_from_rotor_translation(still, steps), motor)
    return float(1 - np.mean([support(one, task) for one in shifted]) / max(own, 1e-12))


def apart(one: Reals, others: Reals, task: Task, free: Reals | None = None) -> Reals:
    """Return which motors are clearly different from one, also after any of the free motions."""
    between = pga3.motor_product(others, pga3.motor_inverse(one))
    between = np.where(between[..., :1] < 0, -between, between)
    if free is not None and len(free):
        along = pga3.motor_logarithm(between) @ free.T @ free
        between = pga3.motor_product(pga3.motor_exponential(-along), between)
    middle = np.asarray(pga3.move_point(one, task.source.centre))
    angle = 2 * np.arctan2(np.linalg.norm(between[..., 1:4], axis=-1), np.abs(between[..., 0]))
    shift = np.linalg.norm(pga3.move_point(between, middle) - middle, axis=-1)
    return np.asarray((angle > _APART) | (shift > _APART_SHIFT * task.size))


def different(motors: Reals, scores: Reals, task: Task, most: int = _REPORTED, free: Reals | None = None) -> list[int]:
    """Return the rows of the best of motors, best first, of which no two are about the same."""
    left = np.argsort(-scores, kind="stable")
    kept: list[int] = []
    while len(left) and len(kept) < most:
        kept.append(int(left[0]))
        left = left[apart(motors[left[0]], motors[left], task, free)]
    return kept


def hypothesis_refined(motor: Reals, task: Task) -> Reals:
    """Refine a hypothesis with gates that become narrower."""
    gates = [task.reach.gate * gate for gate in _FINE_GATES]
    return refined(motor, task.parts, gates, [gate / 2 for gate in gates]).motor


def unexplained(motor: Reals, task: Task) -> int:
    """Return the number of points of both clouds without a point of the other one within the gate."""
    there = pga3.move_point(motor, task.source.points)
    back = pga3.move_point(pga3.motor_inverse(motor), task.target.points)
    clouds = (task.target, there), (task.source, back)
    near = [cloud.tree.query(points, distance_upper_bound=task.reach.gate)[0] for cloud, points in clouds]
    return int(sum(np.isinf(distances).sum() for distances in near))


def significantly_least(counts: Sequence[int]) -> Reals:
    """Return which counts do not exceed the least one by more than two random counts differ."""
    numbers = np.asarray(counts)
    return np.asarray(numbers - numbers.min() <= _DIFFERENT * np.sqrt(numbers + numbers.min() + 1))


def explaining(motors: Reals, task: Task) -> Reals:
    """Return which poses leave no more points unexplained than the best one, and no more surfaces contradicted."""
    kept = significantly_least([unexplained(motor, task) for motor in motors])
    possible = kept & [contradiction(motor, task.source, task.target) >= WRONG for motor in motors]
    return possible if possible.any() else kept


class Turned(NamedTuple):
    """What turns by the weakest motion of a pose leave unexplained."""

    better: Reals | None
    """The motor of a turn that leaves significantly less unexplained than the pose."""
    matters: bool
    """Whether some turns leave significantly more unexplained than others."""


def least_unexplained(motor: Reals, task: Task, weakest: Reals) -> Turned:
    """Compare full turns by the weakest motion of a pose, which hardly changes its distances from tangent planes."""
    size = float(np.linalg.norm(weakest[:3]))
    if size * task.size < _TRANSLATES * float(np.linalg.norm(weakest[3:])):
        return Turned(None, False)
    steps = np.pi / size * np.arange(_TURNS) / _TURNS
    motors = np.asarray(pga3.motor_product(pga3.motor_exponential(steps[:, None] * weakest), motor))
    counts = [unexplained(one, task) for one in motors]
    least = significantly_least(counts)
    return Turned(None if least[0] else motors[int(np.argmin(counts))], not least.all())


def polished(motor: Reals, task: Task) -> Refined:
    """Refine a motor with fixed scales, and then with scales from the data and without weights of points."""
    gate = task.reach.gate
    first = refined(motor, task.parts, [gate, 0.7 * gate, 0.5 * gate], [gate / 4] * 3)
    equal = [part._replace(weights=np.ones(len(part.points))) for part in task.parts]
    last = refined(first.motor, equal, [0.5 * gate] * 6, [0.0] * 6)
    if task.exact is None:
        return last
    near = np.median(task.target.tree.query(task.target.points, 2)[0][:, 1])
    closer = refined(last.motor, [task.exact], [0.5 * gate] * 10, [0.0] * 10)
    distances = neighbours(task.exact.surface, moved_points(closer.motor, task.exact), 0.5 * gate)[2]
    if np.median(distances) > _COINCIDENT * near:
        return last
    return Refined(closer.motor, refined(closer.motor, equal, [0.5 * gate], [0.0]).sums)


def completed(motors: list[Reals], task: Task, free: Reals, accept: Callable[[Reals], Reals | None]) -> list[Reals]:
    """Add the poses that follow from symmetries: what takes one pose to another is applied to all of them."""
    found = list(motors)
    queue = [(i, j) for i in range(len(found)) for j in range(len(found))]
    tries = 0
    while queue and len(found) < _REPORTED and tries < _TRIES:
        i, j = queue.pop(0)
        symmetry = pga3.motor_product(found[i], pga3.motor_inverse(found[0]))
        candidate = np.asarray(pga3.motor_product(symmetry, found[j]))
        if not all(apart(one, candidate, task, free) for one in found):
            continue
        tries += 1
        new = accept(candidate)
        if new is not None and all(apart(one, new, task, free) for one in found):
            found.append(new)
            queue += [(len(found) - 1, j) for j in range(len(found))] + [(i, len(found) - 1) for i in range(len(found))]
    return found


def solved(
    fine: Reals, task: Task, last: Task, thresholds: tuple[float, float], same: Callable[[Reals, Reals], Reals] | None
) -> Found:
    """Return all poses of equal score, given refined hypotheses.

    Parameters
    ----------
    fine : array, (k, 8)
    task, last : Task
        For the comparison of hypotheses, and for the last refinement.
    thresholds : tuple of float
        The least support of a pose, and by how much it has to exceed the support of poses beside it.
    same : callable, optional
        Returns which of several motors fit as well as the first one by a further criterion.
    """
    fine = _likely(fine, task)
    scores = np.array([score(motor, last) for motor in fine])
    bound = least_score(fine, scores, last)
    order = np.argsort(-scores, kind="stable")[:_POLISHED]
    poses = [polished(fine[row], last) for row in order if scores[row] > bound]
    scores = np.array([score(pose.motor, last) for pose in poses])
    best = poses[int(np.argmax(scores))]
    covariance, free, weakest = uncertainty(best, last)
    if last.exact is None:
        turn = least_unexplained(best.motor, task, weakest)
        if turn.better is not None:
            # A small part, as the handle of a mug, decides between turns that the large one leaves open.
            poses = [polished(hypothesis_refined(turn.better, task), last), *poses]
        kept = explaining(np.stack([pose.motor for pose in poses]), last)
        poses = [pose for pose, good in zip(poses, kept, strict=True) if good]
        scores = np.array([score(pose.motor, last) for pose in poses])
        best = poses[int(np.argmax(scores))]
        covariance, free, weakest = uncertainty(best, last)
        if len(free) == 1 and turn.matters:
            free = free[:0]
        bound = min(bound, least_score(np.stack([pose.motor for pose in poses]), scores, last))
    found = shares(best.motor, last)
    contrast = contrast_of(best.motor, last, float(found[0]))
    supported = _is_supported(found, contrast, thresholds)

    def accepted(motor: Reals) -> Reals | None:
        if score(motor, last) < _PROMISING * bound:
            return None
        better = polished(motor, last).motor
        return better if score(better, last) > bound else None

    motors = np.stack([pose.motor for pose in poses])
    motors = motors[different(motors, scores, last, free=free)]
    if supported and len(motors) > 1:
        motors = np.stack(completed(list(motors), last, free, accepted))
    if same is not None and len(motors) > 1:
        motors = motors[same(best.motor, motors)]
    if last.exact is None and len(motors) > 1:
        motors = motors[explaining(motors, last)]
    order = np.argsort([-score(motor, last) for motor in motors], kind="stable")
    scores = np.array([support(motor, last) for motor in motors])
    status = RegistrationStatus.NO_SUPPORT
    if supported:
        status = _status(len(free), len(order), found, last)
        if last.exact is None and contradiction(best.motor, last.source, last.target) < WRONG:
            status = RegistrationStatus.UNCERTAIN
    residual, coverage = _misfit(best, last)
    return Found(
        status, motors[order], scores[order], covariance, residual, coverage, contrast, free,
        planes_of(last.parts[0].surface), last.reach.gate,
    )  # fmt: skip


def _likely(fine: Reals, task: Task) -> Reals:
    """Return different hypotheses whose scores, after a refinement, are near to the best one."""
    near = np.array([support(motor, task) for motor in fine])
    rows = [row for row in different(fine, near, task) if near[row] > _WORTH * near.max()][:_COMPARED]
    fine = np.stack([polished(fine[row], task).motor for row in rows])
    scores = np.array([score(motor, task) for motor in fine])
    likely = scores > least_score(fine, scores, task, 2)
    return np.asarray(fine[likely][different(fine[likely], scores[likely], task)])


def _is_supported(found: Reals, contrast: float, thresholds: tuple[float, float]) -> bool:
    """Return whether the shares at all scales, and the contrast, are large enough for a pose."""
    factors = (1.0, _OF_SHARP) if len(found) > 1 and found[_MIDDLE] >= _SHARP * found[0] else (1.0,)
    return any(found[0] >= f * thresholds[0] and contrast * found[0] >= f * thresholds[1] for f in factors)


def _status(freedoms: int, count: int, found: Reals, last: Task) -> RegistrationStatus:
    """Return whether a supported pose is the only one."""
    if freedoms:
        return RegistrationStatus.FREE_MOTION
    if count > 1:
        return RegistrationStatus.SYMMETRIC
    if len(found) > 1 and found[_MIDDLE] / found[0] < _DULL * own_sharpness(last):
        return RegistrationStatus.UNCERTAIN
    return RegistrationStatus.OK


def _misfit(best: Refined, last: Task) -> tuple[float, float]:
    """Return the residual of a pose, with bounded distances, and the covered part of the target."""
    far = np.concatenate([sums.distances[np.isfinite(sums.distances)] for sums in best.sums])
    residual = float(np.sqrt(np.mean(np.minimum(far, 3 * np.median(far)) ** 2))) if len(far) else np.inf
    back = pga3.move_point(pga3.motor_inverse(best.motor), last.target.points)
    coverage = np.isfinite(last.source.tree.query(back, distance_upper_bound=last.reach.gate)[0]).mean()
    return residual, float(coverage)


def inverted(found: Found, task: Task) -> Found:
    """Return the registration of the target to the source, given that of the source to the target."""
    motors = np.asarray(pga3.motor_inverse(found.motors))
    moves = np.asarray(pga3.move_line(motors[0], np.eye(6))).T
    free = found.free @ moves.T
    if len(free):
        free = np.linalg.qr(free.T)[0].T
    near = task.target.tree.query(pga3.move_point(found.motors[0], task.source.points), distance_upper_bound=found.gate)
    return replace(
        found, motors=motors, covariance=moves @ found.covariance @ moves.T, free=free,
        coverage=float(np.isfinite(near[0]).mean()), surface=planes_of(planes_target(task.source)),
    )  # fmt: skip


def uncertainty(pose: Refined, task: Task) -> tuple[Reals, Reals, Reals]:
    """Return the covariance of small bivectors, those that tangent planes leave free, and the weakest."""
    total = np.zeros((6, 6))
    parts = []
    for part, sums in zip(task.parts, pose.sums, strict=True):
        variance = max(sums.squares, 1e-24) / max(sums.weight - 6, 1.0)
        total += sums.information / variance
        parts.append(part._replace(weights=np.ones(len(part.points)), surface=planes_of(part.surface)))
    values, vectors = np.linalg.eigh(total)
    kept = np.maximum(values, ROUNDING * max(values[-1], TINY))
    covariance = (vectors / kept) @ vectors.T
    planes = refined(pose.motor, parts, [0.5 * task.reach.gate], [0.0])
    information = sum((sums.information / max(sums.weight, 1.0) for sums in planes.sums), np.zeros((6, 6)))
    values, vectors = np.linalg.eigh(information)
    weak = values < _FREE * values[-1]
    weak[0] |= values[0] < min(_NEARLY_FREE * values[-1], _GAP * values[1])
    if not weak[0]:
        steps = np.asarray(pga3.motor_exponential(_TURN * vectors[:, 0] * [[1], [-1]]))
        beside = [score(one, task) for one in pga3.motor_product(steps, pose.motor)]
        weak[0] = min(beside) > _HELD * score(pose.motor, task)
    return covariance, vectors.T[weak], vectors[:, 0]
