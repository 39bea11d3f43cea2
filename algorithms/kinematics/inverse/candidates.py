"""Conversion of candidate configurations to branches: improvement, validation, removal of duplicates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from generated import pga3

from ...arguments import Reals
from .chain import SAME, Chain, apart
from .search import descend
from .solutions import Branches

_NEAR, _CLOSE, _STEPS = 0.3, 1e-9, 40
"""Candidates with errors below the first number are improved, and discarded unless they get below the second."""
_SINGULAR = 1e-7
"""Branches coincide where the determinant of the joints' unit twists is at most this."""
_BRANCHES = 16
_NEIGHBOUR, _ATTEMPTS = float(np.finfo(float).eps ** 0.25), 6
"""Distance of a neighbouring pose, in angles and relative to the arm's size, and the largest number of attempts.

Half of the digits are left for eigenvectors, whose errors are divided by the distance of the roots, and half for the
return to the pose, whose error is the square of the distance.
"""
_OFFSETS = np.outer([0.01, 0.04, 0.15, 0.5], [1, -1]).ravel()
"""Offsets from a branch, in the direction of the smallest singular value, where a missing branch is searched for."""

Once = Callable[[Reals, int], tuple[Branches, Reals]]
"""Returns the branches of goals, and how many there are at most, (N,), or NaN if the method does not know this.

The second argument numbers the attempts, which may use different equations.
"""


def completed(chain: Chain, once: Once, goals: Reals) -> Branches:
    """Return the branches of goals, where necessary with those of random poses in their neighbourhood.

    Branches are complete if there are as many as zeros of the equations, or as at a neighbour with complete branches.

    Roots that coincide at a goal, because a structured posture makes equations dependent, are distinct at a neighbour.
    A regular branch there is the continuation of one at the goal. Every third attempt is at the goal itself, with other
    equations.
    """
    found, most = once(goals, 0)
    rng, singular = np.random.default_rng(3), np.zeros(len(goals), bool)
    for attempt in range(1, _ATTEMPTS):
        rows = np.flatnonzero(~found.complete)
        if not len(rows):
            break
        goal, shift = goals[rows], rng.normal(size=(len(rows), 6)) * np.repeat([1.0, chain.size], 3)
        beside = goal if attempt % 3 == 0 else pga3.motor_product(goal, pga3.motor_from_twist(_NEIGHBOUR * shift))
        near, more = once(beside, attempt)
        if beside is goal:
            most[rows] = np.fmin(most[rows], more)
        known, place = np.nonzero(np.isfinite(found.q[rows][..., 0]))
        which, spot = np.nonzero(np.isfinite(near.q[..., 0]))
        own = found.q[rows[known], place]
        odd = (np.bincount(known, minlength=len(rows)) % 2 == 1)[known]
        q = np.concatenate([own, near.q[which, spot], _beyond(chain, own[odd])])
        index = np.concatenate([known, which, np.tile(known[odd], len(_OFFSETS))])
        found.q[rows], found.gap[rows] = gathered(chain, index, q, goal)
        count = np.isfinite(found.q[rows][..., 0]).sum(-1)
        as_many = near.complete & (count == np.bincount(which, minlength=len(rows)))
        found.complete[rows] = as_many | (count % 2 == 0) & (count >= most[rows])
        # A pair of branches of the neighbour ends between both poses only if it is singular at the goal.
        singular[rows] |= near.complete & (found.gap[rows] == 0).any(-1)
    return found._replace(complete=found.complete | singular)


def _beyond(chain: Chain, q: Reals) -> Reals:
    """Return configurations (M K, n) on both sides of branches (K, n), where another one is if both are almost one."""
    along = np.linalg.svd(chain.rates(q))[0][..., -1]
    # Prismatic joints may be far from 0.
    along *= np.maximum(1.0, np.abs(q * along).max(-1, keepdims=True))
    return np.reshape(q + _OFFSETS[:, None, None] * along, (-1, len(chain)))


def gathered(chain: Chain, which: Reals, q: Reals, goals: Reals) -> tuple[Reals, Reals]:
    """Improve candidates (K, n) for the goals with indices (K,), and return distinct branches as `Closed.solve` does.

    Missing branches are NaN. Discriminants are 0 where branches coincide.
    """
    which, q, place = _once(chain, *_reached(chain, which, q, goals), len(goals))
    branches, gap = np.full((len(goals), _BRANCHES, len(chain)), np.nan), np.ones((len(goals), _BRANCHES))
    branches[which, place] = q
    rates = chain.rates(q)
    flat = np.abs(np.linalg.det(rates / np.linalg.norm(rates, axis=-1, keepdims=True))) <= _SINGULAR
    gap[which[flat], place[flat]] = 0.0
    return branches, gap


def _reached(chain: Chain, which: Reals, q: Reals, goals: Reals) -> tuple[Reals, Reals]:
    """Return the candidates that reach their goal after improvement, sorted by distance."""
    near = chain.distance(q, goals[which]) < _NEAR
    which = which[near]
    q, _, off = descend(chain, q[near], goals[which], _STEPS)
    order = np.argsort(off)
    order = order[off[order] < _CLOSE]
    return which[order], chain.wrapped(q[order])


def _once(chain: Chain, which: Reals, q: Reals, goals: int) -> tuple[Reals, Reals, Reals]:
    """Return distinct candidates with the index of their branch."""
    order = np.argsort(which, kind="stable")
    which, q = which[order], q[order]
    place = _places(which, q, goals, np.array(chain.slides))
    return which[place >= 0], q[place >= 0], place[place >= 0]


def _places(which: Reals, q: Reals, goals: int, slides: Reals) -> Reals:
    """Return the branch index of each configuration, (K,), -1 for duplicates. Those of a goal must be consecutive."""
    place = np.full(len(which), -1)
    count = np.zeros(goals, int)
    start = np.searchsorted(which, np.arange(goals))
    rank = np.arange(len(which)) - start[which] if len(which) else np.zeros(0, int)
    kept = np.full((goals, _BRANCHES, q.shape[-1]), np.nan)
    for k in range(int(rank.max(initial=-1)) + 1):
        now = np.flatnonzero(rank == k)
        goal = which[now]
        new = ~(apart(kept[goal], q[now, None], slides) < SAME).any(-1) & (count[goal] < _BRANCHES)
        now, goal = now[new], goal[new]
        place[now] = count[goal]
        kept[goal, count[goal]] = q[now]
        count[goal] += 1
    return place
