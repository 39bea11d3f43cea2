"""Hand and eye from poses whose noise is unknown: steps to the most likely motors, compiled by numba. Nothing raises.

Arrays are in double precision and C order, with one axis of problems before that of poses.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from .hand_eye_loops import factor, substitute

_DAMPING = 1e-14


@njit(cache=True, error_model="numpy")
def still_points(rest: Any, points: Any) -> None:
    """The point (p, 3) that motions (p, n, 6) of a frame, as small bivectors, move least in all.

    Near the origin where motions say little: as much as if each had a translation for a point as far as the unit.
    """
    moment, normal, slope = np.zeros((3, 3)), np.empty((3, 3)), np.empty(3)
    for p in range(rest.shape[0]):
        normal[:], slope[:] = 0.0, 0.0
        size = 0.0
        for i in range(rest.shape[1]):
            # The moment is as linear in the rotation as in the point.
            moment[0, 1], moment[0, 2], moment[1, 2] = -rest[p, i, 0], -rest[p, i, 1], -rest[p, i, 2]
            moment[1, 0], moment[2, 0], moment[2, 1] = rest[p, i, 0], rest[p, i, 1], rest[p, i, 2]
            for k in range(3):
                size += rest[p, i, 3 + k] ** 2
                for m in range(3):
                    slope[m] -= moment[k, m] * rest[p, i, 3 + k]
                    for j in range(3):
                        normal[m, j] += moment[k, m] * moment[k, j]
        for k in range(3):
            normal[k, k] += 2 * size / (3 * rest.shape[1]) + 1e-30
        factor(normal, 3)
        points[p] = slope
        substitute(normal, 3, points[p])


@njit(cache=True, error_model="numpy")
def likely_steps(
    turns: Any,
    shifts: Any,
    hand: Any,
    seen: Any,
    moving: Any,
    first: bool,
    variances: Any,
    used: Any,
    cost: Any,
    step: Any,
    squares: Any,
) -> bool:
    """The steps (p, 12) of Gauss and Newton to the poses that are most likely, and new variances; if all are done.

    From rows (p, n, 3, 13) as in `newton_steps`, of translations of the camera's origin. Noise turns the hand about
    its origin, which is at `hand` (p, 3), and the camera about what it looks at, at `seen` (p, n, 3), both in the
    frame of the camera; translations have noise of their own. `variances` (p, 3) are of these. Each is multiplied by
    its part of the sum of squares over what is expected of that, with as many unknowns (restricted maximum likelihood);
    what is 0 stays 0. Where `first`, only ratios of variances are taken. `used` (p, 3) become the variances that the
    step is of, and `cost` (p,) the weighed sum of squares, for `grown`. A problem whose sums are not finite has step 0.
    """
    n = turns.shape[1]
    all_done = True
    rows = np.empty((n, 6, 13))
    whitened = rows.reshape(6 * n, 13)
    to_white, centre, arm, direction = np.empty((n, 3, 3)), np.empty(3), np.empty((n, 3)), np.empty(3)
    moment, rest, row = np.zeros((3, 3)), np.empty(6), np.empty(3)
    causes = np.zeros((3, 3, 6))
    table, normal, inverse = np.empty((13, 13)), np.empty((12, 12)), np.empty((12, 12))
    for p in range(turns.shape[0]):
        step[p] = 0.0
        if not (first or moving[p]):
            continue
        squares[p] = 0.0
        for i in range(n):
            for k in range(3):
                squares[p, 0] += turns[p, i, k, 12] ** 2
                squares[p, 1] += shifts[p, i, k, 12] ** 2
        if not moving[p]:
            continue
        of_hand, of_camera, of_shift = variances[p]
        if first:
            by = (squares[p, 0] / (3 * n) + 1e-32) / (of_hand + of_camera)
            of_hand, of_camera = by * of_hand, by * of_camera
        turn = of_hand + of_camera
        total = 0.0
        for i in range(n):
            # Seen from the weighed mean of both origins, rotations and translations have nothing in common.
            for k in range(3):
                arm[i, k] = seen[p, i, k] - hand[p, k]
                centre[k] = hand[p, k] + of_camera / turn * arm[i, k]
            _moment(centre, moment)
            for k in range(3):
                for m in range(13):
                    rows[i, k, m] = turns[p, i, k, m] / np.sqrt(turn)
                    value = shifts[p, i, k, m]
                    for j in range(3):
                        value += moment[k, j] * turns[p, i, j, m]
                    rows[i, 3 + k, m] = value
                total += rows[i, 3 + k, 12] ** 2
        if first:
            of_shift = total / (3 * n) + 1e-32
        least = 1e-6 * (turn + of_shift)
        of_shift = max(of_shift, least)
        for i in range(n):
            length = np.sqrt(arm[i, 0] ** 2 + arm[i, 1] ** 2 + arm[i, 2] ** 2)
            along = 1 / np.sqrt(of_shift)
            across = 1 / np.sqrt(of_shift + of_hand * of_camera / turn * length**2)
            for k in range(3):
                direction[k] = arm[i, k] / max(length, 1e-30)
            for k in range(3):
                for j in range(3):
                    to_white[i, k, j] = (along - across) * direction[k] * direction[j] + (across if k == j else 0.0)
            for m in range(13):
                for k in range(3):
                    row[k] = 0.0
                    for j in range(3):
                        row[k] += to_white[i, k, j] * rows[i, 3 + j, m]
                for k in range(3):
                    rows[i, 3 + k, m] = row[k]
        np.dot(whitened.T, whitened, table)
        trace = 0.0
        for k in range(12):
            trace += table[k, k]
        for k in range(12):
            for m in range(12):
                normal[k, m] = table[k, m]
                inverse[k, m] = 1.0 if k == m else 0.0
            normal[k, k] += _DAMPING * trace + 1e-300
        factor(normal, 12)
        less, everything = 0.0, 0.0
        for k in range(12):
            substitute(normal, 12, inverse[k])
            for m in range(12):
                step[p, k] -= inverse[k, m] * table[m, 12]
            less -= step[p, k] * table[k, 12]
            everything += step[p, k] - step[p, k]
        if everything != 0.0:
            step[p] = 0.0
            moving[p] = False
            continue
        cost[p] = table[12, 12]
        used[p, 0], used[p, 1], used[p, 2] = of_hand, of_camera, of_shift
        spread = np.dot(np.ascontiguousarray(whitened[:, :12]), inverse)
        found, expected = np.zeros(3), np.zeros(3)
        for i in range(n):
            for k in range(6):
                rest[k] = rows[i, k, 12]
                for m in range(12):
                    rest[k] += rows[i, k, m] * step[p, m]
            # What a rotation of the hand, of the camera, and a translation make of the six numbers.
            for cause in range(2):
                by = of_camera / turn if cause == 0 else -of_hand / turn
                for k in range(3):
                    direction[k] = by * arm[i, k]
                _moment(direction, moment)
                for k in range(3):
                    for j in range(3):
                        causes[cause, j, k] = 1 / np.sqrt(turn) if k == j else 0.0
                        value = 0.0
                        for m in range(3):
                            value += to_white[i, k, m] * moment[m, j]
                        causes[cause, j, 3 + k] = value
                        causes[2, j, 3 + k] = to_white[i, k, j]
            for cause in range(3):
                for j in range(3):
                    value, size = 0.0, 0.0
                    for k in range(6):
                        value += causes[cause, j, k] * rest[k]
                        size += causes[cause, j, k] ** 2
                    found[cause] += value**2
                    for m in range(12):
                        left, right = 0.0, 0.0
                        for k in range(6):
                            left += causes[cause, j, k] * spread[6 * i + k, m]
                            right += causes[cause, j, k] * rows[i, k, m]
                        size -= left * right
                    expected[cause] += size
        for k, variance in enumerate((of_hand, of_camera, of_shift)):
            # What is left free of unknowns is rounding for a few poses that others do not check.
            variances[p, k] = variance * found[k] / expected[k] if expected[k] > 1e-9 else variance
        least = 1e-6 * (variances[p, 0] + variances[p, 1] + variances[p, 2]) + 1e-32
        variances[p, 2] = max(variances[p, 2], least)
        if variances[p, 0] + variances[p, 1] < least:
            by = least / (of_hand + of_camera)
            variances[p, 0], variances[p, 1] = by * of_hand, by * of_camera
        change = abs(np.log(variances[p, 2] / of_shift))
        change = max(change, abs(np.log((variances[p, 0] + variances[p, 1]) / turn)))
        moving[p] = not (less <= 1e-3 and change < 0.1 and not first)
        all_done = all_done and not moving[p]
    return all_done


@njit(cache=True, error_model="numpy")
def grown(turns: Any, shifts: Any, hand: Any, seen: Any, used: Any, cost: Any, moving: Any, worse: Any) -> bool:
    """Whether a step of `likely_steps` made the sum of squares, weighed as there, more: `worse` (p,); if any did.

    From rows after the step, and what else that had. Problems that are worse stop.
    """
    moment, centre, arm, shift = np.zeros((3, 3)), np.empty(3), np.empty(3), np.empty(3)
    any_worse = False
    for p in range(turns.shape[0]):
        worse[p] = False
        if not moving[p]:
            continue
        of_hand, of_camera, of_shift = used[p]
        turn = of_hand + of_camera
        total = 0.0
        for i in range(turns.shape[1]):
            square, along, length = 0.0, 0.0, 0.0
            for k in range(3):
                arm[k] = seen[p, i, k] - hand[p, k]
                centre[k] = hand[p, k] + of_camera / turn * arm[k]
                total += turns[p, i, k, 12] ** 2 / turn
            _moment(centre, moment)
            for k in range(3):
                shift[k] = shifts[p, i, k, 12]
                for j in range(3):
                    shift[k] += moment[k, j] * turns[p, i, j, 12]
                square += shift[k] ** 2
                along += shift[k] * arm[k]
                length += arm[k] ** 2
            along = along**2 / max(length, 1e-60)
            total += along / of_shift + (square - along) / (of_shift + of_hand * of_camera / turn * length)
        if not total <= cost[p]:
            worse[p], moving[p], any_worse = True, False, True
    return any_worse


@njit(cache=True, error_model="numpy")
def _moment(point: Any, moment: Any) -> None:
    """The matrix that takes a rotation about the origin, e12 e13 e23, to the translation e01 e02 e03 at a point."""
    moment[0, 0], moment[0, 1] = -point[1], -point[2]
    moment[1, 0], moment[1, 2] = point[0], -point[2]
    moment[2, 1], moment[2, 2] = point[0], point[1]
