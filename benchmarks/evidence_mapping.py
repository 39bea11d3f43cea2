"""Scenes of scans, objects, paths and cameras of robots for the page of evidence."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from algorithms.estimation import Tracker, aim, gaze_rates, pan_tilt_head
from algorithms.mapping import (
    FollowSettings,
    Match,
    PlanarPath,
    Relocation,
    Relocator,
    Scan,
    SolidFit,
    SolidKind,
    fit_box,
    fit_solid,
    follow,
    match_scans,
    optimise_poses,
    relocate,
    stereo_points,
)
from algorithms.vision import RectifiedPair
from generated import pga2, pga3

from .evidence_scenes import BOUND, Trial, row

_FAR = 30.0


class _Walls(NamedTuple):
    """Exact walls as a map of lines that are seen from both sides."""

    normals: np.ndarray
    offsets: np.ndarray
    ends: np.ndarray


def _map_of(walls: np.ndarray) -> _Walls:
    along = walls[:, 2:] - walls[:, :2]
    normals = np.stack([-along[:, 1], along[:, 0]], 1) / np.linalg.norm(along, axis=1)[:, None]
    both = np.concatenate([normals, -normals])
    ends = np.tile(walls.reshape(-1, 2, 2), (2, 1, 1))
    return _Walls(both, np.einsum("ij,ij->i", both, ends[:, 0]), ends)


def _block(x: float, y: float, width: float, depth: float, angle: float = 0.0) -> np.ndarray:
    """The four walls of a turned rectangle."""
    corners = np.array([[-width, -depth], [width, -depth], [width, depth], [-width, depth]]) / 2
    c, s = np.cos(angle), np.sin(angle)
    corners = corners @ np.array([[c, s], [-s, c]]) + [x, y]
    return np.hstack([corners, np.roll(corners, -1, 0)])


def _flat(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Walls of 10 to 16 rooms of 2.5 to 6 m, divided again and again, with doors and furniture; corners of rooms."""
    rooms = [np.array([0.0, 0.0, rng.uniform(14, 20), rng.uniform(10, 14)])]
    walls = [_block(*(rooms[0][:2] + rooms[0][2:]) / 2, *(rooms[0][2:] - rooms[0][:2]))]
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
            walls.append(_block(*centre[:: 1 - 2 * axis], *size[:: 1 - 2 * axis]))
        rooms[k : k + 1] = [one, two]
    for room in rooms:
        for _ in range(rng.integers(1, 4)):
            place = rng.uniform(room[:2] + 0.4, room[2:] - 0.4)
            walls.append(_block(*place, *rng.uniform(0.3, 1.5, 2), rng.choice([0, 0, rng.uniform(0, 3)])))
    return np.concatenate(walls), np.array(rooms)


def _ranges(walls: np.ndarray, pose: np.ndarray, angles: np.ndarray) -> np.ndarray:
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


def _motor(pose: np.ndarray) -> np.ndarray:
    return np.asarray(pga2.motor_from_angle_translation(pose[2], pose[:2]))


def _right(found: Match | Relocation, truth: np.ndarray) -> bool:
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
    one, two = (_scan(rng, _ranges(walls, pose, beams), beams) for pose in (a, b))
    found = match_scans(one, two)
    return Trial(
        found.status == 0, _right(found, np.asarray(pga2.motor_product(pga2.motor_inverse(_motor(a)), _motor(b))))
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
    truth = np.asarray(pga2.motor_product(pga2.motor_inverse(_motor(poses[0])), _motor(poses[1])))
    found = match_scans(*scans)
    return Trial(found.status == 0, _right(found, truth))


@row("`match_scans`", "a corridor of 1.5 to 4 m without ends, moved by 0.3 to 1.5 m along it")
def scans_of_corridors(rng: np.random.Generator) -> Trial:
    half, beams = rng.uniform(0.75, 2), _beams(rng)
    walls = np.array([[-500, half, 500, half], [-500, -half, 500, -half]])
    a = np.array([0, rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4)])
    b = a + rng.uniform([0.3, -0.2, -0.2], [1.5, 0.2, 0.2])
    one, two = (_scan(rng, _ranges(walls, pose, beams), beams) for pose in (a, b))
    found = match_scans(one, two)
    return Trial(
        found.status == 0, _right(found, np.asarray(pga2.motor_product(pga2.motor_inverse(_motor(a)), _motor(b))))
    )


@row("`relocate`", "flats, noise of 1 cm, 0 to 2 people; wrong: 20 cm or 2 degrees off", good=True, slow=True)
def places_in_flats(rng: np.random.Generator) -> Trial:
    walls, rooms = _flat(rng)
    pose, beams = _place(rng, walls, rooms), _beams(rng)
    found = relocate(_scan(rng, _ranges(walls, pose, beams), beams, int(rng.integers(3))), _map_of(walls))
    return Trial(found.status == 0, _right(found, _motor(pose)))


@row("`relocate`", "flats whose map lacks 30 % of the walls and of the furniture, or the room of the scan", slow=True)
def places_in_changed_flats(rng: np.random.Generator) -> Trial:
    walls, rooms = _flat(rng)
    pose, beams = _place(rng, walls, rooms), _beams(rng)
    middle = (walls[:, :2] + walls[:, 2:]) / 2
    if rng.random() < 0.5:
        known = rng.random(len(walls)) > 0.3
    else:
        known = np.linalg.norm(middle - pose[:2], axis=1) > rng.uniform(3, 6)
    found = relocate(_scan(rng, _ranges(walls, pose, beams), beams, 2), _map_of(walls[known]))
    return Trial(found.status == 0, _right(found, _motor(pose)))


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
    finder, beams, before = Relocator(_map_of(walls[known])), _beams(rng), None
    for pose in _walk(rng, walls, rooms, count):
        motion = None
        if before is not None:
            truth = pga2.motor_product(pga2.motor_inverse(_motor(before)), _motor(pose))
            noise = rng.normal(size=3) * [0.02, 0.02, 0.02]
            motion = pga2.motor_product(truth, _motor(noise))
        before = pose
        found = finder.add(_scan(rng, _ranges(walls, pose, beams), beams, int(rng.integers(3))), motion)
        if found.status == 0:
            return Trial(True, _right(found, _motor(pose)))
    return Trial(False, False)


@row("`Relocator`", "flats, up to three scans 0.4 to 0.9 m apart, 0 to 2 people", good=True, slow=True)
def places_after_three_scans(rng: np.random.Generator) -> Trial:
    return _after_some_scans(rng, 3, 0.0)


@row("`Relocator`", "the same, up to six scans, in maps that lack 30 % of the walls and of the furniture", slow=True)
def places_after_six_scans(rng: np.random.Generator) -> Trial:
    return _after_some_scans(rng, 6, 0.3)


_PAIR = RectifiedPair(700.0, (320.0, 240.0), 0.0, 0.12)
_CAMERA = np.array([1.0, 0, 0, 0, 0, 0, 0, 0])


def _seen(rng: np.random.Generator, points: np.ndarray, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Points by a stereo camera, from noisy pixels, and their covariances."""
    x, y, z = points.T
    left = 700 * np.stack([x / z, y / z], 1) + [320, 240]
    right = 700 * (x - 0.12) / z + 320
    left, right = left + noise * rng.normal(size=left.shape), right + noise * rng.normal(size=len(points))
    return stereo_points(_PAIR, left, left[:, 0] - right, _CAMERA, noise)


def _wall(rng: np.random.Generator, count: int, depth: float) -> tuple[np.ndarray, np.ndarray]:
    """Points of a wall in view, turned by up to 40 degrees, and its plane."""
    turn = rng.uniform(-0.7, 0.7)
    normal = np.array([np.sin(turn), rng.normal(0, 0.05), np.cos(turn)])
    normal /= np.linalg.norm(normal)
    rays = np.column_stack([rng.uniform([-0.45, -0.34], [0.45, 0.34], (count, 2)), np.ones(count)])
    points = rays * (depth * normal[2] / (rays @ normal))[:, None]
    return points, np.append(normal, -depth * normal[2])


def _plane_trial(found: SolidFit, plane: np.ndarray, places: np.ndarray, noise: float) -> Trial:
    solid = found.solid
    if solid is None:
        return Trial(False, False)
    off = np.degrees(np.arccos(min(abs(float(solid.plane[:3] @ plane[:3])), 1)))
    away = abs(float(pga3.signed_distance_point_plane(places.mean(0), solid.plane)))
    depth = float(np.linalg.norm(places.mean(0)))
    # A pixel of disparity is depth**2 / (700 * 0.12); a disparity is the difference of two pixels.
    bound = BOUND * noise * np.sqrt(2 / len(places)) * depth**2 / 84
    return Trial(True, bool(off < 5 and away < max(bound, 0.01)))


@row(
    "`fit_solid`",
    "a wall at 2 to 5 m by stereo, 0.3 pixels; 5 to 30 % of the points on the floor; wrong: 5 degrees off",
)
def walls_with_floor(rng: np.random.Generator) -> Trial:
    places, plane = _wall(rng, 300, rng.uniform(2, 5))
    count = int(300 * rng.uniform(0.05, 0.3))
    floor = np.column_stack([rng.uniform(-1, 1, count), np.full(count, 1.2), rng.uniform(2.2, 4, count)])
    found = fit_solid(*_seen(rng, np.concatenate([places, floor]), 0.3), SolidKind.PLANE)
    return _plane_trial(found, plane, places, 0.3)


@row(
    "`fit_solid`",
    "a wall at 3 to 10 m by stereo, 0.5 pixels; wrong: 1 cm, and 4 deviations of the mean disparity, off",
    good=True,
)
def far_walls(rng: np.random.Generator) -> Trial:
    places, plane = _wall(rng, 600, rng.uniform(3, 10))
    return _plane_trial(fit_solid(*_seen(rng, places, 0.5), SolidKind.PLANE), plane, places, 0.5)


@row("`fit_solid`", "a ball of 10 to 30 cm at 1 to 3 m by stereo, 0.3 pixels; wrong: 2 cm and the bound off", good=True)
def balls(rng: np.random.Generator) -> Trial:
    radius = rng.uniform(0.1, 0.3)
    centre = np.append(rng.uniform(-0.2, 0.2, 2), rng.uniform(1, 3))
    out = rng.normal(size=(3000, 3))
    out /= np.linalg.norm(out, axis=1)[:, None]
    places = (centre + radius * out)[out @ centre < -0.3 * np.linalg.norm(centre)][:500]
    found = fit_solid(*_seen(rng, places, 0.3), SolidKind.SPHERE)
    if found.solid is None:
        return Trial(False, False)
    bound = max(0.02, BOUND * getattr(found, "deviation", 0))
    return Trial(True, bool(np.linalg.norm(found.solid.centre - centre) < bound))


@row("`fit_solid`", "points at random in a cube, or on a line; wrong: any object")
def no_solids(rng: np.random.Generator) -> Trial:
    count = int(rng.integers(8, 200))
    points = rng.uniform(-1, 1, (count, 3)) * (1 if rng.random() < 0.7 else [1, 0, 0])
    spreads = np.tile([4e-4, 0, 0, 4e-4, 0, 4e-4], (count, 1))
    points = points + 0.02 * rng.normal(size=points.shape)
    return Trial(fit_solid(points, spreads, SolidKind(int(rng.integers(2)))).status == 0, False)


def _box_scan(rng: np.random.Generator, least: float, most: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Points of a box, its centre and size, and the angle at which its second side is seen."""
    size = rng.uniform(0.3, 1.0, 2)
    away, grazing = rng.uniform(1.5, 4), rng.uniform(least, most)
    walls = _block(away, 0, *size, grazing)
    step = np.radians(rng.choice([0.25, 0.5]))
    beams = np.arange(-0.6, 0.6, step)
    measured = _ranges(walls, np.zeros(3), beams)
    hit = np.isfinite(measured)
    far = measured[hit] + 0.01 * rng.normal(size=int(hit.sum()))
    points = far[:, None] * np.stack([np.cos(beams[hit]), np.sin(beams[hit])], 1)
    return points, np.array([away, 0.0]), size, grazing


def _box_trial(points: np.ndarray, size: np.ndarray) -> Trial:
    found = fit_box(points)
    if found.fitted is None:
        return Trial(False, False)
    fitted = 2 * found.fitted.size[:2]
    bounds = getattr(found, "bounds", np.zeros(2))
    ways = [np.abs(fitted - size[list(way)]) for way in ((0, 1), (1, 0))]
    return Trial(True, any(bool((way <= np.maximum(bounds, 0.08)).all()) for way in ways))


@row(
    "`fit_box`", "boxes of 0.3 to 1 m at 1.5 to 4 m, seen at 25 to 65 degrees; wrong: 8 cm and the bound off", good=True
)
def boxes(rng: np.random.Generator) -> Trial:
    points, _, size, _ = _box_scan(rng, np.radians(25), np.radians(65))
    return _box_trial(points, size) if len(points) > 20 else Trial(True, True)


@row("`fit_box`", "the same at 0 to 12 degrees, where the second side has few points")
def boxes_from_the_front(rng: np.random.Generator) -> Trial:
    points, _, size, _ = _box_scan(rng, 0, np.radians(12))
    return _box_trial(points, size)


@row("`follow`", "robots 0 to 0.9 m beside the path, an obstacle at random; wrong: touched within 3 s of OK", slow=True)
def obstacles(rng: np.random.Generator) -> Trial:
    path = PlanarPath.through([[0, 0], [4, 0], [4, 4], [8, 4]], 1.0)
    settings = FollowSettings(law=str(rng.choice(["lyapunov", "pursuit"])))  # type: ignore[arg-type]
    at, aside = rng.uniform(0, 6), rng.uniform(-0.9, 0.9)
    start = pga2.motor_product(path.pose(at), _motor(np.array([0, aside, rng.uniform(-1, 1)])))
    obstacle = rng.uniform([-1, -1], [9, 5], (4, 2))
    motor, position, ok = np.asarray(start), at, True
    for k in range(60):
        command = follow(path, motor, position, obstacle, settings)
        position = command.position
        place = pga2.motor_to_angle_translation(motor)[1]
        if k == 0 and np.linalg.norm(obstacle - place, axis=1).min() < settings.width / 2 + 0.05:
            return Trial(False, False)
        if np.linalg.norm(obstacle - place, axis=1).min() < settings.width / 2 - 0.02 and command.speed > 0:
            return Trial(True, False)
        ok = command.status in (0, 1, 2)
        if not ok:
            break
        twist = pga2.twist_from_velocities(0.05 * command.turn, np.array([0.05 * command.speed, 0.0]))
        motor = np.asarray(pga2.normalize_motor(pga2.motor_product(motor, pga2.motor_from_twist(twist))))
    return Trial(ok, True)


_HEAD = pan_tilt_head()


@row("`aim`", "points around a head with limits; wrong: reached beyond the limits, or off the axis")
def aimed_points(rng: np.random.Generator) -> Trial:
    point = rng.normal(size=3) * [2, 2, 1]
    found = aim(_HEAD, point)
    q = found.q
    low, high = _HEAD.limits[:, 0], _HEAD.limits[:, 1]
    seen = pga3.move_point_back(_HEAD.forward(q), point)
    right = bool(((q >= low) & (q <= high)).all() and seen[2] > 0 and np.hypot(seen[0], seen[1]) < 1e-6 * seen[2])
    return Trial(bool(found.reached), right)


@row("`gaze_rates`", "the same, followed for 10 s; wrong: moving, and not at the point in the end", slow=True)
def gazes(rng: np.random.Generator) -> Trial:
    point = rng.normal(size=3) * [2, 2, 1]
    tracker, q = Tracker(_HEAD), rng.uniform([-2.5, -1.2], [2.5, 1.2])
    step = gaze_rates(tracker, q, point)
    for _ in range(60):
        step = gaze_rates(tracker, q, point)
        if step.status > 1:
            break
        q = np.clip(q + 0.16 * step.rates, _HEAD.limits[:, 0], _HEAD.limits[:, 1])
    return Trial(bool(step.status <= 1), bool(np.abs(step.error).max() < 1e-3))


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
