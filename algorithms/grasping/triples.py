"""Triples of contacts for the three styles of section 20.4.

The surface of the object is a function H(u, v): the outermost sample in each cell of an angle u about an axis through
the centre of mass and a height v along it.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from generated import grasping

from ..arguments import Reals
from .meshes import Integers, Surface

_ANGLES, _HEIGHTS = 48, 16
_POOL = 32
"""Number of samples among which style 2 chooses."""
_FINE = 256
"""Number of triples whose bound of the quality is computed with all twists."""
_ROUGH, _ALL = 8, 192
_WITHOUT_SAMPLE = -1


def _unit_twists() -> Reals:
    """Return twists in all directions; the same in every process."""
    found = np.random.default_rng(20).standard_normal((_ALL, 6))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


_TWISTS = _unit_twists()
_COMBINATIONS = np.array(list(combinations(range(_POOL), 3)))


def triples(surface: Surface, style: int, friction: float) -> tuple[Integers, Reals]:
    """Return rows of three samples (t, 3) with bounds of their qualities (t,), the largest first."""
    if style == 2:
        found = _towards_centre(surface, friction)
    else:
        of = _around if style == 1 else _opposite
        found = np.concatenate([of(_outermost(surface, axis)) for axis in range(3)])
    found = found[(found != _WITHOUT_SAMPLE).all(1)]
    scaled = surface.points / surface.length
    bounds = grasping.quality_bound(scaled[found], surface.normals[found], friction, _TWISTS[:_ROUGH])
    first = np.argsort(-bounds, kind="stable")[:_FINE]
    found = found[first[bounds[first] > 0]]
    bounds = grasping.quality_bound(scaled[found], surface.normals[found], friction, _TWISTS)
    order = np.argsort(-bounds, kind="stable")
    order = order[bounds[order] > 0]
    return found[order], bounds[order]


def _outermost(surface: Surface, axis: int) -> Integers:
    """Return the sample H(u, v) with the largest distance from an axis in each cell (angles, heights)."""
    x, y, z = (surface.points[:, (axis + k) % 3] for k in (1, 2, 0))
    u = np.floor(np.arctan2(y, x) * (_ANGLES / (2 * np.pi))).astype(np.intp) % _ANGLES
    half = float(np.abs(z).max())
    v = np.minimum(((z / half + 1) * (_HEIGHTS / 2)).astype(np.intp), _HEIGHTS - 1)
    order = np.argsort(x * x + y * y, kind="stable")
    table = np.full(_ANGLES * _HEIGHTS, _WITHOUT_SAMPLE)
    # Of several assignments to a cell the last one counts.
    table[(u * _HEIGHTS + v)[order]] = order
    return table.reshape(_ANGLES, _HEIGHTS)


def _around(table: Integers) -> Integers:
    """Style 1: three contacts about 120 degrees apart on a section near the centre."""
    start, second, third, row = np.meshgrid(
        np.arange(0, _ANGLES, 2), [-3, 0, 3, 6], [-6, -3, 0, 3], [_HEIGHTS // 2 - 1, _HEIGHTS // 2], indexing="ij"
    )
    angles = start, start + _ANGLES // 3 + second, start + 2 * _ANGLES // 3 + third
    return np.stack([table[angle % _ANGLES, row].ravel() for angle in angles], -1)


def _opposite(table: Integers) -> Integers:
    """Style 3: a thumb opposite to two fingers, which are side by side along the axis."""
    start, row, apart = np.meshgrid(
        np.arange(0, _ANGLES, 2), np.arange(5, _HEIGHTS - 5), np.arange(1, 7), indexing="ij"
    )
    across = (start + _ANGLES // 2) % _ANGLES
    low, high = np.maximum(row - apart, 0), np.minimum(row + apart, _HEIGHTS - 1)
    return np.stack([table[start, row].ravel(), table[across, low].ravel(), table[across, high].ravel()], -1)


def _towards_centre(surface: Surface, friction: float) -> Integers:
    """Style 2: contacts whose friction cones contain the direction to the centre, not necessarily in a plane with it."""
    inward = -(surface.points * surface.normals).sum(1)
    cone = np.sqrt(np.square(surface.points).sum(1)) / np.sqrt(1 + friction * friction)
    pool = np.flatnonzero(-inward >= cone)
    if len(pool) < 3:
        return np.zeros((0, 3), np.intp)
    if len(pool) > _POOL:
        pool = pool[((np.arange(_POOL) + 0.5) * (len(pool) / _POOL)).astype(np.intp)]
    return pool[_COMBINATIONS[(len(pool) > _COMBINATIONS).all(1)]]
