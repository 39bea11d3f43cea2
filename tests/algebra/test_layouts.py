"""Layouts: what is stored, fixed, implied and known; and points that satisfy what is known."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from random import Random
from typing import Any

import mpmath
import pytest
from exact_elements import NULL_PAIRS, OBLIQUE, TEN

from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import (
    CATALOG,
    CGA2,
    CGA3,
    COMPLEX,
    DOUBLE_NUMBERS,
    DUAL_NUMBERS,
    PGA2,
    PGA3,
    QUATERNIONS,
    STA,
    VGA2,
    VGA3,
    orthogonal,
)
from gacompiler.algebra.layout import SCALAR, Layout
from gacompiler.algebra.multivector import Multivector
from gacompiler.algebra.versors import sandwich
from gacompiler.errors import AlgebraError, InexactError, LayoutError
from gacompiler.rings.points import DIGITS, point, random_fraction
from gacompiler.rings.polynomial import PolynomialRing
from tests.support.all_cases import all_cases


def every_layout() -> list[Layout]:
    found = []
    for algebra in CATALOG.values():
        found += algebra.layouts.values()
        found += [algebra.even, algebra.UNIT_EVEN]
    return found


LAYOUTS = every_layout()
WITH_RELATIONS = [layout for layout in LAYOUTS if layout.has_relations]


def test_stored_coefficients_in_the_order_given() -> None:
    p = PGA3.POINT.element([2, 3, 5])
    assert p == PGA3.multivector({"e032": 2, "e013": 3, "e021": 5, "e123": 1})
    assert PGA3.POINT.coefficients(p) == (2, 3, 5)
    assert PGA3.POINT.blades == ("e032", "e013", "e021") and PGA3.POINT.size == 3
    line = STA.BIVECTOR.element([1, 2, 3, 4, 5, 6])
    assert (line["g10"], line["g01"], line["g23"]) == (1, -1, 6)


def test_fixed_coefficients_have_the_sign_of_their_spelling() -> None:
    layout = VGA3.layout("FIXED", "e1", fixed={"e21": Fraction(3, 2)})
    x = layout.element([7])
    assert x["e21"] == Fraction(3, 2) and x["e12"] == Fraction(-3, 2)
    assert layout.coefficients(x) == (7,)


def test_implied_coefficients_follow_from_the_stored() -> None:
    p = CGA3.POINT.element([1, 2, 3])
    assert p["einf"] == 7 and p["e0"] == 1 and p * p == 0
    assert CGA3.POINT.coefficients(p) == (1, 2, 3)
    backwards = CGA2.layout("P", "e2 e1", fixed={"e0": 1}, implied={"einf1": lambda c: c["e2"] - 2 * c["e1"]})
    assert backwards.element([10, 1])["einf1"] == 8 and backwards.element([10, 1])["e1inf"] == -8


@all_cases("layout", LAYOUTS)
def test_elements_and_coefficients_are_inverse(layout: Layout) -> None:
    random = Random(str(layout))
    given = [random_fraction(random) for _ in layout.stored]
    element = layout.element(given)
    assert list(layout.coefficients(element)) == given
    assert frozenset(element.terms) <= layout.support
    ring = PolynomialRing()
    symbols = [ring.variable(name) for name in layout.blades]
    assert list(layout.coefficients(layout.element(symbols))) == symbols


@all_cases(
    "layout, element, message",
    [
        (VGA3.VECTOR, {"e12": 1}, "layout VECTOR: an element with blade e12; expected only e1 e2 e3"),
        (PGA3.POINT, {"e032": 1}, "layout POINT: e123 = 0; expected e123 = 1"),
        (PGA3.POINT, {"e123": 2}, "layout POINT: e123 = 2; expected e123 = 1"),
        (PGA2.TRANSLATOR, {"1": -1}, "layout TRANSLATOR: 1 = -1; expected 1 = 1"),
        (CGA3.POINT, {"e0": 1, "e1": 1, "einf": 1}, "layout POINT: einf = 1; expected einf = 1/2"),
    ],
)
def test_an_element_that_does_not_fit_is_rejected(layout: Layout, element: dict[str, int], message: str) -> None:
    with pytest.raises(LayoutError) as caught:
        layout.coefficients(layout.algebra.multivector(element))
    assert str(caught.value) == message


def test_wrong_numbers_of_coefficients() -> None:
    with pytest.raises(LayoutError, match=r"layout VECTOR: 2 coefficients; expected 3: e1 e2 e3"):
        VGA3.VECTOR.element([1, 2])


@all_cases(
    "make, error, message",
    [
        (lambda: VGA3.layout("L", "e1 e12 e21"), LayoutError, "layout L: e21 and e12 are the same blade"),
        (lambda: VGA3.layout("L", "e1", fixed={"e1": 1}), LayoutError, "layout L: e1 and e1 are the same blade"),
        (lambda: VGA3.layout("L", "e1", implied={"e1": lambda c: 0}), LayoutError, "are the same blade"),
        (lambda: VGA3.layout("L", "e1 e4"), AlgebraError, "blade 'e4': not a blade of VGA3"),
    ],
)
def test_wrong_layouts_are_rejected(make: Callable[[], Layout], error: type[Exception], message: str) -> None:
    with pytest.raises(error) as caught:
        make()
    assert message in str(caught.value)


def test_numbers_alone_have_no_blade_axis() -> None:
    """A layout of the blade 1 in an algebra is one of multivectors, with an axis of one coefficient."""
    assert SCALAR.is_scalar and not VGA3.layout("S", "1").is_scalar
    assert not VGA3.layout("S", "1", fixed={"e1": 1}).is_scalar
    assert not VGA3.layout("S", "e1").is_scalar


def test_support_leaves_out_what_is_fixed_to_zero() -> None:
    layout = VGA3.layout("L", "e1", fixed={"e2": 0, "e3": 2})
    assert layout.support == {1, 4}


def test_layouts_are_values() -> None:
    assert VGA3.layout("L", "e1 e2") == VGA3.layout("L", "e1 e2")
    assert len({VGA3.layout("L", "e1 e2"), VGA3.layout("L", "e1 e2"), VGA3.layout("L", "e2 e1")}) == 2
    with pytest.raises(AttributeError):
        VGA3.VECTOR.name = "other"  # type: ignore[misc]


def test_unit_relations_are_both_products() -> None:
    r = VGA3.ROTOR.element([Fraction(3, 5), Fraction(4, 5), 0, 0])
    assert all(value == 0 for value in VGA3.ROTOR.relations(r))
    assert any(value != 0 for value in VGA3.ROTOR.relations(2 * r))
    motor = PGA3.MOTOR.element([1, 0, 0, 0, 0, 0, 0, 1])
    assert any(value != 0 for value in PGA3.MOTOR.relations(motor)), "m ~m = 1 + 2 e0123"


@all_cases(
    "layout, unit, other",
    [
        (COMPLEX.UNIT_NUMBER, [Fraction(3, 5), Fraction(4, 5)], [Fraction(5, 3), Fraction(4, 3)]),
        (COMPLEX.UNIT_NUMBER, [0, 1], [1, 1]),
        (DOUBLE_NUMBERS.UNIT_NUMBER, [Fraction(5, 3), Fraction(4, 3)], [Fraction(3, 5), Fraction(4, 5)]),
        (DUAL_NUMBERS.UNIT_NUMBER, [1, 7], [2, 7]),
        (QUATERNIONS.UNIT_QUATERNION, [0, 1, 0, 0], [1, 1, 0, 0]),
        (QUATERNIONS.UNIT_QUATERNION, [Fraction(1, 2)] * 4, [Fraction(1, 2), Fraction(1, 2), 1, 0]),
        (VGA2.ROTOR, [Fraction(3, 5), Fraction(-4, 5)], [Fraction(3, 5), Fraction(3, 5)]),
        (PGA2.UNIT_LINE, [Fraction(3, 5), Fraction(4, 5), 9], [1, 1, 0]),
    ],
)
def test_unit_numbers_are_those_of_the_textbook(layout: Layout, unit: list[Any], other: list[Any]) -> None:
    """Complex numbers on the circle, double numbers on the hyperbola, all unit quaternions: i, j and k too."""
    assert all(value == 0 for value in layout.relations(layout.element(unit)))
    assert any(value != 0 for value in layout.relations(layout.element(other)))


def test_user_relations_may_be_one_or_several() -> None:
    null = CGA3.layout("NULL", "e1 e2 e3 e0 einf", relations=lambda x: x * x)
    assert set(null.relations(null.element([0, 0, 0, 1, 0]))) <= {0}
    assert any(null.relations(null.element([0, 0, 0, 1, 1])))
    two = VGA3.layout("TWO", "e1 e2 e3", relations=lambda x: [x * x - 1, x.grade(1) ^ VGA3.basis()[0]])
    assert set(two.relations(two.element([1, 0, 0]))) <= {0}
    assert any(two.relations(two.element([0, 1, 0])))
    assert null.has_relations and two.has_relations and not CGA3.POINT.has_relations


@all_cases("layout", WITH_RELATIONS)
def test_points_satisfy_the_relations_exactly(layout: Layout) -> None:
    random = Random(str(layout))
    seen = []
    for near_one in (False, True, False):
        found = point(layout, random, near_one=near_one)
        assert len(found) == layout.size
        assert all(isinstance(value, (int, Fraction)) for value in found), "an exact point"
        assert all(value == 0 for value in layout.relations(layout.element(found)))
        seen.append(tuple(found))
    if layout.size > 1 or layout.fixed:
        assert len(set(seen)) > 1, "points are random"


def test_points_of_a_motor_are_general() -> None:
    """A point that lies on a subvariety (a pure rotation, say) would let wrong kernels pass."""
    random = Random(1)
    for layout in (PGA3.MOTOR, CGA3.MOTOR, STA.ROTOR, CGA3.UNIT_EVEN, VGA3.ROTOR, PGA3.UNIT_LINE):
        assert all(value != 0 for value in _first_dense(layout, random)), layout


def _first_dense(layout: Layout, random: Random) -> list[Any]:
    found: list[Any] = []
    for _ in range(12):
        found = point(layout, random)
        if all(value != 0 for value in found):
            break
    return found


def test_points_without_relations_are_small_rationals() -> None:
    random = Random(3)
    found = point(VGA3.full, random)
    assert len(found) == 8 and all(isinstance(value, Fraction) and value != 0 for value in found)
    assert all(abs(value) <= 2 for value in point(VGA3.full, random, near_one=True))


def test_points_are_reproducible() -> None:
    assert point(PGA3.MOTOR, Random(5)) == point(PGA3.MOTOR, Random(5))


def oblique_relation(x: Multivector) -> Multivector:
    return x * x - 5


@all_cases(
    "layout",
    [
        VGA3.layout("LENGTH_ROOT_3", "e1 e2 e3", relations=lambda x: x * x - 3),
        OBLIQUE.layout("LENGTH", "a1 a2 a3", relations=oblique_relation),
        PGA3.layout("PLUECKER", "e12 e13 e23 e01 e02 e03", relations=lambda x: x ^ x),
        CGA3.layout("NULL", "e1 e2 e3 e0 einf", relations=lambda x: [x * x, x["e0"] - 1]),
    ],
)
def test_other_relations_are_solved_to_many_digits(layout: Layout) -> None:
    for seed in range(3):
        found = point(layout, Random(seed))
        with mpmath.workdps(DIGITS + 10):
            values = layout.relations(layout.element(found))
            assert all(abs(value) < mpmath.mpf(10) ** (5 - DIGITS) for value in values)
        assert any(value != 0 for value in found)


def test_relations_that_nothing_satisfies() -> None:
    impossible = VGA3.layout("IMPOSSIBLE", "e1 e2 e3", relations=lambda x: x * x + 1)
    with pytest.raises(InexactError, match=r"layout IMPOSSIBLE: no element that satisfies its relations was found"):
        point(impossible, Random(0))


@all_cases("algebra", [OBLIQUE, NULL_PAIRS, orthogonal(4, 1, 1), orthogonal(0, 3), orthogonal(2, 2, 2)])
def test_unit_versors_in_other_algebras(algebra: Algebra) -> None:
    random = Random(algebra.name)
    layout = algebra.UNIT_EVEN
    found = layout.element(point(layout, random))
    assert found * ~found == 1 and ~found * found == 1
    moved = sandwich(found, algebra.basis()[0])
    assert moved * moved == algebra.gram[0][0]


def test_the_catalog_is_the_book() -> None:
    assert list(CATALOG) == [
        "COMPLEX", "DUAL_NUMBERS", "DOUBLE_NUMBERS", "QUATERNIONS", "VGA2", "VGA3", "PGA2", "PGA3", "CGA2", "CGA3",
        "STA", "G33",
    ]  # fmt: skip
    for layout in LAYOUTS:
        assert getattr(layout.algebra, layout.name) == layout
        assert len(set(layout.blades)) == layout.size


@all_cases(
    "layout, grades",
    [(PGA3.LINE, {2}), (PGA3.PLANE, {1}), (PGA3.POINT, {3}), (CGA3.SPHERE, {4}), (CGA3.CIRCLE, {3}), (CGA3.LINE, {3}),
     (CGA3.PLANE, {4}), (CGA3.POINT_PAIR, {2}), (STA.TRIVECTOR, {3}), (CGA3.POINT, {1}), (PGA3.DIRECTION, {3})],
)  # fmt: skip
def test_objects_have_their_grades(layout: Layout, grades: set[int]) -> None:
    assert {blade.bit_count() for blade in layout.support} == grades


def conformal_flats() -> Iterator[tuple[Layout, list[str]]]:
    yield CGA3.LINE, ["p q"]
    yield CGA3.PLANE, ["p q r"]
    yield CGA2.LINE, ["p q"]


@pytest.mark.parametrize(("layout", "points"), [*conformal_flats()], ids=str)
def test_flats_hold_what_points_span(layout: Layout, points: list[str]) -> None:
    """Points wedged with einf fill a flat's layout and nothing else."""
    random = Random(4)
    algebra = layout.algebra
    element = algebra.scalar(1)
    for _ in points[0].split():
        element = element ^ algebra.POINT.element(point(algebra.POINT, random))
    element = element ^ algebra.basis()[-1]
    assert all(layout.coefficients(element))


def test_unit_even_layout_of_a_large_algebra_is_lazy() -> None:
    """Asking a ten-dimensional algebra for a small layout does not build the others."""
    assert TEN.layout("V", "ba bb").size == 2
    assert "full" not in TEN.__dict__
