"""Plots of clouds before and after registration, and of matches in joint space."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3
from generated import registration as kernels

from ..arguments import Reals, real_array
from ..elements import MOTOR, elements
from ..extras import extra

with extra("pictures", __name__):
    from matplotlib.figure import Figure

_MOST = 4000
"""The largest number of points of a cloud that are drawn."""
_SOURCE, _TARGET = "tab:orange", "tab:blue"


@elements(motor=MOTOR)
def draw_clouds(source: ArrayLike, target: ArrayLike, motor: ArrayLike, size: float = 9.0) -> Figure:
    """Draw two clouds before and after the motor that takes the source to the target.

    Before the motion, the source is drawn with its mean at that of the target.

    Parameters
    ----------
    source : array_like, (n, 3)
    target : array_like, (m, 3)
        At most about 4,000 points of each are drawn, and none that are not finite.
    motor : array_like, (8,)
        Of `generated.pga3`.
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
    x, y = _few(source, "source"), _few(target, "target")
    figure = Figure(figsize=(size, 0.5 * size), layout="constrained")
    moved = np.asarray(pga3.move_point(real_array(motor, "motor", (8,)), x))
    shift = y.mean(0) - x.mean(0) if len(x) and len(y) else np.zeros(3)
    for k, (title, points) in enumerate((("before", x + shift), ("after", moved))):
        axis = _axis(figure, 1, 2, k + 1, title)
        axis.scatter(*y.T, s=2, color=_TARGET, label="target")
        axis.scatter(*points.T, s=2, color=_SOURCE, label="source")
        axis.set_aspect("equal")
        axis.legend(markerscale=4)
    return figure


@elements(motor=MOTOR)
def draw_joint_space(
    source: ArrayLike, target: ArrayLike, inliers: ArrayLike, motor: ArrayLike, size: float = 10.0
) -> Figure:
    """Draw matches in the three joint spaces, where those of one motion are on three planes.

    Parameters
    ----------
    source, target : array_like, (n, 3)
    inliers : array_like of bool, (n,)
    motor : array_like, (8,)
        The motor of the inliers, whose planes are drawn.
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
    x, y = (real_array(x, name, (-1, 3), "points") for x, name in ((source, "source"), (target, "target")))
    right = np.asarray(inliers, bool)
    if not x.shape == y.shape == (*right.shape, 3):
        raise ValueError(
            f"source, target and inliers: shapes {x.shape}, {y.shape}, {right.shape}; expected (n, 3), (n, 3), (n,)"
        )
    points = np.asarray(kernels.joint_points(x, y))
    planes = np.asarray(kernels.joint_planes(real_array(motor, "motor", (8,))))
    figure = Figure(figsize=(size, 0.4 * size), layout="constrained")
    for k in range(3):
        axis = _axis(figure, 1, 3, k + 1, f"joint space {k + 1}")
        axis.scatter(*points[~right, k].T, s=2, color="0.7", label="outliers")
        axis.scatter(*points[right, k].T, s=8, color=_SOURCE, label="inliers")
        normal, offset = planes[k, :3], planes[k, 3]
        square = float(normal @ normal)
        if square > 0:
            across = np.linalg.svd(normal[None])[2][1:]
            reach = float(np.abs(points[:, k]).max(initial=0))
            sides = reach * np.array([-1.0, 1.0])
            corners = -offset * normal / square + sides[:, None, None] * across[0] + sides[:, None] * across[1]
            axis.plot_surface(*np.moveaxis(corners, -1, 0), alpha=0.2, color=_TARGET)
        axis.legend()
    return figure


def _axis(figure: Figure, rows: int, columns: int, number: int, title: str) -> Any:
    axis = figure.add_subplot(rows, columns, number, projection="3d")
    axis.set_title(title)
    return axis


def _few(value: ArrayLike, name: str) -> Reals:
    """Return finite points (n, 3), at most about `_MOST`."""
    points = real_array(value, name, (-1, 3), "points")
    if points.ndim != 2:
        raise ValueError(f"{name}: shape {points.shape}; expected (n, 3)")
    points = points[np.isfinite(points).all(1)]
    return points[:: max(1, len(points) // _MOST)]
