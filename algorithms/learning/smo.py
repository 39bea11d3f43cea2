"""Sequential minimal optimisation with one equality constraint for each component of a multivector.

With signed variables ``b`` the dual problem is to minimise ``b'Gb/2 - t'b + eps |b|_1`` with bounds, where the
variables of each component have the sum 0. A step increases one variable and decreases another one of the same
component by the same amount. The kernel `steps_of_pairs` takes many steps in one call, with the Gram matrix of the
samples that may still take part in one. The gradient ``Gb - t`` of all samples, one multivector for each, is updated
after it. `svm_polish` solves for all free variables at once where that is cheaper.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from generated import clifford_svm

from .blade_signs import Signs
from .gram import GramRows, Samples, check_finite, in_blocks
from .svm_kernels import Floats

FAR = 2.0**100
"""From floating point: a derivative larger than any other, for variables at their bound."""
# The next five numbers are limits on work, chosen by trial. They decide which pairs are examined, not when steps end,
# because the conditions of optimality are those of all samples. No test depends on them. On six problems of 700 or
# 1,500 samples, about half and twice of each, 0.5 and 0.85 for `_WORTH`, changed the steps by at most a quarter.
_CHECKED = 1000
"""A limit on work: steps between two attempts to shrink, each of which costs about as much as some steps."""
_WORTH = 0.7
"""A limit on work: the share of samples that remain, from which on a copy of their kernels is not worthwhile."""
_PART = 0.1
"""A limit on work: the violation to which a part of the samples is solved, relative to that of all samples before."""
_FIRST = 400
"""A limit on work: samples whose pairs are examined first; later, twice the number of samples with variables."""
_SHARE = 5
"""A limit on work: the inverse of the share of samples whose pairs are examined first, if these are more."""
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
    while True:
        gap = _gap(problem, state)
        if gap <= tolerance or state.steps >= end:
            return gap <= tolerance
        some = _selected(problem, state) if shrinking else np.arange(len(problem.rows))
        first = max(_FIRST, len(problem.rows) // _SHARE)
        most = max(first, 2 * int(state.signed.any(0).sum()))
        is_part = _WORTH * len(some) > most or len(some) > problem.rows.most_together
        most = min(most, problem.rows.most_together)
        some = _worst(problem, state, some, most) if is_part else some
        before = state.signed.copy()
        part = _Part.of(problem, state, some)
        part.descend(state, max(tolerance, _PART * gap) if is_part else tolerance, end, shrinking)
        part.store(state)
        # Gradients of samples that were left out are not up to date.
        state.gradient += problem.rows.image(state.signed - before, problem.signs)


def _gap(problem: Problem, state: State) -> float:
    lowest, highest = gaps(problem, state)
    return float((highest - lowest).max())


def _selected(problem: Problem, state: State) -> Samples:
    """Return the samples that may still belong to a pair."""
    lowest, highest = (x[:, None] for x in gaps(problem, state))
    rise, fall = problem.slopes(state.signed)
    return np.flatnonzero(np.any((state.gradient + rise < highest) | (state.gradient + fall > lowest), axis=0))


def _worst(problem: Problem, state: State, some: Samples, count: int) -> Samples:
    """Return those of some samples whose variables gain most by an increase or by a decrease, half for each."""
    rise, fall = problem.slopes(state.signed)
    lowest, highest = (x[:, None] for x in gaps(problem, state))
    by_increase = (state.gradient + rise - highest).min(0)[some]
    by_decrease = (lowest - state.gradient - fall).min(0)[some]
    first = np.argsort(by_increase, kind="stable")[: (count + 1) // 2]
    second = np.argsort(by_decrease, kind="stable")
    second = second[~np.isin(second, first)][: count - len(first)]
    return np.asarray(some[np.sort(np.concatenate([first, second]))])


@dataclass
class _Part:
    """The problem for some samples, in blocks of lanes: arrays (m, blocks, lanes), and (samples, size, blocks, lanes).

    All arrays but `numbers`, the numbers of the samples, are filled up to whole blocks.
    """

    problem: Problem
    numbers: Samples
    gram: Floats
    diagonal: Floats
    signed: Floats
    gradient: Floats
    lower: Floats
    upper: Floats

    @classmethod
    def of(cls, problem: Problem, state: State, numbers: Samples) -> _Part:
        """Return the problem for samples of given numbers."""
        rows = (state.signed, state.gradient, problem.lower, problem.upper)
        signed, gradient, lower, upper = (in_blocks(x[:, numbers]) for x in rows)
        diagonal = in_blocks(problem.rows.diagonal[numbers])
        gram = problem.rows.blocks(numbers)
        # Other values of a definite kernel are not greater. `rows.diagonal` is 1 even where squared distances overflow.
        check_finite(gram.reshape(*gram.shape[:2], -1)[:, 0].diagonal())
        return cls(problem, numbers, gram, diagonal, signed, gradient, lower, upper)

    def descend(self, state: State, tolerance: float, end: int, shrinking: bool) -> None:
        """Take steps, and leave out samples that remain at their bounds."""
        blade, sign = self.problem.signs.pairs(self.problem.m)
        blades, signs = blade.astype(float), sign.astype(float)
        # A curvature is the sum of four kernels with rounding errors. Steps divide by it, even if all kernels are 0.
        number = np.finfo(float)
        floor = max(float(number.tiny), 4 * float(number.eps) * float(self.diagonal.max()))
        is_optimal = False
        while not is_optimal and state.steps < end:
            count = min(end - state.steps, _CHECKED if shrinking else end)
            order = np.arange(float(self.diagonal.size)).reshape(self.diagonal.shape)
            self.signed, self.gradient, _, optimal, steps = clifford_svm.steps_of_pairs(
                self.gram, self.diagonal, self.signed, self.gradient, self.lower, self.upper, order, order[0], blades,
                signs, self.problem.width, tolerance, floor, count,
            )  # fmt: skip
            state.steps += int(steps)
            is_optimal = bool(optimal)
            if shrinking and not is_optimal:
                self._shrink(state)

    def _shrink(self, state: State) -> None:
        own = State(self.signed.reshape(self.problem.m, -1), self.gradient.reshape(self.problem.m, -1))
        bounds = (x.reshape(len(x), -1) for x in (self.lower, self.upper))
        keep = _selected(replace(self.problem, lower=next(bounds), upper=next(bounds)), own)
        keep = keep[keep < len(self.numbers)]
        if not len(keep) or len(keep) >= _WORTH * len(self.numbers):
            return
        self.store(state)
        state.shrunk += 1
        for name in ("signed", "gradient", "lower", "upper", "diagonal"):
            rows = getattr(self, name)
            setattr(self, name, in_blocks(rows.reshape(*rows.shape[:-2], -1)[..., keep]))
        self.gram = in_blocks(self.gram.reshape(*self.gram.shape[:2], -1).take(keep, 0).take(keep, 2))
        self.numbers = self.numbers[keep]

    def store(self, state: State) -> None:
        """Store the variables in the state, without the gradient."""
        state.signed[:, self.numbers] = self.signed.reshape(len(self.signed), -1)[:, : len(self.numbers)]
