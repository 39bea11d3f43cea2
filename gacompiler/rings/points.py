"""Points of a layout: random stored coefficients that satisfy its relations.

Exact rational points are constructed geometrically: the square of a product of vectors, divided by its norm, is a unit
versor with rational coefficients, and the sandwich product of these versors with a unit blade is a unit blade. For
relations of other kinds, a point is computed to many digits by Gauss-Newton iteration.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, partial
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
from .residues import PRIME, Residue

POOL = 128
"""Number of points of a layout with relations, for each spread."""
DIGITS = 60
"""Working precision of points that are not rational, in decimal digits."""


def random_fraction(random: Random) -> Fraction:
    """Return a random rational that is not zero, and for which ``x * x`` and ``x + x`` differ."""
    return _scaled(*_drawn(random), Fraction(1))


def _drawn(random: Random) -> tuple[int, int]:
    """Return ``choice((-1, 1)) * randint(11, 97)`` and ``choice((1, 2, 3, 5, 7))``, in a third of the time."""
    below = _below(random, 2), _below(random, 87), _below(random, 5)
    return (2 * below[0] - 1) * (11 + below[1]), (1, 2, 3, 5, 7)[below[2]]


def _below(random: Random, n: int) -> int:
    bits = n.bit_length()
    found = random.getrandbits(bits)
    while found >= n:
        found = random.getrandbits(bits)
    return found


@cache
def _scaled(numerator: int, denominator: int, spread: Fraction) -> Fraction:
    """Return one of the few free coefficients of points; kernels on many numbers draw tens of thousands."""
    return spread * Fraction(numerator, denominator)


def point(
    layout: Layout,
    random: Random,
    *,
    spread: Fraction = Fraction(1),
    near_one: bool = False,
    whole: bool = False,
    taken: set[int] | None = None,
) -> list[Any]:
    """Return random stored coefficients of an element of `layout`, Fractions if possible, else mpmath numbers.

    `spread` scales free coefficients, and the distance of versors from 1. `near_one` limits magnitudes, for the
    measurement of rounding errors. `whole` makes free coefficients integers, whose products are many times faster. The
    index of a point that is drawn from a pool is not in `taken`, and is added to it.
    """
    if not layout.has_relations and whole:
        return [random.randint(-(10**6), 10**6) for _ in layout.stored]
    if not layout.has_relations:
        if near_one:
            return [spread * Fraction(random.randint(-2000, 2000), 1000) for _ in layout.stored]
        return [_scaled(*_drawn(random), spread) for _ in layout.stored]
    taken = set() if taken is None else taken
    number = random.choice([k for k in range(POOL) if k not in taken] or [0])
    taken.add(number)
    return list(_from_pool(layout, spread, number))


def wide_point(layout: Layout, random: Random) -> list[Any] | None:
    """Return stored coefficients modulo a large prime, or None if the elements have no rational parametrisation.

    They are rational functions of parameters that are uniformly distributed. A rational function of the coefficients
    that is not zero on the elements of the layout is therefore zero at the point with a probability of at most its
    degree in the parameters divided by the prime.
    """
    if not layout.has_relations:
        return [_residue(random) for _ in layout.stored]
    make = _best_maker(layout)
    return make(layout, random, Fraction(1), _residue) if make else None


@cache
def _from_pool(layout: Layout, spread: Fraction, number: int) -> tuple[Any, ...]:
    """Return a point of a layout with relations. Points are expensive to construct, and are shared by all kernels."""
    random, make = Random(number), _best_maker(layout)
    found = make(layout, random, spread, None) if make else None
    return tuple(_newton(layout, random) if found is None else found)


def _small(random: Random) -> Fraction:
    return Fraction(random.choice((-1, 1)) * random.randint(1, 6), random.randint(1, 3))


def _residue(random: Random) -> Residue:
    return Residue(random.randrange(1, PRIME))


@dataclass(frozen=True, slots=True)
class Recipe:
    """Parameters of the construction of a unit versor, the square of a product of pairs of vectors divided by its norm.

    Attributes
    ----------
    vectors : tuple of int
        The basis vectors that are used.
    n_pairs : int
        Number of pairs.
    fixed : int or None
        A basis vector that is the first of every pair.
    """

    vectors: tuple[int, ...]
    n_pairs: int
    fixed: int | None = None


def _recipes(layout: Layout) -> Iterator[Recipe]:
    """Yield products of fewer and fewer general vectors, of a basis vector and a general one, and in a subspace."""
    everything = tuple(range(layout.algebra.dimension))
    for n_pairs in range((len(everything) + 1) // 2, 0, -1):
        yield Recipe(everything, n_pairs)
    for k in everything:
        yield Recipe(everything, 1, k)
    for size in range(len(everything) - 1, 1, -1):
        for chosen in combinations(everything, size):
            blades = (sum(1 << k for k in pair) for r in range(0, size + 1, 2) for pair in combinations(chosen, r))
            if all(blade in layout.support for blade in blades):
                yield Recipe(chosen, (size + 1) // 2)
                return


Draw = Callable[[Random], Any]
"""Draws a parameter."""
Maker = Callable[[Layout, Random, Fraction, "Draw | None"], "list[Any] | None"]
"""Makes an element from parameters; they are small rational numbers if no other ones are drawn."""


@cache
def _best_maker(layout: Layout) -> Maker | None:
    """Return the first method that gives elements of the layout with the largest number of nonzero coefficients.

    Elements with zeros would test only a part of a kernel.
    """
    best: tuple[int, Maker] | None = None
    makers: list[Maker] = [_free]
    if 0 in layout.support:
        makers += [partial(_by_recipe, recipe) for recipe in _recipes(layout)]
    for make in (*makers, _blade, _number):
        found = make(layout, Random(1), Fraction(1), None)
        filled = sum(value != 0 for value in found or ())
        if found is not None and (best is None or filled > best[0]):
            best = filled, make
        if filled == layout.size:
            break
    return best[1] if best else None


def _free(layout: Layout, random: Random, spread: Fraction, draw: Draw | None) -> list[Any] | None:
    """Return random coefficients, if the relations hold for all coefficients, as for translators; else None."""
    draw = draw or random_fraction
    return _accepted(layout, layout.element([spread * draw(random) for _ in layout.stored]))


def _by_recipe(recipe: Recipe, layout: Layout, random: Random, spread: Fraction, draw: Draw | None) -> list[Any] | None:
    for _ in range(4):
        found = _accepted(layout, _unit_versor(layout, recipe, random, spread, draw or _small))
        if found is not None:
            return found
    return None


def _unit_versor(layout: Layout, recipe: Recipe, random: Random, spread: Fraction, draw: Draw) -> Multivector | None:
    algebra = layout.algebra
    product = algebra.scalar(1)

    def vector(size: Fraction) -> Multivector:
        return Multivector(algebra, {1 << k: size * draw(random) for k in recipe.vectors})

    for _ in range(recipe.n_pairs):
        first = vector(Fraction(1)) if recipe.fixed is None else Multivector(algebra, {1 << recipe.fixed: 1})
        product = product * first * (first + vector(spread))
    norm = norm_squared(product).scalar
    return None if norm == 0 else (product * product).map(lambda value: divide(value, norm))


def _number(layout: Layout, random: Random, spread: Fraction, draw: Draw | None) -> list[Any] | None:
    """Return ``x x / (x times its Clifford conjugate)``, for complex numbers, quaternions and similar layouts."""
    draw = draw or random_fraction
    x = layout.element([draw(random) * (spread if slot.blade else 1) for slot in layout.stored])
    norm = x * clifford_conjugate(x)
    return _accepted(layout, (x * x).map(lambda value: divide(value, norm.scalar))) if norm.scalar else None


def _blade(layout: Layout, random: Random, spread: Fraction, draw: Draw | None) -> list[Any] | None:
    algebra = layout.algebra
    for slot in layout.stored:
        seed = Multivector(algebra, {slot.blade: 1})
        if grade(slot.blade) == 0 or (seed * ~seed).scalar != 1:
            continue
        for size in range(algebra.dimension, 1, -1):
            for vectors in combinations(range(algebra.dimension), size):
                versor = _unit_versor(layout, Recipe(vectors, (size + 1) // 2), random, spread, draw or _small)
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
    return found if layout.relations_hold(layout.element(found)) else None


def _newton(layout: Layout, random: Random) -> list[Any]:
    """Return a point computed by Gauss-Newton iteration from random initial points, to `DIGITS` digits.

    Raises
    ------
    InexactError
        If no point is found.
    """
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
