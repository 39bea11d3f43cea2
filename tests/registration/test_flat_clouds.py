"""Clouds in a plane and on a line: all poses are reported, and no other ones."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from selection import some_slow

from algorithms.registration import RegistrationStatus, register
from benchmarks.registration_scenes import clouds
from generated import pga3

SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
RECTANGLE = [(0, 0), (1.5, 0), (1.5, 1), (0, 1)]
TRIANGLE = [(0, 0), (1, 0), (0.5, 3**0.5 / 2)]
ISOSCELES = [(0, 0), (1, 0), (0.5, 1.4)]
ELL = [(0, 0), (2, 0), (2, 0.6), (0.6, 0.6), (0.6, 1.2), (0, 1.2)]
TURN = Rotation.from_rotvec([0.7, -1.9, 0.4]).as_matrix()
SHIFT = np.array([0.3, 2.0, -1.0])


def drawn(rng, corners, count):
    """Return random points on the outline of a polygon, in the plane of the first two axes."""
    corners = np.asarray(corners, float)
    sides = np.roll(corners, -1, 0) - corners
    lengths = np.linalg.norm(sides, axis=1)
    side = rng.choice(len(corners), count, p=lengths / lengths.sum())
    return np.column_stack([corners[side] + rng.random((count, 1)) * sides[side], np.zeros(count)])


def filled(rng, corners, count):
    """Return random points in a rectangle, or in the union of rectangles of the ell."""
    points = rng.random((8 * count, 2)) * np.max(corners, 0)
    if corners is ELL:
        points = points[(points[:, 1] < 0.6) | (points[:, 0] < 0.6)]
    return np.column_stack([points[:count], np.zeros(count)])


def placed(points):
    """Return points at another place; the true motion takes them back."""
    return (points - SHIFT) @ TURN


def corners_reached(result, corners, limit):
    """Return to which corners the poses take each corner, after a check that they do."""
    corners = np.column_stack([corners, np.zeros(len(corners))])
    moved = pga3.move_point(result.poses.motors[:, None], placed(corners))
    far = np.linalg.norm(moved[:, :, None] - corners, axis=-1)
    assert far.min(2).max() < limit
    return far.argmin(2)


@pytest.mark.slow
@pytest.mark.parametrize(("corners", "count"), [(ISOSCELES, 2), (TRIANGLE, 6)])
def test_outlines_of_polygons(corners, count):
    rng = np.random.default_rng(2)
    source, target = (drawn(rng, corners, 900) + 0.002 * rng.normal(size=(900, 3)) for _ in range(2))
    result = register(placed(source), target)
    assert result.status == (RegistrationStatus.OK if count == 1 else RegistrationStatus.SYMMETRIC)
    reached = corners_reached(result, corners, 0.02)
    assert len(np.unique(reached, axis=0)) == len(reached) == count
    assert (reached == np.arange(len(corners))).all(1).any()
    assert result.inliers.mean() > 0.9 and result.residual < 0.01 and not len(result.free)


@pytest.mark.parametrize(("corners", "count"), [(SQUARE, 8), (ELL, 1)])
@pytest.mark.slow
def test_filled_polygons(corners, count):
    rng = np.random.default_rng(11)
    source, target = (filled(rng, corners, 2000) + 0.001 * rng.normal(size=(2000, 3)) for _ in range(2))
    result = register(placed(source), target)
    assert result.status == (RegistrationStatus.OK if count == 1 else RegistrationStatus.SYMMETRIC)
    reached = corners_reached(result, corners, 0.03)
    assert len(np.unique(reached, axis=0)) == len(reached) == count


@pytest.mark.slow  # A circle is among the blocks of the page.
def test_a_disc_is_free_about_its_axis_and_has_two_sides():
    rng = np.random.default_rng(5)

    def disc():
        angle, radius = 2 * np.pi * rng.random(1500), np.sqrt(rng.random(1500))
        return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(1500)])

    result = register(placed(disc()), disc())
    assert result.status == RegistrationStatus.FREE_MOTION
    assert len(result.free) == 1 and abs(result.free[0, 0]) > 0.99
    normals = pga3.move_direction(result.poses.motors, TURN[2])
    assert np.allclose(sorted(normals[:, 2]), [-1, 1], atol=1e-3)


@pytest.mark.slow  # A flat cloud is among the blocks of the page.
@pytest.mark.parametrize("thickness", [0.0, 0.05])
def test_every_thickness_of_a_scan(thickness):
    bunny = clouds()["bunny"] * [1, 1, thickness]
    result = register(placed(bunny), bunny)
    assert result.status == RegistrationStatus.OK and len(result.poses.motors) == 1
    matrix = pga3.motor_to_matrix(result.motor)
    assert np.allclose(matrix[:3, :3], TURN, atol=1e-6) and np.allclose(matrix[:3, 3], SHIFT, atol=1e-6)


@pytest.mark.parametrize(("height", "count"), some_slow([(0.0, 4), (0.05, 1)], (0.0, 4)))
def test_bumps_of_a_sheet_distinguish_its_sides(height, count):
    rng = np.random.default_rng(7)
    sheets = []
    for _ in range(2):
        points = filled(rng, RECTANGLE, 800)
        points[:, 2] = height * np.sin(3 * points[:, 0] + 2 * points[:, 1]) + 0.002 * rng.normal(size=800)
        sheets.append(points)
    result = register(placed(sheets[0]), sheets[1])
    assert len(result.poses.motors) == count
    matrices = pga3.motor_to_matrix(result.poses.motors)
    assert np.abs(matrices[:, :3, :3] - TURN).max((1, 2)).min() < 0.03


@pytest.mark.slow
def test_different_flat_shapes_have_no_support():
    rng = np.random.default_rng(1)
    angle = 2 * np.pi * rng.random(500)
    circle = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    triangle = drawn(rng, TRIANGLE, 500)
    triangle /= np.linalg.norm(triangle.std(0))
    assert register(circle, triangle).status == RegistrationStatus.NO_SUPPORT


@pytest.mark.parametrize(("skew", "count"), [(1, 2), (2, 1)])
def test_clouds_on_a_line(skew, count):
    rng = np.random.default_rng(3)
    direction = np.array([1.0, 2.0, 2.0]) / 3
    source, target = (rng.random((400, 1)) ** skew * direction + 1e-5 * rng.normal(size=(400, 3)) for _ in range(2))
    result = register(placed(source), target)
    assert result.status == RegistrationStatus.FREE_MOTION and len(result.poses.motors) == count
    e12, e13, e23 = result.free[0, :3]
    assert len(result.free) == 1 and abs(np.array([e23, -e13, e12]) @ direction) > 0.9999
    ends = np.sort(pga3.move_point(result.poses.motors[:, None], placed(np.outer([0, 1], direction))) @ direction, 1)
    assert np.allclose(ends, [0, 1], atol=0.02)
    directions = pga3.move_direction(result.poses.motors, direction @ TURN) @ direction
    assert np.allclose(np.sort(directions), [-1, 1][-count:], atol=1e-3)
    assert result.inliers.mean() > 0.9 and result.covariance.max() > 1e3 * np.sort(np.diag(result.covariance))[0]


def test_a_part_of_a_uniform_line_is_free_along_it():
    rng = np.random.default_rng(3)
    source, target = (np.outer(x, [0.6, 0.8, 0]) for x in (0.6 * rng.random(500), rng.random(800)))
    result = register(placed(source), target)
    assert result.status == RegistrationStatus.FREE_MOTION and len(result.free) == 2
    assert np.allclose(np.abs(result.free[1]), [0, 0, 0, 0.6, 0.8, 0], atol=1e-6)
