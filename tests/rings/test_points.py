"""Points of layouts: they satisfy the relations, with no coefficient that is always zero."""

from __future__ import annotations

from fractions import Fraction
from random import Random

import mpmath
import pytest

from gacompiler.algebra.catalog import CATALOG, PGA3, VGA2, VGA3
from gacompiler.algebra.layout import Layout
from gacompiler.rings.points import DIGITS, POOL, point
from tests.support.all_cases import all_cases

OWN = [
    VGA3.layout("ABOUT_E1", "1 e12 e13", unit=True),
    VGA3.layout("ABOUT_E2", "1 e12 e23", unit=True),
    VGA3.layout("ABOUT_E3", "1 e13 e23", unit=True),
    PGA3.layout("SLIDE", "1 e12 e02", unit=True),
]
UNITS = [
    layout
    for algebra in CATALOG.values()
    if algebra.dimension <= 5
    for layout in (*algebra.layouts.values(), algebra.UNIT_EVEN)
    if layout.has_relations
]


@all_cases("layout", [*UNITS, *OWN])
def test_points_of_unit_layouts_are_rational_and_have_no_zeros(layout: Layout) -> None:
    taken: set[int] = set()
    found = [point(layout, Random(seed), taken=taken) for seed in range(3)]
    assert len(taken) == 3 and taken <= set(range(POOL))
    for each in found:
        assert all(isinstance(value, (int, Fraction)) and value for value in each)
        assert all(value == 0 for value in layout.relations(layout.element(each)))
    assert layout.size == 1 or found[0] != found[1]


@pytest.mark.parametrize("power", [2, 3, 5])
def test_points_that_are_not_rational_have_many_digits(power: int) -> None:
    """``x**k + y - 3 = 0`` and ``x y**2 - 1/2 = 0``: found by iteration, with derivatives of higher powers."""

    def relations(v):  # type: ignore[no-untyped-def]
        x, y = v["e1"], v["e2"]
        whole = x
        for _ in range(power - 1):
            whole = whole * x
        return [whole + y - 3, x * y * y - Fraction(1, 2)]

    layout = VGA2.layout("CURVES", "e1 e2", relations=relations)
    x, y = point(layout, Random(power))
    with mpmath.workdps(DIGITS + 10):
        assert max(abs(x**power + y - 3), abs(x * y * y - mpmath.mpf(1) / 2)) < mpmath.mpf(10) ** (5 - DIGITS)


def test_whole_and_moderate_points() -> None:
    layout = VGA3.layout("FREE", "e1 e2 e3")
    whole = [value for seed in range(20) for value in point(layout, Random(seed), whole=True)]
    assert all(isinstance(value, int) for value in whole) and max(whole) > 10**5 and min(whole) < -(10**5)
    moderate = [value for seed in range(20) for value in point(layout, Random(seed), near_one=True)]
    assert max(map(abs, moderate)) <= 2
