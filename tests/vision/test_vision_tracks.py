"""Shape and motion with points that few views see and with wrong tracks, against exact cameras."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from selection import some_slow

from algorithms.vision import VisionStatus, factorize

Array = np.ndarray[Any, Any]
N_POINTS = 60


def images(rng: np.random.Generator, n_views: int) -> Array:
    """Exact pixels (v, n, 2) of points of a cube in cameras around it, of 640 x 480 pixels."""
    points = rng.uniform(-1, 1, (N_POINTS, 3))
    k = np.array([[600.0, 0, 320], [0, 600, 240], [0, 0, 1]])
    pixels = []
    for _ in range(n_views):
        turn = Rotation.from_rotvec(0.4 * rng.normal(size=3)).as_matrix()
        seen = (points @ turn.T + [0, 0, 5] + 0.3 * rng.normal(size=3)) @ k.T
        pixels.append(seen[:, :2] / seen[:, 2:])
    return np.array(pixels)


def spoiled(rng: np.random.Generator, pixels: Array, n_wrong: int, kind: str) -> tuple[Array, Array]:
    """Replace the first tracks by wrong ones in all or a third of the views; also return a mask of these."""
    wrong = np.zeros(pixels.shape[:2], bool)
    if kind == "everywhere":
        wrong[:, :n_wrong] = True
    else:
        for point in range(n_wrong):
            wrong[rng.choice(len(pixels), len(pixels) // 3, replace=False), point] = True
    bad = np.where(wrong[..., None], rng.uniform([0, 0], [640, 480], pixels.shape), pixels)
    return bad, wrong


@pytest.mark.parametrize("kind", ["everywhere", "in some views"])
@pytest.mark.parametrize(("n_wrong", "n_views"), some_slow([(5, 3), (5, 8), (12, 8)], (5, 8)))
def test_wrong_tracks_do_not_move_the_others(n_wrong: int, n_views: int, kind: str) -> None:
    rng = np.random.default_rng(n_wrong + n_views)
    exact = images(rng, n_views)
    noisy = exact + 0.3 * rng.normal(size=exact.shape)
    bad, wrong = spoiled(rng, noisy, n_wrong, kind)
    alone, found = factorize(noisy[:, n_wrong:]), factorize(bad)
    assert found.status == VisionStatus.OK
    assert not (found.inliers & wrong).any()
    assert found.inliers[:, n_wrong:].all()
    off, least = (
        np.sqrt(np.mean((each - exact[:, n_wrong:]) ** 2)) for each in (found.pixels[:, n_wrong:], alone.pixels)
    )
    assert off <= 1.05 * least
    assert not found.point_status[n_wrong:].any()
    if kind == "everywhere":
        assert (found.point_status[:n_wrong] == VisionStatus.NO_CONSENSUS).all()
        assert np.isnan(found.points[:n_wrong]).all()


def test_observations_are_corrected_if_the_others_agree() -> None:
    rng = np.random.default_rng(3)
    exact = images(rng, 9)
    bad, wrong = spoiled(rng, exact, 10, "in some views")
    found = factorize(bad)
    assert not found.point_status.any()
    np.testing.assert_array_equal(found.inliers, ~wrong)
    assert np.abs(found.pixels - exact).max() < 1e-7


@pytest.mark.parametrize("n_views", [2, 4, 8])
def test_a_point_seen_once_has_a_separate_status(n_views: int) -> None:
    rng = np.random.default_rng(4)
    exact = images(rng, n_views)
    pixels = exact.copy()
    pixels[1:, 0] = np.nan
    pixels[:, 1] = np.nan
    found = factorize(pixels)
    assert found.status == VisionStatus.OK
    assert (found.point_status[:2] == VisionStatus.TOO_FEW).all() and not found.point_status[2:].any()
    assert np.isnan(found.points[:2]).all() and not found.view_status.any()
    assert np.abs(found.pixels[:, 2:] - exact[:, 2:]).max() < 1e-7


def test_a_view_that_sees_too_little_has_a_separate_status() -> None:
    rng = np.random.default_rng(5)
    exact = images(rng, 5)
    pixels = exact.copy()
    pixels[3, 5:] = np.nan
    found = factorize(pixels)
    assert found.status == VisionStatus.TOO_FEW
    assert list(found.view_status) == [0, 0, 0, VisionStatus.TOO_FEW, 0] and not found.point_status.any()
    assert np.abs(found.pixels[[0, 1, 2, 4]] - exact[[0, 1, 2, 4]]).max() < 1e-7


def test_all_correct_observations_are_used() -> None:
    """With noise only, also if half of the observations are hidden."""
    rng = np.random.default_rng(6)
    kept = asked = 0
    for _ in range(2):
        exact = images(rng, 8)
        seen = rng.random(exact.shape[:2]) < 0.5
        found = factorize(exact + 0.5 * rng.normal(size=exact.shape), seen)
        assert found.status == VisionStatus.OK
        assert not (found.inliers & ~seen).any()
        kept, asked = kept + found.inliers.sum(), asked + (seen & (seen.sum(0) >= 2)).sum()
    assert kept >= 0.999 * asked


@pytest.mark.parametrize("n_views", [3, 8])
def test_random_pixels_have_no_consensus(n_views: int) -> None:
    rng = np.random.default_rng(7)
    for _ in range(4):
        found = factorize(rng.uniform([0, 0], [640, 480], (n_views, N_POINTS, 2)))
        assert found.status in (VisionStatus.NO_CONSENSUS, VisionStatus.DEGENERATE)
