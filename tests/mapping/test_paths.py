"""Paths of lines and arcs: poses, distances and unusable paths."""

import numpy as np
import pytest

from algorithms.mapping.navigation_status import PathStatus
from algorithms.mapping.paths import PlanarPath
from generated import cga2, pga2


def pose(x: float, y: float, angle: float = 0.0) -> np.ndarray:
    return np.asarray(pga2.motor_from_angle_translation(angle, np.array([x, y])))


def places(path: PlanarPath, positions: np.ndarray) -> np.ndarray:
    return np.asarray(pga2.motor_to_angle_translation(path.pose(positions))[1])


def test_line_arc_line() -> None:
    path = PlanarPath.from_pieces(pose(1, 1), [2.0, np.pi / 2, 3.0], [np.inf, 1.0, np.inf])
    np.testing.assert_allclose(path.length, 5 + np.pi / 2)
    expected = [[1, 1], [3, 1], [3 + np.sin(0.5), 2 - np.cos(0.5)], [4, 2], [4, 5]]
    np.testing.assert_allclose(places(path, np.array([0, 2, 2.5, 2 + np.pi / 2, 9])), expected, atol=1e-12)
    np.testing.assert_allclose(path.curvature([0.5, 2.5, 4.0]), [0, 1, 0])


def test_vectors_are_the_lines_and_circles() -> None:
    path = PlanarPath.from_pieces(pose(1, 1, 0.3), [2.0, 1.0, 2.0], [np.inf, 2.0, -0.5])
    np.testing.assert_allclose(cga2.inner_product_of_vectors(path.vectors, path.vectors), 1, atol=1e-12)
    at = np.array([[0.1, 1.0, 1.9], [2.1, 2.5, 2.9], [3.1, 4.0, 4.9]])
    points = places(path, at)
    on_path = np.concatenate([points, np.ones((3, 3, 1)), (points**2).sum(-1, keepdims=True) / 2], -1)
    inner = np.asarray(cga2.inner_product_of_vectors(on_path, path.vectors[:, None]))
    np.testing.assert_allclose(inner, 0, atol=1e-12)


@pytest.mark.parametrize("aside", [0.3, -0.3, 0.0])
def test_locate_points_beside_the_path(aside: float) -> None:
    path = PlanarPath.from_pieces(pose(-1, 2, 1.0), [2.0, 2.0, 1.0, 1.5], [np.inf, -1.0, np.inf, 0.8])
    positions = np.linspace(0, path.length, 301)
    beside = pga2.motor_product(path.pose(positions), pose(0, aside))
    found = path.locate(pga2.motor_to_angle_translation(beside)[1])
    np.testing.assert_allclose(found.distance, aside, atol=1e-10)
    np.testing.assert_allclose(found.position, positions, atol=1e-9)


def test_locate_agrees_with_a_search() -> None:
    rng = np.random.default_rng(2)
    path = PlanarPath.through([[0, 0], [4, 0], [4, 3], [1, 3.5]], 0.7)
    points = rng.uniform([-1, -1], [5, 5], (100, 2))
    fine = np.linspace(0, path.length, 2001)
    away = np.linalg.norm(points[:, None] - places(path, fine), axis=-1)
    found = path.locate(points)
    np.testing.assert_allclose(np.abs(found.distance), away.min(1), atol=1e-3)
    np.testing.assert_allclose(found.position, fine[away.argmin(1)], atol=0.05)
    part = path.locate(points, 1.0, 2.0)
    inside = (fine >= 1) & (fine <= 2)
    np.testing.assert_allclose(np.abs(part.distance), away[:, inside].min(1), atol=5e-3)


def test_through_points_touches_the_lines() -> None:
    path = PlanarPath.through([[0, 0], [4, 0], [4, 3]], 0.5)
    np.testing.assert_allclose(path.lengths, [3.5, np.pi / 4, 2.5])
    np.testing.assert_allclose(path.curvatures, [0, 2, 0])
    np.testing.assert_allclose(places(path, np.array([0.0, 99.0])), [[0, 0], [4, 3]], atol=1e-12)
    # A radius for which the lines are too short becomes smaller.
    tight = PlanarPath.through([[0, 0], [1, 0], [1, 0.4], [3, 0.4]], 5.0)
    assert tight.status == PathStatus.OK and np.abs(tight.curvatures).max() < 1 / 0.19
    np.testing.assert_allclose(places(tight, np.array([99.0])), [[3, 0.4]], atol=1e-12)
    straight = PlanarPath.through([[0, 0], [1, 0], [1, 0], [3, 0]], 0.0)
    assert straight.status == PathStatus.OK and straight.length == 3


def test_unusable_paths() -> None:
    start = pose(0, 0)
    assert PlanarPath.from_pieces(start, [], []).status == PathStatus.EMPTY
    assert PlanarPath.from_pieces(start, [0.0], [np.inf]).status == PathStatus.EMPTY
    assert PlanarPath.from_pieces(start, [1.0, 1.0], [np.inf, 0.0]).status == PathStatus.ZERO_RADIUS
    assert PlanarPath.from_pieces(start, [np.nan], [1.0]).status == PathStatus.NOT_FINITE
    assert PlanarPath.through([[1, 1], [1, 1]], 1.0).status == PathStatus.EMPTY
    assert PlanarPath.through([[0, 0], [1, 0], [1, 1]], 0.0).status == PathStatus.ZERO_RADIUS
    assert PlanarPath.through([[0, 0], [1, 0], [0, 0]], 0.2).status == PathStatus.ZERO_RADIUS
    assert PlanarPath.through([[0, 0], [np.inf, 0]], 0.2).status == PathStatus.NOT_FINITE
    with pytest.raises(ValueError, match="full turn"):
        PlanarPath.from_pieces(start, [7.0], [1.0])
    with pytest.raises(ValueError, match="status EMPTY"):
        PlanarPath.from_pieces(start, [], []).pose(0.0)
    nothing = PlanarPath.from_pieces(start, [], []).locate([[0.0, 1.0]])
    assert np.isinf(nothing.distance).all() and nothing.piece.tolist() == [-1]
