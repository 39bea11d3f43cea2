"""Measure how many reachable tasks are reached, and in which time, for the page of ``python -m benchmarks robots``."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from algorithms.kinematics import Reaching, Robot
from algorithms.kinematics.tasks import direction, look_at, on_line, on_plane, on_sphere, orientation, pose, position
from generated import pga3

from . import markdown

_ARMS = ("panda", "ur5")
_ENOUGH = 50.0
"""Microseconds in which a task is to be reached."""
_BESIDE = 0.05
"""Standard deviation of angles between a solution and the start of the search, in radians."""
_ASIDE = np.array([0.36, -0.48, 0.8])


def page(count: int) -> str:
    """Measure a number of tasks of each kind, and return text and a table as Markdown."""
    lines = [(name, kind, *_measured(Robot.named(name), kind, count)) for name in _ARMS for kind in _tasks(np.eye(4))]
    return "\n".join(
        [
            markdown.paragraph(
                f"{count} tasks of each kind, those of the end effector in random configurations within the limits.",
                "They are searched from configurations beside, whose angles differ by 0.05 rad, as in control loops,",
                "and from one fixed configuration in the middle of the limits.",
                "Times are microseconds of CPU time of single calls of `Reaching`.",
                f"Percentages are those of tasks that are reached, and that are reached within {_ENOUGH:.0f} us.",
            ),
            "",
            markdown.table(
                ("robot", "task", "from beside", "reached", "in time", "from the middle", "reached", "in time"), lines
            ),
        ]
    )


def _tasks(place: np.ndarray) -> dict[str, list[Any]]:
    """Return tasks of each kind that poses (..., 4, 4) fulfil."""
    point, axis = place[..., :3, 3], place[..., :3, 2]
    # A plane through the point with the normal _ASIDE.
    distance = -(point @ _ASIDE)[..., None]
    plane = np.concatenate([np.broadcast_to(_ASIDE, point.shape), distance], axis=-1)
    return {
        "position": [position(point)],
        "direction": [direction(axis)],
        "both": [position(point), direction(axis)],
        "line": [on_line(pga3.join_points(point, point + _ASIDE))],
        "plane": [on_plane(plane)],
        "sphere": [on_sphere(point + 0.2 * _ASIDE, 0.2)],
        "look at": [look_at(point + 0.5 * axis)],
        "orientation": [orientation(place)],
        "pose": [pose(place)],
    }


def _measured(robot: Robot, kind: str, count: int) -> tuple[str, ...]:
    rng = np.random.default_rng(46)
    low, high = np.clip(robot.limits.T[:2], -np.pi, np.pi)
    q = rng.uniform(low, high, (count, robot.n_joints))
    places = robot.pose(q)
    reaching, targets = Reaching(robot, _tasks(places[0])[kind]), Reaching(robot, _tasks(places)[kind]).targets
    reaching(q[0], targets=targets[0])  # loads what the first call needs
    beside = np.clip(q + _BESIDE * rng.normal(size=q.shape), low, high)
    figures: list[str] = []
    for starts in (beside, np.broadcast_to((low + high) / 2, q.shape)):
        spent, reached = np.empty(count), np.empty(count, bool)
        for k, (start, target) in enumerate(zip(starts.copy(), targets, strict=True)):
            begin = time.process_time_ns()
            found = reaching(start, targets=target)
            spent[k], reached[k] = (time.process_time_ns() - begin) / 1000, found.status == 0
        in_time = np.mean(reached & (spent <= _ENOUGH))
        figures += [f"{np.median(spent):.1f}", f"{100 * reached.mean():.1f} %", f"{100 * in_time:.1f} %"]
    return tuple(figures)
