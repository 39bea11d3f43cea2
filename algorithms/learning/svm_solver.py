"""Solution of the dual problems of Clifford support vector machines, with a status that has been verified."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..evidence import Status
from .smo import Problem, State, gaps, intercepts, minimise
from .svm_interior import interior_point
from .svm_kernels import Floats
from .svm_polish import descend, polish

_FIRST = 15
"""Steps for each sample of one component, before all free variables are first solved for. Steps of more components cost
more, and more of them are needed. Without success, the number doubles."""
_FEWEST = 1000
"""Steps at least between two solutions for all free variables."""
_NARROW = 0.5
"""The number of features for each sample, below which interior points of linear machines cost less than steps."""
_UNLIMITED = 10_000_000
"""A limit on work: the number of steps if the caller states none."""


class MachineStatus(Status):
    """Whether a support vector machine has been found."""

    OK = 0
    """The conditions of optimality hold within the tolerance, with a gradient computed from the result."""
    NOT_CONVERGED = 1
    """They do not hold after the maximum number of steps."""


@dataclass(frozen=True, eq=False)
class Solution:
    """The solution of a dual problem.

    Attributes
    ----------
    signed : array, (m, n)
        The dual variables, with the signs of their labels.
    intercept : array, (m,)
    status : MachineStatus
    steps : int
    gap : float
        The greatest violation of the conditions of optimality.
    objective : float
        The dual objective, to be minimised.
    """

    signed: Floats
    intercept: Floats
    status: MachineStatus
    steps: int
    gap: float
    objective: float


def solve(problem: Problem, tolerance: float, max_steps: int, shrinking: bool) -> Solution:
    """Solve a dual problem; the components separately if the kernel has scalar values.

    Parameters
    ----------
    problem : Problem
    tolerance : float
        Of the conditions of optimality.
    max_steps : int
        Maximum number of steps, -1 for no limit.
    shrinking : bool
        Whether to leave out samples that probably remain at their bounds.
    """
    limit = _UNLIMITED if max_steps < 0 else max_steps
    if problem.rows.size > 1:
        return _together(problem, tolerance, limit, shrinking)
    parts = []
    for j in range(problem.m):
        one = slice(j, j + 1)
        part = replace(
            problem, targets=problem.targets[one], lower=problem.lower[one], upper=problem.upper[one]
        )  # fmt: skip
        parts.append(_together(part, tolerance, limit, shrinking))
    return Solution(
        np.concatenate([part.signed for part in parts]),
        np.concatenate([part.intercept for part in parts]),
        max(part.status for part in parts),
        sum(part.steps for part in parts),
        max(part.gap for part in parts),
        sum(part.objective for part in parts),
    )


def _together(problem: Problem, tolerance: float, limit: int, shrinking: bool) -> Solution:
    state = State.start(problem)
    x = problem.rows.samples
    if problem.rows.kernel.is_linear and limit > 0 and x.shape[1] < _NARROW * len(x):
        limits = problem.targets[0], problem.lower[0], problem.upper[0]
        state.signed = interior_point(x, *limits, problem.width, tolerance)[None]
        state.gradient = problem.gradient(state.signed)
        state.steps += 1
    budget, later = max(_FIRST * len(x) // problem.m, _FEWEST), 2 * problem.targets.size
    while state.steps < limit:
        before = problem.objective(state.signed, state.gradient)
        done = minimise(problem, state, tolerance, min(budget, limit - state.steps), shrinking)
        decreased = not done and descend(problem, state)
        if done or (decreased and polish(problem, state, tolerance)):
            found = _verified(problem, state, tolerance)
            if found.status is MachineStatus.OK:
                return found
        # Steps of ill-conditioned problems can be so small that rounding errors are larger.
        now = problem.objective(state.signed, state.gradient)
        if before - now <= np.finfo(float).eps * abs(now):
            break
        budget, later = (later, later + later // 4) if decreased else (2 * budget, later)
    return _verified(problem, state, tolerance)


def _verified(problem: Problem, state: State, tolerance: float) -> Solution:
    state.gradient = problem.gradient(state.signed)
    lowest, highest = gaps(problem, state)
    gap = max(float((highest - lowest).max()), 0.0)
    status = MachineStatus.OK if gap <= tolerance else MachineStatus.NOT_CONVERGED
    objective = problem.objective(state.signed, state.gradient)
    return Solution(state.signed, intercepts(problem, state), status, state.steps, gap, objective)
