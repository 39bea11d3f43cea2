"""The scale of votes: enough neighbours, and large in relation to the noise of their places."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arguments import Reals, moderate
from ..precision import TINY

_NEIGHBOURS = 16
"""Tokens within three times the least scale."""
_FITTED = 24
"""Neighbours to which a quadratic function is fitted; the median of as many gives the noise of a token."""
_MOST = 1_000
"""A limit on work: tokens whose noise is estimated."""
_ROUNDS = 4
"""A limit on work: fits with weights that leave out outliers."""
_LEAST, _LARGEST, _GROWTH = 1.4, 4.0, 5.6
"""Multiples of the least scale: bounds, and the multiple for noise of the least scale. The error of a normal by noise
falls with the square of the scale, and that by curvature and edges grows with it, so that the best multiple is a
cube root of the noise; the bounds are limits on work."""


def default_sigma(points: ArrayLike) -> float:
    """Return the median of `sigmas` among different finite points (n, d).

    It is 1 for fewer than two different points, and for arrays that are not points.

    Raises
    ------
    ValueError
        If squares of distances overflow.
    """
    array = np.asarray(points)
    if array.ndim != 2 or array.dtype.kind not in "fiub":
        return 1.0
    places = np.unique(moderate(array[np.isfinite(array).all(1)], "points"), axis=0)
    if len(places) < 2:
        return 1.0
    return float(np.median(sigmas(places)))


def sigmas(places: Reals) -> Reals:
    """Return the scale for each of different finite points (n, d).

    It is a third of the distance to the 16th neighbour, times the cube root of the noise in units of that, but between
    1.4 and 4. The noise is the deviation from quadratic functions that are fitted to 24 neighbours.
    """
    k = min(_NEIGHBOURS, len(places) - 1)
    tree = scipy.spatial.cKDTree(places)
    spacing = tree.query(places, k=[k + 1])[0][:, 0] / 3
    step = -(-len(places) // _MOST)
    rows = np.arange(0, len(places), step)
    count = min(_FITTED, len(places))
    near = tree.query(places[rows], k=count)[1].reshape(len(rows), -1)
    noise = _noise(places, near)
    some = tree if step == 1 else scipy.spatial.cKDTree(places[rows])
    around = some.query(places, k=min(count, len(rows)))[1].reshape(len(places), -1)
    ratio = np.median(noise[around], 1) / np.maximum(spacing, TINY)
    return np.asarray(spacing * np.clip(_GROWTH * np.cbrt(ratio), _LEAST, _LARGEST))


def quadratics(along: Reals) -> Reals:
    """Return the monomials (n, k, p) of quadratic functions of coordinates (n, k, d): 1, linear and quadratic ones."""
    d = along.shape[2]
    found = np.empty((*along.shape[:2], 1 + d + d * (d + 1) // 2))
    found[..., 0] = 1
    found[..., 1 : d + 1] = along
    for k, (i, j) in enumerate(zip(*np.triu_indices(d), strict=True)):
        np.multiply(along[..., i], along[..., j], out=found[..., d + 1 + k])
    return found


def _noise(places: Reals, near: Reals) -> Reals:
    """Return the standard deviation of neighbours from a quadratic function over their plane or line."""
    offsets = places[near] - places[near].mean(1, keepdims=True)
    axes = np.linalg.eigh(offsets.swapaxes(1, 2) @ offsets)[1]
    own = offsets @ axes
    height, along = own[..., 0], own[..., 1:]
    along = along / np.maximum(np.abs(along).max((1, 2), keepdims=True), TINY)
    design = quadratics(along)
    freedom = near.shape[1] - design.shape[2]
    if freedom <= 0:
        return np.zeros(len(near))
    weights = np.ones_like(height)
    rest = height
    for _ in range(_ROUNDS):
        root = np.sqrt(weights)
        q = np.linalg.qr(root[..., None] * design)[0]
        fit = (q @ (q.swapaxes(1, 2) @ (root * height)[..., None]))[..., 0]
        rest = height - fit / np.maximum(root, 1e-6)
        scale = np.median(np.abs(rest), 1, keepdims=True) / 0.6745
        weights = 1 / (1 + (rest / np.maximum(3 * scale, TINY)) ** 2) ** 2
    return np.asarray(np.median(np.abs(rest), 1) / (0.6745 * np.sqrt(freedom / near.shape[1])))
