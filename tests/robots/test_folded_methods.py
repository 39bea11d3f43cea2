"""Every method with the constants of one robot folded, against the loops for any robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from selection import some_slow

from algorithms.kinematics import DescriptionError, Robot
from algorithms.kinematics.folded import GENERIC
from algorithms.kinematics.methods import METHODS as TABLE
from algorithms.kinematics.methods import PARTS_OF_KERNELS, Attempts
from gacompiler.generation.compiling import compile_spec
from gacompiler.generation.files import write
from gacompiler.generation.rendering import render
from gacompiler.generation.spec_files import load_spec
from gacompiler.robots.descriptions import robot_spec
from gacompiler.robots.kernel_texts import METHODS
from gacompiler.runtime import load_module


def link(name: str, mass: float) -> str:
    return (
        f'<link name="{name}"><inertial><origin xyz="0.1 -0.2 0.3" rpy="0.2 0.1 -0.4"/><mass value="{mass}"/>'
        '<inertia ixx="0.3" ixy="0.01" ixz="-0.02" iyy="0.4" iyz="0.03" izz="0.2"/></inertial></link>'
    )


def joint(name: str, kind: str, parent: str, child: str, text: str) -> str:
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{text}</joint>'


TREE = "".join([
    '<robot name="tree"><link name="base"/>', *(link(name, 1 + k) for k, name in enumerate(("a", "b", "c", "d"))),
    joint("one", "continuous", "base", "a", '<origin xyz="0.1 0.2 0.3"/><axis xyz="0 0 1"/>'),
    joint("two", "prismatic", "a", "b", '<origin xyz="0.5 0 0" rpy="0.3 0 0"/><axis xyz="1 0 0"/>'),
    joint("three", "continuous", "b", "c", '<origin xyz="0 0.4 0" rpy="0 0.2 0"/><axis xyz="0 1 0"/>'),
    joint("four", "continuous", "a", "d",
          '<origin xyz="0 0 0.3"/><axis xyz="1 0 0"/><mimic joint="three" multiplier="-0.7" offset="0.2"/>'),
    "</robot>",
])  # fmt: skip
"""Two branches, a slide, an oblique axis, and a joint that follows one of the other branch."""


def written(robot: str, folder: Path, methods: tuple[str, ...], base: str = "fixed") -> Callable[[Robot], Robot]:
    """Functions that attach to a robot the module written for it."""
    name, text = robot_spec(robot, None, None, (), methods, base)
    (folder / f"{name}.py").write_text(text)
    write(render(compile_spec(load_spec(folder / f"{name}.py"), effort=0)), folder / "out")
    module = load_module(folder / "out" / f"{name}.py", f"_{name}", "arrays")
    return lambda found: found.with_module(module)


def check(robot: Robot, plain: Robot, methods: tuple[str, ...]) -> None:
    rng, m = np.random.default_rng(1), plain.n_positions
    rows = [rng.uniform(-2, 2, (5, n)) for n in (m, plain.n_joints, plain.n_joints)]
    for method in methods:
        count = len(METHODS[method].arguments.split(", "))
        assert robot.uses[method] != GENERIC, method
        found, expected = getattr(robot, method)(*rows[:count]), getattr(plain, method)(*rows[:count])
        parts = zip(found, expected, strict=True) if isinstance(expected, tuple) else [(found, expected)]
        for part, truth in parts:
            assert part.shape == truth.shape, method
            assert np.abs(part - truth).max() < 1e-10 * max(1.0, np.abs(truth).max()), method
        with pytest.raises((TypeError, ValueError), match=r"expected"):
            getattr(robot, method)(*np.zeros((count, m + 1)))


FEW = ("forward", "kinetic_energy")
"""Poses and energies; `test_robot_command` has velocities and forces."""


@pytest.mark.parametrize("which", some_slow(["few", "all"], "all"))
@pytest.mark.slow
def test_every_method_of_a_tree_with_prismatic_and_mimic_joints(which: str, tmp_path: Path) -> None:
    methods = FEW if which == "few" else tuple(METHODS)
    path = tmp_path / "tree.urdf"
    path.write_text(TREE)
    plain = Robot.from_urdf(path)
    assert plain.n_joints == 3 and len(plain.kinds) == 4
    robot = written(str(path), tmp_path, methods)(plain)
    check(robot, plain, methods)
    # a different ratio is a different robot
    other = replace(plain, coupling=plain.coupling * 1.001)
    with pytest.raises(DescriptionError, match="different joints"):
        other.with_module(robot.module)


@pytest.mark.parametrize("which", some_slow(["few", "all"], "all"))
@pytest.mark.slow
def test_every_method_of_a_tree_on_a_floating_base(which: str, tmp_path: Path) -> None:
    """The motors of its configurations are random numbers, of any norm and off the Study quadric."""
    methods = ("forward", "gravity", "mass_matrix") if which == "few" else tuple(METHODS)
    path = tmp_path / "tree.urdf"
    path.write_text(TREE.replace('<link name="base"/>', link("base", 2.0)))
    plain = Robot.from_urdf(path, base="floating")
    assert plain.n_positions == 11 and plain.n_joints == 9 and len(plain.kinds) == 5
    check(written(str(path), tmp_path, methods, "floating")(plain), plain, methods)
    fixed = Robot.from_urdf(path)
    with pytest.raises(DescriptionError, match="different"):
        fixed.with_module(written(str(path), tmp_path, ("forward",), "floating")(plain).module)


def test_the_command_writes_the_kernels_that_robots_look_for() -> None:
    assert [*METHODS, "inverse"] == list(PARTS_OF_KERNELS)  # for which there is an option of its own
    for name, row in TABLE.items():
        assert hasattr(Robot, name) and all(call in TABLE for call in row.calls)
        assert hasattr(Attempts, name) == row.has_kernel
