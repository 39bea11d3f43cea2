"""Validation of the branches of inverse kinematics: which reach their goals, which are polished, which are missing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...arguments import Reals
from .chain import COINCIDE, SAME, Chain, apart
from .search import descend, search
from .solutions import Branches

BLOCK = 512
"""Number of poses in a block, such that the data of a block, 1 kB for each pose, fit into the second-level cache."""
EXACT = 2.0**-46
"""Branches with larger errors than this, 64 rounding errors, and up to `ROUGH` are polished."""
ROUGH, NO_ROOT = 1e-3, -1e-6
"""Branches with a discriminant below the second number have no solution, whatever the rounding; they are skipped."""
_SINGULAR = 1e-8
"""Poses missed by less than this may be reachable: the root of the rounding errors is the accuracy at a singularity."""
_STEPS, _FEW = 60, 8
"""Maximum steps of a descent to the nearest reachable pose, and number of starts where no start is known."""

Solver = Callable[[Reals, slice], tuple[Reals, Reals] | Branches]
"""Returns branches and discriminants of a block of goals, and whether all branches are among them if that may fail."""

_Errors = tuple[Reals, Reals, Reals, Reals]
"""The goals and numbers of branches (K,), the branches (K, n), and their errors (K,)."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Branches of a batch of goals: q (N, B, n), valid (N, B), discriminants (N, B), nearest (N, n), complete (N,)."""

    q: Reals
    valid: NDArray[np.bool_]
    gap: Reals
    nearest: Reals
    method: str
    complete: NDArray[np.bool_]


def checked(chain: Chain, goals: Reals, solve: Solver, method: str) -> Found:
    """Validate the branches of a solver against the goals, and polish those with small errors."""
    found: Found | None = None
    rough: list[_Errors] = []
    free: list[_Errors] = []
    for start in range(0, max(len(goals), 1), BLOCK):
        block = slice(start, start + BLOCK)
        q, gap, *complete = solve(goals[block], block)
        off = chain.distance(q, goals[block, None])
        if found is None:
            found = _empty((len(goals), *q.shape[1:]), method)
        # arctan2(-0.0, x) is -pi for negative x.
        q[(q == -np.pi) & (chain.tables["turns"] > 0)] = np.pi
        valid = off <= chain.right
        near = (off > EXACT) & (off < ROUGH) & (gap > NO_ROOT)
        loose = (off >= ROUGH) & (np.abs(gap) <= COINCIDE) & np.isfinite(off)
        for which, errors in ((near, rough), (loose, free)):
            if which.any():
                rows, branches = np.nonzero(which)
                errors.append((rows + start, branches, q[which], off[which]))
        # The first valid branch, or the one with the smallest error if no branch is valid.
        best = np.argmax(valid, axis=-1)
        lost = ~valid.any(-1)
        best[lost] = np.argmin(np.where(np.isfinite(off[lost]), off[lost], np.inf), axis=-1)
        found.nearest[block] = q[np.arange(len(q)), best]
        q[~valid] = np.nan
        found.q[block], found.valid[block], found.gap[block] = q, valid, gap
        if complete:
            found.complete[block] = complete[0]
    assert found is not None  # even an empty batch of goals has one block
    if rough:
        _polished(chain, goals, found, *(np.concatenate(part) for part in zip(*rough, strict=True)))
    if free:
        _freed(chain, goals, found, *(np.concatenate(part) for part in zip(*free, strict=True)))
    missed = np.flatnonzero(~found.valid.any(-1))
    if len(missed):
        _approached(chain, goals, found, missed)
    return found


def _empty(shape: tuple[int, ...], method: str) -> Found:
    """Return room for branches of the given shape, (N, B, n)."""
    q, valid, gap = np.empty(shape), np.empty(shape[:2], bool), np.empty(shape[:2])
    return Found(q, valid, gap, np.empty((shape[0], shape[2])), method, np.ones(shape[0], bool))


def _approached(chain: Chain, goals: Reals, found: Found, missed: Reals) -> None:
    """Insert the nearest configurations of goals without a valid branch, which may reach them after all."""
    begin = found.nearest[missed]
    nowhere = ~np.isfinite(begin).all(-1)
    if nowhere.any():
        begin[nowhere] = search(chain, goals[missed[nowhere]], _FEW)[:, 0]
    reached, _, distance = descend(chain, begin, goals[missed], _STEPS)
    # Next to singularities, or if a joint rotates freely, the goal may be reachable from elsewhere.
    lost = ((np.abs(found.gap[missed]) <= COINCIDE).any(-1) | (distance < _SINGULAR)) & (distance > chain.right)
    if lost.any():
        reached[lost] = search(chain, goals[missed[lost]])[:, 0]
    found.nearest[missed] = chain.wrapped(reached)
    distance = chain.distance(reached, goals[missed])
    right = missed[distance <= chain.right]
    found.complete[missed[(distance > chain.right) & (distance < _SINGULAR)]] = False
    found.q[right, 0], found.valid[right, 0] = found.nearest[right], True
    # The equations had no solution although the pose is reachable: this happens at singularities.
    found.gap[right, 0] = 0.0


def _polished(chain: Chain, goals: Reals, found: Found, rows: Reals, branches: Reals, q: Reals, off: Reals) -> None:
    """Polish branches (K, n) with errors (K,), and insert those that become valid."""
    better, _, distance = descend(chain, q, goals[rows], _STEPS)
    improved = distance < off
    q = np.where(improved[:, None], chain.wrapped(better), q)
    right = np.where(improved, distance, off) <= chain.right
    rows, branches, q = rows[right], branches[right], q[right]
    found.q[rows, branches], found.valid[rows, branches] = q, True
    found.nearest[rows] = found.q[rows, found.valid[rows].argmax(-1)]


def _freed(chain: Chain, goals: Reals, found: Found, rows: Reals, branches: Reals, q: Reals, off: Reals) -> None:
    """Correct branches (K, n), with errors (K,), in which the angle of a freely rotating joint is infeasible.

    For each pose without a valid singular branch, the branch with the smallest error is moved until it reaches the
    goal, and inserted unless it duplicates another one.
    """
    has_one = np.any(found.valid & (np.abs(found.gap) <= COINCIDE), axis=-1)
    order = np.argsort(off)
    order = order[~has_one[rows[order]]]
    first = order[np.unique(rows[order], return_index=True)[1]]
    rows, branches = rows[first], branches[first]
    better, _, distance = descend(chain, q[first], goals[rows], _STEPS)
    better = chain.wrapped(better)
    known = (apart(found.q[rows], better[:, None], np.array(chain.slides)) < SAME).any(-1)
    right = (distance <= chain.right) & ~known
    rows, branches = rows[right], branches[right]
    found.q[rows, branches], found.valid[rows, branches] = better[right], True
