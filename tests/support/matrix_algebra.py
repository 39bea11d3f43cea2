"""Geometric algebras of any metric by matrices, in numpy and without any code of the compiler.

A vector acts on the exterior algebra by its outer product and its contraction together (Chevalley's representation),
and an element is what its matrix makes of the number 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


class MatrixAlgebra:
    """An algebra of vectors with a symmetric Gram matrix. Blades are numbered by their bitmaps."""

    def __init__(self, gram: Sequence[Sequence[Any]]) -> None:
        n = len(gram)
        self.grades = np.array([blade.bit_count() for blade in range(1 << n)])
        vectors = [_vector(k, np.array(row, float)) for k, row in enumerate(gram)]
        matrices = [np.eye(1 << n)]
        for blade in range(1, 1 << n):
            vector, rest = vectors[(blade & -blade).bit_length() - 1], matrices[blade & (blade - 1)]
            sign = (-1) ** (blade.bit_count() - 1)
            matrices.append((vector @ rest + sign * rest @ vector) / 2)  # the outer product
        self.matrices = np.stack(matrices)


def _vector(k: int, row: Any) -> Any:
    """The matrix of the basis vector `k`, whose products with all basis vectors are `row`."""
    size = 1 << len(row)
    found = np.zeros((size, size))
    for blade in range(size):
        if not blade >> k & 1:
            found[blade | 1 << k, blade] += _sign(blade, k)
        for j in range(len(row)):
            if blade >> j & 1:
                found[blade ^ 1 << j, blade] += _sign(blade, j) * row[j]
    return found


def _sign(blade: int, k: int) -> int:
    """The sign of moving the vector `k` past the vectors of a blade that come before it."""
    return -1 if (blade & (1 << k) - 1).bit_count() % 2 else 1


@dataclass(frozen=True)
class Element:
    """An element, with the operators and functions of kernels by their names."""

    algebra: MatrixAlgebra
    value: Any

    def _new(self, value: Any) -> Element:
        return Element(self.algebra, value)

    def grade(self, *wanted: int) -> Element:
        return self._new(np.where(np.isin(self.algebra.grades, wanted), self.value, 0))

    def __mul__(self, other: Element) -> Element:
        return self._new(np.tensordot(self.value, self.algebra.matrices, 1) @ other.value)

    def __add__(self, other: Element) -> Element:
        return self._new(self.value + other.value)

    def __sub__(self, other: Element) -> Element:
        return self._new(self.value - other.value)

    def __invert__(self) -> Element:
        return self._new(self.value * (-1.0) ** (self.algebra.grades * (self.algebra.grades - 1) // 2))

    def __xor__(self, other: Element) -> Element:
        return self.kept(other, lambda p, q: p + q)

    def kept(self, other: Element, grade: Callable[[int, int], int]) -> Element:
        """The parts of one grade of the products of all parts of single grades."""
        total, n = np.zeros_like(self.value), int(self.algebra.grades[-1])
        for p in range(n + 1):
            for q in range(n + 1):
                if 0 <= grade(p, q) <= n:
                    total = total + (self.grade(p) * other.grade(q)).grade(grade(p, q)).value
        return self._new(total)

    def involuted(self) -> Element:
        return self._new(self.value * (-1.0) ** self.algebra.grades)


def inner_product(a: Element, b: Element) -> Element:
    return a.kept(b, lambda p, q: abs(p - q))


def left_contraction(a: Element, b: Element) -> Element:
    return a.kept(b, lambda p, q: q - p)


def right_contraction(a: Element, b: Element) -> Element:
    return a.kept(b, lambda p, q: p - q)


def scalar_product(a: Element, b: Element) -> Element:
    return (a * b).grade(0)


def commutator(a: Element, b: Element) -> Element:
    return Element(a.algebra, (a * b - b * a).value / 2)


def norm_squared(a: Element) -> Element:
    return (a * ~a).grade(0)


def sandwich(v: Element, x: Element) -> Element:
    """``v x ~v``, with the sign of a reflection for odd `v`."""
    is_odd = bool(np.any(np.where(v.algebra.grades % 2, v.value, 0)))
    return v * (x.involuted() if is_odd else x) * ~v
