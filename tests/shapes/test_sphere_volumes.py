"""Unions of spheres, marching spheres and maximal balls: closed forms, real masks, and bad input."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from selection import some_slow

from algorithms.shapes.marching_spheres import march, marching_spheres
from algorithms.shapes.maximal_balls import fit_balls, maximal_balls
from algorithms.shapes.rasterising import filled, overlap
from algorithms.shapes.sphere_status import BallStatus
from algorithms.shapes.union_of_spheres import union_of_spheres
from generated import cga3, sphere_models
from tests.support.sphere_scenes import LUNG_SPACING, ball_mask, border_points, distance_from_spheres, stored_mask


def test_circumspheres_equal_conformal_ones_and_contain_their_points() -> None:
    points = np.random.default_rng(0).normal(size=(50, 4, 3))
    centre, square, volume = sphere_models.circumsphere(*np.moveaxis(points, 1, 0))
    sphere = cga3.sphere_from_points(*np.moveaxis(points, 1, 0))
    np.testing.assert_allclose(centre, cga3.sphere_centre(sphere), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(square, cga3.sphere_radius_squared(sphere), rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(
        ((points - np.asarray(centre)[:, None]) ** 2).sum(-1), np.repeat(square[:, None], 4, 1), rtol=1e-7
    )
    np.testing.assert_allclose(np.abs(volume), np.abs(np.linalg.det(points[:, 1:] - points[:, :1])), rtol=1e-9)


def test_a_ball_fitted_to_points_of_a_sphere() -> None:
    normals = np.random.default_rng(1).normal(size=(4000, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    truth = np.array([3.0, -1, 2, 5])
    found = sphere_models.ball_of_points(truth + np.array([0.3, -0.2, 0.1, 0.4]), truth[:3] + 5 * normals)
    np.testing.assert_allclose(found, truth, atol=2e-3)


def test_the_cost_has_distances_and_radii() -> None:
    a, b = np.array([1.0, 2, 3, 0.5]), np.array([[2.0, 0, 3, 2.5]])
    np.testing.assert_allclose(sphere_models.affinities(a, b, 4.0, 3.0), [np.exp(-(5 + 3 * 4) / 4)], rtol=1e-12)


def test_union_of_spheres_touches_all_boundary_voxels() -> None:
    mask = stored_mask("liver")[::2, ::2, ::2]
    balls = union_of_spheres(mask)
    points = border_points(mask)
    near, _ = cKDTree(points).query(balls[:, :3])
    # Spheres of Delaunay tetrahedra contain no points, and have four of them on their surface.
    np.testing.assert_allclose(near, balls[:, 3], atol=1e-6)
    assert len(balls) < 0.6 * len(union_of_spheres(mask, distinct=False))


def test_union_of_spheres_of_a_ball_has_its_sphere() -> None:
    balls = union_of_spheres(ball_mask(12), (2, 2, 2))
    largest = balls[balls[:, 3].argmax()]
    np.testing.assert_allclose(largest[:3], [32, 32, 32], atol=1.5)
    assert 20 <= largest[3] <= 24


@pytest.mark.parametrize(("step", "size"), some_slow([(1, 1), (1, 2), (2, 2)], (1, 1), (1, 2)))
def test_marching_spheres_of_a_liver(step: int, size: int) -> None:
    mask = stored_mask("liver")[::step, ::step, ::step]
    model = march(mask, size)
    assert distance_from_spheres(border_points(mask), model.balls).max() <= 0.9 * size
    assert model.status is BallStatus.OK
    drawn = filled(model.balls, mask.shape) | model.full
    np.testing.assert_array_equal(drawn, model.filled)
    assert overlap(drawn, mask) >= 0.95 and abs(overlap(drawn, mask) - model.overlap) < 1e-12


@pytest.mark.parametrize(("step", "size"), some_slow([(3, 2), (1, 3)], (1, 3)))
def test_marching_spheres_are_fewer_than_the_union_of_spheres_of_a_lung(step: int, size: int) -> None:
    mask = stored_mask("lung_fixed")[::step, ::step, ::step]
    model = march(mask, size)
    union = union_of_spheres(mask[::size, ::size, ::size], distinct=False)
    assert len(model.balls) <= 0.45 * len(union) and model.overlap >= 0.95


def test_marching_spheres_in_other_units() -> None:
    mask = ball_mask(9, 25)
    one, two = marching_spheres(mask, 2), marching_spheres(mask.astype(np.int16), 2, (2, 2, 2))
    np.testing.assert_allclose(two, 2 * one)


def test_cells_that_are_too_coarse_are_reported() -> None:
    x, y, z = np.indices((24, 24, 24))
    sheets = (x + y + z) % 4 == 0
    model = march(sheets, 8)
    assert model.overlap < 0.95 and model.status is BallStatus.LIMIT_REACHED


@pytest.mark.parametrize(("thickness", "status"), [(1.5, BallStatus.THIN), (4.0, BallStatus.OK)])
@pytest.mark.slow
def test_models_of_thin_shells_are_refused(thickness: float, status: BallStatus) -> None:
    """A ball inside a shell of one voxel covers one voxel, so that the model is a list of voxels."""
    radius = np.linalg.norm(np.indices((34, 34, 34)).T - 17.0, axis=-1)
    shell = (radius < 14) & (radius > 14 - thickness)
    model = march(shell, 2)
    assert model.status is status and model.overlap >= 0.95
    assert (len(model.balls) > len(union_of_spheres(shell))) is (status is BallStatus.THIN)
    assert march(shell, 1).status is BallStatus.OK


@pytest.mark.parametrize("step", some_slow([1, 3], 1))
def test_maximal_balls_of_a_liver(step: int) -> None:
    mask = np.pad(stored_mask("liver")[::step, ::step, ::step], 4)
    model = fit_balls(mask, 0.95, (3, 3, 3))
    assert model.status is BallStatus.OK and len(model.balls) <= 500
    assert overlap(filled(model.balls, mask.shape, (3, 3, 3)), mask) >= 0.95
    assert model.overlap == overlap(filled(model.balls, mask.shape, (3, 3, 3)), mask)


@pytest.mark.slow
def test_maximal_balls_of_lungs() -> None:
    mask = stored_mask("lung_fixed")
    balls = maximal_balls(mask, 0.95, LUNG_SPACING)
    assert len(balls) <= 900 and overlap(filled(balls, mask.shape, LUNG_SPACING), mask) >= 0.95


def test_maximal_ball_of_a_ball() -> None:
    balls = maximal_balls(ball_mask(12), 0.9, (2, 2, 2))
    assert len(balls) == 1
    np.testing.assert_allclose(balls[0], [32, 32, 32, 24], atol=1.5)


def test_limits_are_reported() -> None:
    mask = np.pad(stored_mask("liver")[::2, ::2, ::2], 4)
    model = fit_balls(mask, 0.95, most=5)
    assert model.status is BallStatus.LIMIT_REACHED and len(model.balls) == 5
    assert 0.3 < model.overlap == overlap(filled(model.balls, mask.shape), mask) < 0.95


def methods() -> list:
    return [lambda m, s=(1, 1, 1): marching_spheres(m, 2, s), lambda m, s=(1, 1, 1): maximal_balls(m, 0.9, s)]


@pytest.mark.parametrize("method", methods())
def test_small_and_bad_masks(method) -> None:
    single = np.zeros((3, 3, 3), bool)
    single[1, 1, 1] = True
    balls = method(single)
    assert filled(balls, (3, 3, 3)).tolist() == single.tolist()
    everything = np.ones((5, 6, 7), np.uint8)
    assert overlap(filled(method(everything), (5, 6, 7)), everything > 0) > 0.85
    two = np.zeros((30, 12, 12), np.int32)
    two[1:9, 2:10, 2:10] = two[20:28, 2:10, 2:10] = -4
    drawn = filled(method(two), two.shape)
    assert drawn[4].any() and drawn[24].any() and not drawn[14].any()
    with pytest.raises(ValueError, match="no voxel"):
        method(np.zeros((4, 4, 4)))
    with pytest.raises(ValueError, match="nan"):
        method(np.full((4, 4, 4), np.nan))
    with pytest.raises(ValueError, match="three positive lengths"):
        method(single, (1, 0, 1))
    with pytest.raises(ValueError, match="three axes"):
        method(single[0])
    with pytest.raises(TypeError, match="real numbers"):
        method(single.astype(complex))
    with pytest.raises(ValueError, match=r"68719476736 voxels, which need about 1024 GiB"):
        method(np.broadcast_to(np.uint8(1), (4096, 4096, 4096)))


def test_bad_sizes() -> None:
    mask = ball_mask(4, 11)
    for size in (0, 1.5, True):
        with pytest.raises(ValueError, match="size"):
            marching_spheres(mask, size)
    with pytest.raises(ValueError, match="between 0 and 1"):
        maximal_balls(mask, 1.0)
    with pytest.raises(ValueError, match="without a tetrahedron"):
        union_of_spheres(np.ones((1, 5, 5)))
    with pytest.raises(ValueError, match="radius"):
        filled([[0, 0, 0, -1.0]], (2, 2, 2))
