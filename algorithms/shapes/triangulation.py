"""Closed triangulations of nodes: facets of the Delaunay complex between its inside and its outside."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from ..arguments import Reals
from ..precision import NEGLIGIBLE, ROUNDING, TINY
from .surface_samples import Samples

Triangles = NDArray[np.intp]
_VOTES = 6
"""The number of samples whose normals decide whether a point is inside."""
_REPAIRS = 30
"""A limit on work: how often small parts on the wrong side of the surface are moved to the other one."""
_FACETS = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
"""Facets opposite to each corner of a tetrahedron, counter-clockwise from outside if its volume is positive."""


def closed_triangles(nodes: Reals, samples: Samples, tree: scipy.spatial.cKDTree) -> Triangles:
    """Return the facets (t, 3) between tetrahedra whose circumcentres are inside and outside of the samples."""
    cells = scipy.spatial.Delaunay(nodes)
    corners = cells.simplices.astype(np.intp)
    p = nodes[corners]
    edges = p[:, 1:] - p[:, :1]
    volume = np.linalg.det(edges)
    flat = np.abs(volume) < ROUNDING * np.abs(edges).max((1, 2)) ** 3
    safe = np.where(flat[:, None, None], np.eye(3), edges)
    centres = p[:, 0] + np.linalg.solve(safe, (edges**2).sum(2)[:, :, None] / 2)[:, :, 0]
    centres = np.where(flat[:, None], p.mean(1), centres)
    low, high = samples.places.min(0), samples.places.max(0)
    inside = ((centres >= low) & (centres <= high)).all(1)
    inside[inside] = is_inside(centres[inside], samples, tree)
    neighbours = cells.neighbors.astype(np.intp)
    for _ in range(_REPAIRS):
        minor = _minor_parts(corners, neighbours, inside)
        if not minor.any():
            break
        inside = inside ^ minor
    beyond = np.append(inside, False)[neighbours]
    cell, facet = np.nonzero(inside[:, None] & ~beyond)
    found = corners[cell[:, None], _FACETS[facet]]
    return np.asarray(np.where((volume[cell] < 0)[:, None], found[:, ::-1], found))


def _minor_parts(corners: Triangles, neighbours: Triangles, inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Mark tetrahedra at a node that are apart from the most of those inside, or of those outside.

    Where neither are in several parts, the surface around the node is a disc.
    """
    count, size = len(corners), int(corners.max()) + 1
    label = np.append(inside, False)
    cell, facet = np.nonzero(label[neighbours] == inside[:, None])
    beyond = neighbours[cell, facet]
    pairs = []
    for step in range(1, 4):
        corner = (facet + step) % 4
        node = corners[cell, corner]
        same = np.where(beyond >= 0, 4 * beyond + np.argmax(corners[beyond] == node[:, None], 1), 4 * count + node)
        pairs.append(np.column_stack([4 * cell + corner, same]))
    a, b = np.concatenate(pairs).T
    total = 4 * count + size
    _, part = scipy.sparse.csgraph.connected_components(
        scipy.sparse.coo_array((np.ones(len(a), np.int8), (a, b)), (total, total)), directed=False
    )
    weight = np.ones(total)
    weight[4 * count :] = 0
    at, facet = np.nonzero(neighbours < 0)
    weight[4 * count + np.concatenate([corners[at, (facet + step) % 4] for step in range(1, 4)])] = 4 * count
    weights = np.bincount(part, weight)
    key = np.append(2 * corners.ravel() + np.repeat(inside, 4), 2 * np.arange(size))
    most = np.zeros(2 * size)
    np.maximum.at(most, key, weights[part])
    # Of equal parts, the first one counts as the larger one.
    first = np.full(2 * size, len(weights))
    largest = weights[part] == most[key]
    np.minimum.at(first, key[largest], part[largest])
    minor = (part != first[key])[: 4 * count]
    return np.asarray(minor.reshape(-1, 4).any(1))


def is_inside(points: Reals, samples: Samples, tree: scipy.spatial.cKDTree) -> NDArray[np.bool_]:
    """Decide by the normals of the nearest samples."""
    _, rows = tree.query(points, _VOTES)
    away = points[:, None] - samples.places[rows]
    lengths = np.linalg.norm(away, axis=2)
    cosines = (away * samples.normals[rows]).sum(2) / np.maximum(lengths, TINY)
    return np.asarray((cosines / np.maximum(lengths, 1e-12 + NEGLIGIBLE * lengths.max(initial=0))).sum(1) < 0)


def faults(triangles: Triangles) -> NDArray[np.intp]:
    """Return the nodes at which a triangulation is not a closed oriented manifold: none if it is one."""
    if not len(triangles):
        return np.zeros(0, np.intp)
    a, b = triangles.ravel(), np.roll(triangles, -1, 1).ravel()
    size = int(triangles.max()) + 1
    keys, counts = np.unique(a * size + b, return_counts=True)
    back = np.isin(keys // size + keys % size * size, keys)
    wrong = keys[(counts != 1) | ~back]
    # The triangles around a node form one cycle if those that share an edge at the node are connected.
    t = np.repeat(np.arange(len(triangles)), 3)
    corner = 3 * t + np.tile([0, 1, 2], len(triangles))
    order = np.argsort(b * size + a, kind="stable")
    at = np.minimum(np.searchsorted((b * size + a)[order], a * size + b), len(order) - 1)
    other = order[at]
    # Edge a to b of one triangle and b to a of another: corners at a are `corner` and the one after `other`.
    after = 3 * (other // 3) + (other % 3 + 1) % 3
    ok = a[after] == a[corner]
    graph = scipy.sparse.coo_array((np.ones(int(ok.sum())), (corner[ok], after[ok])), (len(a), len(a)))
    _, labels = scipy.sparse.csgraph.connected_components(graph, directed=False)
    fans = np.bincount(np.unique(np.column_stack([a, labels]), axis=0)[:, 0], minlength=size)
    return np.unique(np.concatenate([wrong // size, wrong % size, np.flatnonzero(fans > 1)]))


def components_and_genus(triangles: Triangles) -> tuple[int, int]:
    """Return the number of connected surfaces, and the sum of their genera, of a closed manifold."""
    used = np.unique(triangles)
    a, b = triangles.ravel(), np.roll(triangles, -1, 1).ravel()
    size = int(used.max()) + 1
    count = len(np.unique(np.minimum(a, b) * size + np.maximum(a, b)))
    labels = scipy.sparse.csgraph.connected_components(
        scipy.sparse.coo_array((np.ones(len(a)), (a, b)), (size, size)), directed=False
    )[1]
    parts = len(np.unique(labels[used]))
    return parts, parts - (len(used) - count + len(triangles)) // 2
