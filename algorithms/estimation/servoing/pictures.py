"""Plots of guided grasps."""

from __future__ import annotations

import numpy as np

from ...extras import extra
from .scene import GraspRun
from .status import GraspStage

with extra("pictures", __name__):
    from matplotlib.figure import Figure

_HAND = [2, 0, 1, 3, 2]
_BOX = [(a, a | bit) for bit in (1, 2, 4) for a in range(8) if not a & bit]


def plot_guided_grasp(run: GraspRun, size: float = 10.0) -> Figure:
    """Plot both images with the paths of the marks of the hand, and the errors of each step by stages.

    Parameters
    ----------
    run : GraspRun
    size : float, optional
        The width of the figure in inches.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = Figure(figsize=(size, 0.34 * size), layout="constrained")
    axes = figure.subplots(1, 3)
    images = np.array([scene.images() for scene in run.scenes])
    for k, axis in enumerate(axes[:2]):
        box = images[0, k, 4:]
        for a, b in _BOX:
            axis.plot(*box[[a, b]].T, color="0.6", lw=1)
        for mark in range(4):
            axis.plot(*images[:, k, mark].T, color="tab:blue", lw=0.6)
        for points, style in ((images[0, k], ":"), (images[-1, k], "-")):
            axis.plot(*points[_HAND].T, style, color="tab:red")
        axis.set(title=f"camera {k + 1}", aspect="equal")
        axis.invert_yaxis()
    errors = np.array([step.error for step in run.steps])
    stages = np.array([step.state.stage for step in run.steps])
    own = axes[2]
    for stage in GraspStage:
        rows = np.flatnonzero((stages == stage) & (errors > 0))
        if len(rows):
            own.semilogy(rows, errors[rows], ".-", ms=4, label=stage.name.lower())
    own.set(title="error in pixels", xlabel="step")
    if own.lines:
        own.legend(fontsize="small")
    return figure
