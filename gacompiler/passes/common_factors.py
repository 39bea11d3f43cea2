"""Removal of numbers that all terms of a named result have in common; they are multiplied where the result is used.

The inner product of two conformal points is minus half of their squared distance. In a product of several of them, one
number replaces the halves.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from math import gcd, lcm, prod

from ..algebra.blades import exact
from ..rings.polynomial import Polynomial
from .system import System


def without_common_factors(system: System) -> System | None:
    """Return the system with named results divided by their common numbers, or None if there are none."""
    scales: dict[int, Fraction] = {}
    for definition in system.live[0]:
        common = _common(_scaled(definition.polynomial, scales))
        if common != 1:
            scales[definition.variable] = common
    if not scales:
        return None
    one = Fraction(1)

    def change(polynomial: Polynomial, variable: int | None) -> Polynomial:
        return _scaled(polynomial, scales, one if variable is None else scales.get(variable, one))

    return system.changed(change)


def _scaled(polynomial: Polynomial, scales: Mapping[int, Fraction], divisor: Fraction = Fraction(1)) -> Polynomial:
    """Return a polynomial with variables multiplied by numbers, divided by `divisor`."""
    ones = Fraction(1)
    terms = {
        monomial: exact(value * prod((scales.get(variable, ones) for variable in monomial), start=ones) / divisor)
        for monomial, value in polynomial.terms.items()
    }
    return Polynomial(polynomial.ring, terms)


def _common(polynomial: Polynomial) -> Fraction:
    """Return the number that makes the coefficients whole, without a common divisor, and the first one positive."""
    values = [Fraction(value) for value in polynomial.terms.values()]
    size = Fraction(gcd(*(v.numerator for v in values)), lcm(*(v.denominator for v in values)))
    return size if polynomial.terms[polynomial.leading] > 0 else -size
