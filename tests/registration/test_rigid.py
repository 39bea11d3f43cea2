"""Registration of scanned objects and lidar scans from any pose, and its refusals."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from selection import some_slow

from algorithms.registration import RegistrationStatus, register
from benchmarks.registration_scenes import OBJECTS, clouds, error, least_error, scene, split_scene
from generated import pga3

STARTS = [*((name, None) for name in OBJECTS[::2]), ("bunny", 0.0), ("PowerDrill", np.pi)]
"""Objects and angles; a bunny from any rotation is among the blocks of the page."""


@pytest.mark.parametrize(("name", "angle"), some_slow(STARTS, *STARTS[:-1]))
@pytest.mark.slow
def test_half_outliers_and_a_missing_part_from_any_rotation(name, angle):
    source, true_rows, target, matrix = scene(name, 11, angle)
    result = register(source, target)
    assert result.status in (RegistrationStatus.OK, RegistrationStatus.SYMMETRIC, RegistrationStatus.FREE_MOTION)
    angle, distance = least_error(result, matrix, source)
    assert angle < 0.5 and distance < 0.005 * np.linalg.norm(np.ptp(target, axis=0))
    assert result.inliers.shape == (len(source),)
    assert result.inliers[true_rows].mean() > 2 * result.inliers[~true_rows].mean()


@pytest.mark.slow
def test_a_can_is_free_about_its_axis():
    source, _, target, _ = scene("TomatoSoupCan", 3)
    result = register(source, target)
    assert result.status == RegistrationStatus.FREE_MOTION and len(result.free) == 1
    e12, e13, e23 = result.free[0, :3]
    axis = np.array([e23, -e13, e12]) / np.linalg.norm([e12, e13, e23])
    thin = np.linalg.eigh(np.cov(target.T))
    spread = thin[0]
    odd = np.argmax(np.abs(spread - np.median(spread)))
    assert abs(axis @ thin[1][:, odd]) > 0.99


@pytest.mark.slow
def test_lidar_scans_from_the_opposite_heading():
    data = clouds()
    source, target, motion = data["outdoor_source"], data["outdoor_target"], data["outdoor_motion"]
    turn = Rotation.from_euler("z", np.pi).as_matrix()
    truth = motion @ np.block([[turn, np.zeros((3, 1))], [np.zeros((1, 3)), np.ones((1, 1))]])
    result = register(source @ turn, target)
    assert result.status == RegistrationStatus.OK
    angle, distance = error(pga3.motor_to_matrix(result.motor), truth, np.zeros(3))
    assert angle < 0.2 and distance < 0.02


PAIRS = [("bunny", "PowerDrill"), ("Banana", "MustardBottle"), ("CrackerBox", "bunny")]


@pytest.mark.parametrize(("first", "second"), some_slow(PAIRS, *PAIRS[:2]))
@pytest.mark.slow
def test_unrelated_objects_have_no_support(first, second):
    one, two = (clouds()[name].reshape(-1, 3)[:1500] for name in (first, second))
    one, two = (p / np.linalg.norm(p.std(0)) for p in (one, two))
    result = register(one, two)
    assert result.status == RegistrationStatus.NO_SUPPORT
    assert np.array_equal(result.motor, np.eye(8)[0]) and not result.inliers.any()


def test_degenerate_clouds_are_refused():
    rng = np.random.default_rng(0)
    bunny = clouds()["bunny"]
    line = rng.random((100, 1)) * [1.0, 2.0, 3.0]
    plane = rng.random((100, 3)) * [1.0, 2.0, 0.0]
    assert register(bunny[:10], bunny).status == RegistrationStatus.TOO_FEW_POINTS
    assert register(np.tile(bunny[:5], (50, 1)), bunny).status == RegistrationStatus.TOO_FEW_POINTS
    assert register(line, bunny).status == RegistrationStatus.COLLINEAR
    assert register(bunny, plane).status == RegistrationStatus.COPLANAR
    assert register(plane, line).status == RegistrationStatus.COLLINEAR
    assert register(1000 * bunny, bunny).status == RegistrationStatus.DIFFERENT_UNITS
    assert register(np.full((50, 3), np.nan), bunny).status == RegistrationStatus.TOO_FEW_POINTS
    with pytest.raises(ValueError, match="source"):
        register(bunny[:, :2], bunny)


def test_missing_numbers_duplicates_and_units_do_not_matter():
    bunny = clouds()["bunny"]
    turn = Rotation.random(random_state=4).as_matrix()
    source = np.concatenate([bunny @ turn, (bunny @ turn)[:40], np.full((5, 3), np.nan)])
    result = register((1000 * source).tolist(), (1000 * bunny).tolist())
    assert result.status == RegistrationStatus.OK
    assert result.inliers[:-5].all() and not result.inliers[-5:].any()
    assert np.allclose(pga3.motor_to_matrix(result.motor)[:3, :3], turn, atol=1e-6)
    assert result.residual < 1e-6 and result.coverage == 1


@pytest.mark.parametrize("name", some_slow(["bunny", "MustardBottle"], "MustardBottle"))
def test_a_damaged_target_and_a_whole_source(name):
    target, _, source, matrix = scene(name, 12)
    result = register(source, target)
    assert result.status in (RegistrationStatus.OK, RegistrationStatus.SYMMETRIC)
    angle, distance = least_error(result, np.linalg.inv(matrix), source)
    assert angle < 0.5 and distance < 0.005 * np.linalg.norm(np.ptp(source, axis=0))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "outliers_in"), list(zip(OBJECTS[:4], ["source", "target"] * 2, strict=True)))
def test_one_cloud_has_outliers_and_the_other_one_is_cut(name, outliers_in):
    source, target, matrix = split_scene(name, 21, outliers_in)
    result = register(source, target)
    assert result.status in (RegistrationStatus.OK, RegistrationStatus.SYMMETRIC, RegistrationStatus.FREE_MOTION)
    angle, distance = least_error(result, matrix, source)
    assert angle < 0.5 and distance < 0.005 * np.linalg.norm(np.ptp(target, axis=0))


def box(rng, count, sides):
    """Return random points on the surface of a box."""
    sides = np.asarray(sides, float)
    areas = np.prod(sides) / sides
    axis = rng.choice(3, count, p=areas / areas.sum())
    points = rng.random((count, 3))
    points[np.arange(count), axis] = rng.integers(0, 2, count)
    return points * sides


BOXES = [((1, 0.7, 0.4), 4, True), ((1, 1, 0.5), 8, False)]


@pytest.mark.parametrize(("sides", "count", "same"), some_slow(BOXES, BOXES[0]))
@pytest.mark.slow
def test_all_rotations_of_boxes_are_reported(sides, count, same):
    rng = np.random.default_rng(4)
    target = box(rng, 1500, sides)
    source = target if same else box(rng, 1500, sides)
    turn = Rotation.random(random_state=9).as_matrix()
    result = register(source @ turn, target)
    assert result.status == RegistrationStatus.SYMMETRIC
    # Each pose takes corners to corners, and no two of them in the same order.
    corners = np.stack(np.meshgrid(*[(0, side) for side in sides], indexing="ij"), -1).reshape(-1, 3)
    moved = pga3.move_point(result.poses.motors[:, None], corners @ turn)
    far = np.linalg.norm(moved[:, :, None] - corners, axis=-1)
    assert far.min(2).max() < 0.02
    assert len(np.unique(far.argmin(2), axis=0)) == len(far) == count


@pytest.mark.slow
def test_all_rotations_of_a_cube_and_the_families_of_round_bodies_are_reported():
    rng = np.random.default_rng(4)
    turn = Rotation.random(random_state=9).as_matrix()
    cubes = box(rng, 1500, (1, 1, 1)), box(rng, 1500, (1, 1, 1))
    assert len(register(cubes[0] @ turn, cubes[1]).poses.motors) == 24

    def cylinder():
        angle, height = 2 * np.pi * rng.random(1500), 2.5 * rng.random(1500)
        lids = rng.random(1500) < 2 / 7
        radius = np.where(lids, np.sqrt(rng.random(1500)), 1)
        height = np.where(lids, 2.5 * rng.integers(0, 2, 1500), height)
        return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])

    result = register(cylinder() @ turn, cylinder())
    assert result.status == RegistrationStatus.FREE_MOTION
    assert len(result.free) == 1 and len(result.poses.motors) == 2
    balls = rng.normal(size=(2, 1500, 3))
    result = register(*(balls / np.linalg.norm(balls, axis=2, keepdims=True)))
    assert result.status == RegistrationStatus.FREE_MOTION
    assert len(result.free) == 3 and len(result.poses.motors) == 1


def test_the_type_and_the_place_of_the_numbers_do_not_matter():
    bunny = clouds()["bunny"]
    turn = Rotation.random(random_state=4).as_matrix()
    source = (bunny @ turn).astype(np.float32)
    source.flags.writeable = False
    result = register(source, bunny + 1e3)
    assert result.status == RegistrationStatus.OK
    assert np.allclose(pga3.motor_to_matrix(result.motor)[:3, :3], turn, atol=1e-4)


@pytest.mark.parametrize("far", [50.0])
def test_a_stray_point_far_away_does_not_refuse_a_cloud(far: float):
    bunny = clouds()["bunny"]
    turn = Rotation.random(random_state=8).as_matrix()
    size = np.ptp(bunny, axis=0).max()
    source = np.concatenate([bunny @ turn, [[far * size, size, 0]]])
    result = register(source, bunny)
    assert result.status == RegistrationStatus.OK
    assert np.allclose(pga3.motor_to_matrix(result.motor)[:3, :3], turn, atol=1e-4)


@pytest.mark.slow
def test_the_handle_of_a_mug_decides():
    """Without the handle, 4 % of the points, every turn about the axis fits."""
    rng = np.random.default_rng(12)

    def mug():
        body, angle = rng.random(1920) < 0.8, 2 * np.pi * rng.random(1920)
        radius = np.where(body, 1, np.sqrt(rng.random(1920)))
        wall = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), body * 2 * rng.random(1920)])
        bow, around = np.pi * (rng.random(80) - 0.5), 2 * np.pi * rng.random(80)
        wide = 0.45 + 0.1 * np.cos(around)
        handle = np.column_stack([1 + wide * np.cos(bow), 0.1 * np.sin(around), 1 + wide * np.sin(bow)])
        return np.concatenate([wall, handle])

    turn = Rotation.random(random_state=3).as_matrix()
    result = register(mug() @ turn, mug())
    assert result.status == RegistrationStatus.OK
    assert np.allclose(pga3.motor_to_matrix(result.motor)[:3, :3], turn, atol=0.05)
