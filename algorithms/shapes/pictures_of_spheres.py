"""Plots of models of spheres: circles in slices, spheres in space, and matched centres."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals
from ..extras import extra
from ..precision import TINY
from .rasterising import checked_balls, checked_mask, checked_spacing
from .sphere_matching import SphereRegistration

with extra("pictures", __name__):
    from matplotlib.collections import PatchCollection
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle


def plot_slice(mask: ArrayLike, balls: ArrayLike, index: int, spacing: ArrayLike = (1, 1, 1)) -> Figure:
    """Draw a slice of a mask across the last axis, and the circles in which the plane meets balls."""
    inside, rows, edges = checked_mask(mask), checked_balls(balls), checked_spacing(spacing)
    figure = Figure(figsize=(6, 6), layout="constrained")
    axis = figure.subplots()
    width, height = inside.shape[0] * edges[0], inside.shape[1] * edges[1]
    extent = (-edges[0] / 2, width - edges[0] / 2, -edges[1] / 2, height - edges[1] / 2)
    axis.imshow(inside[:, :, index].T, origin="lower", extent=extent, cmap="Greys", alpha=0.4)
    square = rows[:, 3] ** 2 - (rows[:, 2] - index * edges[2]) ** 2
    circles = [Circle((r[0], r[1]), float(np.sqrt(s))) for r, s in zip(rows, square, strict=True) if s > 0]
    axis.add_collection(PatchCollection(circles, facecolor="none", edgecolor="tab:blue", linewidth=0.7))
    axis.set_xlabel("x")
    axis.set_ylabel("y")
    return figure


def plot_balls(balls: ArrayLike) -> Figure:
    """Draw the centres of balls in space; areas of markers and colours are those of the radii."""
    rows = checked_balls(balls)
    figure = Figure(figsize=(6, 6), layout="constrained")
    axis = figure.add_subplot(projection="3d")
    axis.scatter(*rows[:, :3].T, s=4 * _relative(rows[:, 3]) ** 2 + 1, c=rows[:, 3])
    return figure


def plot_matches(a: ArrayLike, b: ArrayLike, found: SphereRegistration) -> Figure:
    """Draw the images of the balls of one model, those of the other, and lines between matched ones."""
    moved, other = found.warp_balls(a), checked_balls(b, "b")
    figure = Figure(figsize=(6, 6), layout="constrained")
    axis = figure.add_subplot(projection="3d")
    axis.scatter(*moved[:, :3].T, s=6, label="images of the first")
    axis.scatter(*other[:, :3].T, s=6, label="second")
    for i, j in found.match:
        axis.plot(*np.stack([moved[i, :3], other[j, :3]], 1), color="0.5", lw=0.6)
    axis.legend()
    return figure


def _relative(radii: Reals) -> Reals:
    return 10 * radii / max(float(radii.max(initial=0)), TINY)
