"""Normals from quadratic functions fitted to neighbours, with robust weights from normals that are roughly known."""

from __future__ import annotations

import numpy as np
import scipy

from ..arguments import Reals
from ..evidence.noise import NORMAL
from ..precision import NEGLIGIBLE, TINY
from .vote_scale import quadratics

_FITTED = 64
"""A limit on work: neighbours of a fit."""
_FEWEST = 12.0
"""Twice the number of coefficients: sums of weights below this leave the normal unchanged."""
_ROUNDS = 3
"""A limit on work: fits, each over the plane of the last one."""
_NEAR = 3
"""The scale of residuals is that of this part of the neighbours, the nearest: a second sheet is farther away."""
_WIDE = np.cos(np.radians(45.0))
"""Neighbours whose normals differ by more are beyond an edge."""
_TUKEY = 4.685
"""From a probability: residuals beyond this number of standard deviations have no weight, at 95 % efficiency."""
_BATCH = 200
"""A limit on work: places at once, whose fits then remain in the cache."""


def jet_normals(places: Reals, normals: Reals) -> Reals:
    """Return unit normals (n, d) of quadratic functions over the planes or lines of rough ones.

    The slope at the place has the noise of a fitted plane, but neither the error by curvature nor, because of the
    weights, those by edges and outliers. Signs are those of the rough normals.
    """
    near = scipy.spatial.cKDTree(places).query(places, min(_FITTED, len(places)))[1]
    found = normals.copy()
    for start in range(0, len(places), _BATCH):
        rows = slice(start, start + _BATCH)
        offsets = places[near[rows]] - places[rows, None]
        alike = np.abs((normals[near[rows]] @ normals[rows, :, None])[..., 0]) > _WIDE
        for _ in range(_ROUNDS):
            found[rows] = _refined(offsets, alike, found[rows])
    return found


def _refined(offsets: Reals, alike: Reals, normals: Reals) -> Reals:
    frames = np.linalg.svd(normals[:, None])[2][:, 1:]
    height = (offsets @ normals[..., None])[..., 0]
    along = offsets @ frames.swapaxes(1, 2)
    reach = np.maximum(np.sqrt((along**2).sum(2).max(1)), TINY)
    along, height = along / reach[:, None, None], height / reach[:, None]
    design = quadratics(along)
    weights = alike.astype(float)
    rest = height  # the first scale is that of distances from the rough plane or line
    for _ in range(2):
        weights = alike * _tukey(rest, alike)
        weighted = (design * weights[..., None]).swapaxes(1, 2)  # products of matrices are faster than einsum
        table = weighted @ design
        size = np.einsum("npp->np", table)
        table[:, range(design.shape[2]), range(design.shape[2])] += NEGLIGIBLE * size + 1e-30
        fit = np.linalg.solve(table, weighted @ height[..., None])[..., 0]
        rest = height - (design @ fit[..., None])[..., 0]
    slope = (fit[:, None, 1 : frames.shape[1] + 1] @ frames)[:, 0]
    better = normals - slope
    better /= np.linalg.norm(better, axis=1, keepdims=True)
    return np.where((weights.sum(1) >= _FEWEST)[:, None], better, normals)


def _tukey(rest: Reals, alike: Reals) -> Reals:
    """Return Tukey's weights of residuals, relative to the median of the absolute ones of the nearest neighbours."""
    size = np.abs(rest)
    near = alike & (np.cumsum(alike, 1) <= np.maximum(alike.sum(1) // _NEAR, 1)[:, None])
    ordered = np.sort(np.where(near, size, np.inf), axis=1)
    scale = NORMAL * ordered[np.arange(len(rest)), near.sum(1) // 2]
    scale = np.where(np.isfinite(scale), scale, 0)
    share = size / np.maximum(_TUKEY * scale, 1e-12)[:, None]
    return np.asarray(np.where(share < 1, (1 - np.minimum(share, 1) ** 2) ** 2, 0))
