"""Pictures of filters show the numbers that they are given."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from algorithms.estimation.pictures_of_filters import draw_errors, draw_innovations


def test_errors_and_bands() -> None:
    times, errors = np.arange(5.0), np.arange(10.0).reshape(5, 2)
    figure = draw_errors(times, errors, np.full((5, 2), 0.5), ["east", "north"], "m")
    first, second = figure.axes
    assert np.array_equal(second.lines[0].get_ydata(), errors[:, 1])
    assert first.collections[0].get_paths()[0].get_extents().ymax == 1.5
    assert first.get_ylabel() == "east (m)"
    with pytest.raises(ValueError, match="errors"):
        draw_errors(times, errors[:4], errors, ["east", "north"])


def test_band_of_innovations() -> None:
    rng = np.random.default_rng(1)
    squares = rng.chisquare(4, (200, 30))
    (axis,) = draw_innovations(squares, 4).axes
    assert np.array_equal(axis.lines[1].get_ydata(), squares.mean(0))
    low, high = (x / 200 for x in chi2.interval(0.95, 800))
    box = axis.patches[0].get_extents().transformed(axis.transData.inverted())
    assert np.allclose([box.ymin, box.ymax], [low, high])
