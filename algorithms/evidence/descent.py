"""Levenberg and Marquardt's iterations for one large sum of squares, with robust parts whose bounds are lowered."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from ..arguments import Reals
from ..precision import CONVERGED, ROUNDING

_STEPS = 50
"""A limit on work: failed steps raise the damping from the least to the most in 13 steps, almost four times in all."""
_RAISED, _EASED = 30.0, 10.0
"""Limits on work: the factors between steps by which the damping is raised after a failed one and lowered after
another. They differ, so that a failure after a success does not lead to the damping before these."""
LEAST, _MOST = 1e-12, 1e6
"""Limits on work: relative increments of the diagonal, at the start and at most."""
_REUSED, _SLOW = 0.1, 0.5
"""Limits on work: factors are used for the next step if the cost decreased by at most the first share of the last
decrease, and as long as decreases are at most the second share of the last one. A step with new factors costs some five
times as much."""
_LOWERED = 16.0
"""A limit on work: the factor by which the bound of robust parts is lowered in each of the first steps."""


class Squares(Protocol):
    """A sum of squares whose parts are linearised, weighed and solved."""

    def linearised(self, state: Any) -> tuple[Reals, Any]:
        """Return the squares (m,) of the parts at a state, divided by their variances, and their equations."""
        ...

    def weighed(self, squares: Reals, widened: float) -> tuple[float, Reals]:
        """Return half the sum of losses, and the weights (m,), with the bounds of robust parts times a factor."""
        ...

    def step(
        self, state: Any, equations: Any, weights: Reals, damping: float, reused: bool
    ) -> tuple[Reals, Any] | None:
        """Return the changes of the parameters and the state after them, or None if the equations are singular.

        Factors of the last step may be `reused`.
        """
        ...


class Descent(NamedTuple):
    """Where the iterations end."""

    state: Any
    squares: Reals
    equations: Any
    weights: Reals
    cost: float
    settled: bool
    steps: int


def descended(problem: Squares, start: Any, tolerance: float, widened: float = 1.0) -> Descent:
    """Take steps until they are small, or until the cost is expected to decrease by less than a relative tolerance.

    Undamped steps converge linearly near a minimum, so that the next decrease follows from the last two.

    Parameters
    ----------
    problem : Squares
    start : state
    tolerance : float
    widened : float
        The factor of the squared bounds of robust parts at the start. It is lowered step by step, so that far parts can
        pull the state together first.
    """
    state = start
    squares, equations = problem.linearised(state)
    cost, weights = problem.weighed(squares, widened)
    damping, before, settled, reused, step = LEAST, np.inf, False, False, 0
    while not settled and step < _STEPS and damping < _MOST:
        step += 1
        found = problem.step(state, equations, weights, damping, reused)
        if found is None:
            damping *= _RAISED
            continue
        change, moved = found
        new_squares, new_equations = problem.linearised(moved)
        new_cost, new_weights = problem.weighed(new_squares, widened)
        settled = widened == 1 and float(np.abs(change).max(initial=0.0)) < CONVERGED
        if widened > 1:
            widened = max(widened / _LOWERED, 1.0)
            state, squares, equations = moved, new_squares, new_equations
            cost, weights = problem.weighed(squares, widened)
        elif new_cost <= cost:
            decrease = cost - new_cost
            ratio = min(decrease / before, 1.0) if damping == LEAST and before < np.inf else 1.0
            settled |= ratio * decrease <= tolerance * cost
            reused = damping == LEAST and ratio <= (_SLOW if reused else _REUSED)
            state, squares, equations, cost, weights = moved, new_squares, new_equations, new_cost, new_weights
            damping, before = max(damping / _EASED, LEAST), max(decrease, np.finfo(float).tiny)
        else:
            settled |= new_cost - cost <= ROUNDING * cost
            # A step with old factors says nothing about one with new ones.
            damping, before, reused = (damping, before, False) if reused else (damping * _RAISED, np.inf, False)
    return Descent(state, squares, equations, weights, cost, bool(settled), step)
