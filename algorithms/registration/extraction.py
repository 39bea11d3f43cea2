"""Extremal surfaces from dense votes on a grid, and extremal curves."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, finite_number
from .ascent import finite_tokens
from .curve_evidence import curve_status, without_chance
from .extremal import Extremal, no_extremal
from .traced_curves import trace_curves
from .vote_scale import default_sigma
from .vote_status import CurveStatus
from .voting import VoteField

_MOST_NODES = 4_000_000
"""A limit on memory: the largest number of nodes of a grid."""
_CURVATURE = 0.1
"""Weight of squared curvatures. With a large one, a straight continuation is preferred, and circles are too large."""
_SCALES = (1.0, 1.5, 2.25, 3.4)
"""A limit on work: multiples of the default scale that are tried for curves."""
_PARALLEL = 0.5
"""The least cosine of the normals at both ends of an edge that crosses a surface."""


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
    finite = finite_tokens(points, (3,))
    scale, step, share = _settings(sigma, spacing, least)
    if not len(finite):
        return no_extremal(3, 4)
    low = finite.min(0) - 2 * step
    shape = np.ceil((finite.max(0) + 2 * step - low) / step) + 1
    if shape.prod() > _MOST_NODES:
        raise ValueError(f"spacing: {step} gives {shape.prod():.3g} nodes; expected at most {_MOST_NODES}")
    counts = tuple(int(k) for k in shape)
    nodes = np.stack(np.meshgrid(*(np.arange(k) for k in counts), indexing="ij"), -1).reshape(-1, 3)
    votes = VoteField(finite, scale, _CURVATURE).votes(low + step * nodes)
    saliency = (votes.eigenvalues[:, 0] - votes.eigenvalues[:, 1]).reshape(counts)
    normals = votes.normals.reshape(*counts, 3)
    if not saliency.any():
        return no_extremal(3, 4)
    slope = (np.stack(np.gradient(saliency), -1) * normals).sum(-1)
    found = [_crossings(saliency, normals, slope, axis, share * saliency.max()) for axis in range(3)]
    return _dual(found, counts, low, step)


def extract_curves(
    points: ArrayLike,
    *,
    sigma: float | None = None,
    spacing: float | None = None,
    least: float = 0.2,
    support: float = 2.0,
    contrast: float = 6.0,
) -> Extremal:
    """Extract the curves in the plane or in space on which the votes of tokens agree.

    Parameters
    ----------
    points : array_like, (n, 2) or (n, 3)
        Tokens. Those with numbers that are not finite are ignored.
    sigma : float, optional
        The scale of votes, in the units of the points. By default it is the least of 1, 1.5, 2.25 and 3.4 times the
        scale of `estimate_normals` whose curves explain the tokens, or else the last one.
    spacing : float, optional
        Of vertices along curves; by default a quarter of sigma.
    least : float, optional
        The least saliency, in units of the largest one of curves and surfaces.
    support : float, optional
        The least saliency of a curve in the median along it, in units of the vote of one token.
    contrast : float, optional
        The least ratio of the saliency on a curve to that at the distance sigma from it, in the median along the curve.
        Curves of tokens have 10 to 40, random tokens up to about 6. Lines along which two surfaces cross at 60 degrees
        have about 5, at 90 degrees about 15.

    Returns
    -------
    Extremal
        Polylines: each vertex belongs to at most two segments, and rings are closed. These are curves of tokens, and in
        space also those in which surfaces cross. Curves end at the last token, typically within half of sigma, and may
        have gaps of the length sigma at junctions. Those that are shorter than 3 sigma are left out, and parallel
        curves closer to each other than half of sigma merge. In the plane, curves that chance explains are left out.
        The status is UNEXPLAINED if tokens beside the curves are denser than by chance, as with noise of more than 0.15
        sigma.

    Raises
    ------
    ValueError
        If an argument has a wrong shape or is out of its range.
    """
    tokens = finite_tokens(points, (2, 3))
    own = 1.0 if sigma is None else sigma
    _settings(own, spacing, least)
    for name, value in (("support", support), ("contrast", contrast)):
        if finite_number(value, name) <= 0:
            raise ValueError(f"{name}: {value}; expected a positive number")
    scales = [own] if sigma is not None else [factor * default_sigma(tokens) for factor in _SCALES]
    for trial in scales:
        scale, step, share = _settings(trial, spacing, least)
        field = VoteField(tokens, scale, _CURVATURE)
        found = without_chance(trace_curves(field, scale, step, share, support, contrast), field.tokens.points, scale)
        found = replace(found, status=curve_status(found, field.tokens, scale), sigma=scale)
        if found.status == CurveStatus.OK:
            break
    return found


def _settings(sigma: float, spacing: float | None, least: float) -> tuple[float, float, float]:
    scale, share = finite_number(sigma, "sigma"), finite_number(least, "least")
    step = scale / 4 if spacing is None else finite_number(spacing, "spacing")
    if scale <= 0 or step <= 0 or not 0 < share < 1:
        raise ValueError(
            f"sigma, spacing, least: {scale}, {step}, {share}; expected two positive numbers, and one between 0 and 1"
        )
    return scale, step, share


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
    around = np.array([[0, 0], [-1, 0], [-1, -1], [0, -1]])
    cells, places, sizes = [], [], []
    for axis, (edges, share, size) in enumerate(found):
        others = [k for k in range(3) if k != axis]
        corners = np.repeat(edges[:, None], len(around), 1)
        corners[..., others] += around
        inside = (corners >= 0).all((1, 2)) & (corners < np.array(counts) - 1).all((1, 2))
        place = edges.astype(float)
        place[:, axis] += share
        cells.append(np.ravel_multi_index(tuple(corners[inside].reshape(-1, 3).T), counts))
        places.append(np.repeat(place[inside], len(around), 0))
        sizes.append(np.repeat(size[inside], len(around)))
    every: NDArray[Any] = np.concatenate(cells)
    if not len(every):
        return no_extremal(3, 4)
    _, rows = np.unique(every, return_inverse=True)
    total = np.bincount(rows)
    spots, weights = np.concatenate(places), np.concatenate(sizes)
    vertices = np.stack([np.bincount(rows, spots[:, k]) / total for k in range(3)], 1)
    return Extremal(low + step * vertices, rows.reshape(-1, 4), np.bincount(rows, weights) / total)
