"""Maps from streams: real scans of Killian Court, a simulated house, bad input, and long logs."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from algorithms.arguments import Reals
from algorithms.mapping import BuildSettings, BuiltMap, Progress, Scan, ScanStatus, build_map
from algorithms.mapping.built_map import REFUSED
from algorithms.mapping.carmen import CarmenLog
from algorithms.mapping.floor_plans import load_floor_plan
from algorithms.mapping.g2o import PoseGraphFile, read_g2o
from algorithms.mapping.line_map import same_wall
from algorithms.mapping.motions import relative
from algorithms.mapping.scan_simulation import Odometry, Scanner, SimulatedLog, simulate_log
from generated import pga2
from tests.support.all_cases import all_cases
from tests.support.selection import some_slow

DATA = Path(__file__).parents[1] / "data" / "maps"
Stream = list[tuple[Scan, Reals | None, float | None]]


def motors(poses: Reals) -> Reals:
    return np.asarray(pga2.motor_from_angle_translation(poses[..., 2], poses[..., :2]))


def poses_of(found: Reals) -> Reals:
    angles, shifts = pga2.motor_to_angle_translation(found)
    return np.concatenate([shifts, np.asarray(angles)[:, None]], -1)


def trajectory_error(places: Reals, truth: Reals) -> float:
    """The root mean square of distances after the best rigid motion."""
    a, b = places - places.mean(0), truth - truth.mean(0)
    left, _, right = np.linalg.svd(a.T @ b)
    turn = left @ np.diag([1, np.linalg.det(left @ right)]) @ right
    return float(np.sqrt((((a @ turn) - b) ** 2).sum(1).mean()))


def with_noise(truth: Reals, turn: float, shift: float, seed: int) -> Reals:
    """Odometry (n, 3): true motions with errors of angles in degrees and of places in metres, and 2 % of the length."""
    rng = np.random.default_rng(seed)
    chain = [truth[0]]
    for motion in relative(truth[:-1], truth[1:]):
        _, ahead = pga2.motor_to_angle_translation(motion)
        angle, place = np.radians(turn) * rng.normal(), shift * rng.normal(size=2) + 0.02 * np.asarray(ahead)
        error = pga2.motor_from_angle_translation(angle, place)
        chain.append(pga2.motor_product(chain[-1], pga2.motor_product(motion, error)))
    return poses_of(np.array(chain))


@pytest.fixture(scope="module")
def court() -> PoseGraphFile:
    """The part of Killian Court with closed loops."""
    whole, some = read_g2o(DATA / "killian_start.g2o.gz"), slice(100, 300)
    inside = ((whole.edges >= some.start) & (whole.edges < some.stop)).all(1)
    edges, motions = whole.edges[inside] - some.start, whole.motions[inside]
    return replace(whole, readings=whole.readings[some], poses=whole.poses[some], edges=edges, motions=motions)


@pytest.fixture(scope="module")
def stream(court: PoseGraphFile) -> Stream:
    """The scans of Killian Court, with odometry that is wrong by 2 degrees and 8 cm at each of them."""
    odometry = with_noise(motors(court.poses), 2.0, 0.08, 1)
    return [(each.scan, pose, each.time) for each, pose in zip(court.readings, odometry, strict=True)]


def edge_errors(court: PoseGraphFile, found: Reals) -> tuple[Reals, Reals]:
    """Differences of the edges of the file from a map: metres and degrees."""
    between = relative(found[court.edges[:, 0]], found[court.edges[:, 1]])
    angles, shifts = pga2.motor_to_angle_translation(relative(motors(court.motions), between))
    return np.hypot(*shifts.T), np.degrees(np.abs(angles))


@pytest.fixture(scope="module")
def built(stream: Stream) -> BuiltMap:
    return build_map(stream)


def test_motions_of_killian_court_are_reproduced(court: PoseGraphFile, stream: Stream, built: BuiltMap) -> None:
    """Medians of 5 cm and 0.5 degrees on real scans, from odometry that is off by more than twice that."""
    lengths, angles = edge_errors(court, built.motors)
    assert np.median(lengths) < 0.05 and np.median(angles) < 0.5
    raw_lengths, raw_angles = edge_errors(court, motors(np.array([odometry for _, odometry, _ in stream])))
    assert np.median(raw_lengths) > 2 * np.median(lengths) and np.median(raw_angles) > 2 * np.median(angles)
    assert np.bincount(built.statuses)[ScanStatus.ADDED] > 195 and built.refused == {}


def test_map_of_killian_court(built: BuiltMap) -> None:
    """At most 600 segments without duplicates, and readings within 3 cm of them."""
    assert 50 < len(built.line_map) <= 600
    assert not list(same_wall(built.line_map))
    assert built.residual < 0.03
    assert len(built.closures) > 3 and (built.closures[:, 1] - built.closures[:, 0] > 10).all()


@pytest.mark.slow
def test_loops_reduce_errors(court: PoseGraphFile, stream: Stream, built: BuiltMap) -> None:
    open_ended = build_map(stream, BuildSettings(close_loops=False))
    assert len(open_ended.closures) == 0
    loops = court.edges[:, 1] - court.edges[:, 0] > 1
    with_loops, without = (edge_errors(court, each.motors)[0][loops] for each in (built, open_ended))
    assert np.median(with_loops) < 0.5 * np.median(without)


def test_frame_of_the_odometry_is_of_no_account(stream: Stream, built: BuiltMap) -> None:
    """Odometry that starts elsewhere, and motors of the opposite sign, give the same map."""
    away = motors(np.array([100.0, -50.0, 2.0]))
    moved = poses_of(-pga2.motor_product(away, motors(np.array([odometry for _, odometry, _ in stream[:15]]))))
    other = build_map([(scan, pose, time) for (scan, _, time), pose in zip(stream, moved, strict=False)])
    first = build_map(stream[:15])
    assert np.allclose(other.poses[:, :2], first.poses[:, :2], atol=1e-6)
    assert np.allclose(other.line_map.ends, first.line_map.ends, atol=1e-5)


def test_scans_without_odometry(court: PoseGraphFile, stream: Stream) -> None:
    found = build_map([(scan, None, None) for scan, _, _ in stream[:30]])
    truth = relative(motors(court.poses[:29]), motors(court.poses[1:30]))
    angles, shifts = pga2.motor_to_angle_translation(relative(truth, relative(found.motors[:-1], found.motors[1:])))
    assert np.median(np.hypot(*shifts.T)) < 0.05 and np.median(np.abs(angles)) < np.radians(0.5)
    assert np.isnan(found.times).all()


def useless(kind: str, rng: np.random.Generator) -> Scan:
    ranges = {
        "empty": np.zeros(0), "one beam": np.ones(1), "maximum": np.full(180, 81.83), "missing": np.full(180, np.nan),
        "noise": rng.uniform(0.5, 20, 180), "zeros": np.zeros(180),
    }[kind]  # fmt: skip
    return Scan(ranges, -np.pi / 2, np.pi / 180, 30.0)


def test_useless_scans_leave_the_map_as_it_was(stream: Stream) -> None:
    """Every sixth scan is followed by a useless one: it is refused, and the map is the same up to rounding."""
    rng = np.random.default_rng(0)
    kinds = iter(("empty", "one beam", "maximum", "missing", "zeros"))
    rows: list[Any] = []
    for k, item in enumerate(stream[:30]):
        rows += [item] + ([(useless(next(kinds), rng), item[1], item[2])] if k % 6 == 5 else [])
    clean, found = build_map(stream[:30]), build_map(rows)
    bad = np.arange(6, 35, 7)
    assert found.refused == {"TOO_FEW_READINGS": 5} and set(found.statuses[bad]) == {ScanStatus.TOO_FEW_READINGS}
    assert np.allclose(np.delete(found.poses, bad, 0), clean.poses, atol=1e-9)
    assert np.allclose(found.line_map.lines, clean.line_map.lines, atol=1e-7)
    assert np.allclose(found.line_map.spans, clean.line_map.spans, atol=1e-7)


def test_scans_of_something_else_leave_the_map_as_it_was(stream: Stream, court: PoseGraphFile) -> None:
    """Every tenth scan is replaced by beams at random, or by one with the beams in the opposite order."""
    rng = np.random.default_rng(0)
    rows: list[Any] = list(stream[:40])
    for k in range(9, 40, 10):
        mirrored = Scan(stream[k + 40][0].ranges[::-1], -np.pi / 2, np.pi / 180, 30.0)
        rows[k] = (useless("noise", rng) if k % 20 == 9 else mirrored, *rows[k][1:])
    found = build_map(rows)
    bad = np.arange(9, 40, 20)
    assert set(found.statuses[bad]) <= set(REFUSED)
    assert trajectory_error(found.poses[:, :2], court.poses[:40, :2]) < 0.3
    assert found.residual < 0.03


def test_only_useless_scans() -> None:
    rng = np.random.default_rng(0)
    found = build_map([(useless(kind, rng), np.zeros(3), 0.0) for kind in ("empty", "maximum", "zeros")])
    assert found.refused == {"TOO_FEW_READINGS": 3} and len(found.line_map) == 0 and len(found.added) == 0
    assert np.array_equal(found.poses, np.zeros((3, 3)))
    nothing = build_map([])
    assert len(nothing.motors) == len(nothing.statuses) == len(nothing.line_map) == 0 and nothing.refused == {}


def test_odometry_that_jumps(stream: Stream, court: PoseGraphFile) -> None:
    """The odometry is 40 m and a radian elsewhere from the scan 25 on, where a counter was reset."""
    away = motors(np.array([40.0, -10.0, 1.0]))
    rows = [
        (scan, pose if k < 25 else poses_of(pga2.motor_product(away, motors(pose[None])))[0], time)
        for k, (scan, pose, time) in enumerate(stream[:50])
    ]
    found = build_map(rows)
    truth = motors(court.poses[:50])
    assert trajectory_error(found.poses[:, :2], court.poses[:50, :2]) < 0.3
    assert found.statuses[25] in (ScanStatus.ADDED, ScanStatus.ODOMETRY_JUMP)
    across, measured = (relative(each[15], each[35]) for each in (truth, found.motors))
    angle, shift = pga2.motor_to_angle_translation(relative(across, measured))
    assert np.hypot(*shift) < 0.2 and abs(angle) < np.radians(2)


def test_odometry_that_is_not_finite_counts_as_missing(stream: Stream, court: PoseGraphFile) -> None:
    rows = [(scan, pose if k % 7 else np.full(3, np.nan), time) for k, (scan, pose, time) in enumerate(stream[:30])]
    found = build_map(rows)
    assert found.refused == {}
    assert trajectory_error(found.poses[:, :2], court.poses[:30, :2]) < 0.3


def test_time_stamps_do_not_matter_much(stream: Stream) -> None:
    wanted = build_map(stream[:10]).poses
    for times in (np.zeros(10), np.r_[np.arange(5), np.arange(5)], np.arange(10) * 1e5):
        rows = [(scan, pose, float(time)) for (scan, pose, _), time in zip(stream, times, strict=False)]
        assert np.allclose(build_map(rows).poses, wanted, atol=1e-9), times


def test_robot_that_stands(stream: Stream) -> None:
    scan, pose, _ = stream[0]
    found = build_map([(scan, pose + 0.001 * k * np.eye(3)[0], None) for k in range(30)])
    assert found.added.tolist() == [0] and set(found.statuses[1:]) == {ScanStatus.STANDING}
    assert found.poses[-1, :2] == pytest.approx([0.029 * np.cos(pose[2]), -0.029 * np.sin(pose[2])], abs=1e-9)
    still = build_map([(scan, None, None) for _ in range(5)])
    assert still.added.tolist() == [0] and set(still.statuses[1:]) == {ScanStatus.STANDING}


def test_progress_is_reported(stream: Stream) -> None:
    seen: list[Progress] = []
    build_map(stream[:20], progress=seen.append)
    assert [each.n_scans for each in seen] == [*range(1, 21), 20, 20]
    assert [each.stage for each in seen[-3:]] == ["scans", "poses", "lines"]


@all_cases("item", [1, (1, 2), (np.zeros(3), None, None), "scan"])
def test_other_elements_are_errors(item: Any) -> None:
    with pytest.raises(TypeError, match="expected triples of a Scan"):
        build_map([item])


def test_forms_of_elements(stream: Stream) -> None:
    """Poses and motors, tuples and lists, and scans alone."""
    some = build_map(stream[:6])
    by_motors = build_map([[scan, motors(pose), time] for scan, pose, time in stream[:6]])
    assert np.allclose(by_motors.poses, some.poses, atol=1e-9)
    alone = build_map(scan for scan, _, _ in stream[:6])
    assert np.array_equal(alone.poses, build_map([(scan, None, None) for scan, _, _ in stream[:6]]).poses)
    with pytest.raises(ValueError, match=r"odometry: shape \(2,\)"):
        build_map([(stream[0][0], np.zeros(2), None)])


def test_log_that_is_cut(tmp_path: Path, stream: Stream) -> None:
    lines = []
    for scan, pose, time in stream[:15]:
        lines.append(f"ODOM {pose[0]:.4f} {pose[1]:.4f} {pose[2]:.5f} 0 0 0 {time} h {time}\n")
        lines.append(f"FLASER {len(scan)} {' '.join(f'{r:.2f}' for r in scan.ranges)} 0 0 0 0 0 0 {time} h {time}\n")
    path = tmp_path / "cut.log"
    path.write_text("".join(lines)[:-300])
    found = build_map(path)
    assert len(found.motors) == 14 and found.problems[0].line == 30
    assert np.allclose(found.poses, build_map(list(CarmenLog(path))).poses)
    assert np.allclose(found.poses[:, :2], build_map(stream[:14]).poses[:, :2], atol=0.02)


def house_log(n_people: int, n: int) -> SimulatedLog:
    """A robot that drives twice around in two rooms and the hall between them."""
    plan = load_floor_plan(DATA / "house.mat", 0.045, smallest=1.0)
    corners = np.array([[8.0, 4.4], [10.8, 4.6], [10.8, 7.0], [9.4, 9.3], [9.4, 13.0], [11.0, 15.0]])
    route = np.concatenate([corners, corners[-2:0:-1], corners, corners[-2::-1]])
    steps = np.hypot(*np.diff(route, axis=0).T)
    at = np.linspace(0, steps.sum(), n)
    length = np.concatenate([[0], np.cumsum(steps)])
    places = np.stack([np.interp(at, length, route[:, k]) for k in (0, 1)], 1)
    ahead = np.stack([np.interp(at + 0.4, length, route[:, k]) for k in (0, 1)], 1) - places
    ahead[-4:] = ahead[-5]
    heading = np.arctan2(ahead[:, 1], ahead[:, 0])
    noisy = Odometry(turn_per_turn=0.05, turn_per_metre=0.05, length_per_metre=0.05, least_turn=0.01, least_length=0.01)
    scanner = Scanner(noise=0.015, missing=0.02)
    poses = np.concatenate([places, heading[:, None]], 1)
    return simulate_log(plan, motors(poses), scanner, noisy, n_people=n_people, seed=5)


@pytest.mark.parametrize(("n_people", "n", "error"), some_slow([(0, 90, 0.05), (3, 90, 0.15)], (0, 90, 0.05)))
@pytest.mark.slow
def test_house(n_people: int, n: int, error: float) -> None:
    """A simulated house: errors far below those of odometry, also with people, and the walls where they are."""
    log = house_log(n_people, n)
    assert not log.status.any()
    odometry = poses_of(log.odometry)
    found = build_map((log.scan(k), odometry[k], log.times[k]) for k in range(len(log)))
    truth = poses_of(log.truth)
    assert trajectory_error(found.poses[:, :2], truth[:, :2]) < error
    assert trajectory_error(odometry[:, :2], truth[:, :2]) > 2 * error
    assert not list(same_wall(found.line_map)) and found.residual < 0.03


def circling(n: int) -> Iterator[tuple[Scan, Reals, float]]:
    """A robot with 40 beams that circles in a room of 10 m by 8 m, by 2 mm at each scan."""
    angles = np.linspace(-np.pi, np.pi, 40, endpoint=False)
    rng = np.random.default_rng(0)
    for k in range(n):
        turn = 0.001 * k
        pose = np.array([2 * np.sin(turn), -2 * np.cos(turn), turn])
        c, s = np.cos(angles + turn), np.sin(angles + turn)
        with np.errstate(divide="ignore"):
            x, y = (np.sign(c) * 5 - pose[0]) / c, (np.sign(s) * 4 - pose[1]) / s
        ranges = np.minimum(x, y) + 0.01 * rng.normal(size=40)
        yield Scan(ranges, -np.pi, np.pi / 20, 30.0), pose, 0.1 * k


def memory(n: int) -> int:
    """The bytes at the end, without those of the result of the numbers of scans."""
    tracemalloc.start()
    build_map(circling(n))
    found = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return found


@pytest.mark.slow
def test_memory_grows_by_a_constant_for_each_scan() -> None:
    memory(200)
    short, middle, long = (memory(n) for n in (300, 600, 900))
    assert long - middle < 1.3 * (middle - short) + 10_000
    assert (long - short) / 600 < 1500


@pytest.mark.slow
def test_ten_thousand_scans() -> None:
    found = build_map(circling(10_000))
    assert len(found.motors) == 10_000 and found.refused == {}
    truth = np.array([pose for _, pose, _ in circling(10_000)])
    assert trajectory_error(found.poses[:, :2], truth[:, :2]) < 0.03
    assert 4 <= len(found.line_map) <= 12 and not list(same_wall(found.line_map))
