"""Results of inverse kinematics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ... import evidence


class Status(evidence.Status):
    """Outcome for one pose."""

    FOUND = 0
    """All regular branches are returned."""
    OK = FOUND
    SINGULAR = 1
    """Two branches coincide to 1e-6 radians, or a joint can rotate freely; one of the infinitely many configurations is
    returned."""
    OUT_OF_REACH = 2
    """No configuration reaches the pose."""
    NOT_FOUND = 3
    """An iterative search from several starts did not converge, or the pose is missed by less than 1e-8 of the arm's
    size, next to a singularity. This does not prove that the pose is unreachable."""
    NOT_FINITE = 4
    """The pose is NaN, infinite, or not a rigid motion."""
    INCOMPLETE = 5
    """At least one branch is valid, but others may be missing. All poses that a search reaches have this status, those
    of redundant arms included, which have infinitely many configurations."""


FOUND = np.array([Status.FOUND, Status.SINGULAR], np.int8)
"""The status of a pose whose branches are found, for a pose that is not singular and for one that is."""

EVERY = np.ones(1, bool)
"""Of every goal, all branches were found."""


class Branches(NamedTuple):
    """Branches q (N, B, n) of a method, their discriminants (N, B), and whether none is missing, (N,) or (1,)."""

    q: NDArray[Any]
    gap: NDArray[Any]
    complete: NDArray[np.bool_] = EVERY

    def of_block(self, _goals: NDArray[Any], block: slice) -> Branches:
        """Return those of a block of goals."""
        return Branches(self.q[block], self.gap[block], self.complete[block])


@dataclass(slots=True, eq=False)
class Solutions:
    """All branches of the inverse kinematics of a batch of poses.

    Attributes
    ----------
    q : array, (..., branches, n)
        Joint variables, NaN where the branch is not valid. Angles are in (-pi, pi], or shifted by multiples of 2 pi:
        into the joint's limits where possible, and as close to `near` as the limits allow if `near` was given. Locked
        joints have their given values.
    valid : array of bool, (..., branches)
        Whether the branch reaches the pose to 1e-10 of the arm's size, verified by forward kinematics, and to rounding
        errors of its distance from the origin. Coinciding branches at singularities are all valid.
    status : array of int, (...)
        Values of `Status`.
    nearest : array, (..., n)
        The first valid branch, preferably within the limits. If `near` was given, the candidate with the smallest sum
        of squared differences to it. If no branch is valid, the configuration whose pose is closest according to damped
        least squares, in lengths and in angles times the arm's size. Its angles are shifted as those of `q`, and it may
        violate limits. NaN where the pose is not finite.
    method : str
        The method that solved the arm: "spherical wrist", "spherical shoulder", "three parallel axes", "parallel axes",
        "three slides", "elbow circle", "elimination" or "search".
    within_limits : array of bool, (..., branches)
        Whether the branch is valid and `q` is within the limits of every joint: ``low <= q <= high``. Values beyond a
        limit by rounding errors up to 1e-11 are set to the limit.
    """

    q: NDArray[Any]
    valid: NDArray[np.bool_]
    status: NDArray[np.int8]
    nearest: NDArray[Any]
    method: str
    within_limits: NDArray[np.bool_]
