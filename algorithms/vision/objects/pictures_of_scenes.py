"""Figures and animations of scenes: the robot, the objects, the cameras, and what a camera sees."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from generated import pga3

from ...arguments import Reals
from ...extras import extra
from ...kinematics.pictures import skeleton
from .pose_models import KINDS, View
from .scene import Scene, SceneCamera

with extra("pictures", __name__):
    from matplotlib.animation import FuncAnimation, PillowWriter
    from matplotlib.figure import Figure

_FRUSTUM = 0.08
"""Depth of the pyramid that stands for a camera, in metres."""


def plot_scene(scene: Scene, contacts: Reals | None = None) -> Figure:
    """Return a figure of the robot, the objects and the cameras, with contacts (k, 3) of the world as points."""
    figure, axes = _stage()
    _draw(axes, scene, contacts)
    return figure


def plot_view(view: View, size: tuple[int, int] = (640, 480)) -> Figure:
    """Return a figure of the pixels of a view, coloured by the kind of element."""
    figure = Figure(figsize=(5, 4))
    axes = figure.add_subplot()
    for kind in KINDS:
        seen = getattr(view, kind)
        if seen is not None:
            pixels = np.asarray(seen if kind == "points" else seen[1])
            axes.plot(*pixels.T, "o" if kind == "points" else ".", markersize=5 if kind == "points" else 2, label=kind)
    axes.set(xlim=(0, size[0]), ylim=(size[1], 0), xlabel="x/pixel", ylabel="y/pixel", aspect="equal")
    axes.legend()
    return figure


def animate_scenes(scenes: Sequence[Scene], path: str | Path, frames_per_second: int = 10) -> Path:
    """Write an animation of scenes, such as those of `simulate`, as a GIF.

    Raises
    ------
    OSError
        If the file cannot be written.
    ValueError
        If there is no scene.
    """
    if not scenes:
        raise ValueError("animate_scenes: no scene; expected at least one")
    figure, axes = _stage()

    def show(k: int) -> list[Any]:
        axes.clear()
        _draw(axes, scenes[k], None)
        return []

    film = FuncAnimation(figure, show, frames=len(scenes), blit=False, interval=1000 / frames_per_second)
    film.save(path, PillowWriter(fps=frames_per_second))
    return Path(path)


def _stage() -> tuple[Figure, Any]:
    figure = Figure(figsize=(6, 5))
    return figure, figure.add_subplot(projection="3d")


def _draw(axes: Any, scene: Scene, contacts: Reals | None) -> None:
    axes.set(xlabel="x/m", ylabel="y/m", zlabel="z/m")
    if scene.robot is not None:
        for segment in skeleton(scene.robot, scene.q):
            axes.plot(*segment.T, "o-", linewidth=3, markersize=4, color="tab:blue")
    for one in scene.objects:
        vertices = pga3.move_point(one.pose, one.vertices)
        if len(one.faces):
            axes.plot_trisurf(*vertices.T, triangles=one.faces, alpha=0.5, color="tab:orange")
        axes.plot(*pga3.move_point(one.pose, one.model.samples).T, ".", markersize=3, color="tab:brown")
    for k, camera in enumerate(scene.cameras):
        for line in _pyramid(camera, scene.camera(k).pose):
            axes.plot(*line.T, linewidth=1, color="tab:green")
    if contacts is not None:
        axes.plot(*np.asarray(contacts).T, "o", color="tab:red", markersize=6)
    axes.set_aspect("equal")


def _pyramid(camera: SceneCamera, pose: Reals) -> Reals:
    """Return the edges (8, 2, 3) of the pyramid of a camera's view."""
    width, height = camera.size
    rays = camera.pinhole.directions(np.array([[0, 0], [width, 0], [width, height], [0, height]], float))
    top, around = pga3.move_point(pose, np.zeros(3)), pga3.move_point(pose, rays * _FRUSTUM / rays[:, 2:])
    return np.array([*((top, p) for p in around), *zip(around, np.roll(around, -1, 0), strict=True)])
