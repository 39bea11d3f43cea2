"""Plots show the data they are given."""

from __future__ import annotations

import numpy as np

from algorithms.shapes import gradient_vector_flow, surface, trace_contour
from algorithms.shapes.pictures_of_shapes import plot_contour, plot_flow, plot_segment, plot_surface


def test_plots() -> None:
    image = np.hypot(*(np.indices((40, 40)) - 20)) < 12
    found = trace_contour(image)
    figure = plot_contour(image, found)
    assert len(figure.axes[0].lines[0].get_xdata()) == len(found.path) + 1
    assert plot_flow(image, gradient_vector_flow(image), found.samples).axes[0].lines[0].get_xdata()[0] > 0
    ball = np.hypot(np.hypot(*(np.indices((20, 20, 20))[:2] - 10)), np.indices((20, 20, 20))[2] - 10) < 6
    assert [axis.get_title() for axis in plot_segment(ball * 1.0, ball).axes] == [
        f"axis {axis}, slice 10" for axis in range(3)
    ]


def test_plot_of_a_surface() -> None:
    grid = np.indices((30, 30, 30)) - 15
    found = surface((grid**2).sum(0) < 120)
    left, right = plot_surface(found).axes
    assert left.get_xlim()[1] > found.nodes[:, 0].max() > 20 and len(left.collections) == 1
    assert left.get_title() == f"{len(found.nodes)} nodes, genus {found.genus}, {found.status.name}"
    assert len(right.lines[0].get_xdata()) == len(found.curve)
