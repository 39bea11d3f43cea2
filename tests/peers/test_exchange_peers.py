"""Objects as those of clifford and kingdon: products there are products here, and everything comes back."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gacompiler.algebra.algebra import Algebra
from gacompiler.errors import AlgebraError
from gacompiler.objects import (
    CGA2,
    CGA3,
    PGA2,
    PGA3,
    STA,
    VGA3,
    Space,
    from_clifford,
    from_kingdon,
    to_clifford,
    to_kingdon,
)

pytestmark = pytest.mark.peers
clifford = pytest.importorskip("clifford")
kingdon = pytest.importorskip("kingdon")

SIGNATURES = {
    "VGA3": (3, 0, 0),
    "PGA2": (2, 0, 1),
    "PGA3": (3, 0, 1),
    "STA": (1, 3, 0),
    "CGA2": (3, 1, 0),
    "CGA3": (4, 1, 0),
}
SPACES = {"VGA3": VGA3, "PGA2": PGA2, "PGA3": PGA3, "STA": STA, "CGA2": CGA2, "CGA3": CGA3}


def pair(space: Any, shape: tuple[int, ...] = ()) -> tuple[Any, Any]:
    random = np.random.default_rng(1)
    blades = space.algebra.full.blades
    return tuple(space.multivector({blade: random.normal(size=shape) for blade in blades}) for _ in range(2))


@pytest.mark.parametrize("name", SPACES)
def test_products_of_clifford(name: str) -> None:
    space, (p, q, r) = SPACES[name], SIGNATURES[name]
    layout = clifford.Cl(p, q, r)[0]
    x, y = pair(space)
    for ours, theirs in (
        (x * y, to_clifford(x, layout) * to_clifford(y, layout)),
        (x ^ y, to_clifford(x, layout) ^ to_clifford(y, layout)),
        (~x, ~to_clifford(x, layout)),
    ):
        np.testing.assert_allclose(to_clifford(ours, layout).value, theirs.value, atol=1e-12)
        assert from_clifford(space, theirs).isclose(ours)
    many = pair(space, (2, 3))[0]
    assert to_clifford(many, layout).shape == (2, 3)
    assert np.all(from_clifford(space, to_clifford(many, layout)).isclose(many))


@pytest.mark.parametrize("name", SPACES)
@pytest.mark.parametrize("shape", [(), (4, 2)])
def test_products_of_kingdon(name: str, shape: tuple[int, ...]) -> None:
    space, algebra = SPACES[name], kingdon.Algebra(*SIGNATURES[name])
    x, y = pair(space, shape)
    there = to_kingdon(x, algebra) * to_kingdon(y, algebra)
    assert np.all(from_kingdon(space, there).isclose(x * y))
    assert np.all(from_kingdon(space, to_kingdon(x, algebra)).isclose(x))


def test_conformal_points_are_cliffords() -> None:
    from clifford import g3c

    for a in np.random.default_rng(2).normal(size=(20, 3)):
        there = g3c.up(a @ [g3c.e1, g3c.e2, g3c.e3])
        np.testing.assert_allclose(to_clifford(CGA3.point(a), g3c.layout).value, there.value, atol=1e-13)
        assert from_clifford(CGA3, there).as_layout(CGA3.algebra.POINT).isclose(CGA3.point(a))
    np.testing.assert_array_equal(to_clifford(CGA3.einf, g3c.layout).value, g3c.einf.value)
    np.testing.assert_array_equal(to_clifford(CGA3.e0, g3c.layout).value, g3c.eo.value)


def test_other_signatures_are_refused() -> None:
    with pytest.raises(AlgebraError, match="the same signature"):
        to_kingdon(PGA3.point(1, 2, 3), kingdon.Algebra(4))
    with pytest.raises(AlgebraError, match="the same signature"):
        to_clifford(PGA3.point(1, 2, 3), clifford.Cl(3)[0])
    with pytest.raises(AlgebraError, match="oblique"):
        to_kingdon(Space(Algebra("OBLIQUE", "a b", [[2, 1], [1, -1]])).multivector({"a": 1.0}), kingdon.Algebra(1, 1))
