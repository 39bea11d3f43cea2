"""Scans of real objects, and meshes of simple shapes, for tests of grasps."""

from functools import cache
from pathlib import Path

import numpy as np

_FILE = Path(__file__).parents[1] / "data" / "grasping" / "scans.npz"
NAMES = "MustardBottle", "Banana", "PowerDrill", "TomatoSoupCan", "CrackerBox", "FoamBrick"


@cache
def scan(name):
    """Return the vertices, in metres, and the faces of a scan."""
    with np.load(_FILE) as file:
        return file[f"{name}_vertices"] / 2e5, file[f"{name}_faces"].astype(np.intp)


def _grid(points, *, around):
    """Return the mesh of a closed grid of points (u, v, 3), in which u wraps, and v if `around`."""
    rows, columns = points.shape[:2]
    u, v = np.meshgrid(np.arange(rows), np.arange(columns if around else columns - 1), indexing="ij")
    a, b = u * columns + v, (u + 1) % rows * columns + v
    c, d = (u + 1) % rows * columns + (v + 1) % columns, u * columns + (v + 1) % columns
    return points.reshape(-1, 3), np.concatenate([np.stack(x, -1).reshape(-1, 3) for x in ((a, b, c), (a, c, d))])


def torus(large, small):
    u, v = np.meshgrid(np.arange(60) * np.pi / 30, np.arange(24) * np.pi / 12, indexing="ij")
    r = large + small * np.cos(v)
    return _grid(np.stack([r * np.cos(u), r * np.sin(u), small * np.sin(v)], -1), around=True)


def eight(size, radius):
    """A tube about a curve that crosses itself, as in the digit 8."""
    u, v = np.meshgrid(np.arange(60) * np.pi / 30, np.arange(12) * np.pi / 6, indexing="ij")
    curve = size * np.stack([np.sin(u), np.sin(u) * np.cos(u), 0 * u], -1)
    across = np.stack([np.cos(2 * u), -np.cos(u), 0 * u], -1)
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    ring = np.cos(v)[..., None] * across + np.sin(v)[..., None] * [0, 0, 1]
    return _grid(curve + radius * ring, around=True)


def sphere(radius):
    u, v = np.meshgrid(np.arange(48) * np.pi / 24, np.linspace(-np.pi / 2, np.pi / 2, 25), indexing="ij")
    points = radius * np.stack([np.cos(u) * np.cos(v), np.sin(u) * np.cos(v), np.sin(v)], -1)
    return _closed_ends(*_grid(points, around=False), rows=48, columns=25)


def cylinder(radius, height):
    u = np.arange(48) * np.pi / 24
    ring = np.stack([radius * np.cos(u), radius * np.sin(u), 0 * u], -1)
    levels = np.array([[0.0, -1], [1, -1], [1, 1], [0, 1]])
    points = np.stack([ring * r + [0, 0, z * height / 2] for r, z in levels], 1)
    return _closed_ends(*_grid(points, around=False), rows=48, columns=4)


def _closed_ends(points, faces, *, rows, columns):
    """Merge the first points of all rows, and the last ones."""
    numbers = np.arange(rows * columns).reshape(rows, columns)
    numbers[:, 0], numbers[:, -1] = numbers[0, 0], numbers[0, -1]
    return points, numbers.ravel()[faces]


def box(x, y, z):
    corners = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * np.array([x, y, z]) / 2
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6]]
    return corners, np.array([*faces, [0, 6, 4], [1, 5, 7], [1, 7, 3]])
