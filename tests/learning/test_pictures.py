"""Pictures contain what they are given."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from algorithms.learning import TrainingResult, TrainingStatus
from algorithms.learning.pictures import plot_errors, plot_losses


def test_losses() -> None:
    result = TrainingResult(TrainingStatus.OK, np.array([3.0, 1, 0.5]), np.zeros(0))
    (axes,) = plot_losses({"adam": result}).axes
    assert np.asarray(axes.lines[0].get_xydata()).tolist() == [[1, 3], [2, 1], [3, 0.5]]


def test_errors_and_medians() -> None:
    (axes,) = plot_errors({"task": {"G(3)": np.array([1.0, 2, 5]), "R": np.array([3.0])}}).axes
    assert [np.asarray(line.get_ydata()).tolist() for line in axes.lines] == [[1, 2, 5], [2, 2], [3], [3, 3]]
