"""Public functions of the chapters take elements, return elements, and refuse elements of other layouts by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np
import pytest

from algorithms import calculus, estimation, geometry, kinematics, motors, registration, shapes, vision
from gacompiler.objects import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, STA, VGA2, VGA3
from generated import pga3
from tests.support.all_cases import all_cases

RANDOM = np.random.default_rng(41)
MOTOR = PGA3.motor([1, 2, 2], 0.7, 0.5)
MANY = PGA3.random_motor(6, generator=RANDOM)
SCATTER = RANDOM.normal(size=(40, 3))
POINTS = PGA3.point(SCATTER)
MOVED = MOTOR >> POINTS
LINES = PGA3.line(SCATTER[:6], SCATTER[6:12])
ARM = kinematics.Robot.from_screws(LINES, MOTOR)


def conformal(m: Any) -> Any:
    """Return the same motor in conformal space, whose coefficients are the same numbers."""
    return CGA3.of(CGA3.MOTOR, m.values)


def angle_between(a: Any, b: Any) -> Any:
    """Return the deviation of two motors, whose signs have no meaning."""
    a, b = np.asarray(a.values), np.asarray(b.values)
    return np.minimum(np.abs(a - b).max(-1), np.abs(a + b).max(-1))


def began(motor: Any) -> Any:
    """Return the estimate of a filter after one update by elements."""
    kalman = estimation.MotorFilter(motor, 1e-2)
    assert kalman.update_lines(LINES, MOTOR >> LINES, 1e-6).name in ("OK", "INCONSISTENT")
    return kalman.motor


Case = tuple[Callable[[], Any], Any, float]
CASES: dict[str, Case] = {
    "average_motors": (lambda: motors.average_motors([MOTOR, MOTOR, -MOTOR]), MOTOR, 1e-14),
    "mean_motor": (lambda: motors.mean_motor([MOTOR, MOTOR]).motor, MOTOR, 1e-14),
    "sclerp": (lambda: motors.sclerp(MOTOR * MOTOR, MOTOR, 1.0), MOTOR, 1e-14),
    "nlerp": (lambda: motors.nlerp(MOTOR * MOTOR, MOTOR, 1.0), MOTOR, 1e-14),
    "slerp": (
        lambda: motors.slerp(VGA3.rotor([0, 0, 1], 0), VGA3.rotor([0, 0, 1], 2), 0.5), VGA3.rotor([0, 0, 1], 1), 1e-14,
    ),
    "bezier": (lambda: motors.bezier(MANY, 0.0), MANY[0], 1e-14),
    "spline": (lambda: motors.MotorSpline.through([0, 1, 2], [MOTOR, MANY[0], MANY[1]])(0.0), MOTOR, 1e-13),
    "rotor_from_vectors": (
        lambda: motors.rotor_from_vectors(VGA3.vector(SCATTER), VGA3.rotor([0, 0, 1], 2) >> VGA3.vector(SCATTER)).rotor,
        VGA3.rotor([0, 0, 1], 2), 1e-13,
    ),
    "motor_from_points": (lambda: motors.motor_from_points(POINTS, MOVED).motor, MOTOR, 1e-13),
    "register_matches": (lambda: registration.register_matches(POINTS, MOVED).motor, MOTOR, 1e-9),
    "hand_eye": (lambda: vision.hand_eye(MANY, ~MOTOR * MANY * MOTOR).motor, MOTOR, 1e-12),
    "hand_eye in conformal space": (
        lambda: vision.hand_eye(conformal(MANY), conformal(~MOTOR * MANY * MOTOR)).motor, conformal(MOTOR), 1e-12,
    ),
    "hand_eye_from_poses": (lambda: vision.hand_eye_from_poses(MANY, MANY * MOTOR).motor, None, 0),
    "MotorFilter": (lambda: began(MOTOR * PGA3.motor([0, 0, 1], 1e-3)), MOTOR, 1e-5),
}  # fmt: skip


@all_cases("name", CASES)
def test_elements_give_elements(name: str) -> None:
    run, expected, tolerance = CASES[name]
    found = run()
    if expected is None:
        assert found.layout == PGA3.MOTOR
        return
    assert found.layout == expected.layout and angle_between(found, expected) < tolerance


def test_jacobians_take_elements() -> None:
    q, line, plane = SCATTER[0, 0] * np.ones(6), LINES[1], PGA3.plane([1, 2, 2], 0.5)
    np.testing.assert_array_equal(ARM.jacobian_of_line(q, line), ARM.jacobian_of_line(q, line.values))
    np.testing.assert_array_equal(ARM.jacobian_of_plane(q, plane), ARM.jacobian_of_plane(q, plane.values))
    with pytest.raises(TypeError, match=r"^line is PGA3\.PLANE"):
        ARM.jacobian_of_line(q, plane)


def test_fits_are_elements_of_the_algebra_of_their_points() -> None:
    flat = SCATTER * [1, 1, 0] + [0, 0, 2]
    plane = geometry.fit_plane(PGA3.point(flat)).object
    assert plane.layout == PGA3.PLANE and geometry.distance(plane, PGA3.point(flat)).max() < 1e-12
    line = geometry.fit_line(CGA3.point(SCATTER[:1] + np.arange(5.0)[:, None] * [1, 2, 2])).object
    assert line.algebra == CGA3.algebra and geometry.distance(line, PGA3.point(SCATTER[0])) < 1e-12
    on_sphere = SCATTER / np.linalg.norm(SCATTER, axis=1)[:, None] * 3 + [1, 2, 3]
    sphere = geometry.fit_sphere(PGA3.point(on_sphere)).object
    np.testing.assert_allclose(CGA3.centre(sphere), [1, 2, 3], atol=1e-12)


def test_arms_of_elements() -> None:
    assert angle_between(PGA3.of(PGA3.MOTOR, ARM.forward(np.zeros(6))), MOTOR) < 1e-14
    longer = ARM.with_tool(PGA3.translator([0, 0, 1]))
    np.testing.assert_allclose(longer.forward(np.zeros(6)), (MOTOR * PGA3.translator([0, 0, 1])).values, atol=1e-14)
    assert ARM.inverse(MOTOR).status is not None


ALL = [
    PGA2.point(1, 2), PGA2.line([0, 0], [1, 2]), PGA2.motor(1), PGA3.point(1, 2, 3), PGA3.plane(1, 2, 2, 3), LINES[0],
    MOTOR, PGA3.direction(1, 0, 0), CGA2.point(1, 2), CGA2.circle([0, 0], 1), CGA3.point(1, 2, 3),
    CGA3.plane([0, 0, 1], 1), CGA3.sphere([0, 0, 0], 1), CGA3.circle([0, 0, 0], [0, 0, 1], 1.0),
    CGA3.line([0, 0, 0], [1, 0, 0]), conformal(MOTOR), VGA2.vector(1, 2), VGA3.vector(1, 2, 3),
    VGA3.bivector(1, 2, 3), VGA3.rotor([0, 0, 1], 1), STA.vector(1, 2, 3, 4), QUATERNIONS.quaternion(1, 2, 3, 4),
]  # fmt: skip
TAKE_MOTORS: dict[str, Callable[[Any], Any]] = {
    "motors": lambda x: motors.average_motors([x, x]),
    "a": lambda x: motors.sclerp(x, MOTOR, 0.5),
    "tool": lambda x: ARM.with_tool(x),
    "base": lambda x: ARM.with_base(x),
    "poses": lambda x: ARM.inverse(x),
    "motor": lambda x: estimation.MotorFilter(x, 1.0),
}
TAKE_POINTS: dict[str, Callable[[Any], Any]] = {
    "points": lambda x: geometry.fit_plane(x),
    "source": lambda x: registration.register(x, SCATTER),
    "a": lambda x: motors.motor_from_points(x, SCATTER),
}


@all_cases("x", ALL)
def test_motors_of_other_layouts_are_refused(x: Any) -> None:
    for name, run in TAKE_MOTORS.items():
        if x.layout in (PGA3.MOTOR, CGA3.MOTOR):
            run(x)
            continue
        with pytest.raises(TypeError, match=rf"\b{name}(\[0\])? is "):
            run(x)


@all_cases("x", ALL)
def test_points_of_other_layouts_are_refused(x: Any) -> None:
    if x.layout in (PGA3.POINT, CGA3.POINT, VGA3.VECTOR):
        return
    many = x * np.ones(5)
    for name, run in TAKE_POINTS.items():
        if name == "points" and x.layout in (PGA2.POINT, CGA2.POINT):
            assert run(many).object.layout in (PGA3.PLANE, CGA3.PLANE)  # the plane lies in space
            continue
        with pytest.raises(TypeError, match=rf"^{name} is "):
            run(many)


def test_points_are_no_directions_and_no_numbers() -> None:
    """Elements are coordinates where points or vectors are meant, and neither angles, colours nor covariances."""
    point, direction, vector = PGA3.point(1, 2, 3), PGA3.direction(1, 2, 3), VGA3.vector(1, 2, 3)
    corners = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]
    hit = {
        "directions": lambda x: geometry.hit_mesh([0.2, 0.2, -1], x, corners, [[0, 1, 2]]),
        "origins": lambda x: geometry.hit_mesh(x, [0.0, 0, 1], corners, [[0, 1, 2]]),
    }
    for x in (direction, vector):
        np.testing.assert_equal(asdict(hit["directions"](x)), asdict(hit["directions"]([1.0, 2, 3])))
    hit["origins"](point), hit["origins"](vector)
    others: dict[str, Callable[[Any], Any]] = {
        "directions": hit["directions"],
        "angles": lambda x: motors.rotor_from_euler("zyx", x),
        "matrix": lambda x: motors.matrix_to_euler("zyx", [x, x, x]),
        "semi_axes": lambda x: geometry.ellipsoid([0.0, 1], [0.0, 1], x),
        "rate": lambda x: estimation.RotorFilter([1.0, 0, 0, 0], np.eye(3)).predict(x, 0.1, 1.0),
        "size": lambda x: calculus.free_dirac(np.zeros((4, 4, 4, 8)), x, 1.0, 0.1),
        "covariance": lambda x: estimation.KalmanFilter(np.zeros(3), [x, x, x], *4 * [np.eye(3)]),
    }
    for name, run in others.items():
        with pytest.raises(TypeError, match=rf"^{name}(\[0\])? is PGA3\.POINT"):
            run(point)
    with pytest.raises(TypeError, match=r"^origins is PGA3\.DIRECTION"):
        hit["origins"](direction)


def test_lists_of_elements_keep_their_meaning() -> None:
    """Lists are arrays of elements in every chapter, and so refused where other elements are."""
    plane = geometry.fit_plane(
        [PGA3.point(0, 0, 2), PGA3.point(1, 0, 2), PGA3.point(0, 1, 2), PGA3.point(3, 4, 2)]
    ).object
    assert plane.layout == PGA3.PLANE and geometry.distance(plane, PGA3.point(7, 7, 5)) == pytest.approx(3)
    others = [VGA3.bivector(1, 2, 3), PGA3.plane(1, 2, 2, 3), pga3.Direction(1, 2, 3)]
    calls: dict[str, Callable[[Any], Any]] = {
        r"points\[0\]": lambda x: registration.estimate_normals([x] * 40),
        r"source\[0\]": lambda x: registration.separate_motions([x] * 5, SCATTER[:5]),
        "volume": lambda x: shapes.segment([x] * 4),
        "columns": lambda x: calculus.dirac_spinors([x] * 4),
    }
    for name, run in calls.items():
        for x in others:
            with pytest.raises(TypeError, match=rf"^{name}.* is "):
                run(x)
    with pytest.raises(TypeError, match=r"^motors\[1\] is VGA3"):
        motors.average_motors([np.asarray(MOTOR.values), VGA3.rotor([0, 0, 1], 1)])
