"""Extremal surfaces in space and extremal curves in the plane, from dense votes on a grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, finite_number
from .voting import tensor_vote

_MOST_NODES = 4_000_000
_PARALLEL = 0.5
"""The least cosine of the normals at both ends of an edge that crosses a surface."""


@dataclass(frozen=True, eq=False)
class Extremal:
    """Places at which the saliency is largest along the normal.

    Attributes
    ----------
    vertices : array, (v, d)
        At most one in each cell of the grid.
    pieces : int array, (f, 2 (d - 1))
        Rows of vertices: the ends of segments of curves in the plane, or the corners of quadrilaterals of surfaces in
        space, in order around each one. Neighbouring quadrilaterals may have opposite orders.
    saliency : array, (v,)
        Interpolated between the nodes.
    """

    vertices: Reals
    pieces: NDArray[np.int64]
    saliency: Reals


def extract_surface(points: ArrayLike, *, sigma: float, spacing: float | None = None, least: float = 0.2) -> Extremal:
    """Extract the surfaces in space on which the votes of tokens agree.

    Parameters
    ----------
    points : array_like, (n, 3)
    sigma : float
        The scale of votes.
    spacing : float, optional
        Of the nodes of the grid; by default a quarter of sigma.
    least : float, optional
        The least saliency, in units of the largest one.

    Returns
    -------
    Extremal
        A piece crosses each edge of the grid on which the derivative of the saliency along the normal changes its sign
        from plus to minus. Surfaces closer to each other than about sigma merge. There are gaps where the saliency is
        below the least one, and pieces near outliers if that is small.
    """
    return _extract(points, 3, sigma, spacing, least)


def extract_curves(points: ArrayLike, *, sigma: float, spacing: float | None = None, least: float = 0.2) -> Extremal:
    """Extract the curves in the plane on which the votes of tokens agree; see `extract_surface`.

    Curves in space are not extracted; `Votes.curve` and `Votes.tangents` describe them at tokens.
    """
    return _extract(points, 2, sigma, spacing, least)


def _extract(points: ArrayLike, d: int, sigma: float, spacing: float | None, least: float) -> Extremal:
    places = np.asarray(points, float)
    if places.ndim != 2 or places.shape[1] != d:
        raise ValueError(f"points: shape {places.shape}; expected (n, {d})")
    step = finite_number(sigma, "sigma") / 4 if spacing is None else finite_number(spacing, "spacing")
    if step <= 0 or not 0 < finite_number(least, "least") < 1:
        raise ValueError(f"spacing, least: {step}, {least}; expected a positive number, and one between 0 and 1")
    finite = places[np.isfinite(places).all(1)]
    if not len(finite):
        return _nothing(d)
    low = finite.min(0) - 2 * step
    shape = np.ceil((finite.max(0) + 2 * step - low) / step) + 1
    if shape.prod() > _MOST_NODES:
        raise ValueError(f"spacing: {step} gives {shape.prod():.3g} nodes; expected at most {_MOST_NODES}")
    counts = tuple(int(k) for k in shape)
    nodes = np.stack(np.meshgrid(*(np.arange(k) for k in counts), indexing="ij"), -1).reshape(-1, d)
    votes = tensor_vote(finite, sigma=sigma, at=low + step * nodes)
    saliency = (votes.eigenvalues[:, 0] - votes.eigenvalues[:, 1]).reshape(counts)
    normals = votes.normals.reshape(*counts, d)
    if not saliency.any():
        return _nothing(d)
    slope = (np.stack(np.gradient(saliency), -1) * normals).sum(-1)
    found = [_crossings(saliency, normals, slope, axis, least * saliency.max()) for axis in range(d)]
    return _dual(found, counts, low, step)


def _crossings(saliency: Reals, normals: Reals, slope: Reals, axis: int, least: float) -> tuple[Reals, Reals, Reals]:
    """Return the nodes before crossed edges along an axis, places on the edges from 0 to 1, and saliencies."""
    n = saliency.shape[axis]
    first, second = ((np.take(x, range(n - 1), axis), np.take(x, range(1, n), axis)) for x in (saliency, slope))
    a, b = np.take(normals, range(n - 1), axis), np.take(normals, range(1, n), axis)
    cosine = (a * b).sum(-1)
    sign = np.where(cosine < 0, -1.0, 1.0)
    before, after = second[0], sign * second[1]
    ahead = a[..., axis] + sign * b[..., axis]
    crossed = (before * after < 0) & ((before - after) * ahead > 0) & (np.abs(cosine) > _PARALLEL)
    crossed &= np.minimum(*first) >= least
    share = before[crossed] / (before - after)[crossed]
    return np.argwhere(crossed), share, first[0][crossed] * (1 - share) + first[1][crossed] * share


def _dual(found: list[tuple[Reals, Reals, Reals]], counts: tuple[int, ...], low: Reals, step: float) -> Extremal:
    """Connect the cells around crossed edges; the vertex of a cell is the mean of the crossings of its edges."""
    d = len(counts)
    around = np.array([[0], [-1]] if d == 2 else [[0, 0], [-1, 0], [-1, -1], [0, -1]])
    cells, places, sizes = [], [], []
    for axis, (edges, share, size) in enumerate(found):
        others = [k for k in range(d) if k != axis]
        corners = np.repeat(edges[:, None], len(around), 1)
        corners[..., others] += around
        inside = (corners >= 0).all((1, 2)) & (corners < np.array(counts) - 1).all((1, 2))
        place = edges.astype(float)
        place[:, axis] += share
        cells.append(np.ravel_multi_index(tuple(corners[inside].reshape(-1, d).T), counts))
        places.append(np.repeat(place[inside], len(around), 0))
        sizes.append(np.repeat(size[inside], len(around)))
    every: NDArray[Any] = np.concatenate(cells)
    if not len(every):
        return _nothing(d)
    _, rows = np.unique(every, return_inverse=True)
    total = np.bincount(rows)
    spots, weights = np.concatenate(places), np.concatenate(sizes)
    vertices = np.stack([np.bincount(rows, spots[:, k]) / total for k in range(d)], 1)
    return Extremal(low + step * vertices, rows.reshape(-1, 2 * (d - 1)), np.bincount(rows, weights) / total)


def _nothing(d: int) -> Extremal:
    return Extremal(np.zeros((0, d)), np.zeros((0, 2 * (d - 1)), np.int64), np.zeros(0))
