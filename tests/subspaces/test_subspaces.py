"""Arrays of blades against minors, ranks and singular values of numpy, and against exact rationals."""

from __future__ import annotations

from fractions import Fraction
from functools import reduce
from itertools import combinations
from math import comb
from pathlib import Path

import numpy as np
import pytest
from exact_elements import TEN

from algorithms.subspaces import (
    Blade,
    FactoredBlade,
    delta_product,
    dual,
    factorize_blade,
    join,
    join_and_meet,
    meet,
    metric_factors,
    outer_product,
    polarity,
    reduced_factors,
)
from algorithms.subspaces.index_tables import blade_table, blade_table_terms
from algorithms.subspaces.loops import orthonormalize
from gacompiler.algebra import duality, factorization, versors
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CGA3, STA, orthogonal
from gacompiler.algebra.multivector import Multivector
from tests.support.all_cases import all_cases

RANDOM = np.random.default_rng(20)


@pytest.fixture(autouse=True)
def same_numbers_in_any_order() -> None:
    """The numbers of a test do not depend on the tests before it."""
    RANDOM.bit_generator.state = np.random.default_rng(20).bit_generator.state


def exact_blade(algebra: Algebra, rows: np.ndarray) -> Multivector:
    vectors = (Multivector(algebra, {1 << i: int(x) for i, x in enumerate(row)}) for row in rows)
    return reduce(lambda a, b: a ^ b, vectors, algebra.scalar(1))


def of_exact(element: Multivector, grade: int, scale: float = 1.0) -> Blade:
    blades = element.algebra.blades(grade)
    return Blade([float(Fraction(element[b])) * scale for b in blades], element.algebra.dimension, grade)


def minors(rows: np.ndarray) -> np.ndarray:
    """The coefficients of an outer product, as determinants; the order is that of bitmaps."""
    k, n = rows.shape[-2:]
    chosen = sorted(combinations(range(n), k), key=lambda c: sum(1 << i for i in c))
    return np.stack([np.linalg.det(rows[..., list(c)]) for c in chosen], -1)


def gram_of(algebra: Algebra) -> np.ndarray:
    return np.array([[float(x) for x in row] for row in algebra.gram])


def relative(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.max(np.abs(a - b)) / np.max(np.abs(b)))


@all_cases("n", range(1, 11))
def test_coefficients_are_minors(n: int) -> None:
    for k in range(n + 1):
        rows = RANDOM.normal(size=(3, k, n))
        assert relative(FactoredBlade.of_vectors(rows).coefficients().coefficients, minors(rows)) < 1e-13


@pytest.mark.parametrize("n", range(3, 11))
@pytest.mark.parametrize("scale", [1e-8, 1e8])
def test_factors_give_the_blade_back(n: int, scale: float) -> None:
    for k in range(n + 1):
        rows = RANDOM.normal(size=(4, k, n))
        blade = Blade(scale * minors(rows), n, k)
        for found in (factorize_blade(blade), factorize_blade(blade, averaged=True)):
            assert relative(found.coefficients().coefficients, blade.coefficients) < 1e-12
        vectors, size = reduced_factors(blade)
        assert relative(size[:, None] * minors(vectors), blade.coefficients) < 1e-12
        assert np.abs(vectors).max(initial=0) <= 1 + 1e-15
        if k:
            one, two = np.linalg.qr(np.swapaxes(rows, -1, -2))[0], found.vectors
            assert np.abs(np.linalg.norm(two @ one, axis=(-1, -2)) ** 2 - k).max() < 1e-12


@pytest.mark.parametrize("n", range(3, 9))
def test_nearly_dependent_factors(n: int) -> None:
    """Coefficients computed exactly from integers, so that only their rounding is left."""
    algebra = orthogonal(n)
    for k in range(2, n):
        for scale in (1e-8, 1e8):
            rows = RANDOM.integers(-5, 6, (k, n))
            rows[-1] = rows[0] * 10**7 + np.eye(n, dtype=int)[-1]
            element = exact_blade(algebra, rows)
            if not element.terms:
                continue
            blade = of_exact(element, k, scale)
            assert relative(factorize_blade(blade).coefficients().coefficients, blade.coefficients) < 1e-10
            assert (
                relative(factorize_blade(blade, averaged=True).coefficients().coefficients, blade.coefficients) < 1e-10
            )


def test_all_coefficients_average_noise() -> None:
    n, k, noise = 8, 3, 1e-4
    rows = RANDOM.normal(size=(200, k, n))
    blade = FactoredBlade(np.swapaxes(np.linalg.qr(np.swapaxes(rows, -1, -2))[0], -1, -2)).coefficients()
    noisy = Blade(blade.coefficients + noise * RANDOM.normal(size=blade.coefficients.shape), n, k)
    error = {
        averaged: np.median(
            np.linalg.norm(
                factorize_blade(noisy, None, averaged=averaged).coefficients().coefficients - blade.coefficients,
                axis=-1,
            )
        )
        for averaged in (False, True)
    }
    assert error[True] < 0.7 * error[False]
    with pytest.raises(ValueError, match="no blade"):
        factorize_blade(noisy)
    with pytest.raises(ValueError, match="no blade"):
        factorize_blade(noisy, averaged=True)


@pytest.mark.parametrize(("n", "k"), [(4, 2), (6, 3), (8, 4), (10, 5), (11, 5)])
def test_what_is_no_blade_is_found_by_any_coefficient(n: int, k: int) -> None:
    rows = RANDOM.normal(size=(k, n))
    blade = minors(rows) * 1e6
    size = np.linalg.norm(blade)
    for place in RANDOM.integers(0, len(blade), 20):
        other = blade.copy()
        other[place] += 1e-7 * size
        # the sum of two blades of which one is a basis blade is a blade where they share k - 1 directions: never here
        with pytest.raises(ValueError, match="no blade"):
            factorize_blade(Blade(other, n, k))
        other[place] = blade[place] + 1e-12 * size
        factorize_blade(Blade(other, n, k))


def test_outer_products() -> None:
    none = outer_product(Blade(np.empty((0, 3)), 3, 1), Blade(np.empty((0, 3)), 3, 2))
    assert none.coefficients.shape == (0, 1)
    for n, a, b in ((4, 1, 1), (5, 2, 2), (6, 2, 3), (7, 0, 4), (10, 4, 5)):
        rows = RANDOM.normal(size=(5, a + b, n))
        one, two = FactoredBlade.of_vectors(rows[:, :a]), FactoredBlade.of_vectors(rows[:, a:])
        expected = minors(rows)
        assert relative(outer_product(one.coefficients(), two.coefficients()).coefficients, expected) < 1e-12
        assert relative(outer_product(one, two).coefficients().coefficients, expected) < 1e-12


@pytest.mark.parametrize("n", range(2, 11))
def test_dimensions_and_subspaces_of_join_and_meet(n: int) -> None:
    for _ in range(4):
        m = int(RANDOM.integers(0, n + 1))
        x = int(RANDOM.integers(0, n - m + 1))
        y = int(RANDOM.integers(0, n - m - x + 1))
        rows = RANDOM.normal(size=(8, m + x + y, n))
        scales = 10.0 ** RANDOM.integers(-8, 9, (2, 8))
        turn = RANDOM.normal(size=(8, m + y, m + y))
        first = FactoredBlade.of_vectors(rows[:, : m + x])
        second = FactoredBlade.of_vectors(turn @ np.delete(rows, np.s_[m : m + x], axis=1))
        one, two = FactoredBlade(first.vectors, scales[0]), FactoredBlade(second.vectors, scales[1])
        for a, b in ((one, two), (one.coefficients(), two.coefficients())):
            found = join_and_meet(a, b)
            assert (found.join_grade == m + x + y).all() and (found.meet_grade == m).all()
            joined, met = found.join(), found.meet()
            if isinstance(joined, Blade):
                joined, met = factorize_blade(joined), factorize_blade(met)
            for blade, truth in ((joined, rows), (met, rows[:, :m])):
                q = np.swapaxes(np.linalg.qr(np.swapaxes(truth, -1, -2))[0], -1, -2)
                sines = blade.vectors - blade.vectors @ np.swapaxes(q, -1, -2) @ q
                assert np.abs(sines).max(initial=0) < 1e-8
                assert blade.grade == truth.shape[1]
            assert np.allclose(np.abs(met.scale), 1.0, atol=1e-12)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9, 1e-11])
def test_angles_decide_dimensions(tolerance: float) -> None:
    """Subspaces with principal angles on both sides of the tolerance; any basis of either, any scale."""
    n = 9
    for sines in ([2.0], [0.5], [2.0, 0.5], [0.5, 0.5, 3.0], [1.5, 2.0, 0.6, 0.01], [0.0, 2.0]):
        b = len(sines)
        frame = np.swapaxes(np.linalg.qr(RANDOM.normal(size=(20, n, n)))[0], -1, -2)
        s = np.array(sines) * tolerance
        one = frame[:, :4]
        two = np.sqrt(1 - s[:, None] ** 2) * frame[:, :b] + s[:, None] * frame[:, 4 : 4 + b]
        a = FactoredBlade.of_vectors(RANDOM.normal(size=(20, 4, 4)) @ one)
        turn = np.linalg.qr(RANDOM.normal(size=(20, b, b)))[0]
        c = FactoredBlade(turn @ two, 10.0 ** RANDOM.integers(-8, 9, 20))
        found = join_and_meet(a, c, tolerance)
        assert (found.meet_grade == (np.array(sines) < 1).sum()).all()


@pytest.mark.parametrize(("n", "a", "b"), [(3, 1, 1), (5, 2, 3), (6, 3, 2), (7, 1, 6), (8, 3, 3)])
def test_joins_of_blades_apart_are_outer_products(n: int, a: int, b: int) -> None:
    """Compare with minors of integers; a few blades nearly share a direction, and if they share one, grades differ."""
    rows = RANDOM.integers(-9, 10, (400, a + b, n)).astype(float)
    rows = rows[np.linalg.cond(rows) < 1e3]
    rows[::37, a] = rows[::37, 0] + rows[::37, a] * 2.0**-12
    one, two = (Blade(minors(part), n, part.shape[1]) for part in (rows[:, :a], rows[:, a:]))
    found, truth = join(one, two).coefficients, minors(rows)
    assert (np.abs(found - truth).max(-1) <= 1e-10 * np.abs(truth).max(-1)).all()
    shared = rows.copy()
    shared[[3, 100], a] = shared[[3, 100], 0]
    with pytest.raises(ValueError, match=f"grades {a + b - 1}, {a + b} among"):
        join(one, Blade(minors(shared[:, a:]), n, b))
    with pytest.raises(ValueError, match=r"b: element \(5,\) is zero"):
        join(one, Blade(two.coefficients * (np.arange(len(rows)) != 5)[:, None], n, b))


def test_join_and_meet_of_exact_blades() -> None:
    """Scale and sign too: the join is a ^ c where b = meet ^ c."""
    for n, m, x, y in (
        (3, 1, 1, 1),
        (4, 1, 1, 2),
        (5, 2, 1, 1),
        (6, 1, 2, 2),
        (7, 2, 2, 2),
        (6, 0, 2, 3),
        (5, 2, 2, 0),
    ):
        algebra = orthogonal(n)
        rows = RANDOM.integers(-4, 5, (m + x + y, n))
        if np.linalg.matrix_rank(rows) < m + x + y:
            continue
        first = exact_blade(algebra, rows[: m + x])
        second = exact_blade(algebra, np.delete(rows, np.s_[m : m + x], axis=0)) * 5
        joined, met = factorization.join_and_meet(first, second)
        a, b = of_exact(first, m + x), of_exact(second, m + y)
        own_join, own_meet = join(a, b), meet(a, b)
        truth = of_exact(met, m).coefficients
        size = float(own_meet.coefficients @ truth / (truth @ truth))
        assert relative(own_meet.coefficients, size * truth) < 1e-12
        # a meet that is `size` times the other makes the join 1 / size times the other
        assert relative(own_join.coefficients * size, of_exact(joined, m + x + y).coefficients) < 1e-11


def test_where_the_join_is_everything_the_meet_is_the_regressive_product() -> None:
    algebra = orthogonal(5)
    first, second = (exact_blade(algebra, RANDOM.integers(-4, 5, (k, 5))) for k in (3, 4))
    truth = of_exact(duality.regressive_product(first, second), 2).coefficients
    found = meet(of_exact(first, 3), of_exact(second, 4)).coefficients
    assert np.allclose(np.abs(found @ truth), np.linalg.norm(truth))


def test_noisy_blades_join_where_the_noise_is_allowed() -> None:
    rows = RANDOM.normal(size=(20, 5, 7))
    a, b = (FactoredBlade.of_vectors(part).coefficients() for part in (rows[:, :3], rows[:, 2:]))
    noisy = Blade(b.coefficients * (1 + 1e-7 * RANDOM.normal(size=b.coefficients.shape)), 7, 3)
    with pytest.raises(ValueError, match=r"b: element \(\d+,\) is no blade"):
        join(a, noisy)
    found = join_and_meet(a, noisy, 1e-4, blade_tolerance=1e-5)
    assert (found.join_grade == 5).all() and (found.meet_grade == 1).all()
    assert (join_and_meet(a, noisy, 1e-4, blade_tolerance=None).join_grade == 5).all()


def test_grades_that_differ_in_one_batch() -> None:
    a = FactoredBlade.of_vectors([[1.0, 0, 0, 0], [0, 1, 0, 0]])
    b = FactoredBlade.of_vectors([[[1.0, 0, 0, 0]], [[0, 0, 1, 0]], [[1, 1, 0, 0]]])
    found = join_and_meet(a, b)
    assert found.join_grade.tolist() == [2, 3, 2]
    assert found.join(2).shape == (2,) and found.join(3).shape == (1,) and found.meet(1).shape == (2,)
    same = join_and_meet(a, FactoredBlade.of_vectors([[[1.0, 1, 0, 0]]]))
    assert found.meet(0).shape == (1,) and same.join(3).shape == (0,)
    with pytest.raises(ValueError, match="grades 2, 3"):
        join(a, b)
    for grade in (1, 4):
        with pytest.raises(ValueError, match="expected 2 to 3"):
            found.join(grade)


@pytest.mark.parametrize("n", [20, 30])
def test_thirty_dimensions(n: int) -> None:
    rows = RANDOM.normal(size=(4, 18, n))
    a, b = FactoredBlade.of_vectors(rows[:, :12]), FactoredBlade.of_vectors(rows[:, 7:])
    found = join_and_meet(a, b)
    assert (found.join_grade == 18).all() and (found.meet_grade == 5).all()
    both = np.concatenate([found.join().vectors, rows], 1)
    assert (np.linalg.matrix_rank(both, tol=1e-8) == 18).all()
    wedge = outer_product(a, FactoredBlade.of_vectors(rows[:, 12:]))
    volumes = np.sqrt(np.linalg.det(rows @ np.swapaxes(rows, -1, -2)))
    assert relative(np.abs(wedge.scale), volumes) < 1e-10
    twice = dual(dual(wedge))  # 18 is even, so the sign is that of the two bases
    same = np.linalg.det(twice.vectors @ np.swapaxes(wedge.vectors, -1, -2))
    assert relative(twice.scale * same, wedge.scale) < 1e-12


def test_sixteen_dimensions_by_coefficients() -> None:
    rows = RANDOM.normal(size=(7, 16))
    a, b = (FactoredBlade.of_vectors(part).coefficients() for part in (rows[:5], rows[3:]))
    assert a.coefficients.shape == (comb(16, 5),)
    assert join(a, b).grade == 7 and meet(a, b).grade == 2


@pytest.mark.parametrize("algebra", [CGA3, STA, TEN, orthogonal(6)], ids=lambda a: a.name)
def test_duals_of_exact_blades(algebra: Algebra) -> None:
    n, gram = algebra.dimension, gram_of(algebra)
    orientation = algebra.spelling(algebra.everything)[0]
    for k in (0, 1, 3, n):
        element = exact_blade(algebra, RANDOM.integers(-4, 5, (k, n)))
        blade = of_exact(element, k)
        for form in (blade, factorize_blade(blade)):
            for own, exact in ((dual(form), duality.dual(element)), (polarity(form, gram), duality.polarity(element))):
                found = own.coefficients() if isinstance(own, FactoredBlade) else own
                assert relative(found.coefficients * orientation, of_exact(exact, n - k).coefficients) < 1e-10


@pytest.mark.parametrize("algebra", [CGA3, STA, TEN, orthogonal(5)], ids=lambda a: a.name)
def test_delta_products_of_exact_blades(algebra: Algebra) -> None:
    n, gram = algebra.dimension, gram_of(algebra)
    for m, x, y in ((0, 1, 2), (1, 1, 1), (2, 1, 1), (1, 2, 1), (2, 0, 1)):
        if m + x + y > n:
            continue
        rows = RANDOM.integers(-3, 4, (m + x + y, n))
        first = exact_blade(algebra, rows[: m + x])
        second = exact_blade(algebra, np.delete(rows, np.s_[m : m + x], axis=0))
        exact = factorization.delta_product(first, second)
        if exact.grades != (x + y,):
            continue
        met = factorization.meet(first, second)
        if versors.norm_squared(met) == 0:
            with pytest.raises(ValueError, match="null"):
                delta_product(of_exact(first, m + x), of_exact(second, m + y), gram)
            continue
        found = delta_product(of_exact(first, m + x), of_exact(second, m + y), gram)
        assert relative(found.coefficients, of_exact(exact, x + y).coefficients) < 1e-9


@pytest.mark.parametrize("apart", [1.0, 1e-4, 1e-8, 1e-11])
def test_rows_near_to_each_other_become_orthonormal(apart: float) -> None:
    """Rows are orthonormal up to rounding, however small the remainder, and the volume equals that of numpy's QR."""
    rows = RANDOM.normal(size=(3, 1, 6)) + apart * RANDOM.normal(size=(3, 4, 6))
    volumes = np.abs(np.diagonal(np.linalg.qr(np.swapaxes(rows, -1, -2))[1], axis1=-2, axis2=-1)).prod(-1)
    made = rows.copy()
    found = [orthonormalize.py_func(made, e, 4) for e in range(3)]  # as compiled within other loops
    assert np.abs(made @ np.swapaxes(made, -1, -2) - np.eye(4)).max() < 1e-14
    assert np.allclose(found, volumes, rtol=1e-14 / apart + 1e-13)


@pytest.mark.parametrize("size", [2, 3, 4])
def test_a_coarse_tolerance_is_for_sines_of_principal_angles(size: int) -> None:
    """Between any two sines, where bounds leave a doubt: the shared directions are numpy's singular vectors."""
    for _ in range(12):
        q = RANDOM.normal(size=(size, 9))
        p = q + RANDOM.choice([0.3, 1.0, 3.0]) * RANDOM.normal(size=q.shape)
        one, two = (np.linalg.qr(rows.T)[0].T for rows in (p, q))
        turn, sines, across = np.linalg.svd(two - two @ one.T @ one, full_matrices=False)
        for rank in range(1, size):
            tolerance = np.sqrt(sines[rank - 1] * sines[rank])
            if sines[rank - 1] < 1.05 * sines[rank]:
                continue
            blades = FactoredBlade.of_vectors(one), FactoredBlade.of_vectors(two)
            found = join_and_meet(*blades, tolerance)
            whole, shared = found.join().vectors, found.meet().vectors
            assert whole.shape == (size + rank, 9) and shared.shape == (size - rank, 9)
            expected = turn[:, rank:].T @ two
            assert np.abs(shared.T @ shared - expected.T @ expected).max() < 1e-12
            expected = np.concatenate([one, across[:rank]])
            assert np.abs(whole.T @ whole - expected.T @ expected).max() < 1e-12


@pytest.mark.parametrize("apart", [1e-2, 1e-5, 1e-7])
def test_joins_of_subspaces_near_to_each_other_are_orthonormal(apart: float) -> None:
    """The error is that of rounding, not of rounding divided by the sine between them."""
    rows = RANDOM.normal(size=(20, 3, 9))
    one, two = (FactoredBlade.of_vectors(x) for x in (rows, rows + apart * RANDOM.normal(size=rows.shape)))
    found = join_and_meet(one, two, 1e-11).join()
    assert found.vectors.shape == (20, 6, 9)
    assert np.abs(found.vectors @ np.swapaxes(found.vectors, -1, -2) - np.eye(6)).max() < 1e-14


def test_delta_products_in_batches() -> None:
    """Batches with two leading axes of different lengths equal single products."""
    rng = np.random.default_rng(8)
    shared, x, y = rng.normal(size=(2, 3, 1, 5)), rng.normal(size=(2, 3, 1, 5)), rng.normal(size=(2, 3, 2, 5))
    a, b = (FactoredBlade.of_vectors(np.concatenate([shared, each], -2)) for each in (x, y))
    found = delta_product(a, b).coefficients()
    assert found.grade == 3
    for k in np.ndindex(2, 3):
        one, two = (FactoredBlade.of_vectors(np.concatenate([shared[k], each[k]], -2)) for each in (x, y))
        assert relative(found.coefficients[k], delta_product(one, two).coefficients().coefficients) < 1e-9


def test_metric_factors_are_orthogonal() -> None:
    gram = gram_of(CGA3)
    blade = FactoredBlade.of_vectors(RANDOM.normal(size=(6, 3, 5)))
    vectors, squares = metric_factors(blade, gram)
    inner = vectors @ gram @ np.swapaxes(vectors, -1, -2)
    off = inner - np.einsum("...ii->...i", inner)[..., None] * np.eye(3)
    assert np.abs(off).max() < 1e-12 * max(1.0, np.abs(inner).max()) * 100
    assert relative(minors(vectors), blade.coefficients().coefficients) < 1e-12
    assert squares.shape == (6, 3)


LINE = Blade([1.0, 0, 0, 0, 0, 0], 4, 2)
TWISTED = Blade([[1.0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 1]], 4, 2)
AXIS = FactoredBlade(np.eye(3)[:1])
NONE = Blade(np.empty((0, 3)), 3, 1)
ALONE = Blade([1.0, 0, 0], 3, 1)
PAIR, FOUR = (Blade(np.ones((count, 3)), 3, 1) for count in (2, 4))
NOTHING = FactoredBlade(np.eye(3)[:1], 0.0)

BAD = {
    "no blade": (lambda: factorize_blade(TWISTED), ValueError, r"\(1,\) is no blade"),
    "no blade in join": (lambda: join(LINE, TWISTED), ValueError, r"b: element \(1,\) is no blade"),
    "zero": (lambda: factorize_blade(Blade(np.zeros(6), 4, 2)), ValueError, "is zero"),
    "zero factored": (lambda: join(NOTHING, AXIS), ValueError, "a: element is zero"),
    "not a number": (lambda: Blade([1.0, np.nan, 0], 3, 1), ValueError, "nan at"),
    "infinite": (lambda: FactoredBlade.of_vectors([[np.inf, 0]]), ValueError, "finite"),
    "complex": (lambda: Blade([1j, 0, 0], 3, 1), TypeError, "real"),
    "too few": (lambda: Blade([1.0, 2.0], 3, 1), ValueError, r"\(\.\.\., 3\)"),
    "empty": (lambda: Blade([], 3, 1), ValueError, r"shape \(0,\)"),
    "no elements": (lambda: join(NONE, ALONE), ValueError, "no elements"),
    "grade": (lambda: Blade([1.0], 3, 4), ValueError, "0 to n = 3"),
    "dimension": (lambda: Blade([1.0], 17, 0), ValueError, "FactoredBlade"),
    "mixed algebras": (lambda: join(LINE, ALONE), ValueError, "same algebra"),
    "mixed forms": (lambda: meet(ALONE, AXIS), TypeError, "same form"),
    "an array": (lambda: meet(LINE, np.zeros(6)), TypeError, "b: ndarray"),
    "grades too large": (lambda: outer_product(Blade(np.ones(4), 4, 3), LINE), ValueError, "sum up to 4"),
    "axes": (lambda: join(PAIR, FOUR), ValueError, "broadcast"),
    "overflow": (lambda: FactoredBlade.of_vectors(1e200 * np.eye(2)), ValueError, "inf"),
    "tolerance": (lambda: join(LINE, LINE, 0.0), ValueError, "sine"),
    "too many vectors": (lambda: FactoredBlade.of_vectors(np.ones((3, 2))), ValueError, "expected at most n rows"),
    "not orthonormal": (lambda: FactoredBlade([[1.0, 1.0]]), ValueError, "of_vectors"),
    "degenerate": (lambda: polarity(LINE, [1, 1, 1, 0]), ValueError, "dual"),
    "gram": (lambda: polarity(LINE, np.eye(3)), ValueError, "gram"),
    "null meet": (lambda: delta_product(AXIS, AXIS, [0, 1, 1]), ValueError, "null"),
}


@all_cases("name", BAD)
def test_bad_arguments_are_named(name: str) -> None:
    call, kind, words = BAD[name]
    with pytest.raises(kind, match=words):
        call()


def test_the_size_of_a_table_is_known_before_it_is_made() -> None:
    for n, grade in ((4, 2), (6, 3), (7, 2)):
        assert blade_table_terms(n, grade) == len(blade_table(n, grade).left) > 0


def test_the_benchmark_writes_its_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    from benchmarks import subspaces

    monkeypatch.setattr(subspaces, "CLIFFORD", 0)
    out = tmp_path / "page.md"
    assert subspaces.main(["--quick", "--out", str(out)]) == 0
    rows = [line.split(" | ")[:2] for line in out.read_text().splitlines() if line.startswith("| ")]
    assert [row for row in rows if row[0][2:].isdigit()] == [
        ["| 3", "1, 1"], ["| 5", "1, 1"],
        ["| 3", "1, 1"], ["| 5", "2, 2"],
    ]  # fmt: skip
    assert len(rows) == 3 * 2 + 2 * 2 + 5
    assert subspaces.main(["--quick", "--out", str(tmp_path / "page.md" / "no")]) == 1


@pytest.mark.peers
def test_join_and_meet_of_clifford() -> None:
    clifford = pytest.importorskip("clifford")
    layout, _ = clifford.Cl(4)
    for m, x, y in ((1, 1, 1), (1, 1, 2), (0, 1, 2)):
        rows = RANDOM.integers(-3, 4, (m + x + y, 4)).astype(float)
        vectors = [sum(c * v for c, v in zip(row, layout.basis_vectors_lst, strict=True)) for row in rows]
        first, second = rows[: m + x], np.delete(rows, np.s_[m : m + x], axis=0)
        a, b = FactoredBlade.of_vectors(first), FactoredBlade.of_vectors(second)
        one = reduce(lambda u, v: u ^ v, vectors[: m + x])
        two = reduce(lambda u, v: u ^ v, vectors[:m] + vectors[m + x :])
        assert join(a, b).grade == next(iter(one.join(two).grades()))
        assert meet(a, b).grade == next(iter(one.meet(two).grades()))
