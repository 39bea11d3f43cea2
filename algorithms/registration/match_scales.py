"""Ratios of lengths of matches."""

from __future__ import annotations

import numpy as np

from generated import registration as kernels

from ..arguments import Reals

_BINS, _PEAKS = 400, 3
"""Bins of the logarithm of ratios of lengths between 1/20 and 20, and peaks that are tried."""


def likely_scales(x: Reals, y: Reals, n_seeds: int) -> list[float]:
    """Return the ratios of lengths that most pairs have."""
    seeds = np.random.default_rng(0).permutation(len(x))[:n_seeds]
    one, two = kernels.lengths_of_pairs(x[seeds], y[seeds], x, y)
    long = (one > 0.1 * one.max()) & (two > 0)
    ratios = np.log(two[long] / one[long])
    count, edges = np.histogram(ratios, _BINS, (-np.log(20), np.log(20)))
    # The ratios of wrong pairs vary smoothly: a peak is what exceeds the mean of the bins around it.
    around = np.convolve(count, np.ones(21) / 21, "same")
    peaks = np.argsort(-(count - around) / np.sqrt(around + 1))[:_PEAKS]
    found = []
    for k in peaks:
        near = np.abs(ratios - (edges[k] + edges[k + 1]) / 2) < edges[1] - edges[0]
        found.append(float(np.exp(np.median(ratios[near]))) if near.any() else 1.0)
    return found
