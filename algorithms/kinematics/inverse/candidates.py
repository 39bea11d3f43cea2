"""From candidates of a way to branches: improved, checked, each once."""

from __future__ import annotations

import numpy as np

from ...arguments import Reals
from .chain import SAME, Chain, apart
from .search import descend, polish, remainder

_NEAR, _CLOSE, _STEPS = 0.3, 1e-10, 40
"""Candidates nearer than the first to the goal are improved until they are nearer than the second, or left out."""
_SINGULAR = 1e-7
"""Determinants of the joints' unit twists up to this: branches coincide there."""
_BRANCHES = 16
_BESIDE = np.outer([0.01, 0.04, 0.15, 0.5], [1, -1]).ravel()
"""How far from a branch, along the direction in which it can move most freely, another is looked for."""


def gathered(chain: Chain, which: Reals, q: Reals, goals: Reals) -> tuple[Reals, Reals]:
    """Candidates (K, n) for some of the goals, (K,), improved, each once: as `Closed.solve` gives branches.

    NaN where there is no branch; discriminants are 0 where branches coincide.
    """
    which, q, place = _once(chain, *_reached(chain, which, q, goals), len(goals))
    # Real roots come in pairs: where their number is odd, one is missed, most likely next to another.
    odd = (np.bincount(which, minlength=len(goals)) % 2 == 1)[which]
    if odd.any():
        _, rates = remainder(chain, q[odd], goals[which[odd]])
        along = np.linalg.svd(rates)[2][:, -1]
        beside = (q[odd] + _BESIDE[:, None, None] * along).reshape(-1, len(chain))
        more, found = _reached(chain, np.tile(which[odd], len(_BESIDE)), beside, goals)
        which, q, place = _once(chain, np.concatenate([which, more]), np.concatenate([q, found]), len(goals))
    branches, gap = np.full((len(goals), _BRANCHES, len(chain)), np.nan), np.ones((len(goals), _BRANCHES))
    branches[which, place] = q
    _, rates = remainder(chain, q, goals[which])
    flat = np.abs(np.linalg.det(rates / np.linalg.norm(rates, axis=-2, keepdims=True))) <= _SINGULAR
    gap[which[flat], place[flat]] = 0.0
    return branches, gap


def _reached(chain: Chain, which: Reals, q: Reals, goals: Reals) -> tuple[Reals, Reals]:
    """Those that reach their goal once they are improved, the nearest to it first."""
    off = chain.distance(q, goals[which])
    rough = np.flatnonzero((off > _CLOSE) & (off < _NEAR))
    q[rough], _ = descend(chain, q[rough], goals[which[rough]], _STEPS, 1e-13 * chain.size)
    off[rough] = chain.distance(q[rough], goals[which[rough]])
    order = np.argsort(off)
    order = order[off[order] < 10 * _CLOSE]
    which, q = which[order], q[order]
    # Next to a singularity what is that close to the goal may be far from the branch, and seem to be another.
    return which, chain.wrapped(polish(chain, q, goals[which]))


def _once(chain: Chain, which: Reals, q: Reals, goals: int) -> tuple[Reals, Reals, Reals]:
    """Those that are not there already, with the branch that each becomes."""
    order = np.argsort(which, kind="stable")
    which, q = which[order], q[order]
    place = _places(which, q, goals, np.array(chain.slides))
    return which[place >= 0], q[place >= 0], place[place >= 0]


def _places(which: Reals, q: Reals, goals: int, slides: Reals) -> Reals:
    """The branch of each configuration, (K,), -1 for those that are there already; those of a goal are in a row."""
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
