"""Deformable registration: smooth displacements of a cloud, with soft correspondences from coarse to fine."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, finite_number, moderate, real_array
from ..precision import NEGLIGIBLE, TINY
from .vote_status import DeformStatus

_NODES = 6000
"""Points of the source that carry displacements; those of larger clouds are interpolated."""
_NEIGHBOURS, _CANDIDATES, _INTERPOLATED = 8, 60, 4
"""Neighbours whose displacements are similar; the most possible partners of a target; and nodes between which
displacements are interpolated."""
_START, _END, _FACTOR = 2.0, 0.14, 0.92
"""First and last radius of correspondences in units of the spacing, and the factor from step to step."""
_SOFTEST = 0.02
"""The last stiffness, in units of the first one."""
_FITTED = 30
"""A limit on work: points of the source whose displacements give that of a further point."""
_AT_ONCE = 4096
"""A limit on memory: further points whose displacements are computed at once."""
_MISSING = 0.01
"""The weight of the hypothesis that a target has no partner."""
_MATCHED = 0.05
"""The weight from which on the spread of a point's targets measures its uncertainty."""
_NEAR, _ENOUGH = 0.5, 0.8
"""Distance from the target, in units of the spacing, within which displaced points fit, and the share that must."""
_FAR = 2.0
"""Distance, in units of the spacing, from which on a point has no correspondence."""
_CLOSED, _MOST = 0.5, 0.95
"""Distance, in units of the spacing, within which points return to their places, and the share that must."""
_STILL = 0.02
"""The mean displacement of the last step, in units of the spacing, up to which the displacements have converged."""


@dataclass(frozen=True, eq=False)
class Deformation:
    """Displacements of a source cloud onto a target.

    Attributes
    ----------
    points : array, (n, d)
        The displaced points; rows that are not finite remain so.
    correspondences : int array, (n,)
        The row of the target that is nearest to each displaced point, -1 for points without one.
    uncertainties : array, (n,)
        Root mean square distance, for each coordinate, of the targets with which a point was matched in the last step,
        by their weights, or of the nearest target if that is farther; infinite for points without a correspondence.
    status : DeformStatus
        OK promises three things. Four fifths of the displaced points are within half a spacing of the target, the last
        step moved points by less than 2 % of a spacing, and the same method with both clouds exchanged takes 95 % of
        the displaced points back to within half a spacing of their places. It does not promise that each partner is
        right: where the surface can slide along itself, both directions may agree on a wrong one.
    closed : float
        The share of points that return to their places; NaN where another check failed before.
    """

    points: Reals
    correspondences: NDArray[np.int64]
    uncertainties: Reals
    status: DeformStatus
    closed: float = np.nan
    _nodes: Reals | None = field(default=None, repr=False)
    _shift: Reals | None = field(default=None, repr=False)

    def warp(self, points: ArrayLike) -> Reals:
        """Displace further points, such as those of a denser cloud.

        The spline is that of least bending through the displacements of the source, from 30 neighbours. Linear maps are
        continued exactly, and displacements of planes in space are continued along their normals. Far from the source,
        displacements are a guess.

        Parameters
        ----------
        points : array_like, (..., d)
            Points near the source.

        Returns
        -------
        array, (..., d)
            The displaced points; unchanged if the source was, and NaN for points that are not finite.
        """
        d = self.points.shape[1]
        places = np.array(real_array(points, "points", (d,), "points"), float)
        rows = places.reshape(-1, d)
        known = np.isfinite(rows).all(1)
        rows[~known] = np.nan
        if self._nodes is None or self._shift is None or not known.any():
            return places
        moderate(rows[known], "points")
        rows[known] += _spline(self._nodes, self._shift, rows[known])
        return places


def _spline(nodes: Reals, shift: Reals, places: Reals) -> Reals:
    """Return the displacements at places (n, d) of the spline of least bending through those of the nearest nodes."""
    count, d = min(_FITTED, len(nodes)), nodes.shape[1]
    tree, found = scipy.spatial.cKDTree(nodes), np.empty_like(places)
    for part in np.array_split(np.arange(len(places)), -(-len(places) // _AT_ONCE)):
        near = tree.query(places[part], range(1, count + 1))[1]
        off = nodes[near] - places[part, None]
        off /= np.maximum(np.linalg.norm(off, axis=-1).max(-1), TINY)[:, None, None]
        system = np.zeros((len(part), count + 1 + d, count + 1 + d))
        system[:, :count, :count] = -np.linalg.norm(off[:, :, None] - off[:, None], axis=-1)
        system[:, :count, count], system[:, :count, count + 1 :] = 1, off
        system[:, count:, :count] = system[:, :count, count:].swapaxes(1, 2)
        # Nodes that nearly coincide may differ. Those in a plane leave the slope along its normal open: it is 0 then.
        nearest = np.arange(count)
        system[:, nearest, nearest] = NEGLIGIBLE
        slopes = np.arange(count + 1, count + 1 + d)
        system[:, slopes, slopes] = -NEGLIGIBLE
        values = np.zeros((len(part), count + 1 + d, d))
        values[:, :count] = shift[near]
        weights = np.linalg.solve(system, values)
        found[part] = weights[:, count] - np.einsum("nk,nkd->nd", np.linalg.norm(off, axis=-1), weights[:, :count])
    return found


def register_deformable(
    source: ArrayLike,
    target: ArrayLike,
    *,
    stiffness: float = 0.1,
    radius: float | None = None,
    descriptors: tuple[ArrayLike, ArrayLike] | None = None,
) -> Deformation:
    """Displace the points of a source smoothly onto a target.

    In each step, the targets distribute their weights among the nearest displaced points, and a sparse linear system
    gives the displacements, smooth in the graph of neighbours: those of a linear map cost nothing. The radius of
    correspondences decreases from step to step. Clouds must be roughly aligned. A result that fits is checked by the
    displacements of the target onto the source, which takes as long again.

    Parameters
    ----------
    source, target : array_like, (n, d), (m, d)
        Clouds of 2 or 3 dimensions. Rows that are not finite are ignored.
    stiffness : float, optional
        The weight of smoothness in the first step; it decreases to a fiftieth.
    radius : float, optional
        The first radius of correspondences. By default twice the median distance from a point of the source to
        its nearest neighbour at the density of its nodes.
    descriptors : pair of array_like, (n, k) and (m, k), optional
        Numbers that are similar at corresponding points, such as multiples of normals. Their distances count as those
        of coordinates.

    Returns
    -------
    Deformation

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or `stiffness` or `radius` is not positive.
    """
    places, others = _cloud(source, "source"), _cloud(target, "target")
    d = places.shape[1]
    if others.shape[1] != d:
        raise ValueError(f"target: {others.shape[1]} coordinates; expected {d}, as those of the source")
    if finite_number(stiffness, "stiffness") <= 0:
        raise ValueError(f"stiffness: {stiffness}; expected a positive number")
    own, seen = (np.flatnonzero(np.isfinite(cloud).all(1)) for cloud in (places, others))
    own_extra, seen_extra = _descriptors(descriptors, len(places), len(others))
    if min(len(np.unique(places[own], axis=0)), len(np.unique(others[seen], axis=0))) < d + 2:
        return _unchanged(places)
    first = None if radius is None else finite_number(radius, "radius")
    if first is not None and first <= 0:
        raise ValueError(f"radius: {first}; expected a positive number")
    start, goal = _Points(places[own], own_extra[own]), _Points(others[seen], seen_extra[seen])
    moves = _displaced(start, goal, float(stiffness), first)
    moved = places.copy()
    moved[own] += moves.shift
    nodes, first_rows = np.unique(start.points, axis=0, return_index=True)
    found = replace(_result(moved, moves, own, others, seen), _nodes=nodes, _shift=moves.shift[first_rows])
    if found.status != DeformStatus.OK:
        return found
    back = _displaced(goal, start, float(stiffness), first)
    loops = moves.shift + _interpolated(goal.points, back.shift, moved[own])
    spacing = max(_spacing(start.points), _spacing(goal.points))
    closed = float((np.linalg.norm(loops, axis=1) <= _CLOSED * spacing).mean())
    return replace(found, closed=closed, status=found.status if closed >= _MOST else DeformStatus.INCONSISTENT)


@dataclass(frozen=True, eq=False)
class _Points:
    """Finite points of a cloud, with their descriptors."""

    points: Reals
    extra: Reals


@dataclass(frozen=True, eq=False)
class _Shift:
    shift: Reals
    spread: Reals
    change: float
    spacing: float


def _displaced(start: _Points, goal: _Points, stiffness: float, first: float | None) -> _Shift:
    """Return displacements of all points of a cloud, interpolated between those of its nodes."""
    nodes = np.arange(len(start.points))
    if len(nodes) > _NODES:
        nodes = np.sort(np.random.default_rng(0).permutation(nodes)[:_NODES])
    places = start.points[nodes]
    spacing = _spacing(places)
    radius = _START * spacing if first is None else first
    shift, spread, change = _descend(places, start.extra[nodes], goal, stiffness, radius, _END * spacing)
    both = _interpolated(places, np.column_stack([shift, spread]), start.points)
    return _Shift(both[:, :-1], both[:, -1], change, spacing)


def _descend(
    points: Reals, extra: Reals, goal: _Points, stiffness: float, first: float, last: float
) -> tuple[Reals, Reals, float]:
    """Return displacements, their spreads, and the mean change of the last step."""
    n = len(points)
    bending = _bending(points)
    shift, change = np.zeros_like(points), np.inf
    weights: Reals = np.zeros(n)
    # Each target has about n / m of the weight of a point, so that the density of the target does not matter.
    share = min(1.0, n / len(goal.points))
    steps = max(2, int(np.ceil(np.log(max(first / last, 1)) / -np.log(_FACTOR))))
    count = min(_CANDIDATES, n)
    every = np.column_stack([goal.points, goal.extra])
    for step in range(steps + 3):
        radius = max(first * _FACTOR**step, last)
        tree = scipy.spatial.cKDTree(np.column_stack([points + shift, extra]))
        distance, row = tree.query(every, k=count)
        chance = np.exp(-((distance / radius) ** 2) / 2)
        chance /= chance.sum(1, keepdims=True) + _MISSING
        matches = scipy.sparse.csr_matrix(
            (chance.ravel(), (row.ravel(), np.repeat(np.arange(len(every)), count))), shape=(n, len(every))
        )
        weights = share * np.asarray(matches.sum(1)).ravel()
        pull = share * (matches @ goal.points) - weights[:, None] * points
        softer = stiffness * max(_FACTOR**step, _SOFTEST)
        matrix = (softer * bending + scipy.sparse.diags(weights + 1e-9)).tocsc()
        solved = scipy.sparse.linalg.splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(
            pull
        )
        change, shift = float(np.linalg.norm(solved - shift, axis=1).mean()), solved
    away = ((goal.points[:, None] - (points + shift)[row]) ** 2).sum(-1)
    squares = share * np.bincount(row.ravel(), (chance * away).ravel(), n)
    spread = np.sqrt(squares / np.maximum(weights, 1e-12) / points.shape[1])
    return shift, np.where(weights >= _MATCHED, spread, 0), change


def _bending(points: Reals) -> Any:
    """Return the square of the Laplacian of the graph of neighbours."""
    n, k = len(points), min(_NEIGHBOURS, len(points) - 1)
    near = scipy.spatial.cKDTree(points).query(points, k=k + 1)[1]
    links = scipy.sparse.coo_matrix(
        (np.ones(n * k), (np.repeat(np.arange(n), k), near[:, 1:].ravel())), shape=(n, n)
    ).tocsr()
    links = ((links + links.T) > 0).astype(float)
    laplacian = scipy.sparse.diags(np.asarray(links.sum(1)).ravel()) - links
    return laplacian.T @ laplacian


def _result(moved: Reals, moves: _Shift, own: Reals, others: Reals, seen: Reals) -> Deformation:
    """Return the partners of displaced points, and whether they fit and have converged."""
    spacing = moves.spacing
    rows, doubt = np.full(len(moved), -1, np.int64), np.full(len(moved), np.inf)
    if not np.isfinite(moved[own]).all():
        return Deformation(moved, rows, doubt, DeformStatus.POOR_FIT)
    distance, row = scipy.spatial.cKDTree(others[seen]).query(moved[own])
    near = distance <= _FAR * spacing
    rows[own[near]] = seen[row[near]]
    doubt[own[near]] = np.maximum(moves.spread, distance / np.sqrt(moved.shape[1]))[near]
    status = DeformStatus.OK
    if (distance <= _NEAR * max(spacing, _spacing(others[seen]))).mean() < _ENOUGH:
        status = DeformStatus.POOR_FIT
    elif moves.change > _STILL * spacing:
        status = DeformStatus.NOT_CONVERGED
    return Deformation(moved, rows, doubt, status)


def _interpolated(nodes: Reals, values: Reals, at: Reals) -> Reals:
    """Interpolate values of nodes by inverse squared distances."""
    distance, row = scipy.spatial.cKDTree(nodes).query(at, k=_INTERPOLATED)
    weight = 1 / np.maximum(distance, NEGLIGIBLE * (distance.max() + TINY)) ** 2
    weight /= weight.sum(1, keepdims=True)
    return np.asarray((values[row] * weight[..., None]).sum(1))


def _spacing(points: Reals) -> float:
    distance = scipy.spatial.cKDTree(points).query(points, k=2)[0][:, 1]
    positive = distance[distance > 0]
    return float(np.median(positive)) if len(positive) else 1.0


def _cloud(value: ArrayLike, name: str) -> Reals:
    array = real_array(value, name, (-1,), "points").astype(float)
    if array.ndim != 2 or array.shape[1] not in (2, 3):
        raise ValueError(f"{name}: shape {array.shape}; expected (n, 2) or (n, 3)")
    moderate(array[np.isfinite(array).all(1)], name)
    return array


def _descriptors(pair: tuple[ArrayLike, ArrayLike] | None, n: int, m: int) -> tuple[Reals, Reals]:
    if pair is None:
        return np.zeros((n, 0)), np.zeros((m, 0))
    own, other = (real_array(x, f"descriptors[{k}]", (-1,)).astype(float) for k, x in enumerate(pair))
    if own.ndim != 2 or own.shape[0] != n or other.shape != (m, own.shape[1]):
        raise ValueError(f"descriptors: shapes {own.shape} and {other.shape}; expected ({n}, k) and ({m}, k)")
    return np.nan_to_num(own), np.nan_to_num(other)


def _unchanged(places: Reals) -> Deformation:
    n = len(places)
    return Deformation(places, np.full(n, -1, np.int64), np.full(n, np.inf), DeformStatus.TOO_FEW_POINTS)
