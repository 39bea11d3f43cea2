"""Dynamics of robots against clouds of point masses, textbook arms, Lagrange's equations and conservation laws."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from typing import Any

import numpy as np
import pytest
import sympy

import gacompiler as ga
from algorithms.kinematics import Body, DescriptionError, JointCountError, MissingInertiaError, NotFiniteError, Robot
from algorithms.kinematics.lagrange import scalar_inertia_dynamics
from gacompiler import robots
from generated import pga3

RNG = np.random.default_rng(12)


def states(robot: Robot, count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    q, qd, qdd = np.random.default_rng(seed).uniform(-2, 2, (3, count, robot.n_joints))
    return q, qd, qdd


def generic(name: str) -> Robot:
    return replace(Robot.named(name), module=None)


# Kernels.


def cloud(seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(0.1, 1, 7), rng.normal(size=(7, 3))


def body_of(masses: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Mass, centre of mass, and inertia tensor about the centre, by their definitions."""
    centre = masses @ points / masses.sum()
    r = points - centre
    tensor = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, r, strict=True))
    return np.array([masses.sum(), *centre, *(tensor[i, j] for i in range(3) for j in range(i, 3))])


def parts(line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Direction and moment of a line."""
    return np.array([line[2], -line[1], line[0]]), line[3:]


def test_momenta_and_wrenches_equal_those_of_point_masses() -> None:
    masses, points = cloud(1)
    w, v, dw, dv = np.random.default_rng(2).normal(size=(4, 3))
    twist, rate = pga3.twist_from_velocities(w, v), pga3.twist_from_velocities(dw, dv)
    motor = pga3.motor_from_rotation_vector_translation([0.3, -0.8, 0.5], [1.0, 2.0, -0.7])
    inertia = pga3.inertia_of_moved_body(motor, body_of(masses, points))
    placed = pga3.move_point(motor, points)
    velocities = np.cross(w, placed) + v
    accelerations = np.cross(dw, placed) + dv + np.cross(w, velocities)
    for found, vectors in (
        (pga3.momentum(inertia, twist), masses[:, None] * velocities),
        (pga3.inertial_wrench(inertia, twist, rate), masses[:, None] * accelerations),
    ):
        linear, angular = parts(found)
        assert np.abs(linear - vectors.sum(0)).max() < 1e-13
        assert np.abs(angular - np.cross(placed, vectors).sum(0)).max() < 1e-13
    kinetic = (masses * (velocities**2).sum(1)).sum() / 2
    assert pga3.power(twist, pga3.momentum(inertia, twist)) / 2 == pytest.approx(kinetic, abs=1e-13)


def test_the_twist_after_a_joint_is_a_derivative() -> None:
    """Twists add up, and a moving axis changes with the twist of the body that carries it."""
    v, a, axis = np.random.default_rng(3).normal(size=(3, 6))
    axis = pga3.line_from_direction_moment(*pga3.line_to_direction_moment(axis))
    assert np.abs(pga3.twist_after_joint(v, axis, 0.7) - (v + 0.7 * axis)).max() < 1e-15
    rate = pga3.twist_rate_after_joint(v, a, axis, 0.7, -0.4)
    h = 1e-5
    dragged = [pga3.move_line(pga3.motor_from_twist(s * h * v), axis) for s in (1, -1)]
    assert np.abs(rate - (a - 0.4 * axis + 0.7 * (dragged[0] - dragged[1]) / (2 * h))).max() < 1e-9


# Textbook arms.


A1, C1, C2, M1, M2, I1, I2, FALL = 0.8, 0.35, 0.3, 2.0, 1.3, 0.11, 0.07, 9.81


def two_links() -> Robot:
    """A planar arm that hangs in the plane x y."""
    robot = Robot.from_dh(
        [{"a": A1}, {"a": 0.6}],
        bodies=[
            Body(M1, (C1 - A1, 0, 0), (0.02, 0, 0, 0.1, 0, I1)),
            Body(M2, (C2 - 0.6, 0, 0), (0.01, 0, 0, 0.05, 0, I2)),
        ],
    )
    return replace(robot, free_fall=np.array([0, -FALL, 0]))


def test_two_links_as_in_the_textbook() -> None:
    """Spong, Hutchinson and Vidyasagar, *Robot Modeling and Control*, section 7.4."""
    arm = two_links()
    q, qd, _ = states(arm, 50)
    (one, two), (s1, s2) = q.T, qd.T
    h11 = M1 * C1**2 + M2 * (A1**2 + C2**2 + 2 * A1 * C2 * np.cos(two)) + I1 + I2
    h12 = M2 * (C2**2 + A1 * C2 * np.cos(two)) + I2
    h22 = np.full_like(one, M2 * C2**2 + I2)
    mass = np.array([[h11, h12], [h12, h22]]).transpose(2, 0, 1)
    assert np.abs(arm.mass_matrix(q) - mass).max() < 1e-14
    h = -M2 * A1 * C2 * np.sin(two)
    christoffel = np.array([[h * s2, h * (s1 + s2)], [-h * s1, 0 * h]]).transpose(2, 0, 1)
    assert np.abs(arm.coriolis_matrix(q, qd) - christoffel).max() < 1e-13
    assert np.abs(arm.coriolis(q, qd) - np.einsum("bij,bj->bi", christoffel, qd)).max() < 1e-13
    height = M2 * C2 * FALL * np.cos(one + two)
    weight = np.array([(M1 * C1 + M2 * A1) * FALL * np.cos(one) + height, height]).T
    assert np.abs(arm.gravity(q) - weight).max() < 1e-13
    lifted = M1 * FALL * C1 * np.sin(one) + M2 * FALL * (A1 * np.sin(one) + C2 * np.sin(one + two))
    assert np.abs(arm.potential_energy(q) - lifted).max() < 1e-13


def test_a_cart_with_a_pole() -> None:
    """A slide along x that carries a pendulum of length l: (M + m) x'' + m l (t'' cos t - t'^2 sin t) = f."""
    cart, ball, length = 3.0, 0.5, 0.7
    slide = pga3.line_from_direction_moment([1.0, 0, 0], [0.0, 0, 0])
    hinge = pga3.line_from_direction_moment([0.0, -1, 0], [0.0, 0, 0])
    robot = Robot.from_screws(
        [slide, hinge],
        np.eye(8)[0],
        ["prismatic", "revolute"],
        bodies=[Body(cart, (0.2, 0.1, 0.3)), Body(ball, (0, 0, -length))],
    )
    q, qd, qdd = states(robot, 40)
    t, dt, (ddx, ddt) = q[:, 1], qd[:, 1], qdd.T
    tau = robot.inverse_dynamics(q, qd, qdd)
    force = (cart + ball) * ddx + ball * length * (ddt * np.cos(t) - dt**2 * np.sin(t))
    torque = ball * length * (np.cos(t) * ddx + length * ddt + 9.81 * np.sin(t))
    assert np.abs(tau - np.array([force, torque]).T).max() < 1e-13


def lagrange(rows: list[dict[str, Any]], bodies: list[Body]) -> Any:
    """Generalised forces from Lagrange's equations, derived by sympy from 4 x 4 matrices; gravity along -z."""
    n = len(rows)
    q, qd, qdd = (sympy.symbols(f"{name}:{n}", real=True) for name in ("q", "v", "a"))
    pose, kinetic, potential = sympy.eye(4), sympy.S(0), sympy.S(0)
    for k, (row, body) in enumerate(zip(rows, bodies, strict=True)):
        slides = row.get("kind") == "prismatic"
        theta, d = row.get("theta", 0) + (0 if slides else q[k]), row.get("d", 0) + (q[k] if slides else 0)
        c, s, ca, sa = sympy.cos(theta), sympy.sin(theta), sympy.cos(row["alpha"]), sympy.sin(row["alpha"])
        a = row.get("a", 0)
        pose = pose * sympy.Matrix(
            [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        )
        turn = pose[:3, :3]
        centre = (pose * sympy.Matrix([*body.centre, 1]))[:3, 0]
        rate = sum((turn.diff(q[j]) * qd[j] for j in range(n)), sympy.zeros(3, 3))
        spin = turn.T * rate
        w = sympy.Matrix([spin[2, 1], spin[0, 2], spin[1, 0]])
        velocity = centre.jacobian(sympy.Matrix(q)) * sympy.Matrix(qd)
        xx, xy, xz, yy, yz, zz = body.tensor
        tensor = sympy.Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        kinetic += (body.mass * velocity.dot(velocity) + (w.T * tensor * w)[0]) / 2
        potential += body.mass * sympy.Float(9.81) * centre[2]
    forces = []
    for k in range(n):
        slope = kinetic.diff(qd[k])
        along = sum(slope.diff(q[j]) * qd[j] + slope.diff(qd[j]) * qdd[j] for j in range(n))
        forces.append(along - kinetic.diff(q[k]) + potential.diff(q[k]))
    return sympy.lambdify([q, qd, qdd], forces, "numpy", cse=True)


SPATIAL: list[dict[str, Any]] = [
    {"d": 0.4, "a": 0.1, "alpha": 0.7},
    {"a": 0.5, "alpha": -1.1, "theta": 0.3, "kind": "prismatic"},
    {"d": 0.2, "a": 0.3, "alpha": 0.4},
]
SPATIAL_BODIES = [
    Body(1.5, (0.1, -0.2, 0.3), (0.3, 0.01, -0.02, 0.4, 0.03, 0.2)),
    Body(0.9, (-0.1, 0.05, 0.2), (0.1, -0.01, 0.02, 0.2, 0.01, 0.15)),
    Body(0.6, (0.2, 0.1, -0.1), (0.05, 0.004, 0.003, 0.06, -0.002, 0.04)),
]


@pytest.mark.slow
def test_lagranges_equations_of_a_spatial_arm() -> None:
    truth = lagrange(SPATIAL, SPATIAL_BODIES)
    arm = Robot.from_dh(SPATIAL, bodies=SPATIAL_BODIES)
    q, qd, qdd = states(arm, 30)
    expected = np.array([truth(*one) for one in zip(q, qd, qdd, strict=True)])
    assert np.abs(arm.inverse_dynamics(q, qd, qdd) - expected).max() < 1e-12


# Physical laws.

ARMS = {
    "spatial": Robot.from_dh(SPATIAL, bodies=SPATIAL_BODIES),
    "puma560": Robot.named("puma560"),
    "stanford": Robot.named("stanford"),
    "ur5": generic("ur5"),
    "panda": generic("panda"),
}


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_forces_are_sums_of_inertia_coriolis_and_gravity(arm: Robot) -> None:
    q, qd, qdd = states(arm, 40)
    mass, tau = arm.mass_matrix(q), arm.inverse_dynamics(q, qd, qdd)
    size = np.abs(tau).max()
    together = np.einsum("bij,bj->bi", mass, qdd) + arm.coriolis(q, qd) + arm.gravity(q)
    assert np.abs(tau - together).max() < 1e-14 * size
    assert np.array_equal(mass, np.swapaxes(mass, -1, -2))
    assert np.linalg.eigvalsh(mass).min() > 0
    assert np.abs(arm.forward_dynamics(q, qd, tau) - qdd).max() < 1e-9
    assert arm.kinetic_energy(q, qd) == pytest.approx(np.einsum("bi,bij,bj->b", qd, mass, qd) / 2, rel=1e-13)


def along(function: Any, q: np.ndarray, qd: np.ndarray, h: float = 2e-3) -> np.ndarray:
    """The derivative of a function along the motion, by differences of order 6."""
    weights = (3 / 4, -3 / 20, 1 / 60)
    terms = (w * (function(q + k * h * qd) - function(q - k * h * qd)) for k, w in enumerate(weights, 1))
    return sum(terms) / h


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_the_rate_of_the_mass_matrix_less_two_c_is_skew(arm: Robot) -> None:
    q, qd, _ = states(arm, 20)
    rate, c = along(arm.mass_matrix, q, qd), arm.coriolis_matrix(q, qd)
    skew = rate - 2 * c
    size = np.abs(c).max()
    assert np.abs(skew + np.swapaxes(skew, -1, -2)).max() < 1e-10 * size
    assert np.abs(np.einsum("bij,bj->bi", c, qd) - arm.coriolis(q, qd)).max() < 1e-13 * size
    # Christoffel's symbols are symmetric: C(q, u) v = C(q, v) u
    other = states(arm, 20, seed=5)[1]
    left = np.einsum("bij,bj->bi", c, other)
    right = np.einsum("bij,bj->bi", arm.coriolis_matrix(q, other), qd)
    assert np.abs(left - right).max() < 1e-13 * size


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_gravity_is_the_gradient_of_potential_energy_and_power_is_balanced(arm: Robot) -> None:
    q, qd, qdd = states(arm, 20)
    tau = arm.inverse_dynamics(q, qd, qdd)
    assert along(arm.potential_energy, q, qd) == pytest.approx((arm.gravity(q) * qd).sum(-1), abs=1e-9)
    h = 1e-3

    def energy(t: float) -> np.ndarray:
        x, v = q + t * qd + t * t / 2 * qdd, qd + t * qdd
        return arm.kinetic_energy(x, v) + arm.potential_energy(x)

    weights = (3 / 4, -3 / 20, 1 / 60)
    rate = sum(w * (energy(k * h) - energy(-k * h)) for k, w in enumerate(weights, 1)) / h
    assert rate == pytest.approx((tau * qd).sum(-1), rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("arm", [two_links(), Robot.named("ur5")], ids=["pendulum", "ur5"])
def test_energy_is_conserved(arm: Robot) -> None:
    """Energy is conserved in a second of free motion."""
    start = np.full(arm.n_joints, 0.4)
    q, qd = arm.simulate(start, 0 * start, 0.008, 125)
    energy = arm.kinetic_energy(q, qd) + arm.potential_energy(q)
    assert arm.kinetic_energy(q, qd).max() > 1
    assert np.abs(energy - energy[0]).max() < 1e-8


def test_work_of_forces_changes_the_energy() -> None:
    arm = two_links()

    def push(time: float, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        return np.array([3 * np.cos(time), -1.0]) - 0.5 * qd

    q, qd = arm.simulate([[0.1, 0.2], [0.5, -1.0]], np.zeros((2, 2)), 0.01, 100, push)
    assert q.shape == qd.shape == (101, 2, 2)
    power = np.array([(push(0.01 * k, q[k], qd[k]) * qd[k]).sum(-1) for k in range(101)])
    weights = np.tile([4.0, 2.0], 50)[:-1]
    work = 0.01 / 3 * (power[0] + power[-1] + (weights[:, None] * power[1:-1]).sum(0))
    energy = arm.kinetic_energy(q, qd) + arm.potential_energy(q)
    assert energy[-1] - energy[0] == pytest.approx(work, abs=1e-6)
    with pytest.raises(ArithmeticError, match="use a shorter step"):
        arm.simulate([0.1, 0.2], [40.0, -90.0], 0.3, 3)


def test_puma_equals_the_output_of_the_toolbox() -> None:
    """Gravity and the diagonal of the mass matrix with armature, at the nominal pose."""
    arm = Robot.named("puma560")
    qn = np.array([0, pi / 4, pi, 0, pi / 4, 0])
    assert arm.gravity(qn)[1:3] == pytest.approx((31.6399, 6.0351), abs=5e-5)
    assert np.diag(arm.mass_matrix(qn)) == pytest.approx((3.6594, 4.4137, 0.9378, 0.1925, 0.1713, 0.1942), abs=1e-4)
    without = replace(arm, armature=np.zeros(6))
    armature = np.diag(arm.mass_matrix(qn) - without.mass_matrix(qn))
    assert armature == pytest.approx((0.784, 2.325, 0.577, 0.191, 0.171, 0.194), abs=5e-4)


# Folded constants.


def chain_of(robot: Robot) -> robots.Chain:
    return robots.Chain(
        tuple(kind.value for kind in robot.kinds),
        robot.parents,
        tuple(tuple(map(float, row)) for row in robot.axes),
        robot.tip,
        tuple(map(float, robot.tool)),
        tuple(tuple(map(float, row)) for row in robot.bodies),
        tuple(map(float, robot.free_fall)),
        tuple(map(float, robot.armature)),
    )


def forked() -> Robot:
    """A tree with oblique axes, a prismatic joint in the middle, and rotors with inertia."""
    rng = np.random.default_rng(9)
    directions, points = rng.normal(size=(4, 3)), rng.normal(size=(4, 3))
    axes = pga3.line_from_direction_moment(directions, np.cross(points, directions))
    bodies = [Body(1.0, (0.1, 0.2, 0.3), (0.5, 0.1, 0.02, 0.6, 0.03, 0.4), 0.1 * k) for k in range(4)]
    kinds = ["revolute", "prismatic", "revolute", "revolute"]
    tool = pga3.motor_from_rotation_vector_translation([0.3, 0.2, 0.1], [0.5, 0.1, 0.7])
    return replace(Robot.from_screws(axes, tool, kinds, bodies=bodies), parents=(-1, 0, 1, 0), tip=2, tool=tool)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "robot"), [("spatial", ARMS["spatial"]), ("forked", forked())])
def test_folded_kernels_equal_the_generic_path(name: str, robot: Robot) -> None:
    chain, joints = chain_of(robot), ga.array(ga.SCALAR, len(robot.kinds))
    n = len(robot.kinds)

    @ga.kernel(q=joints, returns=ga.array(ga.SCALAR, 6, n))
    def jacobian(q):  # type: ignore[no-untyped-def]
        """Jacobian."""
        return robots.jacobian(chain, q)

    @ga.kernel(q=joints, qd=joints, qdd=joints, returns=joints)
    def inverse_dynamics(q, qd, qdd):  # type: ignore[no-untyped-def]
        """Forces."""
        return robots.inverse_dynamics(chain, q, qd, qdd)

    @ga.kernel(q=joints, returns=ga.array(ga.SCALAR, n, n))
    def mass_matrix(q):  # type: ignore[no-untyped-def]
        """Mass matrix."""
        return robots.mass_matrix(chain, q)

    q, qd, qdd = states(robot, 20)
    assert np.abs(ga.compile(jacobian, "arrays", effort=0)(q) - robot.jacobian(q)).max() < 1e-13
    forces = ga.compile(inverse_dynamics, "arrays", effort=0)(q, qd, qdd)
    assert np.abs(forces - robot.inverse_dynamics(q, qd, qdd)).max() < 1e-12
    assert np.abs(ga.compile(mass_matrix, "arrays", effort=0)(q) - robot.mass_matrix(q)).max() < 1e-13


@pytest.mark.parametrize("name", ["ur5", "panda"])
def test_named_robots_with_their_own_kernels(name: str) -> None:
    folded, plain = Robot.named(name), generic(name)
    assert folded.module is not None
    q, qd, qdd = states(plain, 50)
    tau = plain.inverse_dynamics(q, qd, qdd)
    assert np.abs(folded.pose(q) - plain.pose(q)).max() < 1e-14
    assert np.abs(folded.jacobian(q) - plain.jacobian(q)).max() < 1e-14
    assert np.abs(folded.mass_matrix(q) - plain.mass_matrix(q)).max() < 1e-13
    assert np.abs(folded.inverse_dynamics(q, qd, qdd) - tau).max() < 1e-12
    assert np.abs(folded.coriolis(q, qd) - plain.coriolis(q, qd)).max() < 1e-12
    assert np.abs(folded.forward_dynamics(q, qd, tau) - qdd).max() < 1e-9
    with pytest.raises(DescriptionError, match="belongs to another robot"):
        Robot.named("puma560").with_module(folded.module)


# Arguments.


def test_leading_axes_types_and_order() -> None:
    arm = generic("ur5")
    q, qd, qdd = (x.reshape(5, 8, 6) for x in states(arm, 40))
    tau = arm.inverse_dynamics(q, qd, qdd)
    assert tau.shape == (5, 8, 6) and arm.mass_matrix(q).shape == (5, 8, 6, 6)
    assert tau[2, 3] == pytest.approx(arm.inverse_dynamics(q[2, 3], qd[2, 3], qdd[2, 3]), abs=1e-12)
    assert np.array_equal(arm.inverse_dynamics(q, qd[0], qdd)[1], arm.inverse_dynamics(q[1], qd[0], qdd[1]))
    single = arm.inverse_dynamics(*(x.astype(np.float32) for x in (q, qd, qdd)))
    assert single.dtype == np.float32 and np.abs(single - tau).max() < 1e-3
    assert arm.inverse_dynamics(*np.empty((3, 0, 6))).shape == (0, 6)
    many = states(arm, 2100)
    assert np.array_equal(arm.inverse_dynamics(*many)[2050], arm.inverse_dynamics(*(x[2050] for x in many)))
    nan = arm.inverse_dynamics(np.full(6, np.nan), qd[0, 0], qdd[0, 0])
    assert np.isnan(nan[1:]).all()
    with pytest.raises(ValueError, match="leading axes that broadcast"):
        arm.inverse_dynamics(q, qd[:, :3], qdd)
    with pytest.raises(ValueError, match="6 joint variables"):
        arm.gravity(q[..., :5])


def test_missing_or_wrong_masses() -> None:
    with pytest.raises(MissingInertiaError, match="unknown masses"):
        Robot.named("iiwa").mass_matrix(np.zeros(7))
    with pytest.raises(JointCountError, match="1 bodies for 2 joints"):
        Robot.from_dh([{}, {}], bodies=[Body(1.0)])
    with pytest.raises(NotFiniteError, match="finite"):
        Body(float("nan"))
    with pytest.raises(DescriptionError, match="no negative"):
        Body(-1.0)
    with pytest.raises(DescriptionError, match="expected 3 and 6"):
        Body(1.0, (0.0, 0.0))
    weightless = Robot.from_dh([{"a": 1.0}, {}], bodies=[Body(1.0), Body(0.0)])
    assert np.isnan(weightless.forward_dynamics(np.zeros(2), np.zeros(2), np.ones(2))).any()


@pytest.mark.parametrize("arm", [*ARMS.values(), forked()], ids=[*ARMS, "forked"])
def test_derivatives_of_the_dynamics(arm: Robot) -> None:
    """Compare derivatives along random directions with finite differences."""
    q, qd, qdd = states(arm, 10)
    tau = arm.inverse_dynamics(q, qd, qdd)
    direction = states(arm, 10, seed=6)[0]
    by_q, by_qd = arm.inverse_dynamics_derivatives(q, qd, qdd)
    ahead = arm.forward_dynamics_derivatives(q, qd, tau)
    moves = (
        (by_q, along(lambda x: arm.inverse_dynamics(x, qd, qdd), q, direction)),
        (by_qd, along(lambda v: arm.inverse_dynamics(q, v, qdd), qd, direction)),
        (ahead[0], along(lambda x: arm.forward_dynamics(x, qd, tau), q, direction)),
        (ahead[1], along(lambda v: arm.forward_dynamics(q, v, tau), qd, direction)),
        (ahead[2], along(lambda f: arm.forward_dynamics(q, qd, f), tau, direction)),
    )
    for k, (matrix, slope) in enumerate(moves):
        found = np.einsum("bij,bj->bi", matrix, direction)
        assert np.abs(found - slope).max() < 1e-7 * np.abs(slope).max(), k


def test_scalar_inertia_is_exact_for_parallel_axes() -> None:
    arm = two_links()
    q, qd, _ = states(arm, 20)
    mass, coriolis, gravity = scalar_inertia_dynamics(arm, [I1, I2], q, qd)
    assert np.abs(mass - arm.mass_matrix(q)).max() < 1e-14
    assert np.abs(coriolis - arm.coriolis(q, qd)).max() < 1e-13
    assert np.abs(gravity - arm.gravity(q)).max() < 1e-13
    # otherwise gravity is exact, and the rest treats bodies as points and spheres that add up the rates of their joints
    arm = ARMS["panda"]
    q, qd, _ = states(arm, 20)
    points = replace(arm, bodies=np.hstack([arm.bodies[:, :4], np.zeros((7, 6))]))
    mass, coriolis, gravity = scalar_inertia_dynamics(arm, np.zeros(7), q, qd)
    assert np.abs(mass - points.mass_matrix(q)).max() < 1e-13
    assert np.abs(coriolis - points.coriolis(q, qd)).max() < 1e-12
    assert np.abs(gravity - arm.gravity(q)).max() < 1e-12
    assert np.abs(scalar_inertia_dynamics(arm, np.full(7, 0.1), q, qd)[0] - arm.mass_matrix(q)).max() > 0.1
    with pytest.raises(ValueError, match="one for each link"):
        scalar_inertia_dynamics(arm, [1.0], q, qd)
