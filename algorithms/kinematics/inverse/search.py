"""Damped Gauss-Newton on motors: polish, the nearest pose that can be reached, and arms without a closed form."""

from __future__ import annotations

import numpy as np

from generated import pga3

from ...arguments import Reals
from .chain import SAME, Chain, apart, direction

_STEPS = 60
_BRANCHES = 8
"""How many configurations a search keeps."""
_SLIGHT = 1e-12
"""Damping, as part of the arm's size squared, that only keeps equations from being singular."""
_SINGULAR = 1e-11
"""Singular values up to this, as parts of the arm's size, are 0."""
_REACHED = 1e-9


def remainder(chain: Chain, q: Reals, goals: Reals) -> tuple[Reals, Reals]:
    """The twist, at the goal and with angles times the arm's size, that is left to go, and its rates of change.

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
    way = pga3.motor_product(back, goals)
    # Of the two motors of a motion, the one with the shorter way.
    way = np.where(way[..., :1] < 0, -way, way)
    left = pga3.motor_to_twist(way)
    rates = np.empty((*q.shape[:-1], 6, len(chain)))
    for j in range(len(chain)):
        # A joint's own motion leaves its axis alone.
        rates[..., j] = pga3.move_line(pga3.motor_product(back, motions[j]), _twist(chain, j))
    weights = np.array([chain.size] * 3 + [1.0] * 3)
    return left * weights, rates * weights[:, None]


def _twist(chain: Chain, joint: int) -> Reals:
    axis: Reals = chain.axes[joint]
    if chain.slides[joint]:
        axis = pga3.twist_from_velocities(np.zeros(3), direction(axis))
    return axis


def descend(chain: Chain, q: Reals, goals: Reals, steps: int, enough: float) -> tuple[Reals, Reals]:
    """Damped least squares from given configurations (Levenberg and Marquardt).

    Parameters
    ----------
    chain : Chain
    q : array, (N, n)
    goals : array, (N, 8)
    steps : int
        At most so many.
    enough : float
        Poses nearer than this are left alone, as are those that improve by less than 1e-7 of themselves.

    Returns
    -------
    q : array, (N, n)
    error : array, (N,)
        Length of the twist that is left.
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
    """A few undamped steps, (N, n) and (N, 8): for what a closed form found to half the digits."""
    for _ in range(3):
        left, rates = remainder(chain, q, goals)
        # not by normal equations, which have half the digits next to a singularity
        across, sizes, along = np.linalg.svd(rates, full_matrices=False)
        inverse = np.where(sizes > _SINGULAR * chain.size, 1 / np.maximum(sizes, _SINGULAR * chain.size), 0.0)
        q = q + np.einsum("kij,ki->kj", along, inverse * np.einsum("kij,ki->kj", across, left))
    return q


def search(chain: Chain, goals: Reals, starts: Reals | int = 24) -> Reals:
    """Configurations found from several starts, or so many, the nearest to the goal first: (N, branches, n)."""
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
    # What ended elsewhere is of use only as the nearest.
    repeated[:, 1:] |= np.take_along_axis(error, order, 1)[:, 1:] > _REACHED * chain.size
    q[repeated] = np.nan
    return q
