"""Geometric algebras as matrix algebras: decomposition into levels of matrices, halves and complex numbers.

This is the only module that derives matrices from blades: the optimiser multiplies large products through them
(`gacompiler.passes.matrices`), and `gacompiler.structure.representation` computes the matrices of generators from them.

Two anticommuting blades that square to 1 (or a null pair of vectors) generate the real 2 x 2 matrices. Every element is
a 2 x 2 matrix over the blades that commute with both: Cl = M2(R) (x) C, where C is again spanned by blades, and so on
(Lounesto, *Clifford Algebras and Spinors*, 2001, ch. 16; Porteous 1995). A blade that commutes with all elements and
squares to 1 splits an algebra into two independent halves.

The relevant algebra is the one that the factors generate: even elements have matrices of their own.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

from ..algebra.algebra import Algebra
from ..algebra.blades import Rational, exact
from ..algebra.coefficients import EXACT
from ..errors import InexactError

Row = tuple[Rational, ...]

LARGEST_DIMENSION = 8
COMPLEX_SIZES = range(16, 65)
"""Dimensions of complex algebras in which three products of half the size are tried instead of four."""


@dataclass(frozen=True)
class Kind:
    """The composition of blocks from the parts of an element, and the multiplication of blocks.

    Attributes
    ----------
    entries : tuple of rows
        Block ``k`` is the sum of the parts times row ``k``.
    products : tuple of tuples of pairs
        Block ``k`` of a product is the sum of the products of these blocks.
    duals : tuple of rows
        Part ``j`` is the sum of the blocks times row ``j``, up to `scales`.
    scales : tuple of numbers
        Remaining factors for the recovery.
    """

    entries: tuple[Row, ...]
    products: tuple[tuple[tuple[int, int], ...], ...]
    duals: tuple[Row, ...]
    scales: Row


@dataclass(frozen=True)
class Level:
    """One factor M2(R), or one splitting into halves, with the place of every blade.

    Attributes
    ----------
    places : mapping
        Blade -> (blade of C, number of the part, factor): ``X = factor * z * m``.
    kind : Kind
    opposite : set of int
        For `NILPOTENT`, the blades of C that anticommute with n.
    """

    places: Mapping[int, tuple[int, int, Rational]]
    kind: Kind
    opposite: frozenset[int] = frozenset()


_HALF = Fraction(1, 2)
MATRIX = tuple(((2 * row, column), (2 * row + 1, column + 2)) for row in (0, 1) for column in (0, 1))
INVOLUTIONS = Kind(
    ((1, 1, 0, 0), (0, 0, 1, 1), (0, 0, 1, -1), (1, -1, 0, 0)),
    MATRIX,
    ((1, 0, 0, 1), (1, 0, 0, -1), (0, 1, 1, 0), (0, 1, -1, 0)),
    (_HALF,) * 4,
)
"""Parts of 1, a, b, ab, where a and b square to 1 and anticommute: a is diagonal."""
HALVES = Kind(((1, 1), (1, -1)), (((0, 0),), ((1, 1),)), ((1, 1), (1, -1)), (_HALF,) * 2)
"""Parts of 1 and of a central z with z z = 1."""
NILPOTENT = Kind(((1, 0), (0, 1)), (((0, 0),), ((0, 1), (1, 2))), ((1, 0), (0, 1)), (1, 1))
"""Parts of 1 and of an n with n n = 0. In a second factor ``z + w n``, block 2 is the ``z'`` with ``n z = z' n``: a
product of two elements takes three products of half the size."""
COMPLEX = Kind(((1, 0), (0, 1)), (), ((1, 0), (0, 1)), (1, 1))
"""Parts of 1 and of a central z with z z = -1; see `_three_products`."""


def _null_pair(g: Rational, half: Rational) -> Kind:
    """Return the parts of 1, u, v and their outer product, where u and v are null and ``u v + v u = g``."""
    return Kind(
        ((1, 0, 0, -half), (0, 0, g, 0), (0, 1, 0, 0), (1, 0, 0, half)),
        MATRIX,
        ((1, 0, 0, 1), (0, 0, 1, 0), (0, 1, 0, 0), (-1, 0, 0, 1)),
        (_HALF, 1, 1 / Fraction(g), 1 / (2 * Fraction(half))),
    )


@cache
def tower(algebra: Algebra) -> tuple[tuple[Level, ...], frozenset[int]]:
    """Return all levels of the whole algebra in order, and the blades that no level decomposes.

    These span the real numbers, the complex numbers or the quaternions if the metric is not degenerate. Levels require
    blades whose products are blades, that is, an orthogonal basis or null pairs; otherwise there are no levels.
    """
    everything = frozenset(algebra.blades())
    levels = _levels(algebra, (everything,), everything)
    return levels, frozenset(z for z, _, _ in levels[-1].places.values()) if levels else everything


@cache
def plans(algebra: Algebra, *factors: frozenset[int]) -> tuple[tuple[Level, ...], ...]:
    """Return decompositions of products of factors with given blades into products of matrices.

    Each plan applies one level after the other. The first plan is for the algebra that the factors generate; it is
    empty if products of blades are not blades, or if nothing is gained. Null pairs need the whole algebra. A central
    blade that squares to -1 makes the numbers complex; they are multiplied with three products. Degenerate vectors are
    separated first in the last plans.
    """
    if algebra.dimension > LARGEST_DIMENSION:
        return ()
    everything = frozenset(algebra.blades())
    given = factors or (everything,)
    space = _generated(algebra, frozenset[int]().union(*given))
    found = [_levels(algebra, given, space)]
    if space != everything:
        found.append(_levels(algebra, (everything,), everything))
    imaginary = _central(algebra, _of_square(algebra, space, -1), space)
    if imaginary is not None and len(space) in COMPLEX_SIZES:
        rests = [
            (*split[:1], *_levels(algebra, given, split[1])) for split in _splits(algebra, space, imaginary, COMPLEX)
        ]
        found += sorted(rests, key=len)[-1:]
    split, rest = _nilpotent_levels(algebra, space)
    inner = _levels(algebra, (rest,), rest) if split else ()
    if inner:
        found.append((*split, *inner))
    return tuple(plan for k, plan in enumerate(found) if plan and plan not in found[:k])


def _nilpotent_levels(algebra: Algebra, space: frozenset[int]) -> tuple[tuple[Level, ...], frozenset[int]]:
    """Return levels that separate the blades with degenerate vectors, one after the other, and the remaining blades."""
    found: list[Level] = []
    for k in reversed([k for k, row in enumerate(algebra.gram) if not any(row)]):
        inside = frozenset(blade for blade in space if not blade >> k & 1)
        for n in sorted(space - inside, key=lambda blade: (blade.bit_count(), blade)):
            level = _level(algebra, space, inside, ({0: 1}, {n: 1}), NILPOTENT)
            if level is not None:
                opposite = frozenset(z for z in inside if not _commute(algebra, z, n))
                found.append(Level(level.places, NILPOTENT, opposite))
                space = inside
                break
    return tuple(found), space


@cache
def _generated(algebra: Algebra, blades: frozenset[int]) -> frozenset[int]:
    """Return the blades of all products of some blades."""
    found, new = {0}, {0}
    while new:
        reached = {c for a in new for b in blades for c in algebra.blade_product(a, b)}
        new = reached - found
        found |= new
        if len(found) == 1 << algebra.dimension:
            break
    return frozenset(found)


@cache
def _levels(algebra: Algebra, factors: tuple[frozenset[int], ...], space: frozenset[int]) -> tuple[Level, ...]:
    found: list[Level] = []
    tag = 0  # a vector anticommutes with earlier pairs; times their bivectors it commutes
    for i, j in algebra.null_pairs:
        u, v = 1 << i, 1 << j
        first, second, both = u | tag, v | tag, u | v
        if not {first, second, both} <= space:
            continue
        product_of_pair = algebra.blade_product(first, second)
        g, w = 2 * product_of_pair[0], product_of_pair[both]
        outside = [blade for blade in space if not blade & both]
        inside = frozenset(blade if _commute(algebra, blade, first) else blade | both for blade in outside)
        kind = _null_pair(g, Fraction(g, 2) / w)
        level = _level(algebra, space, inside, ({0: 1}, {first: 1}, {second: 1}, {both: 1}), kind)
        if level is None:
            return tuple(found)
        found.append(level)
        space, tag = inside, tag | both
    while (level_and_rest := _next_level(algebra, factors, space)) is not None:
        level, space = level_and_rest
        found.append(level)
    return tuple(found)


def _next_level(
    algebra: Algebra, factors: Sequence[frozenset[int]], space: frozenset[int]
) -> tuple[Level, frozenset[int]] | None:
    """Return a level without null pairs, and the remaining blades."""
    ones = _of_square(algebra, space, 1)
    centre = _central(algebra, ones, space)
    if centre is not None:
        return next(_splits(algebra, space, centre, HALVES), None)
    pair = _involutions(algebra, factors, ones, space)
    if pair is None:
        return None
    a, b = pair
    inside = frozenset(z for z in space if _commute(algebra, z, a) and _commute(algebra, z, b))
    unit_a, unit_b = _unit(algebra, a), _unit(algebra, b)
    both = {ab: x * unit_a[a] * unit_b[b] for ab, x in algebra.blade_product(a, b).items()}
    level = _level(algebra, space, inside, ({0: 1}, unit_a, unit_b, both), INVOLUTIONS)
    return None if level is None else (level, inside)


def _of_square(algebra: Algebra, space: frozenset[int], square: int) -> list[int]:
    """Return the blades whose square has the given sign and a rational root, except 1 itself, by grade."""
    ordered = sorted(space, key=lambda blade: (blade.bit_count(), blade))
    return [blade for blade in ordered if blade and _unit(algebra, blade, square)]


def _unit(algebra: Algebra, blade: int, sign: int = 0) -> dict[int, Rational]:
    """Return the multiple of a blade whose square is 1 or -1, or nothing if it is irrational or has another sign."""
    square: Mapping[int, Rational] = algebra.blade_product(blade, blade)
    if set(square) != {0} or sign * square[0] < 0:
        return {}
    size = root(square[0] if square[0] > 0 else -square[0])
    return {blade: exact(1 / size)} if size else {}


def root(value: Rational) -> Fraction | None:
    """Return the square root of a number that is not negative, or None if it is irrational."""
    try:
        return Fraction(EXACT["sqrt"](value))
    except InexactError:
        return None


def _central(algebra: Algebra, blades: Iterable[int], space: frozenset[int]) -> int | None:
    """Return the first of some blades that commutes with all of `space`."""
    return next((z for z in blades if all(_commute(algebra, z, blade) for blade in space)), None)


def _splits(algebra: Algebra, space: frozenset[int], centre: int, kind: Kind) -> Iterator[tuple[Level, frozenset[int]]]:
    """Return levels of a central blade, and the blades without one of its vectors, the last one first."""
    for k in reversed(range(centre.bit_length())):
        if centre >> k & 1:
            inside = frozenset(blade for blade in space if not blade >> k & 1)
            level = _level(algebra, space, inside, ({0: 1}, _unit(algebra, centre)), kind)
            if level is not None:
                yield level, inside


def _involutions(
    algebra: Algebra, factors: Sequence[frozenset[int]], ones: Sequence[int], space: frozenset[int]
) -> tuple[int, int] | None:
    """Return two anticommuting blades that square to 1; the first, diagonal one commutes with the most of a factor.

    Off-diagonal blocks are then empty.
    """
    sparse = [factor for factor in factors if len(factor) < len(space)]

    def rank(a: int) -> tuple[int, int]:
        commuting = max(sum(_commute(algebra, a, blade) for blade in factor) for factor in sparse)
        return -commuting, -sum(a in factor for factor in sparse)

    ordered = sorted(ones, key=rank) if sparse else ones
    return next(((a, b) for a in ordered for b in ordered if _anticommute(algebra, a, b)), None)


def _commute(algebra: Algebra, a: int, b: int) -> bool:
    return algebra.blade_product(a, b) == algebra.blade_product(b, a)


def _anticommute(algebra: Algebra, a: int, b: int) -> bool:
    ab, ba = algebra.blade_product(a, b), algebra.blade_product(b, a)
    return len(ab) == 1 and all(ba.get(blade) == -value for blade, value in ab.items())


def _level(
    algebra: Algebra, space: frozenset[int], inside: frozenset[int], elements: Sequence[Mapping[int, Rational]],
    kind: Kind,
) -> Level | None:  # fmt: skip
    places: dict[int, tuple[int, int, Rational]] = {}
    for z in sorted(inside):
        for j, element in enumerate(elements):
            ((m, sign),) = element.items()
            found = algebra.blade_product(z, m)
            if len(found) != 1:
                return None
            ((blade, factor),) = found.items()
            places[blade] = (z, j, 1 / Fraction(factor * sign))
    return Level(places, kind) if set(places) == space else None
