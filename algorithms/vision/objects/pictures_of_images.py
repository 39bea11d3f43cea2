"""Figures of measurements in raster images: traced contours and the projected model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ...arguments import Reals
from ...extras import extra
from .image_arguments import checked_mesh
from .pose_models import ObjectModel
from .predicted_curves import predicted_curves
from .silhouette_views import MeasuredSilhouettes
from .silhouettes import Silhouette

with extra("pictures", __name__):
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MARGIN = 25.0
"""Pixels around the contour that are shown."""


def plot_silhouettes(
    model: ObjectModel,
    measured: MeasuredSilhouettes,
    images: Sequence[ArrayLike],
    mesh: tuple[ArrayLike, ArrayLike] | None = None,
) -> Figure:
    """Return a figure of images with their traced contours, in white, and the visible curves of the model.

    Parameters
    ----------
    model : ObjectModel
    measured : MeasuredSilhouettes
    images : sequence of array_like, (h, w, 3)
        The images that were measured.
    mesh
        As for `measure_silhouettes`.
    """
    figure = Figure(figsize=(4.2 * len(images), 4.2), layout="constrained")
    for k, (silhouette, image) in enumerate(zip(measured.silhouettes, images, strict=True)):
        axes = figure.add_subplot(1, len(images), k + 1)
        axes.imshow(np.asarray(image))
        for line in () if silhouette.segment is None else silhouette.segment.contours:
            axes.plot(*np.vstack([line, line[:1]]).T, color="white", linewidth=2.5, label="contour")
        if measured.estimate is not None and np.isfinite(measured.estimate.motor).all():
            _draw_model(axes, model, measured.estimate.motor, silhouette, mesh)
        _zoom(axes, silhouette)
        axes.set(xlabel="x/pixel", ylabel="y/pixel", title=measured.statuses[k].name)
    handles, names = figure.axes[0].get_legend_handles_labels() if figure.axes else ([], [])
    unique = dict(zip(names, handles, strict=True))
    figure.legend(unique.values(), unique.keys(), loc="outside lower center", ncols=3, facecolor="lightgrey")
    return figure


def _draw_model(
    axes: Axes, model: ObjectModel, pose: Reals, silhouette: Silhouette, mesh: tuple[ArrayLike, ArrayLike] | None
) -> None:
    camera = silhouette.camera
    curves = predicted_curves(model, pose, camera.pinhole, checked_mesh(model, mesh))
    if curves is None:
        return
    pixels = camera.camera.distort(curves.pixels)
    for where, colour, name in (
        (curves.is_outline & curves.is_visible, "blue", "outline of the model"),
        (~curves.is_outline & curves.is_visible, "cyan", "edges of the model"),
    ):
        axes.plot(*pixels[where].T, ".", color=colour, markersize=3, label=name)


def _zoom(axes: Axes, silhouette: Silhouette) -> None:
    if silhouette.segment is not None and silhouette.segment.contours:
        line = np.concatenate(silhouette.segment.contours)
        low, high = line.min(0) - _MARGIN, line.max(0) + _MARGIN
        axes.set(xlim=(low[0], high[0]), ylim=(high[1], low[1]))
