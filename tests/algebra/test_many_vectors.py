"""Products of sparse multivectors with hundreds of basis vectors, against matrices of numbers."""

from __future__ import annotations

import random
from fractions import Fraction

import numpy as np
import pytest

import gacompiler
from gacompiler import Algebra, kernel
from gacompiler.algebra.multivector import Multivector


def names(n: int) -> list[str]:
    return [f"e{k}" for k in range(1, n + 1)]


@pytest.fixture(autouse=True)
def no_enumeration(monkeypatch: pytest.MonkeyPatch) -> None:
    """Algebras of so many vectors have too many blades to list."""

    def fails(*_: object) -> None:
        raise AssertionError("all blades are listed")

    monkeypatch.setattr(Algebra, "blades", fails)


def squares(n: int, rng: random.Random) -> list[int]:
    return [rng.choice((-1, 0, 1, 2)) for _ in range(n)]


def vector(algebra: Algebra, values: dict[int, int]) -> Multivector:
    return algebra.multivector({f"e{k + 1}": value for k, value in values.items()})


def test_contractions_of_bivectors_are_products_with_a_matrix() -> None:
    n, rng = 600, random.Random(1)
    metric = squares(n, rng)
    algebra = Algebra("G600", names(n), metric)
    values = {k: rng.randint(-9, 9) for k in range(n)}
    entries = {(i, j): rng.randint(1, 9) for i, j in (sorted(rng.sample(range(n), 2)) for _ in range(300))}
    bivector = algebra.multivector({f"e{i + 1}^e{j + 1}": value for (i, j), value in entries.items()})
    expected = dict.fromkeys(range(n), 0)
    for (i, j), value in entries.items():
        expected[j] += values[i] * metric[i] * value
        expected[i] -= values[j] * metric[j] * value
    found = vector(algebra, values).product("left_contraction", bivector)
    assert found.terms == {1 << k: value for k, value in expected.items() if value}
    assert vector(algebra, values).product("inner_product", bivector).terms == found.terms


def test_inner_products_of_an_oblique_basis_are_those_of_the_gram_matrix() -> None:
    n, rng = 120, random.Random(2)
    gram = [[0] * n for _ in range(n)]
    for i in range(n):
        gram[i][i] = rng.randint(-1, 2)
        if i:
            gram[i][i - 1] = gram[i - 1][i] = rng.randint(-1, 1)
    algebra = Algebra("oblique", names(n), gram)
    a, b = ({k: rng.randint(-9, 9) for k in range(n)} for _ in range(2))
    expected = sum(a[i] * gram[i][j] * b[j] for i in range(n) for j in range(n))
    for name in ("inner_product", "left_contraction", "right_contraction", "scalar_product", "hestenes_product"):
        assert vector(algebra, a).product(name, vector(algebra, b)).scalar == expected


def test_products_in_many_dimensions_are_those_of_the_vectors_involved() -> None:
    """The same multivectors in the algebra of the eight vectors that they use, for every product."""
    n, rng = 1000, random.Random(3)
    chosen = sorted(rng.sample(range(n), 8))
    metric = squares(n, rng)
    large, small = Algebra("large", names(n), metric), Algebra("small", names(8), [metric[k] for k in chosen])

    def pair(count: int) -> tuple[Multivector, Multivector]:
        terms = {}
        while len(terms) < count:
            terms[tuple(sorted(rng.sample(range(8), rng.randint(0, 5))))] = rng.randint(1, 9)
        return tuple(
            algebra.multivector({"^".join(f"e{place[k] + 1}" for k in blade) or "1": x for blade, x in terms.items()})
            for algebra, place in ((large, chosen), (small, range(8)))
        )  # type: ignore[return-value]

    def contracted(blade: int) -> int:
        return sum(1 << i for i, k in enumerate(chosen) if blade >> k & 1)

    (a, x), (b, y) = pair(60), pair(60)
    for name in (
        *("outer_product", "inner_product", "left_contraction", "right_contraction", "scalar_product"),
        *("hestenes_product", "commutator", "anticommutator"),
    ):
        found = {contracted(blade): value for blade, value in a.product(name, b).terms.items()}
        assert found == x.product(name, y).terms, name
    assert {contracted(blade): value for blade, value in (a * b).terms.items()} == (x * y).terms


@pytest.mark.slow
def test_kernels_are_compiled() -> None:
    n, rng = 300, np.random.default_rng(0)
    algebra = Algebra("G300", names(n), [1] * n)
    full = algebra.layout("vector", " ".join(names(n)))
    sparse = algebra.layout("some", " ".join(names(n)[::60]))

    @kernel(a=full, b=full)
    def inner(a, b):  # type: ignore[no-untyped-def]
        return gacompiler.inner_product(a, b)

    @kernel(a=sparse, b=sparse)
    def wedge(a, b):  # type: ignore[no-untyped-def]
        return a ^ b

    compiled = gacompiler.compile(inner, "arrays")
    assert compiled.cost["mul"] == n and compiled.cost["add"] == n - 1
    a, b = rng.normal(size=(2, n))
    np.testing.assert_allclose(compiled(a, b), a @ b, rtol=1e-12)
    a, b = rng.normal(size=(2, sparse.size))
    minors = np.outer(b, a) - np.outer(a, b)
    # Blades are ordered by their last vector, then by the first.
    found = gacompiler.compile(wedge, "arrays")(a, b)
    np.testing.assert_allclose(found, minors[np.tril_indices(sparse.size, -1)], rtol=1e-12)


def test_fractions_in_the_metric() -> None:
    algebra = Algebra("G60", names(60), [Fraction(1, k + 1) for k in range(60)])
    a = vector(algebra, dict.fromkeys(range(60), 1))
    assert (a * a).scalar == sum(Fraction(1, k + 1) for k in range(60))
