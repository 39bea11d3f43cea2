"""The parts that linear estimates share: random sets of items, and equations for cameras."""

from __future__ import annotations

import numpy as np

from algorithms.evidence import random_sets
from algorithms.vision.linear_cameras import camera_equations, linear_cameras_of, unit_moments


def scene() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(5)
    cameras, points = rng.normal(size=(2, 3, 4)), rng.normal(size=(9, 4))
    images = np.einsum("vij,nj->vni", cameras, points)
    return cameras, points, images[..., :2] / images[..., 2:]


def test_sets_have_different_items_and_are_the_same_in_every_run() -> None:
    sets = random_sets(12, 5, 40)
    assert sets.shape == (40, 5) and sets.min() >= 0 and sets.max() < 12
    assert all(len(set(row)) == 5 for row in sets.tolist())
    assert len({tuple(sorted(row)) for row in sets.tolist()}) > 30
    assert np.array_equal(sets, random_sets(12, 5, 40))


def test_true_cameras_satisfy_the_equations() -> None:
    cameras, points, pixels = scene()
    rows = camera_equations(pixels, points)
    assert rows.shape == (2, 18, 12)
    off = np.einsum("vij,vj->vi", rows, cameras.reshape(2, 12))
    assert np.abs(off).max() < 1e-12 * np.abs(rows).max()
    assert np.abs(camera_equations(pixels + 0.1, points)[0] @ cameras[0].ravel()).max() > 1e-3


def test_moments_become_those_of_a_unit_matrix() -> None:
    _, points, _ = scene()
    even, root = unit_moments(points)
    assert np.allclose(even.T @ even / len(points), np.eye(4), atol=1e-12)
    assert np.allclose(even @ root.T, points, atol=1e-12)


def test_cameras_are_found_up_to_scale() -> None:
    cameras, points, pixels = scene()
    found = linear_cameras_of(pixels, np.ones(pixels.shape[:2]), points)
    for one, wanted in zip(found.reshape(2, 12), cameras.reshape(2, 12), strict=True):
        cosine = one @ wanted / np.linalg.norm(one) / np.linalg.norm(wanted)
        assert abs(abs(cosine) - 1) < 1e-12
