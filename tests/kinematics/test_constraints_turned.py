"""Constraints of linkages in planes that are not aligned with the axes, against the equations of motion."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from algorithms.kinematics import Constrained, Constraint, ConstraintStatus, DescriptionError, Robot, contacts
from generated import pga3
from tests.support.described_robots import bar, body, described, turning

OK, REDUNDANT, CONTRADICTORY, _, _ = ConstraintStatus
Y = [0.0, 1, 0]


def scales(count: int) -> Iterator[tuple[np.random.Generator, float, list[float], np.ndarray]]:
    """Lengths and masses from 1e-3 to 1e3, and poses of the base."""
    rng = np.random.default_rng(5)
    for _ in range(count):
        length = float(10 ** rng.uniform(-3, 3))
        base = pga3.motor_from_rotation_vector_translation(rng.normal(size=3), length * rng.normal(size=3))
        yield rng, length, [float(x) for x in 10 ** rng.uniform(-3, 3, 3)], base


def linkage(length: float, masses: list[float], base: str = '<link name="base"/>') -> str:
    """Two cranks and a coupler in one plane, all of the same length."""
    names = "crank", "coupler", "rocker"
    return described(
        base, *(bar(name, mass, length) for name, mass in zip(names, masses, strict=True)),
        turning("a", "base", "crank", "0 0 0"), turning("b", "crank", "coupler", f"{length} 0 0"),
        turning("c", "base", "rocker", f"{length} 0 0"),
    )  # fmt: skip


def loops(length: float) -> tuple[Constraint, Constraint]:
    """Return the point and the hinge that close the linkage."""
    place = [length, 0, 0]
    return (
        contacts.point("rocker", place, other="coupler", target=place),
        contacts.hinge("rocker", place, axis=Y, other_axis=Y, other="coupler", target=place),
    )


def arm(length: float, masses: list[float], base: np.ndarray) -> Robot:
    """Three bars in one plane, in sequence."""
    parts = [bar(f"l{k}", mass, length) for k, mass in enumerate(masses)]
    joints = [turning(f"j{k}", f"l{k - 1}", f"l{k}", f"{length} 0 0") for k in (1, 2)]
    first = turning("j0", "base", "l0", "0 0 0")
    return Robot.from_urdf(described('<link name="base"/>', *parts, first, *joints)).with_base(base)


def tip_of(robot: Robot, q: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the end of the last bar, and the normal of the plane."""
    pose = pga3.motor_to_matrix(robot.link("l2", q))
    return pose[:3, 3] + length * pose[:3, 0], pose[:3, 1]


def assert_solves(
    robot: Robot, held: list[Constraint], q: np.ndarray, qd: np.ndarray, rank: int, frequency: float = 0.0
) -> None:
    """Compare with the pseudo-inverse of the rows, in coordinates in which the kinetic energy is a sum of squares."""
    closed = Constrained(robot, held)
    root = np.linalg.cholesky(robot.mass_matrix(q))
    rows = np.linalg.solve(root, closed.matrix(q).T).T
    left, sizes, right = np.linalg.svd(rows)
    inverse = (right[:rank].T / sizes[:rank]) @ left[:, :rank].T
    qd = np.linalg.solve(root.T, root.T @ qd - inverse @ (rows @ (root.T @ qd)))  # the links move as they are held
    still = np.zeros(robot.n_joints)
    free = np.linalg.solve(root, -robot.inverse_dynamics(q, qd, still))
    wanted = closed.accelerations(q, qd, still) + frequency * (2 * closed.matrix(q) @ qd + frequency * closed.errors(q))
    steps = inverse @ (wanted + rows @ free)
    found = closed.forward_dynamics(q, qd, still, frequency=frequency)
    expected = OK if rank == len(rows) else REDUNDANT
    assert found.status == expected
    assert np.linalg.norm(root.T @ found.result - (free - steps)) < 1e-9 * np.linalg.norm(free)
    forces = -inverse.T @ steps
    assert np.linalg.norm(found.forces - forces) <= 1e-9 * max(np.linalg.norm(forces), np.linalg.norm(free) / sizes[0])
    after, before = closed.impact(q, qd + 1), root.T @ (qd + 1)
    assert after.status == expected
    assert np.linalg.norm(root.T @ after.result - before + inverse @ (rows @ before)) < 1e-9 * np.linalg.norm(before)


def test_closed_linkages_in_any_plane() -> None:
    """One force of three, and all torques of a hinge, are along or about directions that no joint moves."""
    for rng, length, masses, base in scales(8):
        robot, (loop, hinge) = Robot.from_urdf(linkage(length, masses)).with_base(base), loops(length)
        q = rng.uniform(0.5, 2.5) * np.array([1, -1, 1])
        for qd in (np.zeros(3), q):
            for held in ([loop], [hinge], [hinge, loop]):
                assert_solves(robot, held, q, qd, 2, frequency=2.0)
        driven = Constrained(robot, hinge, passive=("b", "c"))
        torques = driven.inverse_dynamics(q, np.zeros(3), np.zeros(3))
        assert torques.status == REDUNDANT and not torques.result[1:].any()
        # three bars are carried at the crank, whose ends move alike
        up = pga3.motor_to_matrix(base)[2, :3] @ [-np.sin(q[0]), 0, np.cos(q[0])]
        expected = 9.81 * length * up * (masses[0] / 2 + masses[1] + masses[2] / 2)
        assert torques.result[0] == pytest.approx(expected, rel=1e-9, abs=1e-9 * 9.81 * length * sum(masses))


def test_linkages_on_a_floating_base() -> None:
    """The same wherever it is, also if the base is held by the ground."""
    for rng, length, masses, base in scales(6):
        mass = masses[0]
        trunk = body("base", mass, "0 0 0", (mass * length**2,) * 3)
        robot, (loop, hinge) = Robot.from_urdf(linkage(length, masses, trunk), base="floating"), loops(length)
        away = base.copy()
        away[4:] *= 1000
        qd = np.concatenate([rng.normal(size=3), length * rng.normal(size=3), rng.normal(size=3)])
        for pose in (base, away):
            q = np.concatenate([pose, rng.uniform(0.5, 2.5) * np.array([1, -1, 1])])
            for held, rank in (([loop], 2), ([hinge], 2), ([hinge, contacts.weld("base")], 8)):
                assert_solves(robot, held, q, qd, rank)


def test_contacts_of_tilted_arms() -> None:
    """The ground, whose axes are not those of the plane, holds a bar by points, a hinge or a sole."""
    for rng, length, masses, base in scales(8):
        robot, q, place = arm(length, masses, base), rng.uniform(0.5, 1.5, 3), [length, 0, 0]
        tip, normal = tip_of(robot, q, length)
        for qd in (np.zeros(3), rng.normal(size=3)):
            for held, rank in (
                (contacts.point("l2", place, target=tip), 2),
                (contacts.point("l2", place, directions=[normal]), 0),
                (contacts.point("l2", place, directions=[normal, rng.normal(size=3)]), 1),
                (contacts.hinge("l2", place, axis=Y, other_axis=normal, target=tip), 2),
                (contacts.weld("l2"), 3),
            ):
                assert_solves(robot, [held], q, qd, rank)


def status_of(robot: Robot, q: np.ndarray, length: float, *targets: np.ndarray) -> int:
    """Return the status at rest, with errors corrected ten times faster than the links swing."""
    held = [contacts.point("l2", [length, 0, 0], target=target) for target in targets]
    frequency, still = 10 * np.sqrt(9.81 / length), np.zeros(3)
    return int(Constrained(robot, held).forward_dynamics(q, still, still, frequency=frequency).status)


def test_contradictions_in_any_plane() -> None:
    """An error along the normal of the plane cannot be corrected, nor can two targets be reached; rounding can."""
    for rng, length, masses, base in scales(6):
        robot, q = arm(length, masses, base), rng.uniform(0.5, 1.5, 3)
        tip, normal = tip_of(robot, q, length)
        other = tip + 0.01 * length * rng.normal(size=3)
        assert status_of(robot, q, length, tip) == status_of(robot, q, length, tip, tip) == REDUNDANT
        assert status_of(robot, q, length, tip + 0.01 * length * normal) == CONTRADICTORY
        assert status_of(robot, q, length, tip, other) == CONTRADICTORY


def test_nothing_falls_along_a_row_that_no_joint_moves() -> None:
    """Without gravity and speed, the drift of a dependent row is a rounding error of other sizes than itself."""
    for rng, length, masses, base in scales(6):
        robot = arm(length, masses, base).with_gravity([0, 0, 0])
        q = rng.uniform(0.5, 1.5, 3)
        _, normal = tip_of(robot, q, length)
        held = Constrained(robot, contacts.point("l2", [length, 0, 0], directions=[normal]))
        qd = rng.normal(size=3)
        found = held.forward_dynamics(q, qd, robot.inverse_dynamics(q, qd, np.zeros(3)))
        assert found.status == REDUNDANT and not found.forces.any()


def test_torques_of_welds() -> None:
    """They are about the axes of the target, or of the other link: the moment of a body about a turned sole."""
    mass, rng = 3.0, np.random.default_rng(6)
    block = Robot.from_urdf(described(body("block", mass, "0.1 0.2 0.3", (0.1, 0.2, 0.3))), base="floating")
    frame, q = (pga3.normalize_motor(rng.normal(size=8)) for _ in range(2))
    target = pga3.motor_product(q, frame)
    place, axes = (pga3.motor_to_matrix(target)[:3, k] for k in (3, slice(0, 3)))
    centre = pga3.move_point(q, [0.1, 0.2, 0.3])
    moment = np.cross(centre - place, [0, 0, mass * 9.81])
    for held, expected in (
        (contacts.weld("block", frame), moment),
        (contacts.weld("block", frame, target=target), axes.T @ moment),
    ):
        closed = Constrained(block, held)
        found = closed.forward_dynamics(q, np.zeros(6), np.zeros(6))
        assert found.status == OK and np.allclose(found.forces, [0, 0, mass * 9.81, *expected], atol=1e-11)
    # Half a turn about an axis of the sole, which is no error.
    turned = pga3.motor_from_rotation_vector_translation([0, np.pi, 0], [0, 0, 0])
    place = pga3.motor_product(pga3.motor_product(target, turned), pga3.motor_inverse(frame))
    assert np.abs(closed.errors(place)).max() < 1e-12 and np.abs(closed.errors(q)).max() < 1e-12
    assert np.linalg.norm(place - q) > 0.5 < np.linalg.norm(place + q)


def gripper(ratio: float) -> Robot:
    """Two fingers, of which the second follows the first."""
    joint = '<joint name="{0}" type="prismatic"><parent link="base"/><child link="{1}"/><axis xyz="0 0 1"/>{2}</joint>'
    return Robot.from_urdf(described(
        '<link name="base"/>', *(body(name, 1.0, "0 0 0", (1, 1, 1)) for name in ("left", "right")),
        joint.format("l", "left", ""), joint.format("r", "right", f'<mimic joint="l" multiplier="{ratio}"/>'),
    ))  # fmt: skip


def test_followers_are_not_passive() -> None:
    """The motor of the joint that leads moves them; if both positions are equal, either may lead."""
    held = contacts.point("left", directions=[[0, 0, 1]])
    q, still = np.array([0.1]), np.zeros(1)

    def forces(ratio: float, *passive: str) -> np.ndarray:
        found = Constrained(gripper(ratio), held, passive=passive).inverse_dynamics(q, still, still)
        return np.array([*found.result, *found.forces])

    weight = 9.81 * 0.5
    assert np.allclose(forces(-0.5, "r"), [weight, 0])
    assert np.allclose(forces(-0.5, "l"), [0, weight]) and np.allclose(forces(-0.5, "l", "r"), [0, weight])
    assert np.allclose(forces(1.0, "l", "r"), [0, 4 * weight])
    for name in "lr":
        with pytest.raises(DescriptionError, match="l, r have the same position"):
            Constrained(gripper(1.0), held, passive=(name,))
