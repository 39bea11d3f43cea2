"""Extremal curves, traced along the tangents of the votes from the clearest tokens."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ..arguments import Reals
from ..precision import TINY
from .ascent import climb, well_apart
from .extremal import Extremal, no_extremal
from .voting import VoteField, Votes

_SHARE = 0.2
"""The least saliency of a curve, in units of the first eigenvalue: surfaces are no curves."""
_TRIES = 3
"""Steps that the continuation of a curve may skip, where the votes are not clear."""
_OPEN = 1.6
"""Distance of neighbouring vertices, in steps, above which one is missing between them."""
_NEAR = 0.5
"""Distance along the curve, in steps, below which vertices are the same."""
_ACROSS = 0.5
"""Distance across the curve, in units of sigma, below which parallel curves are the same."""
_AHEAD = 0.7
"""The least cosine of the tangent and the direction of the next vertex."""
_END = 0.5
"""Saliency at the end of a curve, in units of its median: at the last token, the votes of one side are missing."""
_SEED = 0.25
"""Saliency of tokens from which the ascent begins, in units of the least one of a curve."""
_SHORT = 3.0
"""The least length of a curve, in units of sigma."""
_ROUNDS = 10_000
"""Most steps of the ends of curves."""
_RING = 8
"""Places around a vertex, at the distance sigma, with which its saliency is compared."""


@dataclass(frozen=True, eq=False)
class _Vertices:
    places: Reals
    tangents: Reals
    saliency: Reals

    def rows(self, chosen: Any) -> _Vertices:
        return _Vertices(self.places[chosen], self.tangents[chosen], self.saliency[chosen])

    def joined(self, other: _Vertices) -> _Vertices:
        return _Vertices(
            np.concatenate([self.places, other.places]),
            np.concatenate([self.tangents, other.tangents]),
            np.concatenate([self.saliency, other.saliency]),
        )


def trace_curves(
    field: VoteField, sigma: float, step: float, least: float, support: float, contrast: float
) -> Extremal:
    """Trace the curves on which the saliency of curves is largest across the tangent.

    Parameters
    ----------
    field : VoteField
    sigma : float
        The scale of its votes.
    step : float
        The distance of vertices.
    least : float
        The least saliency, in units of the largest one of surfaces and curves at a token or vertex.
    support : float
        The least saliency in the median along a curve, in units of the vote of one token. It is at least half of that
        everywhere.
    contrast : float
        The least ratio of the saliency on a curve to that at the distance sigma from it, in the median.
    """
    tokens = field.votes(field.tokens.points)
    seeds = np.flatnonzero(tokens.curve >= _SHARE * tokens.eigenvalues[:, 0])
    gaps = tokens.eigenvalues[:, :-1] - tokens.eigenvalues[:, 1:]
    largest = gaps.max(initial=0)
    limit = max(least * largest, support / 2)
    seeds = seeds[tokens.curve[seeds] >= _SEED * limit]
    if not len(seeds):
        return no_extremal(tokens.points.shape[1], 2)
    seeds = seeds[well_apart(tokens.points[seeds], tokens.curve[seeds], sigma / 2)]
    first = _Tracer(field, sigma, step, limit).summits(tokens.points[seeds])
    limit = max(least * first.saliency.max(initial=0), limit)
    tracer = _Tracer(field, sigma, step, limit)
    found = tracer.grow(first.rows(first.saliency >= limit))
    curves = _curves(found, *tracer.links(found), sigma)
    clear = [(rows, closed) for rows, closed in curves if np.median(found.saliency[rows]) >= support]
    return _joined(found, [(rows, closed) for rows, closed in clear if tracer.contrast(found, rows) >= contrast])


class _Tracer:
    def __init__(self, field: VoteField, sigma: float, step: float, limit: float) -> None:
        self._field, self._sigma, self._step, self._limit = field, sigma, step, limit

    def summits(self, start: Reals) -> _Vertices:
        """Return the vertices of curves next to places."""
        found = climb(self._field, start, lambda v: v.curve, lambda v: v.axes[:, :-1], self._sigma / 8)
        votes = found.votes
        good = found.reached & (votes.curve >= self._limit) & (votes.curve >= _SHARE * votes.eigenvalues[:, 0])
        return _vertices(votes, good)

    def grow(self, first: _Vertices) -> _Vertices:
        """Add vertices ahead of the ends until the curves end or meet."""
        found = self._new(None, first)
        tries = np.zeros((2, len(found.places)), int)
        for _ in range(_ROUNDS):
            open_ends = (self._neighbours(found, _OPEN) < 0) & (tries < _TRIES)
            if not open_ends.any():
                break
            tries[open_ends] += 1
            places = [
                found.places[rows] + (sign * self._step * tries[side, rows])[:, None] * found.tangents[rows]
                for side, sign in enumerate((1, -1))
                for rows in [np.flatnonzero(open_ends[side])]
            ]
            more = self._new(found, self.summits(np.concatenate(places)))
            found = found.joined(more)
            tries = np.concatenate([tries, np.zeros((2, len(more.places)), int)], 1)
        return found

    def links(self, found: _Vertices) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return pairs of vertices that are next to each other on both sides."""
        ahead, behind = self._neighbours(found, _TRIES + _OPEN - 1)
        rows = np.arange(len(found.places))
        pairs = []
        for near in (ahead, behind):
            own = rows[near >= 0]
            other = near[own]
            mutual = (ahead[other] == own) | (behind[other] == own)
            pairs.append(np.sort(np.stack([own[mutual], other[mutual]], 1), 1))
        both = np.unique(np.concatenate(pairs), axis=0)
        return both[:, 0], both[:, 1]

    def contrast(self, found: _Vertices, rows: NDArray[np.int64]) -> float:
        """Return the median ratio of the saliency on a curve to the mean at the distance sigma from it."""
        votes = self._field.votes(found.places[rows])
        n, d = votes.points.shape
        turn = 2 * np.pi * np.arange(_RING) / _RING
        ring = np.stack([np.cos(turn), np.sin(turn)], 1) if d == 3 else np.array([[-1.0], [1.0]])
        places = votes.points[:, None] + self._sigma * np.einsum("rk,nkd->nrd", ring, votes.axes[:, :-1])
        around = self._field.votes(places.reshape(-1, d)).curve.reshape(n, len(ring)).mean(1)
        return float(np.median(votes.curve / np.maximum(around, TINY)))

    def _neighbours(self, found: _Vertices, steps: float) -> NDArray[np.int64]:
        """Return the closest vertices (2, n) ahead and behind, up to a number of steps away, or -1."""
        n = len(found.places)
        nearest = np.full((2, n), -1)
        if n:
            pairs = scipy.spatial.cKDTree(found.places).query_pairs(steps * self._step, output_type="ndarray")
            own, other = np.concatenate([pairs, pairs[:, ::-1]]).T
            offset = found.places[other] - found.places[own]
            distance = np.linalg.norm(offset, axis=1)
            cosine = (offset * found.tangents[own]).sum(1) / np.maximum(distance, TINY)
            order = np.argsort(-distance, kind="stable")
            for side, chosen in enumerate((cosine >= _AHEAD, cosine <= -_AHEAD)):
                rows = order[chosen[order]]
                nearest[side, own[rows]] = other[rows]  # The last assignment, of the closest one, remains.
        return nearest

    def _new(self, old: _Vertices | None, more: _Vertices) -> _Vertices:
        """Return the vertices that are not at the place of another one, clear ones first."""
        n = 0 if old is None else len(old.places)
        every = more if old is None else old.joined(more)
        if not len(more.places):
            return more
        pairs = scipy.spatial.cKDTree(every.places).query_pairs(np.hypot(_ACROSS * self._sigma, _NEAR * self._step))
        rival: dict[int, list[int]] = {}
        for a, b in pairs:
            offset = every.places[b] - every.places[a]
            along = max(abs(offset @ every.tangents[a]), abs(offset @ every.tangents[b]))
            if abs(every.tangents[a] @ every.tangents[b]) > _AHEAD and along < _NEAR * self._step:
                rival.setdefault(a, []).append(b)
                rival.setdefault(b, []).append(a)
        kept = np.zeros(len(every.places), bool)
        kept[:n] = True
        for k in n + np.argsort(-more.saliency, kind="stable"):
            kept[k] = not any(kept[other] for other in rival.get(int(k), ()))
        return more.rows(kept[n:])


def _vertices(votes: Votes, good: NDArray[Any]) -> _Vertices:
    return _Vertices(votes.points[good], votes.tangents[good], votes.curve[good])


def _curves(found: _Vertices, first: Any, second: Any, sigma: float) -> list[tuple[NDArray[np.int64], bool]]:
    """Return the rows of each curve in order, and whether it is closed, without short curves.

    What is beyond the last tokens is cut off.
    """
    n = len(found.places)
    links = scipy.sparse.coo_matrix((np.ones(len(first)), (first, second)), shape=(n, n)).tocsr()
    links = links + links.T
    _, label = scipy.sparse.csgraph.connected_components(links, directed=False)
    curves = []
    for k in range(label.max(initial=-1) + 1):
        order, closed = _ordered(links, np.flatnonzero(label == k))
        size = found.saliency[order]
        if not closed:
            strong = np.flatnonzero(size >= _END * np.median(size))
            order = order[strong[0] : strong[-1] + 1]
        if np.linalg.norm(np.diff(found.places[order], axis=0), axis=1).sum() >= _SHORT * sigma:
            curves.append((order, closed))
    return curves


def _joined(found: _Vertices, curves: list[tuple[NDArray[np.int64], bool]]) -> Extremal:
    pieces, start = [], 0
    for order, closed in curves:
        own = np.arange(start, start + len(order))
        pieces.append(np.stack([own, np.roll(own, -1)], 1)[: len(own) if closed else len(own) - 1])
        start += len(order)
    if not curves:
        return no_extremal(found.places.shape[1], 2)
    rows = np.concatenate([order for order, _ in curves])
    return Extremal(found.places[rows], np.concatenate(pieces), found.saliency[rows])


def _ordered(links: Any, members: NDArray[np.int64]) -> tuple[NDArray[np.int64], bool]:
    """Return the vertices of a connected part from one end to the other, and whether it is closed."""
    count = np.diff(links.indptr)[members]
    ends = members[count < 2]
    start = int(ends[0]) if len(ends) else int(members[0])
    order = scipy.sparse.csgraph.depth_first_order(links, start, directed=False, return_predecessors=False)
    return np.asarray(order, np.int64), len(ends) == 0
