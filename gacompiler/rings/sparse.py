"""Reduction of the cost of a polynomial by subtracting multiples of relations; the result is not canonical.

A normal form eliminates the same monomial everywhere. Often it is cheaper to eliminate different monomials in different
results: with ``n1**2 + n2**2 + n3**2 = 1``, a different square in each coordinate of a projection.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from ..algebra.blades import Rational, exact
from .polynomial import Monomial, Polynomial, quotient

TERM_LIMIT = 60
"""Maximum number of terms of a polynomial that is simplified; longer ones are returned unchanged."""
ROUNDS = 400
"""Maximum number of multiples that are subtracted from one polynomial."""


def weight(monomial: Monomial, value: Rational) -> int:
    """Return the number of operations of a term: its products, and its addition to the sum."""
    return max(len(monomial), 1) + (value not in (1, -1))


def simplify(polynomial: Polynomial, relations: Sequence[Polynomial]) -> Polynomial:
    """Return a polynomial that is equal modulo `relations` and costs no more, by a greedy, deterministic search."""
    terms = dict(polynomial.terms)
    if len(terms) > TERM_LIMIT:
        return polynomial
    for _ in range(ROUNDS):
        best: tuple[int, Monomial, int, Rational] | None = None
        seen: set[tuple[Monomial, int, Rational]] = set()
        for monomial in sorted(terms, key=lambda m: (-len(m), m)):
            for number, relation in enumerate(relations):
                for part, factor in relation.key:
                    cofactor = quotient(monomial, part)
                    if cofactor is None:
                        continue
                    multiple = exact(Fraction(terms[monomial]) / factor) if terms[monomial] % factor == 0 else None
                    if multiple is None or (cofactor, number, multiple) in seen:
                        continue
                    seen.add((cofactor, number, multiple))
                    gain = _gain(terms, relation, cofactor, multiple)
                    if gain > 0 and (best is None or gain > best[0]):
                        best = (gain, cofactor, number, multiple)
        if best is None:
            break
        _, cofactor, number, multiple = best
        for part, factor in relations[number].terms.items():
            target = tuple(sorted(part + cofactor))
            total = terms.get(target, 0) - multiple * factor
            if total:
                terms[target] = exact(total)
            else:
                terms.pop(target, None)
    return Polynomial(polynomial.ring, terms)


def _gain(terms: dict[Monomial, Rational], relation: Polynomial, cofactor: Monomial, multiple: Rational) -> int:
    gain = 0
    for part, factor in relation.terms.items():
        target = tuple(sorted(part + cofactor))
        old = terms.get(target, 0)
        new = old - multiple * factor
        gain += (weight(target, old) if old else 0) - (weight(target, new) if new else 0)
    return gain
