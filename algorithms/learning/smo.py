"""Sequential minimal optimisation with one equality constraint for each component of a multivector.

With signed variables ``b`` the dual problem is to minimise ``b'Gb/2 - t'b + eps |b|_1`` with bounds, where the
variables of each component have the sum 0. A step increases one variable and decreases another one of the same
component by the same amount. The gradient ``Gb - t``, one multivector for each sample, is updated by two rows of the
Gram matrix. `svm_polish` solves for all free variables at once where that is cheaper.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generated import clifford_svm

from .blade_signs import Signs
from .gram import GramRows
from .svm_kernels import Floats

FAR = 2.0**100
_LEAST_CURVATURE = 1e-12
_CHECKED = 1000
"""Steps between two attempts to shrink."""
_WORTH = 0.8
"""Share of samples that remain, from which on shrinking is not worthwhile."""
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Problem:
    """A dual problem with components (m, n): targets, bounds and the half width of the tube.

    Attributes
    ----------
    rows : GramRows
    signs : Signs
    targets, lower, upper : array, (m, n)
        Lower bounds are at most 0, upper ones at least 0.
    width : float
        Of the tube; 0 for classification.
    """

    rows: GramRows
    signs: Signs
    targets: Floats
    lower: Floats
    upper: Floats
    width: float

    @property
    def m(self) -> int:
        """The number of components."""
        return len(self.targets)

    def slopes(self, signed: Floats) -> tuple[Floats, Floats]:
        """Return what is added to the gradient for an increase, and for a decrease: `rise` and `fall`."""
        rise = np.where(signed >= 0, self.width, -self.width)
        fall = np.where(signed > 0, self.width, -self.width)
        return np.where(signed >= self.upper, FAR, rise), np.where(signed <= self.lower, -FAR, fall)

    def objective(self, signed: Floats, gradient: Floats) -> float:
        """Return the objective from the variables and the gradient."""
        return float((signed * (gradient - self.targets)).sum() / 2 + self.width * np.abs(signed).sum())

    def gradient(self, signed: Floats) -> Floats:
        """Return the gradient, without the part of the tube."""
        return self.rows.image(signed, self.signs) - self.targets


@dataclass
class State:
    """Variables of a problem, which the solver changes in place, with the gradient."""

    signed: Floats
    gradient: Floats
    steps: int = 0
    shrunk: int = 0

    @classmethod
    def start(cls, problem: Problem) -> State:
        """Return the state with all variables 0."""
        return cls(np.zeros(problem.targets.shape), -problem.targets)


def gaps(problem: Problem, state: State) -> tuple[Floats, Floats]:
    """Return for each component the least derivative by an increase, and the greatest by a decrease."""
    rise, fall = problem.slopes(state.signed)
    return (state.gradient + rise).min(1), (state.gradient + fall).max(1)


def intercepts(problem: Problem, state: State) -> Floats:
    """Return the constant of each component: the mean that free variables require, or the middle of its bounds."""
    rise, fall = problem.slopes(state.signed)
    is_free = (rise == fall) & (state.signed != 0)
    lowest, highest = gaps(problem, state)
    found = np.zeros(problem.m)
    for j in range(problem.m):
        ends = [x for x in (lowest[j], highest[j]) if abs(x) < FAR / 2]
        if is_free[j].any():
            found[j] = -(state.gradient[j] + rise[j])[is_free[j]].mean()
        elif ends:
            found[j] = -sum(ends) / len(ends)
    return found


def minimise(problem: Problem, state: State, tolerance: float, budget: int, shrinking: bool) -> bool:
    """Take steps until no pair violates the conditions of optimality by more than a tolerance.

    Returns
    -------
    bool
        Whether the tolerance has been reached for all samples within `budget` steps.
    """
    end = state.steps + budget
    active: NDArray[np.intp] | None = None
    while True:
        reason = _steps(problem, state, active, tolerance, end, shrinking)
        if active is None and reason != "check":
            return reason == "done"
        if reason == "check":
            smaller = _active(problem, state, active)
            if len(smaller) < _WORTH * (len(problem.rows) if active is None else len(active)):
                active, state.shrunk = smaller, state.shrunk + 1
            continue
        # Gradients of samples that were left out are not up to date.
        state.gradient = problem.gradient(state.signed)
        active, shrinking = None, False


def _active(problem: Problem, state: State, active: NDArray[np.intp] | None) -> NDArray[np.intp]:
    """Return the samples that may still belong to a pair."""
    lowest, highest = (x[:, None] for x in _ends(problem, state, active))
    rise, fall = problem.slopes(state.signed)
    keep: Bools = np.any((state.gradient + rise < highest) | (state.gradient + fall > lowest), axis=0)
    if active is not None:
        keep = keep & np.isin(np.arange(keep.size), active)
    return np.flatnonzero(keep)


def _ends(problem: Problem, state: State, active: NDArray[np.intp] | None) -> tuple[Floats, Floats]:
    rise, fall = problem.slopes(state.signed)
    up, down = state.gradient + rise, state.gradient + fall
    if active is not None:
        up, down = up[:, active], down[:, active]
    return up.min(1), down.max(1)


def _steps(
    problem: Problem, state: State, active: NDArray[np.intp] | None, tolerance: float, end: int, shrinking: bool
) -> str:
    """Take steps with the active samples: until "done", the "end" of the budget, or a "check" of what can shrink."""
    step_of_pair, second_of_pair = clifford_svm.step_of_pair, clifford_svm.second_of_pair
    some = slice(None) if active is None else active
    single = problem.m == 1
    shape: Any = (0, some) if single else (slice(None), some)
    v, b, low, high = (x[shape].copy() for x in (state.gradient, state.signed, problem.lower, problem.upper))
    rise, fall = (x[shape] for x in problem.slopes(state.signed))
    rise, fall = np.ascontiguousarray(rise), np.ascontiguousarray(fall)
    diagonal = problem.rows.kernel.diagonal(problem.rows.samples[some])
    blade, sign = problem.signs.pairs(problem.m)
    factor = sign.astype(float)
    width, rows, own = problem.width, problem.rows, np.arange(len(problem.rows))[some].tolist()
    pause = state.steps + min(_CHECKED, len(problem.rows)) if shrinking else end
    gain = loss = v
    step: Floats | float = 0.0 if single else np.zeros(problem.m)
    at: tuple[int, ...] = ()
    while True:
        v, lowest, first, highest = step_of_pair(v, gain, loss, step, rise, fall)
        if not single:
            at = (int(np.argmax(highest - lowest)),)
        if highest[at] - lowest[at] <= tolerance:
            reason = "done"
            break
        if state.steps >= min(end, pause):
            reason = "end" if state.steps >= end else "check"
            break
        i = int(first[at])
        row = rows.row(own[i])
        if active is not None:
            row = row[:, active]
        direct = row[0]
        _, second = second_of_pair(v[at], fall[at], direct, diagonal, diagonal[i], lowest[at], _LEAST_CURVATURE)
        k = int(second)
        up, down = (*at, i), (*at, k)
        old, other = float(b[up]), float(b[down])
        room = (0.0 if old < 0 and width else float(high[up])) - old
        space = other - (0.0 if other > 0 and width else float(low[down]))
        slope = float(v[down] + fall[down] - lowest[at])
        curvature = max(float(diagonal[i] + diagonal[k] - 2 * direct[k]), _LEAST_CURVATURE)
        size = min(slope / curvature, room, space)
        b[up] = old + room if size == room else old + size
        b[down] = other - space if size == space else other - size
        for place in (up, down):
            x = b[place]
            rise[place] = FAR if x >= high[place] else width if x >= 0 else -width
            fall[place] = -FAR if x <= low[place] else width if x > 0 else -width
        gain, loss = row, rows.row(own[k])
        if active is not None:
            loss = loss[:, active]
        if single:
            gain, loss, step = gain[0], loss[0], size
        else:
            gain, loss, step = gain[blade[:, at[0]]], loss[blade[:, at[0]]], size * factor[at[0]]
        state.steps += 1
    state.gradient[shape], state.signed[shape] = v, b
    return reason
