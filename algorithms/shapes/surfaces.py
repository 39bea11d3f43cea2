"""Surfaces as closed triangulated graphs of nodes that carry motors (section 17.2)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from generated import pga3, shapes

from ..arguments import Reals, as_given, finite, moderate, real_array
from ..evidence import rank
from .images import checked_image, checked_spacing
from .surface_adaptation import is_folded, moved_nodes
from .surface_distances import dense_points, distances_to_samples, distances_to_triangles
from .surface_samples import Samples, samples_of_mask, samples_of_points, unit
from .surface_status import SurfaceStatus
from .triangulation import closed_triangles, components_and_genus, faults

_START, _GROWTH = 64, 1.6
"""Nodes of the first level, and the ratio of the numbers of nodes of successive levels."""
_LEVELS, _FULL = 16, 0.97
"""The most levels of growth, and the part of the most nodes at which it ends."""
_LLOYD = 4
"""A limit on work: moves of nodes to the means of their cells in each level."""
_LEAST_SAMPLES = 100
"""Samples that a surface needs: more than the nodes of the first level."""
_MEAN, _LARGEST = 0.003, 0.02
"""Limits of the distances, in diagonals of the bounding box."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A closed triangulated graph of nodes.

    Attributes
    ----------
    nodes : array, (n, 3)
    motors : array, (n, 8)
        Motors of `generated.pga3`, from the origin to the nodes; they turn the third axis to the normals.
    normals : array, (n, 3)
        Unit normals, outwards.
    curvatures : array, (n,)
        Mean curvatures by the spheres through the neighbours; positive where the surface is convex.
    triangles : array, (t, 3)
        Indices of nodes, counter-clockwise seen from outside.
    components, genus : int
        Closed surfaces, and the sum of their genera; -1 unless the graph is a closed manifold.
    mean_distances, largest_distances : tuple of float
        From the samples to the triangles, and from the triangles to the samples, each of which stands for a disc
        of twice the distance of its neighbours.
    diagonal : float
        Of the bounding box of the samples.
    curve : array, (k, 3)
        While the graph grew: nodes, mean and largest distance of the samples from the triangles.
    n_outliers : int
        Points that were left out.
    status : SurfaceStatus
    """

    nodes: Reals
    motors: Reals
    normals: Reals
    curvatures: Reals
    triangles: NDArray[np.intp]
    components: int
    genus: int
    mean_distances: tuple[float, float]
    largest_distances: tuple[float, float]
    diagonal: float
    curve: Reals
    n_outliers: int
    status: SurfaceStatus

    def transport(self, entity: ArrayLike, move: Callable[[Reals, Reals], Reals] = pga3.move_plane) -> Reals:
        """Move an entity of `generated.pga3` that is given at the origin, above the plane z = 0, to all nodes.

        Parameters
        ----------
        entity : array_like
            A plane, or what `move` moves.
        move : callable, optional
            `pga3.move_plane`, `pga3.move_line` or `pga3.move_point`.
        """
        return np.asarray(move(self.motors, entity))  # type: ignore[arg-type]


def surface(
    points_or_mask: ArrayLike,
    spacing: ArrayLike = (1, 1, 1),
    normals: ArrayLike | None = None,
    nodes: int = 4000,
    tolerance: float = 0.0015,
    start: Surface | None = None,
) -> Surface:
    """Grow a closed triangulated graph on the surface of points or of a mask.

    Parameters
    ----------
    points_or_mask : array_like, (n, 3) or (x, y, z)
        Points on a closed surface, or a volume whose voxels above zero are inside.
    spacing : array_like, (3,), optional
        Of the voxels of a mask.
    normals : array_like, (n, 3), optional
        Outward normals of points. By default they are estimated from neighbours.
    nodes : int, optional
        The most nodes.
    tolerance : float, optional
        Mean distance, in diagonals of the bounding box, at which the graph does not grow any more, once its largest
        distance is within the limits and its genus is that of the graph before.
    start : Surface, optional
        The surface before the shape moved. Its nodes follow the shape and its triangles are kept: row i of `motors`,
        times the inverse of row i before, is the motion of node i. The graph does not grow.

    Returns
    -------
    Surface
        Check its `status`.

    Raises
    ------
    ValueError
        If there are too few samples, or all are in a plane, or arguments are not in their range.
    """
    if nodes < _START:
        raise ValueError(f"nodes: {nodes}; expected at least {_START}")
    if not tolerance > 0:
        raise ValueError(f"tolerance: {tolerance}; expected a positive fraction of the diagonal")
    array = as_given(points_or_mask, "points_or_mask")
    outliers, euler = 0, None
    if array.ndim == 3:
        mask = checked_image(array, "mask", (3,)) > 0
        samples, euler = samples_of_mask(mask, checked_spacing(spacing, 3))
    else:
        points = moderate(finite(real_array(array, "points", (-1, 3), "points").astype(float), "points"), "points")
        _check_count(len(points))
        offsets = points - points.mean(0)
        if rank(offsets.T @ offsets) < 3:
            raise ValueError("points: all are in one plane; expected points on a closed surface")
        given = None
        if normals is not None:
            given = finite(real_array(normals, "normals", (len(points), 3), "vectors").astype(float), "normals")
        samples, outliers = samples_of_points(points, given)
    _check_count(len(samples.places))
    if start is not None:
        return _followed(start, samples, outliers, euler)
    return _grown(samples, nodes, tolerance, outliers, euler)


def _check_count(count: int) -> None:
    if count < _LEAST_SAMPLES:
        raise ValueError(f"points: {count} samples; expected at least {_LEAST_SAMPLES}; use a finer spacing")


@dataclass(frozen=True, eq=False)
class _Graph:
    nodes: Reals
    triangles: NDArray[np.intp]
    errors: Reals
    wrong: NDArray[np.intp]
    topology: tuple[int, int]


def _grown(samples: Samples, most: int, tolerance: float, outliers: int, euler: int | None) -> Surface:
    tree = scipy.spatial.cKDTree(samples.places)
    diagonal = float(np.linalg.norm(np.ptp(samples.places, 0)))
    most = min(most, len(samples.places) // 2)
    at = _spread(samples.places, min(_START, most))
    curve: list[tuple[float, float, float]] = []
    before: tuple[int, int] | None = None
    for _ in range(_LEVELS):
        at = _adapted(samples, tree, at)
        graph = _graph(samples, tree, at)
        curve.append((len(at), float(graph.errors.mean()), float(graph.errors.max())))
        near = graph.errors.mean() <= tolerance * diagonal and graph.errors.max() <= _LARGEST * diagonal
        stable = graph.topology == before and not len(graph.wrong)
        if euler is not None:
            stable &= 2 * (graph.topology[0] - graph.topology[1]) == euler
        # Nodes that meet at one sample become one, so that the most nodes may not be reached.
        if (near and stable) or len(at) >= _FULL * most:
            break
        before = graph.topology
        at = _inserted(samples, at, graph, min(most, int(_GROWTH * len(at)) + 1))
    return _result(samples, tree, graph, np.array(curve), diagonal, outliers, stable)


def _followed(before: Surface, samples: Samples, outliers: int, euler: int | None) -> Surface:
    """Adapt the nodes of a surface to the samples of a moved shape."""
    if before.genus < 0:
        raise ValueError(f"start: {before.status.name}; expected a closed surface")
    tree = scipy.spatial.cKDTree(samples.places)
    nodes = moved_nodes(before.nodes, before.normals, before.triangles, samples)
    topology = before.components, before.genus
    errors = distances_to_triangles(samples.places, nodes, before.triangles)
    graph = _Graph(nodes, before.triangles, errors, np.zeros(0, np.intp), topology)
    diagonal = float(np.linalg.norm(np.ptp(samples.places, 0)))
    stable = euler is None or 2 * (topology[0] - topology[1]) == euler
    found = _result(samples, tree, graph, before.curve, diagonal, outliers, stable, before.motors)
    if found.status is SurfaceStatus.OK and is_folded(nodes, before.triangles, samples, tree):
        return replace(found, status=SurfaceStatus.FOLDED)
    return found


def _spread(places: Reals, count: int) -> NDArray[np.intp]:
    """Return samples that are each far from those before them."""
    found = [int(np.argmax(np.linalg.norm(places - places.mean(0), axis=1)))]
    least = np.linalg.norm(places - places[found[0]], axis=1)
    for _ in range(count - 1):
        found.append(int(least.argmax()))
        least = np.minimum(least, np.linalg.norm(places - places[found[-1]], axis=1))
    return np.array(found)


def _adapted(samples: Samples, tree: scipy.spatial.cKDTree, at: NDArray[np.intp]) -> NDArray[np.intp]:
    """Move nodes to the samples nearest to the centroids of their cells, several times."""
    weights = np.ones(len(samples.places))
    for _ in range(_LLOYD):
        places = samples.places[at]
        _, winner = scipy.spatial.cKDTree(places).query(samples.places)
        shifts, sums, _ = shapes.sums_of_cells(samples.places, weights, winner, places)
        _, at = tree.query(places + shifts / np.maximum(sums, 1)[:, None])
        at = np.unique(at)
    return at


def _graph(samples: Samples, tree: scipy.spatial.cKDTree, at: NDArray[np.intp]) -> _Graph:
    places = samples.places[at]
    triangles = closed_triangles(places, samples, tree)
    if not len(triangles):
        far = np.linalg.norm(samples.places - places[scipy.spatial.cKDTree(places).query(samples.places)[1]], axis=1)
        return _Graph(places, triangles, far, np.arange(len(at)), (-1, -1))
    wrong = faults(triangles)
    errors = distances_to_triangles(samples.places, places, triangles)
    return _Graph(places, triangles, errors, wrong, (-1, -1) if len(wrong) else components_and_genus(triangles))


def _inserted(samples: Samples, at: NDArray[np.intp], graph: _Graph, size: int) -> NDArray[np.intp]:
    """Add the samples with the largest errors of the cells with the largest sums, first of those that are wrong."""
    _, winner = scipy.spatial.cKDTree(graph.nodes).query(samples.places)
    away = np.linalg.norm(samples.places - graph.nodes[winner], axis=1)
    cells = np.bincount(winner, graph.errors + 0.02 * away, minlength=len(at))
    cells[graph.wrong] += cells.max()
    chosen = np.argsort(-cells)[: size - len(at)]
    order = np.lexsort((graph.errors + 0.1 * away, winner))
    last = np.searchsorted(winner[order], chosen, side="right") - 1
    return np.unique(np.concatenate([at, order[last]]))


def _result(
    samples: Samples,
    tree: scipy.spatial.cKDTree,
    graph: _Graph,
    curve: Reals,
    diagonal: float,
    outliers: int,
    stable: bool,
    motors: Reals | None = None,
) -> Surface:
    used = np.unique(graph.triangles)
    triangles = np.searchsorted(used, graph.triangles)
    nodes = graph.nodes[used]
    if not len(used):
        empty = np.zeros((0, 3))
        status, far = SurfaceStatus.NOT_MANIFOLD, (np.inf, np.inf)
        return Surface(empty, np.zeros((0, 8)), empty, np.zeros(0), triangles, -1, -1, far, far, diagonal, curve,
                       outliers, status)  # fmt: skip
    a, b, c = triangles.T
    normals = unit(np.asarray(shapes.normals_of_triangles(nodes, a, b, c)))
    if motors is None:
        motors = np.zeros((len(nodes), 8))
        motors[:, 0] = 1
    motors = np.asarray(shapes.moved_surface_nodes(motors, nodes, normals))
    sums, counts = shapes.curvatures_of_edges(nodes, normals, triangles.ravel(), np.roll(triangles, -1, 1).ravel())
    back = distances_to_samples(dense_points(nodes, triangles)[0], samples, tree)
    mean = float(graph.errors.mean()), float(back.mean())
    largest = float(graph.errors.max()), float(back.max())
    status = SurfaceStatus.OK
    if len(graph.wrong):
        status = SurfaceStatus.NOT_MANIFOLD
    elif max(mean[0], mean[1]) > _MEAN * diagonal or largest[0] > _LARGEST * diagonal:
        status = SurfaceStatus.TOO_FAR
    elif largest[1] > _LARGEST * diagonal:
        status = SurfaceStatus.HOLES
    elif not stable:
        status = SurfaceStatus.UNSTABLE
    return Surface(nodes, motors, normals, np.asarray(sums / counts), triangles, *graph.topology, mean, largest,
                   diagonal, curve, outliers, status)  # fmt: skip
