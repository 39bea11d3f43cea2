"""Residuals that follow a shape, and objects that are fitted to other shapes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from algorithms.evidence.misfit import has_shape, in_sequence
from algorithms.mapping import FitStatus, SolidKind, fit_box, fit_circle, fit_solid


@pytest.mark.parametrize("size", [0.9, 1.1])
def test_the_limit_is_a_quantile_of_chi_square(size: float) -> None:
    """A cosine of three half waves has the square of its coefficient, of ten possible ones."""
    wave = np.sqrt(2 / 80) * np.cos(3 * np.pi * (np.arange(80) + 0.5) / 80)
    assert has_shape(np.sqrt(size * chi2.isf(1e-3, 10)) * wave, in_sequence(80), (9,)) == (size > 1)


def test_noise_has_a_shape_at_most_once_in_a_thousand() -> None:
    rng = np.random.default_rng(1)
    found = 0
    for _ in range(2000):
        places = rng.normal(size=(30, 2))
        found += has_shape(rng.normal(size=30), places, (2, 4))
    # The expected number is at most 2; 9 or more have a probability of 2e-4.
    assert found < 9


def test_solids_of_other_shapes_noise_and_copies() -> None:
    rng = np.random.default_rng(2)
    for _ in range(10):
        angle, height = rng.uniform(-0.8, 0.8, 150), rng.uniform(-1, 1, 150)
        curved = 0.7 * np.stack([np.cos(angle), np.sin(angle), height], 1)
        ball = rng.normal(size=(300, 3))
        ball = (ball / np.linalg.norm(ball, axis=1, keepdims=True))[ball[:, 2] > 0]
        level = np.column_stack([rng.uniform(-1, 1, (80, 2)), np.zeros(80)])
        plane, sphere = SolidKind.PLANE, SolidKind.SPHERE
        for points, kind, factor, right in (
            (level, plane, 1, True),
            (level, plane, 2.5, False),
            (curved, plane, 1, False),
            (0.4 * ball, sphere, 1, True),
            (0.4 * ball, sphere, 2.5, False),
            (0.4 * ball * [1, 0.7, 1], sphere, 1, False),
        ):
            seen = points + factor * 0.01 * rng.normal(size=points.shape)
            found = fit_solid(seen, np.tile([1e-4, 0, 0, 1e-4, 0, 1e-4], (len(seen), 1)), kind)
            assert found.status == (FitStatus.OK if right else FitStatus.UNEXPLAINED)
    seen = np.repeat(level[:20] + 0.01 * rng.normal(size=(20, 3)), 5, axis=0)
    spreads = np.tile([1e-4, 0, 0, 1e-4, 0, 1e-4], (100, 1))
    once, often = fit_solid(seen[::5], spreads[::5], plane), fit_solid(seen, spreads, plane)
    assert often.deviation == pytest.approx(once.deviation, rel=1e-12)
    assert np.array_equal(often.inliers, np.repeat(once.inliers, 5))


def test_columns_are_no_boxes_and_few_points_are_no_circles() -> None:
    rng = np.random.default_rng(3)
    for _ in range(25):
        radius, turn = rng.uniform(0.15, 0.5), np.linspace(-1.5, 1.5, 60)
        column = radius * np.stack([np.cos(turn), np.sin(turn)], 1) + 0.01 * rng.normal(size=(60, 2))
        assert fit_circle(column).status == FitStatus.OK
        assert fit_box(column, 0.01, (3.0, 0.2)).status != FitStatus.OK
        few = rng.uniform(-1, 1, (5, 2))
        assert fit_circle(few, 0.02).status != FitStatus.OK
        assert fit_circle(np.repeat(few, 8, axis=0), 0.02).status != FitStatus.OK


def test_points_without_a_ray_have_no_outline() -> None:
    """With equal variances in all directions, no side of a sphere is left out."""
    rng = np.random.default_rng(4)
    out = rng.normal(size=(200, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    seen = 0.5 * out + 0.01 * rng.normal(size=out.shape)
    found = fit_solid(seen, np.tile([1e-4, 0, 0, 1e-4, 0, 1e-4], (200, 1)), SolidKind.SPHERE)
    assert found.status == FitStatus.OK and found.inliers.mean() > 0.99
