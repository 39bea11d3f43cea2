"""Conversion of candidate configurations to branches: improvement, validation, removal of duplicates."""

from __future__ import annotations

import numpy as np

from ...arguments import Reals
from .chain import SAME, Chain, apart
from .search import descend, polish, remainder

_NEAR, _CLOSE, _STEPS = 0.3, 1e-10, 40
"""Candidates with errors below the first number are improved, and discarded unless they get below the second."""
_SINGULAR = 1e-7
"""Branches coincide where the determinant of the joints' unit twists is at most this."""
_BRANCHES = 16
_OFFSETS = np.outer([0.01, 0.04, 0.15, 0.5], [1, -1]).ravel()
"""Offsets from a branch, in the direction of the smallest singular value, where a missing branch is searched for."""


def gathered(chain: Chain, which: Reals, q: Reals, goals: Reals) -> tuple[Reals, Reals]:
    """Improve candidates (K, n) for the goals with indices (K,), and return distinct branches as `Closed.solve` does.

    Missing branches are NaN. Discriminants are 0 where branches coincide.
    """
    which, q, place = _once(chain, *_reached(chain, which, q, goals), len(goals))
    # The number of real roots is even: if it is odd, one is missing, most likely near another one.
    odd = (np.bincount(which, minlength=len(goals)) % 2 == 1)[which]
    if odd.any():
        _, rates = remainder(chain, q[odd], goals[which[odd]])
        along = np.linalg.svd(rates)[2][:, -1]
        trials = (q[odd] + _OFFSETS[:, None, None] * along).reshape(-1, len(chain))
        more, found = _reached(chain, np.tile(which[odd], len(_OFFSETS)), trials, goals)
        which, q, place = _once(chain, np.concatenate([which, more]), np.concatenate([q, found]), len(goals))
    branches, gap = np.full((len(goals), _BRANCHES, len(chain)), np.nan), np.ones((len(goals), _BRANCHES))
    branches[which, place] = q
    _, rates = remainder(chain, q, goals[which])
    flat = np.abs(np.linalg.det(rates / np.linalg.norm(rates, axis=-2, keepdims=True))) <= _SINGULAR
    gap[which[flat], place[flat]] = 0.0
    return branches, gap


def _reached(chain: Chain, which: Reals, q: Reals, goals: Reals) -> tuple[Reals, Reals]:
    """Return the candidates that reach their goal after improvement, sorted by distance."""
    off = chain.distance(q, goals[which])
    rough = np.flatnonzero((off > _CLOSE) & (off < _NEAR))
    q[rough], _ = descend(chain, q[rough], goals[which[rough]], _STEPS, 1e-13 * chain.size)
    off[rough] = chain.distance(q[rough], goals[which[rough]])
    order = np.argsort(off)
    order = order[off[order] < 10 * _CLOSE]
    which, q = which[order], q[order]
    # Near a singularity, candidates this close to the goal may be far from the branch and look like another branch.
    return which, chain.wrapped(polish(chain, q, goals[which]))


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
