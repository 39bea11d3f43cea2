"""Surfaces of regions that are edges, and regions that no edge limits."""

from typing import Any

import numpy as np
import scipy

from algorithms.shapes import SegmentStatus, segment
from algorithms.shapes.region_edges import limited_share, supported

GRID = np.indices((40, 40, 40)) - 19.5
BALL = (GRID**2).sum(0) < 12**2


def smooth(density: Any) -> Any:
    noise = np.random.default_rng(3).normal(size=density.shape)
    return scipy.ndimage.gaussian_filter(density + 0.1 * noise, 0.8)


def test_the_surface_of_a_ball_is_an_edge_and_that_of_a_smaller_one_in_it_is_not() -> None:
    density = smooth(1.0 * BALL)
    inner = (GRID**2).sum(0) < 8**2
    assert limited_share(BALL, density) > 0.95
    assert limited_share(inner, density) < 0.2
    assert limited_share(inner, smooth(GRID[0] / 10)) < 0.2


def test_a_cut_and_a_leak_do_not_compete_with_a_region_that_edges_limit() -> None:
    density = smooth(1.0 * BALL + 0.4 * (GRID[0] > 0) * ~BALL)
    half, leak = BALL & (GRID[1] > 2), BALL | (GRID[0] > 0)
    assert (supported(half, BALL, density) == BALL).all()
    assert (supported(leak, BALL, density) == BALL).all()
    # The ball competes with both of these.
    assert (supported(BALL, half, density) == BALL).all()
    assert (supported(BALL, leak, density) == BALL).all()


def test_an_organ_that_fades_into_its_surroundings_is_not_ok() -> None:
    rng = np.random.default_rng(4)
    fading = np.where(BALL, 1.0, np.clip((GRID[0] + 12) / 24, 0, 1)) + 0.03 * rng.normal(size=BALL.shape)
    found = segment(fading, (10, 20, 20))
    assert found.status != SegmentStatus.OK
    clear = segment(1.0 * BALL + 0.03 * rng.normal(size=BALL.shape), (10, 20, 20))
    assert clear.status == SegmentStatus.OK and (clear.mask ^ BALL).sum() < 0.05 * BALL.sum()
