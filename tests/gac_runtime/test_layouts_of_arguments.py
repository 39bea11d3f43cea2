"""Elements keep their meaning as arguments of kernels: they are taken as they are, converted exactly, or refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gacompiler.errors import LayoutError
from gacompiler.objects import CGA3, PGA3, VGA3
from generated import cga3, pga3, robots, vga3

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
            np.testing.assert_allclose(pga3.move_point(m, p), TURN @ [1, 2, 3], atol=1e-15)
    many = PGA3.point(np.arange(6.0).reshape(2, 3))
    np.testing.assert_allclose(pga3.move_point(m, many), np.arange(6.0).reshape(2, 3) @ TURN.T, atol=1e-15)
    np.testing.assert_allclose(pga3.move_direction(m, PGA3.direction(1, 0, 0)), TURN[:, 0], atol=1e-15)


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


@pytest.mark.parametrize(("p", "message"), REFUSED, ids=[message for _, message in REFUSED])
def test_other_elements_are_refused_by_name(p: Any, message: str) -> None:
    pga3.move_point(MOTOR, [1, 2, 3])
    for motor in MOTORS:
        with pytest.raises(TypeError, match="move_point: argument p.*" + message):
            pga3.move_point(motor, p)


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
