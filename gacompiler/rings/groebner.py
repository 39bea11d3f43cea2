"""Completion of relations to a Groebner basis up to a degree bound, by Buchberger's algorithm.

Critical pairs wait in a heap, smallest degree first. Buchberger's two criteria discard pairs whose S-polynomial reduces
to zero: the leading monomials have no common variable, or a third one divides their least common multiple and both
pairs with it have been treated (Cox, Little and O'Shea, *Ideals, Varieties, and Algorithms*, sections 2.9 and 2.10).
A basis for one degree is the start of the basis for the next.

Bases are cached by the relations themselves, with variables numbered from zero. The relations of a layout are therefore
completed once in a process, whichever kernels and inputs they belong to.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction
from functools import lru_cache
from heapq import heappop, heappush
from itertools import combinations

from ..algebra.blades import Rational, exact
from ..errors import KernelError
from .polynomial import Key, Monomial, quotient

Terms = Mapping[Monomial, Rational]

KEPT = 512
"""Number of bases that are kept in memory."""


def _order(monomial: Monomial) -> tuple[int, Monomial]:
    return len(monomial), monomial


def _descending(monomial: Monomial) -> tuple[int, Monomial]:
    return -len(monomial), monomial


def leading(terms: Terms) -> Monomial:
    """Return the largest monomial."""
    return min(terms, key=_descending)


def sorted_key(terms: Terms) -> Key:
    """Return the terms in canonical order, largest monomial first."""
    return tuple(sorted(terms.items(), key=lambda term: (-len(term[0]), term[0])))


@lru_cache(maxsize=KEPT)
def completed(relations: tuple[Key, ...], degree: int, limit: int) -> tuple[Key, ...]:
    """Return the reduced Groebner basis of some relations up to a degree, with leading coefficients 1.

    Parameters
    ----------
    relations : tuple of Key
        The terms of each relation, in canonical order.
    degree : int
        Multiples of relations of higher degree are not considered.
    limit : int
        Maximum number of S-polynomials that are reduced. The result generates the same ideal if the limit is reached,
        but is not complete.

    Raises
    ------
    KernelError
        If the relations contradict each other (they imply ``1 = 0``).
    """
    lower = tuple(each for each in relations if len(each[0][0]) < degree)
    known = completed(lower, degree - 1, limit) if lower else ()
    if lower == relations and degree > 2 * max(len(each[0][0]) for each in known):
        return known  # No pair has a least common multiple of this degree.
    basis = Basis(known)
    for relation in relations:
        if len(relation[0][0]) >= degree:
            basis.add(dict(relation))
    basis.complete(degree, limit)
    return tuple(sorted_key(basis.reduced(lead)) for lead in sorted(basis.terms, key=_order))


class Basis:
    """Polynomials with leading coefficient 1, of which no leading monomial divides another.

    Parameters
    ----------
    known : iterable of Key
        Polynomials that already have these properties, and are complete up to the degree below that of `complete`.
    """

    def __init__(self, known: Iterable[Key] = ()) -> None:
        self.terms: dict[Monomial, Terms] = {key[0][0]: dict(key) for key in known}
        self._settled = frozenset(self.terms)
        self._lengths = tuple(sorted({len(lead) for lead in self.terms}))

    def reduce(self, terms: Terms) -> dict[Monomial, Rational]:
        """Return the normal form of a polynomial."""
        todo, done = dict(terms), dict[Monomial, Rational]()
        while todo:
            monomial = min(todo, key=_descending) if len(todo) < 8 else next(iter(todo))
            value = todo.pop(monomial)
            lead = self._divisor(monomial)
            if lead is None:
                total = done.get(monomial, 0) + value
                if total:
                    done[monomial] = exact(total)
                else:
                    done.pop(monomial, None)
                continue
            cofactor = quotient(monomial, lead)
            assert cofactor is not None
            for other, factor in self.terms[lead].items():
                if other is lead or other == lead:
                    continue
                target = tuple(sorted(other + cofactor))
                total = todo.get(target, 0) - value * factor
                if total:
                    todo[target] = total
                else:
                    todo.pop(target, None)
        return done

    def reduced(self, lead: Monomial) -> dict[Monomial, Rational]:
        """Return the element with a leading monomial, with its other terms in normal form."""
        tail = self.reduce({monomial: value for monomial, value in self.terms[lead].items() if monomial != lead})
        return {lead: 1, **tail}

    def add(self, relation: Terms) -> list[Monomial]:
        """Add a relation, and return the leading monomials of the elements that are new."""
        waiting, new = [relation], list[Monomial]()
        while waiting:
            reduced = self.reduce(waiting.pop())
            if not reduced:
                continue
            lead = leading(reduced)
            if not lead:
                raise KernelError(
                    "relations of the inputs",
                    "they contradict each other (they imply 1 = 0)",
                    "relations that some element satisfies",
                )
            value = Fraction(reduced[lead])
            divided = [other for other in self.terms if len(other) > len(lead) and quotient(other, lead) is not None]
            waiting += [self.terms.pop(other) for other in reversed(divided)]
            self.terms[lead] = reduced if value == 1 else {m: exact(v / value) for m, v in reduced.items()}
            self._lengths = tuple(sorted({len(each) for each in self.terms}))
            new = [each for each in new if each in self.terms]
            new.append(lead)
        return new

    def complete(self, degree: int, limit: int) -> None:
        """Add the normal forms of S-polynomials up to a degree, at most `limit` of them."""
        heap: list[tuple[int, Monomial, Monomial]] = []
        open_pairs: set[tuple[Monomial, Monomial]] = set()

        def push(a: Monomial, b: Monomial) -> None:
            a, b = sorted((a, b), key=_order)
            size = len(union(a, b))
            if size < degree and a in self._settled and b in self._settled:
                return
            if size <= degree and size < len(a) + len(b):  # Else the leading monomials have no common variable.
                heappush(heap, (size, a, b))
                open_pairs.add((a, b))

        for a, b in combinations(self.terms, 2):
            push(a, b)
        done = 0
        while heap and done < limit:
            _, a, b = heappop(heap)
            open_pairs.discard((a, b))
            if a not in self.terms or b not in self.terms or self._is_implied(a, b, open_pairs):
                continue
            done += 1
            for lead in self.add(self._s_polynomial(a, b)):
                for other in self.terms:
                    if other != lead:
                        push(lead, other)

    def _is_implied(self, a: Monomial, b: Monomial, open_pairs: set[tuple[Monomial, Monomial]]) -> bool:
        """Return whether the chain criterion discards a pair."""
        whole = union(a, b)
        for length in self._lengths:
            for c in combinations(whole, length) if length <= len(whole) else ():
                if c in self.terms and c not in (a, b):
                    pairs = (tuple(sorted((x, c), key=_order)) for x in (a, b))
                    if not any(pair in open_pairs for pair in pairs):
                        return True
        return False

    def _s_polynomial(self, a: Monomial, b: Monomial) -> dict[Monomial, Rational]:
        """Return the difference of the smallest multiples of two elements with the same leading monomial."""
        whole, result = union(a, b), dict[Monomial, Rational]()
        for lead, sign in ((a, 1), (b, -1)):
            cofactor = quotient(whole, lead)
            assert cofactor is not None
            for monomial, value in self.terms[lead].items():
                target = tuple(sorted(monomial + cofactor))
                total = result.get(target, 0) + sign * value
                if total:
                    result[target] = exact(total)
                else:
                    result.pop(target, None)
        return result

    def _divisor(self, monomial: Monomial) -> Monomial | None:
        """Return a leading monomial that divides `monomial`, or None; independent of the order of the elements."""
        for length in self._lengths:
            if length <= len(monomial):
                for candidate in combinations(monomial, length):
                    if candidate in self.terms:
                        return candidate
        return None


def union(a: Monomial, b: Monomial) -> Monomial:
    """Return the least common multiple of two monomials."""
    rest = list(a)
    for variable in b:
        if variable in rest:
            rest.remove(variable)
    return tuple(sorted(rest + list(b)))
