"""Maps that are built while the robot moves: poses, covariances and statuses after each scan."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from laser_scenes import clearance, room, scan_at
from test_building import DATA, house_log, motors, poses_of, with_noise

from algorithms.arguments import Reals
from algorithms.mapping import Mapper, Scan, ScanStatus, build_map, optimise_poses, read_g2o
from algorithms.mapping.keyframes import Keyframes
from algorithms.mapping.motions import relative
from algorithms.mapping.surfaces import Surface
from generated import pga2


def errors(found: Reals, truth: Reals) -> Reals:
    """The perturbations (..., 3) of poses in their own frames: angle, x, y."""
    angle, shift = pga2.motor_to_angle_translation(relative(truth, found))
    return np.concatenate([np.asarray(angle)[..., None], shift], -1)


def corridor(x: float, rng: np.random.Generator) -> Scan:
    """The walls of a corridor without ends, 1.5 m to the left and 1 m to the right."""
    angles = np.radians(np.arange(-90, 91))
    with np.errstate(divide="ignore"):
        ranges = np.where(angles > 0, 1.5, -1.0) / np.sin(angles)
    del x  # It looks alike from everywhere.
    return Scan(np.minimum(ranges + 0.01 * rng.normal(size=181), 30.0), -np.pi / 2, np.pi / 180, 30.0)


@pytest.mark.slow
def test_steps_are_those_of_whole_logs() -> None:
    """The same statuses, closures and map as from `build_map`, also if the mapper is stored on the way."""
    graph = read_g2o(DATA / "killian_start.g2o.gz")
    readings, poses = graph.readings[100:220], graph.poses[100:220]
    odometry = with_noise(motors(poses), 2.0, 0.08, 1)
    mapper, steps = Mapper(), []
    for each, pose in zip(readings, odometry, strict=True):
        steps.append(mapper.add(each.scan, pose, each.time))
        if len(steps) == 60:
            mapper = pickle.loads(pickle.dumps(mapper))
    whole = build_map((each.scan, pose, each.time) for each, pose in zip(readings, odometry, strict=True))
    assert [step.status for step in steps] == whole.statuses.tolist()
    assert [list(step.closure) for step in steps if step.closure] == whole.closures.tolist()
    assert [step.n_scans for step in steps] == list(range(1, 121)) and steps[-1].n_added == len(whole.added)
    last = mapper.map()
    assert np.array_equal(last.poses, whole.poses) and np.array_equal(last.line_map.ends, whole.line_map.ends)
    assert np.allclose(mapper.motor, whole.motors[-1]) and mapper.status == steps[-1].status
    assert np.allclose(steps[0].pose, 0) and not steps[0].covariance.any()


@pytest.mark.slow
def test_errors_agree_with_covariances() -> None:
    """In a house, 99 % of the errors are inside the bounds, which a closure makes narrower."""
    log = house_log(0, 90)
    odometry, mapper = poses_of(log.odometry), Mapper()
    steps = [mapper.add(log.scan(k), odometry[k], log.times[k]) for k in range(len(log))]
    off = errors(np.array([step.motor for step in steps]), relative(log.truth[0], log.truth))
    spreads = np.array([step.covariance for step in steps])
    squares = np.einsum("ki,kij,kj->k", off[1:], np.linalg.inv(spreads[1:]), off[1:])
    assert np.quantile(squares, 0.99) < 11.34 and squares.mean() > 0.01  # the chi-square quantile for three numbers
    sizes = np.sqrt(np.linalg.eigvalsh(spreads)[:, -1])
    moved = np.array([step.moved for step in steps])
    assert moved.any() and (sizes[1:] < sizes[:-1])[moved[1:]].any()
    growing = ~moved[1:20] & np.array([step.status == ScanStatus.ADDED for step in steps[1:20]])
    assert (np.diff(sizes[:20])[growing] > 0).all()


def test_corridors_without_odometry_are_not_measured() -> None:
    """Nothing measures the motion along it: no scan is ADDED, and the standard deviation covers the true motion."""
    rng = np.random.default_rng(2)
    mapper = Mapper()
    steps = [mapper.add(corridor(0.3 * k, rng)) for k in range(12)]
    assert all(step.status not in (ScanStatus.ADDED, ScanStatus.BY_ODOMETRY) for step in steps[1:])
    along = np.sqrt(steps[-1].covariance[1, 1])
    assert abs(steps[-1].pose[0] - 0.3 * 11) < 4 * along and along > 0.9


def test_odometry_measures_the_motion_along_corridors() -> None:
    rng = np.random.default_rng(3)
    mapper = Mapper()
    for k in range(12):
        step = mapper.add(corridor(0.3 * k, rng), [0.3 * k, 0, 0])
        assert step.status == ScanStatus.ADDED
    angle, along, across = np.sqrt(np.diag(step.covariance))
    assert abs(step.pose[0] - 3.3) < 0.15 and 0.1 < along < 0.6 and across < along and angle < 0.1


def test_marginal_covariances_are_those_of_the_inverse() -> None:
    """Of a graph of six poses with two loops, beside the dense inverse with derivatives by differences."""
    rng = np.random.default_rng(5)
    poses = rng.normal(size=(6, 3))
    edges = np.array([[0, 1], [1, 2], [2, 3], [3, 4], [0, 4], [1, 3], [4, 5]])
    measured = relative(motors(poses)[edges[:, 0]], motors(poses)[edges[:, 1]])
    roots = rng.normal(size=(len(edges), 3, 3))
    information = roots @ np.swapaxes(roots, 1, 2) + np.eye(3)
    found = optimise_poses(motors(poses), edges, measured, information, marginals=[0, 3, 5])

    def misfits(x: Reals) -> Reals:
        steps = np.concatenate([np.zeros((1, 3)), x.reshape(-1, 3)])
        moved = pga2.motor_product(motors(poses), pga2.motor_from_angle_translation(steps[:, 0], steps[:, 1:]))
        angle, shift = pga2.motor_to_angle_translation(
            relative(measured, relative(moved[edges[:, 0]], moved[edges[:, 1]]))
        )
        return np.concatenate([np.asarray(angle)[:, None], shift], 1)

    h = 1e-6
    rows = np.stack([(misfits(e) - misfits(-e)) / (2 * h) for e in h * np.eye(15)], -1)
    whole = np.linalg.inv(np.einsum("mia,mij,mjb->ab", rows, information, rows))
    assert not found.covariances[0].any()
    for k, pose in ((1, 3), (2, 5)):
        part = slice(3 * pose - 3, 3 * pose)
        assert np.allclose(found.covariances[k], whole[part, part], rtol=1e-6, atol=1e-9)
    apart = optimise_poses(motors(poses), edges[:-1], measured[:-1], information[:-1], marginals=[5])
    assert np.isinf(apart.covariances[0]).all()
    with pytest.raises(ValueError, match="marginals"):
        optimise_poses(motors(poses), edges, measured, information, marginals=[6])


def test_messages() -> None:
    mapper = Mapper()
    assert mapper.status is None and mapper.motor.tolist() == [1, 0, 0, 0]
    with pytest.raises(TypeError, match="scan: list; expected a Scan"):
        mapper.add([1.0, 2.0])  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"odometry: shape \(2,\)"):
        mapper.add(corridor(0, np.random.default_rng(0)), [0, 0])
    for motor in ([0, 0, 0, 0], [2.0, 0, 0, 0]):
        with pytest.raises(ValueError, match=r"odometry: .* expected a unit motor"):
            mapper.add(corridor(0, np.random.default_rng(0)), motor)
    for time, error in (("now", TypeError), (True, TypeError), (np.nan, ValueError), (np.inf, ValueError)):
        with pytest.raises(error, match=r"time: .*; expected a"):
            mapper.add(corridor(0, np.random.default_rng(0)), time=time)  # type: ignore[arg-type]


def test_parts_of_a_submap_are_surfaces_in_another_frame() -> None:
    """Surfaces of different lengths, one of them empty, by matrices."""
    rng, path = np.random.default_rng(0), Keyframes()
    poses = [(0.0, 0.0, 0.0), (0.4, 1.0, -2.0), (-1.3, 2.0, 0.5), (2.0, -3.0, 1.0)]
    motors = pga2.motor_from_angle_translation(*(np.array(poses)[:, each] for each in (0, slice(1, 3))))
    for k, n in enumerate((3, 0, 5, 2)):
        motion = pga2.motor_product(pga2.motor_inverse(motors[max(k - 1, 0)]), motors[k])
        path.add(Surface(rng.normal(size=(n, 2)), rng.normal(size=(n, 2))), motion, np.eye(3))
    found = path.parts(np.array([3, 0, 1, 2]), 2)
    frames = []
    for angle, *place in poses:
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        frames.append((turn, np.array(place)))
    (back, origin) = frames[2]
    for part, row in zip(found, (3, 0, 1, 2), strict=True):
        turn, place = frames[row]
        np.testing.assert_allclose(part.points, (path.surfaces[row].points @ turn.T + place - origin) @ back, atol=1e-6)
        np.testing.assert_allclose(part.normals, path.surfaces[row].normals @ turn.T @ back, atol=1e-6)
    assert path.parts(np.zeros(0, int), 2) == []


def test_slips_of_odometry_do_not_turn_the_map() -> None:
    """A robot circles in a room; wheels slip by 40 degrees and more in every sixth step. Scans decide, not odometry."""
    rng = np.random.default_rng(4)
    walls = room(rng, 12)
    angles = np.linspace(0, np.pi, 20)
    ring = np.column_stack([6 + 4 * np.cos(angles), 4.5 + 2.6 * np.sin(angles)])
    headings = np.arctan2(*np.gradient(ring, axis=0).T[::-1])
    clear = [k for k in range(20) if clearance(walls, ring[k]) > 0.2]
    poses = np.column_stack([ring, headings])[clear]
    truth = motors(poses)
    odometry = [truth[0]]
    for k, step in enumerate(relative(truth[:-1], truth[1:])):
        slip = rng.choice([-1, 1]) * np.radians(rng.uniform(40, 70)) if k % 6 == 5 else 0.0
        error = pga2.motor_from_angle_translation(slip, 0.03 * rng.normal(size=2))
        odometry.append(np.asarray(pga2.motor_product(pga2.motor_product(odometry[-1], step), error)))
    mapper = Mapper()
    for pose, drifted in zip(poses, odometry, strict=True):
        mapper.add(scan_at(rng, walls, pose), drifted)
    built = mapper.map()
    assert len(poses) > 12 and (built.statuses == ScanStatus.ADDED).all()
    off = errors(built.motors, relative(truth[0], truth))
    assert np.abs(off[:, 0]).max() < np.radians(3) and np.abs(off[:, 1:]).max() < 0.15


def test_a_robot_whose_odometry_has_stopped_is_followed() -> None:
    """Odometry repeats one pose while the robot moves. One that stands among people remains where it is."""
    walls = room(np.random.default_rng(4), 6)
    start = next(x for x in np.mgrid[3:9:0.5, 3:6:0.5].reshape(2, -1).T if clearance(walls, x) > 1.2)
    for speed in (0.06, 0.0):
        rng, mapper = np.random.default_rng(8), Mapper()
        poses = np.array([[*start, 0.0] + speed * k * np.array([1.0, 0.0, 0.5]) for k in range(12)])
        for k, pose in enumerate(poses):
            mapper.add(scan_at(rng, walls, pose, people=0.3), odometry=[1.0, 2.0, 0.3], time=0.2 * k)
        first, last = (pga2.motor_from_angle_translation(pose[2], pose[:2]) for pose in poses[[0, -1]])
        assert np.abs(errors(mapper.motor, np.asarray(relative(first, last)))).max() < 0.12
