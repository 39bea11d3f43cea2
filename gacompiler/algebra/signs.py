"""Which signs a quadratic form can have: that of squared norms follows from the Gram matrix and the blades alone."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import TYPE_CHECKING

from .blades import Rational, grade

if TYPE_CHECKING:
    from .algebra import Algebra


@dataclass(frozen=True, slots=True)
class Signs:
    """Which signs a number can have, besides being 0."""

    negative: bool
    positive: bool

    @property
    def zero(self) -> bool:
        """Whether it is always 0."""
        return not self.negative and not self.positive

    @property
    def both(self) -> bool:
        """Whether it can be of either sign."""
        return self.negative and self.positive


@cache
def norm_signs(algebra: Algebra, blades: frozenset[int]) -> Signs:
    """Signs that the scalar part of ``a ~a`` can have where `a` has these blades.

    Only one can occur in a Euclidean metric, degenerate or not; both can in Minkowski's and in conformal ones.
    """
    found = Signs(False, False)
    for group in _not_orthogonal(algebra, blades):
        reversion = -1 if grade(group[0]) & 2 else 1  # all of a group are of one grade
        positive, negative, _ = inertia(
            [[reversion * algebra.blade_product(a, b).get(0, 0) for b in group] for a in group]
        )
        found = Signs(found.negative or negative > 0, found.positive or positive > 0)
        if found.both:
            break
    return found


def _not_orthogonal(algebra: Algebra, blades: Iterable[int]) -> list[list[int]]:
    """Blades in groups: those of different groups have no scalar product.

    A scalar product of blades is a determinant of inner products of their vectors, which vanishes unless both have
    equally many vectors in every subspace that is orthogonal to all others.
    """
    part = list(range(algebra.dimension))
    for i, row in enumerate(algebra.gram):
        for j in range(i):
            if row[j] and part[i] != part[j]:
                part = [part[i] if each == part[j] else each for each in part]
    groups: dict[frozenset[tuple[int, int]], list[int]] = defaultdict(list)
    for blade in sorted(blades):
        counts = Counter(part[k] for k in range(algebra.dimension) if blade >> k & 1)
        groups[frozenset(counts.items())].append(blade)
    return list(groups.values())


def inertia(matrix: Sequence[Sequence[Rational]]) -> tuple[int, int, int]:
    """How many squares of either sign, and how many zeros, a symmetric matrix has on its diagonal form (Sylvester)."""
    rows = [[Fraction(value) for value in row] for row in matrix]
    positive = negative = 0
    while rows:
        n = len(rows)
        pivot = next((i for i in range(n) if rows[i][i]), None)
        if pivot is None:
            pair = next(((i, j) for i in range(n) for j in range(n) if rows[i][j]), None)
            if pair is None:
                break
            pivot, other = pair  # the sum of two null vectors with a product is not null
            rows[pivot] = [a + b for a, b in zip(rows[pivot], rows[other], strict=True)]
            for row in rows:
                row[pivot] += row[other]
        square = rows[pivot][pivot]
        positive, negative = positive + (square > 0), negative + (square < 0)
        others = [i for i in range(n) if i != pivot]
        rows = [[rows[i][j] - rows[i][pivot] * rows[pivot][j] / square for j in others] for i in others]
    return positive, negative, len(rows)
