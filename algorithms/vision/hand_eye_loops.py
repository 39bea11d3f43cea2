"""The sums over motions of `hand_eye`, compiled by numba: one problem after the other. Nothing here raises.

Arrays are in double precision and C order, with one axis of problems before that of motions.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from generated import hand_eye as kernels
from generated import pga3

_misfit_equations, _exponential, _product = (
    kernels.misfit_equations.jit,
    pga3.motor_exponential.jit,
    pga3.motor_product.jit,
)
_DAMPING = 1e-14


@njit(cache=True, error_model="numpy")
def not_unit(one: Any, two: Any, rounding: float) -> int:
    """The place, among all of `one` and then of `two` (p, n, 8), of the first motor finite and not of norm 1, or -1.

    Translations are judged by the largest of the problem in both: what is below `rounding` may be that of others.
    """
    n: int = one.shape[1]
    for side in range(2):
        for p in range(one.shape[0]):
            largest = 0.0
            for i in range(n):
                for k in range(4, 8):
                    for size in (abs(one[p, i, k]), abs(two[p, i, k])):
                        if size < np.inf:
                            largest = max(largest, size)
            for i in range(n):
                a = one[p, i] if side == 0 else two[p, i]
                square, far = 0.0, 0.0
                for k in range(4):
                    square += a[k] * a[k]
                    far += a[4 + k] * a[4 + k]
                pseudoscalar = a[0] * a[7] - a[1] * a[6] + a[2] * a[5] - a[3] * a[4]
                off = abs(square - 1) > 1e-3 or abs(pseudoscalar) > 1e-3 * largest + rounding
                if off and far < np.inf and square < np.inf:
                    found: int = (side * one.shape[0] + p) * n + i
                    return found
    return -1


@njit(cache=True, error_model="numpy")
def same_motions(last: Any, motions: Any, bound: float, same: Any) -> bool:
    """Whether the last of motions (p, n, 8) are those (p, m, 8), up to sign; `same` (p,) stays where so; if any does.

    Rotations to within the bound, translations to within that part of the largest of the problem.
    """
    before = motions.shape[1] - last.shape[1]
    any_same = False
    for p in range(motions.shape[0]):
        far, turned, shifted = 0.0, 0.0, 0.0
        for i in range(motions.shape[1]):
            for k in range(4, 8):
                far = max(far, abs(motions[p, i, k]))
        for i in range(last.shape[1]):
            product = 0.0
            for k in range(4):
                product += last[p, i, k] * motions[p, before + i, k]
            sign = -1.0 if product < 0 else 1.0
            for k in range(8):
                off = abs(sign * last[p, i, k] - motions[p, before + i, k])
                # A number that is not finite is off too.
                if k < 4 and not off <= turned:
                    turned = off if off < np.inf else np.inf
                if k >= 4 and not off <= shifted:
                    shifted = off if off < np.inf else np.inf
        same[p] = same[p] and turned <= bound and shifted <= bound * far and far < np.inf
        any_same = any_same or same[p]
    return any_same


@njit(cache=True, error_model="numpy")
def do_not_turn(one: Any, two: Any, rounding: float, still: Any) -> None:
    """Whether no motion (p, n, 8) of either side turns by more than rounding, in radians: `still` (p,).

    Nothing is solved for this, so that what rounding leaves of the axes of such motions decides nothing.
    """
    for p in range(one.shape[0]):
        still[p] = True
        for i in range(one.shape[1]):
            for motions in (one, two):
                square = 0.0
                for k in range(1, 4):
                    square += motions[p, i, k] ** 2
                # A number that is not finite turns.
                still[p] = still[p] and 4 * square <= rounding**2


@njit(cache=True, error_model="numpy")
def in_own_lengths(
    a: Any, b: Any, half_turn: float, same_axis: float, clear: Any, unit: Any, finite: Any, spread: Any, parallel: Any
) -> tuple[bool, bool]:
    """Motors, in place, in the unit of length in which coefficients with e0 have size 1, and b with the sign of a.

    ``A X = X B`` leaves the scalar and the pseudoscalar part alone; `clear` says which motions have these. A problem
    with a number that is not finite becomes that of no motion. `spread` (p,) is the sum of squares of what sines of
    half the angles, along their axes, leave across the direction that they have in common; `parallel` (p,) says where
    this is no more than the part `same_axis` squared of all of them, or no motion of `a` turns by more than that.
    Returns whether all motions are clear, and all problems finite.
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
            same = a[p, i, 0] * b[p, i, 0] + a[p, i, 7] * b[p, i, 7] / unit[p] ** 2
            sign = 1.0 if same >= 0 else -1.0
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
        total = moments[0, 0] + moments[1, 1] + moments[2, 2]
        spread[p] = total - _largest(moments)
        parallel[p] = 4 * total <= n * same_axis**2 or spread[p] <= same_axis**2 * total
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
    parallel too where the sixth value is no more than the bound times the first. Then more than two vectors are
    singular, and any of them may be the last; instead `first` is the one of `_least_translated`, and `second` is 0.
    """
    table, across, right = np.empty((8, 8)), np.empty((4, 4)), np.empty((4, 4))
    for p in range(equations.shape[0]):
        for i in range(equations.shape[1]):
            if not used[p, i]:
                equations[p, i] = 0.0
        rows = equations[p].reshape(-1, 8)
        np.dot(rows.T, rows, table)
        squares, vectors = np.linalg.eigh(table)
        for k in range(8):
            values[p, k] = np.sqrt(max(squares[7 - k], 0.0))
            first[p, k], second[p, k] = vectors[k, 0], vectors[k, 1]
        parallel[p] = parallel[p] or values[p, 5] <= bound * values[p, 0]
        if parallel[p]:
            _least_translated(table, across, right, first[p])
            second[p] = 0.0


@njit(cache=True, error_model="numpy")
def _least_translated(table: Any, across: Any, right: Any, vector: Any) -> None:
    """The `vector` (8,) with a unit rotational part that leaves the least squares, of products `table` (8, 8).

    Of those that leave the same, one with a small translational part: damping makes it the only one. `across` and
    `right` (4, 4) are room.
    """
    trace = 0.0
    for k in range(8):
        trace += table[k, k]
    for j in range(4):
        for k in range(4):
            across[j, k] = table[4 + j, 4 + k]
            right[j, k] = table[j, 4 + k]
        across[j, j] += _DAMPING * trace + 1e-300
    factor(across, 4)
    for j in range(4):
        substitute(across, 4, right[j])
    for j in range(4):
        for k in range(4):
            across[j, k] = table[j, k]
            for m in range(4):
                across[j, k] -= table[j, 4 + m] * right[k, m]
    _, vectors = np.linalg.eigh(across)
    for k in range(4):
        vector[k] = vectors[k, 0]
        vector[4 + k] = 0.0
        for j in range(4):
            vector[4 + k] -= right[j, k] * vectors[j, 0]


@njit(cache=True, error_model="numpy")
def choose_signs(one: Any, two: Any, motor: Any, clear: Any) -> None:
    """Motions `two` that are not clear with the sign, in place, that a motor has for all of a problem."""
    left, right = np.empty(8), np.empty(8)
    for p in range(len(one)):
        for i in range(one.shape[1]):
            if not clear[p, i]:
                _product(one[p, i], motor[p], left)
                _product(motor[p], two[p, i], right)
                if np.sum(left[:4] * right[:4]) < 0:
                    two[p, i] = -two[p, i]


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
def descend(one: Any, two: Any, motor: Any, most: int, limits: Any, spread: Any, parallel: Any, squares: Any) -> bool:
    """Motors (p, 8) after steps of Gauss and Newton, in place, and sums of squares (p, 2) of both parts that are left.

    Of motions (p, n, 8). At most so many steps; the limits are those of `_newton_step`. Returns whether any axes are
    parallel.
    """
    n, any_parallel = one.shape[1], False
    turns, shifts, table = np.empty((n, 3, 7)), np.empty((n, 3, 7)), np.empty((2, 7, 7))
    step, turn, moved = np.empty(6), np.empty(8), np.empty(8)
    for p in range(len(one)):
        moving = True
        for k in range(most + 1):
            for i in range(n):
                _misfit_equations(one[p, i], two[p, i], motor[p], turns[i], shifts[i])
            moving = _newton_step(
                turns, shifts, k == 0, most > 0, limits, spread[p], parallel[p:], table, step, squares[p]
            )
            if parallel[p] or k == most:
                break
            _exponential(step, turn)
            _product(motor[p], turn, moved)
            motor[p] = moved
            if not moving:
                break
        any_parallel = any_parallel or parallel[p]
    return any_parallel


@njit(cache=True, error_model="numpy")
def _newton_step(
    turns: Any,
    shifts: Any,
    first: bool,
    moving: bool,
    limits: Any,
    spread: float,
    parallel: Any,
    table: Any,
    step: Any,
    squares: Any,
) -> bool:
    """The step (6,) of Gauss and Newton, and the sums of squares (2,) of both parts; whether more steps are to come.

    From rows (n, 3, 7) of derivatives with the misfit behind them. `table` (2, 7, 7) is room. Parts are weighed by
    their own sums of squares, within bounds, where there are more than two motions. It is the last step where less than
    the first limit of the sum would go, or it is below the second. `first`, axes are found to be parallel, and then
    there is no step, where the misfit leaves a rotation about them open by more than the third limit: that in radians
    is the misfit over the root of the spread; or where the spread is less than three times that of noise.
    """
    n, size = len(turns), turns.shape[2] - 1
    for part in range(2):
        rows = (turns if part == 0 else shifts).reshape(-1, size + 1)
        np.dot(rows.T, rows, table[part])
        squares[part] = table[part, size, size]
    if first:
        least = max(1 / limits[2] ** 2, 6.0 * n)
        parallel[0] = parallel[0] or squares[0] * least > (3 * n - 3) * spread
    if parallel[0] or not moving:
        return False
    weight = 1.0
    if n > 2:
        floor = 1e-4 * (squares[0] + squares[1]) + 1e-300
        weight = max(squares[0], floor) / max(squares[1], floor)
    normal = table[0]
    trace = 0.0
    for k in range(size + 1):
        for m in range(k + 1):
            normal[k, m] += weight * table[1, k, m]
        if k < size:
            trace += normal[k, k]
    cost = normal[size, size]
    for k in range(size):
        normal[k, k] += _DAMPING * trace + 1e-300
    factor(normal, size)
    for k in range(size):
        step[k] = -normal[size, k]
    substitute(normal, size, step)
    less = 0.0
    for k in range(size):
        less -= step[k] * normal[size, k]
    return not (less <= limits[0] * cost or cost <= limits[1])


@njit(cache=True, error_model="numpy")
def factor(matrix: Any, size: int) -> None:
    """L D L' of a symmetric matrix, in place below the diagonal and on it; not finite where it is singular."""
    for j in range(size):
        for k in range(j):
            matrix[j, j] -= matrix[j, k] * matrix[j, k] * matrix[k, k]
        for i in range(j + 1, size):
            for k in range(j):
                matrix[i, j] -= matrix[i, k] * matrix[j, k] * matrix[k, k]
            matrix[i, j] /= matrix[j, j]


@njit(cache=True, error_model="numpy")
def substitute(factors: Any, size: int, right: Any) -> None:
    """``matrix^-1 right``, in place, from what `factor` leaves."""
    for i in range(size):
        for k in range(i):
            right[i] -= factors[i, k] * right[k]
    for i in range(size):
        right[i] /= factors[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            right[i] -= factors[k, i] * right[k]


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
def root_mean_squares(squares: Any, count: int, unit: Any, finite: Any) -> Any:
    """Of rotations and translations (p, 2), in the caller's unit of length, from sums over half of them; or NaN."""
    found = np.empty_like(squares)
    for p in range(len(squares)):
        for k in range(2):
            found[p, k] = 2 * np.sqrt(squares[p, k] / count) if finite[p] else np.nan
        found[p, 1] *= unit[p]
    return found
