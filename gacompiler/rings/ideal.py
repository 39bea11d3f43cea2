"""Reduction of polynomials modulo the ideal of relations, polynomials that are known to vanish.

A Groebner basis up to a degree bound suffices, because the degree of a kernel's outputs is known. A polynomial whose
normal form is zero vanishes wherever the relations hold. The converse may fail because of the bound, in which case the
result is the safe one, "not known to vanish".
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from .groebner import Basis, completed, union
from .polynomial import Key, Polynomial, quotient

PAIR_LIMIT = 200
"""Maximum number of S-polynomials that are reduced for each degree; the ideals of unit versors in the catalog need far
fewer."""


class Ideal:
    """The ideal of relations, modulo which polynomials are reduced.

    Relations without common variables are completed independently, and each part once in a process for all ideals that
    contain it, under any names of the variables (`gacompiler.rings.groebner`).

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
        given = sorted((r for r in relations if not r.is_zero), key=lambda p: (p.degree, len(p.terms), p.key))
        self._ring = given[0].ring if given else None
        self._basis = Basis(basis for part in _parts(given) for basis in _completed(part, degree))

    @property
    def basis(self) -> tuple[Polynomial, ...]:
        """The relations in reduced form."""
        found = self._basis.terms
        return tuple(
            Polynomial(self._ring, found[leading])
            for leading in sorted(found, key=lambda m: (len(m), m))
            if self._ring is not None
        )

    def reduce(self, polynomial: Polynomial) -> Polynomial:
        """Return the normal form of a polynomial."""
        if self._ring is None:
            return polynomial
        return Polynomial(polynomial.ring, self._basis.reduce(polynomial.terms))


def _parts(relations: Sequence[Polynomial]) -> Iterator[list[Polynomial]]:
    """Yield the sets of relations that are connected by common variables."""
    parts: list[tuple[set[int], list[Polynomial]]] = []
    for relation in relations:
        variables, own = set(relation.variables), [relation]
        for part in [part for part in parts if part[0] & variables]:
            parts.remove(part)
            variables |= part[0]
            own = part[1] + own
        parts.append((variables, own))
    for _, own in parts:
        yield own


def _completed(relations: Sequence[Polynomial], degree: int) -> Iterator[Key]:
    """Yield the Groebner basis of some relations, completed with variables numbered from zero in the same order."""
    variables = sorted({variable for relation in relations for variable in relation.variables})
    number = {variable: k for k, variable in enumerate(variables)}
    numbered = tuple(_renamed(relation.key, number) for relation in relations)
    back = dict(enumerate(variables))
    for key in completed(numbered, degree, PAIR_LIMIT):
        yield _renamed(key, back)


def _renamed(key: Key, names: dict[int, int]) -> Key:
    """Rename variables. The order of the terms is the same, since the names are in the same order."""
    return tuple((tuple(names[variable] for variable in monomial), value) for monomial, value in key)


def s_polynomial(a: Polynomial, b: Polynomial) -> Polynomial:
    """Return the S-polynomial: the difference of the smallest multiples with the same leading monomial, which cancels.

    Parameters
    ----------
    a, b : Polynomial
        Polynomials with leading coefficient 1.
    """
    whole = union(a.leading, b.leading)
    left, right = (p * Polynomial(p.ring, {quotient(whole, p.leading) or (): 1}) for p in (a, b))
    return left - right
