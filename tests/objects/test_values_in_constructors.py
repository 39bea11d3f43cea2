"""Constructors and methods of objects with values of generated modules as arguments: what objects give, or an error."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

from algorithms.geometry import distance, project
from gacompiler.errors import GacError
from gacompiler.objects import CGA3, PGA3, QUATERNIONS, VGA3
from generated import arms, cga3, pga3, quaternion, vga3
from tests.support.all_cases import all_cases

ELEMENTS: dict[str, tuple[Any, list[Any]]] = {
    "PGA3": (
        PGA3,
        [pga3.Point(1, 2, 3), pga3.Direction(0, 3, 4), pga3.Plane(1, 2, 2, 3), pga3.Line(1, 2, 3, 3, -2, 1)],
    ),
    "CGA3": (CGA3, [cga3.Point(1, 2, 3), cga3.Point(0, 0, 1), cga3.Plane(*CGA3.plane([0, 0, 1], 2.0).values)]),
    "VGA3": (VGA3, [vga3.Vector(1, 2, 3), vga3.Vector(0, 3, 4), vga3.Bivector(1, 2, 3)]),
}
CONSTRUCTORS = ("point", "direction", "line", "plane", "translator", "rotor", "motor", "sphere", "circle", "point_pair",
                "vector", "rotor_between", "reflect")  # fmt: skip
METHODS = ("distance", "angle", "project", "reject", "join", "meet", "isclose", "sandwich")


def result_of(function: Any, arguments: tuple[Any, ...]) -> Any:
    try:
        return function(*arguments)
    except (GacError, TypeError) as error:
        return error


def assert_same(found: Any, wanted: Any, call: Any) -> None:
    if isinstance(wanted, Exception):
        assert isinstance(found, Exception), (call, found, wanted)
        return
    assert getattr(found, "layout", None) == getattr(wanted, "layout", None), (call, found, wanted)
    np.testing.assert_array_equal(*(getattr(x, "values", x) for x in (found, wanted)), err_msg=str(call))


@pytest.mark.parametrize("name", ELEMENTS)
def test_values_are_the_elements_of_their_layouts(name: str) -> None:
    space, values = ELEMENTS[name]
    pairs = [*((x, space.of(x)) for x in values), (0.5, 0.5), ([1, 0, 0], [1, 0, 0])]
    created = 0
    for constructor in CONSTRUCTORS:
        function = getattr(space, constructor, None)
        if function is None or not callable(function):
            continue
        for n in (1, 2, 3):
            for chosen in product(pairs[: 2 if n == 3 else None], *(n - 1) * [pairs]):
                given, objects = zip(*chosen, strict=True)
                wanted = result_of(function, objects)
                assert_same(result_of(function, given), wanted, (constructor, given))
                created += not isinstance(wanted, Exception)
    assert created > 10
    for method in METHODS:
        for (x, a), (y, b) in product(pairs[: len(values)], repeat=2):
            assert_same(result_of(getattr(a, method), (y,)), result_of(getattr(a, method), (b,)), (method, x, y))


@all_cases(
    "call",
    [
        lambda p: PGA3.point(p, 1, 2), lambda p: PGA3.multivector({"e1": p}), lambda p: PGA3.of(PGA3.LINE, *6 * [p]),
        lambda p: CGA3.sphere(p, 1.0), lambda p: VGA3.rotor(p, 1.0), lambda p: VGA3.rotor_between(p, [1, 0, 0]),
        lambda p: CGA3.point_pair([p, p], [[1, 0, 0], [0, 1, 0]]), lambda p: QUATERNIONS.imaginary(p),
    ])  # fmt: skip
def test_elements_are_not_read_as_numbers(call: Any) -> None:
    for point in (pga3.Point(1, 2, 3), PGA3.point(1, 2, 3)):
        with pytest.raises((GacError, TypeError), match=r"PGA3|not an array of numbers|dtype object"):
            call(point)


def test_lists_of_elements_are_elements() -> None:
    p, d = pga3.Point(1, 2, 3), pga3.Direction(1, 0, 0)
    line = PGA3.line(PGA3.point(1, 2, 3), PGA3.direction(1, 0, 0))
    assert np.all(PGA3.line([p, p], d) == np.stack([line, line]))
    assert PGA3.line(PGA3.point(1, 2, 3).exactly(), PGA3.direction(1, 0, 0).exactly()) == line
    assert PGA3.line(p, [1, 0, 0]) == line and PGA3.line([1, 2, 3], [2, 2, 3]) == line
    assert PGA3.of([p, PGA3.point(0, 0, 1)]).shape == (2,)
    assert PGA3.line(line) is line and PGA3.plane(pga3.Plane(0, 0, 1, 2)) == PGA3.plane(0, 0, 1, 2)


def test_values_of_the_module_of_quaternions_are_quaternions() -> None:
    turn = VGA3.rotor([0, 0, 1], 0.5)
    given = quaternion.UnitQuaternion(turn.quaternion())
    assert VGA3.from_quaternion(given).isclose(turn)
    assert QUATERNIONS.quaternion(given).isclose(QUATERNIONS.quaternion(turn.quaternion()))
    with pytest.raises(TypeError, match=r"from_quaternion is PGA3\.POINT"):
        VGA3.from_quaternion(pga3.Point(1, 2, 3))


def test_values_are_equal_to_their_objects() -> None:
    value, point = pga3.Point(1, 2, 3), PGA3.point(1, 2, 3)
    points = np.stack([point, PGA3.point(0, 0, 1)])
    assert value == point and point == value and hash(value) == hash(point)
    assert (value != point, point != value) == (False, False)
    assert (points == value).tolist() == (value == points).tolist() == [True, False]
    assert arms.Motor(1, 0, 0, 0, 0, 0, 0, 0) == pga3.Motor(1, 0, 0, 0, 0, 0, 0, 0) == PGA3.of(PGA3.MOTOR, 1, *7 * [0])
    for other in (
        pga3.Point(1, 2, 4), pga3.Direction(1, 2, 3), vga3.Vector(1, 2, 3), cga3.Point(1, 2, 3),
        PGA3.direction(1, 2, 3), CGA3.point(1, 2, 3), 1, None, [1, 2, 3],
    ):  # fmt: skip
        assert value != other and other != value
    assert pga3.Motor(1, 0, 0, 0, 0, 0, 0, 0) == pga3.Even(1, 0, 0, 0, 0, 0, 0, 0)


def test_equality_does_not_depend_on_layouts() -> None:
    mine = PGA3.of(PGA3.algebra.layout("MINE", "e032 e013 e021", fixed={"e123": 1}), 1, 2, 3)
    point, points = PGA3.point(1, 2, 3), PGA3.point(np.array([[1.0, 2, 3], [0, 0, 1]]))
    assert mine == point and (mine != point) is False and hash(mine) == hash(point)
    assert (points == mine).tolist() == (mine == points).tolist() == [True, False]
    assert (points != mine).tolist() == [False, True]
    turned = PGA3.of(PGA3.algebra.layout("TURNED", "e013 e032 e021", fixed={"e123": 1}), 2, 1, 3)
    assert turned == point and hash(turned) == hash(point)


def test_arrays_of_values_are_arrays_of_objects() -> None:
    numbers = np.arange(12.0).reshape(4, 3)
    values, points, motor = pga3.Point.array(numbers), PGA3.point(numbers), PGA3.motor([0, 0, 1], 0.5)
    plane = PGA3.plane(0, 0, 1, -1)
    assert np.all(PGA3.of(values) == points) and np.all(values == points) and np.all(points == values)
    for moved in (motor >> values, motor(values), pga3.move_point(motor, values)):
        np.testing.assert_allclose(np.asarray(moved, float), (motor >> points).values, atol=1e-14)
    assert np.all(values & PGA3.point(0, 0, 0) == points & PGA3.point(0, 0, 0))
    np.testing.assert_array_equal(distance(values, plane), distance(points, plane))
    onto = project(values, pga3.Plane(0, 0, 1, -1))
    assert type(onto[0]) is pga3.Point and np.all(onto == project(points, plane))
