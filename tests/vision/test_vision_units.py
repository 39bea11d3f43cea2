"""Vision in other units of pixels and directions: results that scale with the unit, and invariant ones."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.vision import LandmarkMap, factorize, fundamental_matrix, invariants_3d_deviation


def views_of(n_views: int, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cameras on a circle that look at the origin from about 6 units, and pixels."""
    cameras = np.empty((n_views, 3, 4))
    for v in range(n_views):
        c, s = np.cos(0.3 * v), np.sin(0.3 * v)
        turn = np.array([[c, 0, -s], [0.1 * s, 1, 0.1 * c], [s, -0.1, c]])
        turn = np.linalg.qr(turn.T)[0].T
        turn *= np.sign(np.diag(turn))[:, None]
        cameras[v] = np.diag([800.0, 800, 1]) @ np.concatenate([turn, [[0.2], [-0.1], [6 + 0.1 * v]]], 1)
    seen = np.einsum("vij,nj->vni", cameras, np.concatenate([points, np.ones((len(points), 1))], 1))
    return cameras, seen[..., :2] / seen[..., 2:]


@pytest.mark.parametrize("unit", [1e-5, 1e5])
def test_deviations_of_invariants_are_per_unit_of_pixels(unit: float) -> None:
    rng = np.random.default_rng(1)
    cameras, pixels = views_of(2, rng.uniform(-1, 1, (60, 3)))
    first, second = pixels.reshape(2, 10, 6, 2)
    scaled = np.diag([unit, unit, 1.0]) @ cameras
    one = invariants_3d_deviation(first, second, fundamental=fundamental_matrix(*cameras))
    two = invariants_3d_deviation(unit * first, unit * second, fundamental=fundamental_matrix(*scaled), noise=unit)
    np.testing.assert_allclose(two, one, rtol=1e-4)


@pytest.mark.parametrize("unit", [1e-6, 1e12, 1e30])
def test_a_refined_fundamental_matrix_is_that_of_any_unit(unit: float) -> None:
    rng = np.random.default_rng(4)
    first, second = views_of(2, rng.uniform(-1, 1, (40, 3)))[1]
    second = second + rng.normal(size=second.shape)
    scale = np.diag([unit, unit, 1.0])
    matrix = scale @ fundamental_matrix(unit * first, unit * second) @ scale
    expected = fundamental_matrix(first, second)
    matrix *= np.sign((matrix * expected).sum()) * np.linalg.norm(expected) / np.linalg.norm(matrix)
    np.testing.assert_allclose(matrix, expected, atol=1e-9 * np.abs(expected).max())


def test_singular_values_are_relative_to_the_first() -> None:
    """Test any unit, and one missing view of a point that the others determine."""
    rng = np.random.default_rng(2)
    _, pixels = views_of(5, rng.uniform(-1, 1, (20, 3)))
    hidden = pixels.copy()
    hidden[3, 4], hidden[0, 7] = np.nan, np.nan
    for given in (pixels, 1e3 * pixels, hidden):
        found = factorize(given)
        assert found.singular_values[0] == 1 and (np.diff(found.singular_values) <= 0).all()
        assert found.singular_values[3] > 1e-6 and (found.singular_values[4:] < 1e-9).all()
        unit = 1e3 if given[1, 1, 0] != pixels[1, 1, 0] else 1.0
        np.testing.assert_allclose(found.pixels / unit, pixels, atol=1e-5)


def test_landmarks_do_not_depend_on_lengths_of_directions() -> None:
    rng = np.random.default_rng(3)
    plane = np.concatenate([rng.uniform(-1, 1, (9, 2)), np.ones((9, 1))], 1)
    views = np.stack([plane @ np.linalg.qr(np.eye(3) + 0.2 * rng.normal(size=(3, 3)))[0] for _ in range(3)])
    one = LandmarkMap.learn([views])
    two = LandmarkMap.learn([views * rng.uniform(0.1, 10, (3, 9, 1))])
    np.testing.assert_allclose(two.points, one.points, atol=1e-12)
    for bad in (views[0], views[:0], views[None]):
        with pytest.raises(ValueError, match=r"landmarks\[0\]: shape"):
            LandmarkMap.learn([bad])
