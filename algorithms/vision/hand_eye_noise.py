"""Hand-eye calibration from poses with unknown noise: steps to the most likely motors, for many problems at once.

Arrays are in double precision, with one axis of problems before that of poses. No function raises an error.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from generated import hand_eye as kernels

from ..arguments import Reals
from ..evidence import WRONG, largest_ratio, rank
from ..evidence.misfit import SUSPECTED, coherence
from ..precision import TINY

DAMPING = 1e-14
"""From floating point: the increment of the diagonal relative to its sum, which prevents a division by 0."""


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
    found = called(kernels.likely_step, parts, float(first), np.full(12, DAMPING))
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


def deviations(
    one: Reals, two: Reals, x: Reals, z: Reals, inliers: Reals, floors: tuple[Reals, Reals]
) -> tuple[Reals, Reals]:
    """Return the deviations (p, 2) of the rotations and translations of motors X (p, 8), and what contradicts them.

    Rotations and translations of the residuals of poses (p, n, 8) have a variance each, that of the inliers. Few
    residuals leave it uncertain: deviations are larger by as much as Student's distribution is wider. What residuals
    have in common with those of the next pose makes deviations larger, and is a contradiction (p,) if it is more than
    the rest: the camera has moved on the hand. Residuals of rotation and translation (p,) below
    floors are rounding errors.
    """
    parts = kernels.misfit_of_poses_equations(one, two, x[:, None], z[:, None], np.eye(8)[0])
    information, freedom = np.zeros((len(one), 12, 12)), np.maximum(3 * inliers.sum(1) - 6, 0)
    rests = []
    for part, floor in zip(parts, floors, strict=True):
        rows = np.where(inliers[..., None, None], part, 0).reshape(len(one), -1, 13)
        last = rows[..., 12]
        variance = np.maximum(np.vecdot(last, last), TINY) / np.maximum(freedom, 1)
        rests.append(last.reshape(*inliers.shape, 3) * ((variance > floor * floor) / np.sqrt(variance))[:, None, None])
        information += np.swapaxes(rows[..., :12], 1, 2) @ rows[..., :12] / variance[:, None, None]
    found, contradicted = np.full((len(one), 2), np.inf), np.zeros(len(one), bool)
    # A motor and its negative have residuals of opposite signs, and derivatives by the same turn too.
    rest = np.concatenate(rests, 2) * np.copysign(1.0, parts[0][..., :1, 0])
    for p in np.flatnonzero(np.isfinite(information).all((1, 2)) & (freedom > 0)):
        suspected, certain = _shares(rest[p, inliers[p]])
        contradicted[p] = 2 * certain > 1
        if rank(information[p]) == 12:
            growth = (1 + int(inliers[p].sum()) * suspected) * largest_ratio(3, int(freedom[p])) / largest_ratio(3)
            spread = growth * np.linalg.inv(information[p])
            # A bivector turns and moves by twice its size.
            both = spread[:6, :6].reshape(2, 3, 2, 3)[range(2), :, range(2)]
            found[p] = 2 * np.sqrt(np.linalg.eigvalsh(both)[:, -1])
    return found, contradicted


def _shares(rest: Reals) -> tuple[float, float]:
    """Return which share of residuals (n, 6) successive poses have in common: perhaps, and certainly.

    Noise of the hand moves the camera by a lever, so that the six numbers of a pose are not independent. Differences of
    successive poses, in which what these share vanishes, give the number of independent ones: ``tr(C)**2 / tr(C**2)``
    for their covariance C.
    """
    n, width = rest.shape
    changes = rest[1:] - rest[:-1]
    squares, products = float(np.vdot(rest, rest)), float(np.vdot(rest[1:], rest[:-1]) + rest[-1] @ rest[-2])
    if not squares or n < 3 or not changes.any():
        return 0.0, 0.0
    whole, parts = _squared_traces(changes)
    independent = min(max(whole / max(parts, TINY), 1.0), float(width))
    suspected, certain = (
        coherence(squares, products, int(n * independent), int(2 * independent), each) for each in (SUSPECTED, WRONG)
    )
    return suspected, certain


def _squared_traces(changes: Reals) -> tuple[float, float]:
    """Return estimates of ``tr(C)**2`` and ``tr(C**2)`` for the covariance C of successive differences (m, q).

    For the sum S of products of normal differences, the expected value of ``tr(S)**2`` is ``m**2 tr(C)**2 + 2 k
    tr(C**2)``, and that of ``tr(S**2)`` is ``(m**2 + k) tr(C**2) + k tr(C)**2``. Here k is the sum of squared
    correlations of all pairs of differences: those with a pose in common have -1/2.
    """
    m = len(changes)
    k = m + (m - 1) / 2
    sums = changes.T @ changes
    whole, parts = float(np.trace(sums)) ** 2, float(np.vdot(sums, sums))
    of_squares = (m * m * parts - k * whole) / (m**4 + m * m * k - 2 * k * k)
    return (whole - 2 * k * of_squares) / (m * m), of_squares
