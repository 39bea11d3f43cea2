"""A changed robot computes with its new parameters: every change, for every method, with specialised kernels."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from math import cos, pi, sin
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from algorithms.kinematics import Body, DescriptionError, MissingInertiaError, Robot, Status
from algorithms.kinematics.denavit_hartenberg import Joint
from gacompiler.generation.compiling import compile_spec
from gacompiler.generation.files import write
from gacompiler.generation.rendering import render
from gacompiler.generation.spec_files import load_spec
from gacompiler.robots.descriptions import robot_spec
from gacompiler.runtime import load_module
from generated import pga3, ur5

METHODS = (
    *(("forward", 1), ("forward_all", 1), ("pose", 1), ("jacobian", 1), ("jacobian_rate", 2), ("velocity", 2)),
    *(("acceleration", 3), ("manipulability", 1), ("twists_of_joints", 1), ("inverse_dynamics", 3), ("gravity", 1)),
    *(("coriolis", 2), ("coriolis_matrix", 2), ("mass_matrix", 1), ("forward_dynamics", 3), ("kinetic_energy", 2)),
    *(("potential_energy", 1), ("inverse_dynamics_derivatives", 3), ("forward_dynamics_derivatives", 3)),
    *(("inverse_mass_matrix", 1), ("torque_regressor", 3), ("centre_of_mass", 1), ("centroidal_momentum", 2)),
    ("centroidal_momentum_matrix", 1),
)
TOOL = pga3.motor_from_rotation_vector_translation([0.3, -0.2, 0.5], [0.05, 0.1, 0.2])
BASE = pga3.motor_from_rotation_vector_translation([1.0, 0.4, -0.7], [0.3, -0.8, 0.5])
NEARBY = np.array([1, 0, 0, 0, 1e-3, -2e-3, 3e-3, 0])
SLIDE = Joint.PRISMATIC

CHANGES: dict[str, tuple[Callable[[Robot], Robot], str]] = {
    "tool": (lambda r: r.with_tool(TOOL), "forward pose jacobian acceleration"),
    "base": (lambda r: r.with_base(BASE), "forward forward_all jacobian gravity inverse_dynamics twists_of_joints"),
    "gravity": (lambda r: r.with_gravity((1.0, 2.0, 9.81)), "gravity inverse_dynamics forward_dynamics"),
    "payload": (lambda r: r.with_payload(5.0, (0, 0, 0.1), (0.1, 0, 0, 0.2, 0, 0.3)), "gravity mass_matrix coriolis"),
    "armature": (lambda r: r.with_armature(np.full(r.n_joints, 0.5)), "mass_matrix forward_dynamics kinetic_energy"),
    "replaced tool": (lambda r: replace(r, tool=pga3.motor_product(r.tool, TOOL)), "forward jacobian"),
    "replaced tip": (lambda r: replace(r, tip=3, tool=r.home[3]), "forward jacobian velocity"),
    "replaced gravity": (lambda r: replace(r, free_fall=-r.free_fall), "gravity potential_energy"),
    "replaced bodies": (lambda r: replace(r, bodies=1.001 * r.bodies), "gravity mass_matrix"),
    "replaced armature": (lambda r: replace(r, armature=np.full(r.n_joints, 1e-6)), "mass_matrix"),
    "replaced axes": (lambda r: replace(r, axes=pga3.move_line(NEARBY, r.axes)), "jacobian pose mass_matrix"),
    "replaced parents": (lambda r: replace(r, parents=(-1, 0, 1, 2, 3, *range(3, r.n_joints - 2))), "mass_matrix"),
    "replaced kinds": (lambda r: replace(r, kinds=(*r.kinds[:-1], SLIDE)), "forward jacobian mass_matrix"),
}
"""Changes, and methods whose results they must affect."""


def largest(found: Any, expected: Any) -> float:
    pairs = zip(found, expected, strict=True) if isinstance(expected, tuple) else [(found, expected)]
    return max(float(np.abs(a - b).max() / max(1.0, np.abs(b).max())) for a, b in pairs)


@pytest.mark.slow
@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("name", ["ur5", "panda"])
def test_every_change_reaches_every_method(name: str, change: str) -> None:
    robot = Robot.named(name)
    make, seen = CHANGES[change]
    changed = make(robot)
    plain = replace(changed, module=None)
    rows = np.random.default_rng(3).uniform(-1.5, 1.5, (3, 4, robot.n_joints))
    for method, count in METHODS:
        expected = getattr(plain, method)(*rows[:count])
        assert largest(getattr(changed, method)(*rows[:count]), expected) < 1e-11, method
        one = getattr(changed, method)(*rows[:count, 0])
        first = tuple(part[0] for part in expected) if isinstance(expected, tuple) else expected[0]
        assert largest(one, first) < 1e-11, method
        if method in seen.split():
            assert largest(expected, getattr(robot, method)(*rows[:count])) > 1e-9, method


def test_kernels_that_each_method_uses() -> None:
    robot = Robot.named("ur5")
    moves, forces = {"forward", "pose", "jacobian"}, {"inverse_dynamics"}

    def own(changed: Robot) -> set[str]:
        assert set(changed.uses) >= moves | forces | {"mass_matrix"}
        return {m for m in moves | forces | {"mass_matrix"} if changed.uses[m] == "generated.ur5"}

    everything = moves | forces | {"mass_matrix"}
    assert set(robot.uses) >= {name for name, _ in METHODS}
    assert own(robot) == everything == own(robot.with_limits(np.tile([-1.0, 1.0], (6, 1))))
    assert own(robot.with_tool(TOOL)) == forces | {"mass_matrix"}
    assert own(robot.with_gravity((0, 0, -1.62))) == moves | {"mass_matrix"}
    assert own(robot.with_payload(5.0)) == moves == own(robot.with_armature(np.ones(6)))
    assert own(robot.with_base(BASE)) == set() == own(replace(robot, module=None))
    assert robot.with_gravity((0, 0, -1.62)).uses["gravity"] == "generated.robots"
    assert robot.uses["manipulability"] == "generated.ur5" and robot.uses["acceleration"] == "generated.robots"
    # a robot with coupled joints has variables that no kernel of the module has
    coupled = replace(robot, coupling=np.eye(6, 7), limits=np.empty(0))
    assert set(coupled.uses.values()) == {"generated.robots"}
    q = np.linspace(-1, 1, 6)
    assert largest(coupled.mass_matrix(q), robot.mass_matrix(q)) < 1e-14
    # a change that is reverted
    assert own(robot.with_gravity((0, 0, 9.81)).with_gravity((0, 0, -9.81))) == everything
    assert own(robot.with_tool(TOOL).with_tool(pga3.motor_inverse(TOOL))) == everything


def test_modules_of_other_robots_are_rejected() -> None:
    robot = Robot.named("ur5")
    lighter = replace(robot, bodies=robot.bodies - np.eye(1, 10) * 0.001)
    cases = {
        "bodies": (robot.with_payload(5.0), lighter, replace(robot, bodies=robot.bodies + np.eye(6, 10, 9) * 1e-9)),
        "tool": (robot.with_tool(TOOL), replace(robot, tip=4)),
        "gravity": (robot.with_gravity((0, 0, -9.81 + 1e-9)),),
        "armature": (robot.with_armature([0, 0, 0, 0, 0, 1e-9]),),
        "axes": (robot.with_base(BASE),),
        "joints": (replace(robot, kinds=(*robot.kinds[:-1], SLIDE)),),
    }
    for part, others in cases.items():
        for other in others:
            with pytest.raises(DescriptionError, match=rf"ur5: module generated.ur5 belongs .*: different .*{part}"):
                other.with_module(ur5)
            assert other.uses["inverse_dynamics"] == "generated.robots" or part == "tool"
    unsigned = SimpleNamespace(__name__="old", forward=ur5.forward, jacobian=ur5.jacobian)
    with pytest.raises(DescriptionError, match="module old belongs to another robot: different axes, joints, tool"):
        robot.with_module(unsigned)
    assert replace(robot, module=unsigned).uses["forward"] == "generated.robots"
    for wrong in (None, 5, "ur5", np):
        with pytest.raises(TypeError, match=r"ur5: module .*; expected a module written by gac robot"):
            robot.with_module(wrong)


def test_digests_are_read_without_docstrings() -> None:
    code = "from algorithms.kinematics import Robot; print(Robot.named('ur5').uses['forward'], Robot.named.__doc__)"
    done = subprocess.run([sys.executable, "-OO", "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["generated.ur5", "None"]


@pytest.mark.parametrize("name", ["ur5", "panda"])
def test_digests_do_not_depend_on_the_last_digit(name: str) -> None:
    """Another processor or math library may round it differently."""
    robot, rng = Robot.named(name), np.random.default_rng(10)
    for _ in range(20):

        def nudged(a: np.ndarray) -> np.ndarray:
            return a + rng.uniform(-3, 3, a.shape) * np.spacing(np.maximum(np.abs(a), 0.1))

        fields = {part: nudged(getattr(robot, part)) for part in ("axes", "tool", "bodies")}
        assert replace(robot, **fields).uses == robot.uses
        assert replace(robot, **fields, module=None).with_module(robot.module).uses == robot.uses


@pytest.mark.parametrize("name", ["ur5", "panda"])
def test_inverse_kinematics_of_changed_robots(name: str) -> None:
    robot = Robot.named(name)
    q = (
        np.random.default_rng(5).uniform(-0.5, 0.5, (20, robot.n_joints))
        + [0.3, -1.2, 0.8, -1.5, 0.7, 1.1, 0.2][: robot.n_joints]
    )
    locked = {6: q[:, 6]} if name == "panda" else {}
    for change in ("tool", "base", "payload", "replaced tool"):
        changed = CHANGES[change][0](robot)
        found = changed.inverse(changed.forward(q), locked=locked)
        assert (found.status == Status.FOUND).all()
        missed = np.where(found.valid, np.abs(np.sin((found.q - q[:, None]) / 2)).max(-1), np.inf).min(-1)
        assert missed.max() < 1e-7, change


@pytest.mark.parametrize("distance", [10.0, 1e3, 1e6])
def test_dynamics_far_from_the_origin(distance: float) -> None:
    """The error is proportional to the distance, like that of the stored lines, not to its square."""
    robot = Robot.named("ur5").with_payload(2.0, (0, 0.1, 0.05), (0.1, 0, 0, 0.2, 0, 0.3))
    q, qd, qdd = np.random.default_rng(8).uniform(-2, 2, (3, 20, 6))
    base = pga3.motor_from_rotation_vector_translation([0, 0, 0.3], distance * np.array([0.6, -0.48, 0.64]))
    far = Robot.named("ur5").with_base(base).with_payload(2.0, (0, 0.1, 0.05), (0.1, 0, 0, 0.2, 0, 0.3))
    limit = 3e-14 + 2e-15 * distance
    assert largest(far.inverse_dynamics(q, qd, qdd), robot.inverse_dynamics(q, qd, qdd)) < limit
    assert largest(far.mass_matrix(q), robot.mass_matrix(q)) < limit
    assert largest(far.coriolis_matrix(q, qd), robot.coriolis_matrix(q, qd)) < limit
    slopes = (arm.inverse_dynamics_derivatives(q, qd, qdd) for arm in (far, robot))
    assert largest(*slopes) < limit
    energies = far.potential_energy(q) - robot.bodies[:, 0].sum() * 9.81 * base_height(base)
    assert np.abs(energies - robot.potential_energy(q)).max() < 1e-12 * (1 + distance)


def base_height(base: np.ndarray) -> float:
    return float(pga3.motor_to_matrix(base)[2, 3])


LENGTH, NEAR, MASS, MOMENT, ROTOR = 0.7, 0.3, 2.0, 0.05, 0.02


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """One link that rotates about y, along x in the zero configuration, with specialised kernels."""
    folder = tmp_path_factory.mktemp("pendulum")
    path = folder / "pendulum.urdf"
    path.write_text(
        f'<robot name="pendulum"><link name="base"/><link name="rod"><inertial><origin xyz="{NEAR} 0 0"/>'
        f'<mass value="{MASS}"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="{MOMENT}" iyz="0" izz="{MOMENT}"/></inertial>'
        '</link><link name="end"/><joint name="turn" type="continuous"><parent link="base"/><child link="rod"/>'
        '<axis xyz="0 -1 0"/></joint><joint name="weld" type="fixed"><parent link="rod"/><child link="end"/>'
        f'<origin xyz="{LENGTH} 0 0"/></joint></robot>'
    )
    return Robot.from_urdf(path).with_module(written(path, folder))


def written(path: Path, folder: Path, change: Callable[[str], str] = str) -> ModuleType:
    """Write the module with ``gac robot``."""
    name, text = robot_spec(str(path), None, None, ())
    spec = folder / f"{name}.py"
    spec.write_text(change(text))
    write(render(compile_spec(load_spec(spec))), folder / "out")
    shutil.rmtree(
        folder / "out" / "__pycache__", ignore_errors=True
    )  # remove stale bytecode, as the file may have the same time and size
    return load_module(folder / "out" / f"{name}.py", f"_{name}", "arrays")


def test_a_pendulum_in_closed_form(pendulum: Robot) -> None:
    """The z axis points upwards; the angle is measured from x upwards."""
    q, qd, qdd, load, g, long = 0.4, 1.3, -0.7, 1.5, 9.81, LENGTH + 0.2
    state = [np.array([x]) for x in (q, qd, qdd)]
    stick = np.array([1, 0, 0, 0, -0.1, 0, 0, 0])  # 0.2 m along x
    own = MASS * NEAR, MOMENT + MASS * NEAR**2
    for robot, first, second, fall, tip in (
        (pendulum, *own, g, LENGTH),
        (pendulum.with_payload(load), own[0] + load * LENGTH, own[1] + load * LENGTH**2, g, LENGTH),
        (pendulum.with_payload(load, (0.2, 0, 0), (0, 0, 0, 0.3, 0, 0)), own[0] + load * long,
         own[1] + load * long**2 + 0.3, g, LENGTH),
        (pendulum.with_gravity((0, 0, 1.62)), *own, -1.62, LENGTH),
        (pendulum.with_armature([ROTOR]), own[0], own[1] + ROTOR, g, LENGTH),
        (pendulum.with_tool(stick), *own, g, long),
        (pendulum.with_tool(stick).with_payload(load), own[0] + load * long, own[1] + load * long**2, g, long),
    ):  # fmt: skip
        weight, inertia = first * fall * cos(q), second
        assert robot.pose(state[0])[:3, 3] == pytest.approx((tip * cos(q), 0, tip * sin(q)), abs=1e-14)
        assert robot.jacobian(state[0])[:, 0] == pytest.approx((0, -1, 0, -tip * sin(q), 0, tip * cos(q)), abs=1e-14)
        assert robot.gravity(state[0]) == pytest.approx(weight, rel=1e-13)
        assert robot.mass_matrix(state[0]) == pytest.approx(inertia, rel=1e-13)
        tau = robot.inverse_dynamics(*state)
        assert tau == pytest.approx(inertia * qdd + weight, rel=1e-13)
        assert robot.coriolis(state[0], state[1]) == pytest.approx(0.0, abs=1e-13)
        assert robot.forward_dynamics(*state[:2], np.array([2.0])) == pytest.approx((2 - weight) / inertia, rel=1e-12)
        assert robot.kinetic_energy(*state[:2]) == pytest.approx(inertia * qd**2 / 2, rel=1e-13)
        assert robot.potential_energy(state[0]) == pytest.approx(first * fall * sin(q), rel=1e-13)
        assert robot.inverse_dynamics_derivatives(*state)[0] == pytest.approx(-first * fall * sin(q), rel=1e-12)
        # mounted elsewhere, with gravity rotated accordingly
        leaning = robot.with_base(BASE)
        assert np.abs(leaning.pose(state[0]) - pga3.motor_to_matrix(BASE) @ robot.pose(state[0])).max() < 1e-14
        turned = leaning.with_gravity(pga3.motor_to_matrix(BASE)[:3, :3] @ robot.free_fall)
        assert turned.inverse_dynamics(*state) == pytest.approx(float(tau[0]), rel=1e-12)
    wall = pendulum.with_base(pga3.motor_from_rotation_vector_translation([0, pi / 2, 0], [1.0, 2.0, 3.0]))
    assert wall.gravity(state[0]) == pytest.approx(
        MASS * NEAR * g * sin(q), rel=1e-13
    )  # x of the base points downwards
    assert pga3.motor_to_matrix(wall.link("base", state[0]))[:3, 3] == pytest.approx((1, 2, 3), abs=1e-14)


def test_an_edited_spec_is_of_another_robot(pendulum: Robot, tmp_path: Path) -> None:
    """Digests are computed from the numbers that the kernels were generated from, not from the first spec."""
    path = tmp_path / "heavy.urdf"
    path.write_text(
        '<robot name="heavy"><link name="a"/><link name="b"><inertial><mass value="2.25"/><inertia ixx="1" ixy="0" '
        'ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link><joint name="j" type="continuous"><parent link="a"/>'
        '<child link="b"/></joint></robot>'
    )
    robot = Robot.from_urdf(path)
    assert robot.with_module(written(path, tmp_path)).uses["mass_matrix"] != "generated.robots"
    with pytest.raises(DescriptionError, match="different bodies"):
        robot.with_module(written(path, tmp_path, lambda text: text.replace("(2.25, ", "(7.25, ")))


def test_arguments_of_changes() -> None:
    robot = Robot.named("ur5")
    matrix = robot.with_tool(pga3.motor_to_matrix(TOOL))
    assert np.abs(matrix.tool - robot.with_tool(TOOL).tool).max() < 1e-15
    assert robot.with_tool(TOOL.astype(np.float32)).tool.dtype == np.float64
    mirror = np.diag([1.0, 1.0, -1.0, 1.0])
    for wrong in (
        np.zeros(8),
        2 * TOOL,
        mirror,
        np.diag([1.0, 1, 1, 2]),
        2 * np.eye(4),
        np.full(8, np.nan),
        np.ones(3),
    ):
        with pytest.raises(ValueError, match="ur5: tool: "):
            robot.with_tool(wrong)
        with pytest.raises(ValueError, match="ur5: base: "):
            robot.with_base(wrong)
    for gravity in ((0.0, 0.0), (0, 0, np.nan), np.zeros((2, 3))):
        with pytest.raises(ValueError, match="ur5: gravity: "):
            robot.with_gravity(gravity)
    with pytest.raises(TypeError, match="ur5: gravity: "):
        robot.with_gravity("down")  # type: ignore[arg-type]
    for payload in ((-1.0,), (np.nan,), (1.0, (0, 0)), (1.0, (0, 0, np.inf)), (1.0, (0, 0, 0), (-1, 0, 0, 1, 0, 1))):
        with pytest.raises(ValueError, match=r"payload|body"):
            robot.with_payload(*payload)
    with pytest.raises(MissingInertiaError, match="iiwa: payload"):
        Robot.named("iiwa").with_payload(1.0)
    for limits in (np.zeros((5, 2)), np.zeros((6, 3)), np.tile([1.0, -1.0], (6, 1)), np.full((6, 2), np.nan)):
        with pytest.raises(ValueError, match=r"ur5: .*limits"):
            robot.with_limits(limits)
    narrow = robot.with_limits(np.tile([-1, 1], (6, 1)))
    assert np.array_equal(narrow.limits[:, :2], np.tile([-1, 1], (6, 1)))
    assert np.array_equal(narrow.limits[:, 2:], robot.limits[:, 2:])
    for armature in (np.ones(5), [0, 0, 0, 0, 0, -1.0], np.full(6, np.inf)):
        with pytest.raises(ValueError, match="ur5: armature"):
            robot.with_armature(armature)
    assert robot.with_payload(0.0, (1, 2, 3)).gravity(np.ones(6)) == pytest.approx(robot.gravity(np.ones(6)), abs=1e-13)
    body = Body(5.0, (0.0, 0.0, 0.1))
    carried = Robot.from_dh([{"a": 1.0}], bodies=[body]).with_payload(3.0)
    assert carried.bodies[0, :4] == pytest.approx((8, 5 / 8 * 1 + 3 / 8 * 1, 0, 5 / 8 * 0.1))
