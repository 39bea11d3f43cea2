"""Scans of offices: a corridor between rooms with doors and furniture, and people who move between two scans."""

from __future__ import annotations

import numpy as np
from laser_scenes import box, clearance, motion, ranges

from algorithms.arguments import Reals
from algorithms.mapping import Scan

_RADIUS = 0.2
_FAR = 30.0
_ANGLES = np.linspace(-np.pi / 2, np.pi / 2, 181)


def _wall(x0: float, y0: float, x1: float, y1: float) -> Reals:
    """A wall of 15 cm along an axis."""
    return box((x0 + x1) / 2, (y0 + y1) / 2, max(abs(x1 - x0), 0.15), max(abs(y1 - y0), 0.15))


def _room(rng: np.random.Generator, x0: float, x1: float, y: float, depth: float) -> list[Reals]:
    """A room from x0 to x1 whose wall to the corridor is at y; the sign of the depth is its side of the corridor."""
    door, side = rng.uniform(0.8, 1.2), np.sign(depth)
    at = rng.uniform(x0 + 0.3, x1 - 0.3 - door)
    parts = [_wall(x0, y, at, y), _wall(at + door, y, x1, y), _wall(x1, y, x1, y + depth)]
    if rng.random() < 0.4:
        parts.append(box(at + door / 2, y + side * 0.03, door, 0.05))
    elif rng.random() < 0.5:
        parts.append(box(at, y + side * 0.45, 0.05, 0.9))
    for _ in range(rng.integers(1, 5)):
        place = rng.uniform(x0 + 0.5, x1 - 0.5), y + side * rng.uniform(0.8, abs(depth) - 0.4)
        turn = rng.choice([0, 0, np.pi / 2, rng.uniform(0, 3)])
        parts.append(box(*place, rng.uniform(0.4, 1.6), rng.uniform(0.4, 0.8), turn))
    return parts


def office(rng: np.random.Generator) -> tuple[Reals, float, float]:
    """The walls (n, 4) of an office, and the length and the width of its corridor."""
    length, width = rng.uniform(20, 40), rng.uniform(1.8, 3.0)
    parts = []
    for side in (-1, 1):
        x, y, depth = 0.0, side * width / 2, side * rng.uniform(3.5, 6)
        while x < length:
            end = min(x + rng.uniform(2.6, 6.0), length)
            parts += _room(rng, x, end, y, depth) if end - x >= 1.8 else [_wall(x, y, end, y)]
            x = end
        parts += [_wall(0, y + depth, length, y + depth), _wall(0, y, 0, y + depth)]
        for _ in range(rng.integers(0, 4)):
            parts.append(box(rng.uniform(1, length - 1), y - side * 0.3, rng.uniform(0.5, 1.2), 0.4))
    for x in (0.0, length):
        if rng.random() < 0.6:
            parts.append(_wall(x, -width / 2, x, width / 2))
    return np.concatenate(parts), length, width


def _poses(rng: np.random.Generator, walls: Reals, length: float, width: float) -> tuple[Reals, Reals] | None:
    """Two poses 0.3 to 1 m and up to 22 degrees apart, or None if 200 attempts are too close to walls."""
    for _ in range(200):
        heading = rng.choice([0, np.pi]) + 0.3 * rng.normal()
        a = np.array([rng.uniform(0.5, length - 0.5), rng.uniform(-width / 2, width / 2), heading])
        if rng.random() < 0.5:
            a[1:] = rng.uniform(-width / 2 - 6, width / 2 + 6), rng.uniform(-np.pi, np.pi)
        turn = np.radians(rng.uniform(-22, 22))
        ahead = a[2] + turn / 2
        b = a + np.append(rng.uniform(0.3, 1.0) * np.array([np.cos(ahead), np.sin(ahead)]), turn)
        if min(clearance(walls, a[:2] + t * (b - a)[:2]) for t in np.linspace(0, 1, 4)) > 0.3:
            return a, b
    return None


def _to_people(places: Reals, pose: Reals) -> Reals:
    """The distances to the first person along the beams, infinite if there is none."""
    directions = np.stack([np.cos(pose[2] + _ANGLES), np.sin(pose[2] + _ANGLES)], 1)
    off = places - pose[:2]
    along = directions @ off.T
    root = along**2 - (off**2).sum(1) + _RADIUS**2
    distances = along - np.sqrt(np.maximum(root, 0))
    return np.asarray(np.where((root > 0) & (distances > 0.05), distances, np.inf).min(1, initial=np.inf))


def _crowd(rng: np.random.Generator, walls: Reals, pose: Reals, share: float) -> Reals:
    """Places (k, 2) of people who cover a share of the beams."""
    free = ranges(walls, pose, _ANGLES)
    places = np.zeros((0, 2))
    for _ in range(60):
        if (_to_people(places, pose) < free).mean() >= share:
            break
        beam = rng.integers(len(_ANGLES))
        farthest = min(free[beam] - 0.3, 4.0)
        if farthest >= 0.5:
            angle = pose[2] + _ANGLES[beam]
            place = pose[:2] + rng.uniform(0.5, farthest) * np.array([np.cos(angle), np.sin(angle)])
            places = np.concatenate([places, [place]])
    return places


def _scan(rng: np.random.Generator, walls: Reals, pose: Reals, places: Reals) -> Scan:
    measured = np.minimum(ranges(walls, pose, _ANGLES), _to_people(places, pose))
    noisy = measured + 0.01 * rng.normal(size=len(_ANGLES))
    return Scan(np.minimum(noisy, _FAR), -np.pi / 2, np.pi / 180, _FAR)


def office_pair(rng: np.random.Generator, share: float) -> tuple[Scan, Scan, Reals]:
    """Two scans of an office with a share of the beams on people, and the motion between them.

    In the second scan either all people are others, or seven of ten have moved by about 30 or 80 cm.
    """
    while True:
        walls, length, width = office(rng)
        poses = _poses(rng, walls, length, width)
        if poses is not None:
            break
    a, b = poses
    before = _crowd(rng, walls, a, share)
    step = rng.choice([0.0, 0.3, 0.8])
    if step == 0:
        after = _crowd(rng, walls, b, share)
    else:
        after = before + (rng.random((len(before), 1)) < 0.7) * step * rng.normal(size=before.shape)
        after = after[np.linalg.norm(after - b[:2], axis=1) > 0.4]
    return _scan(rng, walls, a, before), _scan(rng, walls, b, after), motion(a, b)
