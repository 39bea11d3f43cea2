"""Whether curves explain tokens: those beside the curves are nowhere denser than by chance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from ..arguments import Reals
from ..evidence import WRONG
from ..precision import TINY
from .extremal import Extremal
from .vote_status import CurveStatus
from .voting import Votes

_BESIDE = 1.0
"""Distance, in units of sigma, up to which tokens belong to a curve: votes do not separate two closer ones."""
_RADII = (1.0, 2.0)
"""A limit on work: radii, in units of sigma, of balls in which tokens are counted."""

_WIDTH = 0.25
"""The distance from a curve, in units of sigma, within which its tokens are to be denser: it contains nine tenths of
the largest noise for which a scale suits, .15 sigma."""
_DISPLACED = 8
"""A limit on work: displaced copies of each token, which give the density around a curve."""


def without_chance(found: Extremal, tokens: Reals, sigma: float) -> Extremal:
    """Return the curves that have more tokens within a width than displacements of the tokens across it explain.

    Random tokens are as dense near a curve as they are after displacements by twice the width in random directions.
    Votes choose the curve: it begins at one of the tokens, and within each length of sigma, it is at one of two places
    side by side. In space, where lines in which surfaces cross are no denser, all curves are returned.
    """
    n, d = found.vertices.shape
    if not n or d == 3:
        return found
    links = scipy.sparse.coo_matrix((np.ones(len(found.pieces)), found.pieces.T), shape=(n, n))
    count, label = scipy.sparse.csgraph.connected_components(links, directed=False)
    ends = found.vertices[found.pieces]
    away = np.random.default_rng(0).normal(size=(_DISPLACED * len(tokens), d))
    away *= 2 * _WIDTH * sigma / np.linalg.norm(away, axis=1, keepdims=True)
    displaced = np.tile(tokens, (_DISPLACED, 1)) + away
    kept = np.zeros(count, bool)
    for k in range(count):
        own = ends[label[found.pieces[:, 0]] == k]
        length = np.linalg.norm(own[:, 1] - own[:, 0], axis=1).sum() / sigma
        near, share = ((_distances(own, places) <= _WIDTH * sigma).mean() for places in (tokens, displaced))
        tail = scipy.stats.binom.logsf(near * len(tokens) - 0.5, len(tokens), share)
        kept[k] = tail + np.log(len(tokens)) + length * np.log(2) < np.log(WRONG)
    rows, pieces = kept[label], found.pieces[kept[label[found.pieces[:, 0]]]]
    order = np.cumsum(rows) - 1
    return replace(found, vertices=found.vertices[rows], pieces=order[pieces], saliency=found.saliency[rows])


def _distances(segments: Reals, points: Reals) -> Reals:
    """Return the distances of points from the segments whose middles are nearest."""
    near = scipy.spatial.cKDTree(segments.mean(1)).query(points)[1]
    start, along = segments[near, 0], segments[near, 1] - segments[near, 0]
    offset = points - start
    place = (offset * along).sum(1) / np.maximum((along**2).sum(1), TINY)
    return np.asarray(np.linalg.norm(offset - np.clip(place, 0, 1)[:, None] * along, axis=1))


def curve_status(found: Extremal, tokens: Votes, sigma: float) -> CurveStatus:
    """Return whether the tokens beside curves are random ones: numbers of tokens in balls around them are Poisson's.

    Tokens that mainly agree on a surface are explained by it. The density of random tokens is that of all tokens beside
    curves in their box.
    """
    beside = tokens.points
    size = tokens.eigenvalues
    if beside.shape[1] == 3:
        beside = beside[size[:, 0] - size[:, 1] <= size[:, 1] - size[:, 2]]
    if len(found.vertices):
        middles = found.vertices[found.pieces].mean(1)
        places = scipy.spatial.cKDTree(np.concatenate([found.vertices, middles]))
        beside = beside[places.query(beside)[0] > _BESIDE * sigma]
    elif not len(tokens.points):
        return CurveStatus.NOTHING
    if _by_chance(beside, tokens.points, sigma):
        return CurveStatus.OK if len(found.pieces) else CurveStatus.NOTHING
    return CurveStatus.UNEXPLAINED


def _by_chance(beside: Reals, tokens: Reals, sigma: float) -> bool:
    """Return whether balls around places contain no more of the others than random places in the box would."""
    n, d = beside.shape
    if n < 2:
        return True
    box = np.maximum(np.ptp(tokens, axis=0), sigma)
    tree = scipy.spatial.cKDTree(beside)
    for radius in _RADII:
        ball = np.pi ** (d / 2) / scipy.special.gamma(d / 2 + 1) * (radius * sigma) ** d
        expected = (n - 1) * min(ball / float(np.prod(box)), 1.0)
        most = int(tree.query_ball_point(beside, radius * sigma, return_length=True).max()) - 1
        if n * len(_RADII) * scipy.special.pdtrc(most - 1, expected) < WRONG:
            return False
    return True
