"""Odometry of a lidar in simulated streets with known truth: drift, covariance, statuses and bad input."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from algorithms.arguments import Reals
from algorithms.mapping import LidarOdometry, MappingStatus
from benchmarks.streets import Street, beams, cloud, drive, street, tunnel
from generated import lidar as kernels
from generated import motor_graphs, pga3

RINGS = beams(24, 200)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def driven(
    rng: np.random.Generator, world: Street, poses: Reals, directions: Reals = RINGS
) -> tuple[LidarOdometry, Reals, list[MappingStatus]]:
    """The odometry after some poses, the error of its pose, and the statuses."""
    odometry = LidarOdometry()
    statuses = [odometry.add(cloud(rng, world, pose, directions)) for pose in poses]
    truth = pga3.motor_product(pga3.motor_inverse(poses[0]), poses[-1])
    return odometry, np.asarray(motor_graphs.difference_of_motors(odometry.pose, truth)[0]), statuses


def along(count: int, step: float, turn: float = 0.0) -> Reals:
    return np.array(
        [pga3.motor_from_rotation_vector_translation([0, 0, k * turn], [k * step, 0, 1.8]) for k in range(count)]
    )


def test_a_street(rng: np.random.Generator) -> None:
    """Nine metres from a start at 7 m/s, without a velocity: the error is at most 3 cm and 4 deviations."""
    odometry, error, statuses = driven(rng, street(rng), drive(rng, 14))
    assert statuses == [MappingStatus.OK] * 14
    assert np.linalg.norm(error[3:]) < 0.03 and np.degrees(np.linalg.norm(error[:3])) < 0.1
    deviations = np.sqrt(np.diag(odometry.covariance))
    assert (np.abs(error) < 4 * deviations).all() and deviations[3:].max() < 0.1


def test_a_turn_on_the_spot(rng: np.random.Generator) -> None:
    _, error, statuses = driven(rng, street(rng), along(8, 0.0, np.radians(8)))
    assert set(statuses) == {MappingStatus.OK} and np.abs(error).max() < 0.02


def test_a_tunnel_is_degenerate(rng: np.random.Generator) -> None:
    """Nothing measures the motion along it: its deviation contains the error, and the other directions are known."""
    odometry, error, statuses = driven(rng, tunnel(), along(8, 0.8))
    assert statuses[1:] == [MappingStatus.DEGENERATE] * 7
    deviations = np.sqrt(np.diag(odometry.covariance))
    assert deviations[3] > abs(error[3]) > 1 and np.abs(np.delete(error, 3)).max() < 0.05


def test_other_surroundings_are_not_matched(rng: np.random.Generator) -> None:
    """The map and the pose remain, the covariance grows, and the next scan of the street is matched again."""
    world, poses = street(rng), drive(rng, 10)
    odometry, _, _ = driven(rng, world, poses)
    pose, covariance, n_cells = odometry.pose, odometry.covariance, odometry.n_cells
    step = odometry._velocity
    assert odometry.add(rng.uniform(-30, 30, (3000, 3))) is MappingStatus.NOT_MATCHED
    assert np.abs(odometry.pose - motor_graphs.moved_motor(pose, step)).max() < 1e-12
    assert odometry.n_cells == n_cells and odometry.covariance[3, 3] > covariance[3, 3] + 1
    assert odometry.add(cloud(rng, world, poses[-1], RINGS)) is MappingStatus.OK
    truth = pga3.motor_product(pga3.motor_inverse(poses[0]), poses[-1])
    assert np.abs(motor_graphs.difference_of_motors(odometry.pose, truth)[0]).max() < 0.05


def test_times_scale_predictions(rng: np.random.Generator) -> None:
    """After a gap of three scans at constant velocity, the prediction is the pose; equal times say nothing new."""
    world, poses = street(rng), along(12, 0.5)
    one, two = LidarOdometry(), LidarOdometry()
    for k in range(8):
        points = cloud(rng, world, poses[k], RINGS)
        one.add(points), two.add(points, time=0.1 * k)
    assert np.abs(one.pose - two.pose).max() < 1e-6
    few = np.zeros((0, 3))
    assert two.add(few, time=1.1) is MappingStatus.TOO_FEW_READINGS
    truth = pga3.motor_product(pga3.motor_inverse(poses[0]), poses[11])
    assert np.abs(motor_graphs.difference_of_motors(two.pose, truth)[0]).max() < 0.15
    with pytest.raises(ValueError, match=r"time: 1\.1; expected later than 1\.1"):
        two.add(few, time=1.1)


def box_room(rng: np.random.Generator, x: float) -> Reals:
    """3,000 readings of the walls of a room, from a place on its axis."""
    half = np.array([8.0, 6, 3])
    points = rng.uniform(-1, 1, (3000, 3)) * half
    side = rng.integers(3, size=3000)
    points[range(3000), side] = np.sign(points[range(3000), side]) * half[side]
    return np.asarray(points - [x, 0, 0])


@pytest.mark.parametrize(
    ("times", "places"),
    [
        ([0, 0.1, 0.2, 0.7, 0.8, 0.9], [0, 0.3, 0.6, 0.6, 0.9, 1.2]),  # the robot stops for a while
        ([0, 0.1, 0.2, 3.2, 3.3, 3.4], [0, 0.3, 0.6, 0.6, 0.9, 1.2]),
        ([0, 0.1, 0.2, 10, 10.1, 10.2], [0, 0.3, 0.6, 0.6, 0.9, 1.2]),
        ([0, 0.1, 0.2, 0.3, None, 0.5, 0.6], [0, 0.3, 0.6, 0.9, 1.2, 1.5, 1.8]),  # a time is missing
        ([0, 0.1, 0.2, 0.2 + 1e-9, 0.3, 0.4], [0, 0, 0, 0, 0, 0]),  # the clock jitters
        ([0, 1e-9, 0.1, 0.2, 0.2 + 1e-6, 0.3], [0, 0, 0.3, 0.6, 0.6, 0.9]),
    ],
)
def test_uneven_times(rng: np.random.Generator, times: list[float | None], places: list[float]) -> None:
    """The pose is that of the scans, whatever the motion before, continued over the elapsed time, predicts."""
    odometry = LidarOdometry()
    for time, x in zip(times, places, strict=True):
        status = odometry.add(box_room(rng, x), time)
        truth = pga3.motor_from_rotation_vector_translation(np.zeros(3), [x, 0, 0])
        error = np.abs(motor_graphs.difference_of_motors(odometry.pose, truth)[0])
        deviations = np.sqrt(np.diag(odometry.covariance))
        assert status is MappingStatus.OK and error.max() < 0.05 and deviations.max() < 0.1, (time, error)


def test_times_may_come_later(rng: np.random.Generator) -> None:
    """A velocity between two scans is one in seconds from the first time between two scans on."""
    odometry = LidarOdometry()
    for k, time in enumerate((None, None, None, 0.3)):
        odometry.add(box_room(rng, 0.3 * k), time)
    assert odometry.add([], 0.4) is MappingStatus.TOO_FEW_READINGS
    assert np.abs(pga3.move_point(odometry.pose, np.zeros(3)) - [1.2, 0, 0]).max() < 0.05


def test_the_motion_during_a_gap_is_unknown(rng: np.random.Generator) -> None:
    """A robot that stops unseen is far from where the prediction is, and the deviation contains the error."""
    odometry, world = LidarOdometry(), street(rng)
    poses = along(5, 0.5)
    for k in range(5):
        odometry.add(cloud(rng, world, poses[k], RINGS), 0.1 * k)
    odometry.add(np.zeros((0, 3)), 4.4)
    error = motor_graphs.difference_of_motors(odometry.pose, poses[-1])[0]
    assert 15 < abs(error[3]) < 1.5 * np.sqrt(odometry.covariance[3, 3])


def test_the_frame_is_that_of_the_first_scan_with_planes(rng: np.random.Generator) -> None:
    heap, around = rng.standard_normal((3000, 3)), np.linspace(0, 6, 500)
    ring = np.stack([5 * np.cos(around), 5 * np.sin(around), 0 * around], 1)
    odometry = LidarOdometry()
    for points in (heap, ring, box_room(rng, 0)[:60]):
        assert odometry.add(points) is MappingStatus.TOO_FEW_READINGS and odometry.n_cells == 0
    assert [odometry.add(box_room(rng, 0.3 * k)) for k in range(3)] == [MappingStatus.OK] * 3
    assert np.abs(pga3.move_point(odometry.pose, np.zeros(3)) - [0.6, 0, 0]).max() < 0.03


def test_huge_coordinates_are_out_of_range(rng: np.random.Generator) -> None:
    odometry = LidarOdometry()
    assert odometry.add([]) is MappingStatus.TOO_FEW_READINGS
    assert odometry.add(np.concatenate([box_room(rng, 0), [[1e200, 0, 0]]])) is MappingStatus.OK


def test_bad_input(rng: np.random.Generator) -> None:
    odometry = LidarOdometry()
    assert odometry.status is None and np.array_equal(odometry.pose, np.eye(8)[0])
    for points in (np.zeros((0, 3)), np.full((100, 3), np.nan), np.zeros((100, 3)), rng.normal(size=(20, 3))):
        assert odometry.add(points) is MappingStatus.TOO_FEW_READINGS and odometry.status is None
    with pytest.raises(ValueError, match="points"):
        odometry.add(np.zeros((5, 2)))
    with pytest.raises(ValueError, match="voxel"):
        LidarOdometry(voxel=0)
    with pytest.raises(TypeError, match="time"):
        odometry.add(np.zeros((0, 3)), time="now")  # type: ignore[arg-type]


def test_any_memory_and_pickle(rng: np.random.Generator) -> None:
    """Single precision, read-only and Fortran order give the same pose, and so does a copy from a file."""
    world, poses = street(rng), drive(rng, 3)
    clouds = [cloud(rng, world, pose, RINGS).astype(np.float32) for pose in poses]
    one, two = LidarOdometry(), LidarOdometry()
    for points in clouds:
        points.flags.writeable = False
        one.add(points)
        two = pickle.loads(pickle.dumps(two))
        two.add(np.asfortranarray(points.astype(float)))
    assert np.abs(one.pose - two.pose).max() < 1e-9 and one.status is MappingStatus.OK


def test_sums_are_derivatives(rng: np.random.Generator) -> None:
    """The gradient is that of half of the sum by differences, and the matrix that of the gradient at the minimum."""
    points, rows = rng.normal(size=(9, 3)), rng.integers(-1, 4, 9).astype(float)
    motor = pga3.motor_from_rotation_vector_translation([0.3, -0.2, 0.5], [1.0, 2, -1])
    surfaces = rng.normal(size=(9, 5))
    surfaces[:, :3] /= np.linalg.norm(surfaces[:, :3], axis=1)[:, None]

    def sums(motor: Reals) -> tuple[Reals, ...]:
        return kernels.sums_at_planes(motor, points, rows, surfaces, 1e6)

    def slope(of: int, part: int | slice) -> Reals:
        ends = [[sums(motor_graphs.moved_motor(motor, s * e))[of][part] for s in (1e-5, -1e-5)] for e in np.eye(6)]
        return np.array([(a - b) / 2e-5 for a, b in ends])

    moved = np.asarray(pga3.move_point(motor, points))
    _, gradient, numbers = sums(motor)
    near = surfaces[rows.astype(int)][rows >= 0]
    distances = (near[:, :3] * moved[rows >= 0]).sum(1) + near[:, 3]
    assert np.allclose(numbers, [len(near), len(near), distances @ distances, near[:, 4].sum()])
    assert np.allclose(gradient, slope(2, 2) / 2, atol=1e-6)
    # At planes on which the points lie, the derivative of the gradient is the matrix.
    rows = np.arange(9.0)
    surfaces[:, 3] = -(surfaces[:, :3] * moved).sum(1)
    triangle, gradient, _ = sums(motor)
    assert np.abs(gradient).max() < 1e-9
    assert np.allclose(triangle, slope(1, slice(None))[np.triu_indices(6)], atol=1e-5)


def test_planes_of_cells(rng: np.random.Generator) -> None:
    """Planes are those of least squares; the tilt is that of many noisy fits; lines and heaps have no plane."""

    def fitted(points: Reals) -> tuple[Reals, Reals]:
        centre = np.array([2.0, 3, 4])
        off = points - centre
        products = (off.T @ off)[np.triu_indices(3)]
        mean, surface = kernels.plane_of_points(float(len(points)), off.sum(0), products, centre, 0.02)
        return np.asarray(mean), np.asarray(surface)

    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    cloud = rng.uniform(-0.5, 0.5, (30, 3))
    flat = cloud * [1, 0.8, 0] @ turn + [2, 3, 3]
    mean, surface = fitted(flat)
    assert np.allclose(mean, flat.mean(0)) and np.isclose(abs(surface[:3] @ turn[2]), 1)
    assert np.abs(flat @ surface[:3] + surface[3]).max() < 1e-12
    noisy = [fitted(flat + 0.02 * rng.normal(size=(30, 1)) * turn[2])[1] for _ in range(300)]
    tilts = np.array([each[:3] @ turn[1] * np.sign(each[:3] @ turn[2]) for each in noisy])
    # The variance counts the noise of readings twice: as stated, and as seen.
    assert 0.8 * tilts.var() < np.mean([each[4] for each in noisy]) < 2.5 * tilts.var()
    assert fitted(cloud * [1, 0, 0] @ turn)[1][4] == fitted(cloud)[1][4] == -1
