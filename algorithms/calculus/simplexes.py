"""Single simplexes in space of any dimension: barycentric coordinates, facets and their normals."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb, factorial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, real_array
from .frames import reciprocal_frame
from .minors import LARGEST, wedge_rows

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Facets:
    """The facets of simplexes; facet i is opposite to corner i.

    Attributes
    ----------
    corners : array, (..., k + 1, k, n)
        Corners in the order that they have in the simplex.
    measures : array, (..., k + 1, C(n, k - 1))
        Directed measures over basis blades ordered by bitmap, ``edge_1 ^ ... / (k - 1)!`` with the sign ``(-1)**i`` of
        the boundary: their sum is 0. For a segment, they are -1 at the end and 1 at the start.
    contents : array, (..., k + 1)
        Lengths, areas or volumes; 1 for the ends of a segment.
    normals : array, (..., k + 1, n)
        Outward unit vectors in the span of the simplex, orthogonal to the facet. NaN for flat simplexes.
    heights : array, (..., k + 1)
        The distance of corner i from the opposite facet. NaN for flat simplexes.
    """

    corners: Floats
    measures: Floats
    contents: Floats
    normals: Floats
    heights: Floats


def barycentric_coordinates(simplex: ArrayLike, points: ArrayLike) -> Floats:
    """Return the barycentric coordinates of points: weights of the corners, of sum 1, whose weighted mean is the point.

    With the reciprocal frame ``f_i`` of the edges ``x_i - x_0`` they are ``f_i . (x - x_0)``, and for corner 0 the
    complement to 1. All are positive inside the simplex.

    Parameters
    ----------
    simplex : array_like, (..., k + 1, n)
        Corners, with k from 1 to n.
    points : array_like, (..., n)
        If `k` is less than `n`, points off the flat of the simplex have the coordinates of their projection.

    Returns
    -------
    array, (..., k + 1)
        NaN if the corners are in a flat of less than k dimensions, up to rounding.

    Raises
    ------
    TypeError, ValueError
        If shapes are inconsistent, or if values are not real numbers.
    """
    corners = _simplexes(simplex)
    places = real_array(points, "points", (corners.shape[-1],), "points").astype(np.float64, copy=False)
    edges = corners[..., 1:, :] - corners[..., :1, :]
    offset = places - corners[..., 0, :]
    others = (reciprocal_frame(edges).vectors @ offset[..., None])[..., 0]
    return np.concatenate([1 - others.sum(-1, keepdims=True), others], -1)


def facets(simplex: ArrayLike) -> Facets:
    """Compute the facets of simplexes: corners, directed measures, contents, outward normals and heights.

    Parameters
    ----------
    simplex : array_like, (..., k + 1, n)
        Corners, with k from 1 to n and n up to 12.

    Returns
    -------
    Facets

    Raises
    ------
    TypeError, ValueError
        If shapes are inconsistent, or if values are not real numbers.

    Notes
    -----
    The reciprocal vector of an edge is the gradient of a barycentric coordinate: it is orthogonal to the facet where
    the coordinate is 0, points inwards, and its length is the inverse of the height.
    """
    corners = _simplexes(simplex)
    *batch, count, n = corners.shape
    k = count - 1
    gradients = reciprocal_frame(corners[..., 1:, :] - corners[..., :1, :]).vectors
    gradients = np.concatenate([-gradients.sum(-2, keepdims=True), gradients], -2)
    lengths = np.linalg.norm(gradients, axis=-1)
    kept = np.array([[j for j in range(count) if j != i] for i in range(count)])
    sides = corners[..., kept, :]
    number = int(np.prod([*batch, count]))
    edges = (sides[..., 1:, :] - sides[..., :1, :]).reshape(number, k - 1, n)
    blades = wedge_rows(edges, k - 1) if k > 1 else np.ones((number, 1))
    signs = (-1.0) ** np.arange(count)[:, None]
    measures = blades.reshape(*batch, count, comb(n, k - 1)) / factorial(k - 1) * signs
    return Facets(sides, measures, np.linalg.norm(measures, axis=-1), -gradients / lengths[..., None], 1 / lengths)


def _simplexes(simplex: ArrayLike) -> Reals:
    array = real_array(simplex, "simplex", (-1, -1), "corners").astype(np.float64, copy=False)
    count, n = array.shape[-2:]
    if not 2 <= count <= n + 1 or n > LARGEST:
        raise ValueError(f"simplex: shape {array.shape}; expected (..., k + 1, n), k from 1 to n, n up to {LARGEST}")
    return array
