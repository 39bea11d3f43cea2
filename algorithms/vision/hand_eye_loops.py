"""The sums over motions of `hand_eye`, compiled by numba: one problem after the other. Nothing here raises.

Arrays are in double precision and C order, with one axis of problems before that of motions.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

_DAMPING = 1e-14


@njit(cache=True, error_model="numpy")
def not_unit(motors: Any) -> int:
    """The place of the first of motors (m, 8) that is finite and not of norm 1, or -1.

    Translations are judged by the largest of all: those of rotations may be rounding.
    """
    largest = 0.0
    for i in range(motors.shape[0]):
        for k in range(4, 8):
            if abs(motors[i, k]) < np.inf:
                largest = max(largest, abs(motors[i, k]))
    for i in range(motors.shape[0]):
        a = motors[i]
        square, far = 0.0, 0.0
        for k in range(4):
            square += a[k] * a[k]
            far += a[4 + k] * a[4 + k]
        pseudoscalar = a[0] * a[7] - a[1] * a[6] + a[2] * a[5] - a[3] * a[4]
        off = abs(square - 1) > 1e-3 or abs(pseudoscalar) > 1e-3 * largest + 1e-6
        if off and far < np.inf and square < np.inf:
            return i
    return -1


@njit(cache=True, error_model="numpy")
def in_own_lengths(
    a: Any, b: Any, half_turn: float, clear: Any, unit: Any, finite: Any, spread: Any
) -> tuple[bool, bool]:
    """Motors, in place, in the unit of length in which coefficients with e0 have size 1, and b with the sign of a.

    ``A X = X B`` leaves the scalar and the pseudoscalar part alone; `clear` says which motions have these. A problem
    with a number that is not finite becomes that of no motion. `spread` (p,) is the sum of squares of what sines of
    half the angles, along their axes, leave across the direction that they have in common. Returns whether all motions
    are clear, and all problems finite.
    """
    n = a.shape[1]
    all_clear, all_finite = True, True
    moments = np.empty((3, 3))
    for p in range(a.shape[0]):
        square, everything = 0.0, 0.0
        for i in range(n):
            for k in range(8):
                everything += a[p, i, k] - a[p, i, k] + b[p, i, k] - b[p, i, k]
                if k >= 4:
                    square += a[p, i, k] * a[p, i, k] + b[p, i, k] * b[p, i, k]
        finite[p] = everything == 0.0
        all_finite = all_finite and finite[p]
        if not finite[p]:
            a[p] = 0.0
            b[p] = 0.0
            a[p, :, 0] = 1.0
            b[p, :, 0] = 1.0
            square = 0.0
        unit[p] = np.sqrt(square / (4 * n)) if square > 0 else 1.0
        for i in range(n):
            sign = 1.0 if a[p, i, 0] * b[p, i, 0] + a[p, i, 7] * b[p, i, 7] >= 0 else -1.0
            for k in range(8):
                by = 1.0 if k < 4 else 1.0 / unit[p]
                a[p, i, k] *= by
                b[p, i, k] *= sign * by
        # Noise may turn signs next to half turns: those are left to the other motions where these are enough.
        far = 0
        for i in range(n):
            far += abs(a[p, i, 0]) >= 5 * half_turn
        least = 5 * half_turn if far >= max(3, n // 2) else half_turn
        for i in range(n):
            clear[p, i] = abs(a[p, i, 0]) >= least
            all_clear = all_clear and clear[p, i]
        for j in range(3):
            for k in range(3):
                moments[j, k] = 0.0
                for i in range(n):
                    moments[j, k] += a[p, i, 1 + j] * a[p, i, 1 + k]
        spread[p] = moments[0, 0] + moments[1, 1] + moments[2, 2] - _largest(moments)
    return all_clear, all_finite


@njit(cache=True, error_model="numpy")
def _largest(table: Any) -> Any:
    """The largest eigenvalue of a symmetric 3 x 3 matrix, by the cosines of its cubic."""
    mean = (table[0, 0] + table[1, 1] + table[2, 2]) / 3
    a, b, c = table[0, 0] - mean, table[1, 1] - mean, table[2, 2] - mean
    d, e, f = table[0, 1], table[0, 2], table[1, 2]
    size = np.sqrt((a * a + b * b + c * c + 2 * (d * d + e * e + f * f)) / 6)
    if size == 0.0:
        return mean
    half = (a * (b * c - f * f) - d * (d * c - e * f) + e * (d * f - b * e)) / (2 * size**3)
    return mean + 2 * size * np.cos(np.arccos(min(max(half, -1.0), 1.0)) / 3)


@njit(cache=True, error_model="numpy")
def null_space(equations: Any, used: Any, bound: float, first: Any, second: Any, values: Any, parallel: Any) -> None:
    """The last two of the singular vectors of equations (p, n, 8, 8), (p, 8) each, and all singular values, descending.

    From sums of products over all motions that are used; the equations of others are overwritten by zeros. Axes are
    parallel where the sixth value is no more than the bound times the first.
    """
    for p in range(equations.shape[0]):
        for i in range(equations.shape[1]):
            if not used[p, i]:
                equations[p, i] = 0.0
        rows = equations[p].reshape(-1, 8)
        squares, vectors = np.linalg.eigh(np.dot(rows.T, rows))
        for k in range(8):
            values[p, k] = np.sqrt(max(squares[7 - k], 0.0))
            first[p, k], second[p, k] = vectors[k, 0], vectors[k, 1]
        parallel[p] = values[p, 5] <= bound * values[p, 0]


@njit(cache=True, error_model="numpy")
def less_before(after: Any, before: Any, less: Any) -> bool:
    """Whether bivectors (p, n, 6) of small motions translate less before than after; if any do."""
    any_less = False
    for p in range(len(less)):
        here, there = 0.0, 0.0
        for i in range(after.shape[1]):
            for k in range(3, 6):
                here += after[p, i, k] ** 2
                there += before[p, i, k] ** 2
        less[p] = there < here
        any_less = any_less or less[p]
    return any_less


@njit(cache=True, error_model="numpy")
def newton_steps(
    turns: Any,
    shifts: Any,
    moving: Any,
    first: bool,
    limits: Any,
    spread: Any,
    parallel: Any,
    table: Any,
    step: Any,
    squares: Any,
) -> bool:
    """The step (p, k) of Gauss and Newton of each problem, the sums of squares (p, 2) of both parts; if all are done.

    From rows (p, n, 3, k + 1) of derivatives with the misfit behind them. `table` (2, k + 1, k + 1) is room. Parts are
    weighed by their own sums of squares, within bounds, where there are more than two motions. Problems not `moving`
    have step 0; those that are done stop. Done is where less than the first limit of the sum would go, or it is below
    the second. `first`, axes are found to be parallel, which stops them too, where the misfit leaves a rotation about
    them open by more than the third limit: that in radians is the misfit over the root of the spread; or where the
    spread is less than three times that of noise.
    """
    size = turns.shape[3] - 1
    weigh = turns.shape[1] > 2
    all_done = True
    for p in range(turns.shape[0]):
        step[p] = 0.0
        if not (first or moving[p]):
            continue
        for part in range(2):
            rows = (turns if part == 0 else shifts)[p].reshape(-1, size + 1)
            np.dot(rows.T, rows, table[part])
            squares[p, part] = table[part, size, size]
        if first:
            freedom = 3 * turns.shape[1] - 3
            least = max(1 / limits[2] ** 2, 6.0 * turns.shape[1])
            parallel[p] = parallel[p] or squares[p, 0] * least > freedom * spread[p]
            moving[p] = moving[p] and not parallel[p]
        if not moving[p]:
            continue
        weight = 1.0
        if weigh:
            floor = 1e-4 * (squares[p, 0] + squares[p, 1]) + 1e-300
            weight = max(squares[p, 0], floor) / max(squares[p, 1], floor)
        normal = table[0]
        trace = 0.0
        for k in range(size + 1):
            for m in range(k + 1):
                normal[k, m] += weight * table[1][k, m]
            if k < size:
                trace += normal[k, k]
        cost = normal[size, size]
        for k in range(size):
            normal[k, k] += _DAMPING * trace + 1e-300
        _solve(normal, size, step[p])
        less = 0.0
        for k in range(size):
            less -= step[p, k] * normal[size, k]
        moving[p] = not (less <= limits[0] * cost or cost <= limits[1])
        all_done = all_done and not moving[p]
    return all_done


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
        points[p] = np.linalg.solve(normal, slope)


@njit(cache=True, error_model="numpy")
def _solve(normal: Any, size: int, step: Any) -> None:
    """``step = - matrix^-1 slope`` by L D L', in place below the diagonal; the slope is the row behind the matrix."""
    for j in range(size):
        for k in range(j):
            normal[j, j] -= normal[j, k] * normal[j, k] * normal[k, k]
        for i in range(j + 1, size):
            for k in range(j):
                normal[i, j] -= normal[i, k] * normal[j, k] * normal[k, k]
            normal[i, j] /= normal[j, j]
    for i in range(size):
        step[i] = -normal[size, i]
        for k in range(i):
            step[i] -= normal[i, k] * step[k]
    for i in range(size):
        step[i] /= normal[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            step[i] -= normal[k, i] * step[k]


@njit(cache=True, error_model="numpy")
def back_in_lengths(motor: Any, unit: Any, finite: Any) -> None:
    """Motors, in place, in the caller's unit of length and with scalar part not negative; NaN for those not finite."""
    for p in range(motor.shape[0]):
        sign = 1.0 if motor[p, 0] >= 0 else -1.0
        for k in range(8):
            motor[p, k] *= sign * (1.0 if k < 4 else unit[p])
        if not finite[p]:
            motor[p] = np.nan


@njit(cache=True, error_model="numpy")
def likely_steps(
    turns: Any, shifts: Any, hand: Any, seen: Any, moving: Any, first: bool, variances: Any, step: Any, squares: Any
) -> bool:
    """The steps (p, 12) of Gauss and Newton to the poses that are most likely, and new variances; if all are done.

    From rows (p, n, 3, 13) as in `newton_steps`, of translations of the camera's origin. Noise turns the hand about
    its origin, which is at `hand` (p, 3), and the camera about what it looks at, at `seen` (p, n, 3), both in the
    frame of the camera; translations have noise of their own. `variances` (p, 3) are of these. Each is multiplied by
    its part of the sum of squares over what is expected of that, with as many unknowns (restricted maximum likelihood);
    what is 0 stays 0. Where `first`, only ratios of variances are taken.
    """
    n = turns.shape[1]
    all_done = True
    rows = np.empty((n, 6, 13))
    whitened = rows.reshape(6 * n, 13)
    to_white, centre, arm, direction = np.empty((n, 3, 3)), np.empty(3), np.empty((n, 3)), np.empty(3)
    moment, rest, row = np.zeros((3, 3)), np.empty(6), np.empty(3)
    causes = np.zeros((3, 3, 6))
    table = np.empty((13, 13))
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
        normal = table[:12, :12].copy()
        for k in range(12):
            normal[k, k] *= 1 + _DAMPING
            normal[k, k] += 1e-300
        inverse = np.linalg.inv(normal)
        less = 0.0
        for k in range(12):
            for m in range(12):
                step[p, k] -= inverse[k, m] * table[m, 12]
            less -= step[p, k] * table[k, 12]
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
        variances[p, 0] = of_hand * found[0] / expected[0]
        variances[p, 1] = of_camera * found[1] / expected[1]
        variances[p, 2] = of_shift * found[2] / expected[2]
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
def _moment(point: Any, moment: Any) -> None:
    """The matrix that takes a rotation about the origin, e12 e13 e23, to the translation e01 e02 e03 at a point."""
    moment[0, 0], moment[0, 1] = -point[1], -point[2]
    moment[1, 0], moment[1, 2] = point[0], -point[2]
    moment[2, 1], moment[2, 2] = point[0], point[1]


@njit(cache=True, error_model="numpy")
def root_mean_squares(squares: Any, count: int, unit: Any, finite: Any) -> Any:
    """Of rotations and translations (p, 2), in the caller's unit of length, from sums over half of them; or NaN."""
    found = np.empty_like(squares)
    for p in range(len(squares)):
        for k in range(2):
            found[p, k] = 2 * np.sqrt(squares[p, k] / count) if finite[p] else np.nan
        found[p, 1] *= unit[p]
    return found
