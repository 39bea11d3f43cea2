"""Matching of scans without a prior: simulated rooms, a real log, covariances, corridors and bad input."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from laser_scenes import box, motion, pair, ranges, room, scan_at

from algorithms.arguments import Reals
from algorithms.mapping import MappingStatus, Match, Scan, match_scans
from algorithms.mapping.g2o import read_g2o
from algorithms.mapping.outlines import in_fours
from generated import mapping as kernels
from generated import pga2
from tests.support.all_cases import all_cases

KILLIAN = Path(__file__).parents[1] / "data" / "maps" / "killian_start.g2o.gz"


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7)


def errors(found: Match, truth: Reals) -> tuple[float, float]:
    """Metres and degrees."""
    angle, shift = pga2.motor_to_angle_translation(found.motor)
    turn = (angle - truth[2] + np.pi) % (2 * np.pi) - np.pi
    return float(np.linalg.norm(shift - truth[:2])), float(np.degrees(abs(turn)))


@pytest.mark.parametrize("n", [180, 181, 360, 361])
def test_rooms_with_boxes(rng: np.random.Generator, n: int) -> None:
    """Motions of about a metre and 16 degrees are found without a prior."""
    found = []
    for _ in range(8):
        walls = room(rng, 12)
        a, b = pair(rng, walls)
        m = match_scans(scan_at(rng, walls, a, n=n), scan_at(rng, walls, b, n=n))
        found.append((*errors(m, motion(a, b)), m.status))
    good = [shift < 0.1 and turn < 1 for shift, turn, _ in found]
    assert sum(good) >= 7
    assert all(ok for ok, (_, _, status) in zip(good, found, strict=True) if status is MappingStatus.OK)


def test_people(rng: np.random.Generator) -> None:
    """With a quarter of the beams on people, most motions are still found, and few of those called OK are wrong."""
    good, certain, wrong = 0, 0, 0
    for _ in range(20):
        walls = room(rng, 10)
        a, b = pair(rng, walls)
        m = match_scans(scan_at(rng, walls, a, people=0.25), scan_at(rng, walls, b, people=0.25))
        shift, turn = errors(m, motion(a, b))
        close = shift < 0.2 and turn < 2
        good += close
        certain += m.status is MappingStatus.OK
        wrong += m.status is MappingStatus.OK and not close
    assert good >= 17 and certain >= 10 and wrong <= 1


def test_real_scans() -> None:
    """Of consecutive scans of Killian Court, at least 93 % are matched, with the errors of the graph itself."""
    graph = read_g2o(KILLIAN)
    scans = [reading.scan for reading in graph.readings]
    chosen = [k for k, (i, j) in enumerate(graph.edges) if j == i + 1][::12]
    found = []
    for k in chosen:
        i, j = graph.edges[k]
        m = match_scans(scans[i], scans[j])
        found.append((*errors(m, graph.motions[k]), m.status is MappingStatus.OK))
    table = np.array(found)
    good = (table[:, 0] < 0.2) & (table[:, 1] < 2)
    assert good.mean() >= 0.93
    assert np.median(table[:, 0]) <= 0.045 and np.median(table[:, 1]) <= 0.45
    assert (~good & (table[:, 2] > 0)).sum() <= 0.02 * len(good)


def test_signs_and_inverses(rng: np.random.Generator) -> None:
    """Exchanged scans have the inverse motion, and a scan matches itself with the identity."""
    walls = room(rng, 12)
    a, b = pair(rng, walls)
    one, two = scan_at(rng, walls, a), scan_at(rng, walls, b)
    forth, back = match_scans(one, two), match_scans(two, one)
    angle, shift = pga2.motor_to_angle_translation(pga2.motor_product(forth.motor, back.motor))
    assert abs(angle) < 0.01 and np.linalg.norm(shift) < 0.03
    itself = match_scans(one, one)
    assert np.abs(np.abs(itself.motor) - [1, 0, 0, 0]).max() < 1e-3 and itself.score > 0.95


def test_a_guess_of_either_sign(rng: np.random.Generator) -> None:
    walls = room(rng, 12)
    a, b = pair(rng, walls)
    one, two = scan_at(rng, walls, a), scan_at(rng, walls, b)
    truth = motion(a, b)
    guess = pga2.motor_from_angle_translation(truth[2] + 0.05, truth[:2] + 0.1)
    for sign in (1, -1):
        assert errors(match_scans(one, two, sign * guess), truth)[0] < 0.05
    with pytest.raises(ValueError, match="guess"):
        match_scans(one, two, np.zeros(4))


def test_covariances_are_of_the_size_of_errors(rng: np.random.Generator) -> None:
    walls = room(rng, 12)
    a, b = pair(rng, walls)
    truth = motion(a, b)
    right = pga2.motor_from_angle_translation(truth[2], truth[:2])
    normalized = []
    for _ in range(15):
        m = match_scans(scan_at(rng, walls, a), scan_at(rng, walls, b))
        angle, shift = pga2.motor_to_angle_translation(pga2.motor_product(m.motor, pga2.motor_inverse(right)))
        x = np.array([*shift, angle])
        normalized.append(x @ np.linalg.solve(m.covariance, x))
    # The covariance is not below that of errors by more than a factor of 2, nor far above it.
    assert 0.05 < np.median(normalized) < 6


def test_corridors_are_degenerate(rng: np.random.Generator) -> None:
    """Between two endless walls, everything but the translation along them is found, and the status is not OK."""
    walls = np.array([[-500.0, 1, 500, 1], [-500.0, -1, 500, -1]])
    a, b = np.array([0.0, 0.2, 0.1]), np.array([0.8, 0.1, -0.1])
    m = match_scans(scan_at(rng, walls, a), scan_at(rng, walls, b))
    assert m.status in (MappingStatus.DEGENERATE, MappingStatus.AMBIGUOUS) and len(m.degenerate)
    angle, shift = pga2.motor_to_angle_translation(m.motor)
    c, s = np.cos(a[2]), np.sin(a[2])
    assert abs(angle + 0.2) < 0.02 and abs(s * shift[0] + c * shift[1] + 0.1) < 0.05
    direction = m.degenerate[0][:2] / np.linalg.norm(m.degenerate[0][:2])
    assert abs(direction @ [c, -s]) > 0.98


def test_repeated_doors_are_ambiguous(rng: np.random.Generator) -> None:
    """Doors of both sides repeat after 2.5 m, and no end is seen: a guess decides, and nothing else."""
    steps = np.arange(-20, 20, 2.5)[:, None] + [0, 0, 0.9, 0.9]
    side = np.stack([steps.ravel(), np.tile([1.2, 1.45, 1.45, 1.2], len(steps))], 1)
    upper = np.hstack([side[:-1], side[1:]])
    walls = np.concatenate([upper, upper * [1, -1, 1, -1]])
    beams = np.linspace(-3.1, 3.1, 541)
    statuses, guessed = [], []
    for _ in range(10):
        a = np.array([rng.uniform(-3, 3), rng.uniform(-0.4, 0.4), rng.uniform(-0.3, 0.3)])
        b = a + rng.uniform([0.3, -0.1, -0.3], [2.2, 0.1, 0.3])
        one, two = (
            Scan(np.where(seen < 12, seen + 0.01 * rng.normal(size=541), np.inf), beams[0], beams[1] - beams[0], 30.0)
            for seen in (ranges(walls, pose, beams) for pose in (a, b))
        )
        truth = motion(a, b)
        statuses.append(match_scans(one, two).status)
        with_guess = match_scans(one, two, pga2.motor_from_angle_translation(truth[2] + 0.02, truth[:2] + 0.05))
        guessed.append(with_guess.status)
        assert errors(with_guess, truth)[0] < 0.1
    assert MappingStatus.OK not in statuses and statuses.count(MappingStatus.AMBIGUOUS) >= 5
    assert guessed.count(MappingStatus.OK) >= 8


def test_a_single_wall(rng: np.random.Generator) -> None:
    walls = np.array([[-500.0, 2, 500, 2]])
    one, two = (scan_at(rng, walls, np.array([x, 0.0, 1.5])) for x in (0.0, 0.7))
    assert match_scans(one, two).status is not MappingStatus.OK


def test_mirrored_beams_do_not_match(rng: np.random.Generator) -> None:
    """Few scans with beams in the wrong order have a motion that is called OK: walls alone may be symmetric."""
    certain = 0
    for _ in range(20):
        walls = room(rng, 12)
        a, b = pair(rng, walls)
        one, two = scan_at(rng, walls, a), scan_at(rng, walls, b)
        mirrored = Scan(two.ranges[::-1], two.angle_min, two.angle_step, two.max_range)
        certain += match_scans(one, mirrored).status is MappingStatus.OK
    assert certain <= 5


@all_cases("ranges", [[], [60.0] * 181, [np.nan] * 181, [1.0] * 9])
def test_too_few_readings(rng: np.random.Generator, ranges: list[float]) -> None:
    empty, other = Scan(ranges, -1, 0.01, 50), scan_at(rng, box(0, 0, 8, 6), np.zeros(3))
    for m in (match_scans(empty, other), match_scans(other, empty), match_scans(empty, empty)):
        assert m.status is MappingStatus.TOO_FEW_READINGS and np.isinf(np.diag(m.covariance)).all()


def test_random_readings_are_not_matched(rng: np.random.Generator) -> None:
    for _ in range(10):
        one, two = (Scan(rng.uniform(0.5, 10, 181), -np.pi / 2, np.pi / 180, 50) for _ in range(2))
        assert match_scans(one, two).status is not MappingStatus.OK


def test_points_at_one_place() -> None:
    scan = Scan([1e-9] * 50, 0, 1e-9, 50)
    assert match_scans(scan, scan).status is not MappingStatus.OK


def test_a_step_solves_the_linear_problem(rng: np.random.Generator) -> None:
    """For small motions and all weights 1, one step agrees with numpy's least squares on the same lines."""
    points, angles = rng.normal(size=(30, 2)), rng.uniform(-np.pi, np.pi, 30)
    normals = np.stack([np.cos(angles), np.sin(angles)], 1)
    small = np.array([1e-4, -2e-4, 1e-4])
    targets = pga2.move_point(pga2.motor_from_angle_translation(small[2], small[:2]), points)
    one = np.array([1.0, 0, 0, 0])
    moved = np.column_stack([points, normals, np.zeros(30), np.ones(30)])
    there = np.column_stack([targets, normals, np.zeros(30), np.ones(30)])
    row, none = np.arange(30.0), (np.zeros((0, 6)), np.zeros(0), np.zeros(0))
    motor, _, _ = kernels.step_between(one, moved, np.zeros(30), row, there, *none, 1e3, 1.0)
    rows = np.column_stack([normals, normals[:, 1] * points[:, 0] - normals[:, 0] * points[:, 1]])
    x = np.linalg.lstsq(rows, ((targets - points) * normals).sum(1))[0]
    angle, shift = pga2.motor_to_angle_translation(motor)
    assert np.abs(np.array([*shift, angle]) - x).max() < 1e-8


def test_a_step_for_targets_of_the_other_scan(rng: np.random.Generator) -> None:
    """Lines of moved points, without the points: a step from a wrong motor agrees with least squares in the map."""
    points, angles = rng.normal(size=(30, 2)), rng.uniform(-np.pi, np.pi, 30)
    normals = np.stack([np.cos(angles), np.sin(angles)], 1)
    motor = pga2.motor_from_angle_translation(0.7, np.array([0.3, -0.2]))
    off = 1e-4 * rng.normal(size=30)
    others = pga2.move_point(motor, points + off[:, None] * normals)
    moved = np.column_stack([points, normals, np.zeros(30), np.ones(30)])
    there = np.column_stack([others, np.zeros((30, 2)), np.zeros(30), np.ones(30)])
    far, row = np.ones(30), np.arange(30.0)
    found, triangle, sums = kernels.step_between(motor, moved, far, row, there, there, np.zeros(30), row, 1e3, 0.5)
    turned, at = pga2.move_direction(motor, normals), pga2.move_point(motor, points)
    rows = np.column_stack([turned, turned[:, 1] * at[:, 0] - turned[:, 0] * at[:, 1]])
    x = np.linalg.lstsq(rows, ((others - at) * turned).sum(1))[0]
    angle, shift = pga2.motor_to_angle_translation(pga2.motor_product(found, pga2.motor_inverse(motor)))
    assert np.abs(np.array([*shift, angle]) - x).max() < 1e-8
    assert np.allclose(triangle, (rows.T @ rows)[np.triu_indices(3)]) and np.isclose(sums[1], off @ off)


@pytest.mark.parametrize("step", [np.pi / 90, -np.pi / 90])
def test_scores_of_points(rng: np.random.Generator, step: float) -> None:
    """Points on targets, in free space, behind what is seen, at angles without beams, and on continued lines."""
    scan = Scan(np.full(91, 4.0), -np.pi / 2 * np.sign(step), step, 30.0)
    points = np.array([[4.05, 0], [2, 0], [6, 0], [-3.0, 1], [6, -5], [3.9, 0]])
    targets = np.array([[4.0, 0, 1, 0, 1]])
    lines = np.array([[4.0, -5, 0, 1, 0]])
    squares = kernels.nearest_square(points, in_fours(targets))
    assert np.array_equal(squares, kernels.nearest(points, targets)[0])
    distances, angles = kernels.distance_and_angle(points)
    found = [
        kernels.sum_of_scores(
            *(each[k : k + 1] for each in (points, squares, distances, angles)),
            scan.ranges, lines, scan.angle_min, scan.angle_step, 0.1,
        )
        for k in range(len(points))
    ]  # fmt: skip
    assert np.allclose(found, [0.75, -0.5, 0.3, 0.3, 0.95, 0], atol=1e-12)


def test_votes_are_meets_of_constraints(rng: np.random.Generator) -> None:
    """Lines moved by a known motion give constraints that meet in its translation."""
    shift = np.array([3.0, -2.0])
    for _ in range(20):
        angles = rng.uniform(-np.pi, np.pi, 2)
        rows = [[np.cos(t), np.sin(t), -np.array([np.cos(t), np.sin(t)]) @ shift, -99, 99, 2.0] for t in angles]
        vote, weight = kernels.translation_votes(*rows)
        sine = abs(np.sin(angles[1] - angles[0]))
        if sine > 0.1:
            assert np.abs(vote - shift).max() < 1e-12 and abs(weight - 4 * sine) < 1e-12
        rows[0][4] = shift[0] * rows[0][1] - shift[1] * rows[0][0] - 1e-3
        assert kernels.translation_votes(*rows)[1] == 0


@pytest.mark.parametrize("turn", [0.3, 1.2])
def test_the_turn_in_a_round_room_is_not_determined(rng: np.random.Generator, turn: float) -> None:
    """The turn about the centre is named, and its deviation is that of the unknown; the position is not."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, 181)
    scans = [Scan(3.1 + 0.01 * rng.normal(size=181), angles[0], angles[1] - angles[0], 30.0) for _ in range(2)]
    m = match_scans(*scans)
    assert m.status in (MappingStatus.DEGENERATE, MappingStatus.AMBIGUOUS)
    assert np.abs(m.degenerate[-1] - [0, 0, 1]).max() < 0.05
    assert m.covariance[2, 2] > np.pi**2 and np.sqrt(m.covariance[0, 0] + m.covariance[1, 1]) < 1


@pytest.mark.parametrize("noise", [0.0, 1e-4, 1e-3])
def test_the_chords_of_a_round_room_do_not_determine_the_turn(rng: np.random.Generator, noise: float) -> None:
    """Seen all round by a precise scanner, only the chords between readings distinguish turns."""
    for _ in range(4):
        scans = [Scan(3 + noise * rng.normal(size=181), -np.pi, 2 * np.pi / 181, 30.0) for _ in range(2)]
        m = match_scans(*scans)
        assert m.status in (MappingStatus.DEGENERATE, MappingStatus.AMBIGUOUS) and m.covariance[2, 2] > np.pi**2


def test_a_niche_in_a_round_room(rng: np.random.Generator) -> None:
    """Normals of the chords of a round wall outweigh those of a niche: the turn is right, or not called OK."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, 181)
    for turn in (0.1, 0.2, 0.3, 0.4):
        scans = []
        for heading in (0.0, turn):
            ranges = 3.1 + 0.01 * rng.normal(size=181)
            ranges[np.abs(angles + heading - 0.2) < 0.12] += 0.4
            scans.append(Scan(ranges, angles[0], angles[1] - angles[0], 30.0))
        m = match_scans(*scans)
        assert m.status is not MappingStatus.OK or errors(m, np.array([0, 0, turn]))[1] < 2


def test_the_covariance_of_a_corridor(rng: np.random.Generator) -> None:
    """Along a corridor the deviation is that of the unknown, and across it that of readings."""
    walls = np.array([[-500.0, 1, 500, 1], [-500.0, -1, 500, -1]])
    m = match_scans(*(scan_at(rng, walls, np.array([x, 0.1, 0.0])) for x in (0.0, 0.6)))
    assert m.status is not MappingStatus.OK
    assert m.covariance[0, 0] > 25**2 and m.covariance[1, 1] < 0.1**2


def test_a_huge_range_is_a_reading_as_others(rng: np.random.Generator) -> None:
    """Without a maximal range, one beam of 1e200 m neither warns nor changes the match."""
    walls = room(rng, 12)
    a, b = pair(rng, walls)
    scans = []
    for pose in (a, b):
        ranges = np.array(scan_at(rng, walls, pose).ranges)
        ranges[90] = 1e200
        scans.append(Scan(ranges, -np.pi / 2, np.pi / 180, np.inf))
    shift, turn = errors(match_scans(*scans), motion(a, b))
    assert shift < 0.1 and turn < 1
