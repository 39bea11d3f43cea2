"""Hand-eye calibration from poses with unknown noise: steps to the most likely motors, for many problems at once.

Arrays are in double precision, with one axis of problems before that of poses. No function raises an error.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from generated import hand_eye as kernels

from ..arguments import Reals
from ..evidence import rank

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


def deviations(one: Reals, two: Reals, x: Reals, z: Reals, inliers: Reals) -> Reals:
    """Return the deviations (p, 2) of the rotations and translations of motors X (p, 8), in any direction.

    Rotations and translations of the residuals of poses (p, n, 8) have a variance each, that of the inliers.
    """
    parts = kernels.misfit_of_poses_equations(one, two, x[:, None], z[:, None], np.eye(8)[0])
    information, freedom = np.zeros((len(one), 12, 12)), np.maximum(3 * inliers.sum(1) - 6, 0)
    for part in parts:
        rows = np.where(inliers[..., None, None], part, 0).reshape(len(one), -1, 13)
        cost = (rows[..., 12] ** 2).sum(1)
        rows = rows[..., :12]
        variance = np.maximum(cost, 1e-300) / np.maximum(freedom, 1)
        information += np.swapaxes(rows, 1, 2) @ rows / variance[:, None, None]
    found = np.full((len(one), 2), np.inf)
    for p in np.flatnonzero(np.isfinite(information).all((1, 2)) & (freedom > 0)):
        if rank(information[p]) == 12:
            spread = np.linalg.inv(information[p])
            # A bivector turns and moves by twice its size.
            found[p] = [2 * np.sqrt(np.linalg.eigvalsh(spread[k : k + 3, k : k + 3])[-1]) for k in (0, 3)]
    return found
