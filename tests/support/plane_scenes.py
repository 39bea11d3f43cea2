"""Two views of points, some of them on a plane, with noise and wrong pairs, for tests of robust F."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

Array = np.ndarray[Any, Any]


def seen_from_two_places(
    rng: np.random.Generator,
    n_points: int,
    on_plane: float,
    noise: float,
    wrong: float,
    points: Array | None = None,
) -> tuple[Array, Array, Array, tuple[Array, Array]]:
    """Pixels in two images, which pairs are wrong, and exact pixels of other points in space.

    The cameras are 1.5 units apart and six from the points; a wrong pair has its partner anywhere in 640 x 480 pixels.
    """
    if points is None:
        points = rng.uniform(-1, 1, (n_points, 3)) * [2, 1.5, 1.5]
        some = rng.permutation(n_points) < round(on_plane * n_points)
        points[some, 2] = points[some, :2] @ (0.3 * rng.normal(size=2))
    fresh = rng.uniform(-1, 1, (2000, 3)) * [2, 1.5, 1.5]
    views, exact = [], []
    for side in (-0.5, 0.5):
        turn = Rotation.from_rotvec([0.02, -side / 4, 0.05 * side] + 0.05 * rng.normal(size=3)).as_matrix()
        for places, kept in ((points, views), (fresh, exact)):
            there = (places - [1.5 * side, 0.15 * side, -6]) @ turn.T
            kept.append(700 * there[:, :2] / there[:, 2:] + [320, 240])
    one, two = (view + noise * rng.normal(size=view.shape) for view in views)
    bad = rng.random(n_points) < wrong
    two[bad] = rng.uniform(0, [640, 480], (int(bad.sum()), 2))
    return one, two, bad, (exact[0], exact[1])


def error_on_fresh_points(matrix: Array, first: Array, second: Array) -> float:
    """The root of the mean square of symmetric distances to epipolar lines, in pixels."""
    one, two = (np.c_[x, np.ones(len(x))] for x in (first, second))
    lines, back = one @ matrix.T, two @ matrix
    off = (two * lines).sum(1)
    square = off**2 * (1 / (lines[:, :2] ** 2).sum(1) + 1 / (back[:, :2] ** 2).sum(1)) / 2
    return float(np.sqrt(square.mean()))
