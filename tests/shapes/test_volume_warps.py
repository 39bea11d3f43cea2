"""Volumes moved by registered models of spheres."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.shapes import maximal_balls, register_spheres, warp_volume


def horn(bend: float, size: int = 38) -> np.ndarray:
    """A bent cone, cut at both ends."""
    x, y, z = np.indices((size, size, size)) - size // 2
    return np.asarray((np.hypot(y - bend * x**2, z) < 8 + 0.2 * x) & (np.abs(x) < 16))


@pytest.mark.slow  # Surfaces are moved to each other in the tests of matching.
def test_a_mask_is_moved_to_the_other_shape() -> None:
    a, b = horn(0.0), np.roll(horn(0.012), (2, -3, 1), (0, 1, 2))
    spacing = (2.0, 2.0, 2.0)
    back = register_spheres(maximal_balls(b, 0.9, spacing), maximal_balls(a, 0.9, spacing))
    moved = warp_volume(a, back, b.shape, spacing)

    def dice(mask: np.ndarray) -> float:
        return float(2 * (mask & b).sum() / (mask.sum() + b.sum()))

    assert moved.dtype == bool and moved.shape == b.shape
    assert dice(moved) > 0.93 > 0.85 > dice(a)
    coarse, numbers = (warp_volume(x, back, (19, 19, 19), spacing, (4, 4, 4)) for x in (a, 100 * a.astype(np.int16)))
    np.testing.assert_array_equal(numbers > 50, coarse)


def test_a_similarity_moves_values_to_where_it_takes_points() -> None:
    rng = np.random.default_rng(0)
    balls = np.column_stack([rng.uniform(0, 30, (40, 3)), rng.uniform(1, 3, 40)])
    back = register_spheres(balls, balls + np.array([3, 4.5, -1.5, 0]), "similarity")
    volume = np.indices((20, 21, 22)).sum(0).astype(float)
    moved = warp_volume(volume, back, (20, 21, 22), (1.5, 1.5, 1.5))
    np.testing.assert_allclose(moved[:-2, :-3, 1:], volume[2:, 3:, :-1], atol=0.05)
    finer = warp_volume(volume, back, (10, 10, 10), (1.5, 1.5, 1.5), (0.75, 0.75, 1.5))
    np.testing.assert_allclose(finer[::2, ::2, 1:], volume[2:7, 3:8, :9], atol=0.05)


def test_errors_name_what_is_wrong() -> None:
    balls = np.column_stack([np.random.default_rng(0).uniform(0, 9, (9, 3)), np.ones(9)])
    back = register_spheres(balls, balls, "similarity")
    with pytest.raises(ValueError, match="expected three positive numbers"):
        warp_volume(np.zeros((4, 4, 4)), back, (4, 0, 4))
    with pytest.raises(ValueError, match="three positive lengths"):
        warp_volume(np.zeros((4, 4, 4)), back, (4, 4, 4), (1, 1, 0))
