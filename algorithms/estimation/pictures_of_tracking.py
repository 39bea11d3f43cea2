"""Plots and animations of tracking, and of the circles of tracked points."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array
from .circles_of_points import BodyEyeStatus, JointAxis
from .tracking import Tracker
from .tracking_simulation import Recording

_CAMERA = np.array([[-1.0, -0.75], [1.0, -0.75], [1.0, 0.75], [-1.0, 0.75], [-1.0, -0.75]])
"""The border of an image, in units of half its width."""
_SIZE = 0.25
"""The size of the drawn camera relative to the distance of the target."""
_SAMPLES = 60
"""A limit on work: the number of points of a circle."""


def draw_tracking(recording: Recording) -> Figure:
    """Return a figure of a recording: the joint variables, and the distance of the image from the goal.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    Figure
    """
    figure = Figure(figsize=(7, 4.5), layout="tight")
    upper, lower = figure.subplots(2, 1, sharex=True)
    for k, angles in enumerate(recording.q.T):
        upper.plot(recording.times, angles, label=f"joint {k}")
    upper.set_ylabel("joint variables")
    upper.legend(loc="upper right")
    lower.semilogy(recording.times, np.linalg.norm(recording.error, axis=1), label="error", color="tab:red")
    bad = recording.status > 0
    lower.plot(recording.times[bad], np.full(int(bad.sum()), 1e-4), "|", color="black", label="status not OK")
    lower.set(xlabel="time in seconds", ylabel="error of the image")
    lower.legend(loc="upper right")
    return figure


def draw_circles(points: ArrayLike, axes: list[JointAxis]) -> Figure:
    """Return a figure of tracked points, and of axes with the circles about them.

    Parameters
    ----------
    points : array_like, (n_frames, n_points, 3)
    axes : list of JointAxis
        Those whose status is not OK are left out.

    Returns
    -------
    Figure

    Raises
    ------
    TypeError, ValueError
        If `points` is not an array of points, or axes have circles of another number of points.
    """
    places = real_array(points, "points", (-1, -1, 3), "frames, points and coordinates").astype(np.float64)
    for axis in axes:
        if len(axis.radii) != places.shape[1]:
            raise ValueError(f"axes: radii of {len(axis.radii)} points; expected {places.shape[1]}, as in points")
    figure = Figure(figsize=(6, 6))
    stage = figure.add_subplot(projection="3d")
    stage.scatter(*places.reshape(-1, 3).T, s=6, color="tab:blue")
    centre = np.nanmean(places, axis=(0, 1))
    size = float(np.nanmax(np.abs(places - centre)))
    for axis in axes:
        if axis.status != BodyEyeStatus.OK:
            continue
        direction = pga3.line_to_direction_moment(axis.line)[0]
        foot = pga3.project_point_on_unit_line(centre, axis.line)
        ends = foot + size * direction * np.array([[-1.0], [1.0]])
        stage.plot(*ends.T, color="tab:orange")
        turns = pga3.motor_from_line(axis.line, np.linspace(0, 2 * np.pi, _SAMPLES))
        for column in np.flatnonzero(np.isfinite(axis.radii)):
            seen = places[np.isfinite(places[:, column]).all(-1), column]
            stage.plot(*pga3.move_point(turns, seen[0]).T, linewidth=0.6, color="tab:gray")
    stage.set(xlabel="x", ylabel="y", zlabel="z")
    stage.set_aspect("equal")
    return figure


def animate_tracking(
    tracker: Tracker, recording: Recording, path: str | Path, frames_per_second: int = 20, field_of_view: float = 0.8
) -> Path:
    """Write an animation of a tracking camera, in space and in the image: a GIF, or an HTML page (``.html``).

    Parameters
    ----------
    tracker : Tracker
    recording : Recording
    path : str or Path
    frames_per_second : int, optional
    field_of_view : float, optional
        Half of the width of the image, in units of the focal length.

    Returns
    -------
    Path
        The path of the file.

    Raises
    ------
    OSError
        If the file cannot be written.
    ValueError
        If the recording has fewer than two steps.
    """
    if len(recording.times) < 2:
        raise ValueError(f"recording: {len(recording.times)} steps; expected at least 2")
    step = max(1, round(1 / frames_per_second / float(recording.times[1] - recording.times[0])))
    rows = np.arange(0, len(recording.times), step)
    q, targets, error = recording.q[rows], recording.targets[rows], recording.error[rows]
    mount = pga3.motor_product(pga3.motor_inverse(tracker.robot.tool), tracker.chain.camera)
    cameras = pga3.motor_product(tracker.robot.forward(q), mount)
    distance = float(np.nanmedian(np.linalg.norm(targets, axis=1)))
    size = _SIZE * distance
    pyramids = _pyramids(cameras, size, field_of_view)
    figure = Figure(figsize=(9, 4.5))
    space, image = figure.add_subplot(1, 2, 1, projection="3d"), figure.add_subplot(1, 2, 2)
    figure.subplots_adjust(wspace=0.4)
    space.plot(*targets.T, linewidth=0.8, color="tab:orange")
    reach = 1.05 * max(float(np.nanmax(np.abs(targets))), size)
    space.set(xlim=(-reach, reach), ylim=(-reach, reach), zlim=(-reach, reach), xlabel="x", ylabel="y", zlabel="z")
    (border,) = space.plot(*pyramids[0].T, color="tab:blue")
    (ray,) = space.plot(*_ray(cameras[0], distance).T, "--", linewidth=0.8, color="tab:blue")
    (spot,) = space.plot(*targets[:1].T, "o", color="tab:red")
    image.plot(*(field_of_view * _CAMERA).T, color="tab:gray")
    image.plot([0.0], [0.0], "+", color="black")
    (trail,) = image.plot(*error[:1].T, linewidth=0.8, color="tab:orange")
    (seen,) = image.plot(*error[:1].T, "o", color="tab:red")
    image.set(xlabel="x / z", ylabel="y / z", title="image", aspect="equal")
    image.invert_yaxis()

    def show(k: int) -> list[Any]:
        border.set_data_3d(*pyramids[k].T)
        ray.set_data_3d(*_ray(cameras[k], distance).T)
        spot.set_data_3d(*targets[k : k + 1].T)
        trail.set_data(*error[: k + 1].T)
        seen.set_data(*error[k : k + 1].T)
        space.set_title(f"{recording.times[rows[k]]:.1f} s")
        return [border, ray, spot, trail, seen]

    film = FuncAnimation(figure, show, frames=len(rows), blit=False, interval=1000 / frames_per_second)
    if Path(path).suffix == ".html":
        Path(path).write_text(film.to_jshtml(frames_per_second), encoding="utf-8")
    else:
        film.save(path, PillowWriter(fps=frames_per_second))
    return Path(path)


def _pyramids(cameras: Reals, size: float, field_of_view: float) -> Reals:
    """Return closed paths (n, k, 3) along the edges of the views of cameras."""
    corners = size * np.concatenate([field_of_view * _CAMERA, np.ones((5, 1))], 1)
    apex = np.zeros(3)
    path = np.array([*corners, apex, corners[1], corners[2], apex, corners[3]])
    return np.asarray(pga3.move_point(cameras[:, None], path))


def _ray(camera: Reals, length: float) -> Reals:
    return np.asarray(pga3.move_point(camera, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, length]])))
