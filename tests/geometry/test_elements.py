"""Elements of every algebra in functions of geometry: results are those of vector algebra, or an error says why not."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from algorithms.geometry import angle, distance, meet, nearest_on_circles, project, similarity_between, versor_between
from gacompiler.objects import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, STA, VGA2, VGA3
from generated import cga3, pga3
from tests.support.all_cases import all_cases

Vector = np.ndarray[Any, Any]
P, A, D, N = np.array([1.0, 2, 3]), np.array([0.0, -1, 2]), np.array([2.0, 1, -2]) / 3, np.array([2.0, 3, 6]) / 7
"""A point, a point and the direction of a line, and the normal of a plane at the distance 1 of the origin."""
PAIRS = [
    ("point", P), ("line", (A, D)), ("plane", (N, 1.0)), ("point", -A), ("line", (P, N)), ("plane", (D, -2.0)),
    ("plane", (N, 3.0)), ("line", (P, D)),
]  # fmt: skip
CONSTRUCTORS: dict[str, Any] = {
    "point": {
        "PGA3": PGA3.point,
        "PGA3, twice": lambda p: 2 * PGA3.point(p),
        "CGA3": CGA3.point,
        "CGA3, a vector": lambda p: CGA3.point(p).as_layout(CGA3.VECTOR),
        "CGA3, flat": lambda p: (3 * CGA3.point(p)) ^ CGA3.einf,
        "values": lambda p: pga3.Point(*p),
    },
    "line": {
        "PGA3": lambda x: 2 * PGA3.line(x[0], x[0] + x[1]),
        "CGA3": lambda x: CGA3.line(x[0], x[0] + x[1]),
        "CGA3, a circle": lambda x: CGA3.line(x[0], x[0] + x[1]).as_layout(CGA3.CIRCLE),
        "values": lambda x: pga3.Line(*pga3.join_points(x[0], x[0] + x[1])),
    },
    "plane": {
        "PGA3": lambda x: 2 * PGA3.plane(x[0], x[1]),
        "CGA3": lambda x: CGA3.plane(x[0], x[1]),
        "values": lambda x: pga3.Plane(*x[0], -x[1]),
    },
}


def distance_of(kind: str, one: Any, other: str, two: Any) -> float:
    """Return the distance by formulas of vectors."""
    if kind > other:
        return distance_of(other, two, kind, one)
    if (kind, other) == ("point", "point"):
        return float(np.linalg.norm(one - two))
    if (kind, other) == ("plane", "point"):
        return abs(float(one[0] @ two) - one[1])
    if (kind, other) == ("line", "point"):
        return float(np.linalg.norm(np.cross(two - one[0], one[1])))
    if (kind, other) == ("line", "line"):
        normal = np.cross(one[1], two[1])
        if np.linalg.norm(normal) < 1e-9:
            return float(np.linalg.norm(np.cross(two[0] - one[0], one[1])))
        return abs(float((two[0] - one[0]) @ normal)) / float(np.linalg.norm(normal))
    if (kind, other) == ("line", "plane"):
        return 0.0 if abs(one[1] @ two[0]) > 1e-9 else abs(float(two[0] @ one[0]) - two[1])
    return 0.0 if np.linalg.norm(np.cross(one[0], two[0])) > 1e-9 else abs(one[1] - two[1] * float(one[0] @ two[0]))


@pytest.mark.parametrize("kind", CONSTRUCTORS)
@pytest.mark.parametrize("other", CONSTRUCTORS)
def test_distances_and_angles_are_those_of_vectors(kind: str, other: str) -> None:
    ones, twos = ([x for name, x in PAIRS if name == each] for each in (kind, other))
    for (first, one), (second, two) in itertools.product(CONSTRUCTORS[kind].items(), CONSTRUCTORS[other].items()):
        for x, y in itertools.product(ones, twos):
            a, b = one(x), two(y)
            assert distance(a, b) == pytest.approx(distance_of(kind, x, other, y), abs=2e-7), (first, second, x, y)
            if "point" not in (kind, other):
                u, v = x[1] if kind == "line" else x[0], y[1] if other == "line" else y[0]
                turn = np.arccos(np.clip(u @ v, -1, 1)) if kind == other else np.arcsin(np.clip(u @ v, -1, 1))
                assert angle(a, b) == pytest.approx(turn, abs=2e-7), (first, second)


def test_projections_and_intersections_stay_in_the_algebra() -> None:
    plane, point, line = PGA3.plane(0, 0, 1, -1), PGA3.point(1, 2, 3), PGA3.line([1, 0, 0], [1, 0, 5])
    assert project(point, plane).isclose(PGA3.point(1, 2, 1)) and project(point, plane).layout == PGA3.POINT
    assert project(CGA3.point(1, 2, 3), plane).isclose(CGA3.point(1, 2, 1))
    onto = project(PGA3.line([0, 0, 3], [1, 0, 4]), plane)
    assert onto.layout == PGA3.LINE and (onto & PGA3.line([0, 0, 1], [1, 0, 1])) == pytest.approx(0)
    assert isinstance(project(pga3.Point(1, 2, 3), pga3.Plane(0, 0, 1, -1)), pga3.Point)
    found = meet(line, plane)
    assert found.kind == "point" and found.how == 1 and found.common.isclose(PGA3.point(1, 0, 1))
    cut = meet(PGA3.plane(0, 0, 1, -3), CGA3.sphere([0, 0, 0], 5)).common
    assert cut.algebra == CGA3.algebra and np.sqrt(CGA3.radius_squared(cut)) == pytest.approx(4)
    ends = meet(CGA3.line([0, 0, 3], [1, 0, 3]), CGA3.sphere([0, 0, 0], 5)).common
    np.testing.assert_allclose(cga3.point_pair_points(ends.values), [[4, 0, 3], [-4, 0, 3]], atol=1e-14)
    points = PGA3.point(np.arange(12.0).reshape(4, 3))
    assert project(points, plane).shape == (4,)
    np.testing.assert_allclose(distance(points, plane), np.abs(np.arange(2, 12, 3) - 1))


def test_elements_of_the_plane_lie_in_space() -> None:
    point, line = PGA2.point(3, 4), PGA2.line([0, 1], [5, 1])
    assert distance(point, line) == pytest.approx(3) == pytest.approx(distance(CGA2.point(3, 4), line))
    assert project(point, line).isclose(PGA2.point(3, 1)) and meet(line, PGA2.line([2, 0], [2, 9])).common.isclose(
        PGA2.point(2, 1)
    )
    diagonal = CGA2.line([0, 0], [1, 1])
    assert angle(line, diagonal) == pytest.approx(np.pi / 4) and angle(
        PGA2.line([0, 0], [1, 1]), line
    ) == pytest.approx(np.pi / 4)
    assert distance(CGA2.circle([0, 0], 2), point) == pytest.approx(3)
    pair = meet(CGA2.line([0, 1], [5, 1]), CGA2.circle([0, 0], 2)).common
    assert pair.algebra == CGA2.algebra and np.sqrt(CGA2.radius_squared(pair)) == pytest.approx(np.sqrt(3))
    onto = project(PGA2.line([0, 0], [1, 2]), point)
    assert onto.layout == PGA2.LINE and (onto & point) == pytest.approx(0)
    assert angle(onto, PGA2.line([0, 0], [1, 2])) == pytest.approx(0, abs=1e-7)


OTHERS = [
    VGA2.vector(1, 2), VGA3.vector(1, 2, 3), VGA3.bivector(1, 2, 3), VGA3.rotor([0, 0, 1], 1), STA.vector(1, 2, 3, 4),
    STA.boost(0.5, 0, 0), QUATERNIONS.quaternion(1, 2, 3, 4), PGA3.motor([0, 0, 1], 1), PGA3.direction(1, 0, 0),
    PGA2.motor(1), PGA2.direction(1, 0), CGA3.translator([1, 2, 3]), CGA3.dilator(2),
    CGA3.multivector({"1": 1, "e1": 2}), CGA3.sphere([0, 0, 0], 1).polarity(),
    pga3.Direction(1, 2, 3), PGA3.multivector({"1": 1, "e1": 1}), [1, 2, 3], np.zeros(3), None, "point", 1.5,
]  # fmt: skip


@all_cases("x", OTHERS)
def test_other_elements_are_refused_by_the_name_of_the_parameter(x: Any) -> None:
    point, circle = PGA3.point(1, 2, 3), CGA3.circle([0, 0, 0], [0, 0, 1], 2.0)
    for function in (distance, angle, meet, project, versor_between, similarity_between):
        names = ("a", "b") if function in (versor_between, similarity_between) else ("one", "two")
        for arguments, name in (((x, point), names[0]), ((point, x), names[1])):
            with pytest.raises(TypeError, match=rf"^{name} is "):
                function(*arguments)
    for name, arguments in (("a", (x, circle)), ("b", (circle, x))):
        with pytest.raises((TypeError, ValueError), match=rf"^{name}\b"):
            nearest_on_circles(*arguments)


def test_lists_of_elements_are_arrays_of_them() -> None:
    points, plane = [PGA3.point(1, 2, 3), CGA3.point(0, 0, 7)], PGA3.plane(0, 0, 1, -1)
    np.testing.assert_allclose(distance(points, plane), [2, 6])
    np.testing.assert_allclose(distance("point", points, "plane", plane), [2, 6])
    with pytest.raises(TypeError, match=r"^one is a list of point and plane; expected one kind"):
        distance([points[0], plane], plane)
    with pytest.raises(TypeError, match=r"^one\[1\] is VGA3"):
        distance([points[0], VGA3.bivector(1, 2, 3)], plane)


def test_names_of_kinds_are_compared_with_elements() -> None:
    point = PGA3.point(1, 2, 3)
    assert distance("point", point, "plane", cga3.plane_from_normal([0, 0, 1.0], 1.0)) == pytest.approx(2)
    with pytest.raises(TypeError, match=r"two is a plane, PGA3\.\w*PLANE; expected a line"):
        distance("point", point, "line", PGA3.plane(0, 0, 1, -1))
    with pytest.raises(TypeError, match="3 arguments; expected the elements one, two"):
        distance("point", point, PGA3.plane(0, 0, 1, -1))


def test_versors_between_elements_are_elements() -> None:
    a, b = CGA3.sphere([1, 2, 3], 2), CGA3.sphere([0, 1, 0], 5)
    for versor in (versor_between(a, b), similarity_between(a, b)):
        moved = versor >> a
        np.testing.assert_allclose(CGA3.centre(moved), [0, 1, 0], atol=1e-13)
        assert CGA3.radius_squared(moved) == pytest.approx(25)
    turn = versor_between(PGA3.plane(1, 0, 0, -1), PGA3.plane(0, 1, 0, -2))
    assert turn.algebra == CGA3.algebra
    nearest = nearest_on_circles(CGA3.circle([0, 0, 0], [0, 0, 1], 1.0), CGA2.circle([5, 0], 1))
    assert nearest.distance == pytest.approx(3)
