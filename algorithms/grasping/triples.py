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
_PASSES = 256, 100, 60, 60, 60, 60, 60
"""Each pass lowers the bounds of so many of the best triples by a descent from other twists."""
_TWISTS_OF_PASS, _ROUGH = 24, 8
_SHARES = 0.5 * np.cumprod(np.full(100, 0.965))
"""The lengths of the steps of a descent."""
_WITHOUT_SAMPLE = -1


def _unit_twists() -> Reals:
    """Return twists in all directions; the same in every process."""
    found = np.random.default_rng(20).standard_normal((len(_PASSES), _TWISTS_OF_PASS, 6))
    return found / np.linalg.norm(found, axis=-1, keepdims=True)  # type: ignore[no-any-return]


_TWISTS = _unit_twists()
_COMBINATIONS = np.array(list(combinations(range(_POOL), 3)))


def triples(surface: Surface, style: int, friction: float) -> tuple[Integers, Reals]:
    """Return rows of three samples (t, 3) with bounds of their qualities (t,), the best first."""
    if style == 2:
        found = _towards_centre(surface, friction)
    else:
        of = _around if style == 1 else _opposite
        found = np.concatenate([of(_outermost(surface, axis)) for axis in range(3)])
    found = np.sort(found, axis=1)
    found = found[(found[:, 0] != _WITHOUT_SAMPLE) & (found[:, 0] < found[:, 1]) & (found[:, 1] < found[:, 2])]
    count = len(surface.points)
    _, first = np.unique((found[:, 0] * count + found[:, 1]) * count + found[:, 2], return_index=True)
    found = found[np.sort(first)]
    scaled = surface.points / surface.length
    bounds = grasping.quality_bound(scaled[found], surface.normals[found], friction, _TWISTS[0, :_ROUGH])
    order = np.argsort(-bounds, kind="stable")
    found, bounds = found[order], bounds[order]
    for count, twists in zip(_PASSES, _TWISTS, strict=True):
        best = found[:count]
        lower = grasping.refined_bound(scaled[best], surface.normals[best], friction, twists, _SHARES)
        bounds[:count] = np.minimum(bounds[:count], lower)
        order = np.argsort(-bounds[:count], kind="stable")
        found[:count], bounds[:count] = best[order], bounds[:count][order]
    kept = np.flatnonzero(bounds[: _PASSES[0]] > 0)
    return found[kept], bounds[kept]


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
    start, row, apart, one, other = np.meshgrid(
        np.arange(0, _ANGLES, 3), np.arange(6, _HEIGHTS - 6), np.arange(1, 7), [-3, 0, 3], [-3, 0, 3], indexing="ij"
    )
    low, high = np.maximum(row - apart, 0), np.minimum(row + apart, _HEIGHTS - 1)
    opposite = start + _ANGLES // 2
    cells = (start, row), ((opposite + one) % _ANGLES, low), ((opposite + other) % _ANGLES, high)
    return np.stack([table[cell].ravel() for cell in cells], -1)


def _towards_centre(surface: Surface, friction: float) -> Integers:
    """Style 2: contacts whose friction cones contain the direction to the centre, which may be outside their plane."""
    inward = -(surface.points * surface.normals).sum(1)
    cone = np.sqrt(np.square(surface.points).sum(1)) / np.sqrt(1 + friction * friction)
    pool = np.flatnonzero(-inward >= cone)
    if len(pool) < 3:
        return np.zeros((0, 3), np.intp)
    if len(pool) > _POOL:
        pool = pool[((np.arange(_POOL) + 0.5) * (len(pool) / _POOL)).astype(np.intp)]
    chosen: Integers = pool[_COMBINATIONS[(len(pool) > _COMBINATIONS).all(1)]]
    return chosen
