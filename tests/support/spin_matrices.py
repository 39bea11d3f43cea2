"""Exponentials of bivectors in many digits, by Pauli matrices and without any code of the compiler."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import mpmath as mp

DIGITS = 60


def _kronecker(a: Any, b: Any) -> Any:
    rows, columns = ([(i, k) for i in range(x) for k in range(y)] for x, y in ((a.rows, b.rows), (a.cols, b.cols)))
    return mp.matrix([[a[i, j] * b[k, m] for j, m in columns] for i, k in rows])


def generators(squares: Sequence[int]) -> list[Any]:
    """Anticommuting matrices with these squares, 1 or -1, an even number of them (Jordan and Wigner)."""
    one, z = mp.eye(2), mp.matrix([[1, 0], [0, -1]])
    found = []
    for k in range(len(squares) // 2):
        for pauli in (mp.matrix([[0, 1], [1, 0]]), mp.matrix([[0, -1j], [1j, 0]])):
            matrix = mp.eye(1)
            for j in range(len(squares) // 2):
                matrix = _kronecker(matrix, z if j < k else pauli if j == k else one)
            found.append(matrix)
    return [matrix if square > 0 else 1j * matrix for matrix, square in zip(found, squares, strict=True)]


def null_generators(n: int) -> list[Any]:
    """``w_i = (s_i + t_i) / 2`` and ``v_i = s_i - t_i``, where ``s_i**2 = 1`` and ``t_i**2 = -1``."""
    both = generators([1] * n + [-1] * n)
    return [(both[i] + both[i + n]) / 2 for i in range(n)] + [both[i] - both[i + n] for i in range(n)]


def matrix_of(vectors: Sequence[Any], terms: Mapping[int, Any]) -> Any:
    """The matrix of a multivector with these coefficients by bitmap; blades are outer products of `vectors`."""
    total = mp.zeros(vectors[0].rows)
    for blade, value in terms.items():
        chosen = [vector for k, vector in enumerate(vectors) if blade >> k & 1]
        total += mp.mpf(float(value)) * (_outer(chosen) if chosen else mp.eye(total.rows))
    return total


def _outer(vectors: Sequence[Any]) -> Any:
    """``a ^ B = (a B + (-1)**k B a) / 2`` with `B` of grade `k`."""
    product = vectors[-1]
    for grade, vector in enumerate(reversed(vectors[:-1]), 1):
        product = (vector * product + (-1) ** grade * product * vector) / 2
    return product


def exponential(matrix: Any) -> Any:
    """Taylor series of a scaled matrix, then squaring; the scale is so small that all `DIGITS` remain correct."""
    size = mp.norm(matrix, 1)
    halvings = int(mp.ceil(mp.log(size + 1, 2))) + 6
    small = matrix / mp.mpf(2) ** halvings
    total, term, k = mp.eye(matrix.rows), mp.eye(matrix.rows), 1
    while mp.norm(term, 1) > mp.mpf(10) ** (-mp.mp.dps - 5):
        term = term * small / k
        total, k = total + term, k + 1
    for _ in range(halvings):
        total = total * total
    return total


def error(vectors: Sequence[Any], argument: Mapping[int, float], found: Mapping[int, Any]) -> float:
    """The error of `found`, relative to the largest coefficient of the exponential."""
    with mp.workdps(DIGITS):
        difference = matrix_of(vectors, found) - exponential(matrix_of(vectors, argument))
        largest = max(abs(mp.mpf(float(value))) for value in found.values())
        return float(max(abs(x) for x in difference) / largest)
