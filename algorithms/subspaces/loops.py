"""The loops over batches, compiled by numba. Arrays come in whole and checked; nothing here raises.

Vectors are rows. `k`, `a`, `b` are numbers of rows, `n` is their length.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

ROUNDING = 1e-12
"""What is left of a vector of a subspace, of its length, when all of it is projected out."""
REORTHOGONALIZE = 0.5
"""Below this length a projected unit vector is projected again ("twice is enough", Kahan in Parlett 1980, §6.9)."""


@njit(cache=True, error_model="numpy")
def outer_product(a: Any, b: Any, left: Any, right: Any, sign: Any, out: Any) -> None:
    """``out = a ^ b`` for each element, by an `OuterTable`."""
    for e in range(len(out)):
        for row in range(left.shape[0]):
            total = 0.0
            for way in range(left.shape[1]):
                total += sign[row, way] * a[e, left[row, way]] * b[e, right[row, way]]
            out[e, row] = total


@njit(cache=True, error_model="numpy")
def gather_factors(coefficients: Any, place: Any, sign: Any, factors: Any) -> float:
    """Rows whose outer product, times the number returned, is the blade; 0 for zero, NaN where it is not finite."""
    best, pivot = 0.0, 0
    for p in range(len(coefficients)):
        size = abs(coefficients[p])
        if size > best:
            best, pivot = size, p
        elif not size <= best:
            return np.nan
    if best == 0.0 or best == np.inf:
        return best - best
    scale = coefficients[pivot]
    for i in range(place.shape[1]):
        for j in range(place.shape[2]):
            factors[i, j] = sign[pivot, i, j] * (coefficients[place[pivot, i, j]] / scale)
    return scale  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def orthonormalize(rows: Any, k: int) -> float:
    """Make rows orthonormal in place; the number returned, times their outer product, is the former one."""
    n = rows.shape[1]
    determinant = 1.0
    for i in range(k):
        before = 0.0
        for j in range(n):
            before += rows[i, j] * rows[i, j]
        length = before
        for turn in range(2):
            for h in range(i):
                dot = 0.0
                for j in range(n):
                    dot += rows[h, j] * rows[i, j]
                for j in range(n):
                    rows[i, j] -= dot * rows[h, j]
            length = 0.0
            for j in range(n):
                length += rows[i, j] * rows[i, j]
            if turn == 0 and length > REORTHOGONALIZE * REORTHOGONALIZE * before:
                break
        length = np.sqrt(length)
        determinant *= length
        if length > 0.0:
            for j in range(n):
                rows[i, j] /= length
    return determinant


@njit(cache=True, error_model="numpy")
def wedge_rows(
    start_with: Any, grade: int, rows: Any, k: int, rest: Any, vector: Any, start: Any, size: Any, one: Any, two: Any
) -> bool:
    """Coefficients of grade `grade` ^ the first `k` rows, in `two` where that is said to be true, else in `one`."""
    for p in range(size[grade]):
        one[p] = start_with[p]
    swapped = False
    for i in range(k):
        grade += 1
        source, target = (two, one) if swapped else (one, two)
        at = start[grade]
        for p in range(size[grade]):
            total = 0.0
            for _ in range(grade):
                term = source[rest[at]] * rows[i, vector[at]]
                total = term - total
                at += 1
            target[p] = total
        swapped = not swapped
    return swapped


@njit(cache=True, error_model="numpy")
def factor_batch(
    coefficients: Any, place: Any, sign: Any, orthonormal: bool, check: bool, table: Any, factors: Any, scale: Any,
    error: Any,
) -> None:  # fmt: skip
    """Factors and scale of each blade, and, where asked for, how far their product is from the blade, relatively."""
    rest, vector, start, size = table
    grade = place.shape[1]
    unit = np.ones(1)
    largest = 1
    for k in range(grade + 1):
        largest = max(largest, size[k])
    one, two = np.empty(largest), np.empty(largest)
    for e in range(len(coefficients)):
        scale[e] = gather_factors(coefficients[e], place, sign, factors[e])
        if orthonormal:
            scale[e] *= orthonormalize(factors[e], grade)
        if check:
            swapped = wedge_rows(unit, 0, factors[e], grade, rest, vector, start, size, one, two)
            found = two if swapped else one
            squares, difference = 0.0, 0.0
            # in units of the scale, so that squares neither overflow nor vanish
            for p in range(size[grade]):
                value = coefficients[e, p] / scale[e]
                squares += value * value
                difference += (value - found[p]) ** 2
            error[e] = np.sqrt(difference / squares)


@njit(cache=True, error_model="numpy")
def expand_batch(start_with: Any, grade: int, rows: Any, k: int, scale: Any, table: Any, out: Any) -> None:
    """``start_with`` (of grade `grade`) ^ the first `k` rows, times the scale, for each element."""
    rest, vector, start, size = table
    largest = 1
    for each in range(grade, grade + k + 1):
        largest = max(largest, size[each])
    one, two = np.empty(largest), np.empty(largest)
    for e in range(len(rows)):
        swapped = wedge_rows(start_with[e], grade, rows[e], k, rest, vector, start, size, one, two)
        found = two if swapped else one
        for p in range(size[grade + k]):
            out[e, p] = scale[e] * found[p]


@njit(cache=True, error_model="numpy")
def _project_out(row: Any, basis: Any, k: int) -> None:
    n = len(row)
    for h in range(k):
        dot = 0.0
        for j in range(n):
            dot += basis[h, j] * row[j]
        for j in range(n):
            row[j] -= dot * basis[h, j]


@njit(cache=True, error_model="numpy")
def _swap(rows: Any, i: int, h: int) -> None:
    for j in range(rows.shape[1]):
        rows[i, j], rows[h, j] = rows[h, j], rows[i, j]


@njit(cache=True, error_model="numpy")
def _jacobi(work: Any, other: Any, b: int) -> float:
    """Rotate rows of both until those of `work` are orthogonal, longest first; the determinant of the rotation.

    One-sided Jacobi (Hestenes 1958): lengths of rows are singular values, small ones to high relative accuracy.
    """
    n = work.shape[1]
    for _ in range(40):
        turned = False
        for i in range(b):
            for h in range(i + 1, b):
                alpha, beta, gamma = 0.0, 0.0, 0.0
                for j in range(n):
                    alpha += work[i, j] * work[i, j]
                    beta += work[h, j] * work[h, j]
                    gamma += work[i, j] * work[h, j]
                if abs(gamma) <= 1e-15 * np.sqrt(alpha * beta) or abs(gamma) < 1e-300:
                    continue
                turned = True
                zeta = (beta - alpha) / (2.0 * gamma)
                t = (1.0 if zeta >= 0 else -1.0) / (abs(zeta) + np.sqrt(1.0 + zeta * zeta))
                c = 1.0 / np.sqrt(1.0 + t * t)
                s = c * t
                for j in range(n):
                    x, y = work[i, j], work[h, j]
                    work[i, j], work[h, j] = c * x - s * y, s * x + c * y
                    x, y = other[i, j], other[h, j]
                    other[i, j], other[h, j] = c * x - s * y, s * x + c * y
        if not turned:
            break
    determinant = 1.0
    for i in range(b):
        longest, at = -1.0, i
        for h in range(i, b):
            length = 0.0
            for j in range(n):
                length += work[h, j] * work[h, j]
            if length > longest:
                longest, at = length, h
        if at != i:
            _swap(work, i, at)
            _swap(other, i, at)
            determinant = -determinant
    return determinant


@njit(cache=True, error_model="numpy")
def _length(row: Any) -> float:
    total = 0.0
    for j in range(len(row)):
        total += row[j] * row[j]
    return np.sqrt(total)  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def join_one(one: Any, two: Any, a: int, b: int, tolerance: float, work: Any, mixed: Any, r: Any, added: Any, met: Any):  # type: ignore[no-untyped-def]
    """Join and meet of two subspaces with orthonormal rows `one` and `two`.

    The number of rows of `two` outside `one` is that of sines of principal angles above the tolerance. Those sines are
    the singular values of what is left of `two` when `one` is projected out. Orthogonal triangles with pivoting bound
    them from both sides, by ``3 / sqrt(4**r + 6 r - 1)`` of the last pivot below (Lawson & Hanson 1974, ch. 6) and by
    the norm of the remainder above; where the bounds leave a doubt, Jacobi's rotations decide.

    Returns the number of rows in `added` and a factor: with ``c`` the factor times the outer product of `added`,
    ``join = one ^ c`` and ``two = meet ^ c``, up to what is in `one`; `met` has the rows of the meet.
    """
    n = one.shape[1]
    for i in range(b):
        for j in range(n):
            work[i, j] = two[i, j]
            mixed[i, j] = two[i, j]
        _project_out(work[i], one, a)
    factor, rank, left = 1.0, 0, 0.0
    for s in range(b):
        longest, at, left = -1.0, s, 0.0
        for i in range(s, b):
            length = 0.0
            for j in range(n):
                length += work[i, j] * work[i, j]
            left += length
            if length > longest:
                longest, at = length, i
        left = np.sqrt(left)
        if longest <= tolerance * tolerance:
            break
        if at != s:
            _swap(work, s, at)
            _swap(mixed, s, at)
            for h in range(s):
                r[h, s], r[h, at] = r[h, at], r[h, s]
            factor = -factor
        longest = np.sqrt(longest)
        for j in range(n):
            added[s, j] = work[s, j] / longest
        if longest < REORTHOGONALIZE:
            _project_out(added[s], one, a)
            _project_out(added[s], added, s)
            again = _length(added[s])
            for j in range(n):
                added[s, j] /= again
        r[s, s] = longest
        for i in range(s + 1, b):
            dot = 0.0
            for j in range(n):
                dot += added[s, j] * work[i, j]
            r[s, i] = dot
            for j in range(n):
                work[i, j] -= dot * added[s, j]
        rank += 1
        left = 0.0
    least = r[rank - 1, rank - 1] * 3.0 / np.sqrt(4.0**rank + 6.0 * rank - 1.0) if rank else 2.0
    if least > tolerance and left <= min(tolerance, ROUNDING):
        for s in range(rank):
            factor *= r[s, s]
        # vectors of `two` that lie in `one`: mixed[rank:] - X mixed[:rank] with R11 X = R12, column by column
        for i in range(rank, b):
            for j in range(n):
                met[i - rank, j] = mixed[i, j]
            for s in range(rank - 1, -1, -1):
                x = r[s, i]
                for h in range(s + 1, rank):
                    x -= r[s, h] * r[h, b]
                x /= r[s, s]
                r[s, b] = x
                for j in range(n):
                    met[i - rank, j] -= x * mixed[s, j]
        factor *= orthonormalize(met, b - rank)
    else:
        for i in range(b):
            for j in range(n):
                work[i, j] = two[i, j]
                mixed[i, j] = two[i, j]
            _project_out(work[i], one, a)
            _project_out(work[i], one, a)
        factor = _jacobi(work, mixed, b)
        rank = 0
        for s in range(b):
            length = _length(work[s])
            if length <= tolerance:
                break
            for j in range(n):
                added[s, j] = work[s, j] / length
            _project_out(added[s], one, a)
            _project_out(added[s], added, s)
            again = _length(added[s])
            for j in range(n):
                added[s, j] /= again
            factor *= length
            rank += 1
        for i in range(rank, b):
            for j in range(n):
                met[i - rank, j] = mixed[i, j]
    if rank * (b - rank) & 1:
        factor = -factor
    for i in range(rank, b):
        for j in range(n):
            added[i, j] = 0.0
    for i in range(b - rank, len(met)):
        for j in range(n):
            met[i, j] = 0.0
    return rank, factor


@njit(cache=True, error_model="numpy")
def join_batch(one: Any, two: Any, tolerance: float, rank: Any, factor: Any, added: Any, met: Any) -> None:
    """`join_one` for each element."""
    a, n = one.shape[1], one.shape[2]
    b = two.shape[1]
    work, mixed, r = np.empty((b, n)), np.empty((b, n)), np.zeros((b + 1, b + 1))
    for e in range(len(one)):
        rank[e], factor[e] = join_one(one[e], two[e], a, b, tolerance, work, mixed, r, added[e], met[e])
