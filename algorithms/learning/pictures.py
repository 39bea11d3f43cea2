"""Pictures of trainings and of errors of networks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..extras import extra
from .algebra import Array
from .training import TrainingResult

with extra("pictures", __name__):
    from matplotlib.figure import Figure


def plot_losses(results: Mapping[str, TrainingResult]) -> Figure:
    """Plot the losses of trainings over the epochs or iterations."""
    figure = Figure(figsize=(5, 3), layout="constrained")
    axes = figure.add_subplot()
    for name, result in results.items():
        axes.semilogy(np.arange(1, len(result.losses) + 1), result.losses, label=name)
    axes.set(xlabel="epoch or iteration", ylabel="loss")
    axes.legend()
    return figure


def plot_errors(errors: Mapping[str, Mapping[str, Array]]) -> Figure:
    """Plot the errors of several seeds, by task and network, and their medians."""
    figure = Figure(figsize=(6, 3), layout="constrained")
    axes, names = figure.add_subplot(), list(errors)
    networks = sorted({network for found in errors.values() for network in found})
    for index, network in enumerate(networks):
        for place, name in enumerate(names):
            values = np.asarray(errors[name].get(network, []), float)
            at = place + 0.2 * (index - (len(networks) - 1) / 2)
            color = f"C{index}"
            axes.semilogy(np.full(len(values), at), values, ".", color=color, label="_" if place else network)
            if len(values):
                axes.semilogy([at - 0.07, at + 0.07], [np.median(values)] * 2, color=color)
    axes.set_xticks(range(len(names)), names)
    axes.set(ylabel="root mean square error")
    axes.legend()
    return figure
