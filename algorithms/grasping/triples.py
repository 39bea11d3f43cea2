"""Triples of contacts for the three styles of section 20.4.

The surface of the object is a function H(u, v): the outermost sample in each cell of an angle u about an axis through
the centre of mass and a height v along it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from generated import grasping

from ..arguments import Reals
from ..geometry.meshes import Flags, Integers
from .meshes import Surface

LEAST_QUALITY = 1e-4
"""A grasp of less quality has no force closure within rounding errors."""
_ANGLES, _HEIGHTS = 48, 16
"""Limit on work: the cells, about an axis and along it, of which each has one sample."""
_POOL = 32
"""Number of samples among which style 2 chooses."""
_PASSES = 256, 100, 60, 60, 40, 40, 40
"""Each pass lowers the bounds of so many of the best triples by a descent from other twists."""
_TWISTS_OF_PASS, _ROUGH = 24, 8
"""Limits on work: the number of twists of each pass, and of those that decide which triples pass."""
_GOOD = 0.6
"""The part of the best bound above which triples are good."""
_RECOMBINED = 2
"""The pass before which the best triples are recombined."""
_THOROUGH = 3, 4, 5, 6
"""The passes before which a thorough search recombines the best triples with close samples."""
_CLOSE, _CLOSE_OF = 8, 4
"""The number of samples close to each contact of so many of the best triples."""
_WIDE = 12
"""A thorough search takes one of so many close samples, but so many times farther ones."""
_PARENTS, _DONORS, _ALL_DONORS, _MORE = 12, 24, 72, 60
"""The number of triples of which a contact is replaced; of those whose contacts replace it, or, in style 2, of other
samples; and of the results that are kept."""
_SHARES = 0.5 * np.cumprod(np.full(100, 0.965))
"""The lengths of the steps of a descent."""


def _unit_twists() -> Reals:
    """Return twists in all directions; the same in every process."""
    found = np.random.default_rng(20).standard_normal((len(_PASSES), _TWISTS_OF_PASS, 6))
    return found / np.linalg.norm(found, axis=-1, keepdims=True)  # type: ignore[no-any-return]


_TWISTS = _unit_twists()
_COMBINATIONS = np.array(list(combinations(range(_POOL), 3)))
"""All triples of the pool, as rows."""


@dataclass(frozen=True, slots=True)
class Span:
    """Distances between the centres of fingertips at which a hand can hold an object."""

    radius: float
    """The radius of a fingertip."""
    least: float
    most: float

    def holds(self, surface: Surface, rows: Integers) -> Flags:
        """Return whether all distances between the centres of fingertips at triples (t, 3) are within limits, (t,)."""
        centres = np.ascontiguousarray((surface.points + self.radius * surface.normals).T)
        corners = [centres[:, row] for row in rows.T]
        held = np.ones(len(rows), bool)
        for k in range(3):
            gaps = corners[k] - corners[k - 1]
            squares = np.einsum("ij,ij->j", gaps, gaps)
            held &= (squares > self.least**2) & (squares < self.most**2)
        return held


def triples(
    surface: Surface, style: int, friction: float, span: Span, thorough: bool = False
) -> tuple[Integers, Reals]:
    """Return rows of three samples (t, 3) with bounds of their qualities (t,): good and different ones first.

    Parameters
    ----------
    surface : Surface
    style : {1, 2, 3}
    friction : float
    span : Span
        What a hand can reach; other triples are left out before the best ones are chosen.
    thorough : bool
        Whether contacts are replaced by close samples several times, which takes longer.

    Returns
    -------
    rows : array of int, (t, 3)
    bounds : array, (t,)
    """
    donors, pool = None, np.arange(len(surface.points))
    close = _THOROUGH if thorough else ()
    if style == 2:
        pool = _towards_centre(surface, friction)
        few = _spread(pool, _POOL)
        found = few[_COMBINATIONS[(len(few) > _COMBINATIONS).all(1)]]
        donors = _spread(pool, _ALL_DONORS)
    else:
        of = _around if style == 1 else _opposite
        found = np.concatenate([of(_outermost(surface, axis)) for axis in range(3)])
    found = _sorted(found)
    found = found[(found[:, 0] >= 0) & (found[:, 0] < found[:, 1]) & (found[:, 1] < found[:, 2])]
    count = len(surface.points)
    _, first = np.unique((found[:, 0] * count + found[:, 1]) * count + found[:, 2], return_index=True)
    found = found[np.sort(first)]
    found = found[span.holds(surface, found)]
    scaled = surface.points / surface.length
    bounds = grasping.quality_bound(scaled[found], surface.normals[found], friction, _TWISTS[0, :_ROUGH])
    found, bounds = _ranked(found, bounds)
    found, bounds = found[: _PASSES[0]], bounds[: _PASSES[0]]
    for number, (count, twists) in enumerate(zip(_PASSES, _TWISTS, strict=True)):
        if number == _RECOMBINED or number in close:
            if number in close:
                donors = _close_to(found[:_CLOSE_OF], pool, surface)
            more = _recombined(found, donors, len(surface.points))
            more = more[span.holds(surface, more)]
            lower = grasping.quality_bound(scaled[more], surface.normals[more], friction, _TWISTS[1, : 2 * _ROUGH])
            chosen = np.argsort(-np.round(lower, 8), kind="stable")[:_MORE]
            found, bounds = _ranked(np.concatenate([found, more[chosen]]), np.concatenate([bounds, lower[chosen]]))
            count += _MORE
        best = found[:count]
        lower = grasping.refined_bound(scaled[best], surface.normals[best], friction, twists, _SHARES)
        bounds[:count] = np.minimum(bounds[:count], lower)
        found[:count], bounds[:count] = _ranked(found[:count], bounds[:count])
    kept = np.flatnonzero(bounds > LEAST_QUALITY)
    kept = kept[_different_first(found[kept], bounds[kept])]
    return found[kept], bounds[kept]


def _sorted(rows: Integers) -> Integers:
    """Return triples in ascending order, faster than by numpy."""
    a, b, c = np.ascontiguousarray(rows.T)
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    return np.stack([low, a + b + c - low - high, high], -1)


def _different_first(found: Integers, bounds: Reals) -> Integers:
    """Return an order in which triples that share two samples with a better one come later, but before poor ones.

    If the hand cannot reach a triple without collisions, it can rarely reach those that differ by one contact.
    """
    seen: set[tuple[int, int]] = set()
    good = int((bounds > _GOOD * bounds[:1]).sum())
    first, later = [], []
    for row, (a, b, c) in enumerate(found[:good].tolist()):
        pairs = {(a, b), (b, c), (a, c)}
        if seen.isdisjoint(pairs):
            first.append(row)
            seen |= pairs
        else:
            later.append(row)
    return np.array([*first, *later, *range(good, len(found))], np.intp)


def _ranked(found: Integers, bounds: Reals) -> tuple[Integers, Reals]:
    # Bounds that differ by rounding errors do not change the order, so that it moves with the object.
    order = np.argsort(-np.round(bounds, 8), kind="stable")
    return found[order], bounds[order]


def _recombined(found: Integers, donors: Integers | None, count: int) -> Integers:
    """Return the best triples with one contact replaced by some samples: by default, contacts of other good triples."""
    best = found[:_PARENTS]
    donors = np.unique(found[:_DONORS]) if donors is None else donors
    new = np.repeat(best[:, None, None], 3, 1).repeat(len(donors), 2)
    for slot in range(3):
        new[:, slot, :, slot] = donors
    rows = _sorted(new.reshape(-1, 3))
    rows = rows[(rows[:, 0] < rows[:, 1]) & (rows[:, 1] < rows[:, 2])]
    keys = (rows @ [count * count, count, 1]).astype(np.int64)
    known = found @ [count * count, count, 1]
    _, first = np.unique(keys, return_index=True)
    first = np.sort(first[~np.isin(keys[first], known)])
    chosen: Integers = rows[first]
    return chosen


def _close_to(found: Integers, pool: Integers, surface: Surface) -> Integers:
    """Return one of some number of the samples of a pool that are closest to the contacts of triples."""
    contacts = np.unique(found)
    squares = np.square(surface.points[pool] - surface.points[contacts, None]).sum(-1)
    closest = np.argsort(np.round(squares / surface.length**2, 9), axis=1, kind="stable")[:, : _WIDE * _CLOSE : _WIDE]
    chosen: Integers = np.unique(pool[closest])
    return chosen


def _outermost(surface: Surface, axis: int) -> Integers:
    """Return the sample H(u, v) with the largest distance from an axis in each cell (angles, heights)."""
    x, y, z = (surface.points[:, (axis + k) % 3] for k in (1, 2, 0))
    u = np.floor(np.arctan2(y, x) * (_ANGLES / (2 * np.pi))).astype(np.intp) % _ANGLES
    half = float(np.abs(z).max())
    v = np.minimum(((z / half + 1) * (_HEIGHTS / 2)).astype(np.intp), _HEIGHTS - 1)
    cells, squares = u * _HEIGHTS + v, x * x + y * y
    most = np.full(_ANGLES * _HEIGHTS, -1.0)
    np.maximum.at(most, cells, squares)
    table = np.full(_ANGLES * _HEIGHTS, -1)  # no sample
    # Of several assignments to a cell the last one counts.
    outermost = np.flatnonzero(squares == most[cells])
    table[cells[outermost]] = outermost
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
    """Style 2: samples whose friction cones contain the direction to the centre, which may be outside their plane."""
    inward = -(surface.points * surface.normals).sum(1)
    cone = np.sqrt(np.square(surface.points).sum(1)) / np.sqrt(1 + friction * friction)
    pool: Integers = np.flatnonzero(-inward >= cone)
    return pool


def _spread(pool: Integers, count: int) -> Integers:
    """Return a number of elements at equal distances, or all of them if there are less."""
    if len(pool) <= count:
        return pool
    chosen: Integers = pool[((np.arange(count) + 0.5) * (len(pool) / count)).astype(np.intp)]
    return chosen
