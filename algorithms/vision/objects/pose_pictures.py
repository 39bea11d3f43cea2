"""Figures of what a camera sees of an object, with its model at several poses."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...arguments import Reals
from ...extras import extra
from .pictures_of_scenes import plot_view
from .pose_models import ObjectModel, View
from .scene_silhouettes import element_pixels

with extra("pictures", __name__):
    from matplotlib.figure import Figure

_COLOURS = ("silver", "black", "tab:cyan", "tab:pink")


def plot_poses(
    view: View, model: ObjectModel, poses: Mapping[str, Reals], size: tuple[int, int] = (640, 480), margin: float = 20.0
) -> Figure:
    """Return a figure of measured pixels, and of the images of a model at several poses.

    Parameters
    ----------
    view : View
    model : ObjectModel
    poses : mapping from str to array, (8,)
        Labels and motors, such as those of a start and of the pose that was found.
    size : (int, int)
        Width and height of the image.
    margin : float
        The figure shows the part of the image that contains all pixels, with this margin.
    """
    figure = plot_view(view, size)
    axes = figure.axes[0]
    every = [line.get_xydata() for line in axes.lines]
    for (label, pose), colour in zip(poses.items(), _COLOURS * len(poses), strict=False):
        places = [places for _, places in element_pixels(model, pose, view.camera).values()]
        pixels = view.camera.project(np.concatenate(places))
        axes.plot(*pixels.T, ".", markersize=1.5, color=colour, label=label, zorder=0)
        every.append(pixels)
    seen = np.concatenate([np.asarray(pixels, float) for pixels in every])
    low, high = np.nanmin(seen, 0) - margin, np.nanmax(seen, 0) + margin
    axes.set(xlim=(max(low[0], 0), min(high[0], size[0])), ylim=(min(high[1], size[1]), max(low[1], 0)))
    axes.legend(fontsize="small")
    return figure
