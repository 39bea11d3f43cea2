"""Tasks of robots against geometry computed from matrices, closed forms, and scipy's constrained minimization."""

from __future__ import annotations

import re
from dataclasses import replace
from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation
from test_urdf import joint, link, place, written

from algorithms.kinematics import (
    DescriptionError,
    FloatingBaseError,
    Reaching,
    ReachStatus,
    Robot,
    tasks,
)
from gacompiler.objects import PGA3
from generated import pga3
from tests.support.all_cases import all_cases

PANDA = Robot.named("panda")
LOW, HIGH = PANDA.limits[:, :2].T
READY = np.array([0, 0, 0, -1.5, 0, 1.5, 0.8])
COUNT = 60


def poses(seed: int) -> np.ndarray:
    """Matrices of reachable poses."""
    return PANDA.pose(np.random.default_rng(seed).uniform(LOW, HIGH, (COUNT, 7)))


def reached(goals: Any) -> np.ndarray:
    """Matrices of the configurations that are found, all of which are to reach their tasks within the limits."""
    found = PANDA.reach(goals, near=READY)
    assert (found.status == ReachStatus.OK).all()
    assert ((found.q >= LOW) & (found.q <= HIGH)).all()
    return PANDA.pose(found.q)


def test_a_pose() -> None:
    goal = poses(0)
    assert np.abs(reached(tasks.pose(goal)) - goal).max() < 3e-9
    assert np.abs(reached(tasks.pose(-pga3.motor_from_matrix(goal))) - goal).max() < 3e-9


def test_a_point_of_a_link_at_a_place() -> None:
    goal, point = poses(1), np.array([0.1, -0.2, 0.05])
    target = goal[:, :3, :3] @ point + goal[:, :3, 3]
    found = reached([tasks.position(target, point=point)])
    assert np.abs(found[:, :3, :3] @ point + found[:, :3, 3] - target).max() < 3e-9


def test_a_point_on_a_line_and_an_axis_along_it() -> None:
    along = np.array([0.6, 0, 0.8])
    goal = poses(2)[:, :3, 3]
    line = pga3.join_points(goal, goal + along)
    found = reached([tasks.on_line(line), tasks.direction(-along, axis=[0, 2, 0])])
    assert np.abs(np.cross(found[:, :3, 3] - goal, along)).max() < 3e-9
    assert np.abs(found[:, :3, 1] + along).max() < 3e-9


def test_a_point_on_a_plane_and_a_level_axis() -> None:
    goal = poses(3)[:, :3, 3]
    plane = np.column_stack([np.tile([0, 0, -2.0], (COUNT, 1)), 2 * goal[:, 2]])
    found = reached([tasks.on_plane(plane), tasks.across([0, 0, 5], axis=[1, 0, 0])])
    assert np.abs(found[:, 2, 3] - goal[:, 2]).max() < 3e-9 and np.abs(found[:, 2, 0]).max() < 3e-9


def test_a_point_on_a_sphere_looking_at_its_centre() -> None:
    goal = poses(4)
    centre = goal[:, :3, 3] + 0.3 * goal[:, :3, 2]
    found = reached([tasks.on_sphere(centre, 0.3), tasks.look_at(centre)])
    assert np.abs(found[:, :3, 3] + 0.3 * found[:, :3, 2] - centre).max() < 5e-9


def test_an_orientation() -> None:
    goal = poses(5)
    assert np.abs(reached([tasks.orientation(goal)])[:, :3, :3] - goal[:, :3, :3]).max() < 3e-9


def test_elements_are_targets() -> None:
    goals = [tasks.on_plane(PGA3.plane(0, 0, 2, -1)), tasks.position(PGA3.point(0.4, 0.1, 0.5), weight=2)]
    found = PANDA.reach(goals, near=READY)
    assert found.status == ReachStatus.OK
    assert np.abs(PANDA.pose(found.q)[:3, 3] - [0.4, 0.1, 0.5]).max() < 3e-9
    with pytest.raises(TypeError, match="plane"):
        tasks.on_plane(PGA3.point(0, 0, 1))


def test_the_current_configuration_is_kept() -> None:
    """Nothing moves where all is reached, and a small change of the target changes the configuration little."""
    q = np.random.default_rng(6).uniform(LOW + 0.1, HIGH - 0.1, (COUNT, 7))
    there = PANDA.reach(tasks.pose(PANDA.forward(q)), near=q)
    assert np.abs(there.q - q).max() < 1e-12
    near = PANDA.reach(tasks.pose(PANDA.forward(q)), near=np.clip(q + 0.02, LOW, HIGH))
    assert (near.status == ReachStatus.OK).all() and np.abs(near.q - q).max() < 0.3


PLANAR = Robot.from_dh([{"a": 0.5}, {"a": 0.4}])


def test_a_place_out_of_reach() -> None:
    """The nearest configuration is stretched towards the place: the distance has a closed form."""
    target = np.array([1.2, 0.9, 0.0])
    found = PLANAR.reach([tasks.position(target)], near=[0.1, 1.0])
    assert found.status == ReachStatus.NEAREST
    assert found.distances == pytest.approx([1.5 - 0.9], abs=1e-6)
    assert found.q == pytest.approx([np.arctan2(0.9, 1.2), 0.0], abs=3e-3)


def test_limits_hold() -> None:
    """The elbow can only be bent by a radian or more, which leaves a gap in closed form."""
    arm = replace(PLANAR, limits=np.array([[-pi, pi, np.inf, np.inf], [1.0, 2.0, np.inf, np.inf]]))
    found = arm.reach([tasks.position([2.0, 0.0, 0.0])], near=[0.0, 0.0])
    assert found.q[1] == 1.0
    assert found.distances == pytest.approx([2 - sqrt(0.25 + 0.16 + 0.4 * np.cos(1))], abs=1e-6)


AXES = [[0, 0, 1, 0, 0, 0], [0, -1, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0]]
GANTRY = Robot.from_screws(AXES, np.eye(8)[0], ["prismatic"] * 3)


def test_weights_of_tasks_that_contradict_each_other() -> None:
    """The mean of two places, weighted by squares."""
    first, second = np.array([1.0, 2.0, 3.0]), np.array([2.0, 0.0, -1.0])
    found = GANTRY.reach([tasks.position(first), tasks.position(second, weight=3)])
    mean = (first + 9 * second) / 10
    assert found.status == ReachStatus.NEAREST
    assert found.q == pytest.approx(mean, abs=1e-7)
    assert found.distances == pytest.approx([np.linalg.norm(mean - first), np.linalg.norm(mean - second)], abs=1e-7)


def test_rest_is_approached_as_far_as_the_tasks_allow() -> None:
    """A gantry moves to the projection on a plane; an arm to what scipy finds under the same constraints."""
    normal, rest = np.array([2.0, 1.0, 2.0]) / 3, np.array([0.5, -0.2, 0.1])
    plane = tasks.on_plane([*normal, -1.5])
    found = GANTRY.reach([plane], near=[3, 3, 3], rest=rest)
    assert found.status == ReachStatus.OK
    assert found.q == pytest.approx(rest + (1.5 - normal @ rest) * normal, abs=1e-5)

    targets = poses(7)[:8, :3, 3]
    found = PANDA.reach([tasks.position(targets)], near=READY, rest=READY)
    assert (found.status == ReachStatus.OK).all()
    for q, target in zip(found.q, targets, strict=True):
        best = minimize(
            lambda x: ((x - READY) ** 2).sum(),
            q,
            jac=lambda x: 2 * (x - READY),
            bounds=list(zip(LOW, HIGH, strict=True)),
            constraints=[{"type": "eq", "fun": lambda x, goal=target: PANDA.pose(x)[:3, 3] - goal}],
            method="SLSQP",
            options={"ftol": 1e-12, "maxiter": 200},
        )
        assert ((q - READY) ** 2).sum() < (1 + 1e-4) * best.fun


def test_what_is_left_is_a_length_or_an_angle() -> None:
    """Of tasks that contradict each other."""
    place, spot, along, goal = np.ones(3), np.array([-1, 0.5, 0]), np.array([0, 0.6, 0.8]), np.eye(4)
    goal[:3, :3] = Rotation.from_rotvec([0.3, 1.0, -2.0]).as_matrix()
    goals = [
        tasks.position(place),
        tasks.direction(along),
        tasks.across(along, axis=[1, 0, 0]),
        tasks.look_at(spot),
        tasks.orientation(goal),
    ]
    found = PANDA.reach(goals, near=READY)
    assert found.status == ReachStatus.NEAREST
    pose = PANDA.pose(found.q)
    x, _, z, there = pose[:3].T
    to_spot = (spot - there) / np.linalg.norm(spot - there)
    turned = Rotation.from_matrix(goal[:3, :3] @ pose[:3, :3].T).magnitude()
    angles = np.arccos(z @ along), abs(np.arcsin(x @ along)), np.arccos(z @ to_spot), turned
    assert min(angles) > 0.01
    assert np.allclose(found.distances, [np.linalg.norm(place - there), *angles], atol=1e-9)


@pytest.mark.parametrize("weight", [1e-9, 1.0, 1e9])
def test_only_ratios_of_weights_matter(weight: float) -> None:
    goals = [tasks.position([0.4, 0.1, 0.5], weight=weight), tasks.direction([0, 0, -1], weight=2 * weight)]
    assert PANDA.reach(goals, near=READY).status == ReachStatus.OK


def test_motors_of_any_norm_and_limits_of_one_side() -> None:
    motor = PANDA.forward(READY)
    found = PANDA.reach(tasks.pose(-3 * motor), near=READY + 0.1)
    assert found.status == ReachStatus.OK
    assert np.abs(PANDA.pose(found.q) - pga3.motor_to_matrix(motor)).max() < 3e-9
    assert PANDA.reach(tasks.orientation(np.diag([2.0, 1, 1, 1])), near=READY).status == ReachStatus.NOT_FINITE
    limits = PANDA.limits.copy()
    for side in ((4.0, np.inf), (-np.inf, -4.0)):
        limits[0, :2] = side
        found = replace(PANDA, limits=limits).reach(tasks.position([0.1, 0.2, 5.0]), near=READY)
        assert found.status == ReachStatus.NEAREST and side[0] <= found.q[0] <= side[1]


def test_lines_in_single_precision_and_none() -> None:
    places = np.random.default_rng(9).uniform(0.2, 0.5, (5, 3)).astype(np.float32)
    lines = pga3.normalize_line(pga3.join_points(places, places + np.float32([0.3, -0.2, 0.5])))
    assert lines.dtype == np.float32
    assert (PANDA.reach(tasks.on_line(lines), near=READY).status == ReachStatus.OK).all()
    for task in (tasks.on_line(np.zeros((0, 6))), tasks.on_plane(np.zeros((0, 4)))):
        assert PANDA.reach(task, near=READY).status.shape == (0,)


def test_a_task_does_not_change_with_its_arguments() -> None:
    target = np.array([0.4, 0.1, 0.5])
    reaching = Reaching(PANDA, tasks.position(target))
    target[:] = 9
    reaching.targets[:] = 9
    assert reaching(READY).status == ReachStatus.OK


TWO_ARMS = [
    *[link(name) for name in ("base", "body", "left", "left hand", "right", "right hand", "fixed")],
    joint("turn", "revolute", "base", "body", place("0 0 0.5") + '<axis xyz="0 0 1"/><limit lower="-2" upper="2"/>'),
    joint("a", "revolute", "body", "left", place("0 0.2 0") + '<axis xyz="0 0 1"/><limit lower="-2" upper="2"/>'),
    joint("b", "revolute", "left", "left hand", place("0.4 0 0") + '<axis xyz="0 0 1"/><limit lower="-2" upper="2"/>'),
    joint("c", "revolute", "body", "right", place("0 -0.2 0") + '<axis xyz="0 0 1"/><limit lower="-2" upper="2"/>'),
    joint("d", "revolute", "right", "right hand", place("0.4 0 0") + '<axis xyz="0 0 1"/>'
          '<mimic joint="c" multiplier="-2" offset="0.1"/>'),
    joint("e", "fixed", "base", "fixed"),
]  # fmt: skip


def test_links_of_a_tree(tmp_path: Path) -> None:
    """Both hands are led to places at once; one arm has a joint that follows another one."""
    robot = Robot.from_urdf(written(tmp_path, TWO_ARMS), tip="left hand")
    tip = [0.3, 0.0, 0.0]
    q = np.random.default_rng(8).uniform(-1, 1, (40, robot.n_joints))

    def at(name: str, point: list[float], q: np.ndarray) -> np.ndarray:
        return (pga3.motor_to_matrix(robot.link(name, q)) @ [*point, 1])[..., :3]

    left, right = at("left hand", tip, q), at("right", [0.4, 0, 0], q)
    goals = [
        tasks.position(left, link="left hand", point=tip),
        tasks.on_sphere(right, 0.05, link="right", point=[0.4, 0, 0]),
    ]
    found = robot.reach(goals)
    assert (found.status == ReachStatus.OK).all()
    assert np.abs(at("left hand", tip, found.q) - left).max() < 3e-9
    gaps = np.linalg.norm(at("right", [0.4, 0, 0], found.q) - right, axis=-1)
    assert np.abs(gaps - 0.05).max() < 3e-9
    with pytest.raises(DescriptionError, match="d and c follow one variable"):
        robot.reach([tasks.position(right, link="right hand")])
    with pytest.raises(DescriptionError, match="'fixed' is fixed to the base"):
        robot.reach([tasks.position([0, 0, 0], link="fixed")])


def test_targets_change_in_a_control_loop() -> None:
    reaching = Reaching(PANDA, [tasks.position([0.4, 0, 0.5]), tasks.direction([0, 0, -1])])
    q = reaching(READY).q
    for angle in np.linspace(0, 1, 30):
        targets = reaching.targets.copy()
        targets[0, :2] = 0.4 * np.cos(angle), 0.4 * np.sin(angle)
        found = reaching(q, targets=targets)
        assert found.status == ReachStatus.OK and np.abs(found.q - q).max() < 0.2
        q = found.q
    assert np.abs(PANDA.pose(q)[:3, 3] - targets[0]).max() < 3e-9


def test_what_is_not_finite_and_empty_batches() -> None:
    targets = np.array([[0.4, 0.1, 0.5], [np.nan, 0, 0], [0.3, 0.1, 0.6]])
    found = PANDA.reach([tasks.position(targets)], near=READY)
    assert list(found.status) == [ReachStatus.OK, ReachStatus.NOT_FINITE, ReachStatus.OK]
    assert np.isnan(found.q[1]).all() and np.isnan(found.distances[1]).all() and np.isfinite(found.q[[0, 2]]).all()
    alone = PANDA.reach([tasks.position(targets[2])], near=READY)
    assert np.array_equal(alone.q, found.q[2])
    none = PANDA.reach([tasks.position(targets[:0])], near=READY)
    assert none.q.shape == (0, 7) and none.status.shape == (0,) and none.distances.shape == (0, 1)


@all_cases(
    "call, error, message",
    [
        (lambda: PANDA.reach([]), ValueError, "tasks: none"),
        (lambda: PANDA.reach("position"), TypeError, "tasks: str"),
        (lambda: PANDA.reach([tasks.position([0, 0, 0], link="hand")]), DescriptionError, "no link 'hand'"),
        (lambda: PANDA.reach(tasks.position(np.zeros((2, 3))), near=np.zeros((3, 7))), ValueError, "broadcast"),
        (lambda: PANDA.reach(tasks.position([0, 0, 0]), near=np.zeros(6)), ValueError, "near"),
        (lambda: tasks.position([0, 0]), ValueError, "target"),
        (lambda: tasks.position([0, 0, 0], weight=0), ValueError, "weight: 0"),
        (lambda: tasks.position([0, 0, 0], link=3), TypeError, "link: int"),  # type: ignore[arg-type]
        (lambda: tasks.direction([0, 0, 0]), ValueError, "length 0"),
        (lambda: tasks.direction([0, 0, 1], axis=[np.nan, 0, 0]), ValueError, "axis"),
        (lambda: tasks.on_plane([[1, 0, 0, 1], [0, 1, 0, 1]]), ValueError, "several directions"),
        (lambda: tasks.on_sphere([0, 0, 0], -1), ValueError, "radius: -1"),
        (lambda: tasks.pose(np.zeros((3, 3))), ValueError, "target: shape"),
    ],
)
def test_wrong_arguments(call: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call()


def test_a_floating_base_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FloatingBaseError, match="the base floats"):
        Robot.from_urdf(written(tmp_path, TWO_ARMS), base="floating").reach(tasks.position([0, 0, 0], link="left"))


def test_blocks_of_the_page_run() -> None:
    text = (Path(__file__).parents[2] / "docs/robots.md").read_text()
    sections = [
        ("## Several tasks", "## Robots whose base floats"),
        ("## Contacts and closed loops", "## Inverse kinematics"),
        ("`retime` finds", "## Accuracy"),
    ]
    texts = [text[text.index(first) : text.index(last)] for first, last in sections]
    blocks = re.findall(r"```python\n(.*?)```", "".join(texts), re.DOTALL)
    assert [word in "".join(blocks) for word in ("Reaching", "Constrained", "retime", "view")] == [True] * 4
    exec("\n".join(blocks), {})


def test_tasks_that_differ_in_more_than_targets() -> None:
    """The tables of the last tasks are kept: another point, axis, radius, weight or link needs others."""
    arm = Robot.named("panda")
    near, q = np.array([0.1, -0.4, 0.2, -1.8, 0.1, 1.6, 0.4]), np.array([0.3, -0.2, 0.1, -2.0, 0.2, 1.4, 0.1])
    place = arm.pose(q)[:3, 3]
    variants = [
        tasks.position(place),
        tasks.position(place + 0.02),
        tasks.position(place, point=[0, 0, 0.1]),
        tasks.on_sphere(place, 0.1),
        tasks.on_sphere(place, 0.2),
        tasks.direction([0, 0, -1]),
        tasks.direction([0, 0, -1], axis=[1, 0, 0]),
        [tasks.position(place, weight=2.0), tasks.position(place + 1, weight=1.0)],
        [tasks.position(place, weight=1.0), tasks.position(place + 1, weight=1.0)],
    ]
    for one in variants:
        found, other = arm.reach(one, near=near), Robot.named("panda").reach(one, near=near)
        assert np.array_equal(found.q, other.q) and np.array_equal(found.distances, other.distances)
        assert found.status == other.status


def test_single_calls_are_those_of_batches() -> None:
    """A single configuration in double precision takes a shorter way; its result is that of a row of a batch."""
    arm = Robot.named("panda")
    random = np.random.default_rng(6)
    near = np.array([0.1, -0.4, 0.2, -1.8, 0.1, 1.6, 0.4])
    q = near + random.uniform(-0.1, 0.1, (8, 7))
    goals = tasks.pose(arm.forward(q[0]))
    reaching = Reaching(arm, goals)
    for k, pose in enumerate(arm.forward(q)):
        one, many = reaching(q[k] - 0.05, targets=reaching.targets), reaching(q[k : k + 1] - 0.05)
        assert np.allclose(one.q, many.q[0], atol=1e-12) and one.status.shape == () and one.status.dtype == np.int8
        assert np.allclose(one.distances, many.distances[0], atol=1e-12)
        assert arm.reach(tasks.pose(pose), near=q[k] - 0.05).status == 0
    far = tasks.position([9.0, 0, 0])
    single, batch = Reaching(arm, far)(near), Reaching(arm, far)(near[None])
    assert single.status == batch.status[0] == ReachStatus.NEAREST and np.allclose(single.q, batch.q[0])
    assert Reaching(arm, far)(near * np.nan).status == ReachStatus.NOT_FINITE
