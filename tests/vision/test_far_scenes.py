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
    cross_ratio,
    epipolar_distance,
    fundamental_matrix,
    invariants_3d,
    localize,
    p2_invariants,
    quadrifocal_tensor,
    relative_pose,
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
