"""Versors as vectors, maps as reflections, kinds of elements: against exact algebras and matrices of numpy."""

from __future__ import annotations

from fractions import Fraction
from functools import reduce

import numpy as np
import pytest
from exact_elements import NULL_PAIRS, OBLIQUE, TEN
from scipy.linalg import expm
from scipy.stats import ortho_group

from algorithms.subspaces import (
    FactoredBlade,
    FactoredVersor,
    classify,
    factorize_versor,
    reflections_of,
    versor_coefficients,
)
from gacompiler.algebra import classification
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CGA3, PGA3, STA, VGA3, orthogonal
from gacompiler.algebra.multivector import Multivector
from gacompiler.algebra.versors import inverse, norm_squared, sandwich
from tests.support.all_cases import all_cases

RANDOM = np.random.default_rng(21)


@pytest.fixture(autouse=True)
def same_numbers_in_any_order() -> None:
    """The numbers of a test do not depend on the tests before it."""
    RANDOM.bit_generator.state = np.random.default_rng(21).bit_generator.state


ALGEBRAS = [VGA3, PGA3, CGA3, STA, NULL_PAIRS, OBLIQUE, orthogonal(6), orthogonal(3, 3)]


def gram_of(algebra: Algebra) -> np.ndarray:
    return np.array([[float(x) for x in row] for row in algebra.gram])


def exact_vectors(algebra: Algebra, count: int) -> tuple[np.ndarray, list[Multivector]]:
    """Integer vectors that are far from null."""
    gram, rows = gram_of(algebra), []
    while len(rows) < count:
        row = RANDOM.integers(-4, 5, algebra.dimension)
        if abs(row @ gram @ row) > 0.1 * (row @ row) > 0:
            rows.append(row)
    return np.array(rows).reshape(count, algebra.dimension), [
        Multivector(algebra, {1 << i: int(x) for i, x in enumerate(row)}) for row in rows
    ]


def coefficients(element: Multivector) -> np.ndarray:
    return np.array([float(Fraction(element[blade])) for blade in element.algebra.blades()])


def product_of(algebra: Algebra, vectors: list[Multivector]) -> Multivector:
    return reduce(lambda a, b: a * b, vectors, algebra.scalar(1))


def relative(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.max(np.abs(a - b)) / np.max(np.abs(b)))


def map_of(vectors: np.ndarray, gram: np.ndarray) -> np.ndarray:
    """Reflections one after the other, by the formula of a reflection."""
    result = np.eye(len(gram))
    for v in vectors:
        result = result @ (np.eye(len(gram)) - 2 * np.outer(v, v @ gram) / (v @ gram @ v))
    return result


@pytest.mark.parametrize("algebra", ALGEBRAS, ids=lambda a: a.name)
def test_products_of_versors_are_exact_products(algebra: Algebra) -> None:
    n, gram = algebra.dimension, gram_of(algebra)
    for a, b in ((1, 1), (2, 1), (2, 2), (n, 2), (n, n)):
        rows, vectors = exact_vectors(algebra, a + b)
        one, two = FactoredVersor(rows[:a], gram, -3.0), FactoredVersor(rows[a:], gram)
        product = one.geometric_product(two)
        exact = product_of(algebra, vectors) * -3
        # strong boosts, whose reflections would be inaccurate, keep all their vectors
        assert product.n_vectors <= n or np.linalg.norm(product.matrix(), 2) > 1e4
        assert relative(versor_coefficients(product), coefficients(exact)) < 1e-9
        assert relative(product.norm_squared(), np.array(float(norm_squared(exact).scalar))) < 1e-9
        one_x, (x,) = exact_vectors(algebra, 1)
        moved = product.apply(FactoredBlade.of_vectors(one_x))
        truth = coefficients(sandwich(exact, x) / norm_squared(exact))[1 : n + 1]
        assert relative(moved.scale * moved.vectors[0], truth) < 1e-8
        back = versor_coefficients(product.inverse())
        assert relative(back, coefficients(inverse(exact))) < 1e-8


def test_blades_as_versors() -> None:
    gram = gram_of(CGA3)
    blade = FactoredBlade.of_vectors(RANDOM.normal(size=(4, 3, 5)))
    found = versor_coefficients(FactoredVersor.of_blade(blade, gram))
    assert relative(found[:, 16:26], blade.coefficients().coefficients) < 1e-10
    assert np.abs(np.delete(found, np.s_[16:26], axis=1)).max() < 1e-10 * np.abs(found).max()
    with pytest.raises(ValueError, match="null"):
        FactoredVersor.of_blade(FactoredBlade(np.eye(5)[3:4]), gram)


@pytest.mark.parametrize("n", [8, 16, 30])
def test_reflections_of_rotations(n: int) -> None:
    for turn in (ortho_group.rvs(n, random_state=n), np.eye(n), -np.eye(n), np.eye(n)[RANDOM.permutation(n)]):
        found = reflections_of(turn)
        assert np.abs(map_of(found, np.eye(n)) - turn).max() < 1e-13
        assert len(found) == np.linalg.matrix_rank(turn - np.eye(n), tol=1e-9)
    few = np.eye(n)
    few[:3, :3] = ortho_group.rvs(3, random_state=1)
    assert len(reflections_of(few)) <= 3
    small = expm(1e-7 * (lambda x: x - x.T)(RANDOM.normal(size=(n, n))))
    assert np.abs(map_of(reflections_of(small), np.eye(n)) - small).max() < 1e-13


@pytest.mark.parametrize(
    ("algebra", "tolerance"),
    [(STA, 1e-11), (CGA3, 1e-11), (PGA3, 1e-11), (OBLIQUE, 1e-11), (NULL_PAIRS, 1e-11), (TEN, 1e-8)],
    ids=lambda x: getattr(x, "name", ""),
)
def test_reflections_in_any_metric(algebra: Algebra, tolerance: float) -> None:
    n, gram = algebra.dimension, gram_of(algebra)
    for count in range(n + 1):
        rows, _ = exact_vectors(algebra, count)
        truth = map_of(rows, gram)
        found = reflections_of(truth, gram)
        assert len(found) <= n and (len(found) - count) % 2 == 0
        assert np.abs(map_of(found, gram) - truth).max() < tolerance * np.abs(truth).max() ** 2


def test_maps_that_change_null_directions_only() -> None:
    w1, w2, _, _ = NULL_PAIRS.basis()
    for element, count in ((1 + w1 * w2, 4), (PGA3.multivector({"1": 1, "e01": 3, "e02": -1}), 2)):
        gram = gram_of(element.algebra)
        found = factorize_versor(coefficients(element), gram)
        assert found.n_vectors == count
        assert relative(versor_coefficients(found), coefficients(element)) < 1e-10


@pytest.mark.parametrize("p", range(1, 5))
def test_maps_of_neutral_metrics(p: int) -> None:
    """GL(p) on null vectors, and shears between null spaces, whose changes are all null."""
    gram = np.kron([[0.0, 1.0], [1.0, 0.0]], np.eye(p))
    for kind in range(12):
        shear, skew = np.eye(2 * p), RANDOM.normal(size=(p, p))
        shear[:p, p:] = skew - skew.T
        linear = np.linalg.qr(RANDOM.normal(size=(p, p)))[0] @ np.diag(RANDOM.uniform(0.5, 2.0, p))
        zero = np.zeros((p, p))
        truth = np.block([[linear, zero], [zero, np.linalg.inv(linear).T]]) if kind % 3 else np.eye(2 * p)
        truth = truth @ shear if kind % 2 else truth
        found = reflections_of(truth, gram)
        assert np.abs(map_of(found, gram) - truth).max() < 1e-9
        assert len(found) <= 2 * p


@pytest.mark.parametrize("n", range(3, 7))
def test_all_maps_of_rigid_bodies(n: int) -> None:
    """Rotations, reflections and translations of n - 1 dimensions, as PGA has them on planes: one null direction."""
    gram = np.diag([1.0] * (n - 1) + [0.0])
    for kind in range(12):
        truth = np.eye(n)
        if kind % 3:
            truth[:-1, :-1] = ortho_group.rvs(n - 1, random_state=kind)
        if kind % 2:
            truth[-1, :-1] = RANDOM.normal(size=n - 1) * 10.0 ** RANDOM.integers(-3, 4)
        found = reflections_of(truth, gram)
        assert np.abs(map_of(found, gram) - truth).max() < 1e-9 * np.abs(truth).max()
        assert len(found) <= n


@all_cases("scale", [1e-8, 1.0, 1e8])
@all_cases("algebra", ALGEBRAS)
def test_versors_are_factorised(algebra: Algebra, scale: float) -> None:
    n, gram = algebra.dimension, gram_of(algebra)
    for count in range(min(n, 5) + 1):
        _, vectors = exact_vectors(algebra, count)
        element = scale * coefficients(product_of(algebra, vectors))
        found = factorize_versor(element, gram)
        assert found.n_vectors <= n
        assert relative(versor_coefficients(found), element) < 1e-9


def test_thirty_dimensions() -> None:
    """A product of sixty vectors keeps at most thirty, with the same map, norm and sign."""
    n = 30
    one, two = (FactoredVersor(RANDOM.normal(size=(2, n, n)), scale=0.5) for _ in range(2))
    product = one.geometric_product(two)
    assert product.n_vectors <= n
    assert np.abs(product.matrix() - one.matrix() @ two.matrix()).max() < 1e-12
    assert relative(product.norm_squared(), one.norm_squared() * two.norm_squared()) < 1e-9
    back = product.geometric_product(two.inverse()).geometric_product(one.inverse())
    assert back.n_vectors == 0 or np.abs(back.matrix() - np.eye(n)).max() < 1e-12
    identity = back.reduced()
    assert np.allclose(identity.norm_squared(), 1.0)
    square = (identity.vectors**2).sum(-1).prod(-1) if identity.n_vectors else 1.0
    assert np.allclose(identity.scale * square, 1.0)


def test_the_sign_of_a_turn_by_two_pi() -> None:
    """Two half turns are -1, which their map does not show."""
    half = FactoredVersor(np.eye(3)[:2])
    whole = half.geometric_product(half)
    assert np.allclose(versor_coefficients(whole), [-1, 0, 0, 0, 0, 0, 0, 0])
    assert np.allclose(versor_coefficients(whole.geometric_product(whole)), [1, 0, 0, 0, 0, 0, 0, 0])


def test_kinds_of_elements() -> None:
    e1, e2, e3, e0 = PGA3.basis()
    cases = [
        (PGA3.scalar(0), "zero", -1, False),
        (PGA3.scalar(-2), "blade", 0, True),
        (e1 ^ e2, "blade", 2, True),
        (e0 ^ (e2 + e1), "blade", 2, False),
        ((e1 ^ e2) + (e3 ^ e0), "general", -1, False),
        (1 + 2 * (e1 ^ e0), "versor", -1, True),
        ((e1 + e2) * (e2 - e0) * (e3 + e0) + 0, "versor", -1, True),
        (e1 + 1, "general", -1, False),
        (1 + (e1 ^ e2 ^ e3 ^ e0), "general", -1, False),
        (e1 ^ e2 ^ (e3 + 4 * e0), "blade", 3, True),
    ]
    for size in (1e-8, 1.0, 1e8):
        found = classify(size * np.array([coefficients(element) for element, *_ in cases]), gram_of(PGA3))
        assert found.kind.tolist() == [kind for _, kind, _, _ in cases]
        assert found.grade.tolist() == [grade for _, _, grade, _ in cases]
        assert found.is_versor.tolist() == [is_versor for *_, is_versor in cases]
        truth = [size**2 * float(norm_squared(element).scalar) for element, *_ in cases]
        assert np.allclose(found.norm_squared, truth, atol=1e-12 * size**2)
    oblique = [coefficients(v) for v in OBLIQUE.basis()]
    assert np.allclose(classify(oblique, gram_of(OBLIQUE)).norm_squared, [2.0, 1.5, -1.0])
    mixed = coefficients(orthogonal(4).multivector({"e1e2": 1, "e3e4": 1e-6}))
    assert classify(mixed).kind == "general" and classify(mixed, tolerance=1e-5).kind == "blade"


PLANE = FactoredVersor(np.eye(2))


@pytest.mark.parametrize("algebra", [*ALGEBRAS, orthogonal(2, 2, 1)], ids=lambda a: a.name)
def test_kinds_agree_with_exact_factors(algebra: Algebra) -> None:
    """Products of vectors, and the same with one coefficient more; shears 1 + n m of null vectors too."""
    basis = algebra.basis()
    null = [(a, b) for a in basis for b in basis if a * a == 0 and b * b == 0 and a * b + b * a == 0 and (a ^ b).terms]
    elements = []
    for count in range(algebra.dimension + 1):
        element = product_of(algebra, exact_vectors(algebra, count)[1])
        if null and count % 2:
            a, b = null[count % len(null)]
            element = element * (1 + 2 * a * b)
        extra = reduce(lambda a, b: a ^ b, basis[: 2 + count % 2], algebra.scalar(1))
        elements += [element, element + extra, extra]
    found = classify([coefficients(element) for element in elements], gram_of(algebra))
    exact = [classification.classify(element) for element in elements]
    assert found.kind.tolist() == [one.kind.value for one in exact]
    assert found.is_versor.tolist() == [one.is_versor for one in exact]
    assert found.is_null.tolist() == [one.is_null for one in exact]
    assert {"versor", "blade"} <= set(found.kind.tolist())


BAD = {
    "null vector": (lambda: FactoredVersor([[1.0, 1.0]], [1, -1]), ValueError, "null"),
    "zero vector": (lambda: FactoredVersor([[0.0, 0.0]]), ValueError, "null or zero"),
    "other metric": (lambda: PLANE.geometric_product(FactoredVersor(np.eye(2), [1, -1])), ValueError, "metric"),
    "no versor to multiply": (lambda: PLANE.geometric_product(3), TypeError, "other: int"),
    "no rotation": (lambda: reflections_of(2 * np.eye(3)), ValueError, "preserves them"),
    "not square": (lambda: reflections_of(np.ones((2, 3))), ValueError, r"expected \(n, n\)"),
    "radical": (lambda: reflections_of(np.diag([1.0, 2.0]), [1, 0]), ValueError, "fixes the vectors"),
    "no versor": (lambda: factorize_versor([1.0, 1, 0, 0]), ValueError, "no versor"),
    "zero": (lambda: factorize_versor(np.zeros(4)), ValueError, "zero"),
    "not a power": (lambda: classify([1.0, 2, 3]), ValueError, r"2\*\*n"),
    "empty": (lambda: classify([]), ValueError, r"2\*\*n"),
    "not finite": (lambda: classify([1.0, np.nan]), ValueError, "nan"),
    "not symmetric": (lambda: classify(np.ones(4), [[1, 1], [0, 1]]), ValueError, "symmetric"),
    "null dimensions": (lambda: classify(np.ones(8), [1, 0, 0]), ValueError, "orthogonal to all"),
    "too many coefficients": (lambda: versor_coefficients(FactoredVersor(np.eye(13))), ValueError, "at most 12"),
    "two null": (lambda: FactoredVersor(np.eye(3)[:1], [1, 0, 0]).reduced(), ValueError, "reduced"),
    "no blade": (lambda: FactoredVersor(np.eye(3)).apply(np.eye(3)), ValueError, "FactoredBlade"),
}  # fmt: skip


@all_cases("name", BAD)
def test_bad_arguments_are_named(name: str) -> None:
    call, kind, words = BAD[name]
    with pytest.raises(kind, match=words):
        call()
