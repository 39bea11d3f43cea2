"""Whether two clouds at a pose are samples of one surface: places at which they are on two different ones."""

from __future__ import annotations

import numpy as np
import scipy

from generated import pga3

from ..arguments import Reals
from ..evidence import WRONG
from .clouds import Cloud

_PLACES, _NEAREST = 600, 20
"""Limits on work: places that are examined, and the nearest points of each cloud at a place."""
_PRESENT = 2.0
"""Ratio of the distances of these points in both clouds up to which both have a surface at a place."""
_FLAT = 0.25
"""The part of the variance along a surface up to which that across it shows a surface, not a solid or two sheets."""
_MIXED = 2.0
"""The variance of an offset, in units of that of mixed points, up to which points of both clouds lie side by side."""
_UNLIKE = 0.05
"""From a probability: two samples of one surface have variances so different with it."""
_EVEN = 3.0
"""Unevenness up to which a cloud is a random sample of surfaces: twice that of Poisson's distribution, since parts may
have different densities. Lines of a scanner give more, and their points are not independent."""
_TERMS = 7
"""Coefficients of a quadric above a plane, and the offset of one cloud from the other."""
_STEPS = 10
"""A limit on work: steps towards the motion that the offsets leave."""


def contradiction(motor: Reals, source: Cloud, target: Cloud) -> float:
    """Return the probability that offsets between two clouds at a pose are as many and as large by chance.

    Around each place, one quadric is fitted to the points of both clouds, with an offset between these. If both are
    samples of one surface, the offset relative to its deviation has Student's distribution, whatever the noise is. An
    offset that chance exceeds with a thousandth is also larger than the noise. Places where one cloud has no points
    are left out: what is missing in one cloud contradicts nothing. Clouds that are no random samples of surfaces with
    one noise, such as lines of a scanner, or if only one has many outliers, are not judged: the result is 1.

    Parameters
    ----------
    motor : array, (8,)
        From the source to the target.
    source, target : Cloud
    """
    if min(len(source.points), len(target.points)) < _NEAREST or max(source.unevenness, target.unevenness) > _EVEN:
        return 1.0
    rng = np.random.default_rng(0)
    back = pga3.motor_inverse(motor)
    here = source.points[rng.permutation(len(source.points))[: _PLACES // 2]]
    there = target.points[rng.permutation(len(target.points))[: _PLACES // 2]]
    places = np.concatenate([pga3.move_point(motor, here), there])
    far, rows = source.tree.query(np.concatenate([here, pga3.move_point(back, there)]), _NEAREST)
    away, others = target.tree.query(places, _NEAREST)
    reach = np.maximum(far[:, -1], away[:, -1])
    both = reach <= _PRESENT * np.minimum(far[:, -1], away[:, -1])
    places, rows, others, reach = places[both], rows[both], others[both], reach[both]
    if not len(places) or not reach.all():
        return 1.0
    moved = np.asarray(pga3.move_point(motor, source.points))
    around = np.concatenate([moved[rows], target.points[others]], 1) - places[:, None]
    offset, deviation, normals, kept = _offsets(around / reach[:, None, None], reach)
    if np.count_nonzero(kept) <= _TERMS:
        return 1.0
    freedom = 2 * _NEAREST - _TERMS
    ratio = _unmoved(offset, deviation, places, normals, kept, freedom)
    rare = np.count_nonzero(2 * scipy.special.stdtr(freedom, -np.abs(ratio)) < WRONG)
    # Places share points, so that fewer of them are independent.
    shared = 2 * _NEAREST * len(ratio) / (len(np.unique(rows[kept])) + len(np.unique(others[kept])))
    tail = scipy.special.bdtrc(int(np.ceil(rare / shared)) - 1, int(np.ceil(len(ratio) / shared)), WRONG)
    return float(tail) if rare else 1.0


def _offsets(around: Reals, reach: Reals) -> tuple[Reals, Reals, Reals, Reals]:
    """Return offsets between both halves of points (n, k, 3), their deviations, normals, and which of them count.

    Places have to be flat, and both halves have to scatter alike. If most places are not flat, the noise is as large as
    the distances of points, and decides which places seem flat. If most do not scatter alike, one cloud has outliers
    that the other one has not.
    """
    k = _NEAREST
    own = around.copy()
    for half in (slice(0, k), slice(k, 2 * k)):
        own[:, half] -= around[:, half].mean(1, keepdims=True)
    spread, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", own, own))
    height, u, v = np.moveaxis(np.einsum("nki,nij->nkj", around, axes), 2, 0)
    label = np.broadcast_to(np.repeat([0.5, -0.5], k), u.shape)
    design = np.stack([label, np.ones_like(u), u, v, u * u, u * v, v * v], -1)
    normal = np.einsum("nki,nkj->nij", design, design)
    inverse = np.linalg.inv(normal + np.finfo(float).eps * k * np.eye(_TERMS))
    found = np.einsum("nij,nkj,nk->ni", inverse, design, height)
    rest = height - np.einsum("nki,ni->nk", design, found)
    variance = (rest**2).sum(1) / (2 * k - _TERMS)
    is_flat = spread[:, 0] <= _FLAT * spread[:, 1]
    kept = is_flat & (inverse[:, 0, 0] > 0) & (inverse[:, 0, 0] <= _MIXED * 2 / k)
    squares = np.stack([(rest[:, :k] ** 2).sum(1), (rest[:, k:] ** 2).sum(1)])
    alike = squares.max(0) <= scipy.special.fdtri(k - _TERMS / 2, k - _TERMS / 2, 1 - _UNLIKE / 2) * squares.min(0)
    if np.count_nonzero(is_flat) < len(is_flat) / 2 or np.count_nonzero(alike & kept) < np.count_nonzero(kept) / 2:
        kept = np.zeros_like(kept)
    kept &= alike
    if kept.any():
        # A scanner has one noise: it is not less where a few points happen to agree.
        variance = np.maximum(variance, np.median((variance * reach**2)[kept]) / reach**2)
    deviation = np.sqrt(np.maximum(variance * inverse[:, 0, 0], np.finfo(float).eps ** 2))
    return found[:, 0] * reach, deviation * reach, axes[..., 0], kept


def _unmoved(offset: Reals, deviation: Reals, places: Reals, normals: Reals, kept: Reals, freedom: int) -> Reals:
    """Return offsets that are left after the most likely small motion, in units of their deviations."""
    places = places[kept] - places[kept].mean(0)
    moves = np.concatenate([normals[kept], np.cross(places, normals[kept])], 1) / deviation[kept][:, None]
    ratio = start = offset[kept] / deviation[kept]
    for _ in range(_STEPS):
        weight = (freedom + 1) / (freedom + ratio**2)
        step = np.linalg.lstsq(np.sqrt(weight)[:, None] * moves, np.sqrt(weight) * start, rcond=None)[0]
        ratio = start - moves @ step
    return np.asarray(ratio)
