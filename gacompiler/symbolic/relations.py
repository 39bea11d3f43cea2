"""Comparison and normal forms modulo relations, such as those of unit motors, null points and blades."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from functools import cached_property, lru_cache
from math import lcm
from random import Random
from typing import Any

import sympy

from ..algebra.blades import exact
from ..algebra.multivector import Multivector
from ..errors import AlgebraError, TooLargeError
from ..rings.groebner import KEPT
from ..rings.ideal import Ideal
from ..rings.points import point
from ..rings.polynomial import Polynomial, PolynomialRing, quotient
from ..rings.symbolic import Expanded, generator, generators, term
from .multivector import SymbolicMultivector, required

POINTS = 3
"""Number of points at which a difference is evaluated if it could not be proved to vanish."""


def relations(*elements: SymbolicMultivector) -> tuple[Any, ...]:
    """Return the expressions that vanish for multivectors made by `symbols`, such as ``m ~m - 1`` for a motor."""
    return tuple(value.expression for element in elements for value in _relations(element))


def _relations(element: Any) -> list[Expanded]:
    if not isinstance(element, SymbolicMultivector):
        return [Expanded.of(sympy.sympify(element))]
    if element.layout is None:
        return list(element.terms.values())
    return [Expanded.of(value) for value in element.layout.relations(Multivector(element.algebra, element.terms))]


def equal(a: Any, b: Any, *given: Any) -> bool | None:
    """Determine whether two multivectors are equal for all values of their symbols that satisfy the given relations.

    Parameters
    ----------
    a, b : SymbolicMultivector, Multivector, number or sympy expression
    *given : SymbolicMultivector or sympy expression
        Multivectors made by `symbols`, for the relations of their layouts. Other expressions are assumed to be zero.

    Returns
    -------
    bool or None
        True if equality is proved, False if it fails at some point, None if neither could be established.
    """
    difference = _difference(a, b)
    left = _reduced(difference, given)
    if not left.terms:
        return True
    if _is_zero_by_simplification(left):
        return True
    return _refuted(difference, given)


def reduce(a: SymbolicMultivector, *given: Any) -> SymbolicMultivector:
    """Return `a` in normal form modulo relations, without vanishing coefficients or reducible terms.

    In addition to the given relations, ``sin**2 + cos**2 = 1`` and ``cosh**2 - sinh**2 = 1`` are applied, and sums in
    denominators and under roots are cancelled against sums in numerators. This is many times faster than
    `SymbolicMultivector.simplify`.

    Parameters
    ----------
    a : SymbolicMultivector
    *given
        As for `equal`.

    Returns
    -------
    SymbolicMultivector
        The element `a` itself if the ideal of the relations is too large.
    """
    start = required("reduce()", a)
    if not given and _is_normal(start):
        return start
    found = _reduced(start, given)
    # The first pass can merge denominators whose relations the second pass then uses.
    same = found.terms.keys() == start.terms.keys() and all(v is start.terms[b] for b, v in found.terms.items())
    return found if same else _reduced(found, given)


def _difference(a: Any, b: Any) -> SymbolicMultivector:
    for one in (a, b):
        if isinstance(one, SymbolicMultivector):
            return one.lift(a) - one.lift(b)
    for one in (a, b):
        if isinstance(one, Multivector):
            zero = SymbolicMultivector(one.algebra, {})
            return zero.lift(a) - zero.lift(b)
    raise AlgebraError("equal()", f"{type(a).__name__} and {type(b).__name__}", "at least one multivector")


class _Bridge:
    """Conversion of expanded expressions to polynomials in generators, or in their roots for fractional exponents."""

    def __init__(self, first: Iterable[int], roots: Mapping[int, int]) -> None:
        self.ring = PolynomialRing(effort=20_000_000)
        self._roots, inner = dict(roots), _inside(roots)
        for element in inner:
            _add_roots(self._roots, element)
        ordered = sorted(self._roots, key=lambda g: (_rank(generator(g)), g))
        self._generators = tuple(dict.fromkeys([*first, *ordered]))
        self._variables = {g: k for k, g in enumerate(self._generators)}
        for g in self._generators:
            self._roots.setdefault(g, 1)
            self.ring.variable(f"g{g}")
        self._ideals: dict[int, Ideal] = {}

    def to(self, element: Expanded) -> tuple[Polynomial, dict[int, int]] | None:
        """Return a polynomial and the negative powers that multiply it, or None for floating-point coefficients."""
        variables, roots = self._variables, self._roots
        lowest: dict[int, int] = {}
        for monomial, value in element.terms.items():
            if isinstance(value, float):
                return None
            for g, e in monomial:
                if e < 0:
                    lowest[g] = min(lowest.get(g, 0), int(e * roots[g]))
        raised = {g: -n for g, n in lowest.items()}
        terms: dict[tuple[int, ...], int | Fraction] = {}
        for monomial, value in element.terms.items():
            powers = dict(raised)
            for g, e in monomial:
                powers[g] = powers.get(g, 0) + int(e * roots[g])
            key = tuple(sorted(variables[g] for g, n in powers.items() for _ in range(n)))
            assert not isinstance(value, float)
            terms[key] = value
        return Polynomial(self.ring, terms), lowest

    def back(self, polynomial: Polynomial, lowest: Mapping[int, int]) -> Expanded:
        """The inverse of `to`."""
        result = Expanded({})
        for monomial, value in polynomial.terms.items():
            powers = dict(lowest)
            for variable in monomial:
                g = self._generators[variable]
                powers[g] = powers.get(g, 0) + 1
            exponents = ((g, exact(Fraction(n, self._roots[g]))) for g, n in powers.items() if n)
            result = result + term(tuple(sorted(exponents)), value)
        return result

    def ideal(self, degree: int) -> Ideal:
        """Return the ideal of the identities, completed up to a degree."""
        if degree not in self._ideals:
            self._ideals[degree] = Ideal(self.identities, degree)
        return self._ideals[degree]

    @cached_property
    def identities(self) -> list[Polynomial]:
        """The identities among the generators: of sines and cosines, and of sums under a root or a fraction."""
        found: list[Polynomial] = []
        nested = []
        for g in self._generators:
            base, variable = generator(g), Polynomial(self.ring, {(self._variables[g],) * self._roots[g]: 1})
            partner = _PARTNERS.get(base.func)
            if partner is not None:
                other = self._known(Expanded.of(partner[0](*base.args)))
                if other is not None:
                    square = Polynomial(self.ring, {(self._variables[other],) * (2 * self._roots[other]): 1})
                    found.append(variable * variable + square * partner[1] - 1)
            if base.is_Add or (base.is_Number and self._roots[g] > 1):
                pair = self.to(Expanded.of(base))
                if pair is not None and not any(pair[1].values()):
                    found.append(variable - pair[0])
                elif pair is not None:
                    nested.append((variable, *pair))
        for variable, numerator, lowest in nested:
            found.append(self._without_denominators(variable, numerator, lowest, found))
        return found

    def _without_denominators(
        self, variable: Polynomial, numerator: Polynomial, lowest: Mapping[int, int], known: Sequence[Polynomial]
    ) -> Polynomial:
        """Return the identity of a sum that has sums in denominators, which do not vanish and are divided out."""
        below = tuple(sorted(self._variables[g] for g, n in lowest.items() for _ in range(-n)))
        whole = variable * Polynomial(self.ring, {below: 1}) - numerator
        whole = Ideal(known, whole.degree).reduce(whole) if known else whole
        for each in below:
            rests = [(quotient(monomial, (each,)), value) for monomial, value in whole.terms.items()]
            if all(rest is not None for rest, _ in rests):
                whole = Polynomial(self.ring, {rest: value for rest, value in rests if rest is not None})
        return whole

    def _known(self, element: Expanded) -> int | None:
        """Return the generator that equals `element` up to sign, or None."""
        ((monomial, value), *more) = element.terms.items() or [((), 0)]
        if more or len(monomial) != 1 or abs(value) != 1 or monomial[0][1] != 1:
            return None
        return monomial[0][0] if monomial[0][0] in self._variables else None


_PARTNERS: Mapping[Any, tuple[Any, int]] = {sympy.cos: (sympy.sin, 1), sympy.cosh: (sympy.sinh, -1)}


def _is_normal(a: SymbolicMultivector) -> bool:
    """Return whether `a` is in normal form since its generators have no identities."""
    for value in a.terms.values():
        for monomial in value.terms:
            for g, _ in monomial:
                if _has_identities(g):
                    return False
    return True


@lru_cache(maxsize=4096)
def _has_identities(number: int) -> bool:
    """Return whether `_Bridge.identities` can contain one of this generator."""
    base = generator(number)
    return base.is_Add or base.is_Number or base.func in _PARTNERS


def _rank(base: Any) -> int:
    """Return the rank of a generator in the monomial order: cosines come first, sums last."""
    return 0 if base.func in _PARTNERS else 2 if base.is_Add else 1


@lru_cache(maxsize=KEPT)
def _bridge(first: tuple[int, ...], roots: tuple[tuple[int, int], ...]) -> _Bridge:
    return _Bridge(first, dict(roots))


def _add_roots(roots: dict[int, int], element: Expanded) -> None:
    """Add the generators of an element to `roots`, with the common denominators of their exponents."""
    for monomial in element.terms:
        for g, e in monomial:
            roots[g] = lcm(roots.get(g, 1), e.denominator)


def _inside(numbers: Iterable[int]) -> list[Expanded]:
    """Return the sums that are among some generators, including nested sums."""
    found: dict[int, Expanded] = {}
    waiting = list(numbers)
    while waiting:
        g = waiting.pop()
        if g not in found and generator(g).is_Add:
            found[g] = Expanded.of(generator(g))
            waiting += generators(found[g])
    return list(found.values())


def _reduced(a: SymbolicMultivector, given: Sequence[Any]) -> SymbolicMultivector:
    """Return `a` modulo relations; coefficients without anything to reduce are the same objects."""
    zero = [relation for each in given for relation in _relations(each) if relation.terms]
    roots: dict[int, int] = {}
    for element in (*zero, *a.terms.values()):
        _add_roots(roots, element)
    bridge = _bridge(tuple(_first(given)), tuple(sorted(roots.items())))
    try:
        polynomials = [pair[0] for pair in map(bridge.to, zero) if pair is not None] + bridge.identities
    except TooLargeError:
        return a
    if not polynomials:
        return a
    converted = {blade: bridge.to(value) for blade, value in a.terms.items()}
    degree = max([p.degree for p in polynomials] + [pair[0].degree for pair in converted.values() if pair is not None])
    try:
        ideal = Ideal(polynomials, degree) if zero else bridge.ideal(degree)
        terms = dict(a.terms)
        for blade, pair in converted.items():
            if pair is not None and (left := ideal.reduce(pair[0])).terms != pair[0].terms:
                terms[blade] = bridge.back(left, pair[1])
        return a.of_ring(a.algebra, terms)
    except TooLargeError:
        return a


def _first(given: Sequence[Any]) -> list[int]:
    """Return the generators of named multivectors in the order of their layouts.

    The scalar coefficient of a versor is then the largest generator.
    """
    return [
        g
        for each in given
        if isinstance(each, SymbolicMultivector) and each.layout is not None
        for blade in each.layout.blades
        for g in generators(Expanded.of(each[blade]))
    ]


def _is_zero_by_simplification(a: SymbolicMultivector) -> bool:
    return all(sympy.simplify(value) == 0 for value in a.expressions.values())


def _refuted(difference: SymbolicMultivector, given: Sequence[Any]) -> bool | None:
    """Return False if the difference is nonzero at some point that satisfies the relations, else None."""
    named = [each for each in given if isinstance(each, SymbolicMultivector) and each.layout is not None]
    if len(named) != len(given):
        return None
    random = Random(1)
    for _ in range(POINTS):
        values: dict[Any, Any] = {}
        for element in named:
            assert element.layout is not None
            numbers = [_rational(number) for number in point(element.layout, random)]
            values |= dict(zip([element[blade] for blade in element.layout.blades], numbers, strict=True))
        for symbol in sorted(difference.free_symbols - values.keys(), key=str):
            values[symbol] = sympy.Rational(random.randint(11, 97), random.randint(2, 9))
        found = [sympy.N(value.subs(values), 40) for value in difference.expressions.values()]
        if any(value.is_number and abs(value) > sympy.Float("1e-25", 40) for value in found):
            return False
    return None


def _rational(number: Any) -> Any:
    return (
        sympy.Rational(number.numerator, number.denominator) if hasattr(number, "numerator") else sympy.sympify(number)
    )
