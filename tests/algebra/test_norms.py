"""Norms and unit elements of every layout of the catalog, against exact ``x ~x``: of either sign, and zero."""

from __future__ import annotations

from fractions import Fraction
from random import Random
from typing import Any

import numpy as np
import pytest
from selection import some_slow

import gacompiler as ga
from gacompiler import jacobian, kernel
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CATALOG, DCGA, STA
from gacompiler.algebra.layout import Layout
from gacompiler.algebra.signs import norm_signs
from gacompiler.errors import ZeroDivisorError
from gacompiler.objects import CGA2, CGA3, PGA3, VGA3, Space
from gacompiler.objects import STA as SPACETIME
from gacompiler.objects.checks import check_relations
from gacompiler.rings.points import point
from tests.support.all_cases import all_cases

LAYOUTS = [layout for algebra in CATALOG.values() for layout in (*algebra.layouts.values(), algebra.even, algebra.full)]
SMALL = [layout for layout in LAYOUTS if 1 < layout.size <= 16 or layout.support != {0}]


def exact_square(layout: Layout, coefficients: list[Any]) -> Fraction:
    x = layout.element(coefficients)
    return Fraction((x * ~x).scalar)


def elements(layout: Layout) -> list[list[Any]]:
    """Coefficients with exact squares: some of each sign that occurs, and null ones, in whole numbers."""
    random = Random(layout.size)
    if layout.has_relations:
        found = [point(layout, random) for _ in range(4)]
        return [each for each in found if all(isinstance(x, (int, Fraction)) for x in each)]
    found = [[random.randint(-9, 9) for _ in layout.stored] for _ in range(6)]
    found += [[random.choice((-1, 0, 1)) for _ in layout.stored] for _ in range(60)]
    by_sign: dict[int, list[list[Any]]] = {-1: [], 0: [], 1: []}
    for each in found:
        square = exact_square(layout, each)
        by_sign[(square > 0) - (square < 0)].append(each)
    return [each for some in by_sign.values() for each in some[:5]]


@pytest.mark.parametrize(
    ("backend", "layout"),
    [*(("arrays", each) for each in SMALL), *(pytest.param("c", each, marks=pytest.mark.slow) for each in SMALL[::4])],
    ids=str,
)
def test_every_layout_of_the_catalog(backend: str, layout: Layout, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GAC_BACKEND", backend)  # by C, each operation of each layout takes the compiler
    space = Space(layout.algebra)
    rows = elements(layout)
    squares = [exact_square(layout, row) for row in rows]
    x = space.of(layout, np.array(rows, float))
    sizes = np.array([abs(float(square)) ** 0.5 for square in squares])
    np.testing.assert_allclose(np.broadcast_to(x.norm(), len(rows)), sizes, rtol=1e-14, atol=1e-14)
    with np.errstate(all="ignore"):
        unit = x.normalize()
    for k, square in enumerate(squares):
        if square == 0:
            assert np.isnan(unit[k].values).all()
            with pytest.raises(ZeroDivisorError, match="null"):
                x[k].normalize()
            continue
        sign = 1 if square > 0 else -1
        for each in (unit[k], x[k].normalize()):
            if isinstance(each, float):  # a unit dual number is 1 or -1
                assert abs(each) == 1
                continue
            assert abs(each.norm_squared() - sign) < 1e-12 and np.isfinite(np.asarray(each.values)).all()
            assert abs(each.norm() - 1) < 1e-12
            if each.layout.has_relations:  # the claims of a layout are true
                check_relations("here", each.layout, np.asarray(each.values), 1e-12)


def test_all_signs_were_met() -> None:
    """The test above cannot see what its elements do not have."""
    seen: dict[tuple[str, str], set[int]] = {}
    for layout in SMALL:
        squares = [exact_square(layout, row) for row in elements(layout)]
        seen[layout.algebra.name, layout.name] = {(square > 0) - (square < 0) for square in squares}
    for key in (("CGA3", "SPHERE"), ("CGA2", "CIRCLE"), ("STA", "VECTOR"), ("STA", "BIVECTOR"), ("CGA3", "VECTOR"),
                ("DOUBLE_NUMBERS", "NUMBER"), ("G33", "VECTOR")):  # fmt: skip
        assert seen[key] == {-1, 0, 1}, key
    assert seen["PGA3", "PLANE"] >= {1} and seen["CGA3", "PLANE"] >= {-1} and seen["PGA3", "DIRECTION"] == {0}


@all_cases("layout", [each for each in LAYOUTS if each.size <= 32])
def test_signs_follow_from_the_metric(layout: Layout) -> None:
    """Branches omitted from a kernel are never needed: no element has a sign that the metric excludes."""
    signs = norm_signs(layout.algebra, layout.support)
    for row in elements(layout):
        square = exact_square(layout, row)
        assert (square >= 0 or signs.negative) and (square <= 0 or signs.positive)
    assert norm_signs(DCGA, frozenset(range(1024))).both


def test_conformal_objects_by_their_radii() -> None:
    """With weight 1, ``x ~x`` of a sphere, a circle and a point pair as outer products is minus the square radius."""
    sphere = CGA3.sphere([1.0, 2, 3], 2.0)
    assert np.isclose(sphere.norm(), 2) and np.isclose(sphere.norm_squared(), -4)
    assert not sphere.normalize().layout.has_relations
    imaginary = sphere.dual()
    assert imaginary.norm_squared() != 0
    for x in (
        CGA3.point(1, 0, 0) ^ CGA3.point(0, 1, 0) ^ CGA3.point(0, 0, 1), CGA3.point(1, 2, 3) ^ CGA3.point(0, 0, 0),
        CGA3.plane([0, 0, 1], 2), CGA3.point(0, 0, 0) ^ CGA3.point(1, 0, 0) ^ CGA3.einf,
        CGA2.point(1, 0) ^ CGA2.point(0, 1) ^ CGA2.point(-1, 0), CGA2.point(1, 0) ^ CGA2.point(0, 5),
        SPACETIME.vector(0, 1, 0, 0), SPACETIME.vector(2, 1, 0, 0), SPACETIME.g1 * SPACETIME.g0,
    ):  # fmt: skip
        unit = x.normalize()
        sign = np.sign(x.norm_squared())
        assert abs(unit.norm_squared() - sign) < 1e-14 and not (unit.layout.has_relations and sign < 0)
        assert (unit * x.norm()).isclose(x)


def test_null_up_to_rounding() -> None:
    """Rounding makes the square of a conformal point 1e-17 instead of 0; its root would be a size out of nothing."""
    x = CGA3.of(CGA3.VECTOR, [0.1, 0.2, 0.3, 1.0, (0.1**2 + 0.2**2 + 0.3**2) / 2])
    with pytest.raises(ZeroDivisorError, match="null"):
        x.normalize()
    with pytest.raises(ZeroDivisorError, match="null"):
        CGA3.point(0.1, 0.2, 0.3).normalize()
    assert np.isnan(CGA3.point([[0.1, 0.2, 0.3]]).normalize().values).all()
    mixed = SPACETIME.of(SPACETIME.VECTOR, [[1.0, 1, 0, 0], [2, 0, 0, 0], [0, 0, 3, 0]]).normalize()
    np.testing.assert_array_equal(np.isnan(mixed.values).all(axis=-1), [True, False, False])
    np.testing.assert_array_equal(mixed.values[1:], [[1, 0, 0, 0], [0, 0, 1, 0]])


def test_squares_too_large_and_too_small_for_doubles() -> None:
    for size in (1e200, 1e-200, 3e-308):
        assert VGA3.vector(3 * size, 0, 4 * size).normalize().isclose(VGA3.vector(0.6, 0, 0.8))
        many = VGA3.vector(np.array([[3 * size, 0, 4 * size], [0, 2.0, 0]])).normalize()
        np.testing.assert_allclose(many.values, [[0.6, 0, 0.8], [0, 1, 0]], rtol=1e-15)
    single = VGA3.of(VGA3.VECTOR, np.float32([[3, 0, 4]])).normalize()
    np.testing.assert_allclose(single.values, [[0.6, 0, 0.8]], rtol=1e-6)


def test_lines_of_conformal_space_satisfy_the_study_condition() -> None:
    values = np.random.default_rng(0).normal(size=(20, 6))
    for space, sign in ((CGA3, -1), (PGA3, 1)):
        lines = space.of(space.LINE, values).normalize()
        product = (lines * ~lines).as_layout(space.full).values
        np.testing.assert_allclose(product, sign * np.eye(product.shape[-1])[0] + 0 * product, atol=1e-12)


UNITS = [("SPHERE", CGA3), ("VECTOR", CGA3), ("CIRCLE", CGA2), ("VECTOR", STA), ("BIVECTOR", STA)]


@pytest.mark.parametrize(
    ("name", "algebra"), some_slow(UNITS, ("SPHERE", CGA3), ("VECTOR", CGA3)), ids=[f"{a.name}.{n}" for n, a in UNITS]
)
def test_kernels(name: str, algebra: Any) -> None:
    layout: Layout = getattr(algebra, name)

    @kernel(x=layout)
    def sized(x: Any) -> Any:
        """The norm and the unit element."""
        return ga.norm(x), ga.normalize(x)

    function = ga.compile(sized, "arrays")
    rows = [row for row in elements(layout) if exact_square(layout, row)]
    squares = np.array([float(exact_square(layout, row)) for row in rows])
    norms, units = function(np.array(rows, float))
    np.testing.assert_allclose(norms, np.sqrt(np.abs(squares)), rtol=1e-14)
    assert not function.layouts["out_1"].unit
    again = np.array([float((layout.element(u) * ~layout.element(u)).scalar) for u in units.tolist()])
    np.testing.assert_allclose(again, np.sign(squares), atol=1e-12)
    null = [row for row in elements(layout) if not exact_square(layout, row)]
    with np.errstate(all="ignore"):
        assert not np.isfinite(function(np.array(null, float))[1]).any()


def test_no_absolute_value_where_the_metric_excludes_a_sign() -> None:
    from gacompiler.passes.pipeline import compile_kernel

    counts = {}
    for layout in (VGA3.VECTOR, PGA3.PLANE, PGA3.LINE, CGA3.PLANE, CGA3.DUAL_PLANE, STA.VECTOR, CGA3.SPHERE):

        @kernel(x=layout)
        def unit(x: Any) -> Any:
            """A unit element."""
            return ga.normalize(x)

        counts[str(layout)] = compile_kernel(unit).cost.choice
    assert counts == {
        "VGA3.VECTOR": 0, "PGA3.PLANE": 0, "PGA3.LINE": 0, "CGA3.PLANE": 0, "CGA3.DUAL_PLANE": 0, "STA.VECTOR": 1,
        "CGA3.SPHERE": 1,
    }  # fmt: skip


def test_derivatives_have_the_sign() -> None:
    """``d sqrt(|s|) = sign(s) ds / (2 sqrt(|s|))``, of ``s = t**2 - x**2 - y**2 - z**2`` and of negative metrics."""

    @kernel(x=STA.VECTOR)
    def size(x: Any) -> Any:
        """The norm."""
        return ga.norm(x)

    slope = ga.compile(jacobian(size, "x"), "arrays")
    for x in ([3.0, 1, 1, 1], [1.0, 2, 0, -1]):
        s = x[0] ** 2 - x[1] ** 2 - x[2] ** 2 - x[3] ** 2
        wanted = np.sign(s) * np.array([x[0], -x[1], -x[2], -x[3]]) / np.sqrt(abs(s))
        found = next(np.ravel(each) for each in map(np.asarray, _results(slope(x))) if each.size == 4)
        np.testing.assert_allclose(found, wanted, rtol=1e-14)
    negative = Algebra("NEGATIVE", "e1 e2", [-1, -1])

    @kernel(x=negative.layout("VECTOR", "e1 e2"))
    def length(x: Any) -> Any:
        """The norm."""
        return ga.norm(x)

    assert ga.compile(length, "arrays")([3.0, 4]) == 5
    found = next(
        np.ravel(each) for each in map(np.asarray, _results(ga.compile(jacobian(length, "x"), "arrays")([3.0, 4])))
        if each.size == 2
    )  # fmt: skip
    np.testing.assert_allclose(found, [0.6, 0.8], rtol=1e-15)


def _results(value: Any) -> tuple[Any, ...]:
    return value if isinstance(value, tuple) else (value,)


def test_exact_elements() -> None:
    x = STA.multivector({"g0": 3, "g1": 5})
    assert ga.norm(x).scalar == 4 and ga.normalize(x) == STA.multivector({"g0": Fraction(3, 4), "g1": Fraction(5, 4)})
    with pytest.raises(ZeroDivisorError, match="norm is 0"):
        ga.normalize(STA.multivector({"g0": 1, "g1": 1}))
