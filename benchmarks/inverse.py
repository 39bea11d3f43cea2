"""Compare inverse kinematics with EAIK and ssik, for the page of ``python -m benchmarks robots``.

``python -m benchmarks.inverse COUNT`` compares the branches of all prebuilt arms of ssik in postures of four kinds.
"""

from __future__ import annotations

import importlib
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from statistics import median
from typing import Any

import numpy as np

from algorithms.kinematics import Robot, Status, elbow_angle
from generated import pga3

from . import markdown
from .libraries import installed

_EAIK = ("ur5", "puma560", "kr5", "irb140")
"""Named robots that EAIK decomposes."""
_SSIK = {
    "ur5": "universal_robots.ur5_ik",
    "puma560": "unimation.puma560_ik",
    "xarm6": "ufactory.xarm6_ik",
    "jaco2": "kinova.jaco2_ik",
    "crx10ia": "fanuc.crx10ia_ik",
    "piper": "agilex.piper_ik",
}
"""Prebuilt arms of ssik, whose axes and limits the robot takes. It has none for GoFa."""
_REDUNDANT = {"panda": "franka.panda_ik", "iiwa7": "kuka.iiwa7_ik"}
"""Arms with seven joints. Panda's last joint is locked, and iiwa is given its elbow angle."""
_REPEATS = 5
_REACHED = 1e-6
"""Branches of a peer whose pose differs by more than this in any entry are not counted."""
_SAME = 1e-4
"""Branches are the same if no angle differs by more than this."""


@dataclass(frozen=True, slots=True)
class _Peer:
    """A function from a pose to configurations, and the poses that it is given in its own form."""

    solve: Callable[[Any], np.ndarray]
    timed: Callable[[Any], object]
    poses: list[np.ndarray]


def page(count: int) -> str:
    """Measure a number of random poses of each arm, and return tables as Markdown."""
    return "\n".join(
        [
            markdown.paragraph(
                f"All branches of one pose given as a matrix: microseconds of CPU time, the median of {count} random",
                "poses, whose calls alternate with those of EAIK or of ssik's native solvers on the same poses.",
                "*Batch* is the time per pose of all of them in one call.",
                "*Found* counts the branches that reach their poses, those of the peer, and the union of both;",
                "*error* is the largest difference of an entry between the poses of our branches and the given ones.",
                "ssik takes axes and limits of each arm from its own table, and so does ours.",
            ),
            "",
            markdown.table(
                (
                    "peer",
                    "robot",
                    "method",
                    "one pose",
                    "peer",
                    "ratio",
                    "batch",
                    "found",
                    "by the peer",
                    "union",
                    "error",
                ),
                [_beside_eaik(name, count) for name in _EAIK] + [_beside_ssik(name, count) for name in _SSIK],
            ),
            markdown.paragraph(
                "Arms with seven joints have infinitely many configurations.",
                "Ours are all branches for one value of the redundant variable, that of the configuration whose pose",
                "it is, and ssik's are samples of the whole: times are not those of equal work.",
            ),
            "",
            markdown.table(
                ("robot", "given", "one pose", "branches", "within limits", "ssik", "its configurations"),
                [_redundant(name, count) for name in _REDUNDANT],
            ),
        ]
    )


def _beside_eaik(name: str, count: int) -> tuple[str, ...]:
    if not installed("eaik"):
        return ("EAIK", name, "EAIK is not installed", *[markdown.MISSING] * 8)
    from eaik.IK_HP import HPRobot

    arm = Robot.named(name)
    poses = _poses(arm, count)[1]
    tool = pga3.motor_to_matrix(arm.tool)
    points = np.vstack([np.zeros(3), pga3.line_support(arm.axes), tool[:3, 3]])
    peer = HPRobot(pga3.line_to_direction_moment(arm.axes)[0], np.diff(points, axis=0))
    turned = poses.copy()
    turned[:, :3, :3] = poses[:, :3, :3] @ tool[:3, :3].T
    given = [np.asfortranarray(pose) for pose in turned]
    return ("EAIK", name, *_compared(arm, poses, _Peer(lambda pose: np.array(peer.IK(pose).Q), peer.IK, given)))


def _beside_ssik(name: str, count: int) -> tuple[str, ...]:
    if not installed("ssik"):
        return ("ssik", name, "ssik is not installed", *[markdown.MISSING] * 8)
    solver, arm = prebuilt(_SSIK[name])
    poses = _poses(arm, count)[1]
    call = partial(solver, respect_limits=False)
    peer = _Peer(lambda pose: np.array([found.q for found in call(pose)]), call, list(poses))
    return ("ssik", name, *_compared(arm, poses, peer))


def _compared(arm: Robot, poses: np.ndarray, peer: _Peer) -> tuple[str, ...]:
    """Return what a row has after the names."""
    own, theirs = _alternating([partial(arm.inverse, pose) for pose in poses], peer)
    batch = min(_spent(lambda: arm.inverse(poses)) for _ in range(_REPEATS)) / len(poses)
    found, counts, error = arm.inverse(poses), np.zeros(3, int), 0.0
    for k, pose in enumerate(poses):
        ours = found.q[k][found.valid[k]]
        others = peer.solve(peer.poses[k]).reshape(-1, arm.n_joints)
        right = np.abs(arm.pose(others) - pose).max((-2, -1)) < _REACHED
        ours, others = _different(ours), _different(others[right])
        counts += (len(ours), len(others), len(_different(np.concatenate([ours, others]))))
        error = max(error, float(np.abs(arm.pose(ours) - pose).max(initial=0.0)))
    times = (f"{own:.1f}", f"{theirs:.1f}", markdown.ratio(own / theirs), f"{batch:.2f}")
    return (found.method, *times, *map(str, counts), f"{error:.0e}")


def _redundant(name: str, count: int) -> tuple[str, ...]:
    given = "elbow angle" if name.startswith("iiwa") else "last joint"
    if not installed("ssik"):
        return (name, given, "ssik is not installed", *[markdown.MISSING] * 4)
    solver, arm = prebuilt(_REDUNDANT[name])
    q, poses = _poses(arm, count)
    values = elbow_angle(arm, q) if given == "elbow angle" else q[:, 6]
    options = [{"elbow": x} if given == "elbow angle" else {"locked": {6: x}} for x in values]
    calls = [partial(arm.inverse, pose, **known) for pose, known in zip(poses, options, strict=True)]
    own, theirs = _alternating(calls, _Peer(solver, solver, list(poses)))
    found = [call() for call in calls]
    branches, within = (sum(int(getattr(x, what).sum()) for x in found) for what in ("valid", "within_limits"))
    others = sum(len(solver(pose)) for pose in poses)
    numbers = (f"{branches / count:.1f}", f"{within / count:.1f}", f"{theirs:.1f}", f"{others / count:.0f}")
    return (name, given, f"{own:.1f}", *numbers)


def _poses(arm: Robot, count: int) -> tuple[np.ndarray, np.ndarray]:
    low, high = np.clip(arm.limits.T[:2], -np.pi, np.pi)
    q = np.random.default_rng(4).uniform(low, high, (count, arm.n_joints))
    return q, arm.pose(q)


def _alternating(calls: list[Callable[[], object]], peer: _Peer) -> tuple[float, float]:
    """Return the median times of our calls and of the peer's, in microseconds."""
    own: list[float] = []
    theirs: list[float] = []
    for call, pose in zip(calls, peer.poses, strict=True):
        other = partial(peer.timed, pose)
        call(), other()
        for times, timed in ((own, call), (theirs, other)):
            times.append(min(_spent(timed) for _ in range(_REPEATS)))
    return median(own), median(theirs)


def _spent(call: Callable[[], object]) -> float:
    """Return the CPU time of a call in microseconds."""
    start = time.process_time_ns()
    call()
    return (time.process_time_ns() - start) / 1000


def _different(q: np.ndarray) -> np.ndarray:
    """Return configurations (N, n) without repetitions up to whole turns."""
    away = np.abs((q[:, None] - q + np.pi) % (2 * np.pi) - np.pi).max(-1)
    return q[~np.tril(away < _SAME, -1).any(-1)]


def prebuilt(path: str) -> tuple[Callable[..., Any], Robot]:
    """Return a solver of ssik and the same robot, read from a description with its numbers."""
    module = importlib.import_module(f"ssik.prebuilt.{path}")
    body = module._build_kb()
    name = path.rpartition(".")[2]
    parts = [f'<robot name="{name}"><link name="link0"/>']
    place = np.eye(4)
    for k, joint in enumerate(body.joints):
        kind, inside = "continuous", f'<axis xyz="{_words(joint.axis)}"/>'
        if joint.limits is not None:
            kind, (low, high) = joint.joint_type, map(float, joint.limits)
            inside += f'<limit lower="{low!r}" upper="{high!r}" effort="1" velocity="1"/>'
        parts.append(_joint(k, kind, place @ joint.T_left, inside))
        place = np.asarray(joint.T_right)
    parts.append(_joint(len(body.joints), "fixed", place, ""))
    return module.solve, Robot.from_urdf("".join([*parts, "</robot>"]))


def _joint(k: int, kind: str, place: np.ndarray, inside: str) -> str:
    """Return the XML text of a joint and of the link that it moves."""
    turn = place[:3, :3]
    angles = (
        np.arctan2(turn[2, 1], turn[2, 2]),
        -np.arcsin(np.clip(turn[2, 0], -1, 1)),
        np.arctan2(turn[1, 0], turn[0, 0]),
    )
    return (
        f'<link name="link{k + 1}"/><joint name="joint{k + 1}" type="{kind}"><parent link="link{k}"/>'
        f'<child link="link{k + 1}"/><origin xyz="{_words(place[:3, 3])}" rpy="{_words(angles)}"/>{inside}</joint>'
    )


def _words(numbers: Any) -> str:
    return " ".join(repr(float(x)) for x in numbers)


def recall(count: int, seed: int = 1) -> str:
    """Compare the regular branches of ssik's prebuilt arms with six joints, in postures of four kinds.

    Returns a table in Markdown: of each arm and kind the regular configurations, how many of them are not among the
    branches of their own poses, with which statuses, and the regular branches of ours, of ssik and of both together.
    """
    import ssik

    lines = []
    for path in (one.import_path.removeprefix("ssik.prebuilt.") for one in ssik.list_arms() if one.dof == 6):
        solver, arm = prebuilt(path)
        rng = np.random.default_rng(seed)
        for kind in ("random", "fourth angle 0", "wrist, 90 degrees", "all, 15 degrees"):
            q = rng.uniform(-np.pi, np.pi, (count, 6))
            if kind == "fourth angle 0":
                q[:, 3] = 0.0
            elif kind == "wrist, 90 degrees":
                q[:, 3:] = rng.integers(-1, 3, (count, 3)) * np.pi / 2
            elif kind == "all, 15 degrees":
                q = rng.integers(-11, 13, (count, 6)) * np.pi / 12
            poses = arm.pose(q)
            found, missing, counts = arm.inverse(poses), dict.fromkeys(Status, 0), np.zeros(3, int)
            for k, pose in enumerate(poses):
                ours = _regular(arm, found.q[k][found.valid[k]])
                others = np.array([one.q for one in solver(pose, respect_limits=False)]).reshape(-1, 6)
                others = _regular(arm, others[np.abs(arm.pose(others) - pose).max((-2, -1)) < _REACHED])
                own = _regular(arm, q[k : k + 1])
                missing[Status(found.status[k])] += len(_different(np.concatenate([ours, own]))) - len(_different(ours))
                both = _different(np.concatenate([ours, others]))
                counts += (len(_different(ours)), len(_different(others)), len(both))
            names = ", ".join(f"{many} {status.name}" for status, many in missing.items() if many) or "0"
            lines.append((path, kind, str(len(_regular(arm, q))), names, *map(str, counts)))
    return markdown.table(("arm", "postures", "regular", "missing", "branches", "ssik", "union"), lines)


def _regular(arm: Robot, q: np.ndarray) -> np.ndarray:
    return q[np.linalg.svd(arm.jacobian(q), compute_uv=False)[:, -1] > 0.01]


if __name__ == "__main__":
    print(recall(int(sys.argv[1])))
