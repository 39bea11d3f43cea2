"""Linear functions on all grades, against exact minors, theorems on compound matrices, numpy and scipy."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations
from math import comb

import numpy as np
import pytest
import scipy.linalg

from algorithms.calculus import (
    LinearFunction,
    LinearStatus,
    eigenblades,
    polar,
    product_of,
    skew_planes,
    symmetric_spectrum,
)
from algorithms.subspaces import Blade, FactoredBlade, reflections_of
from tests.support.all_cases import all_cases


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def exact_determinant(rows: list[list[Fraction]]) -> Fraction:
    """By elimination in rationals."""
    rows, result = [list(row) for row in rows], Fraction(1)
    for k in range(len(rows)):
        pivot = next((i for i in range(k, len(rows)) if rows[i][k]), None)
        if pivot is None:
            return Fraction(0)
        if pivot != k:
            rows[k], rows[pivot], result = rows[pivot], rows[k], -result
        result *= rows[k][k]
        for i in range(k + 1, len(rows)):
            factor = rows[i][k] / rows[k][k]
            rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k], strict=True)]
    return result


def by_bitmap(n: int, k: int) -> list[tuple[int, ...]]:
    return sorted(combinations(range(n), k), key=lambda rows: sum(1 << i for i in rows))


def exact_compound(matrix: np.ndarray, k: int) -> np.ndarray:
    entries = [[Fraction(int(x)) for x in row] for row in matrix]
    return np.array(
        [
            [
                float(exact_determinant([[entries[i][j] for j in columns] for i in rows]))
                for columns in by_bitmap(matrix.shape[1], k)
            ]
            for rows in by_bitmap(matrix.shape[0], k)
        ]
    )


@all_cases("shape", [(1, 1), (3, 3), (4, 4), (3, 5), (5, 2), (5, 5)])
def test_outermorphisms_are_the_minors(shape: tuple[int, int], rng: np.random.Generator) -> None:
    matrices = rng.integers(-9, 10, (3, *shape))
    f = LinearFunction(matrices)
    for k in range(min(shape) + 1):
        found = f.outermorphism(k)
        assert found.shape == (3, comb(shape[0], k), comb(shape[1], k))
        for one, matrix in zip(found, matrices, strict=True):
            np.testing.assert_array_equal(one, exact_compound(matrix, k))


@all_cases("n", range(1, 9))
def test_theorems_on_compound_matrices(n: int, rng: np.random.Generator) -> None:
    f = LinearFunction(np.linalg.qr(rng.normal(size=(4, n, n)))[0] + 0.3 * rng.normal(size=(4, n, n)))
    g = LinearFunction(rng.normal(size=(4, n, n)))
    determinant = np.linalg.det(f.matrix)
    for k in range(n + 1):
        whole = f.outermorphism(k)
        scale = np.linalg.norm(whole) * max(1.0, float(np.linalg.norm(g.outermorphism(k))))
        # Cauchy and Binet
        np.testing.assert_allclose((f @ g).outermorphism(k), whole @ g.outermorphism(k), rtol=0, atol=1e-12 * scale)
        # Sylvester and Franke
        power = comb(n - 1, k - 1) if k else 0
        np.testing.assert_allclose(np.linalg.slogdet(whole)[1], power * np.log(np.abs(determinant)), rtol=0, atol=1e-11)
        # Jacobi: complementary minors of the inverse
        inverse = LinearFunction(np.linalg.inv(f.matrix)).outermorphism(k)
        np.testing.assert_allclose(f.inverse_outermorphism(k), inverse, rtol=0, atol=1e-12 * np.linalg.norm(inverse))
    np.testing.assert_allclose(f.determinant(), determinant, rtol=1e-12)
    np.testing.assert_allclose(f.inverse().matrix, np.linalg.inv(f.matrix), rtol=0, atol=1e-12 * 2**n)
    np.testing.assert_allclose(f.outermorphism(n)[..., 0, 0], determinant, rtol=1e-12)


def test_a_determinant_of_many_vectors(rng: np.random.Generator) -> None:
    matrices = rng.normal(size=(3, 11, 11))
    np.testing.assert_allclose(LinearFunction(matrices).determinant(), np.linalg.det(matrices), rtol=1e-12)


def test_inverses_of_integers_are_rational(rng: np.random.Generator) -> None:
    matrix = rng.integers(-9, 10, (4, 4))
    entries = [[Fraction(int(x)) for x in row] for row in matrix]
    determinant = exact_determinant(entries)
    expected = np.empty((4, 4))
    for i in range(4):
        for j in range(4):
            minor = [[x for c, x in enumerate(row) if c != i] for r, row in enumerate(entries) if r != j]
            expected[i, j] = float((-1) ** (i + j) * exact_determinant(minor) / determinant)
    found = LinearFunction(matrix).inverse()
    assert found.determinant == float(determinant) and found.status == LinearStatus.OK
    np.testing.assert_allclose(found.matrix, expected, rtol=1e-15)


def test_large_batches_are_like_single_functions(rng: np.random.Generator) -> None:
    matrices = rng.normal(size=(2, 2500, 4, 4))
    many = LinearFunction(matrices)
    one = LinearFunction(matrices[1, 2217])
    np.testing.assert_array_equal(many.outermorphism(2)[1, 2217], one.outermorphism(2))
    np.testing.assert_array_equal(many.inverse().matrix[1, 2217], one.inverse().matrix)
    np.testing.assert_array_equal(many.determinant()[1, 2217], one.determinant())


def test_units_do_not_matter(rng: np.random.Generator) -> None:
    matrix = rng.normal(size=(4, 4))
    for scale in (2.0**-600, 2.0**-30, 2.0**200):
        f, g = LinearFunction(matrix), LinearFunction(scale * matrix)
        np.testing.assert_array_equal(g.inverse().matrix * scale, f.inverse().matrix)
        assert g.inverse().status == LinearStatus.OK
        np.testing.assert_array_equal(g.inverse_outermorphism(1) * scale, f.inverse_outermorphism(1))
        one, other = eigenblades(scale * matrix).blades(), eigenblades(matrix).blades()
        assert [blade.grade for blade, _ in one] == [blade.grade for blade, _ in other]
        assert polar(scale * matrix).status == LinearStatus.OK


def test_singular_functions_are_reported(rng: np.random.Generator) -> None:
    a, b = rng.normal(size=(2, 5, 3))
    rank_three = a.T @ b
    for matrix in (np.zeros((3, 3)), np.ones((4, 4)), (b @ a.T) - (b @ a.T), a @ b.T):
        found = LinearFunction(matrix).inverse()
        assert found.status == LinearStatus.SINGULAR and np.isnan(found.matrix).all()
    assert np.isnan(LinearFunction(np.ones((4, 4))).inverse_outermorphism(2)).all()
    batch = LinearFunction(np.stack([np.eye(3), np.ones((3, 3)), rank_three])).inverse()
    assert batch.status.tolist() == [LinearStatus.OK, LinearStatus.SINGULAR, LinearStatus.OK]
    # rank 3 of 5: blades of three vectors have an image, of four none
    f = LinearFunction(a @ b.T)
    assert np.linalg.matrix_rank(f.matrix) == 3
    assert np.linalg.matrix_rank(f.outermorphism(3)) == 1 and np.abs(f.outermorphism(4)).max() < 1e-12


def test_blades_are_mapped_factor_by_factor(rng: np.random.Generator) -> None:
    f = LinearFunction(rng.normal(size=(6, 5)))
    vectors = rng.normal(size=(7, 3, 5))
    blade = FactoredBlade.of_vectors(vectors)
    images = FactoredBlade.of_vectors(vectors @ f.matrix.T).coefficients().coefficients
    np.testing.assert_allclose(f(blade.coefficients()).coefficients, images, atol=1e-12)
    np.testing.assert_allclose(f(blade).coefficients().coefficients, images, atol=1e-12)
    assert f(Blade([2.0], 5, 0)).coefficients == [2.0]


def test_outermorphisms_of_rotations_keep_geometric_products(rng: np.random.Generator) -> None:
    for n in (2, 3, 4):
        f = LinearFunction(np.linalg.qr(rng.normal(size=(n, n)))[0])
        a, b = rng.normal(size=(2, 5, 1 << n))
        product = product_of(n)
        both = product(f.multivector(a), f.multivector(b))
        np.testing.assert_allclose(f.multivector(product(a, b)), both, atol=1e-13)
    flat = LinearFunction(np.eye(2, 3)).multivector(np.arange(8.0))
    np.testing.assert_array_equal(flat, [0, 1, 2, 4])
    np.testing.assert_array_equal(LinearFunction(np.eye(3, 2)).multivector([1, 2, 3, 4]), [1, 2, 3, 0, 4, 0, 0, 0])


def test_adjoints_in_any_metric(rng: np.random.Generator) -> None:
    f = LinearFunction(rng.normal(size=(6, 4, 4)))
    oblique = rng.normal(size=(4, 4))
    for gram in (None, [1, -1, -1, -1], oblique + oblique.T):
        metric = np.eye(4) if gram is None else np.diag(gram) if np.ndim(gram) == 1 else np.asarray(gram)
        a, b = rng.normal(size=(2, 6, 4))
        left = np.einsum("ei,ij,ejk,ek->e", a, metric, f.matrix, b)
        right = np.einsum("eij,ej,ik,ek->e", f.adjoint(gram).matrix, a, metric, b)
        np.testing.assert_allclose(left, right, atol=1e-11)


@all_cases("n", [1, 2, 3, 4, 5, 7])
def test_eigenblades_are_only_scaled(n: int, rng: np.random.Generator) -> None:
    matrices = rng.normal(size=(30, n, n))
    found = eigenblades(matrices)
    assert (found.status == LinearStatus.OK).all()
    np.testing.assert_allclose(
        np.sort_complex(found.eigenvalues), np.sort_complex(np.linalg.eigvals(matrices).astype(complex)), atol=1e-12
    )
    for e, matrix in enumerate(matrices):
        f, grades = LinearFunction(matrix), 0
        for blade, value in found.blades((e,)):
            before = blade.coefficients().coefficients
            after = f(blade.coefficients()).coefficients
            np.testing.assert_allclose(after, value * before, atol=1e-11)
            grades += blade.grade
            assert blade.grade <= 2
        assert grades == n
    assert (np.abs(np.linalg.det(found.vectors)) > 1e-6).all()


def test_equal_eigenvalues_form_one_eigenblade(rng: np.random.Generator) -> None:
    turn = np.array([[0.0, -1], [1, 0]])
    twice = np.kron(np.eye(2), turn)
    coupled = twice.copy()
    coupled[:2, 2:] = np.eye(2)
    jordan = np.array([[2.0, 1, 0], [0, 2, 1], [0, 0, 2]])
    cases = [
        (np.eye(4), LinearStatus.REPEATED, [(4, 1.0)]),
        (np.zeros((3, 3)), LinearStatus.REPEATED, [(3, 0.0)]),
        (np.diag([1.0, 5, 1, 3]), LinearStatus.REPEATED, [(1, 5.0), (1, 3.0), (2, 1.0)]),
        (jordan, LinearStatus.DEFECTIVE, [(3, 8.0)]),
        (twice, LinearStatus.REPEATED, [(4, 1.0)]),
        (coupled, LinearStatus.DEFECTIVE, [(4, 1.0)]),
        (scipy.linalg.block_diag(jordan, [[7.0]]), LinearStatus.DEFECTIVE, [(1, 7.0), (3, 8.0)]),
    ]
    for matrix, status, expected in cases:
        frame = np.linalg.qr(rng.normal(size=matrix.shape))[0]
        turned = frame @ matrix @ frame.T
        found = eigenblades(turned, tolerance=1e-4)
        assert found.status == status
        blades = found.blades()
        assert [blade.grade for blade, _ in blades] == [grade for grade, _ in expected]
        for (blade, value), (_, known) in zip(blades, expected, strict=True):
            assert value == pytest.approx(known, abs=1e-8)
            image = LinearFunction(turned)(blade.coefficients()).coefficients
            np.testing.assert_allclose(image, known * blade.coefficients().coefficients, atol=1e-8)


def test_chains_of_near_eigenvalues_are_one_blade(rng: np.random.Generator) -> None:
    """A real eigenvalue and pairs, each within the tolerance of the next, and Jordan blocks with rounding."""
    blocks = [[[1.0]], *([[1.0, -w], [w, 1.0]] for w in (0.09, 0.17))]
    frame = np.linalg.qr(rng.normal(size=(5, 5)))[0]
    norm = np.linalg.norm(scipy.linalg.block_diag(*blocks))
    found = eigenblades(frame @ scipy.linalg.block_diag(*blocks) @ frame.T, tolerance=0.1 / norm)
    ((whole, value),) = found.blades()
    assert whole.grade == 5 and value == pytest.approx(1, abs=0.1)
    for n in (2, 3, 4, 5, 6):
        jordan = np.eye(n) + np.diag(np.ones(n - 1), 1)
        for _ in range(20):
            frame = np.linalg.qr(rng.normal(size=(n, n)))[0]
            for tolerance in (1e-8, 1e-5, 1e-3, 1e-1):
                blades = eigenblades(frame @ jordan @ frame.T, tolerance).blades()
                assert sum(blade.grade for blade, _ in blades) == n
                assert np.prod([value for _, value in blades]) == pytest.approx(1, abs=0.05)


def test_polar_decomposition(rng: np.random.Generator) -> None:
    matrices = rng.normal(size=(20, 4, 4))
    found = polar(matrices)
    for one, rotation, stretch in zip(matrices, found.rotation, found.stretch, strict=True):
        u, p = scipy.linalg.polar(one)
        np.testing.assert_allclose(rotation, u, atol=1e-12)
        np.testing.assert_allclose(stretch, p, atol=1e-12)
        # the rotation is a versor: at most 4 reflections, with the parity of its determinant
        assert (-1) ** len(reflections_of(rotation)) == np.sign(np.linalg.det(one))
    assert (found.status == LinearStatus.OK).all()
    singular = polar(np.diag([2.0, 1, 0]))
    assert singular.status == LinearStatus.SINGULAR
    np.testing.assert_allclose(singular.rotation @ singular.stretch, np.diag([2.0, 1, 0]), atol=1e-15)


def test_spectra_of_symmetric_functions(rng: np.random.Generator) -> None:
    frame = np.linalg.qr(rng.normal(size=(5, 5)))[0]
    known = [3.0, 3.0, 1.0, -3.0, -3.0]
    matrix = frame @ np.diag(known) @ frame.T
    found = symmetric_spectrum((matrix + matrix.T) / 2)
    assert found.status == LinearStatus.REPEATED and found.group.tolist() == [0, 0, 1, 2, 2]
    np.testing.assert_allclose(found.eigenvalues, known, atol=1e-13)
    whole = np.zeros((5, 5))
    for (blade, _), value in zip(found.blades(), (3.0, 1.0, -3.0), strict=True):
        whole += value * blade.vectors.T @ blade.vectors
    np.testing.assert_allclose(whole, matrix, atol=1e-13)
    batch = rng.normal(size=(10, 3, 3))
    plain = symmetric_spectrum(batch + np.swapaxes(batch, 1, 2))
    assert (plain.status == LinearStatus.OK).all() and (np.diff(plain.eigenvalues.real) < 0).all()
    assert symmetric_spectrum([[4.0]]).status == LinearStatus.OK


@all_cases("n", range(2, 9))
def test_skew_functions_turn_in_planes(n: int, rng: np.random.Generator) -> None:
    matrices = rng.normal(size=(12, n, n))
    matrices[0] = 0.0
    canonical = np.zeros((n, n))
    for k in range(0, min(n - 1, 4), 2):
        canonical[k, k + 1] = 2.0
    frame = np.linalg.qr(rng.normal(size=(n, n)))[0]
    matrices[1] = frame @ canonical @ frame.T
    matrices = matrices - np.swapaxes(matrices, 1, 2)
    found = skew_planes(matrices)
    expected = np.sort(np.abs(np.linalg.eigvals(matrices).imag), axis=-1)[:, ::-1][:, : 2 * (n // 2)].reshape(12, -1, 2)
    np.testing.assert_allclose(found.rates, expected.mean(-1), atol=1e-12)
    u, v = found.planes[..., 0, :], found.planes[..., 1, :]
    # f(x) = x . (u ^ v) = x . u v - x . v u
    half = np.einsum("ek,eki,ekj->eij", found.rates, v, u)
    np.testing.assert_allclose(half - np.swapaxes(half, 1, 2), matrices, atol=1e-13 * n)
    basis = np.concatenate([found.planes.reshape(12, -1, n), found.axis], 1)
    np.testing.assert_allclose(basis @ np.swapaxes(basis, 1, 2), np.tile(np.eye(n), (12, 1, 1)), atol=1e-14 * n)
    assert found.status[0] == LinearStatus.SINGULAR
    if n >= 4:
        assert found.status[1] == (LinearStatus.REPEATED if n < 6 else LinearStatus.SINGULAR)
    assert (found.status[2:] == LinearStatus.OK).all()


def test_wrong_arguments_are_rejected() -> None:
    with pytest.raises(ValueError, match=r"matrix: shape \(3,\); expected"):
        LinearFunction([1.0, 2, 3])
    with pytest.raises(ValueError, match=r"matrix: nan at \(0, 1\); expected finite numbers"):
        LinearFunction([[1.0, np.nan]])
    with pytest.raises(ValueError, match="at most 12 rows"):
        LinearFunction(np.eye(13))
    f = LinearFunction(np.ones((2, 3)))
    for method in (f.determinant, f.inverse, lambda: f.inverse_outermorphism(1)):
        with pytest.raises(ValueError, match="from 3 to 2 vectors; expected as many"):
            method()
    with pytest.raises(ValueError, match="grade: 3; expected 0 to 2"):
        f.outermorphism(3)
    with pytest.raises(ValueError, match="x: a blade of 4 vectors; expected 3"):
        f(Blade(np.ones(4), 4, 1))
    with pytest.raises(ValueError, match="of 3 vectors after one to 2"):
        f @ f
    with pytest.raises(ValueError, match=r"matrix: not symmetric, by 1.4 of its norm"):
        symmetric_spectrum([[0.0, 1], [0, 0]])
    with pytest.raises(ValueError, match="matrix: not skew"):
        skew_planes(np.eye(2))
    with pytest.raises(ValueError, match="gram: some vector is orthogonal to all"):
        LinearFunction(np.eye(2)).adjoint([1, 0])
