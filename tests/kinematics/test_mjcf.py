"""Robots from MuJoCo's files against the same robots from URDF files, and against Pinocchio's reader."""

from __future__ import annotations

from math import radians
from pathlib import Path

import numpy as np
import pytest
from test_urdf import joint, link, place

from algorithms.kinematics import DescriptionError, FloatingRobot, MissingInertiaError, Robot, UnknownJointTypeError
from gacompiler.robots.descriptions import robot_spec
from generated import pga3
from tests.support.all_cases import all_cases

ARM = """<mujoco model="arm">
<compiler angle="radian"/>
<default class="main">
  <joint armature="0.2"/>
  <default class="slider"><joint type="slide" axis="1 1 0" range="0 0.5"/></default>
</default>
<worldbody>
  <geom type="plane" size="1 1 1"/>
  <body name="one" pos="0.1 0.2 0.3" quat="0.9 0.1 -0.3 0.2">
    <inertial pos="0.1 -0.2 0.3" quat="1 0.2 0 0" mass="1.5" diaginertia="0.3 0.4 0.2"/>
    <joint name="a" axis="0 2 0" range="-1 2" pos="0.05 0 -0.1"/>
    <body name="two" pos="0.5 0 -0.1" euler="-0.3 0.7 0.1" childclass="slider">
      <inertial pos="0 0 0" mass="0.5" fullinertia="0.03 0.04 0.05 0.001 0.002 -0.003"/>
      <joint name="b" armature="0"/>
      <frame pos="0 0.1 0" axisangle="0 0 1 0.4">
        <body name="three" pos="0 0.2 0.2" xyaxes="0 1 0 -1 0 0.2">
          <joint name="c" class="main" axis="0.2 -0.4 0.7"/>
          <joint name="d" class="main" type="hinge" axis="1 0 0" ref="0.3"/>
          <inertial pos="0.02 0.01 0" mass="0.7" diaginertia="0.01 0.02 0.015"/>
          <body name="tool" pos="0 0 0.15" zaxis="0.1 0.2 1"/>
        </body>
      </frame>
    </body>
  </body>
</worldbody></mujoco>"""

FRAME = '<frame pos="0 0.1 0" axisangle="0 0 1 0.4">'
FLAT = ARM.replace(FRAME, "").replace("</frame>", "")


def test_against_pinocchio(tmp_path: Path) -> None:
    pin = pytest.importorskip("pinocchio")
    path = tmp_path / "arm.xml"
    # Pinocchio has no <frame> and no `ref`, and adds the attributes of a childclass to those of a class.
    text = FLAT.replace('ref="0.3"', "").replace(' childclass="slider"', "")
    path.write_text(text.replace('<joint name="b"', '<joint name="b" class="slider"'))
    robot, peer = Robot.from_mjcf(path), pin.buildModelFromMJCF(str(path))
    data = peer.createData()
    assert robot.joint_names == ("a", "b", "c", "d") and robot.n_joints == peer.nq == 4
    assert list(robot.armature) == [0.2, 0.0, 0.2, 0.2]
    assert robot.limits[0, :2] == pytest.approx([-1, 2]) and robot.limits[1, :2] == pytest.approx([0, 0.5])
    assert np.isinf(robot.limits[2:, :2]).all()
    rng = np.random.default_rng(1)
    for q in rng.normal(size=(6, 4)):
        pin.framesForwardKinematics(peer, data, q)
        for name in ("one", "two", "three", "tool"):
            theirs = data.oMf[peer.getFrameId(name)].homogeneous
            assert np.abs(pga3.motor_to_matrix(robot.link(name, q)) - theirs).max() < 1e-13
        mass = pin.crba(peer, data, q)
        mass = np.triu(mass) + np.triu(mass, 1).T
        assert np.abs(robot.mass_matrix(q) - mass).max() < 1e-12


def test_a_class_replaces_that_of_the_parent() -> None:
    assert [kind.value for kind in Robot.from_mjcf(ARM).kinds] == ["revolute", "prismatic", "revolute", "revolute"]


def test_a_reference_shifts_a_variable() -> None:
    robot, without = Robot.from_mjcf(ARM), Robot.from_mjcf(ARM.replace('ref="0.3"', ""))
    q = np.random.default_rng(2).normal(size=(5, 4))
    assert np.abs(robot.pose(q) - without.pose(q - [0, 0, 0, 0.3])).max() < 1e-14


def test_a_frame_moves_what_is_inside() -> None:
    framed = pga3.motor_product(
        pga3.motor_from_rotor_translation(pga3.rotor_from_axis_angle([0, 0, 1.0], 0.4), np.zeros(3)), np.eye(8)[0]
    )
    framed = pga3.motor_to_matrix(framed) + np.outer([0, 1, 0, 0], [0, 0, 0, 0.1])
    q = np.array([0.3, 0.2, 0.0, 0.3])
    two, three, flat = (
        pga3.motor_to_matrix(Robot.from_mjcf(text).link(name, q))
        for text, name in ((ARM, "two"), (ARM, "three"), (FLAT, "three"))
    )
    assert np.abs(three - two @ framed @ np.linalg.inv(two) @ flat).max() < 1e-14


def test_degrees_and_fixed_axes(tmp_path: Path) -> None:
    """The same arm as a URDF file, whose rpy are angles about fixed axes in radians."""
    text = """<mujoco><compiler eulerseq="XYZ"/><worldbody>
    <body name="one" pos="1 2 3" euler="10 20 -30"><joint name="x" axis="0 0 1" range="-90 45"/>
    <inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/></body></worldbody></mujoco>"""
    rpy = " ".join(str(radians(angle)) for angle in (10, 20, -30))
    same = [
        link("world"), link("one"),
        joint("x", "revolute", "world", "one", place("1 2 3", rpy) + '<axis xyz="0 0 1"/>'
              f'<limit lower="{radians(-90)}" upper="{radians(45)}"/>'),
    ]  # fmt: skip
    mine, theirs = Robot.from_mjcf(text), Robot.from_urdf("<robot>" + "".join(same) + "</robot>")
    q = np.linspace(-1, 1, 5)[:, None]
    assert np.abs(mine.pose(q) - theirs.pose(q)).max() < 1e-15
    assert mine.limits[0, :2] == pytest.approx(theirs.limits[0, :2])


FINGERS = """<mujoco><worldbody><body name="hand"><joint name="wrist"/>
  <body name="left" pos="0 0.02 0"><joint name="l" type="slide" axis="0 1 0"/></body>
  <body name="right" pos="0 -0.02 0"><joint name="r" type="slide" axis="0 -1 0"/></body></body></worldbody>
  <equality><joint joint1="r" joint2="l" polycoef="0.01 0.5 0 0 0"/></equality></mujoco>"""


def test_joints_that_follow_others_and_included_files(tmp_path: Path) -> None:
    robot = Robot.from_mjcf(FINGERS, tip="right")
    assert robot.n_joints == 2 and len(robot.kinds) == 3
    assert robot.pose([0.0, 0.1])[:3, 3] == pytest.approx([0, -0.02 - (0.01 + 0.05), 0])
    (tmp_path / "inner.xml").write_text(FINGERS)
    outer = tmp_path / "outer.xml"
    outer.write_text('<mujoco model="outer"><include file="inner.xml"/></mujoco>')
    found = Robot.from_mjcf(outer, tip="right")
    assert found.name == "outer" and np.array_equal(found.axes, robot.axes)


def test_a_free_joint_is_a_floating_base() -> None:
    text = ARM.replace('<joint name="a"', '<freejoint/><joint name="a" type="ball"').replace('type="ball"', "")
    text = text.replace('<joint name="a"  axis="0 2 0" range="-1 2" pos="0.05 0 -0.1"/>', "")
    robot = Robot.from_mjcf(text, base="floating")
    assert isinstance(robot, FloatingRobot) and robot.n_joints == 6 + 3


@all_cases(
    "change, error, message",
    [
        (("<mujoco", "<robot"), DescriptionError, "not XML"),
        (('type="slide"', 'type="ball"'), UnknownJointTypeError, "joint 'b': type 'ball'"),
        (('class="slider"', 'class="slide"'), DescriptionError, "class 'slider' of a joint is no <default>"),
        (('name="two"', 'name="one"'), DescriptionError, "two bodies of this name"),
        (('quat="0.9 0.1 -0.3 0.2"', 'quat="0 0 0 0"'), DescriptionError, "quat of length 0"),
        (('quat="0.9 0.1 -0.3 0.2"', 'quat="1 0 0 0" euler="0 0 0"'), DescriptionError, "quat and euler"),
        (('range="-1 2"', 'range="2 -1"'), DescriptionError, "expected the lower limit first"),
        (('pos="0 0.2 0.2"', 'pos="0 0.2"'), DescriptionError, "expected 3 numbers"),
        (("<frame", "<replicate"), DescriptionError, "not XML"),
        (('<default class="main">', '<include file="x.xml"/><default class="main">'), DescriptionError, "in a text"),
        (
            ('<default class="main">', '<equality><joint joint1="z" joint2="a"/></equality><default class="main">'),
            DescriptionError,
            "'z'",
        ),
        (
            (
                '<default class="main">',
                '<equality><joint joint1="a" joint2="b" polycoef="0 1 2 0 0"/></equality><default class="main">',
            ),
            DescriptionError,
            "not linear",
        ),
    ],
)
def test_wrong_files(change: tuple[str, str], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        Robot.from_mjcf(ARM.replace(*change, 1))


def test_gac_robot_takes_these_files(tmp_path: Path) -> None:
    path = tmp_path / "hand.xml"
    path.write_text(FINGERS.replace("<mujoco>", '<mujoco model="hand">'))
    name, text = robot_spec(str(path), None, "left", (), ("forward",))
    assert name == "hand" and "From hand.xml." in text


def body(inside: str, name: str = "b") -> str:
    return f'<mujoco><worldbody><body name="{name}">{inside}</body></worldbody></mujoco>'


INERTIAL = '<inertial pos="0 0 0" mass="1" diaginertia=".1 .1 .1"/>'


@pytest.mark.parametrize(
    "inside",
    [
        '<joint pos=".1 0 0"/><geom size=".1"/>',
        "<joint/><frame><geom size='.1'/></frame>",
        f'<joint/>{INERTIAL}<body name="c"><geom size=".1"/></body>',
    ],
)
def test_masses_that_geometry_would_give_are_unknown(inside: str) -> None:
    robot = Robot.from_mjcf(body(inside))
    with pytest.raises(MissingInertiaError):
        robot.mass_matrix(np.zeros(1))


def test_gravity_and_masses_of_welded_bodies() -> None:
    text = body(f'<joint axis="0 1 0"/>{INERTIAL}<body name="c" pos="1 0 0">{INERTIAL}</body>')
    robot = Robot.from_mjcf(text.replace("<mujoco>", '<mujoco><option gravity="0 0 -2"/>'))
    assert robot.gravity(np.zeros(1)) == pytest.approx([-2.0]) and robot.mass_matrix([0.0])[0, 0] == pytest.approx(1.2)


def test_couplings_are_those_of_distances_from_the_initial_configuration() -> None:
    inside = f'<joint name="j" type="slide" axis="1 0 0" ref="0.5"/>{INERTIAL}<body name="c">'
    inside += f'<joint name="k" type="slide" axis="1 0 0" ref="0.2"/>{INERTIAL}</body>'
    text = body(inside).replace("</mujoco>", "")
    text += '<equality><joint joint1="k" joint2="j" polycoef="0 2 0 0 0"/></equality></mujoco>'
    robot = Robot.from_mjcf(text)
    assert robot.pose([0.5])[0, 3] == pytest.approx(0) and robot.pose([0.6])[0, 3] == pytest.approx(0.3)


@all_cases(
    "text, message",
    [
        (body(f"{INERTIAL}<frame><joint/></frame>"), "<joint> in a <frame> of 'b'"),
        (body(f'<joint name="a"/><joint name="a"/>{INERTIAL}'), "two joints of this name"),
        (body("<joint/>").replace("<mujoco>", '<mujoco><compiler inertiafromgeom="true"/>'), "inertiafromgeom"),
        (body("<joint/>").replace("<mujoco>", '<mujoco><compiler angle="rad"/>'), "expected 'degree' or 'radian'"),
        (body("<joint/>").replace("<mujoco>", '<mujoco><compiler eulerseq="xyw"/>'), "three of the letters"),
        (body("<joint/>").replace("</mujoco>", "<equality><weld/></equality></mujoco>"), "a closed loop"),
        (body('<body zaxis="0 0 0"/>'), "direction of length 0"),
        (body('<body xyaxes="1 0 0 2 0 0"/>'), "direction of length 0"),
    ],
)
def test_what_is_not_supported_is_refused(text: str, message: str) -> None:
    with pytest.raises(DescriptionError, match=message):
        Robot.from_mjcf(text)


def test_a_file_that_includes_itself(tmp_path: Path) -> None:
    path = tmp_path / "robot.xml"
    path.write_text('<mujoco><include file="robot.xml"/></mujoco>')
    with pytest.raises(DescriptionError, match="expected each file once"):
        Robot.from_mjcf(path)
