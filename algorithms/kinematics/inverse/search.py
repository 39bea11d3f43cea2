"""Damped Gauss-Newton iteration on motors: polishing, nearest reachable poses, and arms without a closed form."""

from __future__ import annotations

import numpy as np

from generated import pga3

from ...arguments import Reals
from .chain import SAME, Chain, apart, direction

_STEPS = 60
_BRANCHES = 8
"""Number of configurations that a search keeps."""
_SLIGHT = 1e-12
"""Minimum damping relative to the squared arm's size, which merely keeps the equations nonsingular."""
_SINGULAR = 1e-11
"""Singular values up to this, relative to the arm's size, count as 0."""
_REACHED = 1e-9


def remainder(chain: Chain, q: Reals, goals: Reals) -> tuple[Reals, Reals]:
    """Return the remaining twist to the goal, with angles times the arm's size, and the twists of the joints.

    Parameters
    ----------
    chain : Chain
    q : array, (..., n)
    goals : array, (..., 8)

    Returns
    -------
    left : array, (..., 6)
    rates : array, (..., 6, n)
        Twists of the joints, in the same frame.
    """
    motions = chain.motions(q)
    back = pga3.motor_inverse(motions[-1])
    remaining = pga3.motor_product(back, goals)
    # Of the two motors of a motion, choose the one with the smaller angle.
    remaining = np.where(remaining[..., :1] < 0, -remaining, remaining)
    left = pga3.motor_to_twist(remaining)
    rates = np.empty((*q.shape[:-1], 6, len(chain)))
    for j in range(len(chain)):
        # A joint's own motion does not change its axis.
        rates[..., j] = pga3.move_line(pga3.motor_product(back, motions[j]), _twist(chain, j))
    weights = np.array([chain.size] * 3 + [1.0] * 3)
    return left * weights, rates * weights[:, None]


def _twist(chain: Chain, joint: int) -> Reals:
    axis: Reals = chain.axes[joint]
    if chain.slides[joint]:
        axis = pga3.twist_from_velocities(np.zeros(3), direction(axis))
    return axis


def descend(chain: Chain, q: Reals, goals: Reals, steps: int, enough: float) -> tuple[Reals, Reals]:
    """Apply damped least squares (Levenberg-Marquardt) from given configurations.

    Parameters
    ----------
    chain : Chain
    q : array, (N, n)
    goals : array, (N, 8)
    steps : int
        Maximum number of steps.
    enough : float
        Iteration stops for poses with a smaller error than this, and for relative improvements below 1e-7.

    Returns
    -------
    q : array, (N, n)
    error : array, (N,)
        Norm of the remaining twist.
    """
    q = q.copy()
    error, damping = np.full(len(q), np.inf), np.full(len(q), 1e-6 * chain.size**2)
    active, identity = np.arange(len(q)), np.eye(len(chain))
    left, rates = remainder(chain, q, goals)
    error[:] = np.linalg.norm(left, axis=-1)
    for _ in range(steps):
        going = np.isfinite(error[active]) & (error[active] > enough)
        active, left, rates = active[going], left[going], rates[going]
        if not len(active):
            break
        square = rates.swapaxes(-1, -2) @ rates + damping[active, None, None] * identity
        step = np.linalg.solve(square, rates.swapaxes(-1, -2) @ left[..., None])[..., 0]
        trial = q[active] + step
        left_next, rates_next = remainder(chain, trial, goals[active])
        found = np.linalg.norm(left_next, axis=-1)
        better = found < error[active]
        settled = better & (found > (1 - 1e-7) * error[active]) | (damping[active] > 1e6 * chain.size**2)
        chosen = active[better]
        q[chosen], error[chosen] = trial[better], found[better]
        damping[active] = np.maximum(damping[active] * np.where(better, 0.1, 10.0), _SLIGHT * chain.size**2)
        left, rates = np.where(better[:, None], left_next, left), np.where(better[:, None, None], rates_next, rates)
        active, left, rates = active[~settled], left[~settled], rates[~settled]
    return q, error


def polish(chain: Chain, q: Reals, goals: Reals) -> Reals:
    """Improve configurations (N, n) with goals (N, 8) by a few undamped steps, for results with half the digits."""
    for _ in range(3):
        left, rates = remainder(chain, q, goals)
        # normal equations would lose half the digits near a singularity
        across, sizes, along = np.linalg.svd(rates, full_matrices=False)
        inverse = np.where(sizes > _SINGULAR * chain.size, 1 / np.maximum(sizes, _SINGULAR * chain.size), 0.0)
        q = q + np.einsum("kij,ki->kj", along, inverse * np.einsum("kij,ki->kj", across, left))
    return q


def search(chain: Chain, goals: Reals, starts: Reals | int = 24) -> Reals:
    """Return configurations found from several starts, sorted by distance to the goal: (N, branches, n).

    `starts` holds the start configurations, or is their number.
    """
    if isinstance(starts, int):
        starts = np.random.default_rng(7).uniform(-np.pi, np.pi, (starts, len(chain)))
        starts[:, list(np.flatnonzero(chain.slides))] *= chain.size / np.pi
    many = len(starts)
    q, error = descend(chain, np.tile(starts, (len(goals), 1)), np.repeat(goals, many, axis=0), _STEPS, 1e-13)
    q, error = chain.wrapped(q).reshape(-1, many, len(chain)), error.reshape(-1, many)
    order = np.argsort(error, axis=-1)
    q, error = np.take_along_axis(q, order[..., None], 1), np.take_along_axis(error, order, 1)
    same = np.tril(apart(q[:, :, None], q[:, None], np.array(chain.slides)) < SAME, -1).any(-1)
    order = np.argsort(same, axis=-1, kind="stable")[:, :_BRANCHES]
    repeated = np.take_along_axis(same, order, 1)
    q = np.take_along_axis(q, order[..., None], 1)
    # Configurations that miss the goal are kept only as the nearest one.
    repeated[:, 1:] |= np.take_along_axis(error, order, 1)[:, 1:] > _REACHED * chain.size
    q[repeated] = np.nan
    return q
