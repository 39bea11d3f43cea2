"""Elements keep their meaning as arguments of kernels: they are taken as they are, converted exactly, or refused."""

from __future__ import annotations

import itertools
import pickle
from typing import Any

import numpy as np
import pytest

import gacompiler
from gacompiler import Algebra, kernel
from gacompiler.backends.python import _layout as printed_layout
from gacompiler.errors import AlgebraError, LayoutError
from gacompiler.generation.layouts import plain_layout
from gacompiler.objects import CGA3, PGA3, VGA3, Space
from generated import arms, cga3, pga3, robots, vga3
from generated.gac_runtime.layout import layout
from tests.support.all_cases import all_cases

ANGLE = 1.0
TURN = np.array([[np.cos(ANGLE), -np.sin(ANGLE), 0], [np.sin(ANGLE), np.cos(ANGLE), 0], [0, 0, 1]])
MOTOR = PGA3.motor(PGA3.line([0, 0, 0], [0, 0, 1]), ANGLE)
MOTORS = [MOTOR, pga3.Motor(*MOTOR.values), MOTOR.values, MOTOR.as_layout(PGA3.EVEN)]
"""The same motion as an object, a value, an array, and an element of another layout."""


@pytest.mark.parametrize("m", MOTORS, ids=lambda m: type(m).__name__)
def test_elements_of_the_layout_and_of_convertible_layouts_are_accepted(m: Any) -> None:
    trivector = 1 * PGA3.point(1, 2, 3) + 0 * PGA3.direction(1, 0, 0)
    for p in (PGA3.point(1, 2, 3), pga3.Point(1, 2, 3), np.array([1.0, 2, 3]), trivector):
        for _ in range(2):  # the second call does not pass through Python
            np.testing.assert_allclose(np.asarray(pga3.move_point(m, p), float), TURN @ [1, 2, 3], atol=1e-15)
    several = np.arange(6.0).reshape(2, 3)
    moved = np.asarray(pga3.move_point(m, PGA3.point(several)), float)
    np.testing.assert_allclose(moved, several @ TURN.T, atol=1e-15)
    turned = np.asarray(pga3.move_direction(m, PGA3.direction(1, 0, 0)), float)
    np.testing.assert_allclose(turned, TURN[:, 0], atol=1e-15)


REFUSED: list[tuple[Any, str]] = [
    (pga3.Direction(1, 0, 0), "PGA3.DIRECTION with e123 = 0; expected PGA3.POINT"),
    (PGA3.direction(1, 0, 0), "PGA3.DIRECTION with e123 = 0; expected PGA3.POINT"),
    (2 * PGA3.point(1, 2, 3), "with e123 = 2; expected PGA3.POINT"),
    (PGA3.direction(np.eye(3)), "PGA3.DIRECTION with e123 = 0; expected PGA3.POINT"),
    (vga3.Vector(1, 2, 3), "VGA3.VECTOR; expected PGA3.POINT"),
    (VGA3.vector(1, 2, 3), "VGA3.VECTOR; expected PGA3.POINT"),
    (CGA3.point(1, 2, 3), "CGA3.POINT; expected PGA3.POINT"),
    (PGA3.plane(1, 0, 0, 0), "PGA3.PLANE with e1 = 1; expected PGA3.POINT"),
    (np.ma.masked_array([1.0, 2, 3], [False, True, False]), "1 masked numbers"),
]


@all_cases("p, message", REFUSED)
def test_other_elements_are_refused_by_name(p: Any, message: str) -> None:
    pga3.move_point(MOTOR, [1, 2, 3])
    for motor in MOTORS:
        with pytest.raises(TypeError, match="move_point: argument p.*" + message):
            pga3.move_point(motor, p)


def test_results_of_elements_are_elements() -> None:
    point, direction = PGA3.point(1, 2, 3), PGA3.direction(1, 0, 0)
    for _ in range(3):  # the second call does not pass through Python
        moved = pga3.move_point(MOTOR, point)
        assert moved.layout == PGA3.POINT and moved.isclose(MOTOR >> point)
        assert pga3.move_direction(MOTOR, direction).isclose(MOTOR >> direction)
        value = pga3.move_point(pga3.Motor(*MOTOR.values), pga3.Point(1, 2, 3))
        assert isinstance(value, pga3.Point) and value.values == pytest.approx(TURN @ [1, 2, 3])
        rotor, shift = pga3.motor_to_rotor_translation(MOTOR)
        assert rotor.isclose(MOTOR) and rotor.layout == PGA3.ROTOR and type(shift) is np.ndarray
        assert np.ndim(pga3.motor_to_matrix(MOTOR)) == 2 and isinstance(pga3.distance_points(point, point), float)
    many = pga3.move_point(MOTOR, PGA3.point(np.eye(3)))
    assert many.shape == (3,) and many.isclose(MOTOR >> PGA3.point(np.eye(3))).all()
    for _ in range(2):
        powers = pga3.motor_power(MOTOR, np.array([0.0, 0.5, 1.0]))
        assert powers.shape == (3,) and powers[2].isclose(MOTOR)
    normal, offset = pga3.plane_to_vector_algebra(PGA3.plane(0, 0, 1, -2))
    assert (normal.layout, offset.layout) == (VGA3.BIVECTOR, VGA3.PSEUDOSCALAR)


def test_elements_that_are_not_of_unit_norm_are_refused_where_they_have_to_be() -> None:
    point, even = PGA3.point(1, 2, 3), MOTOR.as_layout(PGA3.EVEN)
    for _ in range(2):
        assert pga3.move_point(even, point).isclose(MOTOR >> point)
        assert pga3.move_point(PGA3.line([0, 0, 0], [0, 0, 1]), point).isclose(PGA3.point(-1, -2, 3))
        for wrong in (2 * even, even + 1, 2 * PGA3.line([0, 0, 0], [0, 0, 1]), np.stack([even, 2 * even])):
            with pytest.raises(TypeError, match=r"argument m is PGA3\.\w+ with x ~x = 1 up to .*; normalize"):
                pga3.move_point(wrong, point)


def test_values_that_are_not_of_unit_norm_are_refused_where_they_have_to_be() -> None:
    point, motor = pga3.Point(1, 2, 3), MOTOR.values
    for _ in range(2):
        moved = pga3.move_point(pga3.Even(motor), point)
        assert isinstance(moved, pga3.Point) and moved.values == pytest.approx(TURN @ [1, 2, 3])
        assert pga3.move_point(pga3.Line(0, 0, 1, 0, 0, 0), point).values == pytest.approx([1, -2, -3])
        wrong: object
        for wrong in (pga3.Even(2 * motor), pga3.Line(0, 0, 2, 0, 0, 0), pga3.RotorSum(1, 0, 0, 1e-4)):
            with pytest.raises(TypeError, match=r"argument m is PGA3\.\w+ with x ~x = 1 up to .*; normalize"):
                pga3.move_point(wrong, point)
        with pytest.raises(TypeError, match=r"argument plane is PGA3\.PLANE with x ~x = 1 up to 3"):
            pga3.project_point_on_unit_plane(point, pga3.Plane(0, 0, 2, 1))
        with pytest.raises(TypeError, match=r"argument r is VGA3\.EVEN"):
            vga3.rotate_vector(vga3.Even(1, 0, 0, 1), vga3.Vector(1, 2, 3))
        with pytest.raises(TypeError, match=r"whose norm generated\.arms cannot compute; expected a type of unit"):
            arms.wrist_turns(*(3 * [arms.Line(1, 0, 0, 0, 0, 0)]), arms.Motor(motor))


def test_results_of_arrays_are_arrays() -> None:
    out = np.empty(3)
    for m, p in itertools.product(MOTORS, (PGA3.point(1, 2, 3), pga3.Point(1, 2, 3), np.array([1.0, 2, 3]))):
        if isinstance(m, np.ndarray) or isinstance(p, np.ndarray):
            assert type(pga3.move_point(m, p)) is np.ndarray
        assert pga3.move_point(m, p, out=out) is out
        np.testing.assert_allclose(out, TURN @ [1, 2, 3], atol=1e-15)


def test_values_of_layouts_without_a_name_are_pickled() -> None:
    square = pga3.geometric_product(pga3.Full(*range(16)), pga3.Full(*range(16)))
    rotor, _ = pga3.motor_to_rotor_translation(pga3.Motor(*MOTOR.values))
    for value in (square, rotor):
        again = pickle.loads(pickle.dumps(value))
        assert type(again) is type(value) and again == value


def test_loops_return_elements() -> None:
    kernel = robots.twists_of_joints
    tables = kernel.definition.parameters
    zeros = {t.name: np.zeros((2,) * len(t.lengths) + t.shape) - (t.name == "parents") for t in tables}
    zeros = {t.name: zeros[t.name].astype(np.int64) if t.is_index else zeros[t.name] for t in tables}
    lines = PGA3.line([[0, 0, 0], [0, 0, 1]], [[1, 0, 0], [0, 1, 2]])
    found = kernel(**{**zeros, "screws": lines})
    assert found.layout == PGA3.LINE and found.shape == (2,)
    np.testing.assert_array_equal(found.values, kernel(**{**zeros, "screws": lines.values}))


def test_loops_check_elements_too() -> None:
    tables = robots.forward_all.definition.parameters
    arguments = {t.name: np.zeros((1,) * len(t.lengths) + t.shape, np.int64 if t.is_index else float) for t in tables}
    with pytest.raises(TypeError, match=r"argument screws is VGA3\.BIVECTOR"):
        robots.forward_all(**{**arguments, "screws": VGA3.multivector({"e12": [1.0]}).as_layout(VGA3.BIVECTOR)})
    with pytest.raises(TypeError, match="forward_all: argument q has 1 masked"):
        robots.forward_all(**{**arguments, "q": np.ma.masked_array([1.0], [True])})


def test_implied_coefficients_are_compared() -> None:
    identity = np.eye(8)[0]
    vector = CGA3.multivector({"e0": 1, "e1": 1, "e2": 2, "e3": 3, "einf": 7})
    for point in (CGA3.point(1, 2, 3), cga3.Point(1, 2, 3), vector):
        np.testing.assert_array_equal(cga3.move_point(identity, point), [1, 2, 3])
    with pytest.raises(TypeError, match=r"with einf = 8; expected CGA3\.POINT"):
        cga3.move_point(identity, CGA3.multivector({"e0": 1, "e1": 1, "e2": 2, "e3": 3, "einf": 8}))


def test_coordinates_of_other_elements_are_no_coordinates() -> None:
    assert PGA3.of(PGA3.POINT, 1 * PGA3.point(1, 2, 3)).isclose(PGA3.point(1, 2, 3))
    for other in (PGA3.translator([1, 2, 3]), PGA3.plane(0, 0, 1, -2)):
        with pytest.raises(LayoutError, match=r"as_layout\(PGA3.POINT\)"):
            PGA3.of(PGA3.POINT, other)
    with pytest.raises(TypeError, match=r"PGA3\.POINT is PGA3\.DIRECTION"):
        PGA3.of(PGA3.POINT, pga3.Direction(1, 2, 3))


def test_lists_of_elements_are_arrays_of_them() -> None:
    """And so are numpy's arrays of elements, whose entries are objects."""
    points = [PGA3.point(1, 2, 3), PGA3.point(4, 5, 6)]
    moved = pga3.move_point(MOTOR, points)
    assert moved.layout == PGA3.POINT and moved.isclose(MOTOR >> np.stack(points)).all()
    assert pga3.move_point([MOTOR, ~MOTOR], tuple(points))[1].isclose(~MOTOR >> points[1])
    values = pga3.move_point(MOTOR, [pga3.Point(1, 2, 3)])
    assert type(values[0]) is pga3.Point and values.values[0] == pytest.approx(TURN @ [1, 2, 3])
    assert pga3.move_point(MOTOR, np.array(points)).isclose(moved).all()
    assert pga3.move_point(np.asarray(MOTOR), points).isclose(moved).all()
    assert pga3.move_point(MOTOR, np.random.default_rng(0).permutation(points)).layout == PGA3.POINT
    np.testing.assert_allclose(pga3.move_point(MOTOR.values, points)[0], TURN @ [1, 2, 3], atol=1e-15)
    weighted = 1 * PGA3.point(1, 2, 3) + 0 * PGA3.direction(1, 0, 0)
    assert pga3.move_point(MOTOR, [points[0], weighted])[1].isclose(MOTOR >> points[0])
    for wrong in (PGA3.direction(1, 0, 0), pga3.Direction(1, 0, 0), VGA3.vector(1, 2, 3), CGA3.point(1, 2, 3)):
        for listed, place in (([wrong], 0), ((points[0], wrong), 1), ([[1.0, 2.0, 3.0], wrong], 1), ([[wrong]], 0)):
            with pytest.raises(TypeError, match=rf"argument p\[{place}\].* is .*; expected PGA3.POINT"):
                pga3.move_point(MOTOR, listed)
    with pytest.raises(ValueError, match=r"argument p is a list of elements of shapes \(3,\), \(2, 3\)"):
        pga3.move_point(MOTOR, [points[0], PGA3.point(np.ones((2, 3)))])
    with pytest.raises(TypeError, match=r"argument normal\[0\] is VGA3\.BIVECTOR"):
        cga3.plane_from_normal([VGA3.bivector(1, 2, 3)], 1.0)


def test_types_of_values_have_no_dictionary() -> None:
    with pytest.raises(TypeError, match=r"Own has fields of its own; expected __slots__ = \(\)"):
        type("Own", (pga3.Motor.__base__,), {"layout": pga3.Motor.layout})
    mixed = type("Mixed", (), {})
    content = {"layout": pga3.Motor.layout, "__slots__": (), "__module__": "own"}
    with pytest.raises(TypeError, match="Own has fields of its own"):
        type("Own", (pga3.Motor.__base__, mixed), content)


def test_the_algebra_is_compared_before_the_norm() -> None:
    """Otherwise the message would advise to normalize an element that is refused afterwards."""
    for other in (VGA3.bivector(1, 2, 3), 2 * VGA3.rotor([0, 0, 1], 1.0), CGA3.sphere([0, 0, 0], 2)):
        with pytest.raises(TypeError, match=rf"argument m is {other.algebra.name}.*; expected PGA3\.MOTOR"):
            pga3.motor_to_matrix(other)


def test_layouts_have_one_identity_in_all_packages_and_processes() -> None:
    """It is text, so that no process has to know another one, and one object in all copies of the runtime."""
    point = plain_layout(CGA3.POINT)
    assert point.identity == "CGA3: e1 e2 e3; e0 = 1; einf = 1/2*e1*e1 + 1/2*e2*e2 + 1/2*e3*e3"
    assert type(point) is not type(cga3.POINT) and point == cga3.POINT and point.identity is cga3.POINT.identity
    assert pickle.loads(pickle.dumps(cga3.POINT)).identity is point.identity
    motors = [pga3.MOTOR, pga3.EVEN, arms.MOTOR, robots.MOTOR, plain_layout(PGA3.MOTOR), plain_layout(PGA3.EVEN)]
    assert len({id(each.identity) for each in motors}) == 1
    others = [pga3.DIRECTION, pga3.POINT, pga3.TRIVECTOR, cga3.POINT, vga3.VECTOR, layout("VGA3.X", "e1 e3 e2")]
    assert len({each.identity for each in others}) == len(others)


def test_modules_store_whether_a_layout_has_relations() -> None:
    algebra = Algebra("G", "e1 e2 e3", [1, 1, 1])
    own = algebra.layout("OWN", "e1 e2", relations=lambda x: x * x - 1)
    plain, names = plain_layout(own), {"_layout": layout}
    exec(printed_layout("OWN", plain), names)
    assert plain.related and plain.has_meaning and names["OWN"] == plain


def test_elements_of_another_algebra_with_the_name_of_a_known_one_are_refused() -> None:
    other = Space(Algebra("PGA3", "e1 e2 e3 e0", [1, 1, -1, 0]))
    vector = other.vector(1, 2, 3, 4)
    assert plain_layout(vector.layout).algebra == "PGA3((1,0,0,0),(0,1,0,0),(0,0,-1,0),(0,0,0,0))"
    same = Space(Algebra("PGA3", "e1 e2 e3 e0", [1, 1, 1, 0], "e01 e02 e03 e021 e013 e032 e0123"))
    plane = pga3.Plane(1, 2, 3, 4)
    assert same.algebra == PGA3.algebra and (same.vector(1, 2, 3, 4) ^ plane).layout.algebra == PGA3.algebra
    for _ in range(2):
        for wrong in (lambda: pga3.meet_planes(vector, vector), lambda: pga3.Plane(vector), lambda: plane ^ vector):
            with pytest.raises((TypeError, AlgebraError), match="PGA3"):
                wrong()


def test_relations_of_a_layout_are_those_of_its_elements_only() -> None:
    algebra = Algebra("G", "e1 e2 e3", [1, 1, 1])
    across = algebra.multivector({"e1": 1, "e2": -1})
    own = algebra.layout("DIAGONAL", "e1 e2 e3", relations=lambda x: x | across)

    @kernel(x=own)
    def multiplied(x: Any) -> Any:
        return x * across

    run, space = gacompiler.compile(multiplied, "arrays"), Space(algebra)
    for _ in range(2):
        np.testing.assert_array_equal(np.asarray(run(space.of(own, 1, 1, 2)), float), run([1.0, 1, 2]))
        with pytest.raises(TypeError, match=r"argument x is G\.VECTOR; expected G\.DIAGONAL, whose relations"):
            run(space.of(algebra.layout("VECTOR", "e1 e2 e3"), 1, 5, 2))
