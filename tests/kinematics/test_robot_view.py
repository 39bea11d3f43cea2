"""Robots in a browser: what the page computes under node equals what Python computes, and what it shows."""

from __future__ import annotations

import json
import re
import shutil
import struct
import subprocess
from dataclasses import replace
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from algorithms.kinematics import Reaching, Robot
from algorithms.kinematics.denavit_hartenberg import Joint
from algorithms.kinematics.tasks import position
from algorithms.kinematics.view import RobotView
from algorithms.kinematics.visuals import visuals_of
from gacompiler.generation.compiling import compile_spec
from gacompiler.generation.rendering import render_targets
from gacompiler.generation.spec_files import load_spec
from generated import pga3
from tests.support.described_robots import quadruped

ROOT = Path(__file__).parents[2]
EMITTED = ROOT / "algorithms" / "kinematics" / "drawn_robots.mjs"
ARM = """<robot name="arm"><material name="red"><color rgba="1 0 0 1"/></material>
<link name="base"><visual><geometry><box size="0.4 0.2 0.1"/></geometry></visual></link>
<link name="upper"><visual><origin xyz="0 0 0.25" rpy="0 0 0.3"/>
<geometry><cylinder radius="0.05" length="0.5"/></geometry>
<material name="red"/></visual></link>
<link name="slide"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>
<link name="finger"><visual><geometry><mesh filename="package://arm/meshes/tip.stl" scale="2 2 2"/></geometry></visual>
</link><link name="other"><visual><geometry><mesh filename="none.dae"/></geometry></visual>
<collision><origin xyz="1 0 0"/><geometry><box size="1 1 1"/></geometry></collision></link>
<joint name="a" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.05" rpy="0.2 0 0"/>
<axis xyz="0 1 0"/><limit lower="0.5" upper="2"/></joint>
<joint name="b" type="prismatic"><parent link="upper"/><child link="slide"/><origin xyz="0 0 0.5"/><axis xyz="0 0 1"/>
<limit lower="0" upper="0.3"/></joint>
<joint name="c" type="continuous"><parent link="slide"/><child link="finger"/><axis xyz="1 0 0"/></joint>
<joint name="d" type="revolute"><parent link="slide"/><child link="other"/><axis xyz="1 0 0"/>
<mimic joint="c" multiplier="-2"/></joint></robot>"""
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """The file of the arm in a package, with a tetrahedron as a mesh of STL."""
    folder = tmp_path / "arm"
    (folder / "meshes").mkdir(parents=True)
    triangles = [CORNERS[list(face)] for face in ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))]
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *np.ravel(each), 0) for each in triangles)
    (folder / "meshes" / "tip.stl").write_bytes(bytes(80) + struct.pack("<I", 4) + rows)
    (folder / "arm.urdf").write_text(ARM)
    return folder / "arm.urdf"


def volume(corners: Any, faces: Any) -> float:
    """The volume of a closed surface, positive if its faces are counterclockwise from outside."""
    corners = np.asarray(corners)
    total = 0.0
    for face in faces:
        for b, c in pairwise(face[1:]):
            total += float(corners[face[0]] @ np.cross(corners[b], corners[c])) / 6
    return total


def test_visual_elements(path: Path) -> None:
    """Bodies by their volumes: those inside of round ones are a little smaller."""
    found, missing = visuals_of(path, {})
    assert missing == [] and [each.link for each in found] == ["base", "upper", "slide", "finger", "other"]
    volumes = [volume(each.corners, each.faces) for each in found]
    assert np.allclose([volumes[0], volumes[3], volumes[4]], [0.4 * 0.2 * 0.1, 8 / 6, 1])
    assert 0.95 < volumes[1] / (np.pi * 0.05**2 * 0.5) < 1 and 0.9 < volumes[2] / (4 / 3 * np.pi * 0.1**3) < 1
    assert np.allclose(found[4].corners.mean(0), [1, 0, 0])  # the collision geometry, since a .dae is not read
    assert [each.colour for each in found][:2] == ["#8a939c", "#ff0000"]
    assert visuals_of(ARM, {})[1] == ["package://arm/meshes/tip.stl"]  # a text has no folder


def test_meshes_with_many_vertices(tmp_path: Path) -> None:
    """The hull of a ball of 5,000 vertices has at most 120 corners, all on the ball, and is closed."""
    points = np.random.default_rng(0).normal(size=(5000, 3))
    points = points / np.linalg.norm(points, axis=1, keepdims=True) + [3, 0, 0]
    (tmp_path / "ball.obj").write_text("".join(f"v {x} {y} {z}\n" for x, y, z in points))
    mesh = '<visual><geometry><mesh filename="ball.obj"/></geometry></visual>'
    (tmp_path / "ball.urdf").write_text(f'<robot name="r"><link name="ball">{mesh}</link></robot>')
    ((ball,), missing) = visuals_of(tmp_path / "ball.urdf", {})
    assert missing == [] and 100 < len(ball.corners) <= 120 and len(ball.faces) == 2 * len(ball.corners) - 4
    assert np.allclose(np.linalg.norm(ball.corners - [3, 0, 0], axis=1), 1)
    assert 0.9 < volume(ball.corners, ball.faces) / (4 / 3 * np.pi) < 1


def test_sliders_and_places(path: Path) -> None:
    """Limits and names of joints; the axes of the end effector and a corner of a link are where kernels place them."""
    robot = Robot.from_urdf(path, tip="finger")
    view = robot.view(path, q=[1.0, 0.1, 0.2])
    assert [(each.name, each.low, each.high, each.start) for each in view.sliders] == [
        ("a", 0.5, 2.0, 1.0), ("b", 0.0, 0.3, 0.1), ("c", -np.pi, np.pi, 0.2),
    ]  # fmt: skip
    assert robot.view().sliders[0].start == 0.5  # 0 is outside of the limits
    q = np.array([1.5, 0.2, -0.7])
    drawn = view.at(a=1.5, b=0.2, c=-0.7)
    kinds = [item["kind"] for item in view._data()["items"]]
    pose = robot.pose(q)
    axes = drawn[kinds.index("axes")]
    assert np.allclose(axes[0], pose[:3, 3]) and np.allclose(axes[1:] - axes[0], axes[1, 0] * 0 + (
        np.linalg.norm(axes[1] - axes[0]) * pose[:3, :3].T))  # fmt: skip
    frames = pga3.motor_to_matrix(robot.forward_all(q))[:, :3, 3]
    ends = [points[1] for points, kind in zip(drawn, kinds, strict=True) if kind == "chain"]
    assert np.allclose(ends, [*frames, pose[:3, 3]])
    bodies = [points for points, kind in zip(drawn, kinds, strict=True) if kind == "body"]
    for points, visual in zip(bodies, visuals_of(path, {})[0], strict=True):
        assert np.allclose(points, pga3.move_point(robot.link(visual.link, q), visual.corners), atol=1e-8)
    with pytest.raises(ValueError, match="no slider 'e'; expected one of a, b, c"):
        view.at(e=1)


FOLLOWER = """<robot name="r"><link name="0"/><link name="1"/><link name="2"/>
<joint name="follower" type="prismatic"><parent link="0"/><child link="1"/><axis xyz="0 0 1"/>
<limit lower="-0.1" upper="0.1"/><mimic joint="self" multiplier="1"/></joint>
<joint name="self" type="continuous"><parent link="1"/><child link="2"/><axis xyz="0 0 1"/></joint></robot>"""


def test_a_follower_before_its_leader() -> None:
    """The slider and its limits are those of the leader, whose name may be any; it is a turn for `reach`, too."""
    robot = Robot.from_urdf(FOLLOWER)
    view = robot.view()
    assert [each[:3] for each in view.sliders] == [("self", -np.pi, np.pi)] and robot.leaders == (1,)
    assert np.allclose(view.at(**{"self": 0.3})[0][1], [0, 0, 0.3])
    lines = repr(robot).splitlines()
    assert "1 times self, plus 0" in lines[1] and "inf" in lines[2]
    assert Reaching(robot, [position([0, 0, 1], link="1")])._turns.tolist() == [True]


def test_leaders_of_robots_made_without_them() -> None:
    """Joints that equal a variable come before joints that follow it. A change of the coupling may change leaders."""
    kinds, axes, home = (Joint.REVOLUTE,) * 3, np.tile(np.eye(6)[0], (3, 1)), np.tile(np.eye(8)[0], (3, 1))
    coupling = np.array([[0, 2, 0.1], [0, 1, 0], [1, 0, 0]])
    assert Robot("r", kinds, axes, home, coupling=coupling).leaders == (2, 1)
    assert Robot("r", kinds, axes, home).leaders == (0, 1, 2)
    assert Robot.from_urdf(quadruped(), base="floating").leaders[:8] == (0,) * 6 + (1, 2)
    robot = Robot.from_urdf(FOLLOWER)
    assert replace(robot, coupling=np.array([[1, 0], [2, 0.0]])).leaders == (0,)
    assert replace(robot, coupling=np.empty(0), limits=np.empty(0)).leaders == (0, 1)


@pytest.mark.parametrize("content", [b"", bytes(84), bytes(80) + struct.pack("<I", 4) + bytes(149), b"solid"])
def test_meshes_that_are_cut_off_are_missing(path: Path, content: bytes) -> None:
    (path.parent / "meshes" / "tip.stl").write_bytes(content)
    found, missing = visuals_of(path, {})
    assert missing == ["package://arm/meshes/tip.stl"] and "finger" not in [each.link for each in found]


def test_what_follows_the_triangles_of_a_mesh_is_ignored(path: Path) -> None:
    mesh = path.parent / "meshes" / "tip.stl"
    mesh.write_bytes(mesh.read_bytes() + b"more")
    found, missing = visuals_of(path, {})
    assert missing == [] and np.isclose(volume(found[3].corners, found[3].faces), 8 / 6)


def computed_by_node(view: RobotView, cases: list[list[float]], folder: Path) -> Any:
    """The shapes of the page for values of the sliders."""
    program = (files("gacompiler") / "objects/live.js").read_text()
    text = f"{view.javascript}\n{program}\nconst data = {json.dumps(view._data())}, given = {json.dumps(cases)};"
    text += "\nconsole.log(JSON.stringify(given.map((v) => shapesOf(data, scene, [], v))));"
    (folder / "page.mjs").write_text(text)
    run = subprocess.run(["node", str(folder / "page.mjs")], capture_output=True, text=True, check=True)
    return json.loads(run.stdout)


@pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
def test_the_browser_computes_what_python_computes(path: Path, tmp_path: Path) -> None:
    """All points of an arm with bodies, and of a floating quadruped, at random values of the sliders."""
    floating = Robot.from_urdf(quadruped(), base="floating")
    start = np.concatenate([pga3.normalize_motor(np.arange(1.0, 9)), np.zeros(12)])
    random = np.random.default_rng(1)
    for view in (Robot.from_urdf(path).view(path), floating.view(q=start)):
        cases = [[random.uniform(each.low, each.high) for each in view.sliders] for _ in range(5)]
        names = [each.name for each in view.sliders]
        for values, found in zip(cases, computed_by_node(view, cases, tmp_path), strict=True):
            expected = view.at(**dict(zip(names, values, strict=True)))
            for item, points, (shape,) in zip(view._data()["items"], expected, found, strict=True):
                assert shape["type"] == {"chain": "Chain", "axes": "Frame", "body": "Body"}[item["kind"]]
                assert np.abs(np.array(shape["places"]) - points).max() < 1e-14 * 20
                assert shape.get("faces") == item["faces"] or item["kind"] != "body"


def test_pages_need_no_network(path: Path, tmp_path: Path) -> None:
    view = Robot.from_urdf(path).view(path)
    view.save(tmp_path / "arm.html")
    text = (tmp_path / "arm.html").read_text()
    assert (
        text == view.html() and "<title>arm</title>" in text and "/*" not in re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    )
    assert not re.search(r"""(src|href)\s*=\s*["']?(https?:)?//""", text)
    assert view._repr_html_().startswith("<iframe srcdoc=") and text.count("</script>") == 1
    with pytest.raises(ValueError, match=r"expected .html"):
        view.save(tmp_path / "arm.png")
    with pytest.raises(ValueError, match="one configuration"):
        Robot.from_urdf(path).view(q=np.zeros((2, 3)))
    limits = np.array(view._data()["limits"])
    for _ in range(20):
        points = np.concatenate(view.at(**{each.name: each.high for each in view.sliders}))
        assert (points > limits[:, 0]).all() and (points < limits[:, 1]).all()


def test_the_emitted_kernel_is_of_the_same_spec_as_the_module() -> None:
    """``gac generate gacompiler/specs/drawn_robots.py --target javascript -o algorithms/kinematics`` writes it."""
    own, module = ((ROOT / name).read_text() for name in (EMITTED, "generated/drawn_robots.py"))
    assert re.findall("spec: ([0-9a-f]{16})", own) == re.findall("spec: ([0-9a-f]{16})", module)


@pytest.mark.slow
def test_the_emitted_kernel_is_that_of_its_spec() -> None:
    """What is checked in is what the compiler emits."""
    spec = load_spec(ROOT / "gacompiler/specs/drawn_robots.py", "gac generate drawn_robots.py")
    (text,) = render_targets(compile_spec(spec), ["javascript"]).values()
    assert text == EMITTED.read_text()
