"""Grassmann-Cayley algebra: brackets, join and meet, and the straightening of brackets.

Points are vectors of ``n`` numbers, extensors their outer products; no metric is used. A bracket is a determinant, the
meet a sum of brackets over shuffles (Barnabei, Brini & Rota, *J. Algebra* 96, 1985; Sturmfels, *Algorithms in Invariant
Theory*, 2008, ch. 3).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import cache
from itertools import combinations
from typing import Any

from ..algebra.algebra import Algebra
from ..algebra.catalog import orthogonal
from ..algebra.duality import dual, undual
from ..algebra.factorization import join_and_meet
from ..algebra.multivector import Multivector, sum_of
from ..errors import AlgebraError
from .gibbs import Entry, _named

Monomial = tuple[tuple[Any, ...], ...]
"""A product of brackets: one tuple of letters for each."""
Polynomial = Mapping[Monomial, int | Fraction]
"""A sum of products of brackets with coefficients."""


@cache
def exterior_algebra(n: int) -> Algebra:
    """Return the Grassmann algebra of `n` dimensions, whose geometric product is the outer product."""
    return orthogonal(0, 0, n, f"L({n})")


def extensor(*points: Sequence[Any]) -> Multivector:
    """Return the outer product of points, each `n` numbers: their join, zero if they are dependent."""
    if not points or any(len(point) != len(points[0]) for point in points):
        raise AlgebraError("extensor", "no point, or points of different lengths", "vectors of n numbers each")
    algebra = exterior_algebra(len(points[0]))
    product = algebra.scalar(1)
    for point in points:
        product = product ^ Multivector(algebra, {1 << k: value for k, value in enumerate(point)})
    return product


def bracket(*points: Sequence[Any]) -> Any:
    """Return ``[a b ... ]``, the exact determinant of `n` points of `n` numbers."""
    if not points or len(points) != len(points[0]):
        raise AlgebraError("bracket", f"{len(points)} points of {len(points[0]) if points else 0} numbers", "n of n")
    return extensor(*points)[(1 << len(points)) - 1]


def shuffle_product(a: Sequence[Sequence[Any]], b: Sequence[Sequence[Any]]) -> Multivector:
    """Return the meet of two extensors given by their points, as a sum over the shuffles of the points of `a`.

    With `j` and `k` points in `n` dimensions it is the sum of ``sign [a_1 .. a_(n-k) b_1 .. b_k] a_(n-k+1) ^ .. ^ a_j``
    over all choices of ``n - k`` of the points of `a`; zero for ``j + k < n``. It is the regressive product ``A & B``.
    """
    n, j, k = len(a[0]), len(a), len(b)
    algebra = exterior_algebra(n)
    if j + k < n:
        return Multivector(algebra, {})
    terms = []
    for chosen in combinations(range(j), n - k):
        rest = [i for i in range(j) if i not in chosen]
        factor = _sign([*chosen, *rest]) * bracket(*(a[i] for i in chosen), *b)
        terms.append((extensor(*(a[i] for i in rest)) if rest else algebra.scalar(1)) * factor)
    return sum_of(algebra, terms)


def _meet(a: Multivector, b: Multivector) -> Multivector:
    return a & b


def _union(a: Multivector, b: Multivector) -> Multivector:
    return join_and_meet(a, b)[0]


def _intersection(a: Multivector, b: Multivector) -> Multivector:
    return join_and_meet(a, b)[1]


def _coordinates(x: Sequence[Any], *frame: Sequence[Any]) -> tuple[Fraction, ...]:
    """Return ``x`` as a linear combination of the points of a frame by Cramer's rule, with quotients of brackets."""
    whole = Fraction(bracket(*frame))
    return tuple(Fraction(bracket(*frame[:k], x, *frame[k + 1 :])) / whole for k in range(len(frame)))


def _cross_ratio(a: Sequence[Any], b: Sequence[Any], c: Sequence[Any], d: Sequence[Any]) -> Fraction:
    return Fraction(bracket(a, c) * bracket(b, d)) / Fraction(bracket(a, d) * bracket(b, c))


GRASSMANN_CAYLEY: Mapping[str, Entry] = _named((
    Entry("extensor", "a v b v ...", "a ^ b ^ ...", extensor),
    Entry("bracket", "[a b ... ]", "(a ^ b ^ ...) I**-1", bracket),
    Entry("meet", "A ^ B, a sum over shuffles", "A & B = undual(dual(A) ^ dual(B))", _meet),
    Entry("union of spaces", "A v B of what is not shared", "join(A, B)", _union),
    Entry("intersection of spaces", "A ^ B relative to the union", "meet(A, B)", _intersection),
    Entry("Hodge star", "* A", "dual(A)", dual),
    Entry("inverse star", "*^-1 A", "undual(A)", undual),
    Entry("coordinates", "[.. x ..] / [a b ..]", "(.. ^ x ^ ..) (a ^ b ^ ..)**-1", _coordinates),
    Entry("cross ratio", "[a c] [b d] / ([a d] [b c])", "(a ^ c) (b ^ d) / ((a ^ d) (b ^ c))", _cross_ratio),
))  # fmt: skip
"""Grassmann-Cayley algebra, entry by entry; its join is the outer product of geometric algebra."""


def straighten(polynomial: Polynomial) -> dict[Monomial, int | Fraction]:
    """Return the normal form, by standard tableaux, of a sum of products of brackets; equal sums become identical.

    Letters within brackets and brackets within products are sorted; if a letter of a bracket exceeds the one below, van
    der Waerden's syzygy replaces the two brackets by others that are closer to standard. All relations of brackets
    follow from this (Sturmfels 2008, theorem 3.1.7).

    Parameters
    ----------
    polynomial : mapping
        ``{(("a", "b", "c"), ("d", "e", "f")): 1}`` is ``[a b c] [d e f]``; letters of any ordered type.

    Raises
    ------
    AlgebraError
        For brackets of different lengths.
    """
    lengths = {len(row) for monomial in polynomial for row in monomial}
    if len(lengths) > 1:
        raise AlgebraError("straighten", f"brackets of {sorted(lengths)} letters", "one length")
    left: dict[Monomial, int | Fraction] = {}
    for monomial, value in polynomial.items():
        _add(left, monomial, value)
    found: dict[Monomial, int | Fraction] = {}
    while left:
        monomial = max(left)
        value = left.pop(monomial)
        place = _violation(monomial)
        if place is None:
            found[monomial] = value
            continue
        row, column = place
        for sign, first, second in van_der_waerden(monomial[row], monomial[row + 1], column)[1:]:
            _add(left, (*monomial[:row], first, second, *monomial[row + 2 :]), -sign * value)
    return {monomial: found[monomial] for monomial in sorted(found)}


def van_der_waerden(
    first: Sequence[Any], second: Sequence[Any], column: int
) -> list[tuple[int, tuple[Any, ...], tuple[Any, ...]]]:
    """Return the syzygy of two brackets: signs and pairs of brackets whose products sum to zero, the given pair first.

    The letters of the first bracket from `column` on and those of the second up to it, one more than a bracket has, are
    distributed in all possible ways: the sum is antisymmetric in ``n + 1`` vectors of `n` dimensions, and hence
    vanishes.
    """
    letters = [*first[column:], *second[: column + 1]]
    n_first = len(first) - column
    terms = []
    for chosen in combinations(range(len(letters)), n_first):
        rest = [i for i in range(len(letters)) if i not in chosen]
        one = (*first[:column], *(letters[i] for i in chosen))
        two = (*(letters[i] for i in rest), *second[column + 1 :])
        terms.append((_sign([*chosen, *rest]), one, two))
    return terms


def _violation(monomial: Monomial) -> tuple[int, int] | None:
    for row in range(len(monomial) - 1):
        for column, (above, below) in enumerate(zip(monomial[row], monomial[row + 1], strict=True)):
            if above > below:
                return row, column
    return None


def _add(total: dict[Monomial, int | Fraction], monomial: Sequence[Sequence[Any]], value: int | Fraction) -> None:
    """Add a product of brackets with sorted letters and brackets; it is zero if a bracket repeats a letter."""
    rows = []
    for row in monomial:
        if len(set(row)) < len(row):
            return
        order = sorted(range(len(row)), key=lambda k: row[k])
        value = value * _sign(order)
        rows.append(tuple(row[k] for k in order))
    key = tuple(sorted(rows))
    sum_ = total.get(key, 0) + value
    if sum_:
        total[key] = sum_
    else:
        total.pop(key, None)


def _sign(permutation: Sequence[int]) -> int:
    inversions = sum(a > b for k, a in enumerate(permutation) for b in permutation[k + 1 :])
    return -1 if inversions & 1 else 1
