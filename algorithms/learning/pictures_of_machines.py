"""Pictures of support vector machines: points in space with their classes, and curves."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..extras import extra


def plot_classes(points: ArrayLike, found: ArrayLike, labels: ArrayLike, title: str = "") -> Any:
    """Plot points in space (n, 3) in the colours of their predicted classes, with crosses on wrong ones.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure, axes = _axes_in_space(title)
    p, classes = np.asarray(points), np.asarray(found)
    axes.scatter(*p.T, c=np.unique(classes, return_inverse=True)[1], s=4, cmap="viridis")
    wrong = classes != np.asarray(labels)
    axes.scatter(*p[wrong].T, c="red", marker="x", s=20, label=f"{wrong.sum()} of {len(wrong)} are wrong")
    axes.legend()
    return figure


def plot_curves(values: ArrayLike, samples: ArrayLike, title: str = "") -> Any:
    """Plot curves in space, given by three columns each (n, 3 k), and the samples they have been fitted to.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure, axes = _axes_in_space(title)
    lines, dots = np.asarray(values), np.asarray(samples)
    for k in range(0, lines.shape[1], 3):
        axes.plot(*lines[:, k : k + 3].T)
        axes.scatter(*dots[:, k : k + 3].T, s=12)
    return figure


def _axes_in_space(title: str) -> tuple[Any, Any]:
    with extra("pictures", "algorithms.learning.pictures_of_machines"):
        from matplotlib.figure import Figure
    figure = Figure(figsize=(6, 5), layout="constrained")
    axes = figure.add_subplot(projection="3d")
    axes.set_title(title)
    return figure, axes
