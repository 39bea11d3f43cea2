"""``gac robot``: kernels of one robot with its constants folded, against the generic path."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from algorithms.kinematics import Robot
from algorithms.kinematics.named import FOLDED
from gacompiler import robots
from gacompiler.cli import main
from gacompiler.errors import SpecError
from gacompiler.robots.descriptions import robot_spec
from gacompiler.runtime import load_module
from gacompiler.specs import panda

INERTIAL = """<inertial><origin xyz="0.1 -0.2 0.3" rpy="0.2 0.1 -0.4"/><mass value="1.5"/>
<inertia ixx="0.3" ixy="0.01" ixz="-0.02" iyy="0.4" iyz="0.03" izz="0.2"/></inertial>"""
GRIPPER = f"""<robot name="lift and grip">
<link name="base"/><link name="arm">{INERTIAL}</link>
<link name="left">{INERTIAL}</link><link name="right">{INERTIAL}</link>
<joint name="turn" type="revolute"><parent link="base"/><child link="arm"/>
<origin rpy="1.57079632679 0 0" xyz="0 0 0.3"/><axis xyz="0 0 1"/></joint>
<joint name="left" type="prismatic"><parent link="arm"/><child link="left"/><origin xyz="0.5 0.02 0"/>
<axis xyz="0 1 0"/></joint>
<joint name="right" type="prismatic"><parent link="arm"/><child link="right"/><origin xyz="0.5 -0.02 0"/>
<axis xyz="0 -1 0"/><mimic joint="left"/></joint>
</robot>"""


def run(*arguments: str) -> str:
    result = CliRunner().invoke(main, ["robot", *arguments])
    assert result.exit_code == 0, result.output
    return result.output


@pytest.mark.slow
def test_a_tree_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "gripper.urdf"
    path.write_text(GRIPPER)
    printed = run(str(path), "-o", str(tmp_path / "out"), "--no-build", "--effort", "0")
    assert "lift_and_grip.py .pyi .c .h: 5 kernels" in printed
    module = load_module(tmp_path / "out" / "lift_and_grip.py", "_lift_and_grip", "arrays")
    generic = Robot.from_urdf(path)
    folded = generic.with_module(module)
    q, qd, qdd = np.random.default_rng(0).normal(size=(3, 20, 2))
    for name in ("pose", "jacobian", "mass_matrix", "gravity"):
        assert np.abs(getattr(folded, name)(q) - getattr(generic, name)(q)).max() < 1e-9, name
    assert folded.uses["gravity"] == module.__name__  # although one joint mimics another
    both = [robot.inverse_dynamics(q, qd, qdd) for robot in (folded, generic)]
    assert np.abs(both[0] - both[1]).max() < 1e-9
    assert np.abs(folded.coriolis_matrix(q, qd) - generic.coriolis_matrix(q, qd)).max() < 1e-9
    # quarter turns with eleven digits are quarter turns
    spec = (tmp_path / "out" / "specs" / "lift_and_grip.py").read_text()
    assert "(0.0, 1.0, 0.0, 0.3, 0.0, 0.0)" in spec and "e-1" not in spec


def test_without_masses_there_are_two_kernels(tmp_path: Path) -> None:
    module, text = robot_spec("iiwa", None, None, ())
    assert module == "iiwa" and "def jacobian" in text and "def mass_matrix" not in text
    path = tmp_path / "bare.urdf"
    path.write_text(GRIPPER.replace(INERTIAL, "", 1))
    assert "def mass_matrix" not in robot_spec(str(path), "bare", "left", ["right"])[1]


@pytest.mark.parametrize("name", sorted(FOLDED))
def test_checked_in_specs_equal_the_output_of_the_command(name: str) -> None:
    path = Path(robots.__file__).parents[1] / "specs" / f"{name}.py"
    assert path.read_text() == robot_spec(name, None, None, ())[1]


@pytest.mark.slow
def test_methods_and_languages(tmp_path: Path) -> None:
    printed = run(
        "ur5",
        "--method",
        "gravity",
        "--method",
        "forward_all",
        "--target",
        "rust",
        "-o",
        str(tmp_path),
        "--effort",
        "0",
    )
    assert "ur5.rs: 2 kernels" in printed and not (tmp_path / "ur5.c").exists()
    text = (tmp_path / "ur5.rs").read_text()
    assert "fn gravity" in text and "fn forward_all" in text and "fn jacobian" not in text
    assert "home=(" in (tmp_path / "specs" / "ur5.py").read_text()
    with pytest.raises(SpecError, match=r"iiwa: no masses, which gravity needs; expected one of forward, forward_all"):
        robot_spec("iiwa", None, None, (), ("forward", "gravity"))
    every = robot_spec("iiwa", None, None, (), ("all",))[1]
    assert re.findall(r"^def (\w+)", every, re.MULTILINE) == ["forward", "forward_all", "jacobian", "jacobian_rate"]


def test_unknown_robots(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="unknown; expected one of puma560"):
        robot_spec("r2d2", None, None, ())
    with pytest.raises(SpecError, match="No such file"):
        robot_spec(str(tmp_path / "none.urdf"), None, None, ())
    for options in ({"tip": "tool"}, {"base": "floating"}):
        with pytest.raises(SpecError, match="for --tip, --lock and --base"):
            robot_spec("ur5", None, **{"tip": None, "locked": (), **options})
    with pytest.raises(SpecError, match="not a valid module name"):
        robot_spec("ur5", "3 d", None, ())


def test_invalid_chains() -> None:
    z, tool = (1.0, 0, 0, 0, 0, 0), (1.0, *(0.0,) * 7)
    for kinds, parents, message in (
        (("revolute",), (-1, 0), "2 parents for 1 joints"),
        (("round",), (-1,), "kind 'round'"),
        (("revolute",), (0,), "parent 0"),
        (("revolute", "floating"), (-1, 0), "kind 'floating'"),
        (("floating", "revolute"), (-1, -1), "since the base floats"),
    ):
        with pytest.raises(SpecError, match=message):
            robots.Chain(kinds, parents, (z,) * len(kinds), 0, tool)
    with pytest.raises(SpecError, match="no inertias"):
        robots.gravity(robots.Chain(("revolute",), (-1,), (z,), 0, tool), (0,))
    with pytest.raises(SpecError, match="no home"):
        robots.forward_all(robots.Chain(("revolute",), (-1,), (z,), 0, tool), (0,))


def test_base_parameters_have_no_mass_and_seven_numbers_at_most() -> None:
    """The forces that they give are tested in `test_dynamics`."""
    found = robots.base_parameters(panda.ROBOT)
    assert sum(body[0] for body in panda.ROBOT.inertias) > 10 and all(mass == 0 for mass, _, _ in found)
    numbers = [sum(x != 0 for x in [*h, *(t[i][j] for i in range(3) for j in range(i, 3))]) for _, h, t in found]
    assert max(numbers) <= 7


def test_the_former_name_of_base_parameters_warns() -> None:
    with pytest.warns(DeprecationWarning, match=r"base_parameters.*version 0\.3"):
        assert robots.regrouped is robots.base_parameters
    with pytest.raises(AttributeError, match="nothing"):
        _ = robots.nothing
