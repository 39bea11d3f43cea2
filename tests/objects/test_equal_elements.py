"""Elements are equal if they are the same element, whatever their layouts; equal ones have one hash.

Whether they are the same is decided over the rationals, by the multivectors of the algebra layer.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import pytest

from gacompiler import Algebra, Space
from gacompiler.algebra.layout import Layout
from gacompiler.objects import CGA2, CGA3, PGA3, QUATERNIONS, STA, VGA3
from generated import cga3, pga3
from tests.support.all_cases import all_cases

SPACES = [PGA3, CGA2, CGA3, VGA3, STA, QUATERNIONS]
NUMBERS = (0.0, -0.0, 1.0, -1.0, 0.5)


def layouts_of(space: Any) -> list[Layout]:
    algebra = space.algebra
    two = "^".join(reversed(algebra.vectors[:2]))
    names = [two if algebra.blade(name)[1] == 3 else name for name in reversed(algebra.full.blades)]
    turned = algebra.layout("TURNED", " ".join(names))
    return [*algebra.layouts.values(), algebra.full, algebra.even, turned]


def samples(space: Any, seed: int) -> list[Any]:
    """Single elements of all layouts, of few numbers, so that many are the same."""
    rng = np.random.default_rng(seed)
    found = []
    for layout in layouts_of(space):
        if layout.unit or layout.is_scalar:
            one = space.algebra.full.element([Fraction(name == "1") for name in space.algebra.full.blades])
            found += [space.of(layout, *map(float, layout.coefficients(one)))] if 0 in layout.support else []
            continue
        for k in range(2):
            values = rng.choice(NUMBERS, layout.size) * (rng.random(layout.size) < 2 / layout.size)
            found.append(space.of(layout, *values if k else np.zeros(layout.size)))
    found += [x.as_layout(layout) for x in found for layout in (space.algebra.full, layouts_of(space)[-1])]
    return [*found, *(type(x)(x.values) for x in found[:3])]


@all_cases("space", SPACES)
def test_equality_is_that_of_exact_multivectors(space: Any) -> None:
    elements = samples(space, 3)
    exact = [{blade: value for blade, value in x.exactly().terms.items() if value} for x in elements]
    n_equal = 0
    for (x, a), (y, b) in product(zip(elements, exact, strict=True), repeat=2):
        wanted = a == b
        assert (x == y) is wanted and (x != y) is not wanted, (x, y)
        if wanted:
            assert hash(x) == hash(y), (x, y)
        n_equal += wanted and x.layout != y.layout
    for x, a in zip(elements[::3], exact[::3], strict=True):
        many = np.stack([x, x])
        for y, b in zip(elements[::7], exact[::7], strict=True):
            assert (many == y).tolist() == (y == many).tolist() == 2 * [a == b]
        for number in (0, 1, -1.0, np.float64(0.5), Fraction(1, 2), True):
            assert bool(x == number) is bool(number == x) is (a == ({0: number} if number else {})), (x, number)
            assert (x != number) is not (x == number)
            if x == number:
                assert hash(x) == hash(number)
    assert n_equal > 20


def test_values_of_modules_and_other_precisions() -> None:
    pairs: list[tuple[Any, Any]] = [
        (pga3.Motor(1, 2, 0, 0, 0, 0, 0, 0), pga3.Even(1, 2, 0, 0, 0, 0, 0, 0)),
        (pga3.Even(0.6, 0.8, 0, 0, 0, 0, 0, 0), PGA3.of(PGA3.MOTOR, 0.6, 0.8, *6 * [0])),
        (cga3.Point(1, 2, 3), CGA3.point(1, 2, 3).as_layout(CGA3.VECTOR)),
        (pga3.Translator(0, 0, 0), 1),
        (pga3.Translator(-0.5, -1, -1.5), PGA3.translator(1, 2, 3) * 1.0),
        (VGA3.vector(np.array([1, 0, 0], np.float32)), VGA3.e1),
        (VGA3.vector(np.array([1, 0, 0], complex)), VGA3.vector(1, 0, 0)),
    ]
    for x, y in pairs:
        assert ((x == y), (y == x), (x != y), (y != x)) == (True, True, False, False) and hash(x) == hash(y), (x, y)
        assert 2 * x != y and y != 2 * x
    points = pga3.Point.array(np.eye(3))
    wide = PGA3.point(np.eye(3)).as_layout(PGA3.TRIVECTOR)
    assert (points == wide).all() and (wide == points).all() and (points[0] == wide).tolist() == [True, False, False]
    assert (wide != points[0]).tolist() == [False, True, True] and np.array_equal(wide, PGA3.point(np.eye(3)))
    squares = wide * wide
    assert np.array_equal(squares, -np.ones(3)) and np.array_equal(-np.ones(3), squares)
    assert not np.array_equal(squares, -1) and not np.array_equal(points, -np.ones(3))
    assert (points == np.zeros(3)).tolist() == (np.zeros(3) == points).tolist() == 3 * [False]
    assert (points[:0] == wide[:0]).shape == (0,)
    with pytest.raises(ValueError, match="broadcast"):
        _ = points == wide[:2]


def test_algebras_names_and_nan() -> None:
    mine = Space(Algebra("MINE", "e1 e2 e3", [1, 1, 1], "e31"))
    for name in ("e1", "e12", "e13", "e31", "e132"):
        x, y = getattr(mine, name), getattr(VGA3, name)
        assert x == y and hash(x) == hash(y), name
    assert mine.e31 != VGA3.e13
    for x, other in ((VGA3.e1, PGA3.e1), (VGA3.vector(1, 2, 3), PGA3.plane(1, 2, 3, 0)), (PGA3.e0, CGA3.e0)):
        assert x != other and other != x
    for foreign in (None, "e1", [1, 0, 0], (1,), object()):
        assert (VGA3.e1 == foreign) is False and (VGA3.e1 != foreign) is True
    nan = VGA3.vector(np.nan, 1, 0)
    assert nan != nan and nan != nan.as_layout(VGA3.full) and hash(nan) == hash(nan)
