"""Least squares on manifolds: Levenberg and Marquardt's iterations from many starts at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Reals
from ..precision import CONVERGED, TINY

FIRST, LEAST, MOST = 1e-4, 1e-12, 1e8
"""Limits on work: the damping relative to the diagonal with which iterations start, below which it has no effect, and
from which steps are shorter than rounding."""
STEPS = 50
"""A limit on work: the number of iterations from a start, of which most need about ten."""
FACTOR = 10.0
"""A limit on work: the damping changes by this factor after each step."""


class Minima(NamedTuple):
    """Local minima of sums of squares."""

    state: Reals
    """(b, ...)"""
    cost: Reals
    """(b,) The sums of squares; not finite where they were not at the start."""
    normal: Reals
    """(b, p, p) The sum of products of the derivatives of the residuals."""
    converged: NDArray[np.bool_]
    """(b,) Whether no step decreases the cost any further."""
    lowest: Reals
    """(b,) The sums of squares of the linear problems at the states: minima near these have no less."""


def minima(
    start: Reals,
    equations: Callable[[Reals, NDArray[np.intp]], tuple[Reals, Reals]],
    moved: Callable[[Reals, Reals, NDArray[np.intp]], Reals],
    exact: Reals,
    n_steps: int,
) -> Minima:
    """Minimise sums of squares from several starts, each with its own damping.

    Parameters
    ----------
    start : array, (b, ...)
    equations : callable
        Function from states (k, ...) and their indices (k,) to residuals (k, m) and their derivatives (k, m, p).
    moved : callable
        Function from steps (k, p), states (k, ...) and indices (k,) to states that are moved by the steps.
    exact : array, (b,)
        Costs below these are rounding errors.
    n_steps : int
        Maximum number of iterations.

    Returns
    -------
    Minima
    """
    state, live = np.array(start), np.arange(len(start))
    residual, rows = equations(state, live)
    cost, normal, side = _sums(residual, rows)
    converged, damping = np.zeros(len(state), np.bool_), np.full(len(state), FIRST)
    live = np.flatnonzero(np.isfinite(cost))
    for _ in range(n_steps):
        if not len(live):
            break
        step = _solved(normal[live], side[live], damping[live])
        trial = moved(step, state[live], live)
        new_cost, new_normal, new_side = _sums(*equations(trial, live))
        change = cost[live] - new_cost
        better = change > 0
        kept = live[better]
        for whole, part in ((state, trial), (cost, new_cost), (normal, new_normal), (side, new_side)):
            whole[kept] = part[better]
        damping[live] = np.where(better, np.maximum(damping[live] / FACTOR, LEAST), damping[live] * FACTOR)
        done = (np.abs(change) <= CONVERGED * cost[live]) | (cost[live] <= exact[live]) | (damping[live] > MOST)
        converged[live[done]] = True
        live = live[~done]
    lowest = cost + (side * _solved(normal, side, np.full(len(state), LEAST))).sum(1)
    return Minima(state, cost, normal, converged, lowest)


def _sums(residual: Reals, rows: Reals) -> tuple[Reals, Reals, Reals]:
    transposed = np.swapaxes(rows, 1, 2)
    with np.errstate(invalid="ignore", over="ignore"):
        return (residual**2).sum(1), transposed @ rows, (transposed @ residual[..., None])[..., 0]


def _solved(normal: Reals, side: Reals, damping: Reals) -> Reals:
    """Return damped steps, 0 where the equations are not finite or a parameter has no influence."""
    size = normal.shape[-1]
    diagonal = np.einsum("bii->bi", normal)
    damped = normal.copy()
    damped[:, range(size), range(size)] += damping[:, None] * (diagonal + TINY)
    usable = np.isfinite(damped).all((1, 2)) & (diagonal > 0).all(1) & np.isfinite(side).all(1)
    damped = np.where(usable[:, None, None], damped, np.eye(size))
    step = -np.linalg.solve(damped, np.where(usable[:, None], side, 0)[..., None])[..., 0]
    return np.asarray(step)
