"""Matched scans as factors of graphs of motors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from generated import pga2

from ..arguments import Reals, as_given
from ..estimation.motor_graph import MotorGraph
from .matching import Match
from .status import MappingStatus

_USED = (MappingStatus.OK, MappingStatus.DEGENERATE)
"""Of other statuses, the motion may be another one than the covariance says."""


def add_scans(
    graph: MotorGraph,
    first: ArrayLike,
    second: ArrayLike,
    matches: Match | Sequence[Match],
    *,
    mount: ArrayLike | None = None,
    robust: ArrayLike = False,
) -> Reals:
    """Add the motions between matched scans to a graph of motors, as `MotorGraph.add_flat_motions`.

    Matches that are OK are used, and those that are DEGENERATE: their covariances say what they do not determine, such
    as the way along a corridor, which other factors may. The others are left out.

    Parameters
    ----------
    graph : MotorGraph
        Such as a `MotorSmoother`.
    first, second : array_like, (m,) of int
        The states of the first and second scans of the matches.
    matches : Match, or sequence of m
        As from `match_scans`.
    mount : array_like, (8,), optional
        Motor of `generated.pga3` from the frame of the scanner, which measures in its x-y plane, to those of poses; by
        default the identity.
    robust : array_like, (m,) of bool, optional
        Factors that may be wrong: rooms look alike.

    Returns
    -------
    array, (m,) of bool
        Which matches were used.

    Raises
    ------
    TypeError, ValueError
        As for all methods of `MotorGraph`, or if `matches` are none.

    Examples
    --------
    >>> from algorithms.estimation import MotorGraph
    >>> from algorithms.mapping import Scan, match_scans
    >>> beams = np.linspace(-np.pi / 2, np.pi / 2, 181)
    >>> walls = 3 / np.maximum(np.abs(np.sin(beams)), 1e-9), 4 / np.maximum(np.cos(beams), 1e-9)
    >>> scan = Scan(np.minimum(*walls), -np.pi / 2, np.pi / 180, 30.0)
    >>> graph = MotorGraph()
    >>> add_scans(graph, 0, 1, match_scans(scan, scan)).tolist()
    [True]
    >>> graph
    MotorGraph of 2 states: 1 flat motion
    """
    every = [matches] if isinstance(matches, Match) else list(matches)
    for each in every:
        if not isinstance(each, Match):
            raise TypeError(f"matches: {type(each).__name__}; expected Match, as from match_scans")
    used = np.array([each.status in _USED for each in every], bool)
    chosen = np.flatnonzero(used)
    named = (("first", first), ("second", second), ("robust", robust))
    one, two, flags = (_chosen(value, name, len(every), chosen) for name, value in named)
    motors = np.array([every[k].motor for k in chosen]).reshape(-1, 4)
    spread = _in_second(motors, np.array([every[k].covariance for k in chosen]).reshape(-1, 3, 3))
    graph.add_flat_motions(one, two, motors, spread, mount=mount, robust=flags)
    return used


def _chosen(value: ArrayLike, name: str, n: int, chosen: Reals) -> Reals:
    """Return the values of some of n matches from one for all, or one for each."""
    array = as_given(value, name)
    if array.shape not in ((), (n,)):
        raise ValueError(f"{name}: shape {array.shape}; expected one, or one for each of {n} matches")
    return array[chosen] if array.ndim else array


def _in_second(motors: Reals, covariances: Reals) -> Reals:
    """Return covariances (m, 3, 3) of the angle, x and y of motions of second scans from those of first ones."""
    shift = np.asarray(pga2.motor_to_angle_translation(motors)[1])
    # A small motion of the first frame moves the origin of the second one by its translation and its angle.
    rows = np.zeros((len(motors), 3, 3))
    rows[:, 0, 2] = 1
    turns = np.swapaxes(np.asarray(pga2.motor_to_matrix(motors))[:, :2, :2], 1, 2)
    rows[:, 1:, :2] = turns
    rows[:, 1:, 2] = (turns @ np.stack([-shift[:, 1], shift[:, 0]], 1)[..., None])[..., 0]
    return np.asarray(rows @ covariances @ np.swapaxes(rows, 1, 2))
