"""Reduction of polynomials modulo the ideal of relations, polynomials that are known to vanish.

A Groebner basis up to a degree bound suffices, because the degree of a kernel's outputs is known. A polynomial whose
normal form is zero vanishes wherever the relations hold. The converse may fail because of the bound, in which case the
result is the safe one, "not known to vanish".
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from itertools import combinations

from ..algebra.blades import Rational, exact
from ..errors import KernelError
from .polynomial import Monomial, Polynomial, quotient

PAIR_LIMIT = 200
"""Maximum number of S-polynomials that are examined; the ideals of unit versors in the catalog need far fewer."""


class Ideal:
    """The ideal of relations, modulo which polynomials are reduced.

    Parameters
    ----------
    relations : iterable of Polynomial
        Polynomials that vanish.
    degree : int
        Degree up to which the Groebner basis is completed.

    Raises
    ------
    KernelError
        If the relations contradict each other (they imply ``1 = 0``).
    """

    def __init__(self, relations: Iterable[Polynomial], degree: int) -> None:
        self._basis: dict[Monomial, Polynomial] = {}
        self._lengths: tuple[int, ...] = ()
        for relation in sorted(relations, key=lambda p: (p.degree, len(p.terms), p.key)):
            self._add(relation)
        self._complete(degree)

    @property
    def basis(self) -> tuple[Polynomial, ...]:
        """The relations in reduced form."""
        return tuple(self._basis[leading] for leading in sorted(self._basis, key=lambda m: (len(m), m)))

    def reduce(self, polynomial: Polynomial) -> Polynomial:
        """Return the normal form of a polynomial."""
        if not self._basis:
            return polynomial
        todo = dict(polynomial.terms)
        done: dict[Monomial, Rational] = {}
        while todo:
            monomial = min(todo, key=lambda m: (-len(m), m)) if len(todo) < 8 else next(iter(todo))
            value = todo.pop(monomial)
            leading = self._divisor(monomial)
            if leading is None:
                total = done.get(monomial, 0) + value
                if total:
                    done[monomial] = exact(total)
                else:
                    done.pop(monomial, None)
                continue
            cofactor = quotient(monomial, leading)
            assert cofactor is not None
            for other, factor in self._basis[leading].terms.items():
                if other == leading:
                    continue
                target = tuple(sorted(other + cofactor))
                total = todo.get(target, 0) - value * factor
                if total:
                    todo[target] = total
                else:
                    todo.pop(target, None)
        return Polynomial(polynomial.ring, done)

    def _divisor(self, monomial: Monomial) -> Monomial | None:
        """Return a leading monomial of the basis that divides `monomial`, or None; independent of the dict order."""
        for length in self._lengths:
            if length <= len(monomial):
                for candidate in combinations(monomial, length):
                    if candidate in self._basis:
                        return candidate
        return None

    def _add(self, relation: Polynomial) -> bool:
        reduced = self.reduce(relation)
        if reduced.is_zero:
            return False
        if reduced.constant_value is not None:
            raise KernelError(
                "relations of the inputs",
                "they contradict each other (they imply 1 = 0)",
                "relations that some element satisfies",
            )
        leading = reduced.leading
        monic = reduced * (1 / Fraction(reduced.terms[leading]))
        affected = [m for m in self._basis if quotient(m, leading) is not None]
        replaced = [self._basis.pop(m) for m in affected]
        self._basis[leading] = monic
        self._lengths = tuple(sorted({len(m) for m in self._basis}))
        for old in replaced:
            self._add(old)
        for other in [
            m for m, p in self._basis.items() if m != leading and any(quotient(t, leading) is not None for t in p.terms)
        ]:
            polynomial = self._basis[other]
            tail = Polynomial(polynomial.ring, {m: v for m, v in polynomial.terms.items() if m != other})
            self._basis[other] = self.reduce(tail) + Polynomial(polynomial.ring, {other: 1})
        return True

    def _complete(self, degree: int) -> None:
        looked_at: set[tuple[Monomial, Monomial]] = set()
        while len(looked_at) < PAIR_LIMIT:
            pair = next((pair for pair in self._pairs(degree) if pair not in looked_at), None)
            if pair is None:
                return
            looked_at.add(pair)
            a, b = pair
            self._add(s_polynomial(self._basis[a], self._basis[b]))

    def _pairs(self, degree: int) -> list[tuple[Monomial, Monomial]]:
        leads = sorted(self._basis, key=lambda m: (len(m), m))
        pairs = [(a, b) for a, b in combinations(leads, 2) if set(a) & set(b) and len(_union(a, b)) <= degree]
        return sorted(pairs, key=lambda pair: (len(_union(*pair)), pair))


def s_polynomial(a: Polynomial, b: Polynomial) -> Polynomial:
    """Return the S-polynomial: the difference of the smallest multiples with the same leading monomial, which cancels.

    Parameters
    ----------
    a, b : Polynomial
        Polynomials with leading coefficient 1.
    """
    union = _union(a.leading, b.leading)
    left, right = (p * Polynomial(p.ring, {quotient(union, p.leading) or (): 1}) for p in (a, b))
    return left - right


def _union(a: Monomial, b: Monomial) -> Monomial:
    rest = list(a)
    for variable in b:
        if variable in rest:
            rest.remove(variable)
    return tuple(sorted(rest + list(b)))
