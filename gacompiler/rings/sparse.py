"""Reduction of the cost of a polynomial by subtracting multiples of relations; the result is not canonical.

A normal form eliminates the same monomial everywhere. Often it is cheaper to eliminate different monomials in different
results: with ``n1**2 + n2**2 + n3**2 = 1``, a different square in each coordinate of a projection.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations

from ..algebra.blades import Rational, exact
from .polynomial import Monomial, Polynomial, quotient

TERM_LIMIT = 60
"""Maximum number of terms of a polynomial that is simplified; longer ones are returned unchanged."""
ROUNDS = 400
"""Maximum number of multiples that are subtracted from one polynomial."""

Place = tuple[int, int, Rational, Monomial]
"""The number of a relation, the index and the coefficient of one of its terms, and the cofactor of that term."""


def weight(monomial: Monomial, value: Rational) -> int:
    """Return the number of operations of a term: its products, and its addition to the sum."""
    return max(len(monomial), 1) + (value not in (1, -1))


class IndexedRelations:
    """Relations with an index of their terms, which is the same for all polynomials that are simplified."""

    def __init__(self, relations: Iterable[Polynomial]) -> None:
        self.polynomials = tuple(relations)
        self._places = _places(self.polynomials)
        self._lengths = sorted({len(part) for part in self._places})
        self._multiples: dict[Monomial, list[Place]] = {}

    def dividing(self, monomial: Monomial) -> list[Place]:
        """Return the terms of relations that divide a monomial, with the cofactors, in the order of the relations."""
        found = self._multiples.get(monomial)
        if found is None:
            found = self._multiples[monomial] = _multiples(monomial, self._places, self._lengths)
        return found


def simplify(polynomial: Polynomial, relations: IndexedRelations) -> Polynomial:
    """Return a polynomial that is equal modulo `relations` and costs no more, by a greedy, deterministic search."""
    terms = dict(polynomial.terms)
    if len(terms) > TERM_LIMIT:
        return polynomial
    for _ in range(ROUNDS):
        best: tuple[int, Monomial, int, Rational] | None = None
        seen: set[tuple[Monomial, int, Rational]] = set()
        for monomial in sorted(terms, key=lambda m: (-len(m), m)):
            value = terms[monomial]
            for number, _, factor, cofactor in relations.dividing(monomial):
                if value % factor:
                    continue
                multiple = value // factor
                if (cofactor, number, multiple) in seen:
                    continue
                seen.add((cofactor, number, multiple))
                gain = _gain(terms, relations.polynomials[number], cofactor, multiple)
                if gain > 0 and (best is None or gain > best[0]):
                    best = (gain, cofactor, number, multiple)
        if best is None:
            break
        _, shift, chosen, times = best
        for part, factor in relations.polynomials[chosen].terms.items():
            target = tuple(sorted(part + shift))
            total = terms.get(target, 0) - times * factor
            if total:
                terms[target] = exact(total)
            else:
                terms.pop(target, None)
    return Polynomial(polynomial.ring, terms)


def _places(relations: Sequence[Polynomial]) -> dict[Monomial, list[tuple[int, int, Rational]]]:
    """Return the relations that contain each monomial, the index of the term, and its coefficient."""
    places: dict[Monomial, list[tuple[int, int, Rational]]] = {}
    for number, relation in enumerate(relations):
        for index, (part, factor) in enumerate(relation.key):
            places.setdefault(part, []).append((number, index, factor))
    return places


def _multiples(
    monomial: Monomial, places: dict[Monomial, list[tuple[int, int, Rational]]], lengths: Sequence[int]
) -> list[Place]:
    found = []
    for length in lengths:
        for part in set(combinations(monomial, length)) if length <= len(monomial) else ():
            if part in places:
                cofactor = quotient(monomial, part)
                assert cofactor is not None
                found += [(number, index, factor, cofactor) for number, index, factor in places[part]]
    return sorted(found)


def _gain(terms: dict[Monomial, Rational], relation: Polynomial, cofactor: Monomial, multiple: Rational) -> int:
    gain = 0
    for part, factor in relation.terms.items():
        target = tuple(sorted(part + cofactor))
        old = terms.get(target, 0)
        new = old - multiple * factor
        gain += (weight(target, old) if old else 0) - (weight(target, new) if new else 0)
    return gain
