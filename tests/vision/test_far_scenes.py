"""Scenes far from the origin and of extreme scale, against exact rational and high-precision results.

Coordinates are multiples of a power of two, so that far ones have no rounding errors, and truth is that of the numbers
as they are stored.
"""

from fractions import Fraction

import mpmath
import numpy as np
import pytest

from algorithms.vision import (
    Camera,
    VisionStatus,
    bundle_adjust,
    calibrate_by_pascal,
    calibrate_from_planes,
    calibrate_stereo,
    camera_centre,
    cameras_of_four_points,
    cross_ratio,
    epipolar_distance,
    factorize,
    fundamental_matrices,
    fundamental_matrix,
    hand_eye_from_poses,
    homographies,
    homography,
    invariants_3d,
    localizations,
    localize,
    localize_rig,
    localize_unknown_focal,
    motions_of_plane,
    p2_invariants,
    poses_of_three_points,
    quadrifocal_tensor,
    rectify,
    relative_pose,
    robust_fundamental_matrix,
    robust_homography,
    transfer_point,
    triangulate,
    triangulation,
    trifocal_tensor,
)
from generated import pga3
from tests.support.all_cases import all_cases

K = np.array([[800.0, 0, 320], [0, 790.0, 240], [0, 0, 1]])
FAR = [(1.0, 0.0), (2.0**-10, 0.0), (2.0**10, 0.0), (1.0, 2.0**20), (2.0**-10, 2.0**20)]
"""Units and distances from the origin: 1e-3, 1e3 and 1e6."""


def dyadic(rng, shape, size=1.0):
    """Multiples of 2^-12."""
    return np.round(rng.uniform(-size, size, shape) * 4096) / 4096


def determinant(rows):
    if len(rows) == 1:
        return rows[0][0]
    rest = [[row[:k] + row[k + 1 :] for row in rows[1:]] for k in range(len(rows))]
    return sum((-1) ** k * rows[0][k] * determinant(rest[k]) for k in range(len(rows)))


def fractions(points):
    return [[*map(Fraction, map(float, point)), Fraction(1)] for point in points]


def exact_cross_ratio(points):
    """By brackets of rational numbers."""
    *shared, a, b, c, d = fractions(points)

    def bracket(p, q):
        return determinant([*shared, p, q])

    return bracket(a, c) * bracket(b, d) / (bracket(a, d) * bracket(b, c))


def exact_p2(points):
    found = []
    for k in range(5):
        r = exact_cross_ratio([points[k], *(points[m] for m in range(5) if m != k)])
        above = 2 * r**6 - 6 * r**5 + 9 * r**4 - 8 * r**3 + 9 * r**2 - 6 * r + 2
        found.append(float(above / (r**6 - 3 * r**5 + 3 * r**4 - r**3 + 3 * r**2 - 3 * r + 1)))
    return sorted(found)


def exact_pixels(points, centre):
    """The pixels of a camera without rotation, rounded once, by 50 digits."""
    with mpmath.workdps(50):
        offsets = [
            [mpmath.mpf(float(a)) - mpmath.mpf(float(b)) for a, b in zip(p, centre, strict=True)] for p in points
        ]
        return np.array([[float(K[k, k] * p[k] / p[2] + K[k, 2]) for k in (0, 1)] for p in offsets])


def scene(rng, unit, far, n=30, n_cameras=2):
    """Points and cameras without rotation, and exact pixels."""
    origin = far * np.array([1.0, -0.5, 0.25])
    points = unit * dyadic(rng, (n, 3)) + origin
    centres = unit * (dyadic(rng, (n_cameras, 3)) - np.array([0, 0, 6])) + origin
    cameras = []
    for centre in centres:
        pose = np.asarray(pga3.motor_from_rotation_vector_translation(np.zeros(3), centre))
        assert (pga3.motor_to_matrix(pose)[:3, 3] == centre).all()
        cameras.append(Camera(K, pose))
    return points, centres, cameras, [exact_pixels(points, centre) for centre in centres]


@pytest.mark.parametrize(("unit", "far"), [*FAR, (2.0**500, 0.0), (2.0**-500, 0.0)])
def test_invariants_of_points_have_all_digits(unit, far):
    for seed in range(10):
        rng = np.random.default_rng([90, seed])
        five = unit * dyadic(rng, (5, 2)) + far
        assert np.allclose(p2_invariants(five), exact_p2(five), rtol=1e-9, atol=0)
        for n, size in ((4, 1), (5, 2), (6, 3)):
            points = unit * dyadic(rng, (n, size)) + far
            assert np.isclose(cross_ratio(points), float(exact_cross_ratio(points)), rtol=1e-9, atol=0)
        six = dyadic(rng, (6, 3))
        assert np.allclose(invariants_3d(unit * six + far), invariants_3d(six), rtol=1e-9, atol=0)


@pytest.mark.parametrize(("unit", "far"), FAR)
def test_triangulated_points_have_all_digits(unit, far):
    points, centres, cameras, pixels = scene(np.random.default_rng(91), unit, far)
    matrices = [np.asarray(K @ np.c_[np.eye(3), -centre]) for centre in centres]
    found = triangulation(cameras, pixels, noise=0.5)
    assert (found.status == VisionStatus.OK).all()
    # Pixels are rounded to 1e-13, and depths are less exact by their ratio to the baseline.
    limit = 1e-12 * unit + 2e-16 * far
    assert np.abs(found.points - points).max() < limit and np.abs(triangulate(cameras, pixels) - points).max() < limit
    # The last columns of matrices are products with K, rounded to 1e-16 of the distance from the origin.
    assert np.abs(triangulate(matrices, pixels) - points).max() < 1e-12 * unit + 1e-14 * far


@pytest.mark.parametrize(("unit", "far"), FAR)
def test_tensors_of_far_cameras_fit_their_pixels(unit, far):
    _, _, cameras, pixels = scene(np.random.default_rng(92), unit, far, n_cameras=4)
    matrix = fundamental_matrix(*cameras[:2])
    assert np.abs(epipolar_distance(matrix, *pixels[:2])).max() < 1e-10
    tensor = trifocal_tensor(*cameras[:3])
    assert np.abs(transfer_point(tensor, *pixels[:2]) - pixels[2]).max() < 1e-9
    four = quadrifocal_tensor(*cameras)
    lines = [np.cross(np.insert(p, 2, 1, axis=1), [0.3, 0.5, 0.2]) for p in pixels]
    lines = [each / np.linalg.norm(each, axis=1, keepdims=True) for each in lines]
    assert np.abs(np.einsum("ijkm,ni,nj,nk,nm->n", four / np.linalg.norm(four), *lines)).max() < 1e-12


@all_cases("unit, far", FAR)
@all_cases("threshold", [None, 2.0])
def test_poses_have_all_digits(unit, far, threshold):
    points, centres, _, pixels = scene(np.random.default_rng(93), unit, far)
    found = localize(points, pixels[0], K, threshold=threshold)
    assert found.status == VisionStatus.OK
    assert np.abs(pga3.motor_to_matrix(found.pose)[:3, 3] - centres[0]).max() < 1e-11 * unit + 1e-15 * far
    assert np.abs(pga3.motor_to_matrix(found.pose)[:3, :3] - np.eye(3)).max() < 1e-12


@pytest.mark.parametrize(("unit", "far"), FAR)
def test_motions_and_adjustments_have_all_digits(unit, far):
    rng = np.random.default_rng(94)
    points, centres, cameras, pixels = scene(rng, unit, far)
    motion = relative_pose(*pixels, K)
    way = (centres[0] - centres[1]) / np.linalg.norm(centres[0] - centres[1])
    assert motion.status == VisionStatus.OK and np.abs(pga3.motor_to_matrix(motion.motor)[:3, 3] - way).max() < 1e-9
    views = np.repeat([0, 1], 30), np.tile(np.arange(30), 2), np.concatenate(pixels)
    found = bundle_adjust(cameras, points + 0.01 * unit * rng.normal(size=points.shape), views, fixed_cameras=(0, 1))
    assert found.status == VisionStatus.OK and np.abs(found.points - points).max() < 1e-9 * unit + 1e-15 * far


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_motions_do_not_depend_on_the_unit_of_pixels(unit):
    _, centres, _, pixels = scene(np.random.default_rng(95), 1.0, 0.0)
    scale = np.diag([unit, unit, 1.0])
    found = relative_pose(*(unit * each for each in pixels), scale @ K, threshold=1.5 * unit)
    way = (centres[0] - centres[1]) / np.linalg.norm(centres[0] - centres[1])
    assert found.status == VisionStatus.OK and np.abs(pga3.motor_to_matrix(found.motor)[:3, 3] - way).max() < 1e-9


@pytest.mark.parametrize(("unit", "far"), FAR)
def test_calibrations_have_all_digits_that_boards_have(unit, far):
    rng = np.random.default_rng(96)
    board = np.stack(np.meshgrid(np.arange(9.0), np.arange(6.0)), -1).reshape(-1, 2) / 4
    views = []
    for _ in range(6):
        turn = pga3.motor_from_rotation_vector_translation(rng.uniform(-0.4, 0.4, 3), np.array([1.0, 0.6, -5]))
        views.append(Camera(K, np.asarray(turn)).project(np.insert(board, 2, 0, axis=1)))
    away = unit * board + far  # exact
    for distortion in (None, "brown"):
        found = calibrate_from_planes(away, views, distortion=distortion)
        assert found.status == VisionStatus.OK and np.abs(found.intrinsics - K).max() < 1e-8
    assert np.abs(calibrate_by_pascal(away, views).intrinsics - K).max() < 1e-6


def places(motors):
    return np.asarray(pga3.motor_to_matrix(motors))[..., :3, 3]


def rounding(unit, far):
    return 1e-11 * unit + 1e-15 * far


@pytest.mark.parametrize(("unit", "far"), FAR)
def test_poses_of_samples_and_batches_have_all_digits(unit, far):
    points, centres, _, pixels = scene(np.random.default_rng(97), unit, far, n_cameras=3)
    square = np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]])
    image = (pixels[0] - K[:2, 2]) @ np.diag(1 / np.diag(K)[:2]) * 800 + square[:2, 2]
    found = [poses_of_three_points(points[:3], pixels[0][:3], K), camera_centre(points, pixels[0])]
    assert np.nanmin(np.abs(places(found[0]) - centres[0]).max(-1)) < rounding(unit, far)
    assert np.abs(found[1] - centres[0]).max() < 10 * rounding(unit, far)
    batch = localizations(points.reshape(2, 15, 3), pixels[0].reshape(2, 15, 2), K)
    assert (batch.status == VisionStatus.OK).all()
    assert np.abs(places(batch.models) - centres[0]).max() < rounding(unit, far)
    poses, focals, _ = cameras_of_four_points(points[:4], image[:4], (320, 240))
    nearest = np.abs(focals - 800).argmin()
    assert abs(focals[nearest] - 800) < 1e-9
    assert np.abs(places(poses[nearest]) - centres[0]).max() < rounding(unit, far)
    for threshold in (None, 2.0):
        focal = localize_unknown_focal(points, image, (320, 240), threshold)
        assert focal.status == VisionStatus.OK and abs(focal.focal - 800) < 1e-9
        assert np.abs(places(focal.pose) - centres[0]).max() < rounding(unit, far)
        number = np.arange(30) % 3
        shifts = [np.asarray(pga3.motor_from_rotation_vector_translation(np.zeros(3), c - centres[0])) for c in centres]
        seen = np.array([pixels[k][i] for i, k in enumerate(number)])
        rig = localize_rig(points, seen, [Camera(K, shift) for shift in shifts], number, threshold)
        assert rig.status == VisionStatus.OK and np.abs(places(rig.pose) - centres[0]).max() < rounding(unit, far)


@pytest.mark.parametrize(("unit", "far"), FAR)
def test_lines_have_all_digits(unit, far):
    rng = np.random.default_rng(98)
    points, centres, cameras, pixels = scene(rng, unit, far, n_cameras=4)
    edges, ends = points.reshape(15, 2, 3), np.array(pixels).reshape(4, 15, 2, 2)
    for n, threshold in ((0, None), (10, None), (10, 2.0)):
        found = localize(points[:n], pixels[0][:n], K, threshold, lines=edges, image_lines=ends[0])
        assert found.status == VisionStatus.OK and np.abs(places(found.pose) - centres[0]).max() < rounding(unit, far)
    view, edge = (table.ravel() for table in np.indices((4, 15)))
    table = np.repeat(range(4), 30), np.tile(np.arange(30), 4), np.concatenate(pixels)
    near = points + 0.01 * unit * rng.normal(size=points.shape), edges + 0.01 * unit * rng.normal(size=edges.shape)
    best = bundle_adjust(cameras, near[0], table, lines=near[1], image_lines=(view, edge, ends.reshape(60, 2, 2)))
    assert best.status == VisionStatus.OK and not best.line_status.any()
    assert np.abs(best.points - points).max() < 1e-9 * unit + 1e-15 * far
    along = best.lines[:, 1] - best.lines[:, 0]
    off = np.cross(along, edges[:, 0] - best.lines[:, 0]) / np.linalg.norm(along, axis=1, keepdims=True)
    assert np.abs(off).max() < 1e-9 * unit + 1e-15 * far


@pytest.mark.parametrize(("unit", "far"), FAR)
def test_pairs_of_cameras_and_hands_have_all_digits(unit, far):
    rng = np.random.default_rng(99)
    points, centres, _, _ = scene(rng, unit, far)
    centres[1] = centres[0] + unit * np.array([0.5, 0.25, 0.125])
    cameras = [Camera(K, np.asarray(pga3.motor_from_rotation_vector_translation(np.zeros(3), c))) for c in centres]
    one, two = (exact_pixels(points, centre) for centre in centres)
    pair = rectify(*cameras, (640, 480))
    a, b = pair.points(one, 0), pair.points(two, 1)
    assert np.abs(a[:, 1] - b[:, 1]).max() < 1e-10
    depth = pair.pair().depth(a[:, 0] - b[:, 0])
    assert np.abs(depth / pair.cameras[0].depth(points) - 1).max() < 1e-12 + 1e-15 * far / unit
    turns, shifts = rng.normal(size=(12, 3)), unit * rng.normal(size=(12, 3))
    shifts[1:] += far
    x, z, *hands = pga3.motor_from_rotation_vector_translation(turns, shifts)
    eyes = pga3.motor_product(pga3.motor_inverse(z), pga3.motor_product(np.array(hands), x))
    found = hand_eye_from_poses(np.array(hands), eyes)
    assert not found.status.any() and np.abs(places(found.motor) - shifts[0]).max() < rounding(unit, far)


@pytest.mark.parametrize(("unit", "far"), FAR)
def test_planes_have_all_digits(unit, far):
    rng = np.random.default_rng(100)
    points, centres, _, _ = scene(rng, unit, far)
    points[:, 2] = 0.25 * far
    one, two = (exact_pixels(points, centre) for centre in centres)
    way = (centres[0] - centres[1]) / np.linalg.norm(centres[0] - centres[1])
    for model in (homography(one, two), robust_homography(one, two).model):
        motions = places(motions_of_plane(model, K).motors)
        assert np.abs(motions / np.linalg.norm(motions, axis=-1, keepdims=True) - way).max(-1).min() < 1e-10
    for threshold in (None, 2.0):
        found = localize(points, one, K, threshold)
        assert found.status == VisionStatus.OK and np.abs(places(found.pose) - centres[0]).max() < rounding(unit, far)
    board = np.stack(np.meshgrid(np.arange(9.0), np.arange(6.0)), -1).reshape(-1, 2) / 4
    between = np.asarray(pga3.motor_from_rotation_vector_translation(np.array([0, 0.1, 0]), np.array([-0.8, 0, 0.1])))
    eye, views = Camera(K, np.eye(8)[0]), ([], [])
    for turn in rng.uniform(-0.4, 0.4, (6, 3)):
        pose = pga3.motor_from_rotation_vector_translation(turn, np.array([-1.0, -0.6, 5]))
        corners = pga3.move_point(pose, np.insert(board, 2, 0, axis=1))
        views[0].append(eye.project(corners))
        views[1].append(eye.project(pga3.move_point(between, corners)))
    stereo = calibrate_stereo(unit * board + far, *views, eye, eye)
    assert stereo.status == VisionStatus.OK and np.abs(places(stereo.motor) / unit - places(between)).max() < 1e-11


@pytest.mark.parametrize("unit", [2.0**-10, 1.0, 2.0**10])
def test_matrices_do_not_depend_on_the_unit_of_pixels(unit):
    rng = np.random.default_rng(101)
    _, _, _, (one, two) = scene(rng, 1.0, 0.0, n=60)
    one, two = unit * one, unit * two
    wrong = two.copy()
    wrong[:12] += unit * rng.uniform(30, 60, (12, 2))
    found = robust_fundamental_matrix(one, wrong, unit)
    assert found.status == VisionStatus.OK and not found.inliers[:12].any()
    for matrix in (fundamental_matrix(one, two), found.model):
        assert np.abs(epipolar_distance(matrix, one, two)).max() < 1e-10 * unit
    batch = fundamental_matrices(one.reshape(5, 12, 2), two.reshape(5, 12, 2))
    assert (batch.status == VisionStatus.OK).all()
    matrix = np.array([[1, 0.1, 2], [-0.1, 0.9, 1], [1e-4, 2e-4, 1]]) @ np.diag([1 / unit, 1 / unit, 1])
    three = np.insert(one, 2, 1, axis=1) @ (np.diag([unit, unit, 1]) @ matrix).T
    three = three[:, :2] / three[:, 2:]
    sets = homographies(one.reshape(15, 4, 2), three.reshape(15, 4, 2))
    assert (sets.status == VisionStatus.OK).all()
    for model in (homography(one, three), robust_homography(one, three, 2 * unit).model):
        moved = np.insert(one, 2, 1, axis=1) @ model.T
        assert np.abs(moved[:, :2] / moved[:, 2:] - three).max() < 1e-11 * unit
    views = np.array(scene(rng, 1.0, 0.0, n_cameras=4)[3])
    shape = factorize(unit * views)
    assert shape.status == VisionStatus.OK and np.abs(shape.pixels / unit - views).max() < 1e-9
