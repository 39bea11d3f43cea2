"""Robots from URDF files against products of matrices and the same robots constructed directly."""

from __future__ import annotations

import os
from dataclasses import replace
from math import cos, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from algorithms.kinematics import (
    CyclicTreeError,
    DescriptionError,
    InertiaWarning,
    JointCountError,
    MissingInertiaError,
    NotFiniteError,
    Robot,
    UnknownJointTypeError,
)
from algorithms.kinematics.masses import fault_of
from generated import pga3
from tests.support.all_cases import all_cases

INERTIAL = """<inertial><origin xyz="0.1 -0.2 0.3" rpy="0.2 0.1 -0.4"/><mass value="1.5"/>
<inertia ixx="0.3" ixy="0.01" ixz="-0.02" iyy="0.4" iyz="0.03" izz="0.2"/></inertial>"""


def link(name: str, inside: str = INERTIAL) -> str:
    return f'<link name="{name}">{inside}</link>'


def joint(name: str, type_: str, parent: str, child: str, inside: str = "") -> str:
    return f'<joint name="{name}" type="{type_}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'


def place(xyz: str, rpy: str = "0 0 0") -> str:
    return f'<origin xyz="{xyz}" rpy="{rpy}"/>'


ARM = [
    link("base"),
    link("one"),
    link("two"),
    link("flange"),
    link("tool"),
    joint("a", "revolute", "base", "one", place("0.1 0.2 0.3", "0.4 -0.5 0.6") + '<axis xyz="0 2 0"/>'
          '<limit lower="-1" upper="2" velocity="3" effort="40"/>'),
    joint("b", "prismatic", "one", "two", place("0.5 0 -0.1", "-0.3 0.7 0.1") + '<axis xyz="1 1 0"/>'
          '<limit lower="0" upper="0.5" velocity="1" effort="9"/>'),
    joint("c", "continuous", "two", "flange", place("0 0.3 0.2") + '<axis xyz="0.2 -0.4 0.7"/>'),
    joint("d", "fixed", "flange", "tool", place("0 0 0.15", "0 0.5 1.5")),
]  # fmt: skip
FINGERS = [
    link("left"),
    link("right"),
    joint("left", "prismatic", "tool", "left", place("0 0.02 0.05") + '<axis xyz="0 1 0"/>'),
    joint("right", "prismatic", "tool", "right", place("0 -0.02 0.05") + '<axis xyz="0 -1 0"/>'
          '<mimic joint="left" multiplier="0.5" offset="0.01"/>'),
]  # fmt: skip


def written(folder: Path, parts: list[str]) -> Path:
    path = folder / "robot.urdf"
    path.write_text('<?xml version="1.0"?>\n<robot name="arm">' + "\n".join(parts) + "</robot>")
    return path


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rodrigues' formula as a 4 x 4 matrix."""
    x, y, z = axis / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = np.eye(4)
    matrix[:3, :3] += sin(angle) * k + (1 - cos(angle)) * k @ k
    return matrix


def shifted(v: np.ndarray) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = v
    return matrix


def origin(xyz: tuple[float, ...], rpy: tuple[float, ...] = (0, 0, 0)) -> np.ndarray:
    x, y, z = np.eye(3)
    return shifted(np.array(xyz)) @ about(z, rpy[2]) @ about(y, rpy[1]) @ about(x, rpy[0])


def poses(q: np.ndarray) -> dict[str, np.ndarray]:
    """The poses of the links of `ARM` and `FINGERS` by matrices."""
    one = origin((0.1, 0.2, 0.3), (0.4, -0.5, 0.6)) @ about(np.array([0.0, 1, 0]), q[0])
    two = one @ origin((0.5, 0, -0.1), (-0.3, 0.7, 0.1)) @ shifted(np.array([1, 1, 0]) / 2**0.5 * q[1])
    flange = two @ origin((0, 0.3, 0.2)) @ about(np.array([0.2, -0.4, 0.7]), q[2])
    found = {"base": np.eye(4), "one": one, "two": two, "flange": flange}
    found["tool"] = flange @ origin((0, 0, 0.15), (0, 0.5, 1.5))
    if len(q) > 3:
        found["left"] = found["tool"] @ origin((0, 0.02 + q[3], 0.05))
        found["right"] = found["tool"] @ origin((0, -0.02 - (0.5 * q[3] + 0.01), 0.05))
    return found


def test_an_arm_with_every_type_of_joint(tmp_path: Path) -> None:
    arm = Robot.from_urdf(written(tmp_path, ARM))
    assert arm.name == "arm" and arm.n_joints == 3 and arm.joint_names == ("a", "b", "c")
    assert np.array_equal(arm.limits[:, :2], [[-1, 2], [0, 0.5], [-np.inf, np.inf]])
    assert np.array_equal(arm.limits[:, 2:], [[3, 40], [1, 9], [np.inf, np.inf]])
    for q in np.random.default_rng(1).normal(size=(20, 3)):
        truth = poses(q)
        assert np.abs(arm.pose(q) - truth["tool"]).max() < 1e-14
        for name, pose in truth.items():
            assert np.abs(pga3.motor_to_matrix(arm.link(name, q)) - pose).max() < 1e-14
    with pytest.raises(DescriptionError, match="no link 'hand'"):
        arm.link("hand", np.zeros(3))


def test_masses_of_fixed_links_are_added_to_their_parents(tmp_path: Path) -> None:
    """Potential energy by the centres of all links; a locked link remains in place and keeps its weight."""
    path = written(tmp_path, ARM)
    arm, held = Robot.from_urdf(path), Robot.from_urdf(path, locked=["b"])
    q = np.array([0.3, 0.0, -0.8])
    centre = np.array([0.1, -0.2, 0.3, 1])
    height = sum((pose @ centre)[2] for name, pose in poses(q).items() if name != "base")
    assert arm.potential_energy(q) == pytest.approx(1.5 * 9.81 * height, abs=1e-12)
    assert held.n_joints == 2 and np.abs(held.pose(q[[0, 2]]) - arm.pose(q)).max() < 1e-15
    assert held.potential_energy(q[[0, 2]]) == pytest.approx(arm.potential_energy(q), abs=1e-12)
    mass = arm.mass_matrix(q)[np.ix_([0, 2], [0, 2])]
    assert np.abs(held.mass_matrix(q[[0, 2]]) - mass).max() < 1e-13


def test_a_tree_with_a_mimic_joint(tmp_path: Path) -> None:
    path = written(tmp_path, ARM + FINGERS)
    hand = Robot.from_urdf(path, tip="right")
    assert hand.n_joints == 4 and hand.joint_names == ("a", "b", "c", "left", "right") and len(hand.limits) == 4
    rng = np.random.default_rng(2)
    q, qd, qdd = rng.normal(size=(3, 6, 4))
    for one, pose, left in zip(q, hand.pose(q), hand.link("left", q), strict=True):
        assert np.abs(pose - poses(one)["right"]).max() < 1e-14
        assert np.abs(pga3.motor_to_matrix(left) - poses(one)["left"]).max() < 1e-14
    # Compare with a robot where the joint has a variable, with forces and rates mapped to it.
    loose = replace(hand, coupling=np.empty(0), limits=np.empty(0))
    follow = np.vstack([np.eye(4), [0, 0, 0, 0.5]])
    x, v, a = q @ follow.T + [0, 0, 0, 0, 0.01], qd @ follow.T, qdd @ follow.T
    assert np.abs(hand.jacobian(q) - loose.jacobian(x) @ follow).max() < 1e-14
    assert np.abs(hand.mass_matrix(q) - follow.T @ loose.mass_matrix(x) @ follow).max() < 1e-13
    assert np.abs(hand.inverse_dynamics(q, qd, qdd) - loose.inverse_dynamics(x, v, a) @ follow).max() < 1e-12
    tau = hand.inverse_dynamics(q, qd, qdd)
    assert np.abs(hand.forward_dynamics(q, qd, tau) - qdd).max() < 1e-11
    # by energies, which do not need the matrices of joints
    h = 1e-4
    ahead, behind = (hand.potential_energy(q + s * h * qd) for s in (1, -1))
    assert (ahead - behind) / (2 * h) == pytest.approx((hand.gravity(q) * qd).sum(-1), abs=1e-6)


def test_inverse_kinematics_of_a_link(tmp_path: Path) -> None:
    """Of a link before the end effector, which the last joint does not move."""
    arm = Robot.from_urdf(written(tmp_path, ARM), tip="tool")
    q = np.array([[0.3, 0.2, 0.5], [-0.4, 0.1, 0.0]])
    found = arm.inverse(arm.link("two", q), link="two")
    assert np.abs(arm.link("two", found.nearest) - arm.link("two", q)).max() < 1e-9
    assert np.abs(found.nearest[:, :2] - q[:, :2]).max() < 1e-8 and (found.nearest[:, 2] == 0).all()
    with pytest.raises(DescriptionError, match="no link 'three'"):
        arm.inverse(arm.forward(q), link="three")
    with pytest.raises(DescriptionError, match="'base' is fixed to the base"):
        arm.inverse(arm.forward(q), link="base")


def test_floating_and_planar(tmp_path: Path) -> None:
    free = Robot.from_urdf(written(tmp_path, ARM), base="euler")
    assert (
        type(free) is Robot
        and free.n_joints == 9
        and free.joint_names[:6] == tuple(f"base.{n}" for n in ("x", "y", "z", "yaw", "pitch", "roll"))
    )
    q = np.random.default_rng(3).normal(size=9)
    x, y, z = np.eye(3)
    base = shifted(q[:3]) @ about(z, q[3]) @ about(y, q[4]) @ about(x, q[5])
    assert np.abs(free.pose(q) - base @ poses(q[6:])["tool"]).max() < 1e-14
    # In free fall from rest no forces act.
    fall = np.zeros(9)
    fall[2] = -9.81
    assert np.abs(free.inverse_dynamics(q, np.zeros(9), fall)).max() < 1e-12
    assert np.trace(free.mass_matrix(q)[:3, :3]) == pytest.approx(3 * 5 * 1.5)
    slab = [link("base"), link("slab"), joint("p", "planar", "base", "slab", place("0 0 1") + '<axis xyz="0 0 1"/>')]
    plane = Robot.from_urdf(written(tmp_path, slab))
    assert plane.joint_names == ("p.x", "p.y", "p.turn")
    assert np.abs(plane.pose([0.3, 0.4, 0.5])[:3, 2] - z).max() < 1e-15
    assert np.abs(plane.pose([0.3, 0.4, 0.5])[:3, 3] - [0.3, 0.4, 1]).max() < 1e-15  # as in Pinocchio 4
    assert np.abs(plane.pose([0.3, 0.4, 0.5])[:3, 0] - [np.cos(0.5), np.sin(0.5), 0]).max() < 1e-15
    whole = joint("f", "floating", "base", "slab")
    assert Robot.from_urdf(written(tmp_path, [*slab[:2], whole])).n_joints == 6


def test_missing_inertia_is_reported_when_it_matters(tmp_path: Path) -> None:
    arm = Robot.from_urdf(written(tmp_path, [ARM[0], link("one", ""), *ARM[2:]]))
    assert arm.pose(np.zeros(3)).shape == (4, 4)
    for call in (arm.mass_matrix, arm.gravity, arm.potential_energy):
        with pytest.raises(MissingInertiaError, match="no inertia of one; expected one for every moving link"):
            call(np.zeros(3))
    half = link("one", '<inertial><mass value="1"/></inertial>')
    with pytest.raises(MissingInertiaError):
        Robot.from_urdf(written(tmp_path, [ARM[0], half, *ARM[2:]])).gravity(np.zeros(3))
    # the base, and links fixed to a link with mass, do not need inertia
    fine = [link("base", ""), *ARM[1:4], link("tool", ""), *ARM[5:]]
    assert Robot.from_urdf(written(tmp_path, fine)).gravity(np.zeros(3)).shape == (3,)


BAD = {
    "ring": ([link("a"), link("b"), joint("x", "revolute", "a", "b"), joint("y", "revolute", "b", "a")],
             CyclicTreeError, "every link is carried"),
    "ring beside a base": (
        [*map(link, "abc"), joint("x", "revolute", "a", "b"), joint("y", "revolute", "b", "a")],
        CyclicTreeError, "links a, b carry each other"),
    "two carriers": ([*map(link, "abc"), joint("x", "revolute", "a", "c"), joint("y", "revolute", "b", "c")],
                     CyclicTreeError, "link 'c' is carried by 'x' already"),
    "two bases": ([*map(link, "abc"), joint("x", "revolute", "a", "b")], DescriptionError, "expected one base"),
    "unknown type": ([*map(link, "ab"), joint("x", "helical", "a", "b")], UnknownJointTypeError, "type 'helical'"),
    "nothing moves": ([*map(link, "ab"), joint("x", "fixed", "a", "b")], JointCountError, "no moving joint"),
    "no axis": ([*map(link, "ab"), joint("x", "revolute", "a", "b", '<axis xyz="0 0 0"/>')],
                DescriptionError, "axis of length 0"),
    "unknown link": ([*map(link, "ab"), joint("x", "revolute", "a", "c")], DescriptionError, "child 'c' is no link"),
    "nan": ([*map(link, "ab"), joint("x", "revolute", "a", "b", place("0 nan 0"))], NotFiniteError, "xyz='0 nan 0'"),
    "no number": ([*map(link, "ab"), joint("x", "revolute", "a", "b", place("0 1 q"))], NotFiniteError, "3 numbers"),
    "two numbers": ([*map(link, "ab"), joint("x", "revolute", "a", "b", place("0 1"))], DescriptionError, "3 numbers"),
    "infinite mass": (
        [link("a", INERTIAL.replace("1.5", "inf")), link("b"), joint("x", "revolute", "a", "b")],
        NotFiniteError, "link 'a': value='inf'"),
    "negative mass": ([link("a", INERTIAL.replace("1.5", "-1")), link("b"), joint("x", "revolute", "a", "b")],
                      DescriptionError, "mass -1.0"),
    "no mass": ([link("a", INERTIAL.replace('value="1.5"', "")), link("b"), joint("x", "revolute", "a", "b")],
                DescriptionError, "link 'a': no value; expected a number"),
    "half a tensor": ([link("a", INERTIAL.replace('izz="0.2"', "")), link("b"), joint("x", "revolute", "a", "b")],
                      DescriptionError, "no izz"),
    "negative inertia": ([link("a", INERTIAL.replace("0.4", "-0.4")), link("b"), joint("x", "revolute", "a", "b")],
                         DescriptionError, "expected no negative mass, ixx, iyy, izz"),
    "reversed limits": (
        [*map(link, "ab"), joint("x", "revolute", "a", "b", '<limit lower="1" upper="-1"/>')],
        DescriptionError, "joint 'x': limits 1.0 to -1.0"),
    "nan as a limit": (
        [*map(link, "ab"), joint("x", "revolute", "a", "b", '<limit lower="nan" upper="1"/>')],
        NotFiniteError, "lower='nan'"),
    "negative speed": (
        [*map(link, "ab"), joint("x", "continuous", "a", "b", '<limit velocity="-2" effort="1"/>')],
        DescriptionError, "joint 'x': velocity -2.0; expected a limit that is not negative"),
    "effort of minus infinity": (
        [*map(link, "ab"), joint("x", "prismatic", "a", "b", '<limit upper="1" effort="-inf"/>')],
        DescriptionError, "joint 'x': effort -inf"),
    "mimic of nothing": (
        [*map(link, "ab"), joint("x", "revolute", "a", "b", '<mimic joint="z"/>')], DescriptionError, "mimics 'z'"),
    "mimic of itself": (
        [*map(link, "ab"), joint("x", "revolute", "a", "b", '<mimic joint="x"/>')], CyclicTreeError, "each other"),
    "links of one name": ([link("a"), link("a")], DescriptionError, "two links 'a'"),
    "joints of one name": ([*map(link, "abc"), joint("x", "revolute", "a", "b"), joint("x", "revolute", "b", "c")],
                           DescriptionError, "two joints 'x'"),
    "no link": ([], DescriptionError, "no link"),
}  # fmt: skip


@all_cases("parts, error, message", BAD.values())
def test_invalid_files(parts: list[str], error: type[DescriptionError], message: str, tmp_path: Path) -> None:
    with pytest.raises(error, match=message) as caught:
        Robot.from_urdf(written(tmp_path, parts))
    assert "robot.urdf" in str(caught.value) and isinstance(caught.value, ValueError)


def test_the_end_effector_moves_if_anything_does(tmp_path: Path) -> None:
    """A sensor on the base is further away, by fixed joints, than the moving links."""
    parts = [
        *map(link, ("base", "plate", "imu", "one", "two")),
        joint("weld", "fixed", "base", "plate"),
        joint("glue", "fixed", "plate", "imu", place("1 0 0")),
        joint("a", "continuous", "base", "one", place("0 2 0")),
        joint("b", "continuous", "base", "two", place("0 3 0")),
    ]
    robot = Robot.from_urdf(written(tmp_path, parts))
    assert robot.tip == 0 and robot.pose([0.0, 0.0])[:3, 3].tolist() == [0, 2, 0]
    assert Robot.from_urdf(written(tmp_path, parts), tip="two").tip == 1
    with pytest.raises(DescriptionError, match="link 'imu' does not move"):
        Robot.from_urdf(written(tmp_path, parts), tip="imu")
    assert Robot.from_urdf(written(tmp_path, parts), base="floating").tip == 0  # a robot whose joints all move


def test_texts_and_macros(tmp_path: Path) -> None:
    path = written(tmp_path, ARM)
    text = path.read_text()
    found, same = Robot.from_urdf(text), Robot.from_urdf(path)
    assert found.name == same.name and np.array_equal(found.axes, same.axes)
    with pytest.raises(DescriptionError, match="text: <mujoco>; expected <robot>"):
        Robot.from_urdf("<mujoco/>")
    with pytest.raises(DescriptionError, match="<xacro:arm>: no such macro"):
        Robot.from_urdf('<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arm/></robot>')


@pytest.mark.parametrize("wrong", [5, 0, True, None, 2.5, b"robot.urdf", ["robot.urdf"]])
def test_invalid_file_names_are_not_opened(wrong: Any, tmp_path: Path) -> None:
    held = os.open(written(tmp_path, ARM), os.O_RDONLY)
    try:
        for path in (wrong, held):
            with pytest.raises(TypeError, match=r"path: .*; expected the name of a file, a Path, or a text"):
                Robot.from_urdf(path)
        assert os.lseek(held, 0, os.SEEK_CUR) == 0
    finally:
        os.close(held)


NO_BODY = {
    "not positive": ("1", "5", "1", "1", "a principal moment of inertia is negative"),
    "not positive, by a little": ("1", "1.001", "1", "1", "a principal moment of inertia is negative"),
    "more than the others": ("1", "0", "1", "3", "larger than the sum of the two others"),
    "one moment alone": ("0.1", "0", "0", "0", "larger than the sum of the two others"),
    "products alone": ("0", "0.1", "0", "0", "a principal moment of inertia is negative"),
}


@pytest.mark.parametrize(("xx", "xy", "yy", "zz", "reason"), NO_BODY.values(), ids=NO_BODY)
def test_impossible_moments_of_inertia(xx: str, xy: str, yy: str, zz: str, reason: str, tmp_path: Path) -> None:
    inside = (
        f'<inertial><mass value="1"/><inertia ixx="{xx}" ixy="{xy}" ixz="0" iyy="{yy}" iyz="0" izz="{zz}"/></inertial>'
    )
    path = written(tmp_path, [*ARM[:2], link("two", inside), *ARM[3:]])
    with pytest.warns(InertiaWarning, match=f"robot.urdf: link 'two': .*{reason}") as caught:
        Robot.from_urdf(path)
    assert len(caught) == 1 and caught[0].filename == __file__


def test_possible_moments_of_inertia(tmp_path: Path) -> None:
    """Bodies of random points; rods and plates, which are at the limit, as decimals; points without inertia."""
    rng = np.random.default_rng(11)
    for thickness in (1.0, 1e-3, 0.0):
        points = rng.normal(size=(20, 3)) * [1, 1, thickness]
        t = (points**2).sum() * np.eye(3) - points.T @ points
        turn = pga3.rotor_to_matrix(pga3.rotor_from_rotation_vector(rng.normal(size=3)))
        assert fault_of((turn @ t @ turn.T)[np.triu_indices(3)]) == ""
    rod = (1 / 12, 0, 0, 1 / 12, 0, 0)
    plate = (round(1 / 12, 8), 0, 0, round(1 / 12, 8), 0, round(1 / 6, 8))
    for tensor in (rod, plate, (0.0,) * 6, (1e-300, 0, 0, 1e-300, 0, 1e-300), (1e300, 0, 0, 1e300, 0, 1e300)):
        assert fault_of(tensor) == ""


HUGE = {
    "place": ([link("base"), link("one", ""), joint("a", "revolute", "base", "one", place("1e308 0 0"))],
              "link 'one': its place"),
    "places": ([*ARM[:7], joint("c", "fixed", "two", "flange", place("1e308 0 0")),
                joint("d", "fixed", "flange", "tool", place("1e308 0 0"))], "link 'flange': its place"),
    "turned": ([*ARM[:5], joint("a", "revolute", "base", "one", place("1e308 1e308 1e308", "1 2 3")), *ARM[6:]],
               "link 'one': its place"),
    "inertia": ([ARM[0], link("one", INERTIAL.replace('xyz="0.1', 'xyz="1e200')), *ARM[2:]], "link 'one': its inertia"),
    "mass": ([ARM[0], link("one", INERTIAL.replace("1.5", "1e308")), *ARM[2:]], "link 'one': its inertia"),
}  # fmt: skip


@pytest.mark.parametrize(("parts", "message"), HUGE.values(), ids=HUGE)
def test_lengths_and_masses_without_bounds(parts: list[str], message: str, tmp_path: Path) -> None:
    with pytest.raises(NotFiniteError, match=rf"robot.urdf: ({message}) has numbers beyond 1e.154"):
        Robot.from_urdf(written(tmp_path, parts))


def test_a_robot_far_from_the_root_of_its_file(tmp_path: Path) -> None:
    """Inertias are joined and summed near the robot, not at the origin."""
    weld = joint("weld", "fixed", "world", "base", place("6e5 -4.8e5 6.4e5"))
    far = Robot.from_urdf(written(tmp_path, [link("world", ""), weld, *ARM]))
    arm = Robot.from_urdf(written(tmp_path, ARM))
    q, qd, qdd = np.random.default_rng(14).normal(size=(3, 10, 3))
    assert np.abs(far.inverse_dynamics(q, qd, qdd) - arm.inverse_dynamics(q, qd, qdd)).max() < 1e-7
    assert np.abs(far.mass_matrix(q) - arm.mass_matrix(q)).max() < 1e-8


def test_limits_of_fixed_joints_are_ignored(tmp_path: Path) -> None:
    left = '<limit lower="1" upper="-1" velocity="-1" effort="nan"/>'
    parts = [*map(link, "abc"), joint("x", "fixed", "a", "b", left), joint("y", "revolute", "b", "c")]
    assert Robot.from_urdf(written(tmp_path, parts)).n_joints == 1


def test_limits_may_be_infinite_and_one_joint_locked_by_its_name(tmp_path: Path) -> None:
    limit = '<limit lower="-inf" upper="inf" velocity="inf" effort="3"/>'
    parts = [*map(link, "abc"), joint("xx", "revolute", "a", "b", limit), joint("yy", "revolute", "b", "c")]
    assert Robot.from_urdf(written(tmp_path, parts)).limits[0].tolist() == [-np.inf, np.inf, np.inf, 3.0]
    assert Robot.from_urdf(written(tmp_path, parts), locked="xx").joint_names == ("yy",)


def test_a_chain_may_be_longer_than_the_recursion_limit(tmp_path: Path) -> None:
    n = 1200
    parts = [link(f"l{k}", "") for k in range(n + 1)]
    parts += [joint(f"j{k}", "fixed" if k % 100 else "revolute", f"l{k}", f"l{k + 1}") for k in range(n)]
    assert Robot.from_urdf(written(tmp_path, parts)).n_joints == 12


def test_other_errors(tmp_path: Path) -> None:
    path = written(tmp_path, ARM)
    with pytest.raises(DescriptionError, match="no link 'hand'"):
        Robot.from_urdf(path, tip="hand")
    with pytest.raises(DescriptionError, match="link 'base' does not move"):
        Robot.from_urdf(path, tip="base")
    with pytest.raises(DescriptionError, match="no joint 'z' to lock"):
        Robot.from_urdf(path, locked=["z"])
    with pytest.raises(ValueError, match="'fixed', 'floating' or 'euler'"):
        Robot.from_urdf(path, base="loose")
    with pytest.raises(FileNotFoundError):
        Robot.from_urdf(tmp_path / "none.urdf")
    for text, message in (("<robot", "not XML"), ("<model/>", "expected <robot>")):
        (tmp_path / "bad.urdf").write_text(text)
        with pytest.raises(DescriptionError, match=message):
            Robot.from_urdf(tmp_path / "bad.urdf")
    with pytest.raises(ValueError, match="3 joint variables"):
        Robot.from_urdf(path).pose(np.zeros(4))
