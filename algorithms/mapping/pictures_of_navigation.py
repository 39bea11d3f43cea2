"""Plots and animations of robots that localise themselves in a map and follow a path."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from generated import pga2

from ..arguments import Reals
from .localization import Lines
from .motions import relative
from .navigation_run import NavigationRun
from .navigation_status import FollowStatus
from .objects import MapObject
from .paths import PlanarPath

_ROBOT = 0.25 * np.array([[1.2, 0.0], [-0.8, 0.7], [-0.4, 0.0], [-0.8, -0.7], [1.2, 0.0]])
"""The outline of a robot that looks along x, in metres."""
_SAMPLES = 400
"""A limit on work: the number of points of a drawn path."""


def draw_run(
    lines: Lines, path: PlanarPath, run: NavigationRun, objects: Iterable[MapObject] = (), margin: float = 2.0
) -> Figure:
    """Return a figure of a run over its map: the path, the true and the estimated way, and objects.

    Parameters
    ----------
    lines : Lines
        The map.
    path : PlanarPath
    run : NavigationRun
    objects : iterable of MapObject, optional
    margin : float, optional
        Metres around the run that are shown.

    Returns
    -------
    Figure
    """
    figure = Figure(figsize=(7, 6), layout="tight")
    stage = figure.add_subplot()
    _draw_map(stage, lines, objects)
    truth, estimate = _places(run.truth), _places(run.estimates)
    stage.plot(*_places(path.pose(np.linspace(0, path.length, _SAMPLES))).T, "--", color="tab:gray", label="path")
    stage.plot(*truth.T, color="tab:green", label="true way")
    stage.plot(*estimate.T, linewidth=0.8, color="tab:red", label="estimated way")
    stage.fill(*np.asarray(pga2.move_point(run.truth[-1], _ROBOT)).T, color="tab:green")
    _show(stage, truth, margin)
    stage.legend(loc="best")
    stage.set_title(FollowStatus(int(run.following[-1])).name)
    return figure


def draw_errors(run: NavigationRun) -> Figure:
    """Return a figure of the errors of a run over time.

    The distance of the true place from the path; errors of the estimated pose ahead and to the left with twice their
    standard deviations; and normalised squared errors with the value that 95 % of consistent ones do not exceed.
    """
    figure = Figure(figsize=(7, 6.5), layout="tight")
    upper, middle, lower = figure.subplots(3, 1, sharex=True)
    upper.plot(run.times, 100 * run.distances, color="tab:blue")
    upper.set_ylabel("off the path in cm")
    off = relative(run.estimates, run.truth)
    errors = 100 * np.asarray(pga2.motor_to_angle_translation(off)[1])
    for k, (name, colour) in enumerate((("ahead", "tab:orange"), ("left", "tab:purple"))):
        bound = 200 * np.sqrt(run.covariances[:, 1 + k, 1 + k])
        middle.plot(run.times, errors[:, k], color=colour, label=name)
        middle.fill_between(run.times, -bound, bound, color=colour, alpha=0.15)
    middle.set_ylabel("error of the pose in cm")
    middle.legend(loc="upper right")
    lower.plot(run.times, run.normalized_errors, color="tab:red")
    lower.axhline(float(scipy.special.chdtri(3, 0.05)), linestyle="--", color="tab:gray")
    lower.set(xlabel="time in seconds", ylabel="normalised squared error")
    return figure


def animate_run(
    lines: Lines,
    path: PlanarPath,
    run: NavigationRun,
    file: str | Path,
    frames_per_second: int = 10,
    speed: float = 2.0,
    objects: Iterable[MapObject] = (),
    margin: float = 2.0,
) -> Path:
    """Write an animation of a run with its scans over the map: a GIF, or an HTML page (``.html``).

    Parameters
    ----------
    lines : Lines
        The map.
    path : PlanarPath
    run : NavigationRun
    file : str or Path
    frames_per_second : int, optional
    speed : float, optional
        Seconds of the run per second of the film.
    objects : iterable of MapObject, optional
    margin : float, optional
        Metres around the run that are shown.

    Returns
    -------
    Path
        The path of the file.

    Raises
    ------
    OSError
        If the file cannot be written.
    ValueError
        If the run has fewer than two steps.
    """
    if len(run.times) < 2:
        raise ValueError(f"run: {len(run.times)} steps; expected at least 2")
    step = max(1, round(speed / frames_per_second / float(run.times[1] - run.times[0])))
    rows = np.arange(0, len(run.times), step)
    figure = Figure(figsize=(6, 5.2), layout="tight")
    stage = figure.add_subplot()
    _draw_map(stage, lines, objects)
    stage.plot(*_places(path.pose(np.linspace(0, path.length, _SAMPLES))).T, "--", linewidth=0.8, color="tab:gray")
    truth = _places(run.truth)
    _show(stage, truth, margin)
    (seen,) = stage.plot([], [], ".", markersize=2, color="tab:red")
    (way,) = stage.plot([], [], color="tab:green")
    (robot,) = stage.fill(*_ROBOT.T, color="tab:green")

    def show(k: int) -> list[Any]:
        row = rows[k]
        points = np.asarray(pga2.move_point(run.estimates[row], run.points[row])).reshape(-1, 2)
        seen.set_data(*points.T)
        way.set_data(*truth[: row + 1].T)
        robot.set_xy(np.asarray(pga2.move_point(run.truth[row], _ROBOT)))
        stage.set_title(f"{run.times[row]:.1f} s  {FollowStatus(int(run.following[row])).name}")
        return [seen, way, robot]

    film = FuncAnimation(figure, show, frames=len(rows), blit=False, interval=1000 / frames_per_second)
    if Path(file).suffix == ".html":
        Path(file).write_text(film.to_jshtml(frames_per_second), encoding="utf-8")
    else:
        film.save(file, PillowWriter(fps=frames_per_second))
    return Path(file)


def _draw_map(stage: Axes, lines: Lines, objects: Iterable[MapObject]) -> None:
    stage.add_collection(LineCollection(list(lines.ends), colors="black", linewidths=1.0))
    for each in objects:
        stage.plot(*each.outline.T, color="tab:blue")
        if each.name:
            stage.annotate(each.name, tuple(each.centre), ha="center", va="center", fontsize=7)


def _show(stage: Axes, places: Reals, margin: float) -> None:
    low, high = places.min(0) - margin, places.max(0) + margin
    stage.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x in m", ylabel="y in m")
    stage.set_aspect("equal")


def _places(motors: Reals) -> Reals:
    return np.asarray(pga2.motor_to_angle_translation(motors)[1])
