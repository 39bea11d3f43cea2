"""Robots with contacts and closed loops against closed forms: a four-bar linkage, trusses, bodies on the ground."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from algorithms.kinematics import (
    Constrained,
    Constraint,
    ConstraintStatus,
    DescriptionError,
    MissingInertiaError,
    Robot,
    contacts,
)
from generated import pga3
from tests.support.all_cases import all_cases
from tests.support.described_robots import bar, body, described, quadruped, turning

G = 9.81
OK, REDUNDANT, CONTRADICTORY, NO_INERTIA, NOT_FINITE = ConstraintStatus


def robot_of(*parts: str, base: str = "fixed") -> Robot:
    return Robot.from_urdf(described(*parts), base=base)


CRANK, COUPLER, LENGTH, WIDTH = 1.3, 2.1, 0.7, 1.6


def parallelogram() -> tuple[Robot, Constraint]:
    """Two cranks and the coupler that they carry, whose motion is a translation."""
    robot = robot_of(
        '<link name="base"/>',
        bar("crank", CRANK, LENGTH), bar("coupler", COUPLER, WIDTH), bar("rocker", CRANK, LENGTH),
        turning("a", "base", "crank", "0 0 0"), turning("b", "crank", "coupler", f"{LENGTH} 0 0"),
        turning("c", "base", "rocker", f"{WIDTH} 0 0"),
    )  # fmt: skip
    y = [0, 1, 0]
    return robot, contacts.hinge("rocker", [LENGTH, 0, 0], axis=y, other_axis=y, other="coupler", target=[WIDTH, 0, 0])


def test_a_parallelogram_is_a_pendulum() -> None:
    """Its acceleration is that of two bars about their ends and a translated bar, whatever its speed."""
    robot, loop = parallelogram()
    linkage = Constrained(robot, loop)
    angle, speed = np.linspace(-2, 2, 8), np.linspace(3, -1, 8)
    q, qd = np.outer(angle, [1, -1, 1]), np.outer(speed, [1, -1, 1])
    assert np.abs(linkage.errors(q)).max() < 1e-15 and np.abs(linkage.errors(q + np.array([0, 0, 0.1]))).max() > 0.01
    found = linkage.forward_dynamics(q, qd, np.zeros(3))
    assert (found.status == REDUNDANT).all()  # a hinge in space holds a linkage in a plane three times too often
    inertia = (2 / 3 * CRANK + COUPLER) * LENGTH**2
    expected = -(CRANK + COUPLER) * G * LENGTH * np.cos(angle) / inertia
    assert np.abs(found.result - np.outer(expected, [1, -1, 1])).max() < 1e-12
    assert np.abs(linkage.accelerations(q, qd, found.result)).max() < 1e-12
    # the rocker turns under its weight and the force of the hinge
    along = np.stack([-np.sin(angle), np.zeros(8), np.cos(angle)], -1) * LENGTH
    torque = (along * found.forces[:, :3]).sum(-1) - CRANK * G * LENGTH / 2 * np.cos(angle)
    assert np.abs(torque - CRANK * LENGTH**2 / 3 * expected).max() < 1e-11


def test_a_point_holds_the_same_linkage() -> None:
    """Without the torques of the hinge; in the plane two of three forces are enough."""
    robot, loop = parallelogram()
    hinged = Constrained(robot, loop)
    y = [[1, 0, 0], [0, 0, 1.0]]
    pinned = Constrained(
        robot, contacts.point("rocker", [LENGTH, 0, 0], other="coupler", target=[WIDTH, 0, 0], directions=y)
    )
    q, qd, tau = [0.4, -0.4, 0.4], [1.0, -1, 1], [3.0, -2, 1]
    found = pinned.forward_dynamics(q, qd, tau)
    assert found.status == OK and found.forces.shape == (2,)
    assert np.allclose(found.result, hinged.forward_dynamics(q, qd, tau).result, rtol=1e-12)


def test_a_truss_of_two_bars() -> None:
    """A double pendulum with a pinned tip cannot move; half of its weight and a thrust are at the tip."""
    mass, half, high = 1.7, 0.8, 0.6
    length = np.hypot(half, high)
    robot = robot_of(
        '<link name="base"/>', bar("one", mass, length), bar("two", mass, length),
        turning("a", "base", "one", "0 0 0"), turning("b", "one", "two", f"{length} 0 0"),
    )  # fmt: skip
    rise = np.arctan2(high, half)
    held = Constrained(robot, contacts.point("two", [length, 0, 0], target=[2 * half, 0, 0]))
    found = held.forward_dynamics([rise, -2 * rise], [0, 0], [0, 0])
    assert found.status == REDUNDANT and np.abs(found.result).max() < 1e-13
    assert np.abs(held.errors([rise, -2 * rise])).max() < 1e-15
    assert np.allclose(found.forces, [-mass * G * half / (2 * high), 0, mass * G], atol=1e-12)


MASS, SIDES = 3.0, np.array([0.4, 0.3, 0.2])
BLOCK = body("block", MASS, "0 0 0", tuple(MASS / 12 * (SIDES @ SIDES - SIDES**2)))
CORNERS = np.array([[x, y, -1] for x in (-1, 1) for y in (-1, 1)]) * SIDES / 2
UPRIGHT = np.eye(8)[0]


def test_a_block_rests_on_the_ground() -> None:
    """Four corners carry a quarter of the weight each, one sole all of it, at any place and heading."""
    block = robot_of(BLOCK, base="floating")
    corners = Constrained(block, [contacts.point("block", corner) for corner in CORNERS])
    assert corners.parts[3] == slice(9, 12)
    place = pga3.motor_from_rotor_translation(pga3.rotor_from_axis_angle([0, 0, 1.0], [0.7, -2.0]), [[1.0, 2, 3]])
    still = np.zeros(6)
    found = corners.forward_dynamics(place, still, still)
    assert (found.status == REDUNDANT).all() and np.abs(found.result).max() < 1e-13
    assert np.abs(found.forces.reshape(2, 4, 3) - [0, 0, MASS * G / 4]).max() < 1e-12
    sole = pga3.motor_from_rotor_translation(UPRIGHT[:4], [0.1, 0, -SIDES[2] / 2])
    flat = Constrained(block, contacts.weld("block", sole)).forward_dynamics(UPRIGHT, still, still)
    assert flat.status == OK and np.abs(flat.result).max() < 1e-13
    # the weight is 0.1 m behind the origin of the sole
    assert np.allclose(flat.forces, [0, 0, MASS * G, 0, 0.1 * MASS * G, 0], atol=1e-12)
    # what the ground must do is also what inverse dynamics finds, since nothing drives a floating base
    same = corners.inverse_dynamics(place, still, still)
    assert (same.status == REDUNDANT).all() and not same.result.any()
    assert np.abs(same.forces - found.forces).max() < 1e-12


def test_a_block_slides_without_friction() -> None:
    """A contact that holds along the normal only; on the block acts what is pushed, and nothing turns it."""
    block = robot_of(BLOCK, base="floating")
    smooth = Constrained(block, [contacts.point("block", c, directions=[[0, 0, 2.0]]) for c in CORNERS])
    found = smooth.forward_dynamics(UPRIGHT, [0, 0, 0, 0.3, 0.1, 0], [0, 0, 0, 6.0, 0, 0])
    assert found.status == REDUNDANT
    assert np.allclose(found.result, [0, 0, 0, 6 / MASS, 0, 0], atol=1e-13) and found.forces.sum() == pytest.approx(
        MASS * G
    )


def test_impacts_of_a_bar() -> None:
    """A bar that falls flat and hits the ground with one end; elastic impacts keep the energy."""
    mass, length, speed = 2.0, 1.2, 3.0
    inertia = mass * length**2 / 12
    free = robot_of(body("bar", mass, f"{length / 2} 0 0", (0.01, inertia, inertia)), base="floating")
    end = Constrained(free, contacts.point("bar", directions=[[0, 0, 1]]))
    fall = [0, 0, 0, 0, 0, -speed]
    found = end.impact(UPRIGHT, fall)
    assert found.status == OK and found.forces == pytest.approx([mass * speed / 4])
    assert np.allclose(found.result, [0, 3 * speed / (2 * length), 0, 0, 0, 0], atol=1e-14)
    back = end.impact(UPRIGHT, fall, restitution=1.0)
    assert back.forces == pytest.approx([mass * speed / 2])
    assert free.kinetic_energy(UPRIGHT, back.result) == pytest.approx(free.kinetic_energy(UPRIGHT, np.array(fall)))
    stopped = Constrained(free, contacts.weld("bar")).impact(UPRIGHT, [0.3, -1, 2, 0.4, 1, -3])
    assert stopped.status == OK and np.abs(stopped.result).max() < 1e-14


def test_energy_and_constraints_are_conserved() -> None:
    """Panda with a point of its hand on a rod: a motion of half a second by the method of Runge and Kutta."""
    arm = Robot.named("panda")
    rod = Constrained(arm, contacts.point(directions=[[1, 0, 0.5], [0, 1, 0]]))
    q = np.array([0.3, -0.5, 0.2, -2.0, 0.1, 1.5, 0.4])
    off = np.array([0.3, 0.8, -0.2, 0.6, 0.5, -0.4, 0.2])
    qd = rod.impact(q, off).result
    began = arm.forward(q)
    energy = arm.kinetic_energy(q, qd) + arm.potential_energy(q)

    def rate(x: np.ndarray) -> np.ndarray:
        return np.array([x[1], rod.forward_dynamics(x[0], x[1], np.zeros(7)).result])

    state, h = np.array([q, qd]), 2e-3
    for _ in range(250):
        a = rate(state)
        b = rate(state + h / 2 * a)
        c = rate(state + h / 2 * b)
        state = state + h / 6 * (a + 2 * b + 2 * c + rate(state + h * c))
    gone = pga3.motor_to_matrix(arm.forward(state[0]))[:3, 3] - pga3.motor_to_matrix(began)[:3, 3]
    assert np.abs(gone @ [[1, 0], [0, 1], [0.5, 0]]).max() < 1e-7 < abs(gone[2])
    assert arm.kinetic_energy(*state) + arm.potential_energy(state[0]) == pytest.approx(energy, abs=1e-5)


def standing() -> Robot:
    return Robot.from_urdf(quadruped(), base="floating")


def feet(robot: Robot, *, at: Any = None) -> list[Constraint]:
    names = [name for name in robot.links if name.endswith("shank")]
    return [
        contacts.point(name, [0, 0, -0.3], target=None if at is None else place)
        for name, place in zip(names, np.zeros((4, 3)) if at is None else at, strict=True)
    ]


def test_a_quadruped_stands() -> None:
    """Each foot carries a quarter of the weight; the torques that inverse dynamics finds keep it where it is."""
    robot = standing()
    bend = np.array([0.0, 0.6, -1.2, 0.0, 0.6, -1.2, 0.0, -0.6, 1.2, 0.0, -0.6, 1.2])
    q, still = np.concatenate([UPRIGHT, bend]), np.zeros(18)
    stand = Constrained(robot, feet(robot))
    held = stand.inverse_dynamics(q, still, still)
    assert held.status == REDUNDANT and not held.result[:6].any()
    weight = robot.bodies[:, 0].sum() * G
    assert np.allclose(held.forces.reshape(4, 3), [0, 0, weight / 4], atol=1e-11)
    again = stand.forward_dynamics(q, still, held.result)
    assert again.status == OK and np.abs(again.result).max() < 1e-11
    assert np.abs(again.forces - held.forces).max() < 1e-10  # the torques determine how the feet push each other
    # it falls over on one foot
    assert Constrained(robot, feet(robot)[:1]).inverse_dynamics(q, still, still).status == CONTRADICTORY


def test_nothing_is_needed_in_free_fall() -> None:
    """All forces cancel up to rounding, in any attitude, which contradicts no constraint."""
    robot = standing()
    q, still, _ = random_states(robot, 20)
    still[:] = 0
    falling = still.copy()
    falling[:, 3:6] = -G * pga3.motor_to_matrix(q[:, :8])[:, 2, :3]
    found = Constrained(robot, feet(robot)[:1]).inverse_dynamics(q, still, falling)
    assert (found.status == OK).all() and np.abs(found.forces).max() < 1e-10


def random_states(robot: Robot, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(2)
    q = rng.uniform(-1, 1, (count, robot.n_positions))
    if robot.n_positions > robot.n_joints:
        q[:, :8] = pga3.normalize_motor(q[:, :8])
    return q, *rng.normal(size=(2, count, robot.n_joints))


def test_the_principle_of_gauss() -> None:
    """Accelerations solve the equations of motion with multipliers; forces of constraints do no work on them."""
    robot = standing()
    place = np.random.default_rng(1).normal(size=(4, 3))
    pinned = Constrained(robot, [*feet(robot, at=place)[:2], contacts.hinge(
        "lh_shank", [0, 0.1, 0], axis=[0.48, 0.6, 0.64], other="rf_shank", other_axis=[0, 0.6, 0.8])])  # fmt: skip
    q, qd, tau = random_states(robot, 5)
    found = pinned.forward_dynamics(q, qd, tau)
    assert (found.status == OK).all()
    matrix = pinned.matrix(q)
    left = robot.inverse_dynamics(q, qd, found.result) - tau - np.einsum("krm,kr->km", matrix, found.forces)
    assert np.abs(left).max() < 1e-9 * np.abs(found.forces).max()
    assert np.abs(pinned.accelerations(q, qd, found.result)).max() < 1e-9 * np.abs(found.result).max()
    corrected = pinned.forward_dynamics(q, qd, tau, frequency=5.0)
    wanted = -10 * np.einsum("krm,km->kr", matrix, qd) - 25 * pinned.errors(q)
    assert np.abs(pinned.accelerations(q, qd, corrected.result) - wanted).max() < 1e-9 * np.abs(corrected.result).max()


def test_rates_of_errors_are_velocities() -> None:
    """Differences of the errors of contacts, and of their velocities, at configurations that violate them."""
    robot = standing()
    held = Constrained(robot, feet(robot, at=np.random.default_rng(1).normal(size=(4, 3))))
    q, qd, _ = random_states(robot, 4)
    h, still = 1e-5, np.zeros(18)

    def velocities(x: np.ndarray) -> np.ndarray:
        return np.einsum("krm,km->kr", held.matrix(x), qd)

    ahead, behind = robot.integrate(q, h * qd), robot.integrate(q, -h * qd)
    assert np.abs((held.errors(ahead) - held.errors(behind)) / (2 * h) - velocities(q)).max() < 1e-8
    assert np.abs((velocities(ahead) - velocities(behind)) / (2 * h) - held.accelerations(q, qd, still)).max() < 1e-7


def test_rates_of_angles() -> None:
    """The errors of a weld and of a hinge between two links change like their velocities where they vanish."""
    robot = standing()
    q, qd, _ = random_states(robot, 1)
    links = "lf_shank", "rh_shank"
    frame = pga3.normalize_motor(np.random.default_rng(3).normal(size=8))
    first, second = (pga3.motor_to_matrix(robot.link(name, q[0])) for name in links)
    there = np.linalg.inv(second) @ first
    axis = np.array([0.48, -0.6, 0.64])
    turned = {"axis": axis, "other_axis": there[:3, :3] @ axis, "target": there[:3, 3]}
    for held in (
        contacts.weld(links[0], frame, other=links[1], target=there @ pga3.motor_to_matrix(frame)),
        contacts.hinge(links[0], other=links[1], **turned),
    ):
        closed = Constrained(robot, held)
        assert np.abs(closed.errors(q)).max() < 1e-14
        h = 1e-6
        rates = (closed.errors(robot.integrate(q, h * qd)) - closed.errors(robot.integrate(q, -h * qd))) / (2 * h)
        assert np.abs(rates - np.einsum("krm,km->kr", closed.matrix(q), qd)).max() < 1e-8
        # Velocities of constraints change by their accelerations, also where the loop is open.
        other, speeds, _ = random_states(robot, 3)
        h, still = 1e-5, np.zeros(18)
        ahead, behind = (
            np.einsum("krm,km->kr", closed.matrix(robot.integrate(other, sign * h * speeds)), speeds)
            for sign in (1, -1)
        )
        assert np.abs((ahead - behind) / (2 * h) - closed.accelerations(other, speeds, still)).max() < 1e-7


def test_joints_that_follow_others() -> None:
    """The right finger of a gripper follows the left; both are held by one point of the left."""
    robot = robot_of(
        '<link name="base"/>', body("left", 1.0, "0 0 0", (1, 1, 1)), body("right", 2.0, "0 0 0", (1, 1, 1)),
        '<joint name="l" type="prismatic"><parent link="base"/><child link="left"/><axis xyz="0 0 1"/></joint>',
        '<joint name="r" type="prismatic"><parent link="base"/><child link="right"/><axis xyz="0 0 1"/>'
        '<mimic joint="l" multiplier="-0.5"/></joint>',
    )  # fmt: skip
    gap = Constrained(robot, contacts.point("right", other="left", directions=[[0, 0, 1]]))
    assert np.allclose(gap.matrix([0.3]), [[-1.5]])
    # the weights balance, and the force acts with 1.5 of the rate
    found = gap.forward_dynamics([0.3], [0.0], [3.0])
    assert found.status == OK and np.allclose(found.forces, [2.0]) and np.allclose(found.result, [0], atol=1e-14)


def test_passive_joints_are_moved_by_others() -> None:
    """The crank of a linkage drives it; the other joints have no motors."""
    robot, loop = parallelogram()
    driven = Constrained(robot, loop, passive=("b", "c"))
    q, qd = np.array([0.5, -0.5, 0.5]), np.array([2.0, -2, 2])
    found = driven.inverse_dynamics(q, qd, np.zeros(3))
    inertia_free = (CRANK + COUPLER) * G * LENGTH * np.cos(0.5)
    assert found.status == REDUNDANT and np.allclose(found.result, [inertia_free, 0, 0], atol=1e-11)
    assert np.abs(driven.forward_dynamics(q, qd, found.result).result).max() < 1e-11


def test_statuses() -> None:
    arm = Robot.named("ur5")
    held = Constrained(arm, contacts.point())
    q = np.random.default_rng(0).normal(size=(3, 6))
    bad = q.copy()
    bad[1, 2] = np.nan
    for found in (held.forward_dynamics(bad, q, q), held.forward_dynamics(q, bad, q), held.forward_dynamics(q, q, bad),
                  held.inverse_dynamics(q, q, bad), held.impact(q, bad)):  # fmt: skip
        assert found.status.tolist()[1] == NOT_FINITE
        assert found.status[0] == found.status[2] != NOT_FINITE
    one = held.forward_dynamics(bad[1], q[1], q[1])
    assert one.status == NOT_FINITE and one.status.shape == () and one.status.dtype == np.int8
    # the end effector is held where it is, and pulled elsewhere
    two = Constrained(arm, [contacts.weld(), contacts.weld(target=UPRIGHT)])
    assert two.forward_dynamics(q, q, q, frequency=1.0).status.tolist() == [CONTRADICTORY] * 3
    light = robot_of(
        '<link name="base"/>', body("none", 0.0, "0 0 0", (0, 0, 0)), turning("a", "base", "none", "0 0 0")
    )
    single = Constrained(light, contacts.point("none", [1, 0, 0])).forward_dynamics([0.1], [0], [0])
    assert single.status == NO_INERTIA


def test_shapes_and_types() -> None:
    arm = Robot.named("ur5")
    held = Constrained(arm, contacts.point())
    q, qd, tau = np.random.default_rng(0).normal(size=(3, 2, 3, 6))
    many = held.forward_dynamics(q, qd, tau)
    assert many.result.shape == (2, 3, 6) and many.forces.shape == (2, 3, 3) and many.status.shape == (2, 3)
    one = held.forward_dynamics(q[1, 2], qd[1, 2], tau[1, 2])
    assert np.allclose(one.result, many.result[1, 2], rtol=1e-12) and one.status.shape == ()
    short = held.forward_dynamics(q.astype(np.float32), qd.astype(np.float32), tau.astype(np.float32))
    assert short.result.dtype == short.forces.dtype == np.float32
    assert np.allclose(short.result, many.result, rtol=1e-3, atol=1e-3)
    none = held.forward_dynamics(q[:0, 0], qd[:0, 0], tau[:0, 0])
    assert none.result.shape == (0, 6) and none.status.shape == (0,)


ARM = Robot.named("ur5")
POINT = contacts.point()


@all_cases(
    "call, error, text",
    [
        (lambda: Constrained(ARM, []), ValueError, "expected at least one"),
        (lambda: Constrained(ARM, ["foot"]), TypeError, "str; expected"),
        (lambda: Constrained(ARM, contacts.point("foot")), DescriptionError, "foot"),
        (lambda: Constrained(ARM, POINT, ("x",)), DescriptionError, "no joint 'x'"),
        (lambda: Constrained(Robot.named("ur10"), POINT), MissingInertiaError, "masses"),
        (lambda: Constrained(ARM, POINT).forward_dynamics([0], [0], [0]), ValueError, "6 joint"),
        (lambda: Constrained(ARM, POINT).impact(*np.zeros((2, 6)), 2.0), ValueError, "restitution"),
        (lambda: contacts.point(directions=[[0, 0, 0]]), ValueError, "nonzero"),
        (lambda: contacts.point(place=[0, np.nan, 0]), ValueError, "place"),
        (lambda: contacts.hinge(axis=[0, 0, 0], other_axis=[0, 0, 1]), ValueError, "axis"),
        (lambda: contacts.weld(frame=np.ones((4, 4))), ValueError, "frame"),
    ],
)
def test_errors(call: Any, error: type[Exception], text: str) -> None:
    with pytest.raises(error, match=text):
        call()
