"""Plots of contours, of their growth, of flows and of segments."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from ..arguments import Reals
from ..precision import TINY
from .contours import Contour
from .images import Mask
from .surfaces import Surface

_LINE, _NODE = "#d1495b", "#00798c"


def plot_contour(image: ArrayLike, found: Contour, size: float = 5.0) -> Figure:
    """Draw the nodes and normals of a contour over its image, and its errors while it grew."""
    figure = Figure(figsize=(2 * size, size), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.imshow(np.asarray(image), cmap="gray")
    closed = np.vstack([found.path, found.path[:1]])
    left.plot(closed[:, 1], closed[:, 0], "-o", color=_LINE, markersize=2, linewidth=1)
    left.quiver(found.path[:, 1], found.path[:, 0], *found.normals.T[::-1], angles="xy", color=_NODE, width=0.003)
    left.set_title(f"{len(found.path)} nodes, {found.status.name}")
    right.loglog(found.curve[:, 0], found.curve[:, 1], color=_NODE, label="mean")
    right.loglog(found.curve[:, 0], found.curve[:, 2], color=_LINE, label="largest")
    right.set(xlabel="nodes", ylabel="distance of samples in pixels")
    right.legend()
    return figure


def plot_flow(image: ArrayLike, flow: Reals, samples: Reals, size: float = 5.0, step: int = 4) -> Figure:
    """Draw the directions of a flow in the plane, and samples to which streamlines lead, over the image."""
    figure = Figure(figsize=(size, size), layout="constrained")
    axis = figure.subplots()
    axis.imshow(np.asarray(image), cmap="gray")
    grid = np.indices(flow.shape[1:])[:, ::step, ::step]
    rows, columns = grid[0], grid[1]
    arrows = flow[:, ::step, ::step] / np.maximum(np.linalg.norm(flow[:, ::step, ::step], axis=0), TINY)
    axis.quiver(columns, rows, arrows[1], arrows[0], angles="xy", color=_NODE)
    axis.plot(samples[:, 1], samples[:, 0], ".", color=_LINE, markersize=3)
    return figure


def plot_segment(volume: ArrayLike, mask: Mask, size: float = 9.0) -> Figure:
    """Draw the outline of a region on the middle slice of its extent along each axis."""
    array = np.asarray(volume)
    figure = Figure(figsize=(size, size / 3), layout="constrained")
    for axis, view in enumerate(np.atleast_1d(figure.subplots(1, array.ndim)) if array.ndim == 3 else []):
        inside = np.flatnonzero(mask.any(tuple(a for a in range(3) if a != axis)))
        middle = int(np.median(inside)) if len(inside) else array.shape[axis] // 2
        view.imshow(array.take(middle, axis), cmap="gray")
        part = mask.take(middle, axis)
        if part.any():
            view.contour(part, [0.5], colors=_LINE)
        view.set_title(f"axis {axis}, slice {middle}")
    return figure


def plot_surface(found: Surface, size: float = 5.0) -> Figure:
    """Draw the triangles of a surface in space, and its distances from the samples while it grew."""
    figure = Figure(figsize=(2 * size, size), layout="constrained")
    left = figure.add_subplot(1, 2, 1, projection="3d")
    left.plot_trisurf(*found.nodes.T, triangles=found.triangles, color=_NODE, edgecolor="white", linewidth=0.1)
    left.set_aspect("equal")
    left.set_title(f"{len(found.nodes)} nodes, genus {found.genus}, {found.status.name}")
    right = figure.add_subplot(1, 2, 2)
    right.loglog(found.curve[:, 0], found.curve[:, 1] / found.diagonal, color=_NODE, label="mean")
    right.loglog(found.curve[:, 0], found.curve[:, 2] / found.diagonal, color=_LINE, label="largest")
    right.set(xlabel="nodes", ylabel="distance of samples in diagonals")
    right.legend()
    return figure
