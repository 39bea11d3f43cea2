"""Plots of the saliency of tokens, of curves with junctions, and of deformed clouds."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, real_array
from ..extras import extra
from ..precision import TINY
from .deformation import Deformation
from .extremal import Extremal
from .junctions import Junctions
from .voting import Votes

with extra("pictures", __name__):
    from matplotlib.figure import Figure

_PLANE = [0, 1]


def plot_saliency(votes: Votes, depth: float | None = None, size: float = 8.0) -> Figure:
    """Plot tokens beside their saliency: of curves in the plane, and of surfaces in space, with normals.

    Parameters
    ----------
    votes : Votes
    depth : float, optional
        Of tokens in space, only those are plotted whose third coordinate is at most this far from the mean; by default
        a tenth of their range.
    size : float, optional
        The width of the figure in inches.

    Returns
    -------
    matplotlib.figure.Figure
    """
    points, normals = votes.points, votes.normals
    saliency = votes.surface if points.shape[1] == 3 else votes.curve
    rows = np.isfinite(points).all(1)
    if points.shape[1] == 3 and rows.any():
        z = points[:, 2]
        limit = np.ptp(z[rows]) / 10 if depth is None else depth
        rows &= np.abs(z - z[rows].mean()) <= limit
    places, n, s = points[rows][:, _PLANE], normals[rows][:, _PLANE], saliency[rows]
    figure = Figure(figsize=(size, 0.5 * size), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(*places.T, ".", ms=1.5, color="0.3")
    left.set_title("tokens")
    drawn = right.scatter(*places.T, c=s, s=2 + 10 * s / max(s.max(initial=0), TINY), cmap="viridis")
    strong = s > 0.3 * s.max(initial=0)
    if strong.any():
        right.quiver(*places[strong].T, *n[strong].T, headwidth=1, headlength=0, width=0.0015, color="tab:red")
    right.set_title("saliency and normals")
    figure.colorbar(drawn, ax=right, shrink=0.8)
    for axis in (left, right):
        axis.set_aspect("equal")
    return figure


def plot_curves(points: ArrayLike, curves: Extremal, junctions: Junctions, size: float = 8.0) -> Figure:
    """Plot tokens in space beside the curves and junctions that were extracted from them.

    Parameters
    ----------
    points : array_like, (n, 3)
    curves : Extremal
        The result of `extract_curves`.
    junctions : Junctions
    size : float, optional
        The width of the figure in inches.
    """
    tokens = real_array(points, "points", (-1, 3), "points")
    figure = Figure(figsize=(size, 0.5 * size), layout="constrained")
    left, right = (figure.add_subplot(1, 2, k, projection="3d") for k in (1, 2))
    left.plot(*tokens.T, ".", ms=1.5, color="0.3")
    left.set_title("tokens")
    for piece in curves.pieces:
        right.plot(*curves.vertices[piece].T, color="tab:blue", lw=1.5)
    right.plot(*junctions.points.T, "o", ms=5, color="tab:red")
    right.set_title("curves and junctions")
    low, high = tokens.min(0, initial=np.inf), tokens.max(0, initial=-np.inf)
    for axis in (left, right):
        if len(tokens):
            axis.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        axis.set_aspect("equal")
        axis.set(xticks=[], yticks=[], zticks=[])
    return figure


def plot_deformation(source: ArrayLike, target: ArrayLike, found: Deformation, size: float = 8.0) -> Figure:
    """Plot two clouds, in their first two coordinates, before and after a deformation.

    Parameters
    ----------
    source, target : array_like, (n, d) and (m, d)
        The clouds of `register_deformable`.
    found : Deformation
    size : float, optional
        The width of the figure in inches.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    TypeError, ValueError
        If an array has another type or shape.
    """
    before, goal = (real_array(x, name, (-1,), "points") for x, name in ((source, "source"), (target, "target")))
    figure = Figure(figsize=(size, 0.5 * size), layout="constrained")
    clouds: list[tuple[str, Reals]] = [("before", before), ("after", found.points)]
    for axis, (title, cloud) in zip(figure.subplots(1, 2), clouds, strict=True):
        axis.plot(*goal[:, :2].T, "o", ms=3, mfc="none", color="tab:blue", label="target")
        axis.plot(*cloud[:, :2].T, ".", ms=3, color="tab:red", label="source")
        axis.set_title(title)
        axis.set_aspect("equal")
        axis.legend(loc="upper right", fontsize="small")
    return figure
