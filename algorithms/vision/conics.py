"""The conic through five points of a plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import projective2

from ..arguments import Reals, real_array
from ..precision import rounding_of
from .normalization import homogeneous, rounding
from .status import VisionStatus

_SINGULAR = 1e-11
"""Least singular value of the five equations, relative to the largest, for which they determine a conic."""


@dataclass(frozen=True, slots=True, eq=False)
class ConicThroughPoints:
    """Result of `conic_through_points`.

    Attributes
    ----------
    coefficients : array, (..., 6)
        ``(a, b, c, d, e, f)`` of ``a x**2 + b x y + c y**2 + d x w + e y w + f w**2 = 0``, with a sum of squares of 1;
        NaN if the status is not OK.
    status : array, (...)
        `VisionStatus`: OK, DEGENERATE or NOT_FINITE.
    """

    coefficients: Reals
    status: NDArray[np.int64]


def conic_through_points(points: ArrayLike) -> ConicThroughPoints:
    """Return the conic through five points, by brackets (Pascal's theorem as an equation).

    Parameters
    ----------
    points : array_like, (..., 5, 2) or (..., 5, 3)
        Euclidean or homogeneous.

    Returns
    -------
    ConicThroughPoints
        The status is DEGENERATE if four points are on a line or two coincide, up to rounding, because the conic is then
        not unique. Three points on a line are allowed: the conic is then a pair of lines.

    Raises
    ------
    TypeError, ValueError
        If `points` does not have the shape of five points.

    Notes
    -----
    Points are normalised to mean 0 and a mean distance of the square root of 2, so that the result does not depend on
    position or unit; homogeneous points are scaled to unit length.
    """
    given = real_array(points, "points", (5, -1), "five points")
    array = given.astype(np.float64, copy=False)
    if array.shape[-1] not in (2, 3):
        raise ValueError(f"points: shape {array.shape}; expected (..., 5, 2) or (..., 5, 3)")
    is_finite = np.asarray(np.isfinite(array).all((-2, -1)))
    array = np.where(is_finite[..., None, None], array, 0.0)
    with np.errstate(all="ignore"):
        places, matrix = _normalized(array)
        usable = np.asarray(is_finite & np.isfinite(places).all((-2, -1)))
        if array.shape[-1] == 2:
            usable &= np.ptp(array, axis=-2).max(-1) > rounding(given)
        places = np.where(usable[..., None, None], places, 0.0)
        x, y, w = np.moveaxis(places, -1, 0)
        equations = np.stack([x * x, x * y, y * y, x * w, y * w, w * w], -1)
        sizes = np.linalg.svd(equations, compute_uv=False)
        usable &= sizes[..., -1] > rounding_of(given, part=_SINGULAR) * sizes[..., 0]
        found = _moved(projective2.conic_from_points(places), matrix)
        found = found / np.abs(found).max(-1, keepdims=True)
        found = found / np.linalg.norm(found, axis=-1, keepdims=True)
    status = np.where(usable, VisionStatus.OK, VisionStatus.DEGENERATE)
    status = np.where(is_finite, status, VisionStatus.NOT_FINITE).astype(np.int64)
    return ConicThroughPoints(np.where(usable[..., None], found, np.nan), status)


def _normalized(array: Reals) -> tuple[Reals, Reals]:
    """Return homogeneous points of about unit size, and the matrix of the normalisation."""
    if array.shape[-1] == 3:
        sizes = np.abs(array).max(-1, keepdims=True)
        units = array / sizes
        return units / np.linalg.norm(units, axis=-1, keepdims=True), np.eye(3)
    centre = array.mean(-2, keepdims=True)
    offset = array - centre
    largest = np.abs(offset).max((-2, -1), keepdims=True)
    spread = largest * np.linalg.norm(offset / largest, axis=-1, keepdims=True).mean(-2, keepdims=True)
    scale = np.sqrt(2) / spread
    matrix = np.zeros((*array.shape[:-2], 3, 3))
    matrix[..., 0, 0] = matrix[..., 1, 1] = scale[..., 0, 0]
    matrix[..., :2, 2] = -(centre * scale)[..., 0, :]
    matrix[..., 2, 2] = 1
    return homogeneous(offset * scale), matrix


def _moved(conic: Reals, matrix: Reals) -> Reals:
    """Return the conic of the points that `matrix` maps to those of `conic`: ``M' C M``."""
    a, b, c, d, e, f = (conic[..., k] for k in range(6))
    rows = [[a, b / 2, d / 2], [b / 2, c, e / 2], [d / 2, e / 2, f]]
    whole = np.stack([np.stack(row, -1) for row in rows], -2)
    whole = np.swapaxes(matrix, -1, -2) @ whole @ matrix
    doubled = whole * (2 - np.eye(3))
    return np.stack([doubled[..., i, j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))], -1)
