"""Poses from points where linear equations fail: nearly planar, far from the origin, few, or random pixels."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pose_scenes import INTRINSICS, bent_board, camera_error, seen_from_somewhere, thick_points
from selection import some_slow

from algorithms.vision import VisionStatus, localizations, localize
from tests.support.all_cases import all_cases

Array = np.ndarray[Any, Any]


@pytest.mark.parametrize("bend", some_slow([0.0, 0.5, 1.0, 2.0, 5.0], 0.5, 2.0))
def test_bent_boards(bend: float) -> None:
    """9 x 6 points of 30 mm at 0.7 m, half a pixel of noise: a wrong start has an error of 50 degrees, noise 0.2."""
    rng = np.random.default_rng(int(10 * bend))
    views = [seen_from_somewhere(rng, bent_board(bend), 700.0, noise=0.5) for _ in range(6)]
    check(views, 2.0)


@pytest.mark.parametrize("thickness", some_slow([1e-4, 5e-4, 1.2e-3, 3e-3, 1e-2, 0.1, 1], 5e-4, 3e-3))
def test_thin_scenes(thickness: float) -> None:
    rng = np.random.default_rng(round(1e4 * thickness))
    views = [seen_from_somewhere(rng, thick_points(rng, 12, thickness), rng.uniform(3, 8), noise=0.5) for _ in range(6)]
    check(views, 4.0)


@pytest.mark.parametrize("offset", [1e2, 1e4, 1e6])
def test_distant_origins(offset: float) -> None:
    rng = np.random.default_rng(int(offset))
    views = [
        seen_from_somewhere(rng, thick_points(rng, 10, 1.0), rng.uniform(3, 8), offset, noise=0.5) for _ in range(6)
    ]
    check(views, 2.0)


def check(views: list[tuple[Array, Array, Array, Array]], degrees: float) -> None:
    """All problems are solved with errors that noise explains, alone and in a batch."""
    many = localizations(np.array([v[0] for v in views]), np.array([v[1] for v in views]), INTRINSICS)
    assert (many.status == VisionStatus.OK).all()
    for (points, pixels, turn, centre), pose in zip(views, many.models, strict=True):
        found = localize(points, pixels, INTRINSICS)
        assert found.status == VisionStatus.OK and found.residual < 1.2
        for each in (found.pose, pose):
            angle, away = camera_error(each, turn, centre)
            assert np.degrees(angle) < degrees
            assert away < 0.1 * np.linalg.norm(points.mean(0) - centre)


@all_cases("n_points", [4, 5, 6, 7, 10])
@all_cases("thickness", [0.0, 0.1, 1.0])
def test_few_exact_points(n_points: int, thickness: float) -> None:
    rng = np.random.default_rng(n_points)
    for _ in range(3):
        points, pixels, turn, centre = seen_from_somewhere(rng, thick_points(rng, n_points, thickness), 5.0)
        found = localize(points, pixels, INTRINSICS)
        assert found.status == VisionStatus.OK and found.residual < 1e-6
        assert max(camera_error(found.pose, turn, centre)) < 1e-6


@pytest.mark.slow
def test_random_pixels_are_not_an_image() -> None:
    rng = np.random.default_rng(4)
    for n_points, allowed in ((4, 4), (5, 1), (8, 0), (30, 0)):
        points, pixels = rng.uniform(-1, 1, (300, n_points, 3)), rng.uniform(0, [640, 480], (300, n_points, 2))
        found = localizations(points, pixels, INTRINSICS)
        assert (found.status == VisionStatus.OK).sum() <= allowed
        assert np.isnan(found.models[found.status != VisionStatus.OK]).all()


def test_steps_that_end_early_are_named() -> None:
    rng = np.random.default_rng(5)
    points, pixels, _, _ = seen_from_somewhere(rng, thick_points(rng, 12, 1.0), 5.0, noise=0.5)
    assert localizations(points, pixels, INTRINSICS, n_steps=1).status == VisionStatus.NOT_CONVERGED
    assert localizations(points, pixels, INTRINSICS).status == VisionStatus.OK
