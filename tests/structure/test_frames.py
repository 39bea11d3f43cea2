"""Orthogonal frames: products through a frame are the products of the algebra."""

from __future__ import annotations

from fractions import Fraction
from random import Random

from gacompiler import Algebra
from gacompiler.algebra.catalog import CGA3, PGA3
from gacompiler.algebra.products import product
from gacompiler.structure.frames import orthogonal_frame
from tests.support.all_cases import all_cases

GRAMS = {
    "positive": [[2, 1, 1], [1, 2, 1], [1, 1, 2]],
    "no squares": [[0, 1, 2], [1, 0, 3], [2, 3, 0]],
    "degenerate": [[1, 1, 1, 0], [1, 1, 1, 0], [1, 1, 1, 2], [0, 0, 2, 0]],
    "null": [[0, 0, 1], [0, 0, 1], [1, 1, 0]],
    "fractions": [[Fraction(1, 3), Fraction(2, 5), 1], [Fraction(2, 5), -1, 7], [1, 7, 2]],
}


@all_cases("name", list(GRAMS))
def test_products_through_a_frame(name: str) -> None:
    gram = GRAMS[name]
    algebra = Algebra(name, [f"b{k}" for k in range(len(gram))], gram)
    frame, random = orthogonal_frame(algebra), Random(2)
    assert frame is not None
    assert all(not value for i, row in enumerate(frame.algebra.gram) for j, value in enumerate(row) if i != j)
    a, b = ({blade: random.randint(-9, 9) for blade in algebra.blades()} for _ in range(2))
    kept = {blade: value for blade, value in a.items() if value}
    assert {blade: value for blade, value in frame.from_frame(frame.to_frame(a)).items() if value} == kept
    through = frame.from_frame(product(frame.algebra, "geometric_product", frame.to_frame(a), frame.to_frame(b)))
    expected = product(algebra, "geometric_product", a, b)
    assert {blade: value for blade, value in through.items() if value} == expected


def test_orthogonal_bases_and_null_pairs_are_kept() -> None:
    assert orthogonal_frame(CGA3) is None is orthogonal_frame(PGA3)
