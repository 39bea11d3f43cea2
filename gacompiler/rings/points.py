"""Points of a layout: random stored coefficients that satisfy its relations.

Exact rational points come from the geometry: the square of a product of vectors, divided by its norm, is a unit
versor with rational coefficients, and moving a unit blade by such versors gives unit blades. Where a layout's
relations are of another kind, a point is found to many digits by Gauss-Newton iteration instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations
from random import Random
from typing import Any

import mpmath

from ..algebra.blades import grade
from ..algebra.coefficients import divide
from ..algebra.involutions import clifford_conjugate
from ..algebra.layout import Layout
from ..algebra.multivector import Multivector
from ..algebra.versors import norm_squared
from ..errors import InexactError, LayoutError
from .polynomial import Polynomial, PolynomialRing

DIGITS = 60
"""Working precision of points that are not rational, in decimal digits."""


def random_fraction(random: Random) -> Fraction:
    """A rational that is neither zero nor so small that ``x * x`` and ``x + x`` might agree."""
    return Fraction(random.choice((-1, 1)) * random.randint(11, 97), random.choice((1, 2, 3, 5, 7)))


def point(layout: Layout, random: Random, *, spread: Fraction = Fraction(1), near_one: bool = False) -> list[Any]:
    """Random stored coefficients of an element of `layout`: Fractions where possible, else mpmath numbers.

    `spread` scales free coefficients, and says how far versors are from 1; `near_one` keeps magnitudes moderate, for
    measuring floating-point error.
    """
    if not layout.has_relations:
        return [spread * _coefficient(random, near_one) for _ in layout.stored]
    for make in (_versor, _blade, _number):
        found = make(layout, random, spread)
        if found is not None:
            return found
    return _newton(layout, random)


def _coefficient(random: Random, near_one: bool) -> Fraction:
    return Fraction(random.randint(-2000, 2000), 1000) if near_one else random_fraction(random)


def _vectors_within(layout: Layout, even_only: bool) -> tuple[int, ...]:
    """The largest set of basis vectors whose even subalgebra (or rotations) stay inside the layout's blades."""
    n = layout.algebra.dimension
    for size in range(n, 0, -1):
        for chosen in combinations(range(n), size):
            blades = [sum(1 << k for k in pair) for r in range(0, size + 1, 2) for pair in combinations(chosen, r)]
            if not even_only or all(blade in layout.support for blade in blades):
                return chosen
    return ()


def _unit_versor(layout: Layout, vectors: Sequence[int], random: Random, spread: Fraction) -> Multivector | None:
    algebra = layout.algebra
    product = algebra.scalar(1)

    def vector(size: Fraction) -> Multivector:
        return Multivector(
            algebra, {1 << k: size * Fraction(random.randint(-6, 6), random.randint(1, 3)) for k in vectors}
        )

    for _ in range((len(vectors) + 1) // 2):
        first = vector(Fraction(1))
        product = product * first * (first + vector(spread))
    norm = norm_squared(product).scalar
    return None if norm == 0 else (product * product).map(lambda value: divide(value, norm))


def _versor(layout: Layout, random: Random, spread: Fraction) -> list[Any] | None:
    if 0 not in layout.support:
        return None
    for _ in range(4):
        vectors = _vectors_within(layout, True)
        if len(vectors) < 2:
            vectors = ()
        versor = _unit_versor(layout, vectors, random, spread) if vectors else None
        found = _accepted(layout, versor)
        if found is not None:
            return found
    free = [spread * random_fraction(random) for _ in layout.stored]
    return _accepted(layout, layout.element(free))


def _number(layout: Layout, random: Random, spread: Fraction) -> list[Any] | None:
    """For complex numbers, quaternions and their like: ``x x / (x times its Clifford conjugate)``."""
    x = layout.element([random_fraction(random) * (spread if slot.blade else 1) for slot in layout.stored])
    norm = x * clifford_conjugate(x)
    return _accepted(layout, (x * x).map(lambda value: divide(value, norm.scalar))) if norm.scalar else None


def _blade(layout: Layout, random: Random, spread: Fraction) -> list[Any] | None:
    algebra = layout.algebra
    for slot in layout.stored:
        seed = Multivector(algebra, {slot.blade: 1})
        if grade(slot.blade) == 0 or (seed * ~seed).scalar != 1:
            continue
        for size in range(algebra.dimension, 1, -1):
            for vectors in combinations(range(algebra.dimension), size):
                versor = _unit_versor(layout, vectors, random, spread)
                if versor is None:
                    continue
                found = _accepted(layout, versor * seed * ~versor)
                if found is not None:
                    return found
    return None


def _accepted(layout: Layout, element: Multivector | None) -> list[Any] | None:
    if element is None:
        return None
    try:
        found = list(layout.coefficients(element))
    except LayoutError:
        return None
    return found if all(value == 0 for value in layout.relations(layout.element(found))) else None


def _newton(layout: Layout, random: Random) -> list[Any]:
    """Gauss-Newton from random starts, to `DIGITS` digits."""
    ring = PolynomialRing()
    variables = [ring.variable(name) for name in layout.blades]
    relations = [ring.lift(value) for value in layout.relations(layout.element(variables))]
    relations = [relation for relation in relations if not relation.is_zero]
    with mpmath.workdps(DIGITS + 10):
        for _ in range(20):
            x = [mpmath.mpf(random.uniform(-1, 1)) for _ in variables]
            for _ in range(60):
                values = mpmath.matrix([_value(relation, x) for relation in relations])
                if mpmath.norm(values) < mpmath.mpf(10) ** -DIGITS:
                    return x
                jacobian = mpmath.matrix([[_value(_derivative(r, k), x) for k in range(len(x))] for r in relations])
                try:
                    step = jacobian.T * mpmath.lu_solve(
                        jacobian * jacobian.T + mpmath.mpf(10) ** -40 * mpmath.eye(len(relations)), values
                    )
                except ZeroDivisionError:
                    break
                x = [a - b for a, b in zip(x, step, strict=True)]
    raise InexactError(
        f"layout {layout.name}", "no element that satisfies its relations was found", remedy="check the relations"
    )


def _value(polynomial: Polynomial, x: Sequence[Any]) -> Any:
    total = mpmath.mpf(0)
    for monomial, value in polynomial.terms.items():
        term = mpmath.mpf(value.numerator) / value.denominator
        for variable in monomial:
            term *= x[variable]
        total += term
    return total


def _derivative(polynomial: Polynomial, variable: int) -> Polynomial:
    terms: dict[tuple[int, ...], Any] = {}
    for monomial, value in polynomial.terms.items():
        if variable in monomial:
            rest = list(monomial)
            rest.remove(variable)
            terms[tuple(rest)] = terms.get(tuple(rest), 0) + value * monomial.count(variable)
    return Polynomial(polynomial.ring, {m: v for m, v in terms.items() if v})
