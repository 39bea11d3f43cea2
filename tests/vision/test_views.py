"""Tensors, invariants, calibration, factorization and pose against determinants, numpy and photographs."""

from __future__ import annotations

import re
from itertools import combinations, permutations
from pathlib import Path
from typing import Any

import chessboard
import numpy as np
import pytest
from test_vision import homogeneous, random_camera, same_up_to_scale, through_matrix

from algorithms.vision import (
    MOTORCYCLE,
    Camera,
    DegenerateError,
    OmnidirectionalCamera,
    VisionStatus,
    calibrate_from_planes,
    conic_value,
    cross_ratio,
    epipoles,
    epipoles_of_tensor,
    factorize,
    fundamental_matrix,
    homography,
    invariants_3d,
    localize,
    permutation_invariant,
    quadrifocal_tensor,
    robust_fundamental_matrix,
    robust_homography,
    sampson_distance,
    transfer_line,
    transfer_point,
    trifocal_tensor,
)
from generated import cga3, omnidirectional, pga3, projective2, projective3

Array = np.ndarray[Any, Any]


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(8)


def scene(rng: np.random.Generator, n_views: int, n_points: int) -> tuple[list[Any], list[Array], Array, list[Array]]:
    """Cameras, their matrices, points and pixels."""
    cameras, matrices = zip(*(random_camera(rng) for _ in range(n_views)), strict=True)
    points = rng.normal(size=(n_points, 3))
    return list(cameras), list(matrices), points, [through_matrix(m, points) for m in matrices]


def scaled(tensor: Array, size: float = 400.0) -> Array:
    """A tensor for image points (x, y, size), so that all entries have equal weight; lines scale by 1/size."""
    return tensor * size ** -np.sum(np.meshgrid(*[[0, 0, 1]] * tensor.ndim, indexing="ij"), 0)


# Tensors from cameras


def test_tensors_of_cameras_are_determinants(rng: np.random.Generator) -> None:
    for _ in range(20):
        a, b, c, d = rng.normal(size=(4, 3, 4))
        expected = np.zeros((3, 3, 3))
        for i, j, k in np.ndindex(3, 3, 3):
            expected[i, j, k] = (-1) ** i * np.linalg.det(np.vstack([np.delete(a, i, 0), b[j], c[k]]))
        assert np.abs(trifocal_tensor(a, b, c) - expected).max() < 1e-12
        four = [np.linalg.det([a[i], b[j], c[k], d[m]]) for i, j, k, m in np.ndindex(3, 3, 3, 3)]
        assert np.abs(quadrifocal_tensor(a, b, c, d).ravel() - four).max() < 1e-12
        two = np.zeros((3, 3))
        for i, j in np.ndindex(3, 3):
            rows = np.vstack([np.delete(a, j, 0), np.delete(b, i, 0)])
            two[i, j] = (-1) ** (i + j) * np.linalg.det(rows)
        assert np.abs(fundamental_matrix(a, b) - two).max() < 1e-12


def test_transfer_of_points_and_lines(rng: np.random.Generator) -> None:
    cameras, matrices, points, pixels = scene(rng, 4, 40)
    tensor = trifocal_tensor(*cameras[:3])
    assert np.abs(transfer_point(tensor, *pixels[:2]) - pixels[2]).max() < 1e-9
    lines = [np.cross(homogeneous(x[::2]), homogeneous(x[1::2])) for x in pixels]
    for found, line in zip(transfer_line(tensor, lines[1], lines[2]), lines[0], strict=True):
        assert same_up_to_scale(found * [1, 1, 1 / 400], line * [1, 1, 1 / 400]) < 1e-10
    # Any three lines through images of a point give its image in the fourth view.
    four = quadrifocal_tensor(*cameras)
    through = [np.cross(homogeneous(x), rng.normal(size=3)) for x in pixels]
    image = projective3.transfer_lines(four, *through[:3])
    assert np.abs(image[:, :2] / image[:, 2:] - pixels[3]).max() < 1e-7
    incidence = np.einsum("ijkm,ni,nj,nk,nm->n", four, *through)
    sizes = np.einsum("ijkm,ni,nj,nk,nm->n", np.abs(four), *map(np.abs, through))
    assert np.abs(incidence / sizes).max() < 1e-12
    # Lines of space by the 3 x 6 matrix of each camera.
    space = projective3.join_points(homogeneous(points[::2]), homogeneous(points[1::2]))
    for matrix, line in zip(matrices, lines, strict=True):
        image_lines = projective3.project_line(matrix, space)
        assert np.abs(projective3.line_projection(matrix) @ space.T - image_lines.T).max() < 1e-8
        for one, other in zip(image_lines, line, strict=True):
            assert same_up_to_scale(one * [1, 1, 1 / 400], other * [1, 1, 1 / 400]) < 1e-10


def test_a_camera_from_its_image_basis_and_epipoles(rng: np.random.Generator) -> None:
    centre, *basis = rng.normal(size=(4, 4))
    camera = projective3.camera_from_image_basis(centre, *basis)
    assert np.abs(camera @ centre).max() < 1e-13
    for k, point in enumerate(basis):
        image = camera @ point
        assert np.abs(np.delete(image, k)).max() < 1e-13 < np.abs(image[k])
    a, b, c = rng.normal(size=(3, 3, 4))
    one, two, three = (np.linalg.svd(m)[2][3] for m in (a, b, c))
    first, second = epipoles(fundamental_matrix(a, b))
    assert same_up_to_scale(first, a @ two) < 1e-12 and same_up_to_scale(second, b @ one) < 1e-12
    in_second, in_third = epipoles_of_tensor(trifocal_tensor(a, b, c))
    assert same_up_to_scale(in_second, b @ one) < 1e-11 and same_up_to_scale(in_third, c @ one) < 1e-11
    assert three.shape == (4,)


def test_meets_of_lines_and_planes(rng: np.random.Generator) -> None:
    p, q, r, s = rng.normal(size=(4, 4))
    line = projective3.join_points(p, q)
    met = projective3.meet_line_plane(line, r)
    assert abs(met @ r) < 1e-13 and np.linalg.matrix_rank(np.array([met, p, q]), 1e-10) == 2
    assert abs(projective3.meet_lines(line, projective3.join_points(p + q, r))) < 1e-13
    assert projective3.meet_lines(line, projective3.join_points(r, s)) == pytest.approx(np.linalg.det([p, q, r, s]))


# Tensors from correspondences


def test_the_matrices_and_tensors_of_exact_pixels(rng: np.random.Generator) -> None:
    for _ in range(2):
        cameras, _, _, x = scene(rng, 4, 40)
        truth = scaled(fundamental_matrix(*cameras[:2]))
        for found in (fundamental_matrix(x[0], x[1]), fundamental_matrix(x[0], x[1], refine=False)):
            assert same_up_to_scale(scaled(found), truth) < 1e-10
            assert np.linalg.det(found / np.linalg.norm(found)) < 1e-15
        several = fundamental_matrix(x[0][:7], x[1][:7], "7-point")
        assert np.nanmin([same_up_to_scale(scaled(f), truth) for f in several]) < 1e-8
        truth = scaled(trifocal_tensor(*cameras[:3]))
        assert same_up_to_scale(scaled(trifocal_tensor(*x[:3])), truth) < 1e-8
        assert same_up_to_scale(scaled(trifocal_tensor(*(v[:7] for v in x[:3]))), truth) < 1e-5
        assert same_up_to_scale(scaled(quadrifocal_tensor(*x)), scaled(quadrifocal_tensor(*cameras))) < 1e-8


def test_robust_estimates_ignore_wrong_points(rng: np.random.Generator) -> None:
    cameras, _, _, (one, two) = scene(rng, 2, 200)
    two = two + 0.3 * rng.normal(size=two.shape)
    wrong = rng.random(200) < 0.4
    two[wrong] += rng.uniform(20, 80, (int(wrong.sum()), 2))
    found = robust_fundamental_matrix(one, two, threshold=1.5, seed=3)
    assert found.status == VisionStatus.OK and found.inliers[~wrong].mean() > 0.97
    assert found.inliers[wrong].mean() < 0.2
    truth = fundamental_matrix(*cameras)
    clean = through_matrix(cameras[0].matrix, points := rng.normal(size=(500, 3))), cameras[1].project(points)
    assert np.sqrt(np.mean(sampson_distance(found.model, *clean) ** 2)) < 0.3
    assert np.abs(sampson_distance(truth, *clean)).max() < 1e-9
    again = robust_fundamental_matrix(one, two, threshold=1.5, seed=3)
    assert np.array_equal(found.model, again.model) and found.n_samples == again.n_samples
    assert same_up_to_scale(fundamental_matrix(one, two, "robust"), found.model) < 0.1
    matrix = np.eye(3) + np.array([[0.1, 0.05, 3], [-0.1, 0.02, 8], [1e-4, -2e-4, 0]])
    moved = projective2.transform_point(matrix, one)
    assert same_up_to_scale(scaled(homography(one, moved)), scaled(matrix)) < 1e-10
    moved[wrong] += 50
    flat = robust_homography(one, moved)
    assert np.array_equal(flat.inliers, ~wrong) and same_up_to_scale(scaled(flat.model), scaled(matrix)) < 1e-9
    noise = robust_fundamental_matrix(rng.uniform(0, 500, (8, 2)), rng.uniform(0, 500, (8, 2)), threshold=1e-6)
    assert noise.status == VisionStatus.NO_CONSENSUS and np.isnan(noise.model).all()


def test_true_correspondences_of_the_motorcycle() -> None:
    disparity = pytest.importorskip("skimage.data").stereo_motorcycle()[2].astype(float)
    one, two = (x[::500] for x in MOTORCYCLE.correspondences(disparity))
    found = fundamental_matrix(one, two)
    assert np.abs(sampson_distance(found, one, two)).max() < 1e-10


def test_points_that_do_not_determine_f_and_t(rng: np.random.Generator) -> None:
    cameras, _, points, (one, two, three) = scene(rng, 3, 30)
    flat = points * [1, 1, 0]
    line = np.outer(np.linspace(-1, 1, 30), [1.0, 2, 3])
    for degenerate in (flat, line):
        x = [c.project(degenerate) for c in cameras]
        noisy = [v + 0.5 * rng.normal(size=v.shape) for v in x]
        for views in (x, noisy):
            for call in (fundamental_matrix, trifocal_tensor):
                with pytest.raises(DegenerateError, match="degenerate") as error:
                    call(*views[: 2 if call is fundamental_matrix else 3])
                assert error.value.status == VisionStatus.DEGENERATE
            assert robust_fundamental_matrix(*views[:2]).status == VisionStatus.DEGENERATE
    turned = through_matrix(
        cameras[0].intrinsics @ pga3.motor_to_matrix(cameras[0].pose)[:3, :3] @ np.eye(3, 4), points
    )
    with pytest.raises(DegenerateError, match="degenerate"):
        fundamental_matrix(turned, projective2.transform_point(np.eye(3) + 1e-4, turned))
    for bad, status in ((np.nan, VisionStatus.NOT_FINITE), (np.inf, VisionStatus.NOT_FINITE)):
        spoiled = one.copy()
        spoiled[3, 1] = bad
        with pytest.raises(DegenerateError, match="not finite"):
            fundamental_matrix(spoiled, two)
        with pytest.raises(DegenerateError, match="not finite"):
            quadrifocal_tensor(spoiled, two, three, one)
        assert robust_fundamental_matrix(spoiled, two).status == status
        assert robust_homography(spoiled, two).status == status
    with pytest.raises(DegenerateError, match="too few"):
        fundamental_matrix(one[:7], two[:7])
    with pytest.raises(DegenerateError, match="too few"):
        trifocal_tensor(one[:6], two[:6], three[:6])
    with pytest.raises(ValueError, match="second: 29 points; expected 30"):
        fundamental_matrix(one, two[1:])
    with pytest.raises(ValueError, match="8 points; expected 7"):
        fundamental_matrix(one[:8], two[:8], "7-point")
    with pytest.raises(ValueError, match="expected 3"):
        trifocal_tensor(one, two)
    with pytest.raises(DegenerateError, match="degenerate"):
        trifocal_tensor(cameras[0], cameras[0], cameras[0])


# Invariants


def test_cross_ratios_do_not_change_under_projective_maps(rng: np.random.Generator) -> None:
    for d in (1, 2, 3):
        points = rng.normal(size=(1000, d + 3, d))
        maps = np.linalg.qr(rng.normal(size=(1000, d + 1, d + 1)))[0] * rng.uniform(0.5, 2, (1000, 1, d + 1))
        moved = homogeneous(points) @ maps
        found, after = cross_ratio(points), cross_ratio(moved)
        assert np.abs(after / found - 1).max() < 1e-9
    assert np.abs(invariants_3d(moved) / invariants_3d(points) - 1).max() < 1e-9
    assert cross_ratio([[0.0], [1.0], [2.0], [3.0]]) == pytest.approx((0 - 2) * (1 - 3) / ((0 - 3) * (1 - 2)))


def test_invariants_are_the_coordinates_of_the_sixth_point(rng: np.random.Generator) -> None:
    for points in homogeneous(rng.normal(size=(50, 6, 3))):
        ratio = np.linalg.solve(points[:4].T, points[5]) / np.linalg.solve(points[:4].T, points[4])
        np.testing.assert_allclose(invariants_3d(points), ratio[:3] / ratio[3], rtol=1e-9)


def test_cross_ratios_in_any_order_have_one_invariant(rng: np.random.Generator) -> None:
    values = [permutation_invariant(cross_ratio(p)) for p in permutations(rng.normal(size=(4, 1)))]
    assert np.ptp(values) < 1e-12
    assert permutation_invariant([0.0, 1.0, np.inf]) == pytest.approx([2, 2, 2])
    assert permutation_invariant([-1.0, 2.0, 0.5]) == pytest.approx([2.8] * 3)


def test_invariants_of_two_and_three_views_are_those_of_space(rng: np.random.Generator) -> None:
    errors: dict[int, list[Array]] = {2: [], 3: []}
    noisy: dict[int, list[Array]] = {2: [], 3: []}
    for _ in range(20):
        cameras, _, points, pixels = scene(rng, 3, 180)
        x, truth = [v.reshape(30, 6, 2) for v in pixels], invariants_3d(points.reshape(30, 6, 3))
        matrix, tensor = fundamental_matrix(*cameras[:2]), trifocal_tensor(*cameras)
        off = [v + 0.5 * rng.normal(size=v.shape) for v in x]
        for views, kept in ((x, errors), (off, noisy)):
            two = invariants_3d(*views[:2], fundamental=matrix)
            kept[2].append(np.abs(two - truth) / (1 + np.abs(truth)))
            kept[3].append(np.abs(invariants_3d(*views, tensor=tensor) - truth) / (1 + np.abs(truth)))
    for k in (2, 3):
        # The last per cent are points whose joins nearly pass through the epipoles, where rounding matters more.
        assert np.quantile(errors[k], 0.9) < 1e-12 and np.max(errors[k]) < 1e-7
    assert np.median(noisy[3]) <= np.median(noisy[2]) < 0.1


def test_invariants_of_points_on_a_plane_are_not_finite() -> None:
    plane = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1.0], [1, 2, 3]]
    assert invariants_3d(plane).tolist() == [1, 1, 1]  # Two of four planes are the same.
    plane[3], plane[4] = plane[4], plane[3]
    assert np.isinf(invariants_3d([*plane[:3], plane[3], [1, 0, 5.0], plane[5]])).any()
    assert np.isnan(invariants_3d(np.full((6, 3), np.nan))).all()
    for call in (
        lambda: cross_ratio(np.zeros((7, 2))),
        lambda: invariants_3d(np.zeros((5, 3))),
        lambda: invariants_3d(np.zeros((6, 2)), np.zeros((6, 2))),
        lambda: invariants_3d(*[np.zeros((6, 2))] * 3),
        lambda: invariants_3d(*[np.zeros((6, 2))] * 4),
    ):
        with pytest.raises(ValueError, match="expected"):
            call()


def test_conics_and_pascal(rng: np.random.Generator) -> None:
    angles = rng.uniform(0, 6.3, (30, 6))
    circle = np.stack([np.cos(angles), np.sin(angles), np.ones_like(angles)], -1)
    points = circle @ rng.normal(size=(30, 3, 3))
    assert np.abs(projective2.pascal_bracket(points)).max() < 1e-9
    assert np.abs(projective2.pascal_bracket(rng.normal(size=(30, 6, 3)))).min() > 1e-9
    for conic, six in zip(projective2.conic_from_points(points[:, :5]), points, strict=True):
        x, y, w = six.T
        design = np.stack([x * x, x * y, y * y, x * w, y * w, w * w], -1)
        assert same_up_to_scale(conic, np.linalg.svd(design)[2][-1]) < 1e-5
        assert np.abs(design @ conic).max() < 1e-11 * (np.abs(design) @ np.abs(conic)).max()


def test_homographies_of_lines(rng: np.random.Generator) -> None:
    matrix, (a, b) = rng.normal(size=(3, 3)), rng.normal(size=(2, 3))
    line = projective2.join_points(a, b)
    moved = projective2.join_points(matrix @ a, matrix @ b)
    np.testing.assert_allclose(projective2.line_homography(matrix) @ line, moved, atol=1e-12)
    assert projective2.bracket(a, b, line) == pytest.approx(np.linalg.det([a, b, line]))


# Omnidirectional cameras


@pytest.mark.parametrize("mirror", [0.0, 0.6, 1.0, 1.4])
def test_omnidirectional_round_trip_and_lines(mirror: float, rng: np.random.Generator) -> None:
    pose = random_camera(rng)[0].pose
    camera = OmnidirectionalCamera.from_intrinsics((300, 320), (320, 240), mirror, pose)
    points = rng.normal(size=(2000, 3)) * 10
    place = points @ (to := np.linalg.inv(pga3.motor_to_matrix(pose)))[:3, :3].T + to[:3, 3]
    place /= np.linalg.norm(place, axis=1, keepdims=True)
    pixels = camera.project(points)
    least = -1 / mirror if mirror > 1 else -mirror
    assert np.array_equal(np.isfinite(pixels).all(1), place[:, 2] > least)
    inside = place[:, 2] > least + 0.05
    assert np.abs(camera.directions(pixels[inside]) - place[inside]).max() < 1e-12
    closed = place[:, :2] / (place[:, 2:] + mirror) * [300, 320] + [320, 240]
    assert np.abs((pixels - closed)[inside]).max() < 1e-9
    a, b = rng.normal(size=(2, 3)) * 3
    on_line = camera.project(a + np.linspace(-5, 5, 200)[:, None] * (b - a))
    on_line = on_line[np.isfinite(on_line).all(1) & (np.abs(on_line) < 5000).all(1)]
    conic = camera.conic_of_line(a, b)
    assert len(on_line) > 10
    sizes = conic_value(np.abs(conic), np.abs(on_line))
    assert np.abs(conic_value(conic, on_line) / sizes).max() < 1e-12


def test_images_by_conformal_meets(rng: np.random.Generator) -> None:
    """Intersect the ray and the sphere, and the line from the pole and the image plane, by conformal kernels."""
    origin, north = cga3.embed_point(np.zeros(3)), np.array([0, 0, -0.7])
    sphere = cga3.sphere_from_centre(origin[:3] * 0, 1.0)
    places = rng.normal(size=(50, 3)) + np.array([0, 0, 1])
    for place in places:
        pair = cga3.meet_line_sphere(cga3.line_from_points(np.zeros(3), place), sphere)
        ends = np.array(cga3.point_pair_points(pair))
        on_sphere = ends[np.argmax(ends @ place)]
        plane = cga3.plane_from_points(*(np.array([x, y, 0.3]) for x, y in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))))
        met = cga3.meet_line_plane(cga3.line_from_points(north, on_sphere), plane)
        assert np.abs(met[:2] - omnidirectional.project_place(0.7, -1.0, place)).max() < 1e-12
    circle = omnidirectional.circle_of_line(places[0], places[1])
    assert np.abs(cga3.circle_centre(circle)).max() < 1e-14
    assert cga3.circle_radius_squared(circle) == pytest.approx(1)


def test_lines_are_circles_for_a_parabolic_mirror(rng: np.random.Generator) -> None:
    camera = OmnidirectionalCamera.from_intrinsics(250.0, (320, 240), 1.0, random_camera(rng)[0].pose)
    a, b = rng.normal(size=(2, 30, 3)) * 4
    centre, radius = camera.circle_of_line(a, b)
    for t in np.linspace(-3, 4, 30):
        off = np.linalg.norm(camera.project(a + t * (b - a)) - centre, axis=-1)
        assert np.abs(off / radius - 1).max() < 1e-11
    centred = OmnidirectionalCamera.from_intrinsics(250.0, (320, 240), 1.0)
    assert not np.isfinite(centred.circle_of_line([0, 0, 1.0], [1.0, 0, 1])[1])
    assert np.isnan(centred.project([[0, 0, 0.0], [0, 0, -1], [np.nan, 0, 1]])).all()
    assert np.isnan(centred.conic_of_line([0, 0, 1.0], [0, 0, 2])).all()
    with pytest.raises(ValueError, match="mirror 1"):
        OmnidirectionalCamera.from_intrinsics((250.0, 251.0), (320, 240), 1.0).circle_of_line(a, b)
    with pytest.raises(ValueError, match="mirror: -1"):
        OmnidirectionalCamera.from_intrinsics(250.0, (320, 240), -1)


# Calibration


GRID = np.stack(np.meshgrid(np.arange(9.0), np.arange(6.0)), -1).reshape(-1, 2)


def undistorted(pixels: Array) -> Array:
    """Pixels of a lens without distortion, by fixed-point iteration of OpenCV's published model."""
    k1, k2, p1, p2, k3 = chessboard.DISTORTION
    seen = (pixels - chessboard.CENTRE) / chessboard.FOCAL_LENGTH
    x = seen
    for _ in range(50):
        u, v = x[..., :1], x[..., 1:]
        r = u * u + v * v
        shift = np.concatenate([2 * p1 * u * v + p2 * (r + 2 * u * u), p1 * (r + 2 * v * v) + 2 * p2 * u * v], -1)
        x = (seen - shift) / (1 + k1 * r + k2 * r**2 + k3 * r**3)
    return x * chessboard.FOCAL_LENGTH + chessboard.CENTRE


def test_intrinsics_from_photographs_of_a_chessboard() -> None:
    corners = np.array(chessboard.CORNERS.split(), float).reshape(14, 54, 2)
    found = calibrate_from_planes(GRID, undistorted(corners))
    assert found.status == VisionStatus.OK
    assert np.abs(np.diag(found.intrinsics)[:2] / chessboard.FOCAL_LENGTH - 1).max() < 0.01
    assert np.abs(found.intrinsics[:2, 2] - chessboard.CENTRE).max() < 2


@pytest.mark.parametrize("skew", [False, True])
def test_intrinsics_of_exact_views(skew: bool, rng: np.random.Generator) -> None:
    k = np.array([[700.0, 3.0 * skew, 310], [0, 650, 250], [0, 0, 1]])
    views = []
    for _ in range(5):
        camera, matrix = random_camera(rng)
        views.append(through_matrix(k @ np.linalg.inv(camera.intrinsics) @ matrix, np.insert(GRID * 0.1, 2, 0, 1)))
    found = calibrate_from_planes(GRID, views, skew)
    assert found.status == VisionStatus.OK and np.abs(found.intrinsics - k).max() < 1e-6
    assert np.abs(calibrate_from_planes([GRID * 25.0] * 5, views, skew).intrinsics - k).max() < 1e-6
    assert calibrate_from_planes(GRID, views[:1]).status == VisionStatus.TOO_FEW
    assert calibrate_from_planes(GRID, [views[0]] * 5, True).status == VisionStatus.DEGENERATE
    assert calibrate_from_planes(GRID[:9], [v[:9] for v in views]).status == VisionStatus.DEGENERATE
    assert calibrate_from_planes(GRID, [views[0] * np.nan, *views]).status == VisionStatus.NOT_FINITE
    with pytest.raises(ValueError, match="expected"):
        calibrate_from_planes(GRID[:-1], views)


# Shape and motion


def test_factorization_of_clean_views(rng: np.random.Generator) -> None:
    _, _, points, pixels = scene(rng, 8, 60)
    image = np.stack(pixels)
    found = factorize(image)
    assert found.status == VisionStatus.OK and found.residual < 1e-10
    assert found.singular_values[3] > 1e-3 and found.singular_values[4] < 1e-12
    # The points are those of space after one projective map.
    tops = np.einsum("ni,nj->nij", found.points, homogeneous(points))
    rows = [
        tops[:, i, :, None] * np.eye(4)[j] - tops[:, j, :, None] * np.eye(4)[i] for i, j in combinations(range(4), 2)
    ]
    design = np.concatenate([r.reshape(len(points), 16) for r in rows])
    values = np.linalg.svd(design, compute_uv=False)
    assert values[15] < 1e-9 * values[0] and values[14] > 1e-6 * values[0]
    hidden = rng.random(image.shape[:2]) < 0.3
    occluded = factorize(np.where(hidden[..., None], np.nan, image))
    assert occluded.status == VisionStatus.OK
    assert np.abs(occluded.pixels - image).max() < 1e-8
    assert np.array_equal(factorize(image, ~hidden).pixels, occluded.pixels)


def test_factorization_with_noise(rng: np.random.Generator) -> None:
    _, _, _, pixels = scene(rng, 8, 80)
    image = np.stack(pixels) + 0.5 * rng.normal(size=(8, 80, 2))
    # The noise that remains after least squares, by the number of unknowns.
    left = np.sqrt(2 * 0.25 * (1 - (8 * 11 + 80 * 3 - 15) / (8 * 80 * 2)))
    assert factorize(image).residual < 1.2 * left
    hidden = rng.random(image.shape[:2]) < 0.3
    shown = 2 * (~hidden).sum()
    left = np.sqrt(2 * 0.25 * (1 - (8 * 11 + 80 * 3 - 15) / shown))
    assert factorize(image, ~hidden).residual < 1.25 * left


def test_factorization_of_too_little(rng: np.random.Generator) -> None:
    cameras, _, points, pixels = scene(rng, 4, 30)
    image = np.stack(pixels)
    assert factorize(image[:1]).status == VisionStatus.TOO_FEW
    assert factorize(image[:, :7]).status == VisionStatus.TOO_FEW
    lonely = np.ones((4, 30), bool)
    lonely[1:, 5] = False
    found = factorize(image, lonely)
    assert found.point_status[5] == VisionStatus.TOO_FEW and np.isnan(found.points[5]).all()
    assert found.status == VisionStatus.OK and not np.delete(found.point_status, 5).any()
    assert np.isfinite(np.delete(found.points, 5, 0)).all()
    flat = np.stack([c.project(points * [1, 1, 0]) for c in cameras])
    assert factorize(flat).status == VisionStatus.DEGENERATE
    image[0, 0, 0] = np.inf
    assert factorize(image).status == VisionStatus.NOT_FINITE
    with pytest.raises(ValueError, match="mask"):
        factorize(image, np.ones((3, 3), bool))


# Pose


def same_pose(found: Array, truth: Array) -> float:
    return float(np.abs(pga3.motor_to_matrix(found) - pga3.motor_to_matrix(truth)).max())


def test_localization(rng: np.random.Generator) -> None:
    for _ in range(3):
        camera, _ = random_camera(rng)
        points = rng.normal(size=(30, 3))
        for places in (points, points[:6], points * [1, 1, 0], points[:4] * [1, 0, 1]):
            found = localize(places, camera.project(places), camera.intrinsics)
            assert found.status == VisionStatus.OK and found.residual < 1e-9
            assert same_pose(found.pose, camera.pose) < 1e-9
        pixels = camera.project(points) + 0.5 * rng.normal(size=(30, 2))
        pixels[:8] += 60
        found = localize(points, pixels, camera.intrinsics, threshold=3.0)
        assert found.status == VisionStatus.OK and not found.inliers[:8].any() and found.inliers[8:].mean() > 0.9
        assert same_pose(found.pose, localize(points[8:], pixels[8:], camera.intrinsics).pose) < 0.02
    line = np.outer(np.linspace(-1, 1, 9), [1.0, 2, 3])
    assert localize(line, camera.project(line), camera.intrinsics).status == VisionStatus.DEGENERATE
    assert localize(points[:3], pixels[:3], camera.intrinsics).status == VisionStatus.TOO_FEW
    pixels[2] = np.nan
    assert localize(points, pixels, camera.intrinsics).status == VisionStatus.NOT_FINITE
    with pytest.raises(ValueError, match="expected 30"):
        localize(points, pixels[1:], camera.intrinsics)
    with pytest.raises(ValueError, match="intrinsics"):
        localize(points, pixels, np.zeros((3, 3)))


def test_blocks_of_the_page_run() -> None:
    """Execute the blocks in one namespace, from top to bottom, including their assertions."""
    blocks = re.findall(r"```python\n(.*?)```", (Path(__file__).parents[2] / "docs/vision.md").read_text(), re.DOTALL)
    assert len(blocks) >= 6
    exec(compile("\n".join(blocks), "docs/vision.md", "exec"), {"__name__": "vision"})


@pytest.mark.parametrize("far", [0.0, 1e3, 1e6, 1e9])
def test_cameras_far_from_the_origin(far: float) -> None:
    """Their fundamental matrix is that of the same cameras near the origin, up to the rounding of the places."""
    rng = np.random.default_rng(12)
    turns, places = 0.1 * rng.normal(size=(2, 3)), np.array([[-1.0, 0.2, -6], [1, 0, -6.5]])
    there = [np.array([far, -2 * far, far]) + place for place in places]
    known, found = (
        fundamental_matrix(
            *(Camera.from_intrinsics(700.0, (320, 240), pose(w, t)) for w, t in zip(turns, at, strict=True))
        )
        for at in (places, there)
    )
    assert np.abs(found / np.linalg.norm(found) - known / np.linalg.norm(known)).max() < 1e-12 + 1e-14 * far
    with pytest.raises(ValueError, match="same centre"):
        fundamental_matrix(*(Camera.from_intrinsics(700.0, (320, 240), pose(w, there[0])) for w in turns))


def pose(turn: Array, place: Array) -> Array:
    return np.asarray(pga3.motor_from_rotation_vector_translation(turn, place))
