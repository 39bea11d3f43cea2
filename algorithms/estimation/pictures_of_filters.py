"""Plots of filters: errors with the band of three standard deviations, and the test of innovations."""

from __future__ import annotations

import numpy as np
import scipy
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from ..arguments import real_array


def draw_errors(times: ArrayLike, errors: ArrayLike, deviations: ArrayLike, names: list[str], unit: str = "") -> Figure:
    """Draw errors over time, one below the other, with the band of three standard deviations.

    Parameters
    ----------
    times : array_like, (t,)
    errors, deviations : array_like, (t, k)
        Errors, and their standard deviations by the filter.
    names : list of str
        Of the k errors.
    unit : str
    """
    x = real_array(times, "times", (-1,))
    e, s = (real_array(a, name, (len(x), len(names))) for a, name in ((errors, "errors"), (deviations, "deviations")))
    figure = Figure(figsize=(8, 1.6 * len(names) + 0.6), layout="constrained")
    axes = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for k, (axis, name) in enumerate(zip(axes, names, strict=True)):
        axis.fill_between(x, -3 * s[:, k], 3 * s[:, k], color="0.85", label="3 standard deviations")
        axis.plot(x, e[:, k], lw=0.9, label="error")
        axis.set_ylabel(f"{name} ({unit})" if unit else name)
        axis.margins(x=0)
    axes[0].legend(loc="upper right", ncols=2, fontsize="small")
    axes[-1].set_xlabel("time (s)")
    return figure


def draw_innovations(squares: ArrayLike, freedom: int, probability: float = 0.95) -> Figure:
    """Draw means of normalised squared innovations over runs, with the band in which they are with a probability.

    Parameters
    ----------
    squares : array_like, (n, t)
        The squares of n runs at t times, each divided by its covariance.
    freedom : int
        How many numbers each measurement has: the mean of the squares of a consistent filter.
    probability : float
    """
    array = real_array(squares, "squares", (-1, -1))
    n, t = array.shape
    tail = (1 - probability) / 2
    low, high = (float(scipy.special.chdtri(n * freedom, p)) / n for p in (1 - tail, tail))
    figure = Figure(figsize=(8, 3), layout="constrained")
    axis = figure.subplots()
    axis.axhspan(low, high, color="0.85", label=f"{100 * probability:.0f} % band of {n} runs")
    axis.axhline(freedom, color="0.5", lw=0.8)
    axis.plot(np.arange(1, t + 1), array.mean(0), ".-", label="mean of squared innovations")
    axis.set_xlabel("update")
    axis.legend(loc="upper right", fontsize="small")
    return figure
