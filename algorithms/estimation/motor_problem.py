"""The sparse least squares of graphs of motors: equations, descents, what they determine, and covariances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..arguments import Reals
from ..evidence import Noise, Status, gate_of, is_lost
from ..evidence.descent import LEAST, Descent, descended
from ..evidence.normal_equations import NormalEquations, Parts, blocks_of_inverse
from ..evidence.sparse_factors import least_directions
from ..precision import EIGENVALUE, ROUNDING
from .motor_factors import N_PARAMETERS, PARTS, POSE, VELOCITY, Factors, States, Summary

REJECTED = 0.25
"""The weight of a robust factor at its bound, by definition; with less, it is rejected."""
_ROUNDS = 4
"""A limit on work: iterations after which a direction that changes nothing has a trillion times the share of others."""
_NAMED = 1e-3
"""A limit on work: parts of a direction are named if they have more than this share of its square."""
_NAMES = {
    "rotation": slice(0, 3), "translation": slice(3, 6), "velocity": PARTS[VELOCITY],
    "bias of rates": slice(9, 12), "bias of forces": slice(12, 15),
}  # fmt: skip


class SmoothingStatus(Status):
    """Whether measurements determine the states of a graph, and whether they agree."""

    OK = 0
    NOT_CONVERGED = 1
    """The steps were still large after the last iteration; the states are the best that were found."""
    UNDETERMINED = 2
    """Some direction of the states changes no residual; they keep their start along it."""
    CONTRADICTED = 3
    """Most of the robust factors were rejected: they contradict the others or each other."""
    INCONSISTENT = 4
    """The residuals are larger than the covariances of the factors leave with a probability of 0.001."""
    EMPTY = 5
    """There are no states."""
    TOO_LATE = 6
    """The last measurements belong to a state that was left out; they were not used."""


@dataclass(frozen=True, slots=True, eq=False)
class Undetermined:
    """What a graph leaves undetermined."""

    states: Reals
    """(n,) bool. The states that belong to a direction which changes no residual."""
    directions: Reals
    """(k, n, 15) Up to eight such directions, of norm 1."""
    names: tuple[str, ...]
    """What each of them moves, such as "translation of states 0 to 9"."""


class MotorProblem:
    """Factors of a graph, as one sum of squares.

    Parameters
    ----------
    factors : sequence of Factors or Summary
    n : int
        The number of states.
    held : array of int
        States whose poses are held.
    bound : float, optional
        The square at which the weight of robust factors is a quarter, by default the gate of their numbers.
    """

    def __init__(self, factors: Sequence[Factors | Summary], n: int, held: Reals, bound: float | None = None) -> None:
        self.factors, self.n = factors, n
        self.held = np.isin(np.arange(n), held)
        touched, every = np.zeros((n, N_PARAMETERS), bool), np.arange(n * N_PARAMETERS).reshape(n, N_PARAMETERS)
        for each in factors:
            columns = each.columns(every)
            touched.ravel()[columns[columns >= 0]] = True
        # What no factor mentions has no equations; of poses this is an undetermined direction.
        touched[self.held, PARTS[POSE]] = False
        self.touched = touched
        self.position = np.where(touched, np.cumsum(touched).reshape(touched.shape) - 1, -1)
        self.n_free = int(touched.sum())
        self.equations = NormalEquations([each.columns(self.position) for each in factors], np.nonzero(touched)[0])
        counts = [len(each.states) for each in factors]
        self.robust = np.concatenate([np.zeros(0, bool), *(each.robust for each in factors)])
        self.n_numbers = np.repeat([_numbers_of(each) for each in factors], counts).astype(int)
        self._bounds = np.array([(gate_of(int(k)) if k else 1.0) if bound is None else bound for k in self.n_numbers])
        ends = np.cumsum([0, *counts]).tolist()
        self._slices = [slice(*pair) for pair in pairwise(ends)]

    def linearised(self, states: States) -> tuple[Reals, list[tuple[Reals, Reals]]]:
        """Return squares (m,) of factors in standard deviations, and residuals with their derivatives."""
        found = [each.linearised(states) for each in self.factors]
        return np.concatenate([np.zeros(0), *((rest**2).sum(1) for rest, _ in found)]), found

    def weighed(self, squares: Reals, widened: float) -> tuple[float, Reals]:
        """Return half the sum of losses, and the weights of factors."""
        share = np.where(self.robust, widened * self._bounds / (widened * self._bounds + squares), 1.0)
        return 0.5 * float(share @ squares), np.asarray(share**2)

    def parts(self, found: list[tuple[Reals, Reals]], weights: Reals) -> Parts:
        """Return the parts of the normal equations."""
        each_weight = [weights[part] for part in self._slices]
        return [
            (rest, rows, rows if (weight == 1).all() else weight[:, None, None] * rows)
            for (rest, rows), weight in zip(found, each_weight, strict=True)
        ]

    def step(
        self, states: States, found: list[tuple[Reals, Reals]], weights: Reals, damping: float, reused: bool
    ) -> tuple[Reals, States] | None:
        """Return the damped Gauss-Newton step, and the states after it."""
        step = self.equations.step(self.parts(found, weights), damping, reused)
        return None if step is None else (step, states.moved(self.spread(step)))

    def spread(self, numbers: Reals) -> Reals:
        """Return numbers of free parameters as those of states (n, 15), 0 for the others."""
        change = np.zeros(self.position.shape)
        change[self.touched] = numbers
        return change

    def descended(self, states: States, tolerance: float) -> Descent:
        """Take steps until the cost settles. The bounds of robust factors are lowered step by step."""
        squares = self.linearised(states)[0]
        farthest = float((squares / self._bounds)[self.robust].max(initial=0.0))
        return descended(self, states, tolerance, max(1.0, farthest))

    def summary(self, end: Descent, gone: Reals) -> Summary | None:
        """Return what the factors of some states say of the others (Schur complement), or None if they have none.

        Parameters
        ----------
        end : Descent
        gone : array of bool, (n,)
            States that are left out.
        """
        touching = np.zeros(self.n, bool)
        total, side = np.zeros((self.n_free,) * 2), np.zeros(self.n_free)
        for each, (rest, rows), part in zip(self.factors, end.equations, self._slices, strict=True):
            used = gone[each.states].any(1)
            touching[each.states[used]] = True
            columns = each.columns(self.position)
            for k in np.flatnonzero(used):
                known = columns[k] >= 0
                place, matrix = columns[k][known], rows[k][:, known]
                total[np.ix_(place, place)] += end.weights[part][k] * matrix.T @ matrix
                side[place] += end.weights[part][k] * matrix.T @ rest[k]
        states = np.flatnonzero(touching & ~gone)
        if not len(states):
            return None
        out, kept = (
            np.repeat(each, N_PARAMETERS)[self.touched.ravel()] for each in (touching & gone, touching & ~gone)
        )
        solved = np.linalg.pinv(total[np.ix_(out, out)], rcond=EIGENVALUE, hermitian=True) @ np.column_stack(
            [total[np.ix_(out, kept)], side[out]]
        )
        across = total[np.ix_(kept, out)]
        values, vectors = np.linalg.eigh(total[np.ix_(kept, kept)] - across @ solved[:, :-1])
        sized = values > EIGENVALUE * values[-1]
        roots, vectors = np.sqrt(values[sized]), vectors[:, sized]
        rows = np.zeros((len(roots), self.n * N_PARAMETERS))
        where = np.flatnonzero(self.touched.ravel())[kept]
        rows[:, where] = roots[:, None] * vectors.T
        rest = vectors.T @ (side[kept] - across @ solved[:, -1]) / roots
        rows = rows.reshape(len(roots), self.n, N_PARAMETERS)[:, states].reshape(len(roots), -1)
        return Summary(states[None], States(*(each[states] for each in end.state)), rest, rows)

    def status(self, end: Descent, undetermined: Undetermined) -> SmoothingStatus:
        """Return the status of the end of a descent."""
        used = ~self.robust | (end.weights >= REJECTED)
        freedom = int(self.n_numbers[used].sum()) - self.n_free + len(undetermined.directions)
        if not self.n:
            return SmoothingStatus.EMPTY
        if undetermined.states.any():
            return SmoothingStatus.UNDETERMINED
        if not end.settled:
            return SmoothingStatus.NOT_CONVERGED
        if is_lost(int(used[self.robust].sum()), int(self.robust.sum())):
            return SmoothingStatus.CONTRADICTED
        if bool(Noise(1.0).contradicted(np.asarray(end.squares[used].sum()), freedom)):
            return SmoothingStatus.INCONSISTENT
        return SmoothingStatus.OK

    def undetermined(self, end: Descent) -> Undetermined:
        """Return what the factors leave undetermined at the end of a descent."""
        n = self.n
        missing = ~self.touched[:, PARTS[POSE]].any(1) & ~self.held
        directions, names = [], []
        if missing.any():
            names.append(_named({"pose": np.flatnonzero(missing)}))
        parts = self.parts(end.equations, end.weights)
        if self.n_free and not self._determined(parts):
            matrix = self.equations.matrix(parts)
            scale = _scale(matrix.diagonal())
            vectors = (least_directions(matrix, scale, EIGENVALUE)[1] * scale[:, None])[self.equations.place]
            # Squares of derivatives have twice the digits of eigenvalues, which are differences.
            _, sizes, turns = np.linalg.svd(self._changes(end, vectors), full_matrices=False)
            free = (vectors @ turns.T)[:, sizes <= ROUNDING].T
            directions = [self.spread(each / np.linalg.norm(each)) for each in free]
        found = np.zeros(n, bool) | missing
        for each in directions:
            share = each**2
            found |= share.sum(1) > _NAMED / max(n, 1)
            names.append(_named({
                name: np.flatnonzero(share[:, part].sum(1) > _NAMED / max(n, 1)) for name, part in _NAMES.items()
            }))  # fmt: skip
        return Undetermined(found, np.array(directions).reshape(len(directions), n, N_PARAMETERS), tuple(names))

    def _determined(self, parts: Parts) -> bool:
        """Return whether every direction certainly changes residuals, by a few iterations of the inverse.

        The last factors are used, if they are undamped: where they were computed, the same directions are determined
        but for coincidences. Directions whose eigenvalue is at most the damping count as perhaps undetermined.
        """
        last = self.equations.last(LEAST)
        factor, parts = last if last is not None else (self.equations.factor(parts, LEAST), parts)
        if factor is None:
            return False
        scale = _scale(self.equations.diagonal(parts))
        softest = np.random.default_rng(0).normal(size=self.n_free)
        for _ in range(_ROUNDS):
            softest = factor.solve(softest / scale) / scale
            size = np.linalg.norm(softest)
            if not 0 < size < np.inf:
                return False
            softest /= size
        return self.equations.change(parts, scale * softest) > LEAST

    def _changes(self, end: Descent, directions: Reals) -> Reals:
        """Return the derivatives (r, k) of all residuals along directions (n, k) of the free parameters."""
        padded = np.concatenate([directions, np.zeros((1, directions.shape[1]))])
        found = [np.zeros((directions.shape[1],) * 2)]
        for each, (_, rows), part in zip(self.factors, end.equations, self._slices, strict=True):
            along = np.sqrt(end.weights[part])[:, None, None] * (rows @ padded[each.columns(self.position)])
            found.append(along.reshape(-1, directions.shape[1]))
        return np.concatenate(found)

    def covariances(self, end: Descent, wanted: Reals, undetermined: Reals) -> Reals:
        """Return the covariances (k, p, p) of states, infinite for undetermined ones."""
        p = N_PARAMETERS if self.touched[:, PARTS[VELOCITY].start :].any() else PARTS[POSE].stop
        found = np.full((len(wanted), p, p), np.inf)
        inside = np.flatnonzero(~undetermined[wanted])
        if not len(inside):
            return found
        found[inside] = 0
        if not self.n_free:
            return found
        factor = self.equations.factor(self.parts(end.equations, end.weights))
        if factor is not None:
            places = self.position[wanted[inside], :p]
            blocks = blocks_of_inverse(factor, places, self.n_free)
            # What no factor mentions, such as the velocity of a state without inertial factors, is not known.
            unknown = places < 0
            unknown[self.held[wanted[inside]], PARTS[POSE]] = False
            blocks[:, range(p), range(p)] = np.where(unknown, np.inf, blocks[:, range(p), range(p)])
            found[inside] = blocks
        return found


def _scale(diagonal: Reals) -> Reals:
    """Return factors of rows and columns that make a diagonal 1."""
    return np.asarray(1 / np.sqrt(np.where(diagonal > 0, diagonal, 1)))


def _numbers_of(each: Factors | Summary) -> int:
    return each.kind.n_numbers if isinstance(each, Factors) else len(each.rest)


def _named(moved: dict[str, Reals]) -> str:
    """Return text such as "rotation and translation of states 0 to 9"."""
    groups: dict[tuple[int, ...], list[str]] = {}
    for name, states in moved.items():
        if len(states):
            groups.setdefault(tuple(states.tolist()), []).append(name)
    return ", ".join(f"{' and '.join(names)} of {_ranged(states)}" for states, names in groups.items())


def _ranged(states: tuple[int, ...]) -> str:
    """Return text such as "state 3" or "states 0 to 4 and 7"."""
    runs: list[list[int]] = []
    for each in states:
        if runs and each == runs[-1][1] + 1:
            runs[-1][1] = each
        else:
            runs.append([each, each])
    texts = [str(a) if a == b else f"{a} to {b}" for a, b in runs]
    plural = "s" if len(states) > 1 else ""
    return f"state{plural} {' and '.join([', '.join(texts[:-1]), texts[-1]] if len(texts) > 1 else texts)}"
