"""Groups of points against the distances of all points from all capsules."""

import numpy as np

from algorithms.grasping.clusters import clusters_of
from generated import grasping
from tests.grasping.test_plans import distances_to_mesh
from tests.support.all_cases import all_cases
from tests.support.grasp_shapes import SHAPES


def distances(points, ends, radii):
    """Return the distance (n, k) of the closest point from each capsule, by projection."""
    p, d = ends[..., 0, :], ends[..., 1, :] - ends[..., 0, :]
    off = points[:, None, None] - p
    share = np.clip((off * d).sum(-1) / np.maximum((d * d).sum(-1), 1e-300), 0, 1)
    return np.linalg.norm(off - share[..., None] * d, axis=-1).min(0) - radii


@all_cases("size", [1, 7, 32])
@all_cases("count", [1, 31, 400])
def test_clear_sets_of_capsules(size, count):
    rng = np.random.default_rng(count + size)
    points = rng.uniform(-1, 1, (count, 3)) * [0.1, 0.03, 0.05]
    groups = clusters_of(points, size)
    assert {tuple(p) for p in groups.parts.reshape(-1, 3)} == {tuple(p) for p in points}
    ends = rng.uniform(-1, 1, (200, 4, 1, 3)) * 0.15 + rng.normal(0, 0.02, (200, 4, 2, 3))
    radii = rng.uniform(0, 0.02, 4)
    found = distances(points, ends, radii)
    for least in (-0.0015, 0.0, 0.01):
        clear = groups.clear_of(ends, radii, least)
        assert (clear == (found > least).all(-1)).all()
    assert (clear.any() and not clear.all()) or count == 1


def test_clear_sets_of_capsules_near_triangles():
    rng = np.random.default_rng(5)
    triangles = rng.uniform(-0.1, 0.1, (40, 1, 3)) + rng.normal(0, 0.02, (40, 3, 3))
    triangles[0] = triangles[0, 0] + np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.4, 0]])
    groups = clusters_of(triangles, 8)
    places = rng.uniform(-0.15, 0.15, (60, 3))
    # Spheres, each with a radius of its own.
    found = distances_to_mesh(places, triangles.reshape(-1, 3), np.arange(120).reshape(-1, 3))
    radii = np.where(np.arange(60) % 2, 0.95, 1.05) * found
    clear = groups.clear_of(np.repeat(places[:, None, None], 2, 2), radii[:, None], 0.0)
    assert clear.tolist() == (np.arange(60) % 2 == 1).tolist()


def test_spheres_contain_their_groups():
    vertices, _ = SHAPES["ring"]()
    groups = clusters_of(vertices, 16)
    gaps = np.linalg.norm(groups.parts - groups.centres[:, None], axis=-1)
    assert (gaps <= groups.radii[:, None] * (1 + 1e-12)).all()
    # Neighbours are together: the spheres are much smaller than the shape.
    assert np.median(groups.radii) < 0.25 * np.ptp(vertices, axis=0).max()


def test_equal_points_and_no_capsules_near():
    groups = clusters_of(np.zeros((5, 3)), 4)
    ends = np.array([[[[1.0, 0, 0], [2.0, 0, 0]]], [[[0.0, 0, 0], [0.0, 0, 0]]]])
    assert groups.clear_of(ends, np.array([0.5]), 0.0).tolist() == [True, False]
    assert groups.clear_of(ends[:0], np.array([0.5]), 0.0).shape == (0,)


def test_gap_of_a_point_from_a_capsule():
    start, end = np.array([0.0, 0, 0]), np.array([2.0, 0, 0])
    points = np.array([[1.0, 3, 0], [-3.0, 0, 4], [2.0, 0, 0.5], [1.0, 0, 0]])
    assert np.allclose(grasping.capsule_gap(points, start, end, 1.0), [2, 4, -0.5, -1])
    assert np.allclose(grasping.capsule_gap(points, start, start, 0.0), np.linalg.norm(points, axis=1))
