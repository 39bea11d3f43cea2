"""Factorization, join and meet of blades, element by element, compiled by numba on first use.

These functions are not generated kernels because their control flow depends on the data (the largest coefficient
selects the relations, pivots select the next row and decide the rank), and loop kernels support neither nested loops
over lengths nor branches. Arrays are validated by the callers; nothing here raises errors.

Vectors are rows. `k`, `a`, `b` are numbers of rows, `n` is their length, `e` is the index of an element of the batch.
Whole arrays are passed together with the index, because a view of an element would cost as much as a short loop.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from ..precision import ROUNDING, TINY

_COMPILED = {"cache": True, "error_model": "numpy", "fastmath": {"reassoc", "contract", "nsz"}}
"""Sums may be reordered; infinities and NaNs are respected."""
_INLINED = {**_COMPILED, "inline": "always"}
"""For functions called for every element: passing an array, as seven numbers, would cost as much as a short loop.
They call no function that is not inlined: that would cost 30 ns per element."""
REORTHOGONALIZE = 0.5
"""Below this length a projected unit vector is projected again ("twice is enough", Kahan in Parlett 1980, §6.9)."""


@njit(**_INLINED)
def find_pivot(coefficients: Any, e: int) -> int:
    """Return the index of the first coefficient with the largest absolute value, -1 if all are below 10^-308."""
    best, pivot = 0.0, 0
    for p in range(coefficients.shape[1]):
        size = abs(coefficients[e, p])
        if size > best:
            best, pivot = size, p
    return -1 if best < 2.3e-308 else pivot


@njit(**_INLINED)
def gather_factors(coefficients: Any, e: int, pivot: int, place: Any, sign: Any, factors: Any) -> None:
    """Compute rows whose outer product, times the coefficient at the pivot, is the blade."""
    reciprocal = 1.0 / coefficients[e, pivot]
    for i in range(place.shape[1]):
        for j in range(place.shape[2]):
            factors[e, i, j] = sign[pivot, i, j] * (coefficients[e, place[pivot, i, j]] * reciprocal)


@njit(**_INLINED)
def blade_defect(coefficients: Any, e: int, pivot: int, table: Any) -> float:
    """Return the residual of the relations of a `BladeTable`, relative to the norm of the coefficients."""
    pivots, target, first, left, right, sign = table
    reciprocal = 1.0 / coefficients[e, pivot]
    # in units of the largest coefficient, so that squares neither overflow nor vanish
    squares, difference = 0.0, 0.0
    for p in range(coefficients.shape[1]):
        squares += (coefficients[e, p] * reciprocal) ** 2
    for relation in range(pivots[pivot], pivots[pivot + 1]):
        total = coefficients[e, target[relation]] * reciprocal
        for term in range(first[relation], first[relation + 1]):
            one, two = coefficients[e, left[term]] * reciprocal, coefficients[e, right[term]] * reciprocal
            total -= sign[term] * one * two
        difference += total * total
    return np.sqrt(difference / squares)  # type: ignore[no-any-return]


@njit(**_INLINED)
def _dot(one: Any, e: int, i: int, two: Any, f: int, h: int) -> float:
    total = 0.0
    for j in range(one.shape[2]):
        total += one[e, i, j] * two[f, h, j]
    return total


@njit(**_INLINED)
def _subtract(rows: Any, e: int, i: int, amount: float, others: Any, f: int, h: int) -> None:
    for j in range(rows.shape[2]):
        rows[e, i, j] -= amount * others[f, h, j]


@njit(**_INLINED)
def _project_out(rows: Any, f: int, i: int, basis: Any, e: int, k: int) -> None:
    for h in range(k):
        _subtract(rows, f, i, _dot(basis, e, h, rows, f, i), basis, e, h)


@njit(**_INLINED)
def orthonormalize(rows: Any, e: int, k: int) -> float:
    """Orthonormalize rows in place and return the ratio of the old to the new outer product."""
    determinant = 1.0
    for i in range(k):
        before = _dot(rows, e, i, rows, e, i)
        length = before
        for attempt in range(2):
            _project_out(rows, e, i, rows, e, i)
            length = _dot(rows, e, i, rows, e, i)
            if attempt == 0 and length > REORTHOGONALIZE * REORTHOGONALIZE * before:
                break
        length = np.sqrt(length)
        determinant *= length
        if length > 0.0:
            reciprocal = 1.0 / length
            for j in range(rows.shape[2]):
                rows[e, i, j] *= reciprocal
    return determinant


@njit(**_COMPILED)
def factor_batch(
    coefficients: Any, place: Any, sign: Any, orthonormal: bool, relations: Any, factors: Any, scale: Any, error: Any
) -> None:
    """Compute factors and scale of each blade (scale 0 if it is zero), and `blade_defect` for the given relations."""
    for e in range(len(coefficients)):
        pivot = find_pivot(coefficients, e)
        if pivot < 0:
            scale[e] = 0.0
            continue
        gather_factors(coefficients, e, pivot, place, sign, factors)
        scale[e] = coefficients[e, pivot]
        if orthonormal:
            scale[e] *= orthonormalize(factors, e, place.shape[1])
        if len(relations[1]):
            error[e] = blade_defect(coefficients, e, pivot, relations)


@njit(**_COMPILED)
def _swap(rows: Any, i: int, h: int) -> None:
    for j in range(rows.shape[2]):
        rows[0, i, j], rows[0, h, j] = rows[0, h, j], rows[0, i, j]


@njit(**_INLINED)
def _longest(work: Any, first: int) -> tuple[int, float, float]:
    """Return which row from `first` on is the longest, its squared length, and the sum of all squared lengths."""
    longest, at, total = -1.0, first, 0.0
    for i in range(first, work.shape[1]):
        square = _dot(work, 0, i, work, 0, i)
        total += square
        if square > longest:
            longest, at = square, i
    return at, longest, total


@njit(**_COMPILED)
def _jacobi(work: Any, other: Any, b: int) -> float:
    """Rotate rows of both arrays until those of `work` are orthogonal, sort them by length, and return the determinant.

    The method is one-sided Jacobi (Hestenes 1958). The lengths of rows are the singular values, and small ones have
    high relative accuracy.
    """
    n = work.shape[2]
    for _ in range(40):
        rotated = False
        for i in range(b):
            for h in range(i + 1, b):
                alpha, beta = _dot(work, 0, i, work, 0, i), _dot(work, 0, h, work, 0, h)
                gamma = _dot(work, 0, i, work, 0, h)
                if abs(gamma) <= 1e-15 * np.sqrt(alpha * beta) or abs(gamma) < TINY:
                    continue
                rotated = True
                zeta = (beta - alpha) / (2.0 * gamma)
                t = (1.0 if zeta >= 0 else -1.0) / (abs(zeta) + np.sqrt(1.0 + zeta * zeta))
                c = 1.0 / np.sqrt(1.0 + t * t)
                s = c * t
                for j in range(n):
                    x, y = work[0, i, j], work[0, h, j]
                    work[0, i, j], work[0, h, j] = c * x - s * y, s * x + c * y
                    x, y = other[0, i, j], other[0, h, j]
                    other[0, i, j], other[0, h, j] = c * x - s * y, s * x + c * y
        if not rotated:
            break
    determinant = 1.0
    for i in range(b):
        at = _longest(work, i)[0]
        if at != i:
            _swap(work, i, at)
            _swap(other, i, at)
            determinant = -determinant
    return determinant


@njit(**_COMPILED)
def _reorthogonalize(added: Any, e: int, s: int, one: Any, a: int) -> None:
    """Make a unit row orthogonal to `one` and to the rows above it once more."""
    _project_out(added, e, s, one, e, a)
    _project_out(added, e, s, added, e, s)
    length = np.sqrt(_dot(added, e, s, added, e, s))
    for j in range(added.shape[2]):
        added[e, s, j] /= length


@njit(**_INLINED)
def _copy_rest(work: Any, mixed: Any, two: Any, one: Any, e: int) -> None:
    """Copy the rows of `two` to both arrays, and project `one` out of those of `work`."""
    for i in range(two.shape[1]):
        for j in range(two.shape[2]):
            work[0, i, j] = two[e, i, j]
            mixed[0, i, j] = two[e, i, j]
        _project_out(work, 0, i, one, e, one.shape[1])


@njit(**_INLINED)
def _eliminate(work: Any, r: Any, added: Any, e: int, s: int) -> None:
    """Project row `s` of an orthonormal basis out of the rows below."""
    for i in range(s + 1, work.shape[1]):
        r[s, i] = dot = _dot(added, e, s, work, 0, i)
        _subtract(work, 0, i, dot, added, e, s)


@njit(**_INLINED)
def _solve_meet(mixed: Any, r: Any, rank: int, met: Any, e: int) -> None:
    """Compute the vectors of `two` in `one`, ``mixed[rank:] - X mixed[:rank]`` with ``R11 X = R12``, by columns."""
    b = mixed.shape[1]
    for i in range(rank, b):
        for j in range(mixed.shape[2]):
            met[e, i - rank, j] = mixed[0, i, j]
        for s in range(rank - 1, -1, -1):
            x = r[s, i]
            for h in range(s + 1, rank):
                x -= r[s, h] * r[h, b]
            r[s, b] = x = x / r[s, s]
            _subtract(met, e, i - rank, x, mixed, 0, s)


@njit(**_COMPILED)
def _rotated(work: Any, mixed: Any, one: Any, tolerance: float, added: Any, met: Any, e: int) -> tuple[int, float]:
    """Compute the rows of an element by Jacobi rotations; return the rank and the factor but for its last sign."""
    b, n = work.shape[1], work.shape[2]
    for i in range(b):
        _project_out(work, 0, i, one, e, one.shape[1])
    factor, rank = _jacobi(work, mixed, b), 0
    for s in range(b):
        length = np.sqrt(_dot(work, 0, s, work, 0, s))
        if length <= tolerance:
            break
        for j in range(n):
            added[e, s, j] = work[0, s, j] / length
        _reorthogonalize(added, e, s, one, one.shape[1])
        factor *= length
        rank += 1
    for i in range(rank, b):
        for j in range(n):
            met[e, i - rank, j] = mixed[0, i, j]
    return rank, factor


@njit(**_INLINED)
def _clear(rows: Any, e: int, first: int) -> None:
    for i in range(first, rows.shape[1]):
        for j in range(rows.shape[2]):
            rows[e, i, j] = 0.0


@njit(**_COMPILED)
def join_batch(one: Any, two: Any, tolerance: float, ranks: Any, factors: Any, added: Any, met: Any) -> None:
    """Compute joins and meets of subspaces with orthonormal rows `one` and `two`.

    The number of directions of `two` outside `one` is the number of principal angles whose sines exceed the tolerance.
    These sines are the singular values of the rest of `two` after projecting out `one`. Pivoted QR decomposition bounds
    them from below, by ``3 / sqrt(4**r + 6 r - 1)`` times the last pivot (Lawson & Hanson 1974, ch. 6), and from above,
    by the norm of the remainder. If the bounds are inconclusive, Jacobi rotations decide.

    `ranks` receives the numbers of rows in `added`, and `factors` a factor. If ``c`` is the factor times the outer
    product of `added`, then ``join = one ^ c`` and ``two = meet ^ c``, up to components in `one`. `met` receives the
    rows of the meet.
    """
    b, n = two.shape[1], two.shape[2]
    work, mixed, r = np.empty((1, b, n)), np.empty((1, b, n)), np.zeros((b + 1, b + 1))
    for e in range(len(one)):
        _copy_rest(work, mixed, two, one, e)
        rank, factor, left = 0, 1.0, 0.0
        for s in range(b):
            at, square, left = _longest(work, s)
            if square <= tolerance * tolerance:
                break
            if at != s:
                _swap(work, s, at)
                _swap(mixed, s, at)
                for h in range(s):
                    r[h, s], r[h, at] = r[h, at], r[h, s]
                factor = -factor
            r[s, s] = length = np.sqrt(square)
            reciprocal = 1.0 / length
            for j in range(n):
                added[e, s, j] = work[0, s, j] * reciprocal
            if length < REORTHOGONALIZE:
                _reorthogonalize(added, e, s, one, one.shape[1])
            _eliminate(work, r, added, e, s)
            rank, left = s + 1, 0.0
        least = r[rank - 1, rank - 1] * 3.0 / np.sqrt(4.0**rank + 6.0 * rank - 1.0) if rank else 2.0
        if least > tolerance and np.sqrt(left) <= min(tolerance, ROUNDING):
            for s in range(rank):
                factor *= r[s, s]
            _solve_meet(mixed, r, rank, met, e)
            factor *= orthonormalize(met, e, b - rank)
        else:
            _copy_rest(work, mixed, two, one, e)
            rank, factor = _rotated(work, mixed, one, tolerance, added, met, e)
        if rank * (b - rank) & 1:
            factor = -factor
        _clear(added, e, rank)
        _clear(met, e, b - rank)
        ranks[e], factors[e] = rank, factor
