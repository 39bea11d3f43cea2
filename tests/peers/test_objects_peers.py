"""Numeric objects against clifford, on the same numbers."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from gacompiler.algebra.catalog import orthogonal
from gacompiler.objects import Space

pytestmark = pytest.mark.peers

OPERATIONS = {
    "product": (lambda a, b: a * b, lambda a, b: a * b),
    "outer": (lambda a, b: a ^ b, lambda a, b: a ^ b),
    "sum": (lambda a, b: a + b, lambda a, b: a + b),
    "left_contraction": (lambda a, b: a.left_contraction(b), lambda a, b: a.lc(b)),
    "reverse": (lambda a, b: ~a, lambda a, b: ~a),
    "grade": (lambda a, b: a.grade(2), lambda a, b: a(2)),
    "inverse": (lambda a, b: b * a.inverse(), lambda a, b: b * a.leftLaInv()),
}


@cache
def algebras(p: int, q: int, r: int) -> tuple[Any, Space, tuple[Any, ...]]:
    """clifford's algebra, ours, and clifford's elements for our basis blades."""
    clifford = pytest.importorskip("clifford")
    layout, _ = clifford.Cl(p, q, r)
    vectors = layout.basis_vectors_lst
    # Basis vectors are matched by their squares: clifford puts null ones where it likes.
    vectors = sorted(vectors, key=lambda v: {1: 0, -1: 1, 0: 2}[round(float((v * v).value[0]))])
    space = Space(orthogonal(p, q, r))
    found = []
    for blade in space.algebra.blades():
        product = layout.scalar
        for k, vector in enumerate(vectors):
            product = product ^ vector if blade >> k & 1 else product
        found.append(product)
    return layout, space, tuple(found)


@pytest.mark.parametrize("name", OPERATIONS)
@pytest.mark.parametrize("signature", [(3, 0, 1), (1, 3, 0), (4, 1, 0)], ids=str)
def test_the_numbers_of_clifford(signature: tuple[int, int, int], name: str) -> None:
    _, space, blades = algebras(*signature)
    here, there = OPERATIONS[name]
    rng = np.random.default_rng(0)
    for _ in range(3):
        numbers = rng.normal(size=(2, len(blades)))
        ours = [space.of(space.full, row) for row in numbers]
        theirs = [sum(x * blade for x, blade in zip(row, blades, strict=True)) for row in numbers]
        a, b = here(*ours), there(*theirs)
        scale = np.abs(b.value).max()
        for blade, spelled in zip(blades, space.full.blades, strict=True):
            (index,) = np.nonzero(blade.value)[0]
            assert abs(b.value[index] * blade.value[index] - a[spelled]) < 1e-9 * scale, spelled
