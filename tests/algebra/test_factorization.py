"""Factors, join, meet and kinds of single elements, over exact rationals; sympy's subspaces are the truth."""

from __future__ import annotations

from fractions import Fraction
from functools import reduce
from itertools import pairwise
from random import Random

import numpy as np
import pytest
import sympy
from exact_elements import ALGEBRAS, GRASSMANN, NON_DEGENERATE, NULL_PAIRS, TEN, WITH_VERSORS

from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CGA3, PGA3, STA, VGA3, orthogonal
from gacompiler.algebra.classification import Kind, classify
from gacompiler.algebra.factorization import (
    delta_product,
    factorize_blade,
    factorize_versor,
    join,
    join_and_meet,
    meet,
    spanning_vectors,
    split_bivector,
)
from gacompiler.algebra.multivector import Multivector
from gacompiler.algebra.versors import commutator, inverse
from gacompiler.errors import AlgebraError, InexactError
from gacompiler.rings.polynomial import PolynomialRing
from tests.support.all_cases import all_cases

Rows = list[list[int]]


def vector(algebra: Algebra, row: list[int] | list[Fraction]) -> Multivector:
    return Multivector(algebra, {1 << i: value for i, value in enumerate(row)})


def wedge(algebra: Algebra, rows: Rows) -> Multivector:
    return reduce(lambda a, b: a ^ b, (vector(algebra, row) for row in rows), algebra.scalar(1))


def rows_of(random: Random, count: int, n: int) -> Rows:
    """Independent integer vectors."""
    while True:
        rows = [[random.randint(-4, 4) for _ in range(n)] for _ in range(count)]
        if sympy.Matrix(count, n, [x for row in rows for x in row]).rank() == count:
            return rows


def span(vectors: tuple[Multivector, ...] | list[Multivector], n: int) -> sympy.Matrix:
    """The reduced rows of a subspace: equal exactly where subspaces are."""
    matrix = sympy.Matrix([[sympy.Rational(v[1 << i]) for i in range(n)] for v in vectors]) if vectors else None
    return sympy.zeros(0, n) if matrix is None else matrix.rref()[0][: matrix.rank(), :]


@all_cases("algebra", ALGEBRAS)
def test_a_blade_is_the_outer_product_of_its_factors(algebra: Algebra) -> None:
    random = Random(algebra.name)
    n = algebra.dimension
    for k in range(min(n, 5) + 1):
        rows = rows_of(random, k, n)
        blade = wedge(algebra, rows) * Fraction(random.choice((-3, 2)), 7)
        found = factorize_blade(blade)
        assert reduce(lambda a, b: a ^ b, found.vectors, algebra.scalar(found.scale)) == blade
        assert span(found.vectors, n) == span([vector(algebra, row) for row in rows], n)
        assert abs(found.scale) == max(abs(value) for value in blade.terms.values())


def test_factors_of_polynomials_need_no_division() -> None:
    ring = PolynomialRing()
    x = [ring.variable(f"x{i}") for i in range(8)]
    a, b = (Multivector(PGA3, {1 << i: x[4 * r + i] for i in range(4)}) for r in range(2))
    blade = a ^ b
    first, second = spanning_vectors(blade)
    pivot = next(iter(blade.terms.values()))
    assert (first ^ second) == blade.map(lambda value: value * pivot)


@pytest.mark.parametrize(
    ("element", "words"),
    [
        (VGA3.multivector({"e1": 1, "e12": 1}), "grades"),
        (orthogonal(4).multivector({"e1e2": 1, "e3e4": 1}), "not an outer product"),
        (VGA3.scalar(0), "zero"),
    ],
    ids=["grades", "isoclinic", "zero"],
)
def test_elements_that_are_not_blades_are_rejected(element: Multivector, words: str) -> None:
    with pytest.raises(AlgebraError, match=words):
        factorize_blade(element)
    with pytest.raises(AlgebraError, match=words):
        join(element, element.lift(1) * element.algebra.basis()[0])


def test_mixed_algebras_are_rejected() -> None:
    with pytest.raises(AlgebraError, match="VGA3 and PGA3"):
        meet(VGA3.basis()[0], PGA3.basis()[0])


@pytest.mark.parametrize("algebra", ALGEBRAS, ids=lambda a: a.name)
def test_join_and_meet_are_sum_and_intersection(algebra: Algebra) -> None:
    random = Random(algebra.name)
    n = algebra.dimension
    for shared, left, right in ((0, 1, 1), (1, 1, 1), (1, 0, 2), (2, 0, 0), (0, 0, 2), (1, 1, 0), (2, 1, 1), (0, 2, 2)):
        if shared + left + right > n:
            continue
        rows = rows_of(random, shared + left + right, n)
        common, one, two = rows[:shared], rows[shared : shared + left], rows[shared + left :]
        a, b = wedge(algebra, common + one), wedge(algebra, two + common) * 3
        joined, met = join_and_meet(a, b)
        assert span(spanning_vectors(joined), n) == span([vector(algebra, row) for row in rows], n)
        assert span(spanning_vectors(met), n) == span([vector(algebra, row) for row in common], n)
        # the scale: b = meet ^ c and join = a ^ c
        c = reduce(lambda u, v: u ^ v, (vector(algebra, row) for row in two), algebra.scalar(1))
        factor = next(value / Fraction((met ^ c)[blade]) for blade, value in b.terms.items())
        assert b == (met ^ c) * factor
        assert joined == (a ^ c) * factor


def test_the_dimension_is_right_for_floats_up_to_the_tolerance() -> None:
    e1, e2, e3 = VGA3.basis()
    for size in (1e-8, 1.0, 1e8):
        plane = (e1 ^ e2) * (size * 1.0)
        assert join(plane, e1 + e3 * 1e-6).grades == (3,)
        assert join(plane, e1 + e3 * 1e-12).grades == (2,)


def test_delta_product_of_subspaces() -> None:
    random = Random(7)
    algebra = orthogonal(5)
    rows = rows_of(random, 4, 5)
    a, b = wedge(algebra, rows[:3]), wedge(algebra, rows[1:])
    assert delta_product(a, b).grades == (2,)
    joined, met = join_and_meet(a, b)
    assert joined.grades[0] - met.grades[0] == 2
    assert delta_product(*GRASSMANN.basis()[:2]).grades == (2,)
    assert not delta_product(GRASSMANN.basis()[0], GRASSMANN.basis()[0]).terms


@pytest.mark.parametrize("algebra", WITH_VERSORS, ids=lambda a: a.name)
def test_a_versor_is_the_product_of_its_factors(algebra: Algebra) -> None:
    random = Random(algebra.name)
    n = algebra.dimension
    for k in range(min(n, 4) + 2):
        vectors: list[Multivector] = []
        while len(vectors) < k:
            v = vector(algebra, [random.randint(-3, 3) for _ in range(n)])
            if (v * v).scalar != 0:
                vectors.append(v)
        versor = reduce(lambda a, b: a * b, vectors, algebra.scalar(Fraction(-2, 3)))
        found = factorize_versor(versor)
        assert reduce(lambda a, b: a * b, found.vectors, algebra.scalar(found.scale)) == versor
        assert all((v * v).scalar != 0 for v in found.vectors)
        assert len(found.vectors) <= (k if algebra in NON_DEGENERATE else n)


def test_versors_whose_directions_are_all_null() -> None:
    """Scherk's exception: two reflections more than directions that change."""
    w1, w2, _, _ = NULL_PAIRS.basis()
    translator = PGA3.multivector({"1": 1, "e01": Fraction(3, 2)})
    two_null = Algebra("TWO", "e1 e2 n m", [1, 1, 0, 0])
    for versor, count in (
        (1 + w1 * w2, 4),
        (translator, 2),
        (1 + two_null.basis()[2] * two_null.basis()[3] * 5, 4),
    ):
        found = factorize_versor(versor)
        assert len(found.vectors) == count
        assert reduce(lambda a, b: a * b, found.vectors, versor.lift(found.scale)) == versor


@all_cases("size", [1e-14, 1e-6, 1.0, 1e6, 1e14])
def test_factors_of_floats_in_any_unit(size: float) -> None:
    """Products of vectors, one of them near to null, and what is no product of any."""
    e1, e2, e3, e0, einf = CGA3.basis()
    vectors = [0.3 * e1 + 0.7 * e2 - 0.2 * e0, 0.5 * e2 + 0.1 * e3 + 0.3 * einf, e0 + 0.1 * e1, e1 - 0.4 * e3 + einf]
    for count in (1, 2, 3, 4):
        versor = size * reduce(lambda a, b: a * b, vectors[:count])
        found = factorize_versor(versor)
        product = reduce(lambda a, b: a * b, found.vectors, CGA3.scalar(1)) * found.scale
        assert len(found.vectors) == count
        assert all(abs(value) < 1e-12 * size for value in (product - versor).terms.values())
    with pytest.raises(AlgebraError, match="versor"):
        factorize_versor(size * (1 + 0.5 * (e1 ^ e2) + 0.3 * e3))


@all_cases(
    "element",
    [
        VGA3.multivector({"1": 1, "e1": 1}),
        STA.multivector({"g0": 1, "g1": 1}),
        orthogonal(4).multivector({"1": 1, "e1e2e3e4": 2}),
        orthogonal(6).multivector({"1": 1, "e1e2": 1, "e3e4": 1}),
        PGA3.multivector({"1": 1, "e0123": 1}),
        CGA3.multivector({"e1": 0.6, "e2": -0.2, "e3": 0.7, "e0": 1.0, "einf": (0.6**2 + 0.2**2 + 0.7**2) / 2}),
        VGA3.scalar(0),
    ],
)
def test_elements_that_are_not_versors_are_rejected(element: Multivector) -> None:
    with pytest.raises(AlgebraError, match="versor"):
        factorize_versor(element)


def test_kinds() -> None:
    e1, e2, e3, e0 = PGA3.basis()
    cases = [
        (PGA3.scalar(0), Kind.ZERO, None, False, True),
        (PGA3.scalar(-2), Kind.BLADE, 0, True, False),
        (e1 ^ e2, Kind.BLADE, 2, True, False),
        (e0 ^ e2, Kind.BLADE, 2, False, True),
        ((e1 ^ e2) + (e3 ^ e0), Kind.GENERAL, None, False, False),
        (1 + (e1 ^ e0), Kind.VERSOR, None, True, False),
        (e1 * e2 * (e3 + e0) + e1, Kind.VERSOR, None, True, False),
        (e1 + 1, Kind.GENERAL, None, False, False),
    ]
    for element, kind, k, is_versor, is_null in cases:
        found = classify(element)
        assert (found.kind, found.grade, found.is_versor, found.is_null) == (kind, k, is_versor, is_null), element
    assert [classify(element).is_odd for element in (e1, e1 ^ e2, e1 + 1)] == [True, False, False]
    floats = (0.3 * e1 + 0.1 * e2) * (e1 + 0.7 * e3 - 0.2 * e0) * (0.9 * e1 + e2)
    assert classify(floats).kind is Kind.VERSOR
    assert classify(floats + 1e-3 * (e1 ^ e2 ^ e0)).kind is Kind.GENERAL


def test_a_bivector_is_a_sum_of_commuting_blades() -> None:
    e1, e2, e3, e4, e5 = CGA3.basis()
    turn = (1 + Fraction(1, 3) * (e1 ^ e3)) * (2 + (e2 ^ (e4 + e5))) * (1 + (e3 ^ e5))
    rational = 0
    for bivector in (3 * (e1 ^ e2) + 2 * (e4 ^ e5), (e1 ^ e2) - 5 * (e3 ^ (e4 - e5))):
        moved = turn * bivector * inverse(turn)
        parts = split_bivector(moved)
        assert len(parts) == 2
        assert parts[0] + parts[1] == moved
        assert commutator(*parts) == 0
        for part in parts:
            assert classify(part).grade == 2
        rational += 1
    screw = PGA3.multivector({"e12": 2, "e03": 3, "e01": 1})
    axis, shift = split_bivector(screw)
    assert axis + shift == screw and commutator(axis, shift) == 0 and (axis ^ axis) == 0 and (shift * shift) == 0
    assert split_bivector(VGA3.multivector({"e12": 2})) == (VGA3.multivector({"e12": 2}),)
    assert rational == 2


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
def test_splits_of_floats_in_any_unit(size: float) -> None:
    """Different squares determine a unique split, equal ones do not, and a third part is detected, in any unit."""
    space = orthogonal(4)
    e1, e2, e3, e4 = space.basis()
    turn = (1 + 0.3 * (e1 ^ e3)) * (2 + 0.7 * (e2 ^ e4)) * (1 - 0.4 * (e1 ^ e4))
    make = lambda a, b: size * turn * (a * (e1 ^ e2) + b * (e3 ^ e4)) * inverse(turn)  # noqa: E731
    for a, b in ((2.0, 1.0), (1.1, -1.0), (3.0, 0.01)):
        first, second = split_bivector(make(a, b).grade(2))
        assert abs((first * first).scalar / size**2 + a * a) < 1e-12
        assert abs((second * second).scalar / size**2 + b * b) < 1e-12
        assert all(abs(value) < 1e-12 * size**2 for value in commutator(first, second).terms.values())
    with pytest.raises(AlgebraError, match="same square"):
        split_bivector(make(1.0, 1.0).grade(2))
    assert len(split_bivector(make(1.0, 0.0).grade(2))) == 1
    six = orthogonal(6)
    with pytest.raises(AlgebraError, match="three parts"):
        split_bivector(six.multivector({"e1e2": size, "e3e4": 2.0 * size, "e5e6": 3.0 * size}))


def test_bivectors_without_a_split_are_rejected() -> None:
    with pytest.raises(AlgebraError, match="same square"):
        split_bivector(orthogonal(4).multivector({"e1e2": 1, "e3e4": 1}))
    with pytest.raises(AlgebraError, match="complex squares"):
        split_bivector(orthogonal(2, 2).multivector({"e1e3": 1, "e2e4": 1, "e1e2": 1}))
    with pytest.raises(AlgebraError, match="three parts"):
        split_bivector(orthogonal(6).multivector({"e1e2": 1, "e3e4": 2, "e5e6": 3}))
    with pytest.raises(InexactError):
        split_bivector(orthogonal(4).multivector({"e1e2": 1, "e1e3": 1, "e3e4": 2, "e2e4": 1}))
    with pytest.raises(AlgebraError, match="grade 2"):
        split_bivector(VGA3.basis()[0])


def test_floats_of_every_scale_and_nearly_dependent_factors() -> None:
    """The error relative to exact factors is the rounding of coefficients."""
    random = Random(3)
    for scale in (1e-8, 1.0, 1e8):
        for n, k in ((4, 2), (6, 3), (7, 4)):
            rows = rows_of(random, k, n)
            rows[-1] = [x * 10**6 + y for x, y in pairwise([*rows[0], 1])]
            algebra = orthogonal(n)
            exact = wedge(algebra, rows)
            if not exact.terms:
                continue
            found = factorize_blade(exact.map(float) * scale)
            product = reduce(lambda a, b: a ^ b, found.vectors, algebra.scalar(found.scale))
            error = [product[b] - float(value) * scale for b, value in exact.terms.items()]
            assert np.abs(error).max() <= 1e-10 * scale * max(abs(float(v)) for v in exact.terms.values())


def test_ten_dimensions() -> None:
    random = Random(11)
    rows = rows_of(random, 7, 10)
    joined, met = join_and_meet(wedge(TEN, rows[:5]), wedge(TEN, rows[3:]))
    assert (joined.grades, met.grades) == ((7,), (2,))
