"""Hand-eye calibration from poses with unknown noise: steps to the most likely motors, for many problems at once.

Arrays are in double precision, with one axis of problems before that of poses. No function raises an error.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from generated import hand_eye as kernels

from ..arguments import Reals

_DAMPING = np.full(12, 1e-14)
"""Relative increase of the pivot of each unknown, as a fraction of the trace."""


def called(kernel: Callable[..., Any], arrays: tuple[Reals, ...], *shared: Any) -> Any:
    """Call a kernel for problems (p, ...) with arguments that they share.

    A single problem is passed without the axis of problems, because calls for one element are cheapest.
    """
    if len(arrays[0]) != 1:
        return kernel(*arrays, *shared)
    # A scalar result for one problem is not an array.
    found = kernel(*[each[0] for each in arrays], *shared)
    if type(found) is tuple:
        return tuple([np.asarray(part)[None] for part in found])
    return np.asarray(found)[None]


def still_points(rest: Reals, points: Reals) -> None:
    """Store in `points` (p, 3) the points that motions (p, n, 6), as small bivectors in a frame, move least in total.

    Points are regularised towards the origin, as if each motion had a translation for a point at unit distance.
    """
    points[:] = called(kernels.still_point, (rest,))


def likely_steps(
    rotations: Reals,
    shifts: Reals,
    hand: Reals,
    seen: Reals,
    moving: Reals,
    first: bool,
    variances: Reals,
    used: Reals,
    cost: Reals,
    step: Reals,
    squares: Reals,
) -> bool:
    """Compute Gauss-Newton steps (p, 12) to the most likely poses, and new variances; return whether all are done.

    The arguments are the results of `generated.hand_eye.rows_of_poses`; see `likely_step` there for the computation.
    For the problems that are `moving` (p,), these arrays are changed in place: whether they are still moving, their
    `variances` (p, 3), the variances `used` for the step (p, 3), the weighted sum of squares before it, `cost` (p,),
    for `increased`, the steps, and the sums of `squares` (p, 2). If `first`, only ratios of variances are used, and
    squares are those of all problems. A problem whose sums are not finite has step 0 and stops.
    """
    everyone = first or np.count_nonzero(moving) == len(moving)
    some = slice(None) if everyone else np.flatnonzero(moving)
    rows = rotations, shifts, hand, seen, variances
    parts = rows if everyone else tuple(each[some] for each in rows)
    step[:] = 0.0
    found = called(kernels.likely_step, parts, float(first), _DAMPING)
    step[some], goes_on, used[some], cost[some], variances[some], squares[some] = found
    if first:
        step[~moving] = 0.0
    moving[some] &= goes_on > 0
    return not np.count_nonzero(moving)


def increased(
    rotations: Reals, shifts: Reals, hand: Reals, seen: Reals, used: Reals, cost: Reals, moving: Reals
) -> Reals:
    """Return which steps (p,) of `likely_steps` increased the weighted sum of squares; these problems stop.

    The arguments are the rows after the step, and the values used for the step.
    """
    now = called(kernels.weighed_squares, (rotations, shifts, hand, seen, used))
    worse = moving & ~(now <= cost)
    moving &= ~worse
    return np.asarray(worse)
