"""Conversion of candidate configurations to branches: improvement, validation, removal of duplicates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from generated import pga3

from ...arguments import Reals
from .chain import Chain
from .search import descend
from .solutions import Branches

_NEAR, _STEPS = 0.3, 40
"""Candidates with errors below the first number are improved, with this number of steps."""
_BRANCHES = 16
"""A general arm of six revolute joints has up to 16 configurations for a pose."""
_ATTEMPTS = 26
"""Largest number of attempts: the goal, twice with different equations, and twelve pairs of neighbours."""
_OFFSETS = np.outer([0.01, 0.04, 0.15, 0.5], [1, -1]).ravel()
"""Offsets from a branch, in the direction of the smallest singular value, where a missing branch is searched for."""

Once = Callable[[Reals, int], tuple[Branches, Reals]]
"""Returns the branches of goals, and how many there are at most, (N,), or NaN if the method does not know this.

The second argument numbers the attempts, which may use different equations.
"""


def completed(chain: Chain, once: Once, goals: Reals) -> Branches:
    """Return the branches of goals, where necessary with those of random poses in their neighbourhood.

    Zeros that coincide at a goal, because a structured posture makes equations dependent, are distinct at a neighbour.
    A regular branch there is the continuation of one at the goal, unless two branches meet between both poses. They do
    so at a surface in the space of poses, so that neighbours are used in pairs on opposite sides of the goal. Branches
    are complete if there are as many as zeros of the equations, or as at that one of two complete neighbours that has
    more of them. If it has several pairs more than the other one, several such surfaces are nearby, or one at which the
    arm's symmetry lets several pairs meet: another pair of neighbours must then confirm the number.
    """
    found, most = once(goals, 0)
    if np.count_nonzero(found.complete) == len(goals):
        return found
    most = most.astype(float)
    rng, singular, before = np.random.default_rng(3), np.zeros(len(goals), bool), np.full(len(goals), np.nan)
    shift, agreed = np.zeros(6), np.full(len(goals), np.nan)
    calm, known = np.zeros(len(goals), int), np.zeros(len(goals), int)
    for attempt in range(1, _ATTEMPTS):
        rows = np.flatnonzero(~found.complete)
        if not len(rows):
            break
        pair, is_second = divmod(attempt, 2)
        if not is_second:
            shift = -_neighbour((pair - 1) % 3) * rng.normal(size=6) * np.repeat([1.0, chain.size], 3)
        goal, own, shift = goals[rows], found.q[rows], -shift
        near, zeros = once(pga3.motor_product(goal, pga3.motor_from_twist(shift)), attempt)
        odd = np.isfinite(own[..., 0]).sum(-1) % 2 == 1
        beyond = np.full((len(rows), len(_OFFSETS) * _BRANCHES * bool(odd.any()), len(chain)), np.nan)
        beyond[odd] = _beyond(chain, own[odd]) if odd.any() else 0.0
        together = np.concatenate([own, near.q, beyond], axis=1)
        found.q[rows], found.gap[rows], count = gathered(chain, together, goal)
        beside = np.isfinite(near.q[..., 0]).sum(-1)
        seen = np.where(near.complete, beside, np.nan)
        if not pair:
            # Fewer zeros than branches, or another number than before, show that the equations are dependent here.
            most[rows] = np.where((zeros < count) | (zeros != most[rows]), np.nan, zeros)
        agrees = (pair > 0) & (is_second > 0) & (count == np.maximum(before[rows], seen))
        as_many = agrees & ((np.abs(before[rows] - seen) <= 2) | (agreed[rows] == count))
        agreed[rows] = np.where(agrees, count, agreed[rows])
        has_singular = (found.gap[rows] == 0).any(-1)
        found.complete[rows] = as_many | (count % 2 == 0) & (count == most[rows]) & ~has_singular
        # A pair of branches of the neighbour ends between both poses only if it is singular at the goal.
        singular[rows] |= near.complete & has_singular
        if pair and is_second:
            # Beside singular branches, two pairs of neighbours must not add regular ones.
            regular = (np.isfinite(found.q[rows, :, 0]) & (found.gap[rows] > 0)).sum(-1)
            calm[rows] = np.where(regular == known[rows], calm[rows] + np.isfinite(before[rows] + seen), 0)
            known[rows] = regular
            found.complete[rows] |= has_singular & (calm[rows] >= 2)
        before[rows] = seen
    return found._replace(complete=found.complete | singular)


def _neighbour(pair: int) -> float:
    """Return the distance of a neighbouring pose, in angles and relative to the arm's size.

    If k zeros coincide at a pose, they are about this far from each other at the neighbour, and the polynomial between
    them is as small as its k-th power. Half of the digits are left for it, for k = 2, 3 and 4 in turn.
    """
    return float(np.finfo(float).eps ** (0.5 / (2 + pair)))


def _beyond(chain: Chain, q: Reals) -> Reals:
    """Return configurations (N, M B, n) on both sides of branches (N, B, n), where others are that almost coincide."""
    there = np.isfinite(q[..., 0])
    along = np.zeros(q.shape)
    along[there] = np.linalg.svd(chain.rates(q[there]))[0][..., -1]
    # Prismatic joints may be far from 0.
    along *= np.maximum(1.0, np.abs(q * along).max(-1, keepdims=True))
    return np.reshape(q[:, None] + _OFFSETS[:, None, None] * along[:, None], (len(q), -1, len(chain)))


def by_goal(which: Reals, q: Reals, goals: int) -> Reals:
    """Return candidates (K, n) for the goals with indices (K,) as an array (N, C, n), with NaN for missing ones."""
    order = np.argsort(which, kind="stable")
    which, q = which[order], q[order]
    place = np.arange(len(which)) - np.searchsorted(which, which)
    found = np.full((goals, int(place.max(initial=0)) + 1, q.shape[-1]), np.nan)
    found[which, place] = q
    return found


def gathered(chain: Chain, q: Reals, goals: Reals) -> tuple[Reals, Reals, NDArray[np.int64]]:
    """Improve candidates (N, C, n) for goals (N, 8), and return distinct branches as `Closed.solve` does.

    Missing candidates and branches are NaN. Discriminants are 0 where branches coincide. The last result is the number
    of branches, (N,).
    """
    many, candidates, n = q.shape
    ends = np.repeat(goals, candidates, axis=0)
    q = np.ascontiguousarray(q).reshape(-1, n)
    near = np.flatnonzero(chain.distance_rows(q, ends) < _NEAR)
    reached, off = np.full((many, candidates, n), np.nan), np.ones((many, candidates))
    better, _, off.reshape(-1)[near] = descend(chain, q[near], ends[near], _STEPS)
    reached.reshape(-1, n)[near] = chain.wrapped(better)
    kept, gap = chain.distinct(reached, off)
    missing = kept == 0
    reached[missing], gap[missing] = np.nan, 1.0
    if candidates > _BRANCHES:
        # A continuum of configurations fills no place of a regular branch.
        order = np.argsort(np.where(missing, 2, gap == 0), axis=-1, kind="stable")[:, :_BRANCHES]
        rows = np.arange(many)[:, None]
        reached, gap, missing = reached[rows, order], gap[rows, order], missing[rows, order]
    elif candidates < _BRANCHES:
        reached = np.concatenate([reached, np.full((many, _BRANCHES - candidates, n), np.nan)], axis=1)
        gap = np.concatenate([gap, np.ones((many, _BRANCHES - candidates))], axis=1)
    return reached, gap, missing.shape[1] - missing.sum(-1)
