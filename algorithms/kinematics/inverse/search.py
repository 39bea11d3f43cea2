"""Damped least squares on motors: polishing, nearest reachable poses, and arms without a closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arguments import Reals
from .chain import SAME, Chain, apart, paired

_STEPS, _STARTS = 60, 24
"""Limits on work: the number of steps of a descent, and of its random starts."""
_BRANCHES = 8
"""Number of configurations that a search keeps."""
REACHED = 1e-9
"""A goal is reached to this distance, relative to the arm's size."""
AROUND = 0.05
"""Standard deviation of starts around a configuration, relative to the ranges of the joints."""


def descend(chain: Chain, q: Reals, goals: Reals, steps: int = _STEPS) -> tuple[Reals, Reals, Reals]:
    """Apply damped least squares (Levenberg-Marquardt) from given configurations.

    Parameters
    ----------
    chain : Chain
    q : array, (N, n)
    goals : array, (N, 8)
    steps : int
        Maximum number of steps. Iteration stops at rounding errors, and for relative improvements below 1e-7.

    Returns
    -------
    q : array, (N, n)
    error : array, (N,)
        Norm of the remaining twist, with angles times the arm's size.
    off : array, (N,)
        Distance of the motors, as `Chain.distance`.
    """
    return chain.descent(q, goals, float(steps))  # type: ignore[no-any-return]


@dataclass(frozen=True, slots=True, eq=False)
class Hints:
    """What a search is to respect: limits of the joints, (n, 2), and configurations to begin at, (N, n), or None."""

    limits: Reals
    near: Reals | None

    def at(self, rows: Reals | slice) -> Hints:
        """Return the hints for some of the poses."""
        return self if self.near is None else Hints(self.limits, self.near[rows])

    def without(self, joint: int) -> Hints:
        """Return the hints for the arm without a joint."""
        near = None if self.near is None else np.delete(self.near, joint, -1)
        return Hints(np.delete(self.limits, joint, 0), near)


def search_within(chain: Chain, goals: Reals, hints: Hints) -> Reals:
    """Return configurations as `search`, within limits where possible.

    Where `near` is given, the search begins there, and the configuration that it leads to is the only one. Poses that
    are not reached within the limits are searched from random starts around `near` and within the limits, then without
    limits.
    """
    low, high = np.ascontiguousarray(hints.limits.T)
    found = np.full((len(goals), _BRANCHES, len(chain)), np.nan)
    missed = np.arange(len(goals))
    rng = np.random.default_rng(7)
    spread = np.where(np.isfinite(hints.limits), hints.limits, chain.ranges)
    many = rng.uniform(spread[:, 0], spread[:, 1], (5 * _STARTS, len(chain)))
    random, more = many[:_STARTS], many[_STARTS:]
    rounds = [np.broadcast_to(starts, (len(goals), *starts.shape)) for starts in (random, more)]
    if hints.near is not None:
        around = hints.near[:, None] + AROUND * (spread[:, 1] - spread[:, 0]) * rng.normal(size=random.shape)
        rounds = [hints.near[:, None], around, *rounds]
    for starts in rounds:
        begin, ends = paired(starts[missed], goals[missed, None])
        q, error, _ = chain.descent_inside(begin, ends, low, high, float(_STEPS))
        found[missed] = _distinct(chain, q, error)
        missed = missed[error.min(-1) > REACHED * chain.size]
        if not len(missed):
            return found
    found[missed] = search(chain, goals[missed])
    return found


def search(chain: Chain, goals: Reals, starts: Reals | int = _STARTS) -> Reals:
    """Return configurations found from several starts, first those that reach the goal: (N, branches, n).

    `starts` holds the start configurations, or is their number.
    """
    if isinstance(starts, int):
        begin: Reals = np.random.default_rng(7).uniform(chain.ranges[:, 0], chain.ranges[:, 1], (starts, len(chain)))
    else:
        begin = starts
    many = len(begin)
    q, error, _ = descend(chain, np.tile(begin, (len(goals), 1)), np.repeat(goals, many, axis=0))
    return _distinct(chain, chain.wrapped(q).reshape(-1, many, len(chain)), error.reshape(-1, many))


def _distinct(chain: Chain, q: Reals, error: Reals) -> Reals:
    """Return distinct ones of configurations (N, S, n) in the order of their starts, or the nearest if none reaches."""
    reached = error <= REACHED * chain.size
    order = np.argsort(np.where(reached, -1.0, error), axis=-1, kind="stable")
    q, reached = np.take_along_axis(q, order[..., None], 1), np.take_along_axis(reached, order, 1)
    same = np.tril(apart(q[:, :, None], q[:, None], np.array(chain.slides)) < SAME, -1).any(-1) | ~reached
    same[:, 0] = False
    order = np.argsort(same, axis=-1, kind="stable")[:, :_BRANCHES]
    q, same = np.take_along_axis(q, order[..., None], 1), np.take_along_axis(same, order, 1)
    found = np.full((len(q), _BRANCHES, len(chain)), np.nan)
    found[:, : q.shape[1]] = np.where(same[..., None], np.nan, q)
    return found
