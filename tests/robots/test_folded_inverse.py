"""``gac robot --inverse``: all branches of one robot by one kernel, against `Robot.inverse` and forward kinematics."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from algorithms.kinematics import Robot, Status
from algorithms.kinematics.folded import GENERIC
from algorithms.kinematics.inverse.folding import tables_of
from gacompiler.cli import main
from gacompiler.errors import SpecError
from gacompiler.generation.compiling import compile_spec
from gacompiler.generation.files import write
from gacompiler.generation.rendering import render
from gacompiler.generation.spec_files import load_spec
from gacompiler.robots import Chain
from gacompiler.robots.descriptions import robot_spec
from gacompiler.robots.spec_text import inverse_text, spec_text
from gacompiler.runtime import load_module


def module_of(name: str, text: str, folder: Path) -> Any:
    (folder / f"{name}.py").write_text(text)
    write(render(compile_spec(load_spec(folder / f"{name}.py"), effort=0)), folder / "out")
    return load_module(folder / "out" / f"{name}.py", f"_inverse_{name}", "arrays")


def shoulder_arm() -> Robot:
    """A Puma 560 whose end stands on the ground, with an oblique tool."""
    puma = Robot.named("puma560")
    axes = -puma.axes[::-1]
    return Robot("shoulder", puma.kinds, axes, np.tile(puma.tool, (6, 1)), tool=puma.tool, limits=puma.limits[::-1])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ur5", "puma560", "iiwa", "shoulder"])
def test_the_kernel_has_the_branches_of_the_robot(name: str, tmp_path: Path) -> None:
    if name == "shoulder":
        robot = shoulder_arm()
        rows = [tuple(map(tuple, table.tolist())) for table in (robot.axes, robot.home)]
        tip, tool = robot.tip, tuple(robot.tool.tolist())
        chain = Chain(tuple(k.value for k in robot.kinds), robot.parents, rows[0], tip, tool, home=rows[1])
        names = [f"turn {k}" for k in range(6)]
        text = spec_text(name, chain, "", (), inverse_text(*tables_of(robot), names))
    else:
        robot = Robot.named(name)
        text = robot_spec(name, None, None, (), ("forward",), inverse=True)[1]
    module = module_of(name, text, tmp_path)
    own = robot.with_module(module)
    assert own.uses["inverse"] == module.__name__ and robot.uses["inverse"] == GENERIC
    rng = np.random.default_rng(3)
    wanted = rng.uniform(-3, 3, (200, robot.n_joints))
    given: dict[str, Any] = {"elbow": rng.uniform(-3, 3, 200)} if name == "iiwa" else {}
    poses = robot.forward(wanted) * np.where(rng.random(200) < 0.5, -1, 1)[:, None]
    poses[:5, 4:7] += 3.0  # out of reach
    found, generic = own.inverse(poses, **given), robot.inverse(poses, **given)
    assert (found.status[:5] == Status.OUT_OF_REACH).all()
    assert np.array_equal(found.valid, generic.valid) and np.array_equal(found.status, generic.status)
    assert np.nanmax(np.abs(found.q - generic.q), initial=0.0) < 1e-8
    branches, gaps, errors = module.inverse(poses, *given.values())
    assert branches.shape == (200, 8, robot.n_joints) and gaps.shape == errors.shape == (200, 8)
    reached = robot.forward(branches)
    sides = [np.abs(reached + sign * poses[:, None]).max(-1) for sign in (1, -1)]
    away = np.minimum(*sides)
    # UR5: the motions that are compared differ from the poses by rigid motions with lengths below 2 m.
    most = 6 if name == "ur5" else 1
    assert (away <= most * errors + 1e-12).all() and (errors <= most * away + 1e-12).all()
    assert np.array_equal(errors < 1e-9, found.valid)


def test_structures_without_a_kernel_are_named(tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["robot", "crx10ia", "--inverse", "-o", str(tmp_path), "--no-build"])
    assert result.exit_code and "expected six revolute joints with a spherical wrist" in result.output
    with pytest.raises(SpecError, match="slides, or joints beside the arm"):
        slides = Chain(("prismatic",), (-1,), ((0.0, 0.0, 1.0, 0.0, 0.0, 0.0),), 0, (1.0,) + (0.0,) * 7)
        text = inverse_text("three_parallel_axes", {"point": (0, 0, 0), "plane": (1, 0, 0, 0), "signs": (1, 1, 1)}, "a")
        module_of("slides", spec_text("slides", slides, "", (), text), tmp_path)


def test_the_text_names_the_joints() -> None:
    text = robot_spec("ur5", None, None, (), ("forward",), inverse=True)[1]
    assert "Joint variables: joint 0, joint 1" in text and "three_parallel_axes" in text
    assert "def inverse" not in robot_spec("ur5", None, None, (), ("forward",))[1]
