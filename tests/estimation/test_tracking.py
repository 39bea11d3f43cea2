"""Images in cameras on robots, and control that makes their errors obey linear equations."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from algorithms.estimation import Tracker, TrackingStatus, aim, gaze_rates, pan_tilt_head
from algorithms.estimation.image_jacobians import chain_of
from algorithms.kinematics import JointCountError, Robot
from generated import pga3
from tests.support.selection import some_slow
from tests.support.visual_scenes import (
    IMAGE_SIZES,
    IMAGES,
    camera_matrix,
    complex_step,
    image_by_matrices,
    mount,
    scene,
)

Array = np.ndarray[Any, Any]
KINDS = ("point", "line", "plane")
MOVES = {"point": pga3.move_point, "line": pga3.move_line, "plane": pga3.move_plane}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["ur5", "stanford", "iiwa"])
def test_jacobians_by_complex_steps(name: str, kind: str) -> None:
    rng = np.random.default_rng(0)
    robot, camera = Robot.named(name), mount()
    for _ in range(4):
        q = rng.uniform(-2, 2, robot.n_joints)
        element = scene(rng, robot, q, kind, camera)
        for mirror in (0.0, 0.6, 1.0) if kind == "point" else (0.0,):
            more = {"mirror": mirror} if kind == "point" else {}
            found = IMAGES[kind](robot, q, element, camera=camera, **more)
            expected = image_by_matrices(kind, camera_matrix(robot, q, camera), element, mirror)
            off = found.values - expected
            if kind == "line":
                off[0] = (off[0] + np.pi) % (2 * np.pi) - np.pi
            assert found.seen and np.abs(off).max() < 1e-12 * (1 + np.abs(expected).max())
            slopes = complex_step(kind, robot, q, camera, element, mirror)
            assert np.abs(found.jacobian - slopes).max() < 1e-11 * (1 + np.abs(slopes).max())


def test_batches_and_arguments() -> None:
    rng = np.random.default_rng(1)
    robot = Robot.named("ur5")
    q = rng.uniform(-2, 2, (4, 1, 6))
    points = rng.normal(size=(5, 3))
    found = IMAGES["point"](robot, q, points, mirror=1.0)
    assert found.values.shape == (4, 5, 2) and found.jacobian.shape == (4, 5, 2, 6) and found.seen.shape == (4, 5)
    one = IMAGES["point"](robot, q[2, 0], points[3], mirror=1.0)
    assert np.array_equal(found.jacobian[2, 3], one.jacobian)
    with pytest.raises(ValueError, match=r"ur5: q: shape \(5,\)"):
        IMAGES["point"](robot, np.zeros(5), points)
    with pytest.raises(ValueError, match="expected a unit motor"):
        IMAGES["point"](robot, q, points, camera=np.ones(8))
    with pytest.raises(JointCountError, match="expected a fixed base"):
        Tracker(replace(robot, coupling=np.eye(6, 7)))


def moving(kind: str, element: Array, twist: Array, time: float) -> Array:
    return np.asarray(MOVES[kind](pga3.motor_from_twist(time * twist), element))


def difference(kind: str, values: Array, goal: Array) -> Array:
    off = values - goal
    if kind == "line":
        off[..., 0] = (off[..., 0] + np.pi) % (2 * np.pi) - np.pi
    return off


def a_task(kind: str) -> tuple[Robot, Array, Array, Array, Array, Array, Array]:
    """A robot, its camera and variables, and an element, its twist, the goal and its rate."""
    rng = np.random.default_rng(3)
    robot, camera = Robot.named("puma560"), mount()
    q = np.array([0.3, -0.5, 0.2, 0.4, 0.7, -0.3])
    element = scene(rng, robot, q, kind, camera)
    goal = IMAGES[kind](robot, q + 0.1, element, camera=camera).values
    twist = np.array([0.1, -0.05, 0.08, 0.05, 0.1, -0.04])
    return robot, camera, q, element, twist, goal, 0.05 * np.ones(IMAGE_SIZES[kind])


@pytest.mark.parametrize("kind", KINDS)
def test_error_obeys_the_first_order_equation(kind: str) -> None:
    """``e = e_0 exp(-K t)`` for a moving element and a moving goal, within 1e-6."""
    robot, camera, q, element, twist, goal, slope = a_task(kind)
    tracker = Tracker(robot, camera, gain=3.0)
    step = getattr(tracker, f"rates_for_{kind}")

    def rates(time: float, x: Array) -> Array:
        found = step(x, moving(kind, element, twist, time), goal + time * slope, slope, twist)
        assert found.status == TrackingStatus.OK
        return np.asarray(found.rates)

    times = np.linspace(0, 1.5, 16)
    motion = solve_ivp(rates, (0, 1.5), q, "DOP853", times, rtol=1e-9, atol=1e-10)
    images = [
        IMAGES[kind](robot, x, moving(kind, element, twist, t), camera=camera).values
        for t, x in zip(times, motion.y.T, strict=True)
    ]
    errors = difference(kind, np.array(images), goal + times[:, None] * slope)
    assert np.abs(errors[0]).max() > 0.02
    assert np.abs(errors - errors[0] * np.exp(-3 * times[:, None])).max() < 1e-8


@pytest.mark.parametrize("kind", KINDS)
def test_error_obeys_the_second_order_equation(kind: str) -> None:
    """Forces give ``e'' + 2 K e' + K^2 e = 0``: the closed form of the double pole, within 1e-6."""
    robot, camera, q, element, twist, goal, slope = a_task(kind)
    tracker = Tracker(robot, camera, gain=3.0)
    push = getattr(tracker, f"forces_for_{kind}")
    qd = 0.1 * np.cos(np.arange(6))
    nothing = np.zeros(IMAGE_SIZES[kind])

    def rates(time: float, state: Array) -> Array:
        x, v = state[:6], state[6:]
        found = push(x, v, moving(kind, element, twist, time), goal + time * slope, slope, nothing, twist)
        assert found.status == TrackingStatus.OK
        return np.append(v, robot.forward_dynamics(x, v, found.forces))

    times = np.linspace(0, 1.5, 16)
    motion = solve_ivp(rates, (0, 1.5), np.append(q, qd), "DOP853", times, rtol=1e-9, atol=1e-10)
    rows = [
        push(x[:6], x[6:], moving(kind, element, twist, t), goal + t * slope, slope, nothing, twist)
        for t, x in zip(times, motion.y.T, strict=True)
    ]
    errors, first_rate = np.array([row.error for row in rows]), rows[0].error_rate
    growth = first_rate + 3 * errors[0]
    expected = (errors[0] + growth * times[:, None]) * np.exp(-3 * times[:, None])
    assert np.abs(errors[0]).max() > 0.02 and np.abs(errors - expected).max() < 1e-6
    # The rate of the error is the derivative of the error.
    step = 1e-4
    before, after = (
        difference(kind, IMAGES[kind](robot, q + s * step * qd, moving(kind, element, twist, s * step), camera=camera)
                   .values, goal + s * step * slope)
        for s in (-1, 1)
    )  # fmt: skip
    assert np.abs((after - before) / (2 * step) - first_rate).max() < 1e-6


@pytest.mark.parametrize("kind", KINDS)
def test_steps_of_batches(kind: str) -> None:
    """Batches give what single configurations give, by rates and by forces."""
    robot, camera, q, element, twist, goal, slope = a_task(kind)
    tracker = Tracker(robot, camera, gain=3.0)
    many = q + np.linspace(-0.1, 0.1, 4)[:, None]
    rates = getattr(tracker, f"rates_for_{kind}")(many, element, goal, slope, twist)
    forces = getattr(tracker, f"forces_for_{kind}")(many, 0.1 * many, element, goal, slope, 0 * slope, twist)
    assert rates.status.tolist() == [0] * 4 == forces.status.tolist()
    for k, x in enumerate(many):
        one = getattr(tracker, f"rates_for_{kind}")(x, element, goal, slope, twist)
        push = getattr(tracker, f"forces_for_{kind}")(x, 0.1 * x, element, goal, slope, 0 * slope, twist)
        assert type(one.status) is int and type(push.status) is int
        assert np.allclose(rates.rates[k], one.rates, rtol=1e-12) and np.allclose(rates.error[k], one.error)
        assert np.allclose(forces.forces[k], push.forces, rtol=1e-12)


def test_joints_that_do_not_move_the_camera() -> None:
    chain = chain_of(pan_tilt_head())._replace(path=(0, 2), n_joints=4)
    assert not chain.is_whole
    for shape in ((4,), (3, 4), (2, 3, 4)):
        q = np.arange(np.prod(shape), dtype=float).reshape(shape) + 1
        own = chain.own(q)
        assert np.array_equal(own, q[..., [0, 2]])
        assert np.array_equal(chain.of_robot(own), q * [1, 0, 1, 0])


def test_saturation_keeps_the_direction() -> None:
    head = pan_tilt_head()
    point = np.array([1.0, 0.9, 0.6])
    free, bound = Tracker(head, speeds=[1e3, 1e3]), Tracker(head, speeds=[0.2, 0.3])
    fast, slow = free.rates_for_point([0.0, 0.0], point), bound.rates_for_point([0.0, 0.0], point)
    assert fast.status == TrackingStatus.OK and slow.status == TrackingStatus.SATURATED
    assert np.isclose(np.max(np.abs(slow.rates) / [0.2, 0.3]), 1)
    assert np.isclose(fast.rates[0] * slow.rates[1], fast.rates[1] * slow.rates[0])
    assert Tracker(head, speeds=[0.0, 1.0]).rates_for_point([0.0, 0.0], point).rates[1] < 1e-200


def test_damping_near_a_singularity() -> None:
    """A head that looks along its first axis cannot move the image to the side."""
    head = pan_tilt_head()
    rates = {}
    for tilt in (np.pi / 2, np.pi / 2 - 1e-9, np.pi / 2 - 1e-3, np.pi / 2 - 0.1):
        above = pga3.move_point(head.forward([0.0, tilt]), [0.004, 0.006, 2.0])
        step = Tracker(head, speeds=[1e9, 1e9]).rates_for_point([0.0, tilt], above)
        assert step.status == (TrackingStatus.SINGULAR if tilt > np.pi / 2 - 0.02 else TrackingStatus.OK)
        assert np.abs(step.rates).max() < 1
        rates[tilt] = above, step.rates
    # Without damping the rate grows as the inverse of the distance from the singularity.
    above, damped = rates[np.pi / 2 - 1e-3]
    free = Tracker(head, threshold=0.0, speeds=[1e9, 1e9]).rates_for_point([0.0, np.pi / 2 - 1e-3], above)
    assert np.abs(free.rates[0]) > 10 * np.abs(damped[0])


def test_mobility_of_joints() -> None:
    robot = Robot.named("iiwa")
    q = np.array([0.1, 0.5, -0.3, -1.2, 0.2, 0.9, 0.0])
    point = scene(np.random.default_rng(0), robot, q, "point")
    fixed = Tracker(robot, mobility=[1, 0, 1, 1, 0, 1, 1]).rates_for_point(q, point)
    free = Tracker(robot).rates_for_point(q, point)
    jacobian = IMAGES["point"](robot, q, point).jacobian
    for step in (fixed, free):
        assert np.allclose(jacobian @ step.rates, -2 * step.error, atol=1e-12)
    assert not fixed.rates[[1, 4]].any() and np.linalg.norm(free.rates) < np.linalg.norm(fixed.rates)
    assert np.allclose(free.rates, -2 * np.linalg.pinv(jacobian) @ free.error, atol=1e-12)


def test_bad_input() -> None:
    """Elements that are not seen and numbers that are not finite: no motion, and a status."""
    head = pan_tilt_head()
    tracker, q = Tracker(head), np.zeros(2)
    for point in ([-1.0, 0.1, 0.2], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1e9, 0.0, 0.0]):
        step = tracker.rates_for_point(q, point)
        assert step.status == TrackingStatus.NOT_VISIBLE and not step.rates.any() and np.isfinite(step.error).all()
    through_centre = pga3.join_points([0.0, 0, 0], [1.0, 0.2, 0.1])
    assert tracker.rates_for_line(q, through_centre, [0.0, 0.0]).status == TrackingStatus.NOT_VISIBLE
    assert tracker.rates_for_line(q, np.zeros(6), [0.0, 0.0]).status == TrackingStatus.NOT_VISIBLE
    assert tracker.rates_for_plane(q, [1.0, 0, 0, 0], [0.0, 0, 1]).status == TrackingStatus.NOT_VISIBLE
    for bad in (np.nan, np.inf, -np.inf):
        for step in (
            tracker.rates_for_point(q, [1.0, bad, 0.0]),
            tracker.rates_for_point([0.0, bad], [1.0, 0.0, 0.0]),
            tracker.rates_for_point(q, [1.0, 0.0, 0.0], goal=(bad, 0.0)),
            tracker.rates_for_line(q, [bad, 0, 0, 0, 1, 0], [0.0, 0.0]),
            tracker.rates_for_plane(q, [bad, 0, 0, 1], [0.0, 0.0, 0.0]),
        ):
            assert step.status == TrackingStatus.NOT_FINITE and not step.rates.any()
        push = tracker.forces_for_point(q, q, [1.0, bad, 0.0])
        assert push.status == TrackingStatus.NOT_FINITE and not push.accelerations.any()
        assert np.allclose(push.forces, head.gravity(q))
    with pytest.raises(ValueError, match="gain -1"):
        Tracker(head, gain=-1.0)
    with pytest.raises(ValueError, match="speeds"):
        Tracker(head, speeds=[1.0, -1.0])
    with pytest.raises(ValueError, match="point: shape"):
        tracker.rates_for_point(q, [1.0, 2.0])
    with pytest.raises(TypeError, match="goal: dtype"):
        tracker.rates_for_point(q, [1.0, 2.0, 0.0], goal=(1j, 0))


def converged(tracker: Tracker, kind: str, q: Array, element: Array, goal: Array) -> tuple[Array, Array]:
    """Which of many configurations reach the goal in 10 s, by steps of 10 ms within the limits of the joints."""
    step, nothing, still = tracker.kernel(kind), np.zeros(goal.shape[-1]), np.zeros(6)
    low, high = tracker.robot.limits[:, 0], tracker.robot.limits[:, 1]
    for _ in range(1000):
        q = np.clip(q + 0.01 * step(q, element, still, goal, nothing)[0], low, high)
    _, error, _, status = step(q, element, still, goal, nothing)
    return np.abs(error).max(-1) < 1e-6, status


def test_a_thousand_starts_of_a_head() -> None:
    """Targets anywhere in the image, up to 0.7 radians away in both joints."""
    rng = np.random.default_rng(4)
    head = pan_tilt_head()
    aimed = rng.uniform([-2.9, -1.2], [2.9, 1.2], (1000, 2))
    ahead = np.array([0.0, 0.0, 1.0]) * rng.uniform(0.5, 5, (1000, 1))
    points = pga3.move_point(head.forward(aimed), ahead)
    starts = np.clip(aimed + rng.uniform(-0.7, 0.7, (1000, 2)), head.limits[:, 0], head.limits[:, 1])
    reached, status = converged(Tracker(head, gain=3.0), "point", starts, points, np.zeros(2))
    assert reached.sum() == 1000 and (status <= TrackingStatus.SATURATED).all()


@pytest.mark.slow
def test_gaze_from_anywhere() -> None:
    """All angles within the limits, and targets all around, most of them not in the first image."""
    count = 100
    rng = np.random.default_rng(7)
    head = pan_tilt_head()
    tracker = Tracker(head, gain=5.0)
    low, high = head.limits[:, 0], head.limits[:, 1]
    ahead = np.array([0.0, 0.0, 1.0]) * rng.uniform(0.5, 5, (count, 1))
    points = pga3.move_point(head.forward(rng.uniform(low, high, (count, 2))), ahead)
    q = rng.uniform(low, high, (count, 2))
    for _ in range(25):
        step = gaze_rates(tracker, q, points)
        q = q + 0.15 * step.rates
        assert ((q >= low) & (q <= high)).all() and np.abs(step.rates).max() <= 4
    image = IMAGES["point"](head, q, points)
    assert image.seen.all() and np.abs(image.values).max() < 1e-6 and (step.status == TrackingStatus.OK).all()
    bad = gaze_rates(tracker, [[0.0, 0.0], [np.nan, 0.0], [0.0, 0.0]], [[np.nan, 0, 0], [1.0, 0.7, 0.3], [0.0, 0, 0]])
    assert bad.status.tolist() == [4, 4, 3] and not bad.rates.any()


THOUSAND = [("point", 1000, 1000), ("line", 1000, 1000), ("plane", 1000, 994)]


@pytest.mark.parametrize(
    ("kind", "count", "fewest"), some_slow([("point", 300, 300), ("line", 300, 300), *THOUSAND], *THOUSAND)
)
def test_a_thousand_starts_of_an_arm(kind: str, count: int, fewest: int) -> None:
    """All six joints are up to 1 radian away. Few planes are missed, most of them from the other side."""
    rng = np.random.default_rng(5)
    robot = Robot.named("ur5")
    goals = rng.uniform(-np.pi, np.pi, (count, 6))
    elements = scene(rng, robot, goals, kind)
    mirror = {"mirror": 1.0} if kind == "point" else {}
    goal = IMAGES[kind](robot, goals, elements, **mirror).values
    tracker = Tracker(robot, gain=3.0, threshold=0.01, damping=0.05, **mirror)
    reached, _ = converged(tracker, kind, goals + rng.uniform(-1, 1, (count, 6)), elements, goal)
    assert reached.sum() >= fewest


def test_aim() -> None:
    rng = np.random.default_rng(6)
    axes = pan_tilt_head().axes.copy()
    axes[1] = pga3.join_points([0.03, 0.0, 0.1], [0.04, -1.0, 0.12])
    eye = pga3.motor_product(
        pga3.motor_from_rotation_vector_translation([0.05, 0.1, -0.1], [0.05, 0.02, 0.15]), pan_tilt_head().tool
    )
    skew = pan_tilt_head(axes / np.linalg.norm(axes[:, :3], axis=1, keepdims=True), eye)
    for head in (pan_tilt_head(), skew):
        aimed = rng.uniform([-2.8, -1.2], [2.8, 1.2], (60, 2))
        points = pga3.move_point(head.forward(aimed), np.array([0.0, 0.0, 1.0]) * rng.uniform(0.5, 5, (60, 1)))
        found = aim(head, points, near=aimed + 0.2 * rng.normal(size=aimed.shape))
        assert found.reached.all() and np.abs(found.q - aimed).max() < 1e-8
    simple = aim(pan_tilt_head(), [2.0, 0.5, 0.4])
    assert np.allclose(simple.q, [np.arctan2(0.5, 2), np.arctan2(0.4, np.hypot(2, 0.5))], atol=1e-12)
    nowhere = aim(skew, [[0.03, 0.0, 0.1], [np.nan, 0, 0]])
    assert not nowhere.reached.any() and np.isfinite(nowhere.q).all()
    with pytest.raises(ValueError, match="6 joints; expected a head with two"):
        aim(Robot.named("ur5"), [1.0, 0, 0])


def test_aim_beyond_limits() -> None:
    """Points behind the head, and above it, are not reached; the rates are 0 instead of turning to and fro.

    The pan of a point is that of its horizontal direction, or the opposite one with the tilt beyond the vertical.
    """
    head = pan_tilt_head()
    low, high = head.limits[:, 0], head.limits[:, 1]
    points = np.random.default_rng(8).normal(size=(400, 3)) * [-1.5, 1, 1]
    pan, tilt = np.arctan2(points[:, 1], points[:, 0]), np.arctan2(points[:, 2], np.hypot(points[:, 0], points[:, 1]))
    other = np.stack([pan - np.sign(pan) * np.pi, np.sign(tilt) * np.pi - tilt], 1)
    inside = [((q >= low) & (q <= high)).all(1) for q in (np.stack([pan, tilt], 1), other)]
    found = aim(head, points)
    assert (found.reached == inside[0] | inside[1]).all() and 50 < found.reached.sum() < 390
    assert ((found.q >= low) & (found.q <= high)).all()
    behind = gaze_rates(Tracker(head), [0.4, 0.1], [-1.0, -0.05, 0.0])
    assert behind.status == TrackingStatus.NOT_VISIBLE and not behind.rates.any()


def test_default_head() -> None:
    """Pan turns about z, and a positive tilt raises the optical axis."""
    head = pan_tilt_head()
    pose = head.pose([0.3, 0.2])
    expected = Rotation.from_euler("ZY", [0.3, -0.2]).as_matrix() @ [1, 0, 0]
    assert np.allclose(pose[:3, 2], expected) and pose[2, 1] < 0
    assert np.linalg.eigvalsh(head.mass_matrix([0.3, 0.2])).min() > 0
