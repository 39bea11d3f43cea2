"""Index tables: positions of the coefficients of blades in `n` dimensions, and terms of outer products.

Coefficients of grade `k` are ordered by bitmap, as everywhere in this project. With the vectors of a blade in ascending
order, this is the colexicographic order: the index of ``c_0 < c_1 < ...`` is the sum of the binomials
``(c_i, i + 1)``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import combinations
from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int32]
Signs = NDArray[np.int8]
_Masks = NDArray[np.int64]

LARGEST = 16
"""Maximum dimension for which coefficients are stored. Blades of grade eight then have 12 870 coefficients."""

_BINOMIALS = np.array([[comb(c, i + 1) for i in range(LARGEST)] for c in range(LARGEST)], np.int32)


@cache
def vectors_of(n: int, grade: int) -> Integers:
    """Return the vectors of each basis blade of a grade, ascending: ``(C(n, grade), grade)``."""
    chosen = [tuple(reversed(c)) for c in combinations(range(n - 1, -1, -1), grade)][::-1]
    return np.asarray(_frozen(np.array(chosen, np.int32).reshape(comb(n, grade), grade)))


def place(vectors: Integers) -> Integers:
    """Return the indices of basis blades whose ascending vectors are the last axis."""
    k = vectors.shape[-1]
    return np.asarray(_BINOMIALS[vectors, np.arange(k)].sum(-1), np.int32)


@dataclass(frozen=True, slots=True)
class FactorTable:
    """For each basis blade E of grade `k`, the coefficients that are the coordinates of the factors of a blade.

    Attributes
    ----------
    place : array, (C(n, k), k, n)
        Index of the coefficient that is coordinate `j` of factor `i`. Of the vectors of E, factor `i` contains only
        the `i`-th.
    sign : array, (C(n, k), k, n)
        Its sign; 0 where the coordinate is zero.
    """

    place: Integers
    sign: Signs


@cache
def factor_table(n: int, grade: int) -> FactorTable:
    """Return the table that `factorize_blade` uses."""
    blades = vectors_of(n, grade)
    found = np.zeros((len(blades), grade, n), np.int32)
    sign = np.zeros((len(blades), grade, n), np.int8)
    for i in range(grade):
        others = np.repeat(blades[:, None, :], n, 1)
        others[:, :, i] = np.arange(n)
        order = np.argsort(others, axis=-1)
        ascending = np.take_along_axis(others, order, -1)
        good = (np.diff(ascending, axis=-1) != 0).all(-1)
        # only the new vector moves: past those between its old place and its new one
        swaps = np.argmax(order == i, axis=-1) - i
        found[:, i], sign[:, i] = np.where(good, place(ascending), 0), np.where(good, 1 - 2 * (swaps & 1), 0)
    return FactorTable(_frozen(found), _frozen(sign))


@dataclass(frozen=True, slots=True)
class BladeTable:
    """Conditions for coefficients to be those of a blade: Plücker relations that contain the largest coefficient.

    Let E be the basis blade of that coefficient. There is one relation for each basis blade S that lacks two or more
    vectors of E: ``B_E B_S`` is a sum over the vectors of E that S lacks. The relations of all E and S are stored flat:
    those of E start at ``pivot[E]`` and determine the coefficients `target`; the terms of a relation start at `first`.
    """

    pivot: NDArray[np.int64]
    target: Integers
    first: NDArray[np.int64]
    left: Integers
    right: Integers
    sign: Signs


MOST_TERMS = 200_000
"""Maximum number of terms of a `BladeTable`: enough for 10 dimensions."""


def blade_table_terms(n: int, grade: int) -> int:
    """Return the number of terms that `blade_table` would have."""
    shared = (m * comb(grade, m) * comb(n - grade, m) for m in range(2, grade + 1))
    return comb(n, grade) * sum(shared)


@cache
def blade_table(n: int, grade: int) -> BladeTable:
    """Return the conditions for blades of a grade, for tables with up to `MOST_TERMS` terms."""
    masks = (1 << vectors_of(n, grade).astype(np.int64)).sum(-1)
    at = np.zeros(1 << n, np.int64)
    at[masks] = np.arange(len(masks))
    counts = np.zeros(1, np.int64)
    for _ in range(n):
        counts = np.append(counts, counts + 1)
    is_target = counts[masks & ~masks[:, None]] >= 2
    base, target = np.nonzero(is_target)
    whole, other = masks[base], masks[target]
    new = other & ~whole & -(other & ~whole)
    rest, more = other ^ new, whole | new
    own = _exchange(counts, rest, more, new)
    bits = 1 << np.arange(n)
    row, missing = np.nonzero((whole & ~other)[:, None] & bits)
    old, rest, more = bits[missing], rest[row], more[row]
    return BladeTable(
        _frozen(np.append(0, is_target.sum(-1).cumsum())),
        _frozen(target.astype(np.int32)),
        _frozen(np.append(0, np.bincount(row, minlength=len(target)).cumsum())),
        _frozen(at[rest | old].astype(np.int32)),
        _frozen(at[more ^ old].astype(np.int32)),
        _frozen((-own[row] * _exchange(counts, rest, more, old)).astype(np.int8)),
    )


def _exchange(counts: _Masks, rest: _Masks, more: _Masks, vector: _Masks) -> _Masks:
    """Return the signs of ``(rest ^ vector) (more without vector)`` in Plücker relations, from numbers of bits."""
    return np.asarray(1 - 2 * ((counts[more & (vector - 1)] + counts[rest & -vector]) & 1))


@dataclass(frozen=True, slots=True)
class WedgeTable:
    """Outer products with a vector, for all grades in one flat array.

    The basis blade with index `p` of grade `k` is, up to sign, a product ``rest ^ e_vector`` for `k` pairs, which start
    at ``start[k] + p k``. The sign of the `i`-th pair is ``(-1)**(k - 1 - i)``.
    """

    rest: Integers
    vector: Integers
    start: NDArray[np.int64]
    size: NDArray[np.int64]


@cache
def wedge_table(n: int) -> WedgeTable:
    """Return the table of the outer product with a vector in `n` dimensions."""
    rests, vectors, start = [], [], [0]
    for k in range(n + 1):
        blades = vectors_of(n, k)
        without = [place(np.delete(blades, i, axis=1)) for i in range(k)]
        rests.append(np.stack(without, -1).ravel() if k else np.empty(0, np.int32))
        vectors.append(blades.ravel())
        start.append(start[-1] + blades.size)
    size = np.array([comb(n, k) for k in range(n + 1)])
    rest, vector = (_frozen(np.concatenate(part).astype(np.int32)) for part in (rests, vectors))
    return WedgeTable(rest, vector, _frozen(np.array(start)), _frozen(size))


@dataclass(frozen=True, slots=True)
class OuterTable:
    """The outer product of two grades: rows are blades of the result, columns their terms."""

    left: Integers
    right: Integers
    sign: Signs


@cache
def outer_table(n: int, a: int, b: int) -> OuterTable:
    """Return the table of the outer product of grades `a` and `b`, with a sum of at most `n`."""
    blades = vectors_of(n, a + b)
    first = vectors_of(a + b, a)
    second = np.array([sorted(set(range(a + b)) - set(c)) for c in first.tolist()], np.int32).reshape(len(first), b)
    swaps = (first[:, :, None] > second[:, None, :]).sum((1, 2))
    sign = np.broadcast_to((1 - 2 * (swaps & 1)).astype(np.int8), (len(blades), len(first)))
    return OuterTable(_frozen(place(blades[:, first])), _frozen(place(blades[:, second])), _frozen(sign.copy()))


def _frozen(array: Any) -> Any:
    array = np.ascontiguousarray(array)
    array.flags.writeable = False
    return array
