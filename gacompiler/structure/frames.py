"""Orthogonal frames of algebras with an oblique basis: an exact change of basis, and back.

The product of two blades of an oblique basis has many terms, that of two blades of an orthogonal basis one. A change of
basis is a sequence of shears, each of which adds a multiple of one vector to another one, and a quarter of the
coefficients of an element to another quarter.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import combinations, product
from typing import Any

from ..algebra.algebra import Algebra
from ..algebra.blades import Rational, exact
from ..algebra.coefficients import scale
from .levels import root

Shear = tuple[int, int, Rational]
"""Old vector `i` is the new one plus a multiple of vector `j`."""


MOST_ADDED = 3
"""Number of vectors that are added to another one to find a square with a rational root."""


@dataclass(frozen=True)
class Frame:
    """An orthogonal basis of an algebra.

    Attributes
    ----------
    algebra : Algebra
        With the squares of the vectors of the frame.
    shears : tuple of (i, j, factor)
        From the oblique basis to the frame.
    """

    algebra: Algebra
    shears: tuple[Shear, ...]

    def to_frame(self, terms: Mapping[int, Any]) -> dict[int, Any]:
        """Return the coefficients in the frame of an element of the algebra."""
        return _sheared(terms, self.shears)

    def from_frame(self, terms: Mapping[int, Any]) -> dict[int, Any]:
        """Return the coefficients in the oblique basis."""
        return _sheared(terms, [(i, j, -factor) for i, j, factor in reversed(self.shears)])


@cache
def orthogonal_frame(algebra: Algebra) -> Frame | None:
    """Return an orthogonal frame, or None if the vectors are orthogonal except for null pairs.

    The Gram matrix is diagonalised by symmetric elimination over the rational numbers.
    """
    gram = [[Fraction(value) for value in row] for row in algebra.gram]
    n = len(gram)
    paired = {frozenset(pair) for pair in algebra.null_pairs}
    if all(not gram[i][j] or {i, j} in paired for i in range(n) for j in range(i)):
        return None
    shears: list[Shear] = []

    def add(i: int, j: int, factor: Fraction) -> None:
        """Replace vector `i` by itself plus a multiple of vector `j`."""
        shears.append((i, j, exact(-factor)))
        for row in gram:
            row[i] += factor * row[j]
        gram[i] = [a + factor * b for a, b in zip(gram[i], gram[j], strict=True)]

    rest = list(range(n))
    while any(gram[i][j] for i in rest for j in rest):
        pivot, others = _pivot(gram, rest)
        for k, factor in others:
            add(pivot, k, Fraction(factor))
        rest.remove(pivot)
        for k in rest:
            if gram[k][pivot]:
                add(k, pivot, -gram[k][pivot] / gram[pivot][pivot])
    squares = [exact(gram[k][k]) for k in range(n)]
    return Frame(Algebra(f"{algebra.name}_frame", algebra.vectors, squares), tuple(shears))


def _pivot(gram: Sequence[Sequence[Fraction]], rest: Sequence[int]) -> tuple[int, list[tuple[int, int]]]:
    """Return the vector to separate next, and the vectors and factors to add to it before.

    A vector whose square has a rational root, up to its sign, is preferred, since it has smaller matrices.
    """
    first: tuple[int, list[tuple[int, int]]] | None = None
    for size in range(1, MOST_ADDED + 2):
        for pivot, *others in combinations(rest, size):
            for factors in product((1, -1), repeat=size - 1):
                weights = [(pivot, 1), *zip(others, factors, strict=True)]
                square = sum(x * y * gram[i][j] for i, x in weights for j, y in weights)
                if square:
                    first = first or (pivot, weights[1:])
                    if root(abs(square)) is not None:
                        return pivot, weights[1:]
    assert first is not None
    return first


def _sheared(terms: Mapping[int, Any], shears: Iterable[Shear]) -> dict[int, Any]:
    result = dict(terms)
    for i, j, factor in shears:
        for blade, value in list(result.items()):
            if blade >> i & 1 and not blade >> j & 1:
                target = blade ^ (1 << i) ^ (1 << j)
                between = blade & ((1 << max(i, j)) - (2 << min(i, j)))
                term = scale(value, -factor if between.bit_count() & 1 else factor)
                result[target] = result[target] + term if target in result else term
    return result
