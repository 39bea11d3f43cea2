"""Exhaustive search for a program with at most a given number of sums, differences and products.

Values are pairs of residues modulo a prime, one at each of two points, stored in one integer. A value and its negative
are the same. The search enumerates sets of intermediate values, each set in one order only. A result that is one
operation away from the values computed so far is always computed at once, because some operation has to compute it. If
only one intermediate value is left, it is a value from which, together with another one, a result follows, so that few
have to be tried.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit

from gacompiler.passes.minimal import PRIME, Problem

_P = np.uint64(PRIME)
_LOW = np.uint64(0xFFFFFFFF)
_SHIFT = np.uint64(32)
_BITS = 14
_SIZE = 1 << _BITS
_MOST = 4000


def exists(problem: Problem, most: int) -> bool:
    """Return whether some sequence of at most `most` operations contains the residues of all results.

    If not, no program of at most `most` operations computes the results.
    """
    free = most - len(problem.results)
    if free < 0:
        return False
    known = np.array([0, *(_packed(each) for each in problem.inputs)], dtype=np.uint64)
    results = np.array([_packed(each) for each in problem.results], dtype=np.uint64)
    roots = np.array([_packed(root) for each in problem.results for root in _roots(each)], dtype=np.uint64)
    return _search(known, results, roots, free)


def minimum(problem: Problem, most: int) -> int:
    """Return the smallest number of operations, at most `most`, for which `exists` is true."""
    return next(n for n in range(len(problem.results), most + 1) if n == most or exists(problem, n))


def _packed(value: Sequence[int]) -> int:
    first, second = value
    high, low = (first, second) if (first or second) <= PRIME // 2 else (-first % PRIME, -second % PRIME)
    return high << 32 | low


def _roots(value: Sequence[int]) -> list[tuple[int, int]]:
    """Return the values whose square or double is a value or its negative."""
    half = (PRIME + 1) // 2
    found = [(value[0] * half % PRIME, value[1] * half % PRIME)]
    for sign in (1, -1):
        roots = [pow(sign * each % PRIME, (PRIME + 1) // 4, PRIME) for each in value]
        if all(root * root % PRIME == sign * each % PRIME for root, each in zip(roots, value, strict=True)):
            found += [(roots[0], roots[1]), (roots[0], -roots[1] % PRIME)]
    return found


@njit(cache=True)
def _canonical(high: np.uint64, low: np.uint64) -> np.uint64:
    half = _P >> np.uint64(1)
    if high > half or (high == 0 and low > half):
        high = np.uint64(0) if high == 0 else _P - high
        low = np.uint64(0) if low == 0 else _P - low
    return (high << _SHIFT) | low


@njit(cache=True)
def _sum(a: np.uint64, b: np.uint64) -> np.uint64:
    return _canonical(((a >> _SHIFT) + (b >> _SHIFT)) % _P, ((a & _LOW) + (b & _LOW)) % _P)


@njit(cache=True)
def _difference(a: np.uint64, b: np.uint64) -> np.uint64:
    return _canonical(((a >> _SHIFT) + _P - (b >> _SHIFT)) % _P, ((a & _LOW) + _P - (b & _LOW)) % _P)


@njit(cache=True)
def _product(a: np.uint64, b: np.uint64) -> np.uint64:
    return _canonical((a >> _SHIFT) * (b >> _SHIFT) % _P, (a & _LOW) * (b & _LOW) % _P)


@njit(cache=True)
def _power(base: np.uint64, exponent: np.uint64) -> np.uint64:
    found = np.uint64(1)
    while exponent:
        if exponent & np.uint64(1):
            found = found * base % _P
        base = base * base % _P
        exponent >>= np.uint64(1)
    return found


@njit(cache=True)
def _inverse(a: np.uint64) -> np.uint64:
    """Return the inverse of a value, or 0 if it has none."""
    exponent = _P - np.uint64(2)
    return (_power(a >> _SHIFT, exponent) << _SHIFT) | _power(a & _LOW, exponent)


@njit(cache=True)
def _find(table: np.ndarray, reachable: np.ndarray, value: np.uint64) -> int:
    """Return the slot of the hash table in which a value is, or the free one in which it belongs."""
    slot = np.int64((value * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(64 - _BITS))
    while table[slot] >= 0 and reachable[table[slot]] != value:
        slot = (slot + 1) & (_SIZE - 1)
    return slot


@njit(cache=True)
def _add(value, values, inverses, n_values, table, slots, reachable, n_reachable):  # type: ignore[no-untyped-def]
    """Append a value, and all that follow from it by one operation. Return the new numbers of both."""
    values[n_values] = value
    inverses[n_values] = _inverse(value)
    for k in range(n_values + 1):
        for operation in range(3):
            if operation == 0:
                new = _sum(value, values[k])
            elif operation == 1:
                new = _difference(value, values[k])
            else:
                new = _product(value, values[k])
            slot = _find(table, reachable, new)
            if table[slot] < 0:
                reachable[n_reachable] = new
                slots[n_reachable] = slot
                table[slot] = n_reachable
                n_reachable += 1
    return n_values + 1, n_reachable


def _search(known: np.ndarray, results: np.ndarray, roots: np.ndarray, free: int) -> bool:
    values, inverses = np.zeros(64, np.uint64), np.zeros(64, np.uint64)
    reachable, slots = np.zeros(_MOST, np.uint64), np.zeros(_MOST, np.int64)
    table = np.full(_SIZE, -1, np.int64)
    state = (values, inverses, table, slots, reachable)
    # 0 and the inputs are put first, so that they are never chosen as new values.
    n_values = n_reachable = 0
    for value in known:
        slot = _find(table, reachable, value)
        if table[slot] < 0:
            reachable[n_reachable], slots[n_reachable], table[slot] = value, slot, n_reachable
            n_reachable += 1
    start = n_reachable
    for value in known[1:]:
        n_values, n_reachable = _add(value, values, inverses, n_values, table, slots, reachable, n_reachable)
    done = np.zeros(len(results), np.bool_)
    return bool(_descend(state, n_values, n_reachable, start, results, done, roots, free))


@njit(cache=True)
def _close(state, n_values, n_reachable, results, computed):  # type: ignore[no-untyped-def]
    """Compute the results that follow by one operation. Return the new numbers of values, and how many are missing."""
    values, inverses, table, slots, reachable = state
    again, missing = True, 0
    while again:
        again, missing = False, 0
        for k in range(len(results)):
            if computed[k]:
                continue
            if table[_find(table, reachable, results[k])] >= 0:
                computed[k] = again = True
                n_values, n_reachable = _add(
                    results[k], values, inverses, n_values, table, slots, reachable, n_reachable
                )
            else:
                missing += 1
    return n_values, n_reachable, missing


@njit(cache=True)
def _descend(state, n_values, n_reachable, start, results, done, roots, free):  # type: ignore[no-untyped-def]
    """Return whether all results follow with `free` more intermediate values, taken from position `start` on."""
    values, inverses, table, slots, reachable = state
    first_reachable = n_reachable
    computed = done.copy()
    n_values, n_reachable, missing = _close(state, n_values, n_reachable, results, computed)
    found = missing == 0
    if not found and free == 1:
        found = _with_one(state, n_values, n_reachable, results, computed, roots)
    elif not found and free > 1:
        for k in range(start, n_reachable):
            value = reachable[k]
            is_known = False
            for j in range(n_values):
                is_known = is_known or values[j] == value
            if is_known:
                continue
            more_values, more_reachable = _add(value, values, inverses, n_values, table, slots, reachable, n_reachable)
            found = _descend(state, more_values, more_reachable, k + 1, results, computed, roots, free - 1)
            for j in range(more_reachable - 1, n_reachable - 1, -1):
                table[slots[j]] = -1
            if found:
                break
    for j in range(n_reachable - 1, first_reachable - 1, -1):
        table[slots[j]] = -1
    return found


@njit(cache=True)
def _with_one(state, n_values, n_reachable, results, computed, roots):  # type: ignore[no-untyped-def]
    """Return whether all results follow with one more intermediate value."""
    values, inverses, table, slots, reachable = state
    per_result = len(roots)
    for k in range(len(results)):
        if computed[k]:
            continue
        for j in range(3 * n_values + per_result):
            if j < n_values:
                value = _sum(results[k], values[j])
            elif j < 2 * n_values:
                value = _difference(results[k], values[j - n_values])
            elif j < 3 * n_values:
                inverse = inverses[j - 2 * n_values]
                value = _canonical(
                    (results[k] >> _SHIFT) * (inverse >> _SHIFT) % _P, (results[k] & _LOW) * (inverse & _LOW) % _P
                )
            else:
                value = roots[j - 3 * n_values]
            if table[_find(table, reachable, value)] < 0:
                continue
            _, more = _add(value, values, inverses, n_values, table, slots, reachable, n_reachable)
            found = _follows(state, n_values + 1, more, results, computed)
            for i in range(more - 1, n_reachable - 1, -1):
                table[slots[i]] = -1
            if found:
                return True
    return False


@njit(cache=True)
def _follows(state, n_values, n_reachable, results, computed):  # type: ignore[no-untyped-def]
    """Return whether all results follow without further intermediate values."""
    _, _, table, slots, _ = state
    _, last, missing = _close(state, n_values, n_reachable, results, computed.copy())
    for j in range(last - 1, n_reachable - 1, -1):
        table[slots[j]] = -1
    return missing == 0
