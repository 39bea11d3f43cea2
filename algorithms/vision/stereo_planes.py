"""Planes that two cameras see: their poses in each view, and least squares over the motion between the cameras."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from generated import pga3

from ..arguments import Reals
from ..evidence import WRONG, largest_ratio
from ..precision import NEGLIGIBLE, SQUARED
from .camera import Camera, intrinsics_of, matrix_of
from .distortion import NAMES, Distortion
from .plane_adjustment import N_INTRINSICS, N_POSE, Descended, Lens, Views, adjusted, descended, sums_of
from .pose_refinement import all_poses, camera_motors, pixel_noise, pose_status
from .starts import ROUNDS, STEPS
from .status import VisionStatus

_SAME = np.radians(3)
"""A limit on work: motions by single views that differ by a smaller rotation lead to the same minimum."""
_EQUAL = 1e-4
"""From floating point: minima whose rotations differ by less are the same."""
TO_TWIST: Reals = np.zeros((N_POSE, N_POSE))
"""The bivector of a rotation vector, whose axis is through the origin, and of a translation (columns)."""
TO_TWIST[[2, 1, 0, 3, 4, 5], range(N_POSE)] = np.array([-1, 1, -1, -1, -1, -1]) / 2


@dataclass(frozen=True, slots=True, eq=False)
class Eye:
    """One of the cameras, and the planes that it sees."""

    lens: Lens
    """With the poses of the planes by this camera alone."""
    views: Views
    poses: list[Reals]
    """Of each view, the poses (m, 8) that the noise does not rule out; none if it is not an image of the plane."""


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """Parameters of both cameras."""

    lenses: tuple[Lens, Lens]
    """The poses of the first lens are those of planes; those of the second follow from the motor."""
    motor: Reals
    """(8,) From the frame of the first camera to that of the second."""

    def second(self) -> Lens:
        """The second lens with the poses of planes in its frame."""
        return replace(self.lenses[1], poses=np.asarray(pga3.motor_product(self.motor, self.lenses[0].poses)))


def eye_of(camera: Camera, views: Views) -> Eye:
    """Return a camera with the poses of the planes that it sees."""
    matrix = np.array(camera.intrinsics, float)
    lens = camera.distortion or Distortion("brown")
    poses = [_poses(camera, *(each[k][views.weights[k] > 0] for each in views[:2])) for k in range(len(views.places))]
    start = np.array([found[0] if len(found) else np.eye(8)[0] for found in poses])
    fit = adjusted(Lens(lens.model, intrinsics_of(matrix), lens.array, start), views, np.empty(0, int))
    return Eye(fit.lens, views, poses)


def _poses(camera: Camera, places: Reals, pixels: Reals) -> Reals:
    """Return motors (m, 8) from a plane to a camera that noise does not rule out, the most likely first."""
    k, image = np.asarray(camera.intrinsics, float), np.asarray(camera.undistort(pixels))
    usable = np.isfinite(image).all(1)
    if usable.sum() < 4:
        return np.empty((0, 8))
    flat = np.insert(places[usable], 2, 0, axis=1)[None]
    middle = flat.mean(1, keepdims=True)
    image, noise = image[None, usable], pixel_noise(k)
    found = all_poses(flat - middle, image, k, STEPS, noise)
    status, likely = pose_status(found, flat - middle, image, k, noise)
    freedom = 2 * flat.shape[1] - N_POSE
    if status[0] in (VisionStatus.TOO_FEW, VisionStatus.DEGENERATE) or noise.contradicted(found.cost[0, 0], freedom):
        return np.empty((0, 8))
    rows = found.matrix[0, likely[0]]
    return np.asarray(pga3.motor_inverse(camera_motors(rows, np.broadcast_to(middle[0, 0], (len(rows), 3)))))


class StereoFit:
    """Both cameras, whose equations are in units of the noise of each, which the planes seen by it alone show."""

    def __init__(self, first: Eye, second: Eye, refine: bool) -> None:
        self.eyes = first, second
        self.usable = np.array([len(a) > 0 and len(b) > 0 for a, b in zip(first.poses, second.poses, strict=True)])
        self.is_ambiguous = any(len(a) > 1 or len(b) > 1 for a, b in self._pairs())
        self.sums = [sums_of(eye.lens, eye.views) for eye in self.eyes]
        self.variances = [self._variance(eye, sums) for eye, sums in zip(self.eyes, self.sums, strict=True)]
        self.freedoms = np.sum([2 * eye.views.weights.sum(1) - N_POSE for eye in self.eyes], 0)
        counts = [N_INTRINSICS + len(eye.lens.k) for eye in self.eyes]
        self.counts = counts
        self.of_motor = np.arange(N_POSE) + sum(counts)
        self.used = self.of_motor
        if refine:
            own = [_free(eye.lens) for eye in self.eyes]
            self.used = np.concatenate([own[0], own[1] + counts[0], self.of_motor])
        self.exact = sum(
            SQUARED * float((eye.views.weights[..., None] * eye.views.pixels**2).sum()) / variance
            for eye, variance in zip(self.eyes, self.variances, strict=True)
        )

    def _variance(self, eye: Eye, sums: Reals) -> float:
        """Return the usual mean square of the distances of pixels of one camera."""
        known = self.usable  # planes with poses have four points or more
        freedom = 2 * eye.views.weights.sum(1) - N_POSE
        # Where no pixel differs from 0, the variance is of no use, and must not be 0.
        exact = max(float(np.square(NEGLIGIBLE * np.abs(eye.views.pixels).max())), float(np.finfo(float).tiny))
        return max(float(np.median(sums[known, -1, -1] / freedom[known])) if known.any() else 0.0, exact)

    def candidates(self) -> Iterator[tuple[Reals, Reals, Reals]]:
        """Yield motions by single views, the one nearest to most others first, without near repetitions.

        Each comes with the poses (v, 8) of planes that agree best with it, and the squared distances (v,) of the
        motions of all views from it, in variances.
        """
        every = list[tuple[float, Reals, Reals, Reals]]()
        spreads = [
            np.linalg.inv(np.where(self.usable[:, None, None], sums[:, -7:-1, -7:-1], np.eye(6))) * variance
            for sums, variance in zip(self.sums, self.variances, strict=True)
        ]
        motions = list[Reals]()
        firsts = list[Reals]()
        for a, b in self._pairs():
            pairs = list(product(a, b))
            firsts.append(np.array([p for p, _ in pairs]).reshape(-1, 8))
            backs = pga3.motor_inverse(firsts[-1])
            motions.append(np.asarray(pga3.motor_product(np.array([q for _, q in pairs]).reshape(-1, 8), backs)))
        for v in np.flatnonzero(self.usable):
            for motor in motions[v]:
                turn = _adjoint(motor)
                squares, poses = np.full(len(motions), np.inf), self.eyes[0].lens.poses.copy()
                for u in np.flatnonzero(self.usable):
                    off = np.asarray(pga3.motor_logarithm(pga3.motor_product(motions[u], pga3.motor_inverse(motor))))
                    spread = spreads[1][u] + turn @ spreads[0][u] @ turn.T
                    own = (off * np.linalg.solve(spread, off.T).T).sum(1)
                    squares[u], poses[u] = own.min(), firsts[u][np.argmin(own)]
                every.append((float(np.median(squares[self.usable])), np.asarray(motor), poses, squares))
        every.sort(key=lambda one: one[0])
        for k, (_, motor, poses, squares) in enumerate(every):
            if not any(_angle(motor, other[1]) < _SAME for other in every[:k]):
                yield motor, poses, squares

    def fitted(self, start: Pair, which: Reals, used: Reals) -> Descended[Pair]:
        """Return the minimum over some of the views near a start, whose poses are those of all views."""
        part = self._with(start, start.lenses[0].poses[which])
        return descended(part, lambda pair: self._sums(pair, which), self._moved, used, self.exact)

    def costs(self, pair: Pair, which: Reals) -> tuple[Pair, Reals, Reals]:
        """Return a pair with the best poses of some planes, and sums of squares (v,): with its motor, and without."""
        held = self.fitted(pair, which, np.empty(0, int))
        for poses in self._others(pair) if self.is_ambiguous else ():
            again = self.fitted(self._with(pair, poses), which, np.empty(0, int))
            better = again.sums[:, -1, -1] < held.sums[:, -1, -1]
            if better.any():
                held.state.lenses[0].poses[better] = again.state.lenses[0].poses[better]
                held.sums[better] = again.sums[better]
        alone = np.zeros(int(which.sum()))
        lenses = held.state.lenses[0], held.state.second()
        for lens, eye, variance in zip(lenses, self.eyes, self.variances, strict=True):
            alone += adjusted(lens, eye.views.part(which), np.empty(0, int)).costs / variance
        return held.state, held.sums[:, -1, -1], alone

    def _others(self, pair: Pair) -> Iterator[Reals]:
        """Yield the further poses (v, 8) that planes have by single cameras, in the frame of the first."""
        back = pga3.motor_inverse(pair.motor)
        every = [
            np.concatenate([np.reshape(a, (-1, 8)), pga3.motor_product(back, np.reshape(b, (-1, 8)))])
            for a, b in self._pairs()
        ]
        for k in range(max(map(len, every))):
            yield np.array([own[min(k, len(own) - 1)] if len(own) else np.eye(8)[0] for own in every])

    def _pairs(self) -> Iterator[tuple[Reals, Reals]]:
        return zip(self.eyes[0].poses, self.eyes[1].poses, strict=True)

    def squares(self, pair: Pair, which: Reals) -> tuple[Reals, Reals]:
        """Return the sums of squares (v, 2) in pixels, and the numbers of points (v, 2)."""
        parts = [eye.views.part(which) for eye in self.eyes]
        found = [
            sums_of(lens, own)[:, -1, -1] for lens, own in zip((pair.lenses[0], pair.second()), parts, strict=True)
        ]
        return np.stack(found, 1), np.stack([own.weights.sum(1) for own in parts], 1)

    def disagreeing(self, together: Reals, alone: Reals, which: Reals) -> Reals:
        """Return which views (v,) a motion of their own explains better, by more than noise and than it leaves."""
        freedoms = self.freedoms[which]
        total = float(freedoms.sum())
        usual = max(float(np.median(alone / np.maximum(freedoms, 1))), np.finfo(float).tiny)
        ratio = N_POSE * largest_ratio(N_POSE, max(total, 1.0), WRONG / max(len(alone), 1))
        least = np.maximum(usual * np.maximum(ratio, freedoms), alone) + self.exact
        return np.asarray(~(together - alone <= least))

    def _with(self, pair: Pair, poses: Reals) -> Pair:
        return Pair((replace(pair.lenses[0], poses=poses), pair.lenses[1]), pair.motor)

    def _sums(self, pair: Pair, which: Reals) -> Reals:
        """Return the sums of products of equations (v, q, q): lenses, motor, poses of planes, distance."""
        size = sum(self.counts) + 2 * N_POSE + 1
        whole: Reals = np.zeros((int(which.sum()), size, size))
        begin = 0
        for k, lens in enumerate((pair.lenses[0], pair.second())):
            own = np.zeros((self.counts[k] + N_POSE + 1, size))
            n = self.counts[k]
            own[range(n), range(begin, begin + n)] = 1
            own[n:-1, -1 - N_POSE : -1] = np.eye(N_POSE) if k == 0 else _adjoint(pair.motor)
            if k == 1:
                own[n:-1, self.of_motor] = np.eye(N_POSE)
            own[-1, -1] = 1
            sums = sums_of(lens, self.eyes[k].views.part(which))
            whole += own.T @ sums @ own / self.variances[k]
            begin += n
        return whole

    def _moved(self, pair: Pair, used: Reals, step: Reals, pose_steps: Reals) -> Pair:
        every: Reals = np.zeros(sum(self.counts) + N_POSE)
        every[used] = step
        first, second = pair.lenses
        poses = _stepped(pose_steps, first.poses)
        n = self.counts[0]
        return Pair(
            (replace(_changed(first, every[:n]), poses=poses), _changed(second, every[n:-N_POSE])),
            _stepped(every[-N_POSE:], pair.motor),
        )


def agreed(
    fit: StereoFit, motor: Reals, poses: Reals, squares: Reals, known: list[Reals]
) -> tuple[Descended[Pair], Reals, Reals] | None:
    """Return the minimum over the views that agree with a motion, which views (v,) these are, and costs of each alone.

    It begins with the half of the views that are nearest to the motion. None is returned if this leads to a motor that
    is `known`, to which new ones are added, or if not more than half of the views agree.
    """
    order = np.argsort(np.where(fit.usable, squares, np.inf), kind="stable")
    inliers: Reals = np.zeros(len(squares), bool)
    inliers[order[: int(fit.usable.sum()) // 2 + 1]] = True
    pair = Pair((replace(fit.eyes[0].lens, poses=poses), fit.eyes[1].lens), motor)
    for k in range(ROUNDS):
        found = fit.fitted(pair, inliers, fit.used)
        if not found.converged or (k == 0 and any(_angle(found.state.motor, one) < _EQUAL for one in known)):
            return None
        if k == 0:
            known.append(found.state.motor)
        pair = Pair((replace(found.state.lenses[0], poses=poses), found.state.lenses[1]), found.state.motor)
        held, together, alone = fit.costs(pair, fit.usable)
        poses = poses.copy()
        poses[fit.usable] = held.lenses[0].poses
        pair = Pair((replace(pair.lenses[0], poses=poses), pair.lenses[1]), pair.motor)
        before, inliers = inliers, fit.usable.copy()
        inliers[fit.usable] = ~fit.disagreeing(together, alone, fit.usable)
        if np.array_equal(inliers, before):
            break
        if 2 * inliers.sum() <= fit.usable.sum():
            return None
    final = fit.fitted(pair, inliers, fit.used)
    return final, inliers, np.asarray(alone[inliers[fit.usable]])


def camera_of(lens: Lens, pose: Reals, before: Camera) -> Camera:
    """Return a camera with the parameters of a lens."""
    distortion = None
    if before.distortion is not None:
        distortion = Distortion(lens.model, tuple(map(float, lens.k)))
    return Camera(matrix_of(lens.intrinsics), pose, distortion)


def _free(lens: Lens) -> Reals:
    """Return the numbers of the parameters of a lens that are refined: no skew, and no coefficients after the last."""
    last = int(np.max(np.flatnonzero(lens.k), initial=-1)) + 1
    assert last <= len(NAMES[lens.model])
    return np.concatenate([np.arange(N_INTRINSICS - 1), N_INTRINSICS + np.arange(last)])


def _changed(lens: Lens, step: Reals) -> Lens:
    return replace(lens, intrinsics=lens.intrinsics + step[:N_INTRINSICS], k=lens.k + step[N_INTRINSICS:])


def _stepped(steps: Reals, motors: Reals) -> Reals:
    with np.errstate(all="ignore"):
        moved = pga3.motor_product(pga3.motor_exponential(np.ascontiguousarray(steps)), motors)
        return np.asarray(pga3.normalize_motor(moved))


def _adjoint(motor: Reals) -> Reals:
    """Return the matrix (6, 6) that moves bivectors, which are the logarithms of motors, by a motor."""
    return np.asarray(pga3.move_line(motor, np.eye(N_POSE))).T


def _angle(motor: Reals, other: Reals) -> float:
    """Return the angle between two motions."""
    off = np.asarray(pga3.motor_logarithm(pga3.motor_product(other, pga3.motor_inverse(motor))))
    return 2 * float(np.linalg.norm(off[:3]))  # the logarithm has half of it
