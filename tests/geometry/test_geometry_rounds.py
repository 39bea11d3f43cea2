"""Cylinders, cones and meshes of `algorithms.geometry`, against the true parameters and scipy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial import ConvexHull

from algorithms.geometry import fit_cone, fit_cylinder, hit_mesh
from generated import cga3

Array = np.ndarray[Any, Any]


def frame(random: np.random.Generator) -> Array:
    """Three orthogonal unit vectors as rows."""
    return np.linalg.qr(random.normal(size=(3, 3)))[0]


def cylinder_points(random: np.random.Generator, n: int, arc: float) -> tuple[Array, Array, Array, float]:
    u, v, d = frame(random)
    place, radius = random.normal(size=3) * 5, random.uniform(0.3, 4)
    turn, height = random.uniform(0, arc, n)[:, None], random.uniform(-3, 3, n)[:, None]
    return place + radius * (np.cos(turn) * u + np.sin(turn) * v) + height * d, place, d, radius


def cone_points(random: np.random.Generator, n: int, low: float) -> tuple[Array, Array, Array, float]:
    u, v, d = frame(random)
    apex, angle = random.normal(size=3) * 5, random.uniform(0.2, 1.2)
    turn, height = random.uniform(0, 2 * np.pi, n)[:, None], random.uniform(low, 3, n)[:, None]
    return apex + height * (d + np.tan(angle) * (np.cos(turn) * u + np.sin(turn) * v)), apex, d, angle


@pytest.mark.parametrize("arc", [np.pi / 2, 2 * np.pi])
def test_cylinders_are_recovered(arc: float) -> None:
    random = np.random.default_rng(1)
    for _ in range(12):
        points, place, d, radius = cylinder_points(random, 40, arc)
        found = fit_cylinder(points)
        assert found.determined and found.residual < 1e-11 * (1 + radius)
        assert found.radius == pytest.approx(radius, rel=1e-8)
        axis = cga3.line_from_point_direction(place, d)
        assert min(np.abs(found.axis - axis).max(), np.abs(found.axis + axis).max()) < 1e-7


@pytest.mark.parametrize("low", [0.4, -2.0])
def test_cones_are_recovered_from_one_half_and_from_both(low: float) -> None:
    random = np.random.default_rng(2)
    for _ in range(12):
        points, apex, d, angle = cone_points(random, 60, low)
        found = fit_cone(points)
        assert found.determined and found.residual < 1e-11
        np.testing.assert_allclose(found.apex, apex, atol=1e-8)
        assert found.angle == pytest.approx(angle, abs=1e-8)
        axis = cga3.line_from_point_direction(apex, d)
        assert np.abs(found.axis - axis).max() < 1e-7 or (low < 0 and np.abs(found.axis + axis).max() < 1e-7)


def test_with_noise_no_fit_is_better() -> None:
    """The fit is at least as good as that of scipy started at the true parameters."""
    random = np.random.default_rng(3)
    for make, fit in ((cylinder_points, fit_cylinder), (cone_points, fit_cone)):
        for _ in range(4):
            points, place, d, number = make(random, 80, 2 * np.pi if fit is fit_cylinder else 0.4)
            noisy = points + random.normal(size=points.shape) * 0.02

            def off(x: Array, fit: Any = fit, noisy: Array = noisy) -> Array:
                along = x[3:6] / np.linalg.norm(x[3:6])
                height = (noisy - x[:3]) @ along
                away = np.linalg.norm(noisy - x[:3] - height[:, None] * along, axis=-1)
                return away - x[6] if fit is fit_cylinder else away * np.cos(x[6]) - np.abs(height) * np.sin(x[6])

            best = np.sqrt(np.mean(least_squares(off, [*place, *d, number], xtol=1e-14, ftol=1e-14).fun ** 2))
            assert fit(noisy).residual <= best * (1 + 1e-9)


def test_batches_and_units() -> None:
    random = np.random.default_rng(4)
    points = np.stack([cylinder_points(random, 30, 4.0)[0] for _ in range(4)]).reshape(2, 2, 30, 3)
    found = fit_cylinder(points)
    assert found.axis.shape == (2, 2, 6) and found.radius.shape == found.residual.shape == (2, 2)
    large = fit_cylinder(points * 1e6)
    np.testing.assert_allclose(large.radius, found.radius * 1e6, rtol=1e-7)


def test_data_without_a_fit_are_reported() -> None:
    random = np.random.default_rng(5)
    same, line = np.ones((8, 3)), np.arange(8.0)[:, None] * [1, 2, 3]
    circle = np.stack([np.cos(np.arange(9.0)), np.sin(np.arange(9.0)), np.zeros(9)], -1)
    for fit in (fit_cylinder, fit_cone):
        for points in (same, line):
            assert not fit(points).determined and np.isnan(fit(points).residual)
        with pytest.raises(ValueError, match="points: 3 points"):
            fit(random.normal(size=(3, 3)))
        with pytest.raises(ValueError, match=r"points: (nan|inf) at \(.*\); expected finite"):
            fit(np.full((9, 3), np.nan))
        with pytest.raises(ValueError, match="shape"):
            fit(random.normal(size=(9, 2)))
    assert not fit_cone(circle).determined, "any apex above the centre is a solution"
    assert not fit_cylinder(circle).determined, "a circle does not determine a cylinder"


def test_rays_through_a_convex_hull() -> None:
    """From inside each ray leaves once, at the nearest plane along it; from outside it enters or misses."""
    random = np.random.default_rng(6)
    vertices = random.normal(size=(60, 3))
    hull = ConvexHull(vertices)
    inside = vertices.mean(0) + 0.05 * random.normal(size=(1000, 3))
    directions = random.normal(size=(1000, 3))
    speed = directions @ hull.equations[:, :3].T
    gap = -(inside @ hull.equations[:, :3].T + hull.equations[:, 3])
    expected = np.where(speed > 0, gap / np.where(speed > 0, speed, 1), np.inf).min(1)
    found = hit_mesh(inside, directions, vertices, hull.simplices)
    assert found.hits.all()
    np.testing.assert_allclose(found.distance, expected, rtol=1e-10)
    corners = vertices[hull.simplices[found.face]]
    np.testing.assert_allclose(
        (found.weights[..., None] * corners).sum(1), inside + expected[:, None] * directions, atol=1e-9
    )
    back = hit_mesh(inside + 100 * directions, directions, vertices, hull.simplices)
    assert not back.hits.any() and np.isinf(back.distance).all() and np.isnan(back.weights).all()


def test_no_ray_passes_through_an_edge() -> None:
    cube = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    turned = cube @ frame(np.random.default_rng(7))
    faces = ConvexHull(turned).simplices
    ends = np.concatenate(
        [turned[faces].mean(1), (turned[faces] + np.roll(turned[faces], 1, 1)).reshape(-1, 3) / 2, turned]
    )
    assert hit_mesh(np.zeros(3), ends, turned, faces).hits.mean() > 0.95
    np.testing.assert_allclose(hit_mesh(np.zeros(3), turned[faces].mean(1), turned, faces).distance, 1, rtol=1e-12)
    exact = ConvexHull(cube).simplices
    middles = (cube[exact] + np.roll(cube[exact], 1, 1)).reshape(-1, 3) / 2
    assert hit_mesh(np.zeros(3), middles, cube, exact).hits.all()


def test_invalid_meshes() -> None:
    vertices, faces = np.eye(3), [[0, 1, 2]]
    empty = hit_mesh(np.zeros((4, 3)), np.ones(3), vertices, np.empty((0, 3), int))
    assert empty.face.tolist() == [-1] * 4
    assert hit_mesh(np.zeros((0, 3)), np.ones(3), vertices, faces).distance.shape == (0,)
    assert not hit_mesh(np.zeros(3), np.zeros(3), vertices, faces).hits
    assert (
        hit_mesh(np.zeros((2, 1, 3), "f4"), np.ones((5, 3), "f4"), vertices.astype("f4"), faces).distance.dtype
        == np.float32
    )
    for arguments, message in (
        ((np.zeros(3), np.ones(3), vertices, [[0, 1, 3]]), "faces: vertices 0 to 3"),
        ((np.zeros(3), np.ones(3), vertices, [[0, 1]]), "three integers"),
        ((np.zeros(3), np.ones(3), vertices, [[0.0, 1, 2]]), "three integers"),
        ((np.zeros((2, 3)), np.ones((3, 3)), vertices, faces), "leading axes that broadcast"),
        ((np.zeros(2), np.ones(3), vertices, faces), "origins"),
        ((np.zeros(3), np.ones(3), np.where(vertices == vertices.max(), np.nan, vertices), faces), "vertices"),
    ):
        with pytest.raises(ValueError, match=message):
            hit_mesh(*arguments)
