"""Pictures of speech: images of bands, features, and confusion matrices."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals
from ..extras import extra

with extra("pictures", __name__):
    from matplotlib.figure import Figure


def plot_speech(image: ArrayLike, step: float = 0.01) -> Figure:
    """Plot levels in bands over time, as from `bark_image`.

    Parameters
    ----------
    image : array_like, (bands, frames)
    step : float
        The time from one frame to the next, in seconds.
    """
    levels = np.asarray(image)
    figure = Figure((6, 3), layout="constrained")
    axes = figure.add_subplot()
    shown = axes.imshow(
        levels, "magma", origin="lower", aspect="auto", extent=(0, step * levels.shape[1], -0.5, len(levels) - 0.5)
    )
    axes.set(xlabel="time in seconds", ylabel="band")
    figure.colorbar(shown, label="decibels")
    return figure


def plot_features(features: ArrayLike, labels: ArrayLike) -> Figure:
    """Plot the mean features of each class, divided by the standard deviations of the features.

    Parameters
    ----------
    features : array_like, (n, d)
    labels : array_like, (n,)
    """
    values, given = np.asarray(features, float), np.asarray(labels)
    spread = values.std(0)
    scaled = (values - values.mean(0)) / np.where(spread > 0, spread, 1)
    names = np.unique(given)
    figure = Figure((6, 4), layout="constrained")
    axes = figure.add_subplot()
    shown = axes.imshow(np.stack([scaled[given == name].mean(0) for name in names]), "RdBu_r", vmin=-2, vmax=2,
                        aspect="auto")  # fmt: skip
    axes.set_yticks(range(len(names)), [str(name) for name in names])
    axes.set(xlabel="feature", ylabel="class")
    figure.colorbar(shown, label="standard deviations")
    return figure


def plot_confusion(confusion: ArrayLike, classes: ArrayLike) -> Figure:
    """Plot a confusion matrix, with the shares of each row as colours and the counts as text."""
    counts: Reals = np.asarray(confusion)
    names = [str(name) for name in np.asarray(classes)]
    figure = Figure((5, 5), layout="constrained")
    axes = figure.add_subplot()
    shares = counts / np.maximum(counts.sum(1, keepdims=True), 1)
    axes.imshow(shares, "Blues", vmin=0, vmax=1)
    for (row, column), count in np.ndenumerate(counts):
        if count:
            axes.text(
                column, row, str(count), ha="center", va="center", color="w" if shares[row, column] > 0.5 else "k"
            )
    axes.set_xticks(range(len(names)), names)
    axes.set_yticks(range(len(names)), names)
    axes.set(xlabel="recognised", ylabel="true")
    return figure
