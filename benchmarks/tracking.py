"""How long steps of tracking and body-eye calibration take, beside numpy and scipy."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from algorithms.estimation import (
    Tracker,
    body_eye,
    clock_offset,
    image_of_point,
    joint_axis,
    pan_tilt_head,
)
from algorithms.kinematics import Robot
from generated import pga3

from . import pages
from .libraries import installed
from .machine import version
from .tasks import OURS, Task, interleaved, others_text, time_text

PAGE = Path("docs/tracking-speed.md")
ROUNDS = 15
Array = np.ndarray[Any, Any]


def tasks(quick: bool) -> list[Task]:
    """All problems; peers only where they are installed."""
    return [*_steps(quick), *_calibration(quick)]


def _steps(quick: bool) -> list[Task]:
    rng = np.random.default_rng(0)
    arm = Robot.named("ur5")
    tracker, q = Tracker(arm), 0.3 * rng.normal(size=6)
    line, line_step = pga3.join_points([0.5, 0.2, 0.1], [0.2, 0.9, 0.7]), tracker.kernel("line")
    plane, plane_step = np.array([0.2, 0.3, 0.9, -2.0]), tracker.kernel("plane")
    still, pair, triple = np.zeros(6), np.zeros(2), np.zeros(3)
    return [
        *_of_points("pan-tilt head", pan_tilt_head(), rng, quick),
        *_of_points("UR5", arm, rng, quick),
        Task("UR5: rates for a line", 1, {OURS: lambda: line_step(q, line, still, pair, pair)}),
        Task("UR5: rates for a plane", 1, {OURS: lambda: plane_step(q, plane, still, triple, triple)}),
    ]


def _of_points(title: str, robot: Robot, rng: np.random.Generator, quick: bool) -> list[Task]:
    q, still, goal = 0.3 * rng.normal(size=robot.n_joints), np.zeros(6), np.zeros(2)
    many = 0.3 * rng.normal(size=(100 if quick else 10_000, robot.n_joints))
    tracker = Tracker(robot)
    point = pga3.move_point(robot.forward(q), [0.1, 0.2, 1.5])
    rates = tracker.kernel("point")
    single: dict[str, Callable[[], object]] = {
        OURS: lambda: rates(q, point, still, goal, goal),
        "numpy pinv": by_numpy(robot, q, point),
        **({"Pinocchio and numpy": by_pinocchio(robot, q, point)} if installed("pinocchio") else {}),
    }
    method: dict[str, Callable[[], object]] = {OURS: lambda: tracker.rates_for_point(q, point)}
    torques: dict[str, Callable[[], object]] = {OURS: lambda: tracker.forces_for_point(q, q, point)}
    batch: dict[str, Callable[[], object]] = {OURS: lambda: rates(many, point, still, goal, goal)}
    return [
        Task(f"{title}: rates for a point", 1, single),
        Task(f"{title}: the same by `Tracker.rates_for_point`", 1, method),
        Task(f"{title}: torques by `Tracker.forces_for_point`", 1, torques),
        Task(f"{title}: rates for {len(many):,} configurations", len(many), batch),
    ]


def by_numpy(robot: Robot, q: Array, point: Array) -> Callable[[], Array]:
    """The law with gain 2 for a point, with the Jacobian from here and numpy's pseudoinverse."""

    def step() -> Array:
        image = image_of_point(robot, q, point)
        return np.asarray(np.linalg.pinv(image.jacobian) @ (-2.0 * image.values))

    return step


def by_pinocchio(robot: Robot, q: Array, point: Array) -> Callable[[], Array]:
    """The same law with the geometric Jacobian of Pinocchio."""
    pin: Any = __import__("pinocchio")
    model = pin.Model()
    parent, place = 0, pin.SE3.Identity()
    for k, axis in enumerate(robot.axes):
        direction = np.array([axis[2], -axis[1], axis[0]])
        foot = np.cross(direction, axis[3:])
        joint = pin.JointModelRevoluteUnaligned(*direction)
        here = pin.SE3(np.eye(3), foot)
        parent = model.addJoint(parent, joint, place.actInv(here), f"joint {k}")
        place = here
    tool = pga3.motor_to_matrix(robot.tool)
    frame = model.addFrame(
        pin.Frame("camera", parent, place.actInv(pin.SE3(tool[:3, :3], tool[:3, 3])), pin.FrameType.OP_FRAME)
    )
    data = model.createData()

    def step() -> Array:
        jacobian = pin.computeFrameJacobian(model, data, q, frame, pin.ReferenceFrame.LOCAL)
        pin.forwardKinematics(model, data, q)
        x, y, z = pin.updateFramePlacement(model, data, frame).actInv(point)
        x, y = x / z, y / z
        rows = np.array([
            [-1 / z, 0, x / z, x * y, -(1 + x * x), y],
            [0, -1 / z, y / z, 1 + y * y, -x * y, -x],
        ])  # fmt: skip
        return np.asarray(np.linalg.pinv(rows @ jacobian) @ (-2.0 * np.array([x, y])))

    return step


def _calibration(quick: bool) -> list[Task]:
    rng = np.random.default_rng(0)
    head = pan_tilt_head()
    points = pga3.move_point(head.tool, rng.uniform([-0.7, -0.5, 0.7], [0.7, 0.5, 2.0], (20, 3)))
    sweeps = []
    for joint, reach in ((0, 0.5), (1, 0.4)):
        q = np.zeros((20, 2))
        q[:, joint] = np.linspace(-reach, reach, 20)
        seen = pga3.move_point_back(head.forward(q)[:, None], points)
        sweeps.append(seen + 1e-4 * rng.normal(size=seen.shape))
    times = np.arange(0, 10 if quick else 60, 0.02)
    wobble = np.stack([np.sin(1.3 * times), np.sin(1.41 * times + 1), np.cos(0.7 * times)], -1)
    poses = pga3.motor_from_rotation_vector_translation(wobble, wobble)
    return [
        Task(
            "an axis from 20 points in 20 frames",
            1,
            {OURS: lambda: joint_axis(sweeps[0]), "scipy least_squares": by_scipy(sweeps[0])},
        ),
        Task("the chain of a head: 2 x 20 frames", 1, {OURS: lambda: body_eye(sweeps[0], sweeps[1], head.axes)}),
        Task(f"clocks of {len(times):,} poses each", 1, {OURS: lambda: clock_offset(times + 0.1, poses, times, poses)}),
    ]


def by_scipy(points: Array) -> Callable[[], Array]:
    """The least-squares axis of all circles by scipy, from the line nearest to the bisector planes."""
    line = joint_axis(points, refine=False).line
    direction, moment = pga3.line_to_direction_moment(line)
    foot = np.cross(direction, moment)
    basis = np.linalg.svd(direction[None])[2][1:]

    def residual(x: Array) -> Array:
        axis = direction + x[:2] @ basis
        axis = axis / np.linalg.norm(axis)
        arms = points - (foot + x[2:] @ basis)
        height = arms @ axis
        radius = np.linalg.norm(arms - height[..., None] * axis, axis=-1)
        return np.concatenate([(each - each.mean(0)).ravel() for each in (height, radius)])

    def solve() -> Array:
        x = least_squares(residual, np.zeros(4), method="lm", xtol=1e-12, ftol=1e-12).x
        axis = direction + x[:2] @ basis
        axis = axis / np.linalg.norm(axis)
        return np.array([axis[2], -axis[1], axis[0], *np.cross(foot + x[2:] @ basis, axis)])

    return solve


def page(found: list[tuple[Task, dict[str, float]]], rounds: int) -> str:
    """All figures as Markdown."""
    lines = [
        "# How fast tracking is",
        "",
        f"Written by `python -m benchmarks tracking`, beside numpy {np.__version__}, scipy {version('scipy')} and",
        f"Pinocchio {version('pin')}, on one thread. Microseconds for one problem: the least of {rounds} rounds in",
        "which libraries alternate. Pinocchio computes the Jacobian of the camera, numpy the rest of the same law.",
        "",
        "| | here | others |",
        "| --- | ---: | --- |",
    ]
    for task, spent in found:
        lines.append(f"| {task.name} | {time_text(spent[OURS])} | {others_text(spent)} |")
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page; arguments are those of the command line, or by default of the process."""
    options = pages.options("tracking", __doc__, PAGE).parse_args(arguments)
    out: Path = options.out
    rounds = 1 if options.quick else ROUNDS
    found = [(task, interleaved(task, rounds)) for task in tasks(options.quick)]
    return pages.publish("tracking", out, page(found, rounds), f"{len(found)} tasks")


if __name__ == "__main__":
    sys.exit(main())
