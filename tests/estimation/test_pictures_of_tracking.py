"""Plots of tracking and of circles, and the animation of a head."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, pairwise, product
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

from algorithms.estimation import Tracker, joint_axis, pan_tilt_head, simulate_tracking
from algorithms.estimation.pictures_of_tracking import _pyramids, animate_tracking, draw_circles, draw_tracking
from generated import pga3


@pytest.mark.slow
def test_pictures(tmp_path: Path) -> None:
    tracker = Tracker(pan_tilt_head())
    recording = simulate_tracking(tracker, [0.3, 0.0], lambda t: [2.0, 0.5 * np.sin(t), 0.2], 0.5, control_time=5e-3)
    figure = draw_tracking(recording)
    FigureCanvasAgg(figure).draw()
    upper, lower = figure.axes
    assert len(upper.lines) == 2 and np.array_equal(upper.lines[0].get_ydata(), recording.q[:, 0])
    assert np.allclose(lower.lines[0].get_ydata(), np.linalg.norm(recording.error, axis=1))
    later = replace(recording, times=recording.times + 3.0)
    written = animate_tracking(tracker, later, tmp_path / "head.gif", frames_per_second=10)
    with Image.open(written) as film:
        assert film.n_frames == 5
    with pytest.raises(ValueError, match="0 steps; expected at least 2"):
        animate_tracking(tracker, replace(recording, times=recording.times[:0]), tmp_path / "none.gif")


def test_a_view_is_drawn_as_a_pyramid() -> None:
    """Along all edges; the image is as high as three quarters of its width."""
    (path,) = _pyramids(np.eye(8)[:1], 2.0, 0.5)
    apex, corners = (0, 0, 0), list(product((-1, 1), (-0.75, 0.75), (2,)))
    sides = {
        frozenset(pair) for pair in combinations(corners, 2) if pair[0][0] == pair[1][0] or pair[0][1] == pair[1][1]
    }
    edges = sides | {frozenset((apex, corner)) for corner in corners}
    assert {frozenset(pair) for pair in pairwise(map(tuple, path.tolist()))} == edges


def test_circles() -> None:
    turns = pga3.motor_from_line([1.0, 0, 0, 0, 0, 0], np.linspace(-0.5, 0.5, 8))
    points = pga3.move_point(turns[:, None], np.array([[1.0, 0.2, 0.3], [0.5, 1, 2]]))
    figure = draw_circles(points, [joint_axis(points), joint_axis(points[:2])])
    FigureCanvasAgg(figure).draw()
    axis, *circles = figure.axes[0].lines
    assert len(circles) == 2 and np.allclose(axis.get_data_3d()[:2], 0, atol=1e-12)
    assert np.allclose(np.hypot(*circles[0].get_data_3d()[:2]), np.hypot(1, 0.2))
    with pytest.raises(ValueError, match="axes: radii of 2 points; expected 1"):
        draw_circles(points[:, :1], [joint_axis(points)])
