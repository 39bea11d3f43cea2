"""Plots of models of spheres show what they are given."""

import numpy as np

from algorithms.shapes.maximal_balls import maximal_balls
from algorithms.shapes.pictures_of_spheres import plot_balls, plot_matches, plot_slice
from algorithms.shapes.sphere_matching import register_spheres
from tests.support.sphere_scenes import ball_mask, warped_models


def test_a_slice_has_the_circles_of_the_balls_that_it_meets() -> None:
    mask = ball_mask(8, 21)
    balls = np.vstack([maximal_balls(mask, 0.9), [[3, 3, 0, 1.5]]])
    circles = plot_slice(mask, balls, 10).axes[0].collections[0].get_paths()
    assert len(circles) == len(balls) - 1


def test_balls_and_matches() -> None:
    a, b, _ = warped_models(0, 30, 3)
    found = register_spheres(a, b)
    assert len(plot_balls(a).axes[0].collections[0].get_offsets()) == 33
    assert len(plot_matches(a, b, found).axes[0].lines) == len(found.match) > 20
