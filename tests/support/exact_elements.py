"""Shared by several test files: the algebras, exact random elements, and the text of a failing comparison."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from random import Random
from typing import Any

from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.blades import grade
from gacompiler.algebra.catalog import CGA3, PGA3, STA, VGA3, null_pairs
from gacompiler.algebra.multivector import Multivector
from gacompiler.algebra.versors import norm_squared

NULL_PAIRS = null_pairs(2)
"""G(2, 2) in two null pairs."""

OBLIQUE = Algebra(
    "OBLIQUE",
    "a1 a2 a3",
    [
        [Fraction(2), Fraction(1, 2), Fraction(-1, 3)],
        [Fraction(1, 2), Fraction(3, 2), Fraction(2, 5)],
        [Fraction(-1, 3), Fraction(2, 5), Fraction(-1)],
    ],
)
"""Three dimensions, signature (2, 1), and no two basis vectors orthogonal."""

GRASSMANN = Algebra("GRASSMANN", "e1 e2 e3 e4", [0, 0, 0, 0])
"""No metric at all."""


def _ten() -> Algebra:
    squares = [1, 1, 1, -1, -1, 2, Fraction(-1, 2), 0, 0, 3]
    gram = [[Fraction(squares[i] if i == j else 0) for j in range(10)] for i in range(10)]
    gram[7][8] = gram[8][7] = Fraction(-1)
    gram[0][9] = gram[9][0] = Fraction(1, 2)
    return Algebra("TEN", [f"b{chr(ord('a') + k)}" for k in range(10)], gram)


TEN = _ten()
"""Ten dimensions: squares of every sign, a null pair and an oblique pair; not degenerate."""

ALGEBRAS = (VGA3, PGA3, CGA3, STA, NULL_PAIRS, OBLIQUE, TEN, GRASSMANN)
WITH_VERSORS = ALGEBRAS[:-1]
"""Algebras in which some vector has an inverse."""
NON_DEGENERATE = tuple(algebra for algebra in ALGEBRAS if algebra not in (PGA3, GRASSMANN))


class Draw:
    """Random exact elements of one algebra."""

    def __init__(self, algebra: Algebra, seed: str) -> None:
        self.algebra = algebra
        self.random = Random(seed)

    def number(self) -> Fraction:
        """A rational that is not zero."""
        return Fraction(self.random.choice((-1, 1)) * self.random.randint(1, 7), self.random.randint(1, 4))

    def grade_number(self, lowest: int = 0) -> int:
        """A grade, at most four in high dimensions, where there are many blades."""
        return self.random.randint(lowest, min(self.algebra.dimension, 5 if self.algebra.dimension <= 5 else 4))

    def vector(self) -> Multivector:
        """A vector; sparse in high dimensions."""
        n = self.algebra.dimension
        chosen = range(n) if n <= 5 else self.random.sample(range(n), 4)
        return Multivector(self.algebra, {1 << k: self.number() for k in chosen})

    def vectors(self, count: int) -> list[Multivector]:
        """Several vectors."""
        return [self.vector() for _ in range(count)]

    def homogeneous(self, k: int) -> Multivector:
        """A sum of basis blades of grade `k`, in general no blade."""
        blades = self.algebra.blades(k)
        chosen = self.random.sample(blades, min(len(blades), 6))
        return Multivector(self.algebra, {blade: self.number() for blade in chosen})

    def multivector(self) -> Multivector:
        """An element of mixed grades."""
        n = self.algebra.dimension
        if n <= 5:
            blades = self.random.sample(range(1 << n), min(1 << n, 10))
        else:
            blades = [sum(1 << k for k in self.random.sample(range(n), self.grade_number())) for _ in range(5)]
        return Multivector(self.algebra, {blade: self.number() for blade in blades})

    def blade(self, k: int) -> Multivector:
        """The outer product of `k` vectors."""
        return outer(self.algebra, self.vectors(k))

    def versor(self, count: int) -> Multivector:
        """The product of `count` vectors that have inverses."""
        result = self.algebra.scalar(1)
        for _ in range(count):
            result = result * self.invertible_blade(1)
        return result

    def invertible_blade(self, k: int) -> Multivector:
        """A blade with a norm other than zero."""
        while True:
            found = self.blade(k)
            if norm_squared(found).scalar != 0:
                return found


def outer(algebra: Algebra, factors: Sequence[Multivector]) -> Multivector:
    """The outer product of all `factors` in order."""
    result = algebra.scalar(1)
    for factor in factors:
        result = result ^ factor
    return result


def only_grades(x: Multivector) -> set[int]:
    """The grades that occur in `x`."""
    return {grade(blade) for blade in x.terms}


def name_of(value: object) -> str | None:
    """Test ids: algebras by their names."""
    return value.name if isinstance(value, Algebra) else None


def named(function: Callable[..., Any]) -> Callable[..., Any]:
    """A lambda with the name that kernels need."""
    function.__name__ = "example"
    return function
