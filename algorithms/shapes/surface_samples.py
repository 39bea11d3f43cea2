"""Samples of a surface: outliers, normals by planes of neighbours, and their orientation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from generated import shapes

from ..arguments import Reals
from .boundary_meshes import boundary_mesh

_NEIGHBOURS = 12
"""Nearest samples to which a plane is fitted."""
_SPARSE, _DENSE, _FLAT = 1.7, 0.4, 0.1
"""Reach of the neighbours of an outlier, in the quantile of all; ratio of variances of neighbours that are flat."""
_ALONE, _OFF = 2.5, 1.1
"""Reach of an outlier in those of its neighbours, and distance from their plane in distances of samples."""
_PART = 0.01
"""Part of the points in the smallest component."""
_ROUNDS = 8
"""A limit on work: how often outliers are removed."""


class Samples(NamedTuple):
    """Places (n, 3), unit normals (n, 3), outwards, and the distance of neighbouring samples."""

    places: Reals
    normals: Reals
    spacing: float


def samples_of_mask(mask: NDArray[np.bool_], spacing: Reals) -> tuple[Samples, int]:
    """Return the vertices of the smoothed boundary of a mask, and the Euler number of that boundary."""
    mesh = boundary_mesh(mask, spacing)
    a, b, c, d = mesh.faces.T
    corners = [np.concatenate(pair) for pair in ((a, a), (b, c), (c, d))]
    normals = np.asarray(shapes.normals_of_triangles(mesh.vertices, *corners))
    return Samples(mesh.vertices, unit(normals), float(spacing.max())), 2 * _euler_number(mask)


def _euler_number(mask: NDArray[np.bool_]) -> int:
    """Return the Euler number of the voxels inside as nodes, with cells between those that have common faces."""
    cells = [mask]
    for axis in range(3):
        low, high = (slice(None),) * axis + (slice(None, -1),), (slice(None),) * axis + (slice(1, None),)
        cells += [cell[low] & cell[high] for cell in cells]
    signs = [(-1) ** bin(k).count("1") for k in range(8)]
    return sum(sign * int(cell.sum()) for sign, cell in zip(signs, cells, strict=True))


def samples_of_points(points: Reals, normals: Reals | None) -> tuple[Samples, int]:
    """Remove outliers, and estimate normals unless they are given. Return the number of outliers as well."""
    kept = np.arange(len(points))
    for _ in range(_ROUNDS):
        distances, rows = scipy.spatial.cKDTree(points[kept]).query(points[kept], _NEIGHBOURS + 1)
        good = _near_surface(points[kept], distances, rows)
        if good.all() or good.sum() <= 2 * _NEIGHBOURS:
            break
        kept = kept[good]
    places = points[kept]
    distances, rows = scipy.spatial.cKDTree(places).query(places, _NEIGHBOURS + 1)
    given = _oriented(places, _planes(places, rows)[0], rows) if normals is None else unit(normals[kept])
    return Samples(places, given, float(np.median(distances[:, _NEIGHBOURS // 3]))), len(points) - len(kept)


def unit(vectors: Reals) -> Reals:
    """Divide vectors by their lengths; zeros remain."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(lengths > 0, lengths, 1))


def _near_surface(points: Reals, distances: Reals, rows: NDArray[np.intp]) -> NDArray[np.bool_]:
    reach, step = distances[:, -1], np.median(distances[:, _NEIGHBOURS // 3])
    _, off, flat = _planes(points, rows)
    usual = np.quantile(reach, _DENSE)
    sparse = (reach > _SPARSE * usual) & ~flat | (reach > _ALONE * np.median(reach[rows[:, 1:]], 1))
    # Samples of uneven density are compared with those around them.
    far = off > _OFF * np.maximum(step, np.median(distances[rows[:, 1:], _NEIGHBOURS // 3], 1))
    near = distances[:, 1:5] <= _ALONE * step
    first = np.repeat(np.arange(len(points)), 4).reshape(-1, 4)
    graph = scipy.sparse.coo_array(
        (np.ones(int(near.sum()), np.int8), (first[near], rows[:, 1:5][near])), (len(points),) * 2
    )
    _, labels = scipy.sparse.csgraph.connected_components(graph, directed=False)
    small = ~flat & (np.bincount(labels)[labels] < _PART * len(points))
    return np.asarray(~(sparse | far | small))


def _planes(points: Reals, rows: NDArray[np.intp]) -> tuple[Reals, Reals, NDArray[np.bool_]]:
    """Return the normals of the planes of neighbours, the distances of the points from them, and which are flat."""
    near = points[rows[:, 1:]]
    centres = near.mean(1)
    rest = near - centres[:, None]
    values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", rest, rest))
    normals = vectors[:, :, 0]
    return normals, np.abs(((points - centres) * normals).sum(1)), values[:, 0] < _FLAT * values[:, 1]


def _oriented(points: Reals, normals: Reals, rows: NDArray[np.intp]) -> Reals:
    """Orient normals along the tree of neighbours with the most equal directions, outwards at extreme points."""
    count, k = rows.shape[0], rows.shape[1] - 1
    a, b = np.repeat(np.arange(count), k), rows[:, 1:].ravel()
    cost = 1.0 + 1e-6 - np.abs((normals[a] * normals[b]).sum(1))
    graph = scipy.sparse.coo_array((cost, (a, b)), (count, count)).tocsr()
    graph = graph.maximum(graph.T)
    tree = scipy.sparse.csgraph.minimum_spanning_tree(graph)
    tree = tree + tree.T
    parts, labels = scipy.sparse.csgraph.connected_components(tree, directed=False)
    signs = np.ones(count)
    up = int(np.argmax(points.std(0)))
    for part in range(parts):
        members = np.flatnonzero(labels == part)
        top = int(members[np.argmax(points[members, up])])
        order, before = scipy.sparse.csgraph.breadth_first_order(tree, top, directed=False)
        same = np.sign((normals[order[1:]] * normals[before[order[1:]]]).sum(1))
        signs[top] = 1.0 if normals[top, up] >= 0 else -1.0
        for node, parent, sign in zip(order[1:].tolist(), before[order[1:]].tolist(), same.tolist(), strict=True):
            signs[node] = signs[parent] * (sign or 1.0)
    return normals * signs[:, None]
