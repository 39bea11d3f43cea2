"""Registration of flat clouds: outlines against outlines, in the plane and with both of its sides."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from generated import pga3

from ..arguments import Reals
from .alignment import OWN, Found, Reach, Task, different, hypothesis_refined, reach_of, solved, support
from .clouds import Cloud, cloud_of, levels, normals_of
from .refinement import Part, Surface, neighbours, planes_target, points_target

_SEARCH, _FINISH = 800, 6000
"""Points to which larger clouds are thinned, for the search and for the last refinement."""
_TURNS = 120
"""Rotations in the plane, for each side."""
_CELLS, _EXTENT = 64, 5.0
"""Cells of the grid of densities along an axis, and its size as a multiple of the size of a cloud."""
_HYPOTHESES, _ALIKE = 60, 5
"""Peaks that are refined, and the cells and rotations around a peak in which there is no other one."""
_NEIGHBOURS, _GAP = 20, np.radians(150.0)
"""Neighbours of a point, and the angle without neighbours from which on it is on the outline."""
_WINDOW = 40
"""Neighbours among which the outermost ones of an area are found."""
_TANGENT = 10
"""Points of the outline that give its direction."""
_AREA, _ROUNDS = 0.1, 2
"""The ratio of extents of neighbours from which on they are an area, and corrections of its edge."""
_FEWEST = 8
"""Points of an outline: with fewer, all points count as it."""
_OUTLINE = 0.8
"""Factor of the share of the outline in the support."""
_SCALE = 0.4
"""The scale of distances in spacings of an area, whose outline is not better known."""
_LEAST_SUPPORT, _LEAST_GAIN = 0.57, 0.15
"""Least support of a pose, and by how much it has to exceed the support of poses beside it."""
_WORSE = 2.0
"""Distances of smoothed surfaces, in multiples of those of the best pose, from which on a pose fits worse."""
_SMOOTHED, _EVEN = 12, 1e-4
"""Points of a mean, and the distance relative to the size that does not distinguish poses."""


@dataclass(frozen=True, eq=False)
class _Flat:
    """A flat cloud with its plane, its outline and the normals of both within the plane."""

    cloud: Cloud
    frame: Reals
    """The motor from coordinates in the plane to the cloud."""
    normal: Reals
    places: Reals
    """Coordinates (n, 2) in the plane."""
    outline: Cloud
    edge: Reals
    """The outline (k, 2) in the plane."""
    across: Reals
    """Normals (k, 3) of the outline, in the plane."""
    blur: float
    """The spacing of the points, if they fill an area, and 0 if they are on curves."""
    weights: Reals
    """Weights (k,) of the points of the outline, by the density of all points."""


def flat_registered(source_points: Reals, target_points: Reals) -> Found:
    """Register two clouds of a plane, or of nearly one, in own units."""
    source, target = (_flat(cloud) for cloud in levels(source_points, target_points, _SEARCH))
    task = last = _task(source, target)
    fine = np.stack([hypothesis_refined(motor, task) for motor in _in_plane(source, target)])
    scores = np.array([support(motor, task) for motor in fine])
    fine = fine[different(fine, scores, task)]
    if max(len(source_points), len(target_points)) > 2 * _SEARCH:
        source, target = (_flat(cloud) for cloud in levels(source_points, target_points, _FINISH))
        last = _task(source, target)

    def same(best: Reals, motors: Reals) -> Reals:
        rough = _off(best, source, target, smooth=False) / np.sqrt(_SMOOTHED)
        off = np.array([_off(motor, source, target, smooth=True) for motor in motors])
        return np.asarray(off <= _WORSE * (off[0] + rough) + _EVEN * task.size)

    return solved(fine, task, last, (_LEAST_SUPPORT, _LEAST_GAIN), same)


def _flat(cloud: Cloud) -> _Flat:
    centre = cloud.centre
    offsets = cloud.points - centre
    axes = np.linalg.svd(np.sqrt(cloud.weights)[:, None] * offsets, full_matrices=False)[2]
    axes[2] = np.cross(axes[0], axes[1])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes.T, centre
    places = offsets @ axes[:2].T
    tree = scipy.spatial.cKDTree(places)
    near = tree.query(places, min(_NEIGHBOURS, len(places) - 1) + 1)[1][:, 1:]
    off = places[near] - places[:, None]
    angles = np.sort(np.arctan2(off[..., 1], off[..., 0]), 1)
    gaps = np.diff(angles, axis=1, append=angles[:, :1] + 2 * np.pi)
    rows = np.flatnonzero(gaps.max(1) > _GAP)
    if len(rows) < _FEWEST:
        rows = np.arange(len(places))
    wide = tree.query(places[rows], min(_WINDOW, len(places)))[1]
    edge, across, area = _edge(places, rows, wide)
    spatial = centre + edge @ axes[:2] + ((cloud.points[rows] - centre) @ axes[2])[:, None] * axes[2]
    return _Flat(
        cloud, np.asarray(pga3.motor_from_matrix(matrix)), axes[2], places, cloud_of(spatial), edge, across @ axes[:2],
        cloud.spacing * area, cloud.weights[rows],
    )  # fmt: skip


def _edge(places: Reals, rows: Reals, near: Reals) -> tuple[Reals, Reals, float]:
    """Return places of the outline, its normals in the plane, and the share of areas.

    Points at the edge of an area are inside by the spacing of the points. They are moved outward to the line through
    the outermost of their neighbours, which is nearer by an order of magnitude. Points on curves are not moved.
    """
    around = places[near] - places[rows][:, None]
    mean = around.mean(1)
    spread = np.einsum("nki,nkj->nij", around - mean[:, None], around - mean[:, None])
    extents = np.linalg.eigvalsh(spread)
    area = extents[:, 0] > _AREA * extents[:, 1]
    edge = places[rows]
    normals = _normals(edge)
    for _ in range(_ROUNDS):
        normals *= np.where(np.einsum("ni,ni->n", normals, mean) > 0, -1.0, 1.0)[:, None]
        outward = np.maximum(np.einsum("nki,ni->nk", around, normals).max(1), 0)
        edge = places[rows] + (area * outward)[:, None] * normals
        normals = _normals(edge)
    return edge, normals, float(area.mean())


def _normals(edge: Reals) -> Reals:
    near = scipy.spatial.cKDTree(edge).query(edge, min(_TANGENT, len(edge)))[1]
    off = edge[near] - edge[near].mean(1, keepdims=True)
    return np.asarray(np.linalg.eigh(np.einsum("nki,nkj->nij", off, off))[1][..., 0])


def _task(source: _Flat, target: _Flat) -> Task:
    size = min(source.cloud.size, target.cloud.size)
    reach = reach_of(min(target.cloud.spacing, target.outline.spacing), size)
    reach = Reach(reach.gate, max(reach.scale, _SCALE * max(source.blur, target.blur)))
    surface = planes_target(target.cloud, normals_of(target.cloud, target.normal))
    surface = replace(surface, across=0 * surface.across, along=0 * surface.along + 1)
    n = len(target.edge)
    outline = Surface(target.outline, target.across, np.zeros(n), np.ones(n))
    parts = (
        Part(source.cloud.points, source.cloud.weights, surface),
        Part(source.outline.points, source.weights, outline),
    )
    exact = Part(source.cloud.points, source.cloud.weights, points_target(target.cloud))
    beside = np.asarray(pga3.move_direction(target.frame, np.eye(3)[:2]))
    return Task(source.cloud, target.cloud, parts, (1 - _OUTLINE, _OUTLINE), reach, beside, exact)


def _in_plane(source: _Flat, target: _Flat) -> Reals:
    """Return motors of the highest correlations of densities and outlines, for all motions in the plane."""
    size = min(source.cloud.size, target.cloud.size)
    cell = _EXTENT * size / _CELLS
    angles = 2 * np.pi * np.arange(_TURNS) / _TURNS
    cos, sin = np.cos(angles), np.sin(angles)
    sides = np.array([1.0, -1.0])
    turns = np.stack([np.stack([cos, -sin], -1), np.stack([sin, cos], -1)], -2)
    # The other side is a half turn about the first axis, in the plane a mirror image.
    turns = (turns[None] * np.stack([np.ones(2), sides], -1)[:, None, None]).reshape(-1, 2, 2)
    scores = np.zeros((len(turns), _CELLS, _CELLS))
    whole = (source.places, source.cloud.weights), (target.places, target.cloud.weights)
    outlines = tuple((flat.edge, flat.weights) for flat in (source, target))
    for (mine, mine_weights), (other, weights) in (whole, outlines):
        density = scipy.ndimage.gaussian_filter(_density(other[None], weights, cell)[0], 1.0, mode="wrap")
        density = np.minimum(density, np.quantile(density[density > 0.05 * density.max()], 0.6))
        spectrum = scipy.fft.rfft2(density - density.mean())
        of_source = scipy.fft.rfft2(_density(np.einsum("tij,nj->tni", turns, mine), mine_weights, cell))
        found = scipy.fft.irfft2(spectrum * np.conj(of_source))
        scores += found / found.max()
    by_side = scores.reshape(2, _TURNS, _CELLS, _CELLS)
    peaks = scipy.ndimage.maximum_filter(by_side, (1, _ALIKE, _ALIKE, _ALIKE), mode="wrap") == by_side
    rows = np.flatnonzero(peaks)
    rows = rows[np.argsort(-by_side.ravel()[rows])[:_HYPOTHESES]]
    side, turn, *place = np.unravel_index(rows, by_side.shape)
    shift = np.stack(place, -1)
    matrix = np.tile(np.eye(4), (len(rows), 1, 1))
    matrix[:, :2, :2] = turns[side * _TURNS + turn]
    matrix[:, 2, 2] = sides[side]
    matrix[:, :2, 3] = np.where(shift >= _CELLS // 2, shift - _CELLS, shift) * cell
    inner = pga3.motor_from_matrix(matrix)
    return np.asarray(pga3.motor_product(target.frame, pga3.motor_product(inner, pga3.motor_inverse(source.frame))))


def _density(places: Reals, weights: Reals, cell: float) -> Reals:
    """Return densities (t, cells, cells) of places (t, n, 2); cells repeat periodically."""
    cells = np.floor(places / cell).astype(int) % _CELLS
    flat = (np.arange(len(places))[:, None] * _CELLS + cells[..., 0]) * _CELLS + cells[..., 1]
    count = len(places) * _CELLS**2
    grid = np.bincount(flat.ravel(), np.broadcast_to(weights, flat.shape).ravel(), count)
    return grid.reshape(-1, _CELLS, _CELLS)


def _off(motor: Reals, source: _Flat, target: _Flat, *, smooth: bool) -> float:
    """Return the median distance of smoothed surfaces, or without a smoothing that of points from their own surface.

    Neighbouring points of a side share bumps of the surface, but not the noise, which a mean reduces.
    """
    means = []
    for flat in (source, target):
        points = flat.cloud.points
        near = flat.cloud.tree.query(points, min(_SMOOTHED, len(points)))[1]
        means.append(points[near].mean(1))
    if not smooth:
        own = [
            np.abs((flat.cloud.points - mean) @ flat.normal) for flat, mean in zip((source, target), means, strict=True)
        ]
        return float(np.median(own[0]) + np.median(own[1]))
    surface = Surface(cloud_of(means[1]), *_normal_only(target.normal, len(means[1])))
    moved = np.asarray(pga3.move_point(motor, means[0]))
    distances = neighbours(surface, moved, np.inf, OWN * surface.cloud.spacing)[2]
    return float(np.median(distances))


def _normal_only(normal: Reals, count: int) -> tuple[Reals, Reals, Reals]:
    return np.tile(normal, (count, 1)), np.zeros(count), np.ones(count)
