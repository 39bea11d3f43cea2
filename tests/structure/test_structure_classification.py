"""Geometric algebras as algebras of matrices, against the published table and by exact products."""

from __future__ import annotations

import json
import random
from itertools import combinations

import numpy as np
import pytest
from click.testing import CliRunner
from selection import some_slow

from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CATALOG, CGA3, PGA3, STA, orthogonal
from gacompiler.algebra.involutions import clifford_conjugate, grade_involution, reverse
from gacompiler.algebra.multivector import Multivector
from gacompiler.cli import main
from gacompiler.errors import AlgebraError
from gacompiler.structure import isomorphisms
from gacompiler.structure.adjoints import matrix_involution
from gacompiler.structure.ideals import LeftIdeal, centre, idempotent_factors, primitive_idempotents
from gacompiler.structure.levels import plans, tower
from gacompiler.structure.matrix_algebras import (
    MatrixAlgebra,
    complex_matrix_algebra,
    even_subalgebra,
    matrix_algebra,
    signature,
    tensor_product,
)
from gacompiler.structure.representation import Representation, complex_generators, representation
from gacompiler.structure.summary import matrix_lines
from tests.support.all_cases import all_cases

TABLE = """
R
2R C
R(2) R(2) H
C(2) 2R(2) C(2) 2H
H(2) R(4) R(4) H(2) H(2)
2H(2) C(4) 2R(4) C(4) 2H(2) C(4)
H(4) H(4) R(8) R(8) H(4) H(4) R(8)
C(8) 2H(4) C(8) 2R(8) C(8) 2H(4) C(8) 2R(8)
R(16) H(8) H(8) R(16) R(16) H(8) H(8) R(16) R(16)
"""
"""Lounesto, Clifford Algebras and Spinors, 2001, p. 217: a row for each n, from G(n, 0) to G(0, n)."""

SIGNATURES = [(p, n - p) for n in range(11) for p in range(n + 1)]
DEGENERATE = [(2, 0, 1), (3, 0, 1), (0, 3, 1), (1, 0, 1), (0, 2, 2), (1, 1, 2), (0, 0, 3), (4, 1, 1)]


def draw(algebra: Algebra, n_terms: int, seed: object) -> Multivector:
    rng = random.Random(str(seed))
    blades = rng.sample(range(1 << algebra.dimension), min(n_terms, 1 << algebra.dimension))
    return Multivector(algebra, {blade: rng.randint(-99, 99) for blade in blades})


def real_generators(found: Representation) -> np.ndarray:
    return np.array([found.real(matrices).astype(np.int64) for matrices in found.generators])


def test_the_published_table() -> None:
    rows = [line.split() for line in TABLE.strip().splitlines()]
    for n, row in enumerate(rows):
        assert [str(matrix_algebra(n - q, q)) for q in range(n + 1)] == row


def test_table_modulo_eight_to_ten_vectors() -> None:
    """The table in its usual form: p - q mod 8, and the exponent of the size."""
    known = {
        0: ("R", 0, ""), 2: ("R", 0, ""), 1: ("R", 1, "2"), 3: ("C", 1, ""), 7: ("C", 1, ""),
        4: ("H", 2, ""), 6: ("H", 2, ""), 5: ("H", 3, "2"),
    }  # fmt: skip
    for p, q in SIGNATURES:
        numbers, less, halves = known[(p - q) % 8]
        size = 2 ** ((p + q - less) // 2)
        assert str(matrix_algebra(p, q)) == f"{halves}{numbers}" + (f"({size})" if size > 1 else "")


@pytest.mark.parametrize(("p", "q"), some_slow(SIGNATURES, *(s for s in SIGNATURES if sum(s) > 8)))
def test_generators_are_exact_and_fill_the_matrices(p: int, q: int) -> None:
    """Anticommutators are the metric in integers, and elements come back: with the dimensions this is one to one."""
    algebra = orthogonal(p, q)
    found = Representation(algebra)
    kind = matrix_algebra(p, q)
    numbers = {"R": 1, "C": 2, "H": 4}[kind.numbers]
    assert found.shape == (kind.halves, kind.size, kind.size, numbers)
    assert np.prod(found.shape) == kind.dimension == 2 ** (p + q)
    if p + q:
        generators = real_generators(found)
        assert generators.shape[1] == kind.real_size and set(np.unique(generators)) <= {-1, 0, 1}
        products = generators[:, None].astype(float) @ generators.astype(float)  # exact for such small integers
        metric = np.diag([1] * p + [-1] * q)
        expected = 2 * metric[:, :, None, None] * np.eye(kind.real_size, dtype=int)
        assert np.array_equal(products + products.swapaxes(0, 1), expected)
    x = draw(algebra, 200, (p, q))
    assert found.element(found.matrix(x)) == x


@pytest.mark.parametrize(("p", "q"), some_slow(SIGNATURES[21:], *(s for s in SIGNATURES if sum(s) > 8)))
def test_products_of_elements(p: int, q: int) -> None:
    algebra = orthogonal(p, q)
    found = representation(algebra)
    x, y = draw(algebra, 24, "x"), draw(algebra, 24, "y")
    assert np.array_equal(found.product(found.matrix(x), found.matrix(y)), found.matrix(x * y))


def blade_sign(vectors: list[int], squares: list[int]) -> tuple[tuple[int, ...], int]:
    """A product of basis vectors sorted by exchanges of neighbours, squares taken out."""
    sign, work = 1, list(vectors)
    for _ in work:
        for k in range(len(work) - 1):
            if work[k] > work[k + 1]:
                work[k], work[k + 1], sign = work[k + 1], work[k], -sign
    kept: list[int] = []
    for v in work:
        if kept and kept[-1] == v:
            kept.pop()
            sign *= squares[v]
        else:
            kept.append(v)
    return tuple(kept), sign


@all_cases("p, q", [s for s in SIGNATURES if sum(s) <= 4] + [(5, 0), (4, 1), (0, 5)])
def test_products_of_all_pairs_of_blades(p: int, q: int) -> None:
    """The whole multiplication table, signs counted by sorting."""
    n, squares = p + q, [1] * p + [-1] * q
    found = representation(orthogonal(p, q))
    blades = [list(chosen) for k in range(n + 1) for chosen in combinations(range(n), k)]
    matrices = {
        tuple(blade): found.real(found.matrix(Multivector(found.algebra, {sum(1 << i for i in blade): 1}))).astype(int)
        for blade in blades
    }
    for a in blades:
        for b in blades:
            kept, sign = blade_sign([*a, *b], squares)
            assert np.array_equal(matrices[tuple(a)] @ matrices[tuple(b)], sign * matrices[kept])
    assert np.linalg.matrix_rank(np.array([m.ravel() for m in matrices.values()])) == 2**n


@all_cases("p, q", [s for s in SIGNATURES if 0 < sum(s) <= 5])
def test_matrices_are_irreducible_over_their_numbers(p: int, q: int) -> None:
    """Schur: what commutes with one half is R, C or H."""
    found = representation(orthogonal(p, q))
    size = found.kind.real_size // found.kind.halves
    generators = real_generators(found)[:, :size, :size]
    one = np.eye(size)
    system = np.concatenate([np.kron(one, g) - np.kron(g.T, one) for g in generators])
    assert size**2 - np.linalg.matrix_rank(system) == {"R": 1, "C": 2, "H": 4}[found.kind.numbers]


@all_cases("three", DEGENERATE)
def test_degenerate_metrics(three: tuple[int, int, int]) -> None:
    p, q, r = three
    algebra = orthogonal(p, q, r)
    found = Representation(algebra)
    x, y = draw(algebra, 40, "x"), draw(algebra, 40, "y")
    assert np.array_equal(found.product(found.matrix(x), found.matrix(y)), found.matrix(x * y))
    assert found.element(found.matrix(x)) == x
    assert np.array_equal(found.real(found.matrix(x)) @ found.real(found.matrix(y)), found.real(found.matrix(x * y)))
    assert found.kind.dimension == 2 ** (p + q + r) and found.kind.grassmann == r
    assert found.real(found.one).shape == (found.kind.real_size,) * 2
    assert np.array_equal(found.from_real(found.real(found.matrix(x))), found.matrix(x))


def test_names_with_a_degenerate_part() -> None:
    assert str(matrix_algebra(2, 0, 1)) == "R(2) ⊗ Λ(1)"
    assert str(matrix_algebra(3, 0, 1)) == "C(2) ⊗̂ Λ(1)"
    assert str(even_subalgebra(3, 0, 1)) == "H ⊗ Λ(1)"  # dual quaternions
    assert str(even_subalgebra(2, 0, 1)) == "C ⊗̂ Λ(1)"


@all_cases("algebra", list(CATALOG.values()))
def test_algebras_by_name_in_their_own_bases(algebra: Algebra) -> None:
    """Null bases too: no change of basis is made."""
    found = representation(algebra)
    assert found.kind == matrix_algebra(*signature(algebra))
    x, y = draw(algebra, 30, "x"), draw(algebra, 30, "y")
    assert np.array_equal(found.product(found.matrix(x), found.matrix(y)), found.matrix(x * y))
    assert found.element(found.matrix(x)) == x


def test_complex_matrices_are_a_representation() -> None:
    for algebra in (STA, CGA3, orthogonal(0, 2), orthogonal(0, 3)):
        found = representation(algebra)
        x, y = draw(algebra, 16, "x"), draw(algebra, 16, "y")
        a, b, c = (found.complex(found.matrix(z)) for z in (x, y, x * y))
        assert np.array_equal(a @ b, c)
    with pytest.raises(AlgebraError, match="degenerate"):
        representation(PGA3).complex(representation(PGA3).one)


def test_complex_double_and_dual_numbers_and_quaternions() -> None:
    """The small algebras by their well-known rules; dual numbers differentiate."""
    rng = random.Random(8)
    a, b, c, d = (rng.randint(-9, 9) for _ in range(4))
    for algebra, square in ((orthogonal(0, 1), -1), (orthogonal(1), 1), (orthogonal(0, 0, 1), 0)):
        found = representation(algebra)
        x, y = algebra.multivector({"1": a, "e1": b}), algebra.multivector({"1": c, "e1": d})
        expected = algebra.multivector({"1": a * c + square * b * d, "e1": a * d + b * c})
        assert x * y == found.element(found.product(found.matrix(x), found.matrix(y))) == expected
    assert representation(orthogonal(1)).matrix(orthogonal(1).multivector({"1": a, "e1": b})).ravel().tolist() == [
        a + b, a - b,
    ]  # fmt: skip
    x = orthogonal(0, 0, 1).multivector({"1": a, "e1": 1})
    assert (x**5 - 2 * x**3)["e1"] == 5 * a**4 - 6 * a**2
    e1, e2 = orthogonal(0, 2).basis()
    i, j, k = e1, e2, e1 * e2
    assert i * i == j * j == k * k == i * j * k == -1
    found = representation(orthogonal(0, 2))
    parts = [found.matrix(unit).ravel().tolist() for unit in (i * 0 + 1, i, j, k)]
    assert parts == np.eye(4).tolist()


@all_cases("n", range(8))
def test_complex_algebras(n: int) -> None:
    """Anticommutators, and ``2**n`` products of generators that are independent over the complex numbers."""
    generators = complex_generators(n)
    kind = complex_matrix_algebra(n)
    assert generators.shape == (n, kind.halves, kind.size, kind.size)
    blades = [np.broadcast_to(np.eye(kind.size, dtype=complex), generators.shape[1:])]
    for i, g in enumerate(generators):
        for j, h in enumerate(generators):
            assert np.array_equal(g @ h + h @ g, np.broadcast_to(2 * (i == j) * np.eye(kind.size), g.shape))
        blades += [blade @ g for blade in blades]
    assert np.linalg.matrix_rank(np.array([blade.ravel() for blade in blades])) == 2**n == kind.dimension // 2
    assert set(np.unique(generators)) <= {0, 1, -1, 1j, -1j}


def test_matrices_equal_those_of_the_optimiser() -> None:
    """The levels that large products are compiled through are those of the representation."""
    for algebra in (CGA3, STA, orthogonal(0, 3), orthogonal(5, 1)):
        assert plans(algebra)[0] == tower(algebra)[0]


def test_signature_in_any_basis() -> None:
    assert signature(CGA3) == (4, 1, 0) and signature(PGA3) == (3, 0, 1)
    rng = np.random.default_rng(3)
    for p, q, r in [(2, 1, 0), (1, 1, 2), (3, 2, 1)]:
        n = p + q + r
        t = rng.integers(-3, 4, (n, n)) + 5 * np.eye(n, dtype=int)
        gram = t.T @ np.diag([1] * p + [-1] * q + [0] * r) @ t
        algebra = Algebra("oblique", [f"e{k}" for k in range(1, n + 1)], gram.tolist())
        values = np.linalg.eigvalsh(gram.astype(float))
        assert signature(algebra) == (sum(values > 1e-9), sum(values < -1e-9), sum(abs(values) <= 1e-9)) == (p, q, r)
    with pytest.raises(AlgebraError, match="orthogonal"):
        Representation(Algebra("oblique", "a b", [[2, 1], [1, 2]]))


def test_tensor_products_give_the_period() -> None:
    r2, h = MatrixAlgebra("R", 2), MatrixAlgebra("H", 1)
    for p, q in SIGNATURES:
        assert matrix_algebra(p + 1, q + 1) == tensor_product(matrix_algebra(p, q), r2)
        assert matrix_algebra(p + 2, q) == tensor_product(matrix_algebra(q, p), r2)
        assert matrix_algebra(p, q + 2) == tensor_product(matrix_algebra(q, p), h)
        assert (
            matrix_algebra(p + 8, q)
            == matrix_algebra(p, q + 8)
            == tensor_product(matrix_algebra(p, q), MatrixAlgebra("R", 16))
        )
        if (p - q) % 8 in (0, 2, 4, 6):
            assert tensor_product(matrix_algebra(p, q), MatrixAlgebra("C", 1)) == complex_matrix_algebra(p + q)


ISOMORPHISMS = [
    *((isomorphisms.add_hyperbolic_plane, p, q) for p, q in SIGNATURES if p + q <= 4),
    *((isomorphisms.add_positive_plane, p, q) for p, q in SIGNATURES if p + q <= 4),
    *((isomorphisms.add_negative_plane, p, q) for p, q in SIGNATURES if p + q <= 4),
    *((isomorphisms.shift_four, p, q) for p, q in SIGNATURES if p + q <= 2),
    *((isomorphisms.exchange, p, q) for p, q in SIGNATURES if p + q <= 5 and p),
    *((isomorphisms.even_isomorphism, p, q) for p, q in SIGNATURES if 0 < p + q <= 6),
    *((isomorphisms.add_eight, p, q) for p, q in [(1, 0), (0, 1)]),
    *((isomorphisms.even_isomorphism, *three) for three in DEGENERATE if three[0] + three[1]),
]  # fmt: skip


@all_cases("case", ISOMORPHISMS)
def test_isomorphisms(case: tuple) -> None:
    """Homomorphisms that are one to one; the image commutes with the factor, or is all even elements."""
    make, *numbers = case
    found = make(*numbers)
    x, y = draw(found.source, 12, "x"), draw(found.source, 12, "y")
    assert found(x * y) == found(x) * found(y)
    assert found.inverse(found(x)) == x
    images = {next(iter(found(Multivector(found.source, {b: 1})).terms)) for b in range(1 << found.source.dimension)}
    assert len(images) == 1 << found.source.dimension
    for f in found.factor:
        assert found(x) * f == f * found(x)
    if make is isomorphisms.even_isomorphism:
        assert images == {b for b in range(1 << found.target.dimension) if not b.bit_count() & 1}
        assert even_subalgebra(*numbers) == matrix_algebra(*signature(found.source))


@all_cases("p, q", [s for s in SIGNATURES if sum(s) <= 6])
def test_involutions_on_matrices(p: int, q: int) -> None:
    algebra = orthogonal(p, q)
    found = representation(algebra)
    x = draw(algebra, 40, "x")
    for function in (reverse, grade_involution, clifford_conjugate):
        involution = matrix_involution(found, function.__name__)
        assert np.array_equal(involution(found.matrix(x)), found.matrix(function(x)))


def radon_hurwitz(i: int) -> int:
    return (0, 1, 2, 2, 3, 3, 3, 3)[i % 8] + 4 * (i // 8)


@all_cases("p, q", [s for s in SIGNATURES if sum(s) <= 5])
def test_idempotents_and_ideals(p: int, q: int) -> None:
    """The dimension of a minimal left ideal is ``2**(n - k)``, k = q - r_(q-p) (Lounesto 2001, §17.5)."""
    algebra = orthogonal(p, q)
    found = representation(algebra)
    idempotents = primitive_idempotents(found)
    k = q - radon_hurwitz(q - p)
    assert len(idempotents) == 2**k
    for i, f in enumerate(idempotents):
        assert all(f * g == (f if i == j else 0) for j, g in enumerate(idempotents))
        assert len(idempotent_factors(f)) == k
    assert sum(idempotents[1:], idempotents[0]) == 1
    ideal = LeftIdeal(found, len(idempotents) - 1)
    span = [
        [float((Multivector(algebra, {b: 1}) * ideal.idempotent)[c]) for c in algebra.blades()]
        for b in algebra.blades()
    ]
    assert np.linalg.matrix_rank(np.array(span)) == len(ideal.basis) == 2 ** (p + q - k)
    x, spinor = draw(algebra, 8, "x"), draw(algebra, 8, "y") * ideal.idempotent
    column = ideal.column(spinor)
    assert ideal.spinor(column) == spinor
    half = found.matrix(x)[ideal._half]
    moved = np.zeros_like(column)
    for a, row in enumerate(found.numbers.products):
        for b, terms in enumerate(row):
            for unit, sign in terms:
                moved[:, unit] = moved[:, unit] + sign * (half[..., a] @ column[:, b])
    assert np.array_equal(ideal.column(x * spinor), moved)


def test_invalid_spinors_are_rejected() -> None:
    ideal = LeftIdeal(representation(orthogonal(3)))
    with pytest.raises(AlgebraError, match="ideal"):
        ideal.column(orthogonal(3).scalar(1))
    with pytest.raises(AlgebraError, match="column"):
        LeftIdeal(representation(orthogonal(3)), 5)


@all_cases("three", [(2, 0, 0), (3, 0, 0), (1, 3, 0), (4, 1, 0), *DEGENERATE[:-1]])
def test_centre_is_all_that_commutes(three: tuple[int, int, int]) -> None:
    algebra = orthogonal(*three)
    blades = [
        b for b in algebra.blades()
        if all((x := Multivector(algebra, {b: 1})) * v == v * x for v in algebra.basis())
    ]  # fmt: skip
    assert [sorted(z.terms) for z in centre(algebra)] == [[b] for b in blades]


def test_centre_in_a_null_basis() -> None:
    _, z = centre(CGA3)
    assert z * z == z.lift((z * z).scalar) and all(z * v == v * z for v in CGA3.basis())


def run(*words: str) -> str:
    result = CliRunner().invoke(main, ["classify", *words])
    assert result.exit_code == 0, result.output
    return result.output


def test_command() -> None:
    assert "H(2)" in run("1", "3") and "C(2) ⊗̂ Λ(1)" in run("3", "0", "1")
    assert "C(128)" in run("13", "2")
    data = json.loads(run("2", "1", "--matrices", "--json"))
    assert data["matrices"] == "2R(2)" and data["units"] == ["1"]
    first = np.array(data["generators"]["e1"])
    assert first.shape == (2, 2, 2, 1) and np.array_equal(first[0, :, :, 0] @ first[0, :, :, 0], np.eye(2))
    assert CliRunner().invoke(main, ["classify", "--", "-1"]).exit_code == 2
    refused = CliRunner().invoke(main, ["classify", "13", "--matrices"])
    assert refused.exit_code == 1 and "at most 12" in refused.output


def test_matrices_as_text() -> None:
    found = representation(orthogonal(0, 2))
    x = found.algebra.multivector({"1": 2, "e1": -3, "e12": 1})
    assert matrix_lines(found.numbers, found.matrix(x)) == ["2-3i+k"]
    assert "|" in run("0", "3", "--matrices")
