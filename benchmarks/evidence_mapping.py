"""Scenes of laser scans, of places in maps and of graphs of poses for the page of evidence."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from algorithms.mapping import Match, Relocation, Relocator, Scan, match_scans, optimise_poses, relocate
from generated import pga2

from .evidence_scenes import BOUND, Trial, row

_FAR = 30.0


class _Walls(NamedTuple):
    """Exact walls as a map of lines that are seen from both sides."""

    normals: np.ndarray
    offsets: np.ndarray
    ends: np.ndarray


def map_of(walls: np.ndarray) -> _Walls:
    along = walls[:, 2:] - walls[:, :2]
    normals = np.stack([-along[:, 1], along[:, 0]], 1) / np.linalg.norm(along, axis=1)[:, None]
    both = np.concatenate([normals, -normals])
    ends = np.tile(walls.reshape(-1, 2, 2), (2, 1, 1))
    return _Walls(both, np.einsum("ij,ij->i", both, ends[:, 0]), ends)


def block(x: float, y: float, width: float, depth: float, angle: float = 0.0) -> np.ndarray:
    """The four walls of a turned rectangle."""
    corners = np.array([[-width, -depth], [width, -depth], [width, depth], [-width, depth]]) / 2
    c, s = np.cos(angle), np.sin(angle)
    corners = corners @ np.array([[c, s], [-s, c]]) + [x, y]
    return np.hstack([corners, np.roll(corners, -1, 0)])


def _flat(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Walls of 10 to 16 rooms of 2.5 to 6 m, divided again and again, with doors and furniture; corners of rooms."""
    rooms = [np.array([0.0, 0.0, rng.uniform(14, 20), rng.uniform(10, 14)])]
    walls = [block(*(rooms[0][:2] + rooms[0][2:]) / 2, *(rooms[0][2:] - rooms[0][:2]))]
    while len(rooms) < 16:
        sizes = np.array([(room[2:] - room[:2]).max() for room in rooms])
        k = int(np.argmax(sizes))
        if sizes[k] < 5:
            break
        low, high = rooms[k][:2], rooms[k][2:]
        axis = int(np.argmax(high - low))
        at = rng.uniform(low[axis] + 2.2, high[axis] - 2.2)
        one, two = rooms[k].copy(), rooms[k].copy()
        one[2 + axis] = two[axis] = at
        door, start, end = rng.uniform(0.8, 1.1), low[1 - axis], high[1 - axis]
        gap = rng.uniform(start + 0.2, end - 0.2 - door)
        for a, b in ((start, gap), (gap + door, end)):
            centre = [at, (a + b) / 2]
            size = [0.12, b - a]
            walls.append(block(*centre[:: 1 - 2 * axis], *size[:: 1 - 2 * axis]))
        rooms[k : k + 1] = [one, two]
    for room in rooms:
        for _ in range(rng.integers(1, 4)):
            place = rng.uniform(room[:2] + 0.4, room[2:] - 0.4)
            walls.append(block(*place, *rng.uniform(0.3, 1.5, 2), rng.choice([0, 0, rng.uniform(0, 3)])))
    return np.concatenate(walls), np.array(rooms)


def ranges(walls: np.ndarray, pose: np.ndarray, angles: np.ndarray) -> np.ndarray:
    d = np.stack([np.cos(pose[2] + angles), np.sin(pose[2] + angles)], 1)
    along, start = walls[:, 2:] - walls[:, :2], walls[:, :2] - pose[:2]
    with np.errstate(divide="ignore", invalid="ignore"):
        area = d[:, :1] * along[:, 1] - d[:, 1:] * along[:, 0]
        t = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / area
        s = (start[:, 0] * d[:, 1:] - start[:, 1] * d[:, :1]) / area
    return np.asarray(np.where((t > 0) & (s >= 0) & (s <= 1), t, np.inf).min(1))


def _clear(walls: np.ndarray, places: np.ndarray) -> float:
    along = walls[:, 2:] - walls[:, :2]
    off = places[:, None] - walls[:, :2]
    t = np.clip((off * along).sum(-1) / (along**2).sum(-1), 0, 1)
    return float(np.linalg.norm(off - t[..., None] * along, axis=-1).min())


def _scan(
    rng: np.random.Generator, measured: np.ndarray, angles: np.ndarray, people: int = 0, noise: float = 0.01
) -> Scan:
    """A scan with noise, and people in front of some beams."""
    measured = measured.copy()
    for _ in range(people):
        distance = rng.uniform(0.6, 3.0)
        hit = np.abs(angles - rng.uniform(angles[0], angles[-1])) < np.arctan(0.2 / distance)
        measured[hit] = np.minimum(measured[hit], distance)
    measured = np.minimum(measured + noise * rng.normal(size=len(angles)), _FAR)
    return Scan(measured, angles[0], angles[1] - angles[0], _FAR)


def _beams(rng: np.random.Generator) -> np.ndarray:
    """Beams over half a turn, three quarters, or almost a turn."""
    span = rng.choice([np.pi, 1.5 * np.pi, 2 * np.pi - np.pi / 180])
    return np.asarray(np.linspace(-span / 2, span / 2, int(rng.choice([181, 361]))))


def _place(rng: np.random.Generator, walls: np.ndarray, rooms: np.ndarray) -> np.ndarray:
    while True:
        room = rooms[rng.integers(len(rooms))]
        place = rng.uniform(room[:2] + 0.4, room[2:] - 0.4)
        if _clear(walls, place[None]) > 0.3:
            return np.array([*place, rng.uniform(-np.pi, np.pi)])


def _step(rng: np.random.Generator, walls: np.ndarray, rooms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two poses 0.3 to 1 m and up to 22 degrees apart, with a clear way between them."""
    while True:
        a = _place(rng, walls, rooms)
        turn = np.radians(rng.uniform(-22, 22))
        ahead = a[2] + turn / 2
        b = a + np.append(rng.uniform(0.3, 1.0) * np.array([np.cos(ahead), np.sin(ahead)]), turn)
        if _clear(walls, a[:2] + np.linspace(0, 1, 5)[:, None] * (b - a)[:2]) > 0.3:
            return a, b


def motor(pose: np.ndarray) -> np.ndarray:
    return np.asarray(pga2.motor_from_angle_translation(pose[2], pose[:2]))


def right(found: Match | Relocation, truth: np.ndarray) -> bool:
    """Whether a motion is right to 20 cm and 2 degrees, or within its bound."""
    off = pga2.motor_product(found.motor, pga2.motor_inverse(truth))
    angle, shift = pga2.motor_to_angle_translation(off)
    places = [pga2.motor_to_angle_translation(each)[1] for each in (found.motor, truth)]
    if np.linalg.norm(places[0] - places[1]) < 0.2 and abs(angle) < np.radians(2):
        return True
    error = np.array([*shift, angle])
    return bool(error @ np.linalg.lstsq(found.covariance, error, rcond=None)[0] < BOUND**2)


@row("`match_scans`", "rooms of flats, 0.3 to 1 m apart, noise of 1 cm; wrong: 20 cm or 2 degrees off", good=True)
def scans_of_flats(rng: np.random.Generator) -> Trial:
    walls, rooms = _flat(rng)
    a, b = _step(rng, walls, rooms)
    beams = _beams(rng)
    one, two = (_scan(rng, ranges(walls, pose, beams), beams) for pose in (a, b))
    found = match_scans(one, two)
    return Trial(
        found.status == 0, right(found, np.asarray(pga2.motor_product(pga2.motor_inverse(motor(a)), motor(b))))
    )


@row("`match_scans`", "a round room of 1.5 to 6 m, scanner up to 0.3 m from its centre, turned by 0.2 to 2")
def scans_of_round_rooms(rng: np.random.Generator) -> Trial:
    radius, beams = rng.uniform(1.5, 6), _beams(rng)
    poses = np.column_stack([rng.choice([0, 0.1]) * rng.normal(size=(2, 2)), [0, rng.uniform(0.2, 2)]])
    scans = []
    for pose in poses:
        across = np.stack([np.cos(pose[2] + beams), np.sin(pose[2] + beams)], 1)
        inward = across @ pose[:2]
        scans.append(_scan(rng, -inward + np.sqrt(radius**2 - pose[:2] @ pose[:2] + inward**2), beams))
    truth = np.asarray(pga2.motor_product(pga2.motor_inverse(motor(poses[0])), motor(poses[1])))
    found = match_scans(*scans)
    return Trial(found.status == 0, right(found, truth))


@row("`match_scans`", "halls of 15 to 40 m with pillars; readings are cut off at 5 to 10 m, and 30 m are stated")
def scans_at_their_limit(rng: np.random.Generator) -> Trial:
    size, beams, limit = rng.uniform(15, 40, 2), _beams(rng), rng.uniform(5, 10)
    places = rng.uniform(1, size - 1, (rng.integers(3, 12), 2))
    walls = np.concatenate([block(*size / 2, *size), *(block(x, y, 0.5, 0.5) for x, y in places)])
    while True:
        a = rng.uniform([1, 1, -np.pi], [*size - 1, np.pi])
        b = a + rng.uniform([-0.8, -0.8, -0.4], [0.8, 0.8, 0.4])
        if _clear(walls, np.stack([a, b])[:, :2]) > 0.3:
            break
    noisy = (ranges(walls, pose, beams) + 0.01 * rng.normal(size=len(beams)) for pose in (a, b))
    one, two = (Scan(np.minimum(each, limit), beams[0], beams[1] - beams[0], _FAR) for each in noisy)
    found = match_scans(one, two)
    truth = np.asarray(pga2.motor_product(pga2.motor_inverse(motor(a)), motor(b)))
    return Trial(found.status == 0, found.status == 0 and right(found, truth))


@row("`match_scans`", "two flats; wrong: OK at all, since rooms look alike")
def scans_of_two_flats(rng: np.random.Generator) -> Trial:
    beams = _beams(rng)
    (one, rooms), (two, others) = _flat(rng), _flat(rng)
    a = _scan(rng, ranges(one, _place(rng, one, rooms), beams), beams)
    b = _scan(rng, ranges(two, _place(rng, two, others), beams), beams)
    return Trial(match_scans(a, b).status == 0, False)


@row("`match_scans`", "a corridor of 1.5 to 4 m without ends, moved by 0.3 to 1.5 m along it")
def scans_of_corridors(rng: np.random.Generator) -> Trial:
    half, beams = rng.uniform(0.75, 2), _beams(rng)
    walls = np.array([[-500, half, 500, half], [-500, -half, 500, -half]])
    a = np.array([0, rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4)])
    b = a + rng.uniform([0.3, -0.2, -0.2], [1.5, 0.2, 0.2])
    one, two = (_scan(rng, ranges(walls, pose, beams), beams) for pose in (a, b))
    found = match_scans(one, two)
    return Trial(
        found.status == 0, right(found, np.asarray(pga2.motor_product(pga2.motor_inverse(motor(a)), motor(b))))
    )


@row("`relocate`", "flats, noise of 1 cm, 0 to 2 people; wrong: 20 cm or 2 degrees off", good=True, slow=True)
def places_in_flats(rng: np.random.Generator) -> Trial:
    walls, rooms = _flat(rng)
    pose, beams = _place(rng, walls, rooms), _beams(rng)
    found = relocate(_scan(rng, ranges(walls, pose, beams), beams, int(rng.integers(3))), map_of(walls))
    return Trial(found.status == 0, right(found, motor(pose)))


@row("`relocate`", "flats whose map lacks 30 % of the walls and of the furniture, or the room of the scan", slow=True)
def places_in_changed_flats(rng: np.random.Generator) -> Trial:
    walls, rooms = _flat(rng)
    pose, beams = _place(rng, walls, rooms), _beams(rng)
    middle = (walls[:, :2] + walls[:, 2:]) / 2
    if rng.random() < 0.5:
        known = rng.random(len(walls)) > 0.3
    else:
        known = np.linalg.norm(middle - pose[:2], axis=1) > rng.uniform(3, 6)
    found = relocate(_scan(rng, ranges(walls, pose, beams), beams, 2), map_of(walls[known]))
    return Trial(found.status == 0, right(found, motor(pose)))


def _walk(rng: np.random.Generator, walls: np.ndarray, rooms: np.ndarray, count: int) -> list[np.ndarray]:
    """Poses 0.4 to 0.9 m apart, with a clear way between them; where there is none, the robot turns."""
    poses = [_place(rng, walls, rooms)]
    while len(poses) < count:
        a = poses[-1]
        for _ in range(30):
            turn = rng.uniform(-0.5, 0.5)
            ahead = a[2] + turn / 2
            b = a + np.append(rng.uniform(0.4, 0.9) * np.array([np.cos(ahead), np.sin(ahead)]), turn)
            if _clear(walls, a[:2] + np.linspace(0, 1, 5)[:, None] * (b - a)[:2]) > 0.3:
                break
        else:
            b = a + np.array([0, 0, rng.choice([-0.7, 0.7])])
        poses.append(b)
    return poses


def _after_some_scans(rng: np.random.Generator, count: int, share: float) -> Trial:
    """Whether a robot knows its place within some scans, in a map that lacks a share of the walls."""
    walls, rooms = _flat(rng)
    known = rng.random(len(walls)) >= share
    finder, beams, before = Relocator(map_of(walls[known])), _beams(rng), None
    for pose in _walk(rng, walls, rooms, count):
        motion = None
        if before is not None:
            truth = pga2.motor_product(pga2.motor_inverse(motor(before)), motor(pose))
            noise = rng.normal(size=3) * [0.02, 0.02, 0.02]
            motion = pga2.motor_product(truth, motor(noise))
        before = pose
        found = finder.add(_scan(rng, ranges(walls, pose, beams), beams, int(rng.integers(3))), motion)
        if found.status == 0:
            return Trial(True, right(found, motor(pose)))
    return Trial(False, False)


@row("`Relocator`", "flats, up to three scans 0.4 to 0.9 m apart, 0 to 2 people", good=True, slow=True)
def places_after_three_scans(rng: np.random.Generator) -> Trial:
    return _after_some_scans(rng, 3, 0.0)


@row("`Relocator`", "the same, up to four scans, in maps that lack 30 % of the walls and of the furniture", slow=True)
def places_after_four_scans(rng: np.random.Generator) -> Trial:
    return _after_some_scans(rng, 4, 0.3)


def _loop_trial(rng: np.random.Generator, share: float) -> Trial:
    start, edges, motions, information, robust, truth = _loops(rng, share)
    found = optimise_poses(start, edges, motions, information, robust)
    right = np.ones(len(edges), bool)
    right[len(start) - 1 : len(start) - 1 + int(60 * share)] = False
    best = optimise_poses(start, edges[right], motions[right], information[right])
    before, least, after = (_distance(each, truth) for each in (start, best.motors, found.motors))
    return Trial(found.status == 0, after <= max(before, least) and after <= 1.5 * least + 0.05)


@row(
    "`optimise_poses`",
    "300 poses, 30 % of 60 closures wrong; wrong: 1.5 times as far as with the right ones alone, or than the start",
    slow=True,
)
def wrong_loops(rng: np.random.Generator) -> Trial:
    return _loop_trial(rng, 0.3)


@row("`optimise_poses`", "the same without wrong closures", good=True, slow=True)
def right_loops(rng: np.random.Generator) -> Trial:
    return _loop_trial(rng, 0.0)


def _distance(motors: np.ndarray, truth: np.ndarray) -> float:
    """The root mean square distance of places after the best motion of all."""
    one, two = (np.asarray(pga2.motor_to_angle_translation(each)[1]) @ [1, 1j] for each in (motors, truth))
    one, two = one - one.mean(), two - two.mean()
    turn = np.vdot(one, two)
    return float(np.sqrt((np.abs(one * turn / abs(turn) - two) ** 2).mean()))


def _loops(rng: np.random.Generator, share: float) -> tuple[np.ndarray, ...]:
    """A walk of 300 poses along streets, by odometry, with 60 closures of which a share is wrong."""
    count = 300
    while True:
        heading, place, rows = 0.0, np.zeros(2), []
        for k in range(count):
            rows.append([*place, heading])
            if k % 5 == 4:
                heading += np.pi / 2 * rng.choice([-1, 0, 1])
            place = place + np.round([np.cos(heading), np.sin(heading)])
        poses = np.array(rows)
        apart = np.linalg.norm(poses[:, None, :2] - poses[:, :2], axis=-1)
        near = np.argwhere((apart < 2) & (np.arange(count) - np.arange(count)[:, None] > 15))
        if len(near) > 200:
            break
    truth = _motor_rows(poses)
    sigma = np.array([0.02, 0.05, 0.05])
    pairs = np.stack([np.arange(count - 1), np.arange(1, count)], 1)
    chosen = near[rng.permutation(len(near))[:60]]
    n_wrong = int(60 * share)
    chosen[:n_wrong] = np.sort(np.array([rng.permutation(count)[:2] for _ in range(n_wrong)], int).reshape(-1, 2), 1)
    edges = np.concatenate([pairs, chosen])
    motions = pga2.motor_product(pga2.motor_inverse(truth[edges[:, 0]]), truth[edges[:, 1]])
    motions[count - 1 : count - 1 + n_wrong] = _motor_rows(rng.uniform([-2, -2, -np.pi], [2, 2, np.pi], (n_wrong, 3)))
    noise = sigma * rng.normal(size=(len(edges), 3))
    motions = np.asarray(pga2.motor_product(motions, pga2.motor_from_angle_translation(noise[:, 0], noise[:, 1:])))
    start = [truth[0]]
    for motion in motions[: count - 1]:
        start.append(np.asarray(pga2.normalize_motor(pga2.motor_product(start[-1], motion))))
    information = np.tile(np.diag(1 / sigma**2), (len(edges), 1, 1))
    return np.array(start), edges, motions, information, np.arange(len(edges)) >= count - 1, truth


def _motor_rows(poses: np.ndarray) -> np.ndarray:
    return np.asarray(pga2.motor_from_angle_translation(poses[:, 2], poses[:, :2]))
