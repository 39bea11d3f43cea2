"""Distances between samples and triangles, in both directions."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from ..arguments import Reals
from ..precision import TINY
from .surface_samples import Samples

_DENSITY = 4
"""Intervals of the sides of triangles."""
_DISC = 2.0
"""Radius of the disc that a sample stands for, in distances of samples."""


def dense_points(places: Reals, triangles: NDArray[np.intp]) -> tuple[Reals, NDArray[np.intp]]:
    """Return points on triangles, their corners among them, and the triangle of each."""
    n = _DENSITY
    weights = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]) / n
    points = np.einsum("wk,tkd->twd", weights, places[triangles]).reshape(-1, 3)
    return points, np.repeat(np.arange(len(triangles)), len(weights))


def distances_to_triangles(points: Reals, places: Reals, triangles: NDArray[np.intp]) -> Reals:
    """Return the distances of points from triangles near them; the nearest of a few, thus upper bounds."""
    dense, of = dense_points(places, triangles)
    _, rows = scipy.spatial.cKDTree(dense).query(points, 3)
    found = np.full(len(points), np.inf)
    for column in range(3):
        corners = places[triangles[of[rows[:, column]]]]
        found = np.minimum(found, _distance(points, corners))
    return found


def distances_to_samples(points: Reals, samples: Samples, tree: scipy.spatial.cKDTree) -> Reals:
    """Return the distances of points from discs at the nearest samples, across their normals."""
    _, rows = tree.query(points)
    away = points - samples.places[rows]
    off = (away * samples.normals[rows]).sum(1)
    beside = np.linalg.norm(away - off[:, None] * samples.normals[rows], axis=1)
    return np.asarray(np.hypot(off, np.maximum(0, beside - _DISC * samples.spacing)))


def _distance(p: Reals, corners: Reals) -> Reals:
    """Distance of each point from its triangle: from the plane if the foot is within, else from the nearest side."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    square = np.maximum((normal**2).sum(1), TINY)
    within = np.ones(len(p), bool)
    least = np.full(len(p), np.inf)
    for one, two in ((a, b), (b, c), (c, a)):
        side, away = two - one, p - one
        within &= (np.cross(side, away) * normal).sum(1) >= 0
        t = np.clip((side * away).sum(1) / np.maximum((side**2).sum(1), TINY), 0, 1)
        least = np.minimum(least, np.linalg.norm(away - t[:, None] * side, axis=1))
    return np.where(within, np.abs(((p - a) * normal).sum(1)) / np.sqrt(square), least)
