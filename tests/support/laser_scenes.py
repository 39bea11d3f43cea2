"""Laser scans of rooms of walls, boxes and posts, ray by ray with numpy, and people in front of the beams."""

from __future__ import annotations

import numpy as np

from algorithms.arguments import Reals
from algorithms.mapping import Scan

FAR = 50.0


def box(x: float, y: float, width: float, height: float, angle: float = 0.0) -> Reals:
    """The four walls (4, 4), x y x y, of a turned rectangle about a centre."""
    corners = np.array([[-width, -height], [width, -height], [width, height], [-width, height]]) / 2
    c, s = np.cos(angle), np.sin(angle)
    corners = corners @ np.array([[c, s], [-s, c]]) + [x, y]
    return np.hstack([corners, np.roll(corners, -1, 0)])


def room(rng: np.random.Generator, n_boxes: int) -> Reals:
    """A room of 12 by 9 metres with boxes."""
    boxes = [
        box(x, y, rng.uniform(0.3, 1.5), rng.uniform(0.3, 1.5), a)
        for x, y, a in zip(
            rng.uniform(0.5, 11.5, n_boxes), rng.uniform(0.5, 8.5, n_boxes), rng.uniform(0, 3, n_boxes), strict=True
        )
    ]
    # An alcove makes the walls differ.
    return np.concatenate([box(6, 4.5, 12, 9), box(1.0, 8.5, 2.0, 1.0), *boxes])


def ranges(walls: Reals, pose: Reals, angles: Reals) -> Reals:
    """The distances of the first walls from the pose x, y, angle; infinite if there is none."""
    d = np.stack([np.cos(pose[2] + angles), np.sin(pose[2] + angles)], 1)
    along, start = walls[:, 2:] - walls[:, :2], walls[:, :2] - pose[:2]
    with np.errstate(divide="ignore", invalid="ignore"):
        area = d[:, :1] * along[:, 1] - d[:, 1:] * along[:, 0]
        t = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / area
        s = (start[:, 0] * d[:, 1:] - start[:, 1] * d[:, :1]) / area
    return np.asarray(np.where((t > 0) & (s >= 0) & (s <= 1), t, np.inf).min(1))


def clearance(walls: Reals, place: Reals) -> float:
    """The distance of the nearest wall."""
    along = walls[:, 2:] - walls[:, :2]
    t = np.clip(((place - walls[:, :2]) * along).sum(1) / (along**2).sum(1), 0, 1)
    return float(np.linalg.norm(walls[:, :2] + t[:, None] * along - place, axis=1).min())


def scan_at(
    rng: np.random.Generator, walls: Reals, pose: Reals, *, n: int = 181, noise: float = 0.01, people: float = 0.0
) -> Scan:
    """A scan over half a turn, with noise and a share of the beams on people."""
    step = np.pi / (n - 1)
    angles = -np.pi / 2 + step * np.arange(n)
    measured = ranges(walls, pose, angles)
    for _ in range(round(8 * people)):
        distance = rng.uniform(0.6, 3.0)
        hit = np.abs(angles - rng.uniform(-1.5, 1.5)) < np.arctan(0.2 / distance)
        measured[hit] = np.minimum(measured[hit], distance)
    measured = np.minimum(measured + noise * rng.normal(size=n), FAR)
    return Scan(measured, -np.pi / 2, step, FAR)


def motion(a: Reals, b: Reals) -> Reals:
    """Pose b in the frame of pose a."""
    c, s = np.cos(a[2]), np.sin(a[2])
    x, y = b[:2] - a[:2]
    return np.array([c * x + s * y, -s * x + c * y, b[2] - a[2]])


def pair(rng: np.random.Generator, walls: Reals) -> tuple[Reals, Reals]:
    """Two poses in a room of 12 by 9 metres, 0.7 to 1 m and 10 to 22 degrees apart, clear of walls."""
    while True:
        a = np.array([*rng.uniform([0.5, 0.5], [11.5, 8.5]), rng.uniform(-np.pi, np.pi)])
        turn = np.radians(rng.uniform(10, 22)) * rng.choice([-1, 1])
        ahead = a[2] + turn / 2
        b = a + np.append(rng.uniform(0.7, 1.0) * np.array([np.cos(ahead), np.sin(ahead)]), turn)
        if min(clearance(walls, a[:2] + t * (b - a)[:2]) for t in np.linspace(0, 1, 5)) > 0.3:
            return a, b
