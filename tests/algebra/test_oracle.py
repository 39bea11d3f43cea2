"""The products against matrices: an oracle that shares no code with the algebra layer.

A Clifford algebra of any bilinear form acts on the exterior algebra of its vectors (Chevalley's construction; Lounesto
2001, ch. 22). With creation operators ``c_i`` and annihilation operators ``d_i``, ``d_i c_j + c_j d_i = delta_ij``,
built here as Kronecker products of 2 x 2 matrices (Jordan and Wigner), the matrix of ``e_i`` is
``c_i + sum_j G_ij d_j``. Then ``e_i e_j + e_j e_i = 2 G_ij``, no change of basis is needed for null, degenerate and
oblique metrics, and the representation is faithful: its first column is the element itself. Creation operators alone
give the outer product and annihilation operators alone the contraction.

In ten dimensions the same operators act on sparse columns instead of being written out.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest
from exact_elements import ALGEBRAS, TEN, Draw
from selection import some_slow

from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CGA3, STA, VGA3
from gacompiler.algebra.involutions import clifford_conjugate, grade_involution, reverse
from gacompiler.algebra.multivector import Multivector
from tests.support.all_cases import all_cases

SMALL = tuple(algebra for algebra in ALGEBRAS if algebra is not TEN)
Matrix = Any
State = dict[int, Fraction]


_plain = np.frompyfunc(lambda value: value.numerator if value.denominator == 1 else value, 1, 1)


def plain(matrix: Matrix) -> Matrix:
    """Whole numbers as ints, which are much faster than Fractions."""
    return _plain(matrix)


def bits(blade: int) -> list[int]:
    return [k for k in range(blade.bit_length()) if blade >> k & 1]


class MatrixOracle:
    """Products of one algebra by dense exact matrices on its exterior algebra."""

    def __init__(self, gram: tuple[tuple[Any, ...], ...]) -> None:
        self.n = n = len(gram)
        z, one = np.array([[1, 0], [0, -1]], object), np.array([[1, 0], [0, 1]], object)
        up = np.array([[0, 0], [1, 0]], object)
        self.create = [self._kron([z] * i + [up] + [one] * (n - i - 1)) for i in range(n)]
        self.annihilate = [matrix.T for matrix in self.create]
        self.parity = self._kron([z] * n)
        self.unit = self._kron([one] * n)
        self.contract = [
            plain(sum((Fraction(gram[i][j]) * self.annihilate[j] for j in range(n) if gram[i][j]), 0 * self.unit))
            for i in range(n)
        ]
        self.vector = [self.create[i] + self.contract[i] for i in range(n)]
        self._blade: dict[int, Matrix] = {0: self.unit}

    def _kron(self, factors: Iterable[Matrix]) -> Matrix:
        result = np.array([[1]], object)
        for factor in factors:
            result = np.kron(result, factor)
        return result

    def _row(self, blade: int) -> int:
        """The place of a blade in a column: the first vector is the outermost factor."""
        return sum(1 << (self.n - 1 - k) for k in bits(blade))

    def blade(self, blade: int) -> Matrix:
        """The matrix of an outer product, antisymmetrised: ``e ^ B = (e B + grade_involution(B) e) / 2``."""
        if blade not in self._blade:
            k = bits(blade)[0]
            rest = self.blade(blade ^ 1 << k)
            sign = -1 if len(bits(blade)) % 2 == 0 else 1
            self._blade[blade] = plain((self.vector[k] @ rest + sign * (rest @ self.vector[k])) * Fraction(1, 2))
        return self._blade[blade]

    def matrix(self, terms: Mapping[int, Any]) -> Matrix:
        return sum((value * self.blade(blade) for blade, value in terms.items()), 0 * self.unit)

    def column(self, terms: Mapping[int, Any]) -> Matrix:
        column = np.array([0] * (1 << self.n), object)
        for blade, value in terms.items():
            column[self._row(blade)] = value
        return column

    def terms(self, column: Matrix) -> State:
        return {blade: column[self._row(blade)] for blade in range(1 << self.n) if column[self._row(blade)]}

    def geometric(self, x: Mapping[int, Any], y: Mapping[int, Any]) -> State:
        return self.terms(self.matrix(x) @ self.column(y))

    def outer(self, x: Mapping[int, Any], y: Mapping[int, Any]) -> State:
        return self.terms(self._with(self.create, x, False) @ self.column(y))

    def left_contraction(self, x: Mapping[int, Any], y: Mapping[int, Any]) -> State:
        return self.terms(self._with(self.contract, x, False) @ self.column(y))

    def reverse(self, x: Mapping[int, Any]) -> State:
        return self.terms(self._with(self.create, x, True) @ self.column({0: 1}))

    def grade_involution(self, x: Mapping[int, Any]) -> State:
        return self.terms(self.parity @ self.column(x))

    def right_contraction(self, x: Mapping[int, Any], y: Mapping[int, Any]) -> State:
        return self.reverse(self.left_contraction(self.reverse(y), self.reverse(x)))

    def scalar(self, x: Mapping[int, Any], y: Mapping[int, Any]) -> Fraction:
        """The normalised trace of the product: only the unit matrix has one."""
        return Fraction((self.matrix(x) * self.matrix(y).T).sum()) / (1 << self.n)

    def _with(self, operators: list[Matrix], x: Mapping[int, Any], backwards: bool) -> Matrix:
        total = 0 * self.unit
        for blade, value in x.items():
            product = self.unit
            for k in reversed(bits(blade)) if backwards else bits(blade):
                product = product @ operators[k]
            total = total + value * product
        return total


@cache
def oracle(algebra: Algebra) -> MatrixOracle:
    return MatrixOracle(algebra.gram)


def as_terms(x: Multivector) -> State:
    return {blade: Fraction(value) for blade, value in x.terms.items()}


@pytest.mark.parametrize("algebra", SMALL, ids=lambda algebra: algebra.name)
def test_the_matrices_are_the_algebra(algebra: Algebra) -> None:
    """The oracle's own axioms: anticommutators are the metric, and the first column of a blade is that blade."""
    known = oracle(algebra)
    for i in range(algebra.dimension):
        for j in range(algebra.dimension):
            anticommutator = known.vector[i] @ known.vector[j] + known.vector[j] @ known.vector[i]
            assert (anticommutator == 2 * Fraction(algebra.gram[i][j]) * known.unit).all()
    for blade in range(1 << algebra.dimension):
        assert known.terms(known.blade(blade)[:, 0]) == {blade: 1}


@all_cases("algebra", SMALL)
def test_every_product_of_two_basis_blades(algebra: Algebra) -> None:
    """The whole multiplication table."""
    known = oracle(algebra)
    table = {blade: known.blade(blade) for blade in range(1 << algebra.dimension)}
    for a, matrix in table.items():
        for b in table:
            assert dict(algebra.blade_product(a, b)) == known.terms(matrix @ known.column({b: 1})), (a, b)


@pytest.mark.parametrize("algebra", some_slow(SMALL, CGA3), ids=lambda algebra: algebra.name)
def test_products_of_random_elements(algebra: Algebra) -> None:
    known, draw = oracle(algebra), Draw(algebra, f"oracle {algebra.name}")
    x, y = draw.multivector(), draw.multivector()
    assert as_terms(x * y) == known.geometric(x.terms, y.terms)
    assert as_terms(x ^ y) == known.outer(x.terms, y.terms)
    assert as_terms(x.product("left_contraction", y)) == known.left_contraction(x.terms, y.terms)
    assert as_terms(x.product("right_contraction", y)) == known.right_contraction(x.terms, y.terms)
    assert x.product("scalar_product", y).scalar == known.scalar(x.terms, y.terms)


@pytest.mark.parametrize("algebra", SMALL, ids=lambda algebra: algebra.name)
def test_involutions_of_random_elements(algebra: Algebra) -> None:
    known, draw = oracle(algebra), Draw(algebra, f"involutions {algebra.name}")
    x = draw.multivector()
    assert as_terms(reverse(x)) == known.reverse(x.terms)
    assert as_terms(grade_involution(x)) == known.grade_involution(x.terms)
    assert as_terms(clifford_conjugate(x)) == known.reverse(known.grade_involution(x.terms))


@pytest.mark.parametrize("algebra", some_slow(SMALL, CGA3), ids=lambda algebra: algebra.name)
def test_inner_products_by_grades(algebra: Algebra) -> None:
    """Both inner products from the oracle's geometric product, grade by grade."""
    known, draw = oracle(algebra), Draw(algebra, f"inner {algebra.name}")
    x, y = draw.multivector(), draw.multivector()
    expected: dict[str, State] = {"inner_product": {}, "hestenes_product": {}}
    for a, u in x.terms.items():
        for b, v in y.terms.items():
            p, q = len(bits(a)), len(bits(b))
            for blade, value in known.geometric({a: u}, {b: v}).items():
                if len(bits(blade)) == abs(p - q):
                    for name, total in expected.items():
                        if name == "inner_product" or (p and q):
                            total[blade] = total.get(blade, Fraction(0)) + value
    for name, total in expected.items():
        assert as_terms(x.product(name, y)) == {blade: value for blade, value in total.items() if value}


class ColumnOracle:
    """The same operators on sparse columns, for algebras whose matrices are too large."""

    def __init__(self, gram: tuple[tuple[Any, ...], ...]) -> None:
        self.gram = gram

    def vector(self, i: int, state: State) -> State:
        result: State = {}
        for blade, value in state.items():
            if not blade >> i & 1:
                self._add(result, blade | 1 << i, value, blade, i)
            for j, metric in enumerate(self.gram[i]):
                if metric and blade >> j & 1:
                    self._add(result, blade ^ 1 << j, value * metric, blade, j)
        return {blade: value for blade, value in result.items() if value}

    @staticmethod
    def _add(result: State, target: int, value: Fraction, blade: int, place: int) -> None:
        before = sum(blade >> k & 1 for k in range(place))
        result[target] = result.get(target, Fraction(0)) + (-value if before % 2 else value)

    def blade(self, vectors: list[int], state: State) -> State:
        if not vectors:
            return state
        first, rest = vectors[0], vectors[1:]
        left = self.vector(first, self.blade(rest, state))
        right = self.blade(rest, self.vector(first, state))
        sign = -1 if len(rest) % 2 else 1
        total = {
            b: (left.get(b, Fraction(0)) + sign * right.get(b, Fraction(0))) / 2 for b in left.keys() | right.keys()
        }
        return {blade: value for blade, value in total.items() if value}

    def geometric(self, x: Mapping[int, Any], y: Mapping[int, Any]) -> State:
        total: State = {}
        for blade, value in x.items():
            for target, factor in self.blade(bits(blade), {b: Fraction(v) for b, v in y.items()}).items():
                total[target] = total.get(target, Fraction(0)) + value * factor
        return {blade: value for blade, value in total.items() if value}


@all_cases("algebra", ALGEBRAS)
def test_geometric_product_on_sparse_columns(algebra: Algebra) -> None:
    known, draw = ColumnOracle(algebra.gram), Draw(algebra, f"columns {algebra.name}")
    for _ in range(2):
        x, y = draw.multivector(), draw.multivector()
        assert as_terms(x * y) == known.geometric(x.terms, y.terms)


PAULI = [np.array(m, complex) for m in ([[0, 1], [1, 0]], [[0, -1j], [1j, 0]], [[1, 0], [0, -1]])]
DIRAC = [
    np.kron(PAULI[2], np.eye(2)),
    *(np.kron(np.array([[0, 1], [-1, 0]], complex), sigma) for sigma in PAULI),
]


@pytest.mark.parametrize(("algebra", "gammas"), [(VGA3, PAULI), (STA, DIRAC)], ids=["Pauli", "Dirac"])
def test_the_matrices_of_physics(algebra: Algebra, gammas: list[Matrix]) -> None:
    """Pauli's and Dirac's matrices (Doran & Lasenby 2003, ch. 8), with integers that complex numbers hold exactly."""

    def matrix(x: Multivector) -> Matrix:
        total = np.zeros_like(gammas[0])
        for blade, value in x.terms.items():
            product = np.eye(len(total), dtype=complex)
            for k in bits(blade):
                product = product @ gammas[k]
            total = total + int(value) * product
        return total

    random = Draw(algebra, "physics").random
    for _ in range(10):
        x, y = (
            Multivector(algebra, {b: random.randint(-9, 9) for b in range(1 << algebra.dimension)}) for _ in range(2)
        )
        assert np.array_equal(matrix(x * y), matrix(x) @ matrix(y))
        assert not np.array_equal(matrix(x * y), matrix(y) @ matrix(x))
