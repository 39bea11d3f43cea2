"""Scenes of scans in halls, corridors and round rooms with faults of scanners, for the page of evidence."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from algorithms.mapping import Scan, match_scans, relocate
from generated import pga2

from .evidence_mapping import block, map_of, motor, ranges, right
from .evidence_scenes import Trial, row

_FAR = 30.0


class Building(NamedTuple):
    """Walls (k, 4) of a building, those of furniture (f, n, 4), and points inside of its outline."""

    walls: np.ndarray
    furniture: list[np.ndarray]
    corners: np.ndarray

    @property
    def all(self) -> np.ndarray:
        """All walls."""
        return np.concatenate([self.walls, *self.furniture])


class Sight(NamedTuple):
    """What a scanner does to the ranges of a scan, and the step between beams that it states, as a factor."""

    change: Callable[[np.ndarray, np.ndarray], np.ndarray]
    step: float


def closed(corners: np.ndarray) -> np.ndarray:
    """The walls of a polygon."""
    return np.hstack([corners, np.roll(corners, -1, 0)])


def _hall(rng: np.random.Generator) -> Building:
    """A hall of five to nine sides with hexagonal pillars and stalls."""
    angles = np.sort((np.arange(n := rng.integers(5, 10)) + rng.uniform(-0.3, 0.3, n)) * 2 * np.pi / n)
    corners = rng.uniform(0.8, 1.2, n)[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1) * rng.uniform(5, 12, 2)
    things = []
    for _ in range(rng.integers(3, 9)):
        place = corners[rng.integers(n)] * rng.uniform(0.2, 0.75)
        if rng.random() < 0.5:
            around = np.arange(6) * np.pi / 3
            things.append(closed(place + rng.uniform(0.15, 0.4) * np.stack([np.cos(around), np.sin(around)], 1)))
        else:
            width, depth = rng.uniform(0.4, 2.0, 2)
            things.append(block(place[0], place[1], width, depth, rng.uniform(0, 3)))
    return Building(closed(corners), things, corners)


def _corridor(rng: np.random.Generator, spacing: float = 0.0) -> Building:
    """A corridor with niches of doors and cupboards, which ends within sight; with a spacing, doors repeat."""
    length, half = (40.0, 1.2) if spacing else (rng.uniform(6, 16), rng.uniform(0.8, 1.8))
    sides = []
    depth, width, phase = rng.uniform(0.1, 0.3), rng.uniform(0.8, 1.1), rng.uniform(0, 1, 2)
    for side in range(2):
        points, x = [], phase[side] * max(spacing, 1.0) - (20.0 if spacing else 0.0)
        end = 20.0 if spacing else length
        while x + 1.2 < end:
            if not spacing:
                depth, width = rng.uniform(0.08, 0.4), rng.uniform(0.7, 1.2)
            points += [[x, half], [x, half + depth], [x + width, half + depth], [x + width, half]]
            x += spacing or width + rng.uniform(0.5, 4)
        start = -20.0 if spacing else 0.0
        sides.append(np.array([[start - 0.1, half], *points, [end, half]]))
    corners = np.concatenate([sides[0], (sides[1] * [1, -1])[::-1]])
    things = []
    for _ in range(0 if spacing else rng.integers(1, 4)):
        depth = rng.uniform(0.3, 0.5)
        things.append(block(rng.uniform(0.5, length - 0.5), rng.choice([-1, 1]) * (half - depth / 2), 0.8, depth))
    inside = np.array([[0.0, 0], [length, 0]]) - ([length / 2, 0] if spacing else [0.0, 0.0])
    return Building(closed(corners), things, inside)


def _round(rng: np.random.Generator) -> Building:
    """An oval room of 24 walls with two to six pieces of furniture."""
    around = np.arange(24) * np.pi / 12
    corners = rng.uniform(2, 7) * np.stack([np.cos(around), rng.uniform(1, 1.6) * np.sin(around)], 1)
    places = corners[rng.integers(24, size=rng.integers(2, 7))]
    spots = [(p * rng.uniform(0.3, 0.9), rng.uniform(0.3, 1.5, 2), rng.uniform(0, 3)) for p in places]
    things = [block(x, y, width, depth, angle) for (x, y), (width, depth), angle in spots]
    return Building(closed(corners), things, corners)


def any_building(rng: np.random.Generator) -> Building:
    return (_hall, _corridor, _round)[rng.integers(3)](rng)


def is_free(walls: np.ndarray, places: np.ndarray, least: float = 0.3) -> bool:
    """Whether places are at least a length from all walls, and on the same side of them."""
    along, off = walls[:, 2:] - walls[:, :2], places[:, None] - walls[:, :2]
    t = np.clip((off * along).sum(-1) / (along**2).sum(-1), 0, 1)
    return bool(np.linalg.norm(off - t[..., None] * along, axis=-1).min() > least)


def any_pose(rng: np.random.Generator, building: Building) -> np.ndarray:
    """A pose inside of a building and outside of its furniture."""
    while True:
        parts = rng.dirichlet(np.ones(len(building.corners)))
        place = parts @ building.corners + rng.uniform(-0.5, 0.5, 2)
        if not is_free(building.all, place[None]):
            continue
        if not any(_inside(each, place) for each in building.furniture) and _inside(building.walls, place):
            return np.array([*place, rng.uniform(-np.pi, np.pi)])


def _inside(walls: np.ndarray, place: np.ndarray) -> bool:
    """Whether a place is inside of a closed polygon, by the number of walls to the right of it."""
    x, y = place
    crosses = (walls[:, 1] > y) != (walls[:, 3] > y)
    rise = np.where(crosses, walls[:, 3] - walls[:, 1], 1.0)
    at = walls[:, 0] + (y - walls[:, 1]) / rise * (walls[:, 2] - walls[:, 0])
    return bool((crosses & (at > x)).sum() % 2)


def _moved(rng: np.random.Generator, building: Building, pose: np.ndarray, most: float, turn: float) -> np.ndarray:
    """A pose up to a length and an angle away, with a clear way to it."""
    for _ in range(50):
        heading, length = rng.uniform(-np.pi, np.pi), rng.uniform(0.1, most)
        step = [length * np.cos(heading), length * np.sin(heading), rng.uniform(-turn, turn)]
        found = np.asarray(pose + np.array(step))
        if is_free(building.all, pose[:2] + np.linspace(0, 1, 5)[:, None] * (found - pose)[:2]):
            return found
    return np.asarray(pose + np.array([0, 0, rng.uniform(-turn, turn)]))


def any_beams(rng: np.random.Generator) -> np.ndarray:
    span = rng.choice([np.pi, 1.5 * np.pi, 2 * np.pi - np.pi / 180])
    return np.asarray(np.linspace(-span / 2, span / 2, int(rng.choice([181, 361, 541]))))


def exact(rng: np.random.Generator) -> Sight:
    return Sight(lambda measured, angles: measured, 1.0)


def _tilted(rng: np.random.Generator) -> Sight:
    """A scanner that is tilted about an axis, and sees the floor."""
    tilt, about, height = np.radians(rng.uniform(3, 15)), rng.uniform(-np.pi, np.pi), rng.uniform(0.2, 1.2)

    def change(measured: np.ndarray, angles: np.ndarray) -> np.ndarray:
        down = np.sin(tilt) * np.cos(angles - about)
        with np.errstate(divide="ignore"):
            floor = np.where(down > 0, height / np.maximum(down, 1e-12), np.inf)
        return np.asarray(np.minimum(measured / np.sqrt(1 - down**2), floor))

    return Sight(change, 1.0)


def offset(rng: np.random.Generator) -> Sight:
    by = rng.choice([-1, 1]) * rng.uniform(0.05, 0.3)
    return Sight(lambda measured, angles: np.asarray(np.maximum(measured + by, 0.02)), 1.0)


def _scaled(rng: np.random.Generator) -> Sight:
    by = 1 + rng.choice([-1, 1]) * rng.uniform(0.03, 0.2)
    return Sight(lambda measured, angles: by * measured, 1.0)


def stepped(rng: np.random.Generator) -> Sight:
    return Sight(lambda measured, angles: measured, 1 - rng.uniform(0.02, 0.15))


def _glass(rng: np.random.Generator) -> Sight:
    """Sectors in which nothing is measured, or what is far behind the pane."""

    def change(measured: np.ndarray, angles: np.ndarray) -> np.ndarray:
        measured = measured.copy()
        for _ in range(rng.integers(1, 5)):
            hit = np.abs(angles - rng.uniform(angles[0], angles[-1])) < rng.uniform(0.1, 0.5)
            measured[hit] = np.inf if rng.random() < 0.5 else measured[hit] + rng.uniform(1, 8)
        return measured

    return Sight(change, 1.0)


def crowded(rng: np.random.Generator) -> Sight:
    """People before a fifth to seven tenths of the beams."""
    share = rng.uniform(0.2, 0.7)

    def change(measured: np.ndarray, angles: np.ndarray) -> np.ndarray:
        seen = measured.copy()
        for _ in range(200):
            if (seen < measured - 0.01).mean() > share:
                break
            place = rng.uniform(0.4, 4.0)
            off = np.abs(angles - rng.uniform(angles[0], angles[-1]))
            half = np.arcsin(min(0.25 / place, 1.0))
            reach = place - np.sqrt(np.maximum(0.25**2 - (place * np.sin(np.minimum(off, half))) ** 2, 0))
            seen = np.where(off < half, np.minimum(seen, reach), seen)
        return seen

    return Sight(change, 1.0)


def scan_of(rng: np.random.Generator, walls: np.ndarray, pose: np.ndarray, beams: np.ndarray, sight: Sight) -> Scan:
    measured = sight.change(ranges(walls, pose, beams), beams) + 0.01 * rng.normal(size=len(beams))
    measured = np.where(measured < _FAR, measured, _FAR)
    return Scan(measured, sight.step * beams[0], sight.step * (beams[1] - beams[0]), _FAR)


def motion_of(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(pga2.motor_product(pga2.motor_inverse(motor(a)), motor(b)))


def _matched(
    rng: np.random.Generator, sight: Sight, later: Sight | None = None, *, turn: float = 0.5, is_moved: bool = False
) -> Trial:
    """Two scans of a building by a scanner, the second one perhaps by another one, or with other furniture."""
    building, beams = any_building(rng), any_beams(rng)
    a = any_pose(rng, building)
    b = _moved(rng, building, a, 0.8, turn)
    then = _rearranged(rng, building) if is_moved else building
    one = scan_of(rng, building.all, a, beams, sight)
    two = scan_of(rng, then.all, b, beams, later or sight)
    found = match_scans(one, two)
    return Trial(found.status == 0, right(found, motion_of(a, b)))


def _rearranged(rng: np.random.Generator, building: Building) -> Building:
    """The building with furniture moved by 0.1 to 1.5 m: each piece on its own, or all of them alike."""
    together = rng.random() < 0.5
    shift = rng.uniform(0.1, 1.5) * np.array([np.cos(a := rng.uniform(0, 7)), np.sin(a)])
    moved = []
    for each in building.furniture:
        own = shift if together else rng.uniform(-1, 1, 2)
        moved.append(each + np.tile(own, 2))
    return building._replace(furniture=moved)


@row("`match_scans`", "halls, corridors and oval rooms, up to 0.8 m and 29 degrees apart", good=True)
def scans_of_buildings(rng: np.random.Generator) -> Trial:
    return _matched(rng, exact(rng))


@row("`match_scans`", "the same, furniture moved by 0.1 to 1.5 m between the scans")
def scans_of_moved_furniture(rng: np.random.Generator) -> Trial:
    return _matched(rng, exact(rng), is_moved=True)


@row("`match_scans`", "the same, one to four sectors of glass without echo, or through which more is seen")
def scans_through_glass(rng: np.random.Generator) -> Trial:
    return _matched(rng, _glass(rng))


@row("`match_scans`", "the same, a scanner tilted by 3 to 15 degrees, which sees the floor")
def scans_tilted(rng: np.random.Generator) -> Trial:
    return _matched(rng, _tilted(rng))


@row("`match_scans`", "the same, ranges off by 5 to 30 cm")
def scans_offset(rng: np.random.Generator) -> Trial:
    return _matched(rng, offset(rng))


@row("`match_scans`", "the same, ranges wrong by 3 to 20 %")
def scans_scaled(rng: np.random.Generator) -> Trial:
    return _matched(rng, _scaled(rng))


@row("`match_scans`", "the same, a step between beams that is stated 2 to 15 % too small, turned by up to 60 degrees")
def scans_stepped(rng: np.random.Generator) -> Trial:
    return _matched(rng, stepped(rng), turn=1.0)


@row("`match_scans`", "the same, people before a fifth to seven tenths of the beams")
def scans_of_crowds(rng: np.random.Generator) -> Trial:
    return _matched(rng, crowded(rng))


@row("`match_scans`", "corridors in which doors of both sides repeat after 2 to 5 m, and no end is seen")
def scans_of_repeated_doors(rng: np.random.Generator) -> Trial:
    building, beams = _corridor(rng, rng.uniform(2, 5)), any_beams(rng)
    a = np.array([rng.uniform(-3, 3), rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5)])
    b = a + rng.uniform([-2, -0.2, -0.4], [2, 0.2, 0.4])
    b[1] = np.clip(b[1], -0.7, 0.7)
    one, two = (scan_of(rng, building.all, pose, beams, _cut(12.0)) for pose in (a, b))
    found = match_scans(one, two)
    return Trial(found.status == 0, right(found, motion_of(a, b)))


def _cut(limit: float) -> Sight:
    return Sight(lambda measured, angles: np.where(measured < limit, measured, np.inf), 1.0)


def _campus(rng: np.random.Generator) -> tuple[list[Building], np.ndarray]:
    """Two to five buildings, moved apart and turned, and the walls of all."""
    found = []
    for k in range(rng.integers(2, 6)):
        building, angle = any_building(rng), rng.choice([0, rng.uniform(-np.pi, np.pi)])
        c, s = np.cos(angle), np.sin(angle)
        turn, shift = np.array([[c, s], [-s, c]]), np.array([40.0 * k, 0])

        def place(points: np.ndarray, turn: np.ndarray = turn, shift: np.ndarray = shift) -> np.ndarray:
            return np.asarray((points.reshape(-1, 2) @ turn + shift).reshape(points.shape))

        found.append(Building(place(building.walls), [place(e) for e in building.furniture], place(building.corners)))
    return found, np.concatenate([each.all for each in found])


def _located(rng: np.random.Generator, sight: Sight, *, is_moved: bool = False) -> Trial:
    """A scan in a map of several buildings."""
    buildings, walls = _campus(rng)
    home = buildings[rng.integers(len(buildings))]
    now = _rearranged(rng, home) if is_moved else home
    pose, beams = any_pose(rng, now), any_beams(rng)
    found = relocate(scan_of(rng, now.all, pose, beams, sight), map_of(walls))
    return Trial(found.status == 0, right(found, motor(pose)))


@row("`relocate`", "maps of two to five halls, corridors and oval rooms", good=True, slow=True)
def places_in_buildings(rng: np.random.Generator) -> Trial:
    return _located(rng, exact(rng))


@row("`relocate`", "the same, furniture moved by 0.1 to 1.5 m", slow=True)
def places_with_moved_furniture(rng: np.random.Generator) -> Trial:
    return _located(rng, exact(rng), is_moved=True)


@row("`relocate`", "the same, one to four sectors of glass", slow=True)
def places_with_glass(rng: np.random.Generator) -> Trial:
    return _located(rng, _glass(rng))


@row("`relocate`", "the same, a scanner tilted by 3 to 15 degrees, which sees the floor", slow=True)
def places_tilted(rng: np.random.Generator) -> Trial:
    return _located(rng, _tilted(rng))


@row("`relocate`", "the same, ranges off by 5 to 30 cm, or by 3 to 20 %", slow=True)
def places_offset(rng: np.random.Generator) -> Trial:
    return _located(rng, offset(rng) if rng.random() < 0.5 else _scaled(rng))


@row("`relocate`", "the same, a step between beams that is stated 2 to 15 % too small", slow=True)
def places_stepped(rng: np.random.Generator) -> Trial:
    return _located(rng, stepped(rng))


@row("`relocate`", "the same, people before a fifth to seven tenths of the beams", slow=True)
def places_in_crowds(rng: np.random.Generator) -> Trial:
    return _located(rng, crowded(rng))
