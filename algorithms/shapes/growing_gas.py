"""Growing neural gas whose nodes are motors, for clouds and images (section 17.1.2).

Fritzke, *A growing neural gas network learns topologies*, 1995; Martinetz and Schulten, *Topology representing
networks*, 1994. All samples are presented at once: a node goes to the mean of its cell, as in Lloyd's algorithm.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from generated import pga2, pga3, shapes

from ..arguments import Reals, moderate, real_array, whole_number
from ..evidence import WRONG
from ..precision import TINY
from .gas_status import GasStatus
from .gas_topology import Integers, betti_numbers, witnessed
from .images import checked_image

_FEWEST = 8
"""Nodes of the first stage: fewer do not show a loop in each direction."""
_CELLS = {1: 12, 2: 32}
"""From a probability: samples of a cell of a curve and of a surface. An edge of a curve is without two witnesses with a
probability of exp(-12) (1 + 12); cells of surfaces have three edges each, some of them short."""
_CELL_OF_PIXELS = 6
"""The same for edges of images, whose samples are evenly spaced."""
_GROWTH = 1.3
"""Number of nodes of a stage of growth, in units of that of the previous one."""
_ROUNDS, _LAST_ROUNDS = 4, 20
"""Limits on work: moves of all nodes to the means of their cells in a stage, and in the last one."""
_FLAT = 1 / 3
"""Deviation of a cell across the shape, in units of that along it, from which on nodes would follow the noise."""
_STABLE = 2.0
"""Ratio of numbers of nodes over which the topology must be the same."""
_SMOOTH = 1.0
"""Deviation, in pixels, of the filter whose derivative finds edges."""


@dataclass(frozen=True, eq=False)
class NeuralGas:
    """A graph of motors.

    Attributes
    ----------
    motors : array, (n, 4) or (n, 8)
        Of `generated.pga2` or `generated.pga3`: they take the origin to the places of the nodes, and the last axis to
        the axes. One entity at the origin, moved by them, becomes the shape.
    nodes : array, (n, d)
        Places of the nodes.
    axes : array, (n, d)
        Unit normals of curves in the plane and of surfaces, tangents of curves in space. Their signs are arbitrary.
    edges : int array, (e, 2)
        Rows of nodes that are neighbours.
    betti : tuple of int
        Numbers of parts, of loops, and of cavities.
    error : float
        Root mean square of the distances of the samples from their nearest nodes.
    status : GasStatus
    samples : array, (m, d)
        The finite samples.
    stages : list of (int, float, tuple of int)
        Nodes, error and Betti numbers of each stage of growth.
    """

    motors: Reals
    nodes: Reals
    axes: Reals
    edges: Integers
    betti: tuple[int, int, int]
    error: float
    status: GasStatus
    samples: Reals
    stages: list[tuple[int, float, tuple[int, int, int]]]


def neural_gas(
    points: ArrayLike, n_nodes: int | None = None, *, dimension: int | None = None, seed: int = 0
) -> NeuralGas:
    """Grow a graph of motors on unordered samples of curves or surfaces.

    Nodes are inserted between a node with a large error and its worst neighbour, halfway on the screw motion between
    their motors. Two nodes are neighbours if they are the nearest two of a sample of curves, or of the nearest three of
    a sample of surfaces.

    Parameters
    ----------
    points : array_like, (m, 2) or (m, 3)
        Samples in any order. Rows with NaN or infinite numbers are ignored.
    n_nodes : int, optional
        The number of nodes. By default one for 12 samples of a curve or 32 of a surface, but fewer if cells would be as
        wide as the noise.
    dimension : int, optional
        1 for curves, which is the default in the plane, or 2 for surfaces, the default in space.
    seed : int, optional
        Of the choice of the first nodes.

    Returns
    -------
    NeuralGas

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or is out of its range.
    """
    array = real_array(points, "points", (-1,), "points").astype(float)
    if array.ndim != 2 or array.shape[1] not in (2, 3):
        raise ValueError(f"points: shape {array.shape}; expected (m, 2) or (m, 3)")
    d = array.shape[1]
    size = d - 1 if dimension is None else whole_number(dimension, "dimension", 1)
    if size not in (1, 2) or size >= d:
        raise ValueError(f"dimension: {dimension!r}; expected 1{' or 2' if d == 3 else ' in the plane'}")
    if n_nodes is not None and (isinstance(n_nodes, bool) or not isinstance(n_nodes, (int, np.integer)) or n_nodes < 3):
        raise ValueError(f"n_nodes: {n_nodes!r}; expected an integer of at least 3")
    samples = array[np.isfinite(array).all(1)]
    moderate(samples, "points")
    distinct = np.unique(samples, axis=0)
    wanted = len(samples) // _CELLS[size] if n_nodes is None else int(n_nodes)
    if min(len(distinct) // 2, wanted) < (_FEWEST if n_nodes is None else 3):
        return _unconnected(samples, distinct)
    start = np.random.default_rng(seed).permutation(len(distinct))[: min(_FEWEST, wanted)]
    found, widths = _Growing(samples, distinct[start], size).with_nodes(wanted)
    if n_nodes is None and widths[-1] > _FLAT:
        found, widths = _Growing(samples, distinct[start], size).with_nodes(found.stages[int(np.argmin(widths))][0])
    return found if min(widths) <= _FLAT else replace(found, status=GasStatus.UNCERTAIN)


def neural_gas_of_image(image: ArrayLike, n_nodes: int | None = None, *, seed: int = 0) -> NeuralGas:
    """Grow a graph of motors on the edges of an image.

    Samples are the maxima of the gradient along its direction, to a fraction of a pixel, where the gradient is larger
    than that of noise at any pixel. The noise is estimated from the differences of neighbouring pixels.

    Parameters
    ----------
    image : array_like, (rows, columns)
    n_nodes, seed
        As of `neural_gas`.

    Returns
    -------
    NeuralGas
        Coordinates are row and column.
    """
    samples = _edge_samples(np.asarray(checked_image(image, "image", (2,)), float))
    count = max(len(samples) // _CELL_OF_PIXELS, _FEWEST) if n_nodes is None else n_nodes
    return neural_gas(samples, count, seed=seed)


def _edge_samples(image: Reals) -> Reals:
    if min(image.shape) < 3:
        return np.zeros((0, 2))
    slopes = np.stack([scipy.ndimage.gaussian_filter(image, _SMOOTH, order) for order in ((1, 0), (0, 1))])
    size = np.hypot(*slopes)
    second = image[:, 2:] - 2 * image[:, 1:-1] + image[:, :-2]
    noise = float(np.median(np.abs(second))) / (0.6745 * 6**0.5)
    # The deviation of a derivative of a Gaussian filter; the length of two has Rayleigh's distribution.
    deviation = max(noise, 1e-6 * float(np.ptp(image))) / np.sqrt(8 * np.pi) / _SMOOTH**2
    least = deviation * np.sqrt(2 * np.log(image.size / WRONG))
    rows, columns = np.nonzero(size > least)
    at = np.stack([rows, columns], 1).astype(float)
    along = (slopes[:, rows, columns] / size[rows, columns]).T
    before, after = (
        scipy.ndimage.map_coordinates(size, (at + sign * along).T, order=1, mode="nearest") for sign in (-1, 1)
    )
    here = size[rows, columns]
    top = (here >= before) & (here > after)
    bend = np.where(top, 2 * here - before - after, 1)
    shift = np.where(top, 0.5 * (after - before) / np.maximum(bend, TINY), 0)
    return np.asarray((at + shift[:, None] * along)[top])


@dataclass(eq=False)
class _Growing:
    """Nodes, which move to their cells and multiply."""

    samples: Reals
    nodes: Reals
    dimension: int
    motors: Reals = field(init=False)

    def __post_init__(self) -> None:
        self.motors = np.eye(4 if self.samples.shape[1] == 2 else 8)[:1].repeat(len(self.nodes), 0)
        self.ones = np.ones(len(self.samples))

    def with_nodes(self, wanted: int) -> tuple[NeuralGas, list[float]]:
        """Return the gas with a number of nodes, and the relative width of cells in each stage."""
        stages: list[tuple[int, float, tuple[int, int, int]]] = []
        widths: list[float] = []
        while True:
            self._settle(_ROUNDS)
            nearest, errors, width = self._cells()
            edges, _ = witnessed(nearest, len(self.nodes))
            stages.append((len(self.nodes), self._error(), betti_numbers(edges, len(self.nodes))))
            widths.append(width)
            is_grown = len(stages) < 2 or len(self.nodes) > stages[-2][0]
            if len(self.nodes) >= wanted or not is_grown:
                break
            self._insert(edges, errors, min(wanted, int(np.ceil(_GROWTH * len(self.nodes)))) - len(self.nodes))
        self._settle(_LAST_ROUNDS)
        nearest, _, _ = self._cells()
        edges, times = witnessed(nearest, len(self.nodes))
        betti = betti_numbers(edges, len(self.nodes))
        others = [found for count, _, found in stages if count * _STABLE >= len(self.nodes)]
        others.append(betti_numbers(edges[times > 1], len(self.nodes)))
        status = GasStatus.OK if all(found == betti for found in others) else GasStatus.UNCERTAIN
        axes = self._axes()
        return NeuralGas(
            self.motors, self.nodes, axes, edges, betti, self._error(), status, self.samples, stages
        ), widths

    def _settle(self, rounds: int) -> None:
        """Move nodes to the means of their cells, and turn them. Nodes without samples are left out."""
        for _ in range(rounds):
            shift, weight, _ = self._sums(self._winners(1)[:, 0])
            kept = weight > 0
            self.nodes = (self.nodes + shift / np.maximum(weight, 1)[:, None])[kept]
            self.motors = self.motors[kept]

    def _error(self) -> float:
        distance, _ = scipy.spatial.cKDTree(self.nodes).query(self.samples)
        return float(np.sqrt(np.mean(distance**2)))

    def _winners(self, count: int) -> Integers:
        found = scipy.spatial.cKDTree(self.nodes).query(self.samples, min(count, len(self.nodes)))[1]
        return np.asarray(found).reshape(len(self.samples), -1)

    def _sums(self, winner: Integers) -> tuple[Reals, Reals, Reals]:
        spatial = [np.pad(x, [(0, 0), (0, 3 - x.shape[1])]) for x in (self.samples, self.nodes)]
        shift, weight, square = shapes.sums_of_cells(spatial[0], self.ones, winner, spatial[1])
        return np.asarray(shift)[:, : self.samples.shape[1]], np.asarray(weight), np.asarray(square)

    def _cells(self) -> tuple[Integers, Reals, float]:
        """Turn the nodes; return the nearest nodes of samples, errors of cells, and how wide cells are."""
        nearest = self._winners(self.dimension + 1)
        _, _, errors = self._sums(nearest[:, 0])
        d = self.samples.shape[1]
        # The samples of a node are those of its cell and of those next to it.
        owner = nearest[:, :2].ravel()
        offsets = np.repeat(self.samples, 2, 0) - self.nodes[owner]
        squares = offsets[:, :, None] * offsets[:, None, :]
        table = np.stack(
            [np.bincount(owner, squares[:, i, j], len(self.nodes)) for i in range(d) for j in range(d)], 1
        ).reshape(-1, d, d)
        values, vectors = np.linalg.eigh(table)
        across, along = values[:, : d - self.dimension].mean(1), values[:, d - self.dimension :].mean(1)
        width = float(np.median(np.sqrt(np.maximum(across, 0) / np.maximum(along, TINY))))
        axes = vectors[:, :, 0 if self.dimension == d - 1 else -1]
        axes = axes * np.where((axes * self._axes()).sum(1) < 0, -1.0, 1.0)[:, None]
        moved = shapes.moved_contour_nodes if d == 2 else shapes.moved_surface_nodes
        self.motors = np.asarray(moved(self.motors, self.nodes, axes))
        return nearest, errors, width

    def _axes(self) -> Reals:
        if self.samples.shape[1] == 2:
            return np.asarray(pga2.move_direction(self.motors, [0.0, 1.0]))
        return np.asarray(pga3.move_direction(self.motors, [0.0, 0.0, 1.0]))

    def _insert(self, edges: Integers, errors: Reals, count: int) -> None:
        """Insert nodes halfway between those with the largest errors and their worst neighbours."""
        both = np.concatenate([edges, edges[:, ::-1]])
        order = np.lexsort((errors[both[:, 1]], both[:, 0]))
        own, other = both[order].T
        last = np.flatnonzero(np.append(own[1:] != own[:-1], True))
        worst = last[np.argsort(-errors[own[last]], kind="stable")[:count]]
        pairs = np.unique(np.sort(np.stack([own[worst], other[worst]], 1), axis=1), axis=0)
        planar = self.samples.shape[1] == 2
        halfway: Any = pga2.interpolate_motors if planar else pga3.interpolate_motors
        new = np.asarray(halfway(self.motors[pairs[:, 0]], self.motors[pairs[:, 1]], 0.5))
        places = (pga2 if planar else pga3).move_point(new, np.zeros(self.samples.shape[1]))
        # Halfway between two parts there are no samples: the nearest one is next to one of the parts.
        places = self.samples[scipy.spatial.cKDTree(self.samples).query(places)[1]]
        self.motors, self.nodes = np.concatenate([self.motors, new]), np.concatenate([self.nodes, places])


def _unconnected(samples: Reals, distinct: Reals) -> NeuralGas:
    d = samples.shape[1]
    motors = np.eye(4 if d == 2 else 8)[:1].repeat(len(distinct), 0)
    axes = np.tile(np.eye(d)[-1], (len(distinct), 1))
    moved = shapes.moved_contour_nodes if d == 2 else shapes.moved_surface_nodes
    placed = np.asarray(moved(motors, distinct, axes)) if len(distinct) else motors
    none: NDArray[np.intp] = np.zeros((0, 2), np.intp)
    parts = len(distinct), 0, 0
    return NeuralGas(placed, distinct, axes, none, parts, 0.0, GasStatus.TOO_FEW_POINTS, samples, [])
