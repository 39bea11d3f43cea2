"""Motions between two calibrated views: all minima of Sampson distances, and how well they explain pairs of pixels."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np

from generated import matrices, pga3, relative_poses

from ..arguments import Reals
from ..evidence import Freedom, Noise, Problem, all_or_some_sets, differ
from ..evidence.consensus import Indices
from ..evidence.least_squares import STEPS
from ..evidence.triangles import from_triangle
from .fundamental import eight_points
from .robust import ALL

_ROUNDS = 60
"""A limit on work: the number of selections of pairs that agree with a rotation,"""
_MEDIANS = 3.0
"""which are those within this multiple of the median distance, almost all good ones if half of them are good."""
_SETS = 100
"""A limit on work: the number of sets of five pairs whose motions are starts."""
_STARTS = 16
"""A limit on work: the number of starts, the best of all,"""
_NEAR = 0.05
"""A limit on work: starts that differ from better ones by less, in radians, lead to the same minimum,"""
_SUBSET = 500
"""and the number of pairs on which minima are first sought."""
FREEDOM = Freedom(sample_size=5, parameters=5, codimension=1, solutions=10, false_alarms=1.0)
"""As for the fundamental matrix, the bound is conservative by a factor of more than 50."""


@dataclass(frozen=True, slots=True, eq=False)
class Motions:
    """Minima of the squares of Sampson distances."""

    motors: Reals
    """(m, 8)"""
    cost: Reals
    """(m,) The sums of squares, truncated at the limit."""
    information: Reals
    """(m, 5, 5) By a rotation vector that follows the motor, and by two tangents of its translation."""
    converged: Reals
    """(m,) bool"""

    def at(self, index: Reals | list[int] | slice) -> Motions:
        """Return some of the minima."""
        return Motions(self.motors[index], self.cost[index], self.information[index], self.converged[index])


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Pairs of pixels (n, 2), relative to the principal points, and the matrices K of both cameras without these."""

    first: Reals
    second: Reals
    one: Reals
    two: Reals
    noise: Noise
    left: Reals = field(init=False)
    """The inverse of the first matrix,"""
    right: Reals = field(init=False)
    """and that of the second."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "left", np.linalg.inv(self.one))
        object.__setattr__(self, "right", np.linalg.inv(self.two))

    def some(self, which: Indices) -> Scene:
        """Return the scene of some of the pairs."""
        return Scene(self.first[which], self.second[which], self.one, self.two, self.noise)

    def directions(self) -> tuple[Reals, Reals]:
        """Return the directions (x, y) of all pairs in both cameras."""
        one, two = self.first @ self.left[:2, :2].T, self.second @ self.right[:2, :2].T
        return one, two

    def fundamental(self, essential: Reals) -> Reals:
        """Return the matrices of pixels for essential matrices (m, 3, 3)."""
        return np.asarray(self.right.T @ essential @ self.left)

    def descended(self, motors: Reals, limit: float = ALL, at_most: float = STEPS) -> Motions:
        """Return the minima near motors (m, 8)."""
        found, triangles, numbers = relative_poses.descend_motion(
            motors, self.left, self.right, self.first, self.second, limit, float(at_most)
        )
        return Motions(found, numbers[:, 0], from_triangle(triangles, 5), numbers[:, 1] > 0)

    def descended_in_front(self, motors: Reals, limit: float = ALL, at_most: float = STEPS) -> Motions:
        """Return the minima near motors (m, 8) of the squares of `explained`."""
        found, triangles, numbers = relative_poses.descend_motion_in_front(
            motors, self.left, self.right, self.two, self.first, self.second, limit, float(at_most)
        )
        return Motions(found, numbers[:, 0], from_triangle(triangles, 5), numbers[:, 1] > 0)

    def problem(self) -> Problem:
        """Return the problem of essential matrices from samples of five pairs."""
        one, two = self.directions()

        def solve(sets: Indices) -> Reals:
            return essential_of_sets(one[sets], two[sets])[0]

        def distances(models: Reals, first: Reals, second: Reals) -> Reals:
            return np.sqrt(relative_poses.squared_distances(self.fundamental(models), first, second))

        def costs(models: Reals, first: Reals, second: Reals, threshold: float) -> Reals:
            square = threshold * threshold
            return np.asarray(relative_poses.truncated_squares(self.fundamental(models), first, second, square))

        def descend(models: Reals, threshold: float, at_most: float) -> Reals:
            starts = relative_poses.motions_of_essential(models)[0]
            return np.asarray(relative_poses.essential_of_motion(self.descended(starts, threshold**2, at_most).motors))

        return Problem(self.first, self.second, FREEDOM, solve, distances, costs, descend)

    def minima(self, starts: Reals, good: Indices, limit: float, wide: float) -> Motions:
        """Return distinct minima of squares truncated at a limit, to which starts and pairs that are `good` lead.

        Of all models of five good pairs, those with the least squares are starts, and so are the minima near them of
        squares truncated at `wide`.
        """
        n = len(self.first)
        chosen = np.arange(n) if n <= _SUBSET else np.random.default_rng(n).permutation(n)[:_SUBSET]
        few, own = self.some(chosen), good[chosen]
        one, two = few.some(own).directions()
        essential = np.concatenate([starts, self._linear(one, two), *_of_sets(one, two)])
        costs = relative_poses.truncated_squares(few.fundamental(essential), few.first, few.second, limit)
        best = np.concatenate([starts, apart(essential, costs)])
        motors = relative_poses.motions_of_essential(best)[0]
        motors = motors[np.isfinite(motors).all(1)]
        found = few.descended(motors, limit)
        if wide > limit:
            found = joined([found, few.descended(few.descended(motors, wide).motors, limit)])
        found = few._distinct(found, int(own.sum()))
        return found if len(chosen) == n else self._distinct(self.descended(found.motors, limit), int(good.sum()))

    def _linear(self, one: Reals, two: Reals) -> Reals:
        """Return the matrix of the eight-point algorithm, if there are enough pairs."""
        if len(one) < 9:
            return np.empty((0, 3, 3))
        found = eight_points(one, two) * np.sqrt(2)
        return found[None] if np.isfinite(found).all() else np.empty((0, 3, 3))

    def _distinct(self, found: Motions, n: int) -> Motions:
        """Return minima that differ by more than their bounds, the least first."""
        usable = np.isfinite(found.cost) & np.isfinite(found.motors).all(1) & np.isfinite(found.information).all((1, 2))
        order = np.flatnonzero(usable)
        order, kept = order[np.argsort(found.cost[order], kind="stable")], list[int]()
        variance = self.noise.raised(found.cost, n - 5)
        essential = np.asarray(relative_poses.essential_of_motion(found.motors))
        while len(order):
            k, order = int(order[0]), order[1:]
            kept.append(k)
            if len(order):
                near = nearest_step(found.motors[k], essential[order])
                order = order[differ(near, found.information[k], variance[k])]
        return found.at(kept)

    def explained(self, motors: Reals) -> tuple[Reals, Reals, Reals]:
        """Return squared distances (m, n) of pairs, their points (m, n, 3), and whether these are in front.

        A pair whose point would be behind a camera is as far off as from a point at infinity.
        """
        squares, far, points, in_front = relative_poses.explain_pairs(
            motors, self.left, self.right, self.two, self.first, self.second
        )
        ahead = in_front > 0
        return np.where(ahead, squares, np.maximum(squares, far)), points, ahead

    def far(self, motor: Reals) -> Reals:
        """Return squared distances (n,) of pairs from those that the rotation of a motor explains."""
        return np.asarray(
            relative_poses.explain_pairs(motor, self.left, self.right, self.two, self.first, self.second)[1]
        )

    def normals(self, motor: Reals) -> Reals:
        """Return the unit normals (n, 4) of the pairs that fit a motion."""
        matrix = self.fundamental(relative_poses.essential_of_motion(motor))
        return np.asarray(relative_poses.epipolar_normals(matrix, self.first, self.second))

    def turned(self, motor: Reals) -> Reals:
        """Return the pixels (n, 2) of the second image in which points at infinity would be."""
        return np.asarray(relative_poses.turned_pixels(motor, self.left, self.two, self.first))

    def rotation(self, motors: Reals, limit: float) -> Reals:
        """Return the rotation near some motors (m, 8) that explains pairs best, with truncated squares.

        It explains half of the pairs, so those beyond a multiple of the median distance are left out in each round.
        """
        found, size = np.asarray(motors), ALL
        for _ in range(_ROUNDS):
            found, _, numbers = relative_poses.descend_rotation(
                found, self.left, self.two, self.first, self.second, size, float(STEPS)
            )
            best = found[int(np.argmin(np.where(np.isfinite(numbers[:, 0]), numbers[:, 0], np.inf)))]
            before, size = size, max(limit, min(_MEDIANS**2 * float(np.median(self.far(best))), size / 2))
            if size == before:
                break
        return np.asarray(best)


def apart(essential: Reals, costs: Reals) -> Reals:
    """Return the best of some essential matrices (m, 3, 3), without those that are near better ones."""
    order, kept = np.argsort(np.where(np.isfinite(costs), costs, np.inf), kind="stable"), list[Reals]()
    rest = essential[order].reshape(-1, 9)
    while len(rest) and len(kept) < _STARTS:
        kept.append(rest[0])
        rest = rest[np.abs(rest @ rest[0]) < 2 * (1 - _NEAR * _NEAR)]
    return np.array(kept).reshape(-1, 3, 3)


def joined(parts: list[Motions]) -> Motions:
    """Return several minima, the least first."""
    whole = Motions(*(np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(Motions)))
    usable = np.isfinite(whole.cost) & np.isfinite(whole.motors).all(1)
    order = np.argsort(np.where(usable, whole.cost, np.inf), kind="stable")
    return whole.at(order[: int(usable.sum())])


def halfway(motors: Reals, motor: Reals) -> Reals:
    """Return the motions (m, 8) in the middle between motions and another."""
    middle = np.array([steps_to(each, motor) for each in motors]) / 2
    return np.asarray(relative_poses.move_motion(motors, middle))


def nearest_step(motor: Reals, essential: Reals) -> Reals:
    """Return the steps (m, 5) from a motion to the nearest motions of essential matrices (m, 3, 3)."""
    steps = steps_to(motor, np.stack(relative_poses.motions_of_essential(essential), 1))
    return np.asarray(steps[np.arange(len(steps)), (steps**2).sum(-1).argmin(1)])


def steps_to(motor: Reals, others: Reals) -> Reals:
    """Return the steps (..., 5) from a motion to others (..., 8).

    A step is a rotation vector, and the change of the translation along its tangents, as an angle.
    """
    a, b = pga3.motor_to_matrix(motor), pga3.motor_to_matrix(others)
    turn = pga3.rotor_to_rotation_vector(pga3.rotor_from_matrix(np.ascontiguousarray(b[..., :3, :3] @ a[:3, :3].T)))
    shift = b[..., :3, 3]
    steps = np.stack([shift @ each for each in relative_poses.tangents_of_direction(a[:3, 3])], -1)
    size = np.linalg.norm(steps, axis=-1, keepdims=True)
    angle = np.arctan2(size, (shift @ a[:3, 3])[..., None])
    # The tangents do not say in which direction an opposite translation is.
    steps = np.where(size > 0, steps * (angle / np.where(size > 0, size, 1)), angle * [1.0, 0.0])
    return np.concatenate([turn, steps], -1)


def essential_of_sets(first: Reals, second: Reals) -> tuple[Reals, Reals]:
    """Return all real essential matrices (m, 3, 3) of sets (b, 5, 2) of five pairs of directions, and their sets (m,).

    The norm of a matrix is the square root of 2.
    """
    coefficients, pencil, basis = relative_poses.five_point_polynomial(first, second)
    usable: Reals = np.asarray(np.isfinite(coefficients).all(-1))
    real, imaginary, _, converged = matrices.polynomial_roots(np.where(usable[:, None], coefficients, 0))
    sets, which = np.nonzero((imaginary == 0) & (usable & (converged > 0))[:, None])
    found = np.asarray(relative_poses.essential_of_root(real[sets, which], pencil[sets], basis[sets]))
    good = np.isfinite(found).all((1, 2))
    return found[good], sets[good]


def _of_sets(one: Reals, two: Reals) -> list[Reals]:
    """Return the essential matrices of sets of five pairs, and those of complex solutions without their imaginary part.

    If noise makes two real solutions complex, there is a minimum near their real part.
    """
    sets = all_or_some_sets(len(one), 5, _SETS)
    coefficients, pencil, basis = relative_poses.five_point_polynomial(one[sets], two[sets])
    usable: Reals = np.asarray(np.isfinite(coefficients).all(-1))
    real, _, _, _ = matrices.polynomial_roots(np.where(usable[:, None], coefficients, 0))
    found = np.asarray(relative_poses.essential_of_root(real, pencil[:, None], basis[:, None]))
    found = found[usable].reshape(-1, 3, 3)
    return [found[np.isfinite(found).all((1, 2))]]
