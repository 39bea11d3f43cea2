"""What inverse kinematics gives back."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Status(IntEnum):
    """How it went with one pose.

    ``FOUND``: at least one branch is valid. ``SINGULAR``: the same, but two branches coincide to 1e-6 radians, or a
    joint may turn freely; what is given is one of the configurations. ``OUT_OF_REACH``: no configuration reaches the
    pose. ``NOT_FOUND``: a search from several starts ended elsewhere, which for arms without a closed form is no proof
    that there is none. ``NOT_FINITE``: the pose is NaN, infinite, or no motion.
    """

    FOUND = 0
    SINGULAR = 1
    OUT_OF_REACH = 2
    NOT_FOUND = 3
    NOT_FINITE = 4


@dataclass(frozen=True, slots=True, eq=False)
class Solutions:
    """All branches of the inverse kinematics of a batch of poses.

    Attributes
    ----------
    q : array, (..., branches, n)
        Joint variables, NaN where the branch is not valid. Angles are in (-pi, pi], or turned by whole turns: into the
        joint's limits where that is possible, and as near to `near` as the limits allow where that was given. The
        values of locked joints are those that were given.
    valid : array of bool, (..., branches)
        Whether the branch reaches the pose, to 1e-10 of the arm's size: checked by the forward kinematics. Branches
        that coincide, at singularities, are all valid.
    status : array of int, (...)
        Of `Status`.
    nearest : array, (..., n)
        The first valid branch, within the limits if one is; where `near` was given, of these the one with the
        smallest sum of squared differences to it. Where none is valid, a configuration whose pose is as near as damped
        least squares gets, in lengths and in angles times the arm's size; its angles are turned as those of `q` are,
        and it may be beyond limits. NaN where the pose is not finite.
    method : str
        How the arm was solved: "spherical wrist", "spherical shoulder", "three parallel axes", "parallel axes",
        "three slides", "elbow circle", "elimination" or "search".
    within_limits : array of bool, (..., branches)
        Whether the branch is valid and `q` is within the limits of every joint: ``low <= q <= high``. Values that are
        beyond a limit by rounding, up to 1e-11, are put on it.
    """

    q: NDArray[Any]
    valid: NDArray[np.bool_]
    status: NDArray[np.int8]
    nearest: NDArray[Any]
    method: str
    within_limits: NDArray[np.bool_]
