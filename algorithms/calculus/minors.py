"""Compound matrices: the minors of a batch of matrices, grade by grade, each by its last row from those before.

Inside, the batch is the last axis, so that the loops over it are vectorised, and goes through in blocks that stay in
the cache.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from math import comb
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ..subspaces.tables import place, vectors_of

Floats = NDArray[np.float64]
Places = NDArray[np.int64]
LARGEST = 12
"""The most vectors for which compound matrices are made: those of grade 6 of 12 have 924 rows."""
_BLOCK = 1 << 14
"""How many minors of one order are made at a time."""
_ROUNDING = 2.3e-16


def compound(matrices: Floats, grade: int) -> Floats:
    """The minors of order `grade` of matrices ``(N, m, n)``: ``(N, C(m, grade), C(n, grade))``, ordered by bitmap."""
    count, m, n = matrices.shape
    result = np.empty((count, comb(m, grade), comb(n, grade)))
    for part, block in _blocks(matrices, comb(m, m // 2) * comb(n, n // 2)):
        result[part] = np.moveaxis(_minors(block, grade), -1, 0)
    return result


def wedge_rows(matrices: Floats, count: int) -> Floats:
    """The outer products of the first `count` rows of matrices ``(N, m, n)``: ``(N, C(n, count))``."""
    n = matrices.shape[-1]
    result = np.empty((len(matrices), comb(n, count)))
    for part, block in _blocks(matrices, comb(n, n // 2)):
        found = np.ones((1, 1, block.shape[-1]))
        for k in range(1, count + 1):
            out = np.zeros((1, comb(n, k), block.shape[-1]))
            _expand(block, found, np.zeros(1, np.int64), np.array([k - 1]), *_columns(n, k), out)
            found = out
        result[part] = found[0].T
    return result


def inverses(matrices: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Inverses of matrices ``(N, n, n)`` by their cofactors, determinants, and where these are 0 to within rounding."""
    count, n, _ = matrices.shape
    out, determinant, singular = np.empty((count, n, n)), np.empty(count), np.empty(count, np.bool_)
    for part, block in _blocks(matrices, comb(n, n // 2) ** 2):
        # entries of about 1, so that products neither overflow nor vanish
        exponent = np.frexp(np.abs(block).max((0, 1)))[1]
        block, found = np.ldexp(block, -exponent), np.empty_like(block)
        _divide(block, _minors(block, n - 1), found, determinant[part], singular[part])
        out[part] = np.moveaxis(np.ldexp(found, -exponent), -1, 0)
        determinant[part] = np.ldexp(determinant[part], n * exponent)
    return out, determinant, singular


def complementary(minors: Floats, n: int, grade: int) -> Floats:
    """What Jacobi's theorem makes of minors of order n - grade: transposed, complemented, with signs.

    Of matrices F these are ``det F`` times the minors of order `grade` of the inverses.
    """
    at, sign = _complements(n, grade)
    return np.asarray(np.swapaxes(minors, -1, -2)[..., at[:, None], at] * (sign[:, None] * sign))


def _blocks(matrices: Floats, size: int) -> Iterator[tuple[slice, Floats]]:
    step = max(1, _BLOCK // size)
    for start in range(0, len(matrices), step):
        part = slice(start, start + step)
        yield part, np.ascontiguousarray(np.moveaxis(matrices[part], 0, -1))


def _minors(block: Floats, grade: int) -> Floats:
    m, n, count = block.shape
    found = np.ones((1, 1, count))
    for k in range(1, grade + 1):
        if k == 1:
            found = block
            continue
        out = np.zeros((comb(m, k), comb(n, k), count))
        _expand(block, found, *_rows(m, k), *_columns(n, k), out)
        found = out
    return found


@cache
def _rests(n: int, k: int) -> tuple[Places, Places]:
    """For each blade: the places of the blades without one of its vectors, and its vectors."""
    vectors = vectors_of(n, k)
    rest = np.stack([place(np.delete(vectors, j, axis=1)) for j in range(k)], -1)
    return rest.astype(np.int64), vectors.astype(np.int64)


@cache
def _rows(n: int, k: int) -> tuple[Places, Places]:
    """For each blade: the place of the blade without its last vector, and that vector."""
    rest, vectors = _rests(n, k)
    return np.ascontiguousarray(rest[:, -1]), np.ascontiguousarray(vectors[:, -1])


@cache
def _columns(n: int, k: int) -> tuple[Places, Places, Floats]:
    rest, vectors = _rests(n, k)
    return rest, vectors, np.array([(-1.0) ** (k - 1 - j) for j in range(k)])


@cache
def _complements(n: int, k: int) -> tuple[Places, Floats]:
    """For each blade of grade k: the place of its complement, and the sign of the two together as a permutation."""
    vectors = vectors_of(n, k).astype(np.int64)
    others = np.array([[i for i in range(n) if i not in row] for row in vectors.tolist()], np.int32)
    sign = 1.0 - 2.0 * ((vectors.sum(-1) - k * (k - 1) // 2) & 1)
    return place(others.reshape(len(vectors), n - k)).astype(np.int64), sign


@njit(cache=True, error_model="numpy")
def _expand(
    matrices: Any, before: Any, row_rest: Any, row_last: Any, rest: Any, vectors: Any, sign: Any, out: Any
) -> None:
    """To ``out``, zeros, add the expansion of each minor along its last row."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(rest.shape[1]):
                s, row, column = sign[k], row_last[i], vectors[j, k]
                r, c = row_rest[i], rest[j, k]
                for e in range(out.shape[2]):
                    out[i, j, e] += s * matrices[row, column, e] * before[r, c, e]


@njit(cache=True, error_model="numpy")
def _divide(matrices: Any, cofactors: Any, out: Any, determinant: Any, singular: Any) -> None:
    """Minors of order n - 1, transposed, with signs, over the determinant; NaN where that is 0."""
    n, count = matrices.shape[0], matrices.shape[2]
    factor, lengths = np.zeros(count), np.ones(count)
    for i in range(n):
        squares = np.zeros(count)
        for j in range(n):
            for e in range(count):
                squares[e] += matrices[i, j, e] * matrices[i, j, e]
        for e in range(count):
            lengths[e] *= np.sqrt(squares[e])
    for j in range(n):
        sign = 1.0 - 2.0 * (j & 1)
        for e in range(count):
            factor[e] += sign * matrices[0, j, e] * cofactors[n - 1, n - 1 - j, e]
    for e in range(count):
        determinant[e] = factor[e]
        singular[e] = not abs(factor[e]) > n * _ROUNDING * lengths[e]
        factor[e] = np.nan if singular[e] else 1.0 / factor[e]
    for i in range(n):
        for j in range(n):
            sign = 1.0 - 2.0 * ((i + j) & 1)
            for e in range(count):
                out[j, i, e] = sign * cofactors[n - 1 - i, n - 1 - j, e] * factor[e]
