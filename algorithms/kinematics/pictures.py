"""Figures of robots, samples of their workspace, and animations."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array
from ..extras import extra
from .robot import Robot

with extra("pictures", __name__):
    from matplotlib.animation import FuncAnimation, PillowWriter
    from matplotlib.figure import Figure


def skeleton(robot: Robot, q: ArrayLike) -> Reals:
    """Return the line segments of a stick figure of a robot.

    Parameters
    ----------
    robot : Robot
    q : array_like, (n,)

    Returns
    -------
    array, (N + 1, 2, 3)
        Start and end points: for each joint the origin of its parent's frame and of its own frame, and finally the
        origin of the frame of joint `tip` and the end effector.

    Raises
    ------
    TypeError, ValueError
        As in `Robot.forward`.
    """
    frames = pga3.motor_to_matrix(robot.forward_all(q))[:, :3, 3]
    tip = robot.pose(q)[:3, 3]
    starts = [frames[parent] if parent >= 0 else np.zeros(3) for parent in robot.parents]
    return np.array([*zip(starts, frames, strict=True), (frames[robot.tip], tip)])


def workspace(robot: Robot, count: int, seed: int = 0) -> Reals:
    """Return positions of the end effector at random configurations within the joint limits.

    Parameters
    ----------
    robot : Robot
        Missing limits are replaced by -pi and pi, or by -1 m and 1 m for prismatic joints.
    count : int
    seed : int, optional

    Returns
    -------
    array, (count, 3)
    """
    width = np.full(robot.n_joints, np.pi)
    if not robot.coupling.size:
        width = np.array([np.pi if kind.value == "revolute" else 1.0 for kind in robot.kinds])
    low, high = robot.limits[:, 0], robot.limits[:, 1]
    low, high = np.where(np.isfinite(low), low, -width), np.where(np.isfinite(high), high, width)
    q = np.random.default_rng(seed).uniform(low, high, (count, robot.n_joints))
    return robot.pose(q)[:, :3, 3]


def draw(robot: Robot, q: ArrayLike, cloud: ArrayLike | None = None) -> Figure:
    """Return a figure of a robot in one configuration.

    Parameters
    ----------
    robot : Robot
    q : array_like, (n,)
    cloud : array_like, (count, 3), optional
        Further points to draw, as returned by `workspace`.

    Raises
    ------
    TypeError, ValueError
        As in `Robot.forward`, or if `cloud` is not an array of points.
    """
    figure, axes = _stage(robot)
    if cloud is not None:
        points = real_array(cloud, "cloud", (-1, 3), "points")
        axes.scatter(*points.T, s=1, alpha=0.2, linewidths=0, color="tab:gray")
    _lines(axes, skeleton(robot, q))
    axes.set_aspect("equal")
    return figure


def animate(robot: Robot, q: ArrayLike, path: str | Path, frames_per_second: int = 25) -> Path:
    """Write an animation of a motion with the path of the end effector: a GIF, or an HTML page (``.html``).

    Parameters
    ----------
    robot : Robot
    q : array_like, (frames, n)
    path : str or Path
    frames_per_second : int, optional

    Returns
    -------
    Path
        The path of the file.

    Raises
    ------
    OSError
        If the file cannot be written.
    TypeError, ValueError
        If `q` is not an array of configurations.
    """
    motion = real_array(q, f"{robot.name}: q", (-1, robot.n_positions), "configurations")
    figure, axes = _stage(robot)
    trace = robot.pose(motion)[:, :3, 3]
    axes.plot(*trace.T, linewidth=1, color="tab:orange")
    drawn = _lines(axes, skeleton(robot, motion[0]))
    reach = np.abs(
        np.concatenate([skeleton(robot, one).reshape(-1, 3) for one in motion[:: max(1, len(motion) // 50)]])
    )
    size = 1.05 * reach.max()
    axes.set(xlim=(-size, size), ylim=(-size, size), zlim=(-size, size))

    def show(k: int) -> list[Any]:
        for line, (start, end) in zip(drawn, skeleton(robot, motion[k]), strict=True):
            line.set_data_3d(*np.array([start, end]).T)
        return drawn

    film = FuncAnimation(figure, show, frames=len(motion), blit=False, interval=1000 / frames_per_second)
    if Path(path).suffix == ".html":
        Path(path).write_text(film.to_jshtml(frames_per_second), encoding="utf-8")
    else:
        film.save(path, PillowWriter(fps=frames_per_second))
    return Path(path)


def _stage(robot: Robot) -> tuple[Figure, Any]:
    figure = Figure(figsize=(5, 5))
    axes = figure.add_subplot(projection="3d")
    axes.set(title=robot.name, xlabel="x/m", ylabel="y/m", zlabel="z/m")
    return figure, axes


def _lines(axes: Any, segments: Reals) -> list[Any]:
    return [axes.plot(*segment.T, "o-", linewidth=3, markersize=4, color="tab:blue")[0] for segment in segments]
