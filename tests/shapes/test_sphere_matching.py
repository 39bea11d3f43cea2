"""Registration of models of spheres: known maps with outliers, other units, real lungs, and bad input."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from algorithms.shapes.marching_cubes import CubeMesh, marching_cubes
from algorithms.shapes.maximal_balls import fit_balls
from algorithms.shapes.sphere_matching import register_spheres, surface_points
from algorithms.shapes.sphere_status import SphereMatchStatus
from tests.support.sphere_scenes import LUNG_SPACING, distance_from_spheres, stored_mask, warped_models


@pytest.mark.parametrize("seed", [0, 2])
def test_known_warps_with_outliers(seed: int) -> None:
    a, b, partner = warped_models(seed)
    found = register_spheres(a, b)
    right = partner[found.match[:, 0]] == found.match[:, 1]
    assert found.status is SphereMatchStatus.OK
    assert np.count_nonzero(right) >= 0.95 * np.count_nonzero(partner >= 0) and right.mean() >= 0.95
    inliers = np.flatnonzero(partner >= 0)
    error = found.warp_balls(a[inliers]) - b[partner[inliers]]
    # The distance of neighbouring balls is about 3.
    assert np.sqrt((error[:, :3] ** 2).sum(1).mean()) < 0.3
    assert np.median(np.abs(error[:, 3]) / b[partner[inliers], 3]) < 0.1


def test_surfaces_of_overlapping_balls_are_moved_to_each_other() -> None:
    centres = 3.0 * np.stack(np.meshgrid(*[np.arange(2)] * 3), -1).reshape(-1, 3)
    a = np.column_stack([centres, np.full(8, 2.5)])
    b = np.column_stack([centres * [1.1, 1, 0.9] + 0.03 * centres[:, [1, 2, 0]] ** 2, np.full(8, 2.8)])
    points, _ = surface_points(a)
    found, without = register_spheres(a, b), register_spheres(a, b, surfaces=False)
    away, before = (distance_from_spheres(one.warp(points), b).mean() for one in (found, without))
    assert found.status is SphereMatchStatus.OK and away < 0.05 < 0.2 < before


@pytest.mark.parametrize("kind", ["similarity", "affine"])
def test_linear_maps_are_exact(kind: str) -> None:
    rng = np.random.default_rng(3)
    a = np.column_stack([rng.uniform(-10, 10, (80, 3)), rng.uniform(0.3, 1.5, 80)])
    angle = 0.15
    matrix = 1.1 * np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    b = np.column_stack([a[:, :3] @ matrix.T + [5, 6, 7], 1.1 * a[:, 3]])
    found = register_spheres(a, b, kind)
    np.testing.assert_array_equal(found.match, np.column_stack([np.arange(80)] * 2))
    np.testing.assert_allclose(found.warp_balls(a), b, atol=1e-3)


def test_other_origins_and_units_give_the_same_matches() -> None:
    a, b, _ = warped_models(5, 80, 10)
    found = register_spheres(a, b)
    points = a[:20, :3]
    moved = register_spheres(a + np.array([1e3, 1e3, 1e3, 0]), b + np.array([1e3, 1e3, 1e3, 0]))
    np.testing.assert_array_equal(moved.match, found.match)
    np.testing.assert_allclose(moved.warp(points + 1e3) - 1e3, found.warp(points), atol=1e-8)
    small = register_spheres(1e-3 * a, 1e-3 * b)
    np.testing.assert_array_equal(small.match, found.match)
    np.testing.assert_allclose(1e3 * small.warp(1e-3 * points), found.warp(points), atol=1e-8)


def test_unwarp_inverts() -> None:
    a, b, _ = warped_models(1, 80, 10)
    found = register_spheres(a, b)
    points = a[:30, :3]
    np.testing.assert_allclose(found.unwarp(found.warp(points)), points, atol=1e-5)
    assert found.warp(np.zeros((0, 3))).shape == (0, 3) and found.warp(np.zeros(3)).shape == (3,)


@pytest.mark.slow
def test_lungs_of_one_patient_at_two_times() -> None:
    masks = [stored_mask("lung_moving"), stored_mask("lung_fixed")]
    models = [fit_balls(mask, 0.95, LUNG_SPACING).balls for mask in masks]
    meshes = [marching_cubes(mask, spacing=LUNG_SPACING) for mask in masks]
    found = register_spheres(*models)
    warped, fixed = found.warp(meshes[0].points), meshes[1]
    for a, b in ((warped, fixed.points), (fixed.points, warped)):
        distance, _ = cKDTree(b).query(a)
        assert distance.mean() <= 1.5 and np.percentile(distance, 95) <= 4
    assert meshes[0].volume() / fixed.volume() > 1.15
    assert abs(CubeMesh(warped, meshes[0].triangles).volume() / fixed.volume() - 1) < 0.02


def test_unrelated_models_are_not_ok() -> None:
    rng = np.random.default_rng(0)
    a, b = (np.column_stack([rng.uniform(-10, 10, (100, 3)), rng.uniform(0.1, 3, 100)]) for _ in range(2))
    assert register_spheres(a, b, "affine").status is SphereMatchStatus.FEW_MATCHES


def test_few_and_bad_balls() -> None:
    one = np.array([[1.0, 2, 3, 1]])
    found = register_spheres(one, one + np.array([5, 0, 0, 0]))
    assert found.status is SphereMatchStatus.TOO_FEW_BALLS and len(found.match) == 0
    np.testing.assert_allclose(found.warp([1.0, 2, 3]), [6, 2, 3])
    with pytest.raises(ValueError, match="b: no balls"):
        register_spheres(one, np.zeros((0, 4)))
    with pytest.raises(ValueError, match="a: nan"):
        register_spheres([[np.nan, 0, 0, 1]], one)
    with pytest.raises(ValueError, match="centre and radius"):
        register_spheres(np.zeros((5, 3)), one)
    with pytest.raises(ValueError, match="kind"):
        register_spheres(one, one, "rigid")


@pytest.mark.parametrize("degrees", [70, 180])
def test_turned_models_are_found(degrees: int) -> None:
    a, b, partner = warped_models(degrees, 100, 20)
    turn = Rotation.from_rotvec(np.radians(degrees) * np.array([2, -1, 2]) / 3)
    b[:, :3] = turn.apply(b[:, :3])
    found = register_spheres(a, b)
    right = partner[found.match[:, 0]] == found.match[:, 1]
    assert found.status is SphereMatchStatus.OK and right.mean() > 0.95 and right.sum() > 90


@pytest.mark.parametrize("seed", [11, 12])
def test_mirrored_and_unrelated_models_are_not_ok(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = (np.column_stack([rng.uniform(-10, 10, (50, 3)), rng.uniform(0.3, 1.5, 50)]) for _ in range(2))
    assert register_spheres(a, b).status is SphereMatchStatus.FEW_MATCHES
    assert register_spheres(a, a * [-1, 1, 1, 1]).status is SphereMatchStatus.FEW_MATCHES


@pytest.mark.parametrize("kind", ["similarity", "affine", "nonrigid"])
def test_centres_on_a_line_have_a_status(kind: str) -> None:
    line = np.column_stack([np.outer(np.arange(20.0), [1, 2, 3]), np.ones(20)])
    found = register_spheres(line, line + np.array([1, 0, 0, 0]), kind)
    assert found.status is SphereMatchStatus.FLAT and len(found.match) == 0
    np.testing.assert_allclose(found.warp([0.0, 0, 0]), [1, 0, 0], atol=1e-12)


@pytest.mark.slow
def test_models_of_one_surface_are_nearer_than_without_a_map() -> None:
    grid = np.stack(np.meshgrid(*[np.arange(40.0)] * 3, indexing="ij"), -1) - 20

    def inside(x: np.ndarray) -> np.ndarray:
        return np.asarray((x[..., 0] / 16) ** 2 + (x[..., 1] / 12) ** 2 + ((x[..., 2] - x[..., 0] ** 2 / 40) / 9) ** 2)

    bend = 1.5 * np.sin(grid[..., [1, 2, 0]] / 9)
    masks = inside(grid) < 1, inside(grid - bend) < 1
    found = register_spheres(*(fit_balls(mask, 0.95).balls for mask in masks))
    points = grid[masks[0]] + 20
    # The first mask is moved by x + u(x) with u(x + u(x)) = bend at the new place: fixed points of bend.
    true = points.copy()
    for _ in range(20):
        true = points + 1.5 * np.sin((true - 20)[:, [1, 2, 0]] / 9)
    off, before = (np.linalg.norm(x - true, axis=1).mean() for x in (found.warp(points), points))
    assert found.status is SphereMatchStatus.FEW_MATCHES and off < before


@pytest.mark.parametrize("kind", ["slab", "walk"])
def test_reflections_are_no_deformations(kind: str) -> None:
    """A thin model is near its mirror image, and affine maps reflect others exactly."""
    rng = np.random.default_rng(11)
    centres = {"slab": rng.uniform(-1, 1, (80, 3)) * [15, 10, 2], "walk": rng.normal(size=(80, 3)).cumsum(0)}[kind]
    model = np.column_stack([centres, rng.gamma(4, 0.2, 80)])
    turned = np.column_stack([centres[:, [1, 2, 0]] + [3, -2, 1], model[:, 3]])
    assert register_spheres(model, turned).status == SphereMatchStatus.OK
    assert register_spheres(model, turned * [1, 1, -1, 1]).status == SphereMatchStatus.FEW_MATCHES
