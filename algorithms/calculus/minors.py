"""Compound matrices: the minors of a batch of matrices, grade by grade, each by expansion along its last row."""

from __future__ import annotations

from functools import cache
from math import comb

import numpy as np
from numpy.typing import NDArray

from ..subspaces.index_tables import place, vectors_of
from ..subspaces.products import Product, outer_by_vector, product_of_terms

Floats = NDArray[np.float64]
Places = NDArray[np.int64]
LARGEST = 12
"""Maximum number of vectors for compound matrices: those of grade 6 of 12 have 924 rows."""
_ROUNDING = 2.3e-16
"""From floating point: the distance of 1 from the next number, rounded up."""


def compound(matrices: Floats, grade: int) -> Floats:
    """Return the minors of order `grade` of matrices ``(N, m, n)``: ``(N, C(m, grade), C(n, grade))``, by bitmap."""
    count, m, n = matrices.shape
    entries = np.ascontiguousarray(matrices).reshape(count, m * n)
    found = np.ones((count, 1)) if grade == 0 else entries
    for k in range(2, grade + 1):
        found = _expansion(m, n, k)(entries, found)
    return found.reshape(count, comb(m, grade), comb(n, grade))


def wedge_rows(matrices: Floats, count: int) -> Floats:
    """Return the outer products of the first `count` rows of matrices ``(N, m, n)``: ``(N, C(n, count))``."""
    n = matrices.shape[-1]
    found = np.ones((len(matrices), 1))
    for k in range(count):
        found = outer_by_vector(n, k)(found, matrices[:, k])
    return found


def inverses(matrices: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Return inverses of matrices ``(N, n, n)`` from cofactors, determinants, and where these are 0 up to rounding."""
    n = matrices.shape[-1]
    # scale entries to about 1, so that products neither overflow nor underflow
    exponent = np.frexp(np.abs(matrices).max((1, 2)))[1]
    scaled = np.ldexp(matrices, -exponent[:, None, None])
    sign = (-1.0) ** np.arange(n)
    cofactors = compound(scaled, n - 1)[:, ::-1, ::-1] * (sign[:, None] * sign)
    determinant = np.einsum("ej,ej->e", scaled[:, 0], cofactors[:, 0])
    singular = ~(np.abs(determinant) > n * _ROUNDING * np.linalg.norm(scaled, axis=-1).prod(-1))
    factor = np.full(len(matrices), np.nan)
    np.divide(1.0, determinant, out=factor, where=~singular)
    found = np.swapaxes(cofactors, 1, 2) * factor[:, None, None]
    return np.ldexp(found, -exponent[:, None, None]), np.ldexp(determinant, n * exponent), singular


def complementary(minors: Floats, n: int, grade: int) -> Floats:
    """Return the minors of order n - grade after Jacobi's theorem: transposed, complemented, with signs.

    For matrices F these are ``det F`` times the minors of order `grade` of the inverses.
    """
    at, sign = _complements(n, grade)
    return np.asarray(np.swapaxes(minors, -1, -2)[..., at[:, None], at] * (sign[:, None] * sign))


@cache
def _expansion(m: int, n: int, k: int) -> Product:
    """Return the product that gives minors of order k of m x n matrices from entries and minors of order k - 1."""
    row_rest, row_last = _rows(m, k)
    rest, vectors = _rests(n, k)
    sign = (-1.0) ** (k - 1 - np.arange(k))
    entries = row_last[:, None, None] * n + vectors
    minors = row_rest[:, None, None] * comb(n, k - 1) + rest
    count = comb(m, k) * comb(n, k)
    target = np.broadcast_to(np.arange(count).reshape(comb(m, k), comb(n, k), 1), entries.shape)
    return product_of_terms(entries, minors, np.broadcast_to(sign, entries.shape), target, count)


@cache
def _rests(n: int, k: int) -> tuple[Places, Places]:
    """Return, for each blade, the places of the blades without one of its vectors, and its vectors."""
    vectors = vectors_of(n, k)
    rest = np.stack([place(np.delete(vectors, j, axis=1)) for j in range(k)], -1)
    return rest.astype(np.int64), vectors.astype(np.int64)


@cache
def _rows(n: int, k: int) -> tuple[Places, Places]:
    """Return, for each blade, the place of the blade without its last vector, and this vector."""
    rest, vectors = _rests(n, k)
    return np.ascontiguousarray(rest[:, -1]), np.ascontiguousarray(vectors[:, -1])


@cache
def _complements(n: int, k: int) -> tuple[Places, Floats]:
    """Return, for each blade of grade k, the place of its complement, and the sign of both as a permutation."""
    vectors = vectors_of(n, k).astype(np.int64)
    others = np.array([[i for i in range(n) if i not in row] for row in vectors.tolist()], np.int32)
    sign = 1.0 - 2.0 * ((vectors.sum(-1) - k * (k - 1) // 2) & 1)
    return place(others.reshape(len(vectors), n - k)).astype(np.int64), sign
