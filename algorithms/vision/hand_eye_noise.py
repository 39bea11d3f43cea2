"""Hand and eye from poses whose noise is unknown: steps to the most likely motors, of many problems at once.

Arrays are in double precision, with one axis of problems before that of poses. Nothing here raises.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from generated import hand_eye as kernels

from ..arguments import Reals

_DAMPING = np.full(12, 1e-14)
"""What the pivot of each unknown is increased by, as a part of the trace."""


def called(kernel: Callable[..., Any], arrays: tuple[Reals, ...], *shared: Any) -> Any:
    """What a kernel gives for problems (p, ...), and for arguments that they share.

    One problem has no axis of its own: calls on one element cost least.
    """
    if len(arrays[0]) != 1:
        return kernel(*arrays, *shared)
    # A number of one problem is no array.
    found = kernel(*[each[0] for each in arrays], *shared)
    if type(found) is tuple:
        return tuple([np.asarray(part)[None] for part in found])
    return np.asarray(found)[None]


def still_points(rest: Reals, points: Reals) -> None:
    """Return the points (p, 3), a result, that motions (p, n, 6) of a frame, as small bivectors, move least in all.

    Near the origin where motions say little: as much as if each had a translation for a point as far as the unit.
    """
    points[:] = called(kernels.still_point, (rest,))


def likely_steps(
    turns: Reals,
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
    """Return the steps (p, 12) of Gauss and Newton to the poses that are most likely, and new variances; if all are done.

    From what `generated.hand_eye.rows_of_poses` gives; `likely_step` there says what is computed. The problems that
    are `moving` (p,) change in place: whether they still are, their `variances` (p, 3), those that the step is of,
    `used` (p, 3), the weighed sums of squares before it, `cost` (p,), for `grown`, the steps, and sums of `squares`
    (p, 2). Where `first`, only ratios of variances are taken, and squares are those of all problems. A problem whose
    sums are not finite has step 0, and stops.
    """
    everyone = first or np.count_nonzero(moving) == len(moving)
    some = slice(None) if everyone else np.flatnonzero(moving)
    rows = turns, shifts, hand, seen, variances
    parts = rows if everyone else tuple(each[some] for each in rows)
    step[:] = 0.0
    found = called(kernels.likely_step, parts, float(first), _DAMPING)
    step[some], goes_on, used[some], cost[some], variances[some], squares[some] = found
    if first:
        step[~moving] = 0.0
    moving[some] &= goes_on > 0
    return not np.count_nonzero(moving)


def grown(turns: Reals, shifts: Reals, hand: Reals, seen: Reals, used: Reals, cost: Reals, moving: Reals) -> Reals:
    """Which steps (p,) of `likely_steps` made the sum of squares, weighed as there, more; these problems stop.

    From rows after the step, and what else that had.
    """
    now = called(kernels.weighed_squares, (turns, shifts, hand, seen, used))
    worse = moving & ~(now <= cost)
    moving &= ~worse
    return np.asarray(worse)
