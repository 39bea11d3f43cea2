"""The sums over motions of `hand_eye`, compiled by numba: one problem after the other. Nothing here raises.

Arrays are in double precision and C order, with one axis of problems before that of motions.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

_DAMPING = 1e-14


@njit(cache=True, error_model="numpy")
def in_own_lengths(a: Any, b: Any, half_turn: float, clear: Any, unit: Any, finite: Any) -> None:
    """Motors, in place, in the unit of length in which coefficients with e0 have size 1, and b with the sign of a.

    ``A X = X B`` leaves the scalar and the pseudoscalar part alone; `clear` says which motions have these. A problem
    with a number that is not finite becomes that of no motion.
    """
    n = a.shape[1]
    for p in range(a.shape[0]):
        square, everything = 0.0, 0.0
        for i in range(n):
            for k in range(8):
                everything += a[p, i, k] - a[p, i, k] + b[p, i, k] - b[p, i, k]
                if k >= 4:
                    square += a[p, i, k] * a[p, i, k] + b[p, i, k] * b[p, i, k]
        finite[p] = everything == 0.0
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
            clear[p, i] = abs(a[p, i, 0]) >= half_turn


@njit(cache=True, error_model="numpy")
def null_space(equations: Any, used: Any, first: Any, second: Any, values: Any) -> None:
    """The last two of the singular vectors of equations (p, n, 8, 8), (p, 8) each, and all singular values, descending.

    From sums of products over all motions that are used.
    """
    total = np.empty((8, 8))
    for p in range(equations.shape[0]):
        total[:] = 0.0
        for i in range(equations.shape[1]):
            if used[p, i]:
                for row in range(8):
                    for k in range(8):
                        value = equations[p, i, row, k]
                        if value != 0.0:  # A quarter of them are.
                            for m in range(k + 1):
                                total[k, m] += value * equations[p, i, row, m]
        squares, vectors = np.linalg.eigh(total)
        for k in range(8):
            values[p, k] = np.sqrt(max(squares[7 - k], 0.0))
            first[p, k], second[p, k] = vectors[k, 0], vectors[k, 1]


@njit(cache=True, error_model="numpy")
def newton_steps(
    turns: Any, shifts: Any, moving: Any, first: bool, weigh: bool, limits: Any, table: Any, step: Any, squares: Any
) -> bool:
    """The step (p, k) of Gauss and Newton of each problem, the sums of squares (p, 2) of both parts; if all are done.

    From rows (p, n, 3, k + 1) of derivatives with the misfit behind them. `table` (2, k + 1, k + 1) is room. Parts are
    weighed by their own sums of squares, within bounds. Problems not `moving` have step 0; those that are done stop.
    Done is where less than the first limit of the sum would go, or it is below the second.
    """
    size = turns.shape[3] - 1
    all_done = True
    for p in range(turns.shape[0]):
        step[p] = 0.0
        if not (first or moving[p]):
            continue
        for part in range(2):
            rows = turns if part == 0 else shifts
            total = table[part]
            total[:] = 0.0
            for i in range(rows.shape[1]):
                for row in range(3):
                    for k in range(size + 1):
                        value = rows[p, i, row, k]
                        if value != 0.0:  # Rotations do not depend on translations.
                            for m in range(k + 1):
                                total[k, m] += value * rows[p, i, row, m]
            squares[p, part] = total[size, size]
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
