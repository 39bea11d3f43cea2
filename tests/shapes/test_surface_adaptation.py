"""Surfaces that follow moved and deformed shapes keep their triangles, and their motors are the motion."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.shapes import Surface, SurfaceStatus, surface
from generated import pga3


def egg(count: int, seed: int = 0) -> np.ndarray:
    """Random points on an ellipsoid with three different axes."""
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return np.asarray(points * [3, 2, 1.5] / np.linalg.norm(points, axis=1, keepdims=True))


@pytest.fixture(scope="module")
def before() -> Surface:
    return surface(egg(3000))


def test_motion_of_nodes_is_that_of_the_shape(before: Surface) -> None:
    motor = pga3.motor_exponential([0.05, 0.04, -0.06, 0.5, -0.3, 0.2])
    moved = pga3.move_point(motor, egg(3000, 7))
    found = surface(moved, start=before)
    assert found.status is SurfaceStatus.OK
    np.testing.assert_array_equal(found.triangles, before.triangles)
    # Nodes may slide along the surface: they are near their images, much nearer than to where they were.
    images = pga3.move_point(motor, before.nodes)
    slides = np.linalg.norm(found.nodes - images, axis=1)
    assert np.median(slides) < 0.2 * np.median(np.linalg.norm(images - before.nodes, axis=1))
    inner = pga3.move_point(pga3.motor_inverse(motor), found.nodes) / [3, 2, 1.5]
    assert np.abs(np.linalg.norm(inner, axis=1) - 1).max() < 0.03
    motions = pga3.motor_product(found.motors, pga3.motor_inverse(before.motors))
    np.testing.assert_allclose(pga3.move_point(motions, before.nodes), found.nodes, atol=1e-9)


def test_a_shape_that_deforms_and_one_of_another_genus(before: Surface) -> None:
    bent = egg(3000, 3)
    bent = bent * [1.1, 0.9, 1] + np.column_stack([np.zeros((len(bent), 2)), 0.1 * bent[:, 0] ** 2])
    assert surface(bent, start=before).status is SurfaceStatus.OK
    rng = np.random.default_rng(0)
    u, v = rng.uniform(0, 2 * np.pi, (2, 3000))
    ring = np.column_stack([(3 + np.cos(v)) * np.cos(u), (3 + np.cos(v)) * np.sin(u), np.sin(v)])
    assert surface(ring, start=before).status is not SurfaceStatus.OK
