"""Maps in crowds: people are no walls, and scans that do not show the motion leave it to odometry."""

from __future__ import annotations

import numpy as np
from laser_scenes import box, scan_at

from algorithms.arguments import Reals
from algorithms.mapping import Mapper, Scan, ScanStatus
from algorithms.mapping.free_space import sight_of
from algorithms.mapping.keyframes import IDENTITY, Keyframes
from algorithms.mapping.loops import _thinned
from algorithms.mapping.rivals import Rivals
from algorithms.mapping.surfaces import Reference, surface
from generated import pga2

ROOM = np.concatenate([box(0, 0, 9, 7), box(3, 2, 1.0, 0.6, 0.4), box(-2.5, -2, 0.8, 1.2, 0.2)])


def among_people(rng: np.random.Generator, scan: Scan, count: int) -> Scan:
    """The scan with round people 0.7 to 3 m away, who stand elsewhere in the next one."""
    seen = scan.ranges.copy()
    for _ in range(count):
        place, off = rng.uniform(0.7, 3.0), np.abs(scan.angles - rng.uniform(scan.angles[0], scan.angles[-1]))
        half = np.arcsin(0.25 / place)
        reach = place - np.sqrt(np.maximum(0.25**2 - (place * np.sin(np.minimum(off, half))) ** 2, 0))
        seen = np.where(off < half, np.minimum(seen, reach), seen)
    return Scan(seen, scan.angle_min, scan.angle_step, scan.max_range)


def test_people_leave_the_map_and_walls_stay() -> None:
    """Ten scans with six people each: errors stay within their bounds, and few points of people are left."""
    rng = np.random.default_rng(3)
    mapper = Mapper()
    odometry = IDENTITY
    for k in range(10):
        pose = np.array([-2 + 0.3 * k, 0.3, 0.0])
        if k:
            noise = 0.02 * rng.normal(size=3)
            step = pga2.motor_from_angle_translation(noise[0], np.array([0.3, 0.0]) + noise[1:])
            odometry = np.asarray(pga2.motor_product(odometry, step))
        found = mapper.add(among_people(rng, scan_at(rng, ROOM, pose), 6), odometry)
        angle, shift = pga2.motor_to_angle_translation(found.motor)
        error = np.array([angle, *(shift - [0.3 * k, 0.0])])
        assert found.status in (ScanStatus.ADDED, ScanStatus.BY_ODOMETRY)
        assert error @ np.linalg.pinv(found.covariance) @ error < 16.27 or not k  # chi-square, a thousandth
    path = mapper._path
    kept = np.concatenate([each.points for each in path.parts(np.arange(10), 0)])
    whole = np.concatenate([pga2.move_point(m, s.points) for m, s in zip(path.motors, path.surfaces, strict=True)])

    def off_walls(points: Reals) -> Reals:
        along, start = ROOM[:, 2:] - ROOM[:, :2], (points + np.array([-2, 0.3]))[:, None] - ROOM[:, :2]
        t = np.clip((start * along).sum(-1) / (along**2).sum(-1), 0, 1)
        return np.asarray(np.linalg.norm(start - t[..., None] * along, axis=-1).min(1) > 0.3)

    before, after = off_walls(whole), off_walls(kept)
    assert before.sum() > 40 and after.sum() < 0.5 * before.sum()
    assert (~after).sum() > 0.95 * (~before).sum()


def test_submaps_that_scans_see_through_are_compared_without_points() -> None:
    """A scan of a small room, and scans from its centre in a large one, which see through all of its walls."""
    rng = np.random.default_rng(6)
    path = Keyframes()
    for size in (4, 20, 20):
        scan = scan_at(rng, box(0, 0, size, size), np.zeros(3))
        path.add(surface(scan), IDENTITY, np.eye(3))
        path.look(sight_of(scan), 0)
    empty = path.parts(np.arange(1), 0)
    assert len(path.surfaces[0].points) > 100 and len(empty[0].points) == 0
    assert len(_thinned(empty).points) == 0


def test_looks_of_a_scan() -> None:
    """Points before walls are seen through, points on them are seen, and others say nothing."""
    sight = sight_of(Scan(np.full(91, 4.0), -np.pi / 4, np.pi / 180, 30.0))
    on, through = sight.looks(np.array([[4.0, 0.0], [2.0, 0.5], [6.0, 0.0], [-4.0, 0.0]]))
    assert on.tolist() == [True, False, False, False] and through.tolist() == [False, True, False, False]


def test_walls_that_a_scan_sees_through_contradict_a_motion() -> None:
    """The same room does not contradict; a room that is open where walls were seen does."""
    rng = np.random.default_rng(4)
    mapper = Mapper()
    for k in range(4):
        mapper.add(scan_at(rng, ROOM, np.array([0.2 * k, 0.0, 0.0])), [0.2 * k, 0.0, 0.0])
    step = pga2.motor_from_angle_translation(0.0, np.array([0.2, 0.0]))
    here, far = (scan_at(rng, walls, np.array([0.8, 0.0, 0.0])) for walls in (ROOM, box(0, 0, 20, 18)))
    assert not mapper._path.is_contradicted(sight_of(here), step, 0)
    assert mapper._path.is_contradicted(sight_of(far), step, 0)


def test_what_scans_do_not_show_is_left_to_odometry() -> None:
    """In a room all directions are sharp; along a corridor without ends the spread is that of odometry."""
    rng = np.random.default_rng(5)
    information = np.diag(np.array([0.05, 0.12, 0.12]) ** -2.0)
    spreads = []
    for walls in (ROOM, box(0, 0, 400, 2)):
        one, two = (surface(scan_at(rng, walls, np.array([x, 0.0, 0.0]))) for x in (0.0, 0.1))
        truth = pga2.motor_from_angle_translation(0.0, np.array([0.1, 0.0]))
        others = Rivals(Reference([one]), two, truth, information)
        mean, spread = others.around(truth)
        assert np.abs(np.subtract(mean, truth)).max() < 0.05
        spreads.append(np.sqrt(np.diag(spread)))
    assert spreads[0].max() < 0.04
    assert 0.06 < spreads[1][1] < 0.18 and spreads[1][[0, 2]].max() < 0.05
