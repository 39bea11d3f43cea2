"""Plots of maps from scans, of votes for motions, and of errors over time."""

from __future__ import annotations

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from generated import pga2

from ..arguments import Reals, real_array
from .built_map import BuiltMap, ScanStatus
from .line_map import LineMap
from .motions import relative
from .scan import Scan

_MOST_POINTS = 200_000
"""A limit on work: the number of drawn points."""


def draw_map(
    built: BuiltMap | LineMap, scans: list[Scan] | None = None, truth: ArrayLike | None = None, size: float = 8.0
) -> Figure:
    """Draw the segments of a map over the readings, with the path and the closures of loops.

    Parameters
    ----------
    built : BuiltMap or LineMap
    scans : list of Scan, optional
        All scans that the map was built from, in their order.
    truth : array_like, (n, 3), optional
        Known poses in the frame of the map.
    size : float, optional
        The width of the figure in inches.
    """
    line_map = built.line_map if isinstance(built, BuiltMap) else built
    figure = Figure(figsize=(size, 0.8 * size), layout="constrained")
    axis = figure.subplots()
    if isinstance(built, BuiltMap):
        if scans is not None:
            points = _points(built, scans)
            axis.plot(*points.T, ",", color="0.75", rasterized=True)
        axis.plot(*built.poses[:, :2].T, color="tab:blue", lw=0.8, label="path")
        ends = built.poses[built.closures][..., :2]
        axis.add_collection(LineCollection(list(ends), colors="tab:purple", linewidths=0.5, label="closures of loops"))
    if truth is not None:
        axis.plot(*real_array(truth, "truth", (3,))[:, :2].T, color="tab:green", lw=0.8, label="truth")
    axis.add_collection(LineCollection(list(line_map.ends), colors="tab:red", linewidths=1.2, label="segments"))
    axis.autoscale()
    axis.set_aspect("equal")
    axis.set_xlabel("x (m)")
    axis.set_ylabel("y (m)")
    axis.legend(loc="upper right", fontsize="small")
    return figure


def draw_path_errors(built: BuiltMap, truth: ArrayLike) -> Figure:
    """Draw the errors of poses over the path, with the statuses of scans that were not added."""
    poses = real_array(truth, "truth", (len(built.motors), 3)).astype(float)
    motors = pga2.motor_from_angle_translation(poses[:, 2], poses[:, :2])
    angle, shift = pga2.motor_to_angle_translation(relative(motors, built.motors))
    figure = Figure(figsize=(8, 3.6), layout="constrained")
    axes = figure.subplots(2, 1, sharex=True)
    rows = np.arange(len(poses))
    for axis, values, name in zip(axes, (np.hypot(*shift.T), np.degrees(np.abs(angle))), ("m", "°"), strict=True):
        axis.plot(rows, values, lw=0.9)
        refused = built.statuses != ScanStatus.ADDED
        axis.plot(rows[refused], values[refused], "x", color="tab:red", label="not added")
        axis.set_ylabel(f"error ({name})")
        axis.margins(x=0)
    axes[0].legend(loc="upper left", fontsize="small")
    axes[1].set_xlabel("scan")
    return figure


def draw_votes(votes: ArrayLike, step: float, name: str = "angle (°)") -> Figure:
    """Draw a histogram of votes: a row of numbers for angles, or a matrix for translations.

    Parameters
    ----------
    votes : array_like, (n,) or (n, m)
        With the middle bin at 0.
    step : float
        The width of a bin, in the unit of the name.
    name : str, optional
        The coordinate of a row of votes.
    """
    array = real_array(votes, "votes")
    figure = Figure(figsize=(8, 2.6) if array.ndim == 1 else (5, 4), layout="constrained")
    axis = figure.subplots()
    if array.ndim == 1:
        axis.bar((np.arange(len(array)) - len(array) // 2) * step, array, width=step)
        axis.set_xlabel(name)
        axis.set_ylabel("votes")
        return figure
    half = [(length - length // 2 - 0.5) * step for length in array.shape]
    image = axis.imshow(array.T, origin="lower", extent=(-half[0], half[0], -half[1], half[1]), cmap="magma")
    axis.set_xlabel("x (m)")
    axis.set_ylabel("y (m)")
    figure.colorbar(image, label="votes")
    return figure


def _points(built: BuiltMap, scans: list[Scan]) -> Reals:
    """Return the readings of the scans that were added, in the frame of the map, at most so many."""
    rows = [int(row) for row in built.added if row < len(scans)]
    moved = [np.asarray(pga2.move_point(built.motors[row], scans[row].points())) for row in rows]
    points = np.concatenate(moved) if moved else np.zeros((0, 2))
    return points[:: max(1, -(-len(points) // _MOST_POINTS))]
