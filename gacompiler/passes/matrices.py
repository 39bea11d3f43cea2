"""Dense products through matrices: a geometric algebra is an algebra of small matrices, which multiply in fewer steps.

Two anticommuting blades that square to 1 (or a null pair of vectors) generate the real 2 x 2 matrices. Every element is
a 2 x 2 matrix over the blades that commute with both: Cl = M2(R) (x) C, where C is again spanned by blades, and so on
(Lounesto, *Clifford Algebras and Spinors*, 2001, ch. 16; Porteous 1995). One level takes the product of two elements
to eight products of elements of a quarter of the size instead of sixteen, for a few sums on the way in and out.

Zero squares are no obstacle: a degenerate vector stays in C, where products that vanish are not formed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any

from ..algebra.algebra import Algebra
from ..algebra.blades import Rational
from ..algebra.coefficients import is_zero, scale
from ..algebra.multivector import Multivector
from ..algebra.products import product
from ..frontend.expression import Expression, apply_operation, topological

Terms = Mapping[int, Any]
Matrix = tuple[tuple[Rational, Rational], tuple[Rational, Rational]]
Blocks = Any
"""An element without levels left (a mapping of blades), or four of them, row by row."""

SMALLEST = 64
"""Products of fewer pairs of blades than this are left as they are."""
LARGEST_DIMENSION = 8
HUGE = 10_000
"""Products of more pairs of blades than this are only computed through matrices: writing them out takes seconds and
never wins."""


@dataclass(frozen=True)
class Level:
    """One factor M2(R): four elements with their matrices, and where every blade belongs.

    Attributes
    ----------
    places : mapping
        Blade -> (blade of C, number of the matrix element, factor): ``X = factor * z * m``.
    matrices : four 2 x 2 matrices
    duals : four 2 x 2 matrices
        ``c_j = sum(duals[j] * M)`` recovers the parts of a matrix, up to `scales`.
    scales : four numbers
        Factors that recovering still lacks.
    """

    places: Mapping[int, tuple[int, int, Rational]]
    matrices: tuple[Matrix, Matrix, Matrix, Matrix]
    duals: tuple[Matrix, Matrix, Matrix, Matrix]
    scales: tuple[Fraction, Fraction, Fraction, Fraction]


@cache
def levels(algebra: Algebra) -> tuple[Level, ...]:
    """As many levels as there are, null pairs first; none where blades do not multiply to single blades."""
    found: list[Level] = []
    if algebra.dimension > LARGEST_DIMENSION:
        return ()
    space = frozenset(algebra.blades())
    tag = 0  # a vector anticommutes with earlier pairs; times their bivectors it commutes
    for u, v in _null_pairs(algebra):
        first, second, both = u | tag, v | tag, u | v
        product_of_pair = algebra.blade_product(first, second)
        g, w = 2 * product_of_pair[0], product_of_pair[both]
        half = Fraction(g, 2) / w
        outside = [blade for blade in space if not blade & both]
        inside = frozenset(blade if _commute(algebra, blade, first) else blade | both for blade in outside)
        level = _level(
            algebra,
            space,
            inside,
            ({0: 1}, {first: 1}, {second: 1}, {both: 1}),
            (((1, 0), (0, 1)), ((0, 0), (1, 0)), ((0, g), (0, 0)), ((-half, 0), (0, half))),
            (((1, 0), (0, 1)), ((0, 0), (1, 0)), ((0, 1), (0, 0)), ((-1, 0), (0, 1))),
            (Fraction(1, 2), Fraction(1), 1 / Fraction(g), 1 / (2 * half)),
        )
        if level is None:
            return tuple(found)
        found.append(level)
        space, tag = inside, tag | both
    while (pair := _involutions(algebra, space)) is not None:
        a, b = pair
        inside = frozenset(z for z in space if _commute(algebra, z, a) and _commute(algebra, z, b))
        level = _level(
            algebra,
            space,
            inside,
            ({0: 1}, {a: 1}, {b: 1}, algebra.blade_product(a, b)),
            (((1, 0), (0, 1)), ((1, 0), (0, -1)), ((0, 1), (1, 0)), ((0, 1), (-1, 0))),
            (((1, 0), (0, 1)), ((1, 0), (0, -1)), ((0, 1), (1, 0)), ((0, 1), (-1, 0))),
            (Fraction(1, 2),) * 4,
        )
        if level is None:
            break
        found.append(level)
        space = inside
    return tuple(found)


def _null_pairs(algebra: Algebra) -> Iterator[tuple[int, int]]:
    """Pairs of null vectors that see each other and nothing else."""
    for i, row in enumerate(algebra.gram):
        partners = [j for j, value in enumerate(row) if value]
        if len(partners) == 1 and partners[0] > i and [k for k, x in enumerate(algebra.gram[partners[0]]) if x] == [i]:
            yield 1 << i, 1 << partners[0]


def _involutions(algebra: Algebra, space: frozenset[int]) -> tuple[int, int] | None:
    """The first two blades that square to 1 and anticommute."""
    ones = [b for b in sorted(space, key=lambda b: (b.bit_count(), b)) if b and algebra.blade_product(b, b) == {0: 1}]
    return next(((a, b) for k, a in enumerate(ones) for b in ones[k + 1 :] if _anticommute(algebra, a, b)), None)


def _commute(algebra: Algebra, a: int, b: int) -> bool:
    return algebra.blade_product(a, b) == algebra.blade_product(b, a)


def _anticommute(algebra: Algebra, a: int, b: int) -> bool:
    ab, ba = algebra.blade_product(a, b), algebra.blade_product(b, a)
    return len(ab) == 1 and all(ba.get(blade) == -value for blade, value in ab.items())


def _level(
    algebra: Algebra, space: frozenset[int], inside: frozenset[int], elements: Sequence[Mapping[int, Rational]],
    matrices: Any, duals: Any, scales: Any,
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
    return Level(places, matrices, duals, scales) if set(places) == space else None


def matrix_product(algebra: Algebra, a: Terms, b: Terms, depth: int, possible: Iterable[int]) -> dict[int, Any]:
    """The geometric product of two sums of blades through `depth` levels of 2 x 2 matrices.

    Only the `possible` blades are formed: sums that cancel for every element (odd blades in a product of even ones) do
    not cancel by their form.
    """
    chosen = levels(algebra)[:depth]
    blocks = _multiply(algebra, _to_blocks(chosen, a), _to_blocks(chosen, b), depth)
    values, scales = _from_blocks(chosen, blocks)
    result = {blade: scale(values[blade], scales[blade]) for blade in sorted(possible) if blade in values}
    return {blade: value for blade, value in result.items() if not is_zero(value)}


def _to_blocks(chosen: Sequence[Level], terms: Terms) -> Blocks:
    if not chosen:
        return terms
    level = chosen[0]
    parts: list[dict[int, Any]] = [{}, {}, {}, {}]
    for blade, value in terms.items():
        z, j, factor = level.places[blade]
        parts[j][z] = scale(value, factor)
    return tuple(
        _to_blocks(chosen[1:], _combined([(parts[j], level.matrices[j][row][column]) for j in range(4)]))
        for row in (0, 1)
        for column in (0, 1)
    )


def _combined(parts: Sequence[tuple[Terms, Rational]]) -> dict[int, Any]:
    total: dict[int, Any] = {}
    for terms, factor in parts:
        if factor:
            for blade, value in terms.items():
                term = scale(value, factor)
                total[blade] = total[blade] + term if blade in total else term
    return total


def _multiply(algebra: Algebra, a: Blocks, b: Blocks, depth: int) -> Blocks:
    if depth == 0:
        return product(algebra, "geometric_product", a, b)
    products = [
        [_multiply(algebra, a[2 * row + k], b[2 * k + column], depth - 1) for k in (0, 1)]
        for row in (0, 1)
        for column in (0, 1)
    ]
    return tuple(_added(x, y, depth - 1) for x, y in products)


def _added(a: Blocks, b: Blocks, depth: int) -> Blocks:
    if depth == 0:
        return _combined([(a, 1), (b, 1)])
    return tuple(_added(x, y, depth - 1) for x, y in zip(a, b, strict=True))


def _from_blocks(chosen: Sequence[Level], blocks: Blocks) -> tuple[dict[int, Any], Mapping[int, Rational]]:
    """Coefficients, and the factors that they still lack."""
    if not chosen:
        return dict(blocks), _Ones()
    level = chosen[0]
    inner = [_from_blocks(chosen[1:], block) for block in blocks]
    inner_scales = inner[0][1]
    parts = [
        _combined([(inner[2 * row + column][0], level.duals[j][row][column]) for row in (0, 1) for column in (0, 1)])
        for j in range(4)
    ]
    values: dict[int, Any] = {}
    scales: dict[int, Rational] = {}
    for blade, (z, j, factor) in level.places.items():
        scales[blade] = inner_scales[z] * level.scales[j] / factor
        if z in parts[j]:
            values[blade] = parts[j][z]
    return values, scales


class _Ones(dict[int, Rational]):
    """The factor 1 for every blade."""

    def __missing__(self, blade: int) -> Rational:
        return 1


def evaluate_by_matrices(
    expressions: Sequence[Expression], inputs: Mapping[str, Any], lift: Any, depth: int
) -> list[Multivector] | None:
    """As `gacompiler.frontend.expression.evaluate`, large products by matrices; None where there is none."""
    memory: dict[Expression, Multivector] = {}
    used = False
    for expression in topological(expressions):
        values = [memory[argument] for argument in expression.arguments]
        if (
            expression.operation == "geometric_product"
            and _is_large(values)
            and len(levels(values[0].algebra)) >= depth
        ):
            used = True
            terms = matrix_product(expression.algebra, values[0].terms, values[1].terms, depth, expression.blades)
            memory[expression] = Multivector(expression.algebra, terms)
        else:
            memory[expression] = apply_operation(expression, values, inputs, lift)
    return [memory[expression] for expression in expressions] if used else None


def has_huge_product(expressions: Sequence[Expression]) -> bool:
    """Whether some product is better not written out, because matrices will do."""
    return any(
        expression.operation == "geometric_product"
        and len(expression.arguments[0].blades) * len(expression.arguments[1].blades) > HUGE
        and len(levels(expression.algebra)) > 0
        for expression in topological(expressions)
    )


def _is_large(values: Sequence[Multivector]) -> bool:
    a, b = values
    return a.algebra == b.algebra and len(a.terms) * len(b.terms) >= SMALLEST
