"""Matrices of blades over real or complex numbers that multiply with fewer operations than tables of terms."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
_X, _Y, _Z = np.array([[0.0, 1], [1, 0]]), np.array([[0.0, 1], [-1, 0]]), np.diag([1.0, -1])


def _vectors(p: int, q: int) -> list[Array] | None:
    """Return matrices of the vectors, those with the square 1 first, or None if there are none as compact."""
    if p and q:
        inner = _vectors(p - 1, q - 1)
        if inner is None:
            return None
        one = np.eye(len(inner[0]) if inner else 1)
        outer = [np.kron(_Z, matrix) for matrix in inner]
        return [*outer[: p - 1], np.kron(_X, one), *outer[p - 1 :], np.kron(_Y, one)]
    cores: dict[tuple[int, int], list[Array]] = {
        (0, 0): [], (0, 1): [np.array([[1j]])], (2, 0): [_X, _Z], (3, 0): [_X, -1j * _Y, _Z],
    }  # fmt: skip
    return cores.get((p, q))


def representation(p: int, q: int, bitmaps: Array) -> Array | None:
    """Return the matrices (blades, d, d) of blades whose real and imaginary parts are as many numbers as blades.

    They exist if p - q is 0 or 2 (real) or 3 (complex) modulo 8, where the reduction to these cases by pairs of vectors
    with opposite squares succeeds, and for complex numbers.
    """
    vectors = _vectors(p, q)
    if not vectors:
        return None
    found = []
    for blade in bitmaps:
        matrix = np.eye(len(vectors[0]), dtype=np.result_type(*vectors))
        for k, vector in enumerate(vectors):
            if int(blade) >> k & 1:
                matrix = matrix @ vector
        found.append(matrix)
    return np.array(found)
