"""Identities between methods of robots, closed forms, and robots without inertia."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from test_floating_base import states as free_states
from test_robots_single import coupled, tree
from test_urdf import ARM, FINGERS, written

from algorithms.kinematics import Body, DescriptionError, MissingInertiaError, Robot
from generated import pga3

ROBOTS = {
    "tree": tree(),
    "coupled": coupled(),
    "ur5": Robot.named("ur5"),
    "panda": replace(Robot.named("panda"), module=None),
    "stanford": Robot.named("stanford"),
}
DISTANCES = (0.0, 1e3, 1e6)


@pytest.fixture(params=[*ROBOTS, "floating"])
def robot(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Robot:
    if request.param == "floating":
        return Robot.from_urdf(written(tmp_path_factory.mktemp("free"), ARM + FINGERS), base="floating")
    return ROBOTS[request.param]


def states(robot: Robot, count: int = 8) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    if robot.n_positions != robot.n_joints:
        return free_states(robot, count)
    q, qd, qdd = np.random.default_rng(2).uniform(-1.5, 1.5, (3, count, robot.n_joints))
    return q, qd, qdd


def relative(found: Any, expected: Any) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def times(matrix: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.einsum("...ij,...j->...i", matrix, v)


def slope(function: Callable[[float], Any], h: float = 4e-3) -> Any:
    """The derivative at 0, by finite differences of order 8, with a relative error of about 1e-11."""
    weights = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
    return sum(w * (function(k * h) - function(-k * h)) for k, w in enumerate(weights, 1)) / h


def jacobian_by(function: Callable[[np.ndarray], Any], n: int) -> np.ndarray:
    """Derivatives with respect to the entries of the argument, along the last axis."""
    return np.stack([slope(lambda t, step=step: function(t * step)) for step in np.eye(n)], axis=-1)


def test_the_mass_matrix_times_its_inverse(robot: Robot) -> None:
    q, _, _ = states(robot)
    mass, inverse = robot.mass_matrix(q), robot.inverse_mass_matrix(q)
    assert np.abs(mass @ inverse - np.eye(robot.n_joints)).max() < 1e-13 * np.linalg.cond(mass).max()
    assert relative(inverse, inverse.mT) < 1e-13 and (np.linalg.eigvalsh(inverse) > 0).all()


def test_forward_dynamics_inverts_inverse_dynamics(robot: Robot) -> None:
    q, qd, qdd = states(robot)
    tau = robot.inverse_dynamics(q, qd, qdd)
    assert relative(robot.forward_dynamics(q, qd, tau), qdd) < 1e-14 * np.linalg.cond(robot.mass_matrix(q)).max()
    parts = times(robot.mass_matrix(q), qdd) + robot.coriolis(q, qd) + robot.gravity(q)
    assert relative(tau, parts) < 1e-13
    assert relative(times(robot.coriolis_matrix(q, qd), qd), robot.coriolis(q, qd)) < 1e-13


def test_derivatives_of_the_dynamics(robot: Robot) -> None:
    q, qd, qdd = states(robot)
    n = robot.n_joints
    tau = robot.inverse_dynamics(q, qd, qdd)
    by_q, by_qd = robot.inverse_dynamics_derivatives(q, qd, qdd)
    assert relative(by_q, jacobian_by(lambda d: robot.inverse_dynamics(robot.integrate(q, d), qd, qdd), n)) < 1e-10
    assert relative(by_qd, jacobian_by(lambda d: robot.inverse_dynamics(q, qd + d, qdd), n)) < 1e-10
    ahead = robot.forward_dynamics_derivatives(q, qd, tau)
    near = 1e-11 * np.linalg.cond(robot.mass_matrix(q)).max()
    assert relative(ahead[0], jacobian_by(lambda d: robot.forward_dynamics(robot.integrate(q, d), qd, tau), n)) < near
    assert relative(ahead[1], jacobian_by(lambda d: robot.forward_dynamics(q, qd + d, tau), n)) < near
    assert relative(ahead[2], jacobian_by(lambda d: robot.forward_dynamics(q, qd, tau + d), n)) < near


def test_the_regressor_times_inertias_is_the_force(robot: Robot) -> None:
    q, qd, qdd = states(robot)
    regressor = robot.torque_regressor(q, qd, qdd)
    assert regressor.shape == (8, robot.n_joints, len(robot.kinds), 10)
    found = np.einsum("...ijk,jk->...i", regressor, robot.link_inertias)
    bare = robot.with_armature(np.zeros(len(robot.kinds)))
    assert relative(found, bare.inverse_dynamics(q, qd, qdd)) < 1e-13
    # it does not depend on the masses, and the force is linear in them
    heavy = replace(bare, bodies=bare.bodies * np.array([3.0, 1, 1, 1, *[3.0] * 6]))
    assert np.array_equal(heavy.torque_regressor(q, qd, qdd), regressor)
    assert relative(3 * found, heavy.inverse_dynamics(q, qd, qdd)) < 1e-13


def test_power_changes_the_energy(robot: Robot) -> None:
    q, qd, qdd = states(robot)
    power = (robot.inverse_dynamics(q, qd, qdd) * qd).sum(-1)

    def energy(t: float) -> Any:
        # The velocity is constant during a step in the group of motions; its change is added to first order.
        place = robot.integrate(q, t * qd)
        return robot.kinetic_energy(place, qd + t * qdd) + robot.potential_energy(place)

    assert relative(slope(energy), power) < 1e-10
    assert relative(robot.kinetic_energy(q, qd), (times(robot.mass_matrix(q), qd) * qd).sum(-1) / 2) < 1e-13


def test_the_centre_of_mass_by_potential_energy(robot: Robot) -> None:
    """The energies for three directions of gravity give three coordinates."""
    q, qd, _ = states(robot)
    mass = robot.bodies[:, 0].sum()
    energies = [robot.with_gravity(-direction).potential_energy(q) for direction in np.eye(3)]
    centre = robot.centre_of_mass(q)
    assert relative(centre, np.stack(energies, -1) / mass) < 1e-14
    forces = [robot.with_gravity(-direction).gravity(q) for direction in np.eye(3)]
    rate = slope(lambda t: robot.centre_of_mass(robot.integrate(q, t * qd)))
    assert relative(rate, np.stack([(force * qd).sum(-1) for force in forces], -1) / mass) < 1e-10


def test_momenta_are_sums_over_the_bodies(robot: Robot) -> None:
    """Compare with sums of the positions and velocities of mass centres and the rotations of bodies."""
    q, qd, _ = states(robot)

    def placed(t: float) -> tuple[np.ndarray, np.ndarray]:
        """Centres of mass, and rotations from the zero configuration."""
        frames = robot.forward_all(robot.integrate(q, t * qd))
        moves = pga3.motor_product(frames, pga3.motor_inverse(robot.home))
        return pga3.move_point(moves, robot.bodies[:, 1:4]), pga3.motor_to_matrix(moves)[..., :3, :3]

    centres, turns = placed(0.0)
    speeds, spins = slope(lambda t: placed(t)[0]), slope(lambda t: placed(t)[1]) @ turns.mT
    spins = np.stack([spins[..., 2, 1], spins[..., 0, 2], spins[..., 1, 0]], -1)
    mass = robot.bodies[:, 0, None]
    tensors = robot.bodies[:, 4:][:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
    arms = centres - robot.centre_of_mass(q)[:, None]
    angular = np.cross(arms, mass * speeds) + times(turns @ tensors @ turns.mT, spins)
    expected = np.concatenate([angular.sum(1), (mass * speeds).sum(1)], -1)
    assert relative(robot.centroidal_momentum(q, qd), expected) < 1e-9
    assert relative(times(robot.centroidal_momentum_matrix(q), qd), expected) < 1e-9


def test_jacobians_of_links(robot: Robot) -> None:
    if not robot.links:
        with pytest.raises(DescriptionError, match=f"{robot.name}: no link 'hand'"):
            robot.jacobian(np.zeros(robot.n_positions), link="hand")
        return
    q, qd, _ = states(robot)
    for name in robot.links:
        jacobian = robot.jacobian(q, link=name)
        pose, rate = (
            pga3.motor_to_matrix(robot.link(name, q)),
            slope(lambda t, name=name: pga3.motor_to_matrix(robot.link(name, robot.integrate(q, t * qd)))),
        )
        spin = rate[:, :3, :3] @ pose[:, :3, :3].mT
        expected = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0], *rate[:, :3, 3].T], -1)
        assert np.abs(times(jacobian, qd) - expected).max() < 1e-9, name
    with pytest.raises(DescriptionError, match=f"{robot.name}: no link 'none'; expected one of "):
        robot.jacobian(q, link="none")


def test_links_of_the_base_do_not_move(tmp_path: Any) -> None:
    robot = Robot.from_urdf(written(tmp_path, ARM + FINGERS))
    q = np.ones((2, robot.n_joints), np.float32)
    assert robot.jacobian(q, link="base").dtype == robot.link("base", q).dtype == np.float32
    assert not robot.jacobian(q, link="base").any() and robot.jacobian(q, link="base").shape == (2, 6, robot.n_joints)
    assert np.array_equal(robot.link("base", q), np.eye(8)[[0, 0]])


def test_one_prismatic_and_one_revolute_joint_in_closed_form() -> None:
    """A cart of 3 kg along z carries a rod of 2 kg that rotates about z: the motions are not coupled."""
    rows = [{"kind": "prismatic"}, {}]
    cart = Body(3.0)
    rod = Body(2.0, (0.5, 0, 0), (0.1, 0, 0, 0.2, 0, 0.3))
    robot = Robot.from_dh(rows, bodies=[cart, rod])
    q, qd = np.array([0.7, 0.4]), np.array([1.5, -2.0])
    turn = 0.3 + 2 * 0.5**2
    c, s = np.cos(q[1]), np.sin(q[1])
    assert robot.mass_matrix(q) == pytest.approx(np.diag([5.0, turn]), abs=1e-15)
    assert robot.inverse_mass_matrix(q) == pytest.approx(np.diag([0.2, 1 / turn]), abs=1e-15)
    assert robot.forward_dynamics(q, qd, [0.0, 1.0]) == pytest.approx([-9.81, 1 / turn])
    assert robot.centre_of_mass(q) == pytest.approx([0.2 * c, 0.2 * s, 0.7])
    # about the common centre: the spin of the rod and the distances of both centres
    spin = -2.0 * (0.3 + 3 * 2 / 5 * 0.5**2)
    expected = [0, 0, spin, 2 * 0.5 * s * 2.0, -2 * 0.5 * c * 2.0, 5 * 1.5]
    found = robot.centroidal_momentum(q, qd)
    assert found[2:] == pytest.approx(expected[2:], abs=1e-14)


@pytest.mark.parametrize("distance", DISTANCES)
def test_results_far_from_the_origin(distance: float) -> None:
    """The error is that of lines and points at this distance; see also `test_robot_changes`."""
    arm = replace(Robot.named("ur5"), module=None)
    base = pga3.motor_from_rotation_vector_translation(np.zeros(3), distance * np.array([0.6, -0.48, 0.64]))
    far = arm.with_base(base)
    q, qd, qdd = states(arm)
    limit = 3e-14 + 2e-15 * distance
    for name, count in (
        *(("jacobian", 1), ("jacobian_rate", 2), ("inverse_dynamics", 3), ("gravity", 1), ("coriolis", 2)),
        *(("mass_matrix", 1), ("torque_regressor", 3), ("centroidal_momentum_matrix", 1), ("kinetic_energy", 2)),
    ):
        given = (q, qd, qdd)[:count]
        assert relative(getattr(far, name)(*given), getattr(arm, name)(*given)) < limit, name
    condition = np.linalg.cond(arm.mass_matrix(q)).max()
    assert relative(far.inverse_mass_matrix(q), arm.inverse_mass_matrix(q)) < condition * limit
    assert relative(far.forward_dynamics(q, qd, qdd), arm.forward_dynamics(q, qd, qdd)) < condition * limit
    moved = pga3.move_point(base, arm.centre_of_mass(q))
    assert np.abs(far.centre_of_mass(q) - moved).max() < 1e-15 + 1e-15 * distance


MASSLESS = Body(0.0)
ROD = Body(1.0, (0.3, 0.1, 0.2), (0.1, 0, 0, 0.2, 0, 0.3))
AXLE = Body(1.0, (0.0, 0.0, 0.4))
"""A point of mass on the axis of its joint."""
NO_INERTIA: dict[str, tuple[list[dict[str, Any]], list[Body]]] = {
    "the last link has no mass": ([{"a": 0.7, "alpha": 0.4}, {}], [ROD, MASSLESS]),
    "a point on its axis": ([{"a": 0.7, "alpha": 0.4}, {}], [ROD, AXLE]),
    "two joints about one axis": ([{}, {}], [MASSLESS, ROD]),
    "two joints about one axis, apart": ([{"d": 0.3}, {"theta": 0.3}, {"alpha": 1.0}], [MASSLESS, ROD, ROD]),
    "two slides along one line": ([{"kind": "prismatic"}, {"kind": "prismatic"}], [MASSLESS, ROD]),
    "three turns about parallel axes": ([{"a": 0.5}, {"a": 0.4}, {}], [MASSLESS, MASSLESS, AXLE]),
    "nothing has mass": ([{"a": 0.5}, {"a": 0.4}], [MASSLESS, MASSLESS]),
}


@pytest.mark.parametrize("what", NO_INERTIA)
def test_accelerations_without_inertia_are_nan(what: str) -> None:
    """Every acceleration is NaN, not a large number from rounding; the inertia of a rotor suffices."""
    rows, bodies = NO_INERTIA[what]
    robot = Robot.from_dh(rows, bodies=bodies)
    q, qd, tau = np.random.default_rng(3).uniform(-2, 2, (3, 200, robot.n_joints))
    coupled = replace(robot, coupling=np.eye(len(rows), len(rows) + 1), limits=np.empty(0))
    with np.errstate(invalid="ignore"):
        for arm in (robot, coupled):
            assert np.isnan(arm.forward_dynamics(q, qd, tau)).all()
            assert np.isnan(arm.forward_dynamics(q[0], qd[0], tau[0])).all()
            assert np.isnan(arm.inverse_mass_matrix(q)).all()
            single = [rows.astype(np.float32) for rows in (q, qd, tau)]
            assert np.isnan(arm.forward_dynamics(*single)).all() and np.isnan(arm.inverse_mass_matrix(single[0])).all()
    assert np.isfinite(robot.inverse_dynamics(q, qd, tau)).all()
    turning = robot.with_armature(np.full(robot.n_joints, 0.1))
    assert relative(turning.inverse_dynamics(q, qd, turning.forward_dynamics(q, qd, tau)), tau) < 1e-12


def test_light_links_have_accelerations() -> None:
    """A link of a milligram on an arm of a ton has enough inertia."""
    heavy = Body(1000.0, (0.3, 0.1, 0.2), (100.0, 0, 0, 200.0, 0, 250.0))
    light = Body(1e-6, (0.01, 0, 0), (1e-10, 0, 0, 1e-10, 0, 1e-10))
    robot = Robot.from_dh([{"a": 0.7, "alpha": 0.4}, {"a": 0.5}, {}], bodies=[heavy, heavy, light])
    q, qd, qdd = np.random.default_rng(3).uniform(-2, 2, (3, 50, 3))
    tau = robot.inverse_dynamics(q, qd, qdd)
    assert np.abs(robot.forward_dynamics(q, qd, tau) - qdd)[:, :2].max() < 1e-10
    # the force of the last joint is 1e-10, with a large relative rounding error
    assert np.abs(robot.forward_dynamics(q, qd, tau) - qdd).max() < 1e-6


def test_trees_next_to_one_without_inertia_move() -> None:
    arm = Robot.from_dh([{"a": 0.5}, {"a": 0.5}], bodies=[ROD, MASSLESS])
    fields = ("name", "kinds", "axes", "home", "bodies")
    both = Robot(**{name: getattr(arm, name) for name in fields}, parents=(-1, -1))
    found = both.forward_dynamics(np.ones(2), np.ones(2), np.ones(2))
    assert np.isfinite(found[0]) and np.isnan(found[1])
    inverse = both.inverse_mass_matrix(np.ones(2))
    assert inverse[0, 0] == pytest.approx(1 / both.mass_matrix(np.ones(2))[0, 0], rel=1e-14)
    assert np.isnan(inverse[1, 1]) and inverse[0, 1] == inverse[1, 0] == 0


def test_without_masses() -> None:
    weightless = Robot.from_dh([{"a": 0.5}, {"a": 0.4}], bodies=[MASSLESS, MASSLESS])
    q = np.ones((3, 2))
    assert np.array_equal(weightless.potential_energy(q), np.zeros(3)) and weightless.potential_energy(q[0]) == 0.0
    assert np.isnan(weightless.centre_of_mass(q)).all()
    iiwa = Robot.named("iiwa")
    rows = np.ones((3, 7))
    for name, count in (
        *(("inverse_mass_matrix", 1), ("inverse_dynamics_derivatives", 3), ("forward_dynamics_derivatives", 3)),
        *(("centre_of_mass", 1), ("centroidal_momentum_matrix", 1), ("centroidal_momentum", 2)),
    ):
        with pytest.raises(MissingInertiaError, match="iiwa: unknown masses"):
            getattr(iiwa, name)(*rows[:count])
    with pytest.raises(MissingInertiaError):
        _ = iiwa.link_inertias
    assert iiwa.torque_regressor(*rows).shape == (7, 7, 10)
