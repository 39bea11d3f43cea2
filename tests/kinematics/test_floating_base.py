"""Robots with a floating base: closed forms of a rigid body, rigid motions, and the same robot by angles."""

from __future__ import annotations

import pickle
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_urdf import ARM, FINGERS, joint, link, place, written

from algorithms.kinematics import DescriptionError, FloatingBaseError, FloatingRobot, Robot, retime
from algorithms.kinematics.denavit_hartenberg import Joint
from generated import pga3, ur5

DISTANCES = (0.0, 1e3, 1e6)
SHIFT = np.array([0.6, -0.48, 0.64])
M, C = 1.5, np.array([0.1, -0.2, 0.3])
"""Mass and centre of the links in `test_urdf`."""


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """A robot with a prismatic joint, revolute joints, two branches, and a finger that mimics another."""
    return Robot.from_urdf(written(tmp_path_factory.mktemp("free"), ARM + FINGERS), base="floating")


def states(robot: Robot, count: int, seed: int = 0, shift: Any = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Configurations, velocities and accelerations; the first two have a pitch of a quarter and a half turn."""
    rng = np.random.default_rng(seed)
    rotors = rng.normal(size=(count, 4))
    rotors[:2] = pga3.rotor_from_axis_angle([[0.0, 1, 0], [0.6, 0, 0.8]], [pi / 2, pi])
    rotors /= np.linalg.norm(rotors, axis=1, keepdims=True)
    q = rng.uniform(-1, 1, (count, robot.n_positions))
    q[:, :8] = pga3.motor_from_rotor_translation(rotors, rng.normal(size=(count, 3)) + shift)
    return q, *rng.normal(size=(2, count, robot.n_joints))


def moved(q: np.ndarray, motor: np.ndarray) -> np.ndarray:
    return np.concatenate([pga3.motor_product(motor, q[..., :8]), q[..., 8:]], axis=-1)


def relative(found: Any, expected: Any) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def test_a_rigid_body_by_newton_and_euler(tmp_path: Path) -> None:
    """Torque about the origin of the base and force, in its frame; energies and momenta by closed forms."""
    body = Robot.from_urdf(written(tmp_path, [link("body")]), base="floating")
    assert isinstance(body, FloatingRobot) and (body.n_joints, body.n_positions) == (6, 8)
    turn = Rotation.from_euler("xyz", [0.2, 0.1, -0.4]).as_matrix()
    tensor = turn @ np.array([[0.3, 0.01, -0.02], [0.01, 0.4, 0.03], [-0.02, 0.03, 0.2]]) @ turn.T
    for distance in DISTANCES:
        q, v, a = states(body, 6, shift=distance * SHIFT)
        tau, weight = body.inverse_dynamics(q, v, a), body.gravity(q)
        for k in range(len(q)):
            matrix = pga3.motor_to_matrix(q[k])
            w, u, alpha, b = v[k, :3], v[k, 3:], a[k, :3], a[k, 3:]
            down = matrix[:3, :3].T @ [0, 0, -9.81]
            force = M * (b + np.cross(w, u) + np.cross(alpha, C) + np.cross(w, np.cross(w, C)) - down)
            torque = tensor @ alpha + np.cross(w, tensor @ w) + np.cross(C, force)
            assert relative(tau[k], np.concatenate([torque, force])) < 1e-14
            assert relative(weight[k], np.concatenate([np.cross(C, -M * down), -M * down])) < 1e-14
            speed = u + np.cross(w, C)
            assert body.kinetic_energy(q[k], v[k]) == pytest.approx((M * speed @ speed + w @ tensor @ w) / 2, rel=1e-14)
            assert body.potential_energy(q[k]) == pytest.approx(M * 9.81 * (matrix @ [*C, 1])[2], rel=1e-13)
            assert (
                relative(body.jacobian(q[k]) @ v[k], np.concatenate([matrix[:3, :3] @ w, matrix[:3, :3] @ u])) < 1e-14
            )
        assert relative(body.forward_dynamics(q, v, tau), a) < 1e-13
        mass = body.mass_matrix(q)
        assert relative((mass @ v[..., None])[..., 0], body.inverse_dynamics(q, 0 * v, v) - weight) < 1e-14


METHODS = (
    *(("inverse_dynamics", 3), ("gravity", 1), ("coriolis", 2), ("coriolis_matrix", 2), ("mass_matrix", 1)),
    *(("forward_dynamics", 3), ("kinetic_energy", 2), ("inverse_dynamics_derivatives", 3)),
    *(("forward_dynamics_derivatives", 3), ("inverse_mass_matrix", 1), ("torque_regressor", 3)),
)
VECTORS = (
    *(("jacobian", 1), ("jacobian_rate", 2), ("velocity", 2), ("acceleration", 3)),
    *(("centroidal_momentum_matrix", 1), ("centroidal_momentum", 2)),
)


@pytest.mark.parametrize("distance", DISTANCES)
def test_results_are_invariant_under_rigid_motions(robot: Robot, distance: float) -> None:
    """Gravity rotates with the robot, and so do velocities of the end effector."""
    rows = states(robot, 8)
    motor = pga3.motor_from_rotation_vector_translation([1.1, -0.7, 0.4], distance * SHIFT)
    turn = pga3.motor_to_matrix(motor)[:3, :3]
    elsewhere = robot.with_gravity(turn @ robot.free_fall)
    there = moved(rows[0], motor), *rows[1:]
    for name, count in METHODS:
        expected, found = getattr(robot, name)(*rows[:count]), getattr(elsewhere, name)(*there[:count])
        for mine, other in zip(found, expected, strict=True) if isinstance(expected, tuple) else [(found, expected)]:
            assert np.isfinite(mine).all() and relative(mine, other) < 1e-12, name
    for name, count in VECTORS:
        expected = getattr(robot, name)(*rows[:count])
        both = np.concatenate([turn @ part for part in np.split(expected.reshape(8, 6, -1), 2, axis=1)], axis=1)
        assert relative(getattr(elsewhere, name)(*there[:count]).reshape(both.shape), both) < 1e-14, name
    frames = pga3.motor_to_matrix(motor) @ robot.pose(rows[0])
    assert relative(elsewhere.pose(there[0]), frames) < 1e-14
    # without the rotation no bit changes: motors that differ by a translation have the same rotor
    shifted = moved(rows[0], pga3.motor_from_rotation_vector_translation(np.zeros(3), distance * SHIFT))
    for name, count in METHODS:
        expected, found = getattr(robot, name)(*rows[:count]), getattr(robot, name)(shifted, *rows[1:count])
        for mine, other in zip(found, expected, strict=True) if isinstance(expected, tuple) else [(found, expected)]:
            assert relative(mine, other) < 1e-14, name


def rates_matrix(x: np.ndarray) -> np.ndarray:
    """Body velocities, angular then linear, from the rates of x, y, z, yaw, pitch and roll (Featherstone 2008)."""
    (ps, pc), (rs, rc) = ((np.sin(a), np.cos(a)) for a in x[4:6])
    found = np.eye(len(x))
    found[:6, :6] = 0
    found[:3, 3:6] = [[-ps, 0, 1], [pc * rs, rc, 0], [pc * rc, -rs, 0]]
    found[3:6, :3] = Rotation.from_euler("ZYX", x[3:6]).as_matrix().T
    return found


def test_the_same_robot_by_yaw_pitch_and_roll(robot: Robot, tmp_path: Path) -> None:
    angles = Robot.from_urdf(written(tmp_path, ARM + FINGERS), base="euler")
    assert angles.n_joints == robot.n_joints == 10 and robot.n_positions == 12
    x, xd, xdd = np.random.default_rng(1).uniform(-1, 1, (3, 5, 10))
    rotors = pga3.rotor_from_quaternion_scalar_last(Rotation.from_euler("ZYX", x[:, 3:6]).as_quat())
    q = np.concatenate([pga3.motor_from_rotor_translation(rotors, x[:, :3]), x[:, 6:]], axis=1)
    e = np.array([rates_matrix(row) for row in x])
    h = 1e-5
    pairs = zip(x, xd, strict=True)
    rate = np.array([(rates_matrix(a + h * b) - rates_matrix(a - h * b)) / (2 * h) for a, b in pairs])
    back = np.linalg.inv(e)
    v, a = (e @ xd[..., None])[..., 0], (e @ xdd[..., None] + rate @ xd[..., None])[..., 0]

    def dual(tau: np.ndarray) -> np.ndarray:
        return (np.swapaxes(back, 1, 2) @ tau[..., None])[..., 0]

    assert relative(robot.pose(q), angles.pose(x)) < 1e-14
    assert relative(robot.forward_all(q)[:, 1:], angles.forward_all(x)[:, 6:]) < 1e-14
    assert relative(robot.link("left", q), angles.link("left", x)) < 1e-14
    assert relative(pga3.motor_to_matrix(robot.link("base", q)), pga3.motor_to_matrix(q[:, :8])) < 1e-14
    assert relative(robot.jacobian(q), angles.jacobian(x) @ back) < 1e-13
    assert relative(robot.manipulability(q), np.sqrt(np.linalg.det(robot.jacobian(q) @ robot.jacobian(q).mT))) < 1e-12
    assert relative(robot.acceleration(q, v, a), angles.acceleration(x, xd, xdd)) < 1e-8
    for name, element in (("point", [0.1, 0.2, 0.3]), ("line", [1.0, 2, 3, 0.1, 0.2, -0.1]), ("plane", [1.0, 2, 3, 4])):
        mine, theirs = getattr(robot, f"jacobian_of_{name}"), getattr(angles, f"jacobian_of_{name}")
        assert relative(mine(q, element), theirs(x, element) @ back) < 1e-13, name
    assert relative(robot.twists_of_joints(q)[:, 6:], angles.twists_of_joints(x)[:, 6:]) < 1e-13
    assert relative(robot.mass_matrix(q), back.mT @ angles.mass_matrix(x) @ back) < 1e-13
    assert relative(robot.gravity(q), dual(angles.gravity(x))) < 1e-13
    assert relative(robot.inverse_dynamics(q, v, a), dual(angles.inverse_dynamics(x, xd, xdd))) < 1e-8
    assert relative(robot.potential_energy(q), angles.potential_energy(x)) < 1e-13
    assert relative(robot.kinetic_energy(q, v), angles.kinetic_energy(x, xd)) < 1e-13
    matrix = back.mT @ (angles.coriolis_matrix(x, xd) - angles.mass_matrix(x) @ back @ rate) @ back
    assert relative(robot.coriolis_matrix(q, v), matrix) < 1e-8


def test_derivatives_along_small_motions(robot: Robot) -> None:
    q, v, a = states(robot, 4, seed=3)
    h, steps = 1e-5, np.eye(robot.n_joints)

    def difference(f: Any) -> np.ndarray:
        return np.stack([(f(h * step) - f(-h * step)) / (2 * h) for step in steps], axis=-1)

    tau = robot.inverse_dynamics(q, v, a)
    by_q, by_qd = robot.inverse_dynamics_derivatives(q, v, a)
    ahead = robot.forward_dynamics_derivatives(q, v, tau)
    assert relative(by_q, difference(lambda d: robot.inverse_dynamics(robot.integrate(q, d), v, a))) < 1e-8
    assert relative(by_qd, difference(lambda d: robot.inverse_dynamics(q, v + d, a))) < 1e-8
    assert relative(ahead[0], difference(lambda d: robot.forward_dynamics(robot.integrate(q, d), v, tau))) < 1e-7
    assert relative(ahead[1], difference(lambda d: robot.forward_dynamics(q, v + d, tau))) < 1e-7
    assert relative(ahead[2] @ robot.mass_matrix(q), np.eye(robot.n_joints)) < 1e-11
    assert relative(robot.gravity(q), difference(lambda d: robot.potential_energy(robot.integrate(q, d)))) < 1e-8
    place = difference(lambda d: robot.pose(robot.integrate(q, d))[:, :3, 3])
    assert relative(robot.jacobian(q)[:, 3:], place) < 1e-8
    turning = (robot.jacobian(robot.integrate(q, h * v)) - robot.jacobian(robot.integrate(q, -h * v))) / (2 * h)
    assert relative(robot.jacobian_rate(q, v), turning) < 1e-8
    # the rate of the mass matrix minus 2 C is skew-symmetric, and C gives the forces
    rate = (robot.mass_matrix(robot.integrate(q, h * v)) - robot.mass_matrix(robot.integrate(q, -h * v))) / (2 * h)
    matrix = robot.coriolis_matrix(q, v)
    rest = rate - 2 * matrix
    assert np.abs(rest + rest.mT).max() < 1e-8 * np.abs(matrix).max()
    assert relative((matrix @ v[..., None])[..., 0], robot.coriolis(q, v)) < 1e-13


def test_free_fall_of_a_body_that_tumbles(tmp_path: Path) -> None:
    """The centre falls on a parabola; angular momentum about it and energy are conserved, also far from the origin."""
    body = Robot.from_urdf(written(tmp_path, [link("body")]), base="floating")
    tensor = body.bodies[0, 4:][[0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(3, 3)
    w, u, step, count = np.array([2.0, -3.0, 4.0]), np.array([1.0, 2.0, -0.5]), 0.01, 20
    for distance in (0.0, 1e3):
        start = pga3.motor_from_rotation_vector_translation([0.0, pi / 2, 0.0], distance * SHIFT)
        q, v = body.simulate(start, np.concatenate([w, u]), step, count)
        assert q.shape == (count + 1, 8) and v.shape == (count + 1, 6)
        turns, times = pga3.motor_to_matrix(q)[:, :3, :3], step * np.arange(count + 1)
        centres = pga3.move_point(q, C)
        speed = turns[0] @ (u + np.cross(w, C))
        fall = centres[0] + times[:, None] * speed + times[:, None] ** 2 / 2 * [0, 0, -9.81]
        assert np.abs(centres - fall).max() < 1e-12 * (1 + distance)
        spin = (turns @ (tensor @ v[:, :3, None]))[..., 0]
        assert np.abs(spin - spin[0]).max() < 1e-12
        energy = body.kinetic_energy(q, v) + body.potential_energy(q)
        assert np.abs(energy - energy[0]).max() < 1e-11 * (1 + distance)


def test_a_robot_in_free_fall_conserves_momentum(robot: Robot) -> None:
    """Joints swing under springs, and the centre of mass falls like a point."""
    q, v, _ = states(robot, 2, seed=12)
    q[:, 8:] *= 0.3
    heavy = [(k, body) for k, body in enumerate(robot.bodies) if body[0] > 0]

    def centre(q: np.ndarray) -> np.ndarray:
        frames = pga3.motor_between_frames(
            robot.home, robot.forward_all(q)
        )  # the bodies after the motions of their frames
        parts = [body[0] * pga3.move_point(frames[..., k, :], body[1:4]) for k, body in heavy]
        return sum(parts) / sum(body[0] for _, body in heavy)

    def springs(time: float, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        force = np.zeros_like(qd)
        force[..., 6:] = -5.0 * q[..., 8:] + time
        return force

    places, _ = robot.simulate(q, v, 0.01, 20, springs)
    assert places.shape == (21, 2, robot.n_positions)
    now, times = centre(places), 0.01 * np.arange(21)[:, None, None]
    h = 1e-6
    speed = (centre(robot.integrate(q, h * v)) - centre(robot.integrate(q, -h * v))) / (2 * h)
    assert np.abs(now - (now[0] + times * speed + times**2 / 2 * [0, 0, -9.81])).max() < 1e-9


def test_a_file_whose_root_carries_a_floating_joint(robot: Robot, tmp_path: Path) -> None:
    """This joint is the floating base, and no second one is added."""
    world = [link("world", ""), joint("free", "floating", "world", "base", place("1 2 3"))]
    same = Robot.from_urdf(written(tmp_path, [*world, *ARM, *FINGERS]), base="floating")
    assert same.n_joints == robot.n_joints and same.joint_names == robot.joint_names
    q, v, a = states(robot, 3, seed=13)
    assert np.array_equal(same.inverse_dynamics(q, v, a), robot.inverse_dynamics(q, v, a))
    assert Robot.from_urdf(written(tmp_path, [*world, *ARM, *FINGERS]), base="euler").n_joints == robot.n_joints
    assert Robot.from_urdf(written(tmp_path, [*world, *ARM, *FINGERS])).n_joints == robot.n_joints


@pytest.mark.parametrize("name", ["ur5", "stanford", "floating"])
def test_integrate_and_difference_are_inverse(name: str, robot: Robot) -> None:
    arm = robot if name == "floating" else Robot.named(name)
    rng = np.random.default_rng(6)
    if name == "floating":
        q, v, _ = states(arm, 200, seed=5)
        v[:, :3] *= rng.uniform(0, 0.999 * pi, (200, 1)) / np.linalg.norm(v[:, :3], axis=1, keepdims=True)
        v[:3, :3] = [0, 0, 0], [1e-9, 0, 0], [0, 0.9999 * pi, 0]
    else:
        q, v = rng.uniform(-7, 7, (2, 200, arm.n_joints))
    end = arm.integrate(q, v)
    assert np.abs(arm.difference(q, end) - v).max() < 1e-12
    assert np.abs(arm.integrate(q, arm.difference(q, end)) - end).max() < 1e-13
    assert np.abs(arm.difference(q, q)).max() < 1e-15
    assert np.array_equal(arm.integrate(q[0], v[0]), end[0]) and arm.difference(q[0], end).shape == v.shape
    if name == "floating":
        for sign in (-1.0, 2.5):  # the same pose
            same = end.copy()
            same[:, :8] *= sign
            assert np.abs(arm.difference(q, same) - v).max() < 1e-12
            assert np.abs(arm.pose(same) - arm.pose(end)).max() < 1e-13
        # along a screw, by scipy
        step = pga3.motor_to_matrix(pga3.motor_relative(q[:, :8], end[:, :8]))
        assert np.abs(Rotation.from_matrix(step[:, :3, :3]).as_rotvec() - v[:, :3])[3:].max() < 1e-12
    else:
        assert np.array_equal(end, q + v)
    for call in (
        lambda: arm.integrate(q, v[:, :-1]),
        lambda: arm.integrate(q[:, :-1], v),
        lambda: arm.difference(q, v[:2, :3]),
    ):
        with pytest.raises(ValueError, match=rf"{arm.name}: (q|v|q1): shape"):
            call()
    with pytest.raises(ValueError, match="leading axes that broadcast"):
        arm.integrate(q[:3], v[:4])


def test_one_configuration_and_many(robot: Robot) -> None:
    rows = states(robot, 6, seed=7)
    for name, count in (
        *METHODS,
        *VECTORS,
        ("forward", 1),
        ("forward_all", 1),
        ("potential_energy", 1),
        ("centre_of_mass", 1),
    ):
        batch = getattr(robot, name)(*rows[:count])
        one = getattr(robot, name)(*(row[0] for row in rows[:count]))
        pairs = zip(one, batch, strict=True) if isinstance(batch, tuple) else [(one, batch)]
        for mine, expected in pairs:
            assert np.shape(mine) == expected.shape[1:] and relative(mine, expected[0]) < 1e-12, name
        grid = getattr(robot, name)(rows[0].reshape(2, 3, -1), *(row.reshape(2, 3, -1)[0] for row in rows[1:count]))
        first = grid[0] if isinstance(grid, tuple) else grid
        assert first.shape[:2] == (2, 3)


def test_kinds_of_numbers(robot: Robot) -> None:
    q, v, a = states(robot, 3, seed=8)
    tau = robot.inverse_dynamics(q, v, a)
    single = robot.inverse_dynamics(*(x.astype(np.float32) for x in (q, v, a)))
    assert single.dtype == np.float32 and relative(single, tau) < 1e-5
    still = [x.copy() for x in (q, v, a)]
    for x in still:
        x.flags.writeable = False
    assert np.array_equal(robot.inverse_dynamics(*still), tau)
    assert robot.inverse_dynamics(q[:0], v[:0], a[:0]).shape == (0, robot.n_joints)
    spoilt = q.copy()
    spoilt[1, 2] = np.nan
    found = robot.inverse_dynamics(spoilt, v, a)
    assert np.isnan(found[1]).any() and np.array_equal(found[[0, 2]], tau[[0, 2]])
    with pytest.raises(ValueError, match=r"arm: q: shape .*, a motor and 4 joint variables"):
        robot.gravity(q[:, :10])
    with pytest.raises(TypeError, match="arm: q: dtype"):
        robot.gravity(q + 0j)


def test_changes_of_a_floating_robot(robot: Robot) -> None:
    q, v, a = states(robot, 3, seed=9)
    loaded = robot.with_payload(2.0, (0.1, 0, 0))
    assert isinstance(loaded, FloatingRobot)
    assert loaded.mass_matrix(q)[:, 3:6, 3:6] == pytest.approx(
        robot.mass_matrix(q)[:, 3:6, 3:6] + 2 * np.eye(3), abs=1e-12
    )
    place = (pga3.motor_to_matrix(robot.forward(q)) @ [0.1, 0, 0, 1])[:, :3]
    assert loaded.potential_energy(q) == pytest.approx(robot.potential_energy(q) + 2 * 9.81 * place[:, 2], rel=1e-12)
    assert np.abs(robot.with_gravity(np.zeros(3)).gravity(q)).max() == 0.0
    tool = pga3.motor_from_rotation_vector_translation([0.3, 0.1, 0.2], [0.1, 0.2, 0.3])
    assert relative(robot.with_tool(tool).forward(q), pga3.motor_product(robot.forward(q), tool)) < 1e-14
    again = pickle.loads(pickle.dumps(robot))
    assert np.array_equal(again.inverse_dynamics(q, v, a), robot.inverse_dynamics(q, v, a))
    assert set(robot.uses.values()) == {"generated.robots"}
    with pytest.raises(DescriptionError, match=r"arm: module generated.ur5 .* different .*joints"):
        robot.with_module(ur5)
    for call in (
        lambda: robot.with_base(np.eye(4)),
        lambda: robot.inverse(np.eye(4)),
        lambda: replace(robot, kinds=(Joint.REVOLUTE, *robot.kinds[1:]), limits=np.empty(0)),
        lambda: replace(robot, kinds=(*robot.kinds[:-1], Joint.FLOATING), limits=np.empty(0)),
        lambda: replace(robot, parents=(-1, -1, *robot.parents[2:])),
        lambda: Robot(robot.name, robot.kinds, robot.axes, robot.home),
    ):
        with pytest.raises(FloatingBaseError, match="arm: "):
            call()


def test_what_a_floating_base_has_not(robot: Robot) -> None:
    with pytest.raises(FloatingBaseError, match="self_motions"):
        robot.self_motions(np.eye(4))
    with pytest.raises(FloatingBaseError, match="retime"):
        retime(robot, np.zeros((2, robot.n_joints)), acceleration=1.0)
    with pytest.raises(DescriptionError, match="the floating base; expected 0"):
        robot.with_armature(np.ones(len(robot.kinds)))
    none = robot.twists_of_joints(np.zeros((0, robot.n_positions)))
    assert none.shape == (0, 5 + len(robot.kinds), 6)
