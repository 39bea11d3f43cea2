"""Scenes of objects seen by stereo cameras and scanners, of paths and of heads for the page of evidence."""

from __future__ import annotations

import numpy as np

from algorithms.estimation import Tracker, aim, gaze_rates, pan_tilt_head
from algorithms.mapping import (
    FollowSettings,
    PlanarPath,
    SolidFit,
    SolidKind,
    fit_box,
    fit_solid,
    follow,
    stereo_points,
)
from algorithms.vision import RectifiedPair
from generated import pga2, pga3

from .evidence_mapping import block, motor, ranges
from .evidence_scenes import BOUND, Trial, row

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
    slow=True,
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
    slow=True,
)
def far_walls(rng: np.random.Generator) -> Trial:
    places, plane = _wall(rng, 600, rng.uniform(3, 10))
    return _plane_trial(fit_solid(*_seen(rng, places, 0.5), SolidKind.PLANE), plane, places, 0.5)


@row(
    "`fit_solid`",
    "a ball of 10 to 30 cm at 1 to 3 m by stereo, 0.3 pixels; wrong: 2 cm and the bound off",
    good=True,
    slow=True,
)
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


@row("`fit_solid`", "points at random in a cube, or on a line; wrong: any object", slow=True)
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
    walls = block(away, 0, *size, grazing)
    step = np.radians(rng.choice([0.25, 0.5]))
    beams = np.arange(-0.6, 0.6, step)
    measured = ranges(walls, np.zeros(3), beams)
    hit = np.isfinite(measured)
    far = measured[hit] + 0.01 * rng.normal(size=int(hit.sum()))
    points = far[:, None] * np.stack([np.cos(beams[hit]), np.sin(beams[hit])], 1)
    return points, np.array([away, 0.0]), size, grazing


def _box_trial(points: np.ndarray, size: np.ndarray) -> Trial:
    found = fit_box(points)
    if found.fitted is None:
        return Trial(False, False)
    fitted = 2 * found.fitted.size[:2]
    errors = [np.abs(fitted - expected) for expected in (size, size[::-1])]
    return Trial(True, any(bool((off <= np.maximum(found.bounds, 0.08)).all()) for off in errors))


@row(
    "`fit_box`",
    "boxes of 0.3 to 1 m at 1.5 to 4 m, seen at 25 to 65 degrees; wrong: 8 cm and the bound off",
    good=True,
    slow=True,
)
def boxes(rng: np.random.Generator) -> Trial:
    points, _, size, _ = _box_scan(rng, np.radians(25), np.radians(65))
    return _box_trial(points, size) if len(points) > 20 else Trial(True, True)


@row("`fit_box`", "the same at 0 to 12 degrees, where the second side has few points", slow=True)
def boxes_from_the_front(rng: np.random.Generator) -> Trial:
    points, _, size, _ = _box_scan(rng, 0, np.radians(12))
    return _box_trial(points, size)


@row("`follow`", "robots 0 to 0.9 m beside the path, an obstacle at random; wrong: touched within 3 s of OK", slow=True)
def obstacles(rng: np.random.Generator) -> Trial:
    path = PlanarPath.through([[0, 0], [4, 0], [4, 4], [8, 4]], 1.0)
    settings = FollowSettings(law=str(rng.choice(["lyapunov", "pursuit"])))  # type: ignore[arg-type]
    at, aside = rng.uniform(0, 6), rng.uniform(-0.9, 0.9)
    start = pga2.motor_product(path.pose(at), motor(np.array([0, aside, rng.uniform(-1, 1)])))
    obstacle = rng.uniform([-1, -1], [9, 5], (4, 2))
    here, position, ok = np.asarray(start), at, True
    for k in range(60):
        command = follow(path, here, position, obstacle, settings)
        position = command.position
        place = pga2.motor_to_angle_translation(here)[1]
        if k == 0 and np.linalg.norm(obstacle - place, axis=1).min() < settings.width / 2 + 0.05:
            return Trial(False, False)
        if np.linalg.norm(obstacle - place, axis=1).min() < settings.width / 2 - 0.02 and command.speed > 0:
            return Trial(True, False)
        ok = command.status in (0, 1, 2)
        if not ok:
            break
        twist = pga2.twist_from_velocities(0.05 * command.turn, np.array([0.05 * command.speed, 0.0]))
        here = np.asarray(pga2.normalize_motor(pga2.motor_product(here, pga2.motor_from_twist(twist))))
    return Trial(ok, True)


_HEAD = pan_tilt_head()


@row("`aim`", "points around a head with limits; wrong: reached beyond the limits, or off the axis", slow=True)
def aimed_points(rng: np.random.Generator) -> Trial:
    point = rng.normal(size=3) * [2, 2, 1]
    found = aim(_HEAD, point)
    q = found.q
    low, high = _HEAD.limits[:, 0], _HEAD.limits[:, 1]
    seen = pga3.move_point_back(_HEAD.forward(q), point)
    right = bool(((q >= low) & (q <= high)).all() and seen[2] > 0 and np.hypot(seen[0], seen[1]) < 1e-6 * seen[2])
    return Trial(bool(found.reached), right)


@row("`gaze_rates`", "the same, followed for 7 s; wrong: moving, and not at the point in the end", slow=True)
def gazes(rng: np.random.Generator) -> Trial:
    point = rng.normal(size=3) * [2, 2, 1]
    tracker, q = Tracker(_HEAD), rng.uniform([-2.5, -1.2], [2.5, 1.2])
    step = gaze_rates(tracker, q, point)
    for _ in range(15):
        step = gaze_rates(tracker, q, point)
        if step.status > 1:
            break
        q = np.clip(q + 0.45 * step.rates, _HEAD.limits[:, 0], _HEAD.limits[:, 1])
    return Trial(bool(step.status <= 1), bool(np.abs(step.error).max() < 1e-3))
