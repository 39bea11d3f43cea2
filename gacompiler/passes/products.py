"""Factorisation of expanded polynomials: ``x**2 - 2 x y + y**2`` becomes the square of a named difference."""

from __future__ import annotations

from fractions import Fraction

from ..algebra.blades import exact
from ..rings.factors import factors
from ..rings.polynomial import Monomial, Polynomial
from .system import Definition, System

FEWEST = 3
"""Polynomials with fewer terms do not become cheaper."""


def as_products(system: System) -> System | None:
    """Replace polynomials by products of named factors, or return None if there are none."""
    ring = system.ring
    named: dict[Polynomial, Definition] = {}

    def name(factor: Polynomial) -> int:
        if factor not in named:
            ring.variable(f"f{len(ring.names)}")
            named[factor] = Definition(len(ring.names) - 1, factor)
        return named[factor].variable

    products: dict[Polynomial, Polynomial] = {}
    for polynomial in system.polynomials:
        if len(polynomial.terms) >= FEWEST and polynomial.degree > 1 and polynomial not in products:
            found = factors(polynomial)
            if sum(exponent for _, exponent in found) > 1:
                variables = tuple(name(factor) for factor, exponent in found for _ in range(exponent))
                products[polynomial] = _product(polynomial, found, variables)
    if not products:
        return None
    return system.changed(lambda polynomial, _: products.get(polynomial, polynomial), named.values())


def _product(polynomial: Polynomial, found: list[tuple[Polynomial, int]], variables: Monomial) -> Polynomial:
    """Return the product of the named factors, the monomial and the number that they leave out."""
    lead: Monomial = ()
    for factor, exponent in found:
        lead += factor.leading * exponent
    rest = list(polynomial.leading)
    for variable in lead:
        rest.remove(variable)
    value = Fraction(polynomial.terms[polynomial.leading])
    for factor, exponent in found:
        value /= Fraction(factor.terms[factor.leading]) ** exponent
    return Polynomial(polynomial.ring, {tuple(sorted((*rest, *variables))): exact(value)})
