"""The signs that a quadratic form can have; those of squared norms follow from the Gram matrix and the blades."""

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
    """The signs that a number can have, in addition to being 0."""

    negative: bool
    positive: bool

    @property
    def zero(self) -> bool:
        """Whether the number is always 0."""
        return not self.negative and not self.positive

    @property
    def both(self) -> bool:
        """Whether the number can have either sign."""
        return self.negative and self.positive


@cache
def norm_signs(algebra: Algebra, blades: frozenset[int]) -> Signs:
    """Return the signs that the scalar part of ``a ~a`` can have for elements with these blades.

    Only one sign can occur in a Euclidean metric, degenerate or not. Both can occur in Minkowski, conformal and
    symbolic metrics.
    """
    if algebra.has_symbolic_metric:
        return Signs(True, True)
    found = Signs(False, False)
    for group in _not_orthogonal(algebra, blades):
        reversion = algebra.reverse_sign(grade(group[0]))  # all blades of a group have the same grade
        positive, negative, _ = inertia(
            [[reversion * algebra.blade_product(a, b).get(0, 0) for b in group] for a in group]
        )
        found = Signs(found.negative or negative > 0, found.positive or positive > 0)
        if found.both:
            break
    return found


def _not_orthogonal(algebra: Algebra, blades: Iterable[int]) -> list[list[int]]:
    """Partition blades into groups such that the scalar product of blades of different groups is zero.

    A scalar product of blades is a determinant of inner products of their vectors. It vanishes unless both blades have
    the same number of vectors in each of the mutually orthogonal subspaces.
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
    """Return the inertia of a symmetric matrix: the numbers of positive, negative and zero squares (Sylvester)."""
    rows = [[Fraction(value) for value in row] for row in matrix]
    positive = negative = 0
    while rows:
        n = len(rows)
        pivot = next((i for i in range(n) if rows[i][i]), None)
        if pivot is None:
            pair = next(((i, j) for i in range(n) for j in range(n) if rows[i][j]), None)
            if pair is None:
                break
            pivot, other = pair  # the sum of two null vectors with a nonzero product is not null
            rows[pivot] = [a + b for a, b in zip(rows[pivot], rows[other], strict=True)]
            for row in rows:
                row[pivot] += row[other]
        square = rows[pivot][pivot]
        positive, negative = positive + (square > 0), negative + (square < 0)
        others = [i for i in range(n) if i != pivot]
        rows = [[rows[i][j] - rows[i][pivot] * rows[pivot][j] / square for j in others] for i in others]
    return positive, negative, len(rows)
