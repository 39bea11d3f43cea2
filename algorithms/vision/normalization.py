"""Normalised coordinates, relative to the centroid and of unit size, which linear equations need (Hartley)."""

from __future__ import annotations

import numpy as np

from generated import robust_views

from ..arguments import Reals


def similarity(points: Reals, scale: Reals | None = None) -> Reals:
    """Return matrices (..., d + 1, d + 1) that map points (..., n, d) to mean 0 and mean square norm d.

    If `scale` (...) is given, it replaces the scale of the points.
    """
    n, dimension = points.shape[-2:]
    mean = points.sum(-2) / n
    if scale is None:
        centred = points - mean[..., None, :]
        spread = np.sqrt(np.einsum("...nd,...nd->...", centred, centred) / (n * dimension))
        # Rounding differences between equal points are not scaled up.
        scale = 1 / np.where(spread > rounding(points), spread, np.fmax(np.abs(mean).max(-1), 1))
    matrix = np.zeros((*points.shape[:-2], dimension + 1, dimension + 1), points.dtype)
    matrix[..., range(dimension), range(dimension)] = scale[..., None]
    matrix[..., :-1, -1] = -scale[..., None] * mean
    matrix[..., -1, -1] = 1
    return matrix


def rounding(points: Reals) -> Reals:
    """Return the spread of equal points (..., n, d) due to rounding; a smaller spread is insignificant."""
    return np.asarray(8 * np.finfo(points.dtype).eps * np.abs(points).max((-2, -1), initial=0))


def normalized(points: Reals, scale: Reals | None = None) -> tuple[Reals, Reals]:
    """Return the points after their `similarity`, and the similarity."""
    matrix = similarity(points, scale)
    # Differences from the mean are exact far from the origin, where sums with a shift would round each point.
    return (points - points.sum(-2, keepdims=True) / points.shape[-2]) * matrix[..., :1, :1], matrix


def undone(matrix: Reals) -> Reals:
    """Return the inverses of similarities."""
    inverse = matrix.copy()
    inverse[..., :-1, :-1] = matrix[..., :-1, :-1] / matrix[..., :1, :1] ** 2
    inverse[..., :-1, -1] = -matrix[..., :-1, -1] / matrix[..., :1, 0]
    return inverse


def extents(points: Reals) -> tuple[Reals, Reals]:
    """Return the least and the largest singular value of centred points (..., n, d); in 2D to 1e-8 of the largest."""
    if points.shape[-1] != 2:
        values = np.linalg.svd(points - points.mean(-2, keepdims=True), compute_uv=False)
        return values[..., -1], values[..., 0]
    small, large = np.moveaxis(np.sqrt(robust_views.extents_of_pixels(points)), -1, 0)
    return small, large


def flatness(points: Reals) -> Reals:
    """Return the ratio of the least to the largest singular value of centred points (..., n, d).

    It is 0 on a line in 2D, on a plane in 3D, and for points that coincide up to rounding.
    """
    small, large = extents(points)
    differ = large > rounding(points) * np.sqrt(points.shape[-2])
    return np.asarray(np.where(differ, small / np.maximum(large, np.finfo(float).tiny), 0))


def three_on_a_line(quads: Reals, least: float = 1e-3) -> Reals:
    """Return whether three of four points (..., 4, 2) are nearly on a line, by the height of their triangle."""
    bad = np.zeros(quads.shape[:-2], bool)
    for k in range(4):
        a, b, c = (quads[..., m, :] for m in range(4) if m != k)
        u, v = b - a, c - a
        area = np.abs(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])
        bad |= area <= least * np.maximum((u * u).sum(-1), (v * v).sum(-1))
    return bad


def homogeneous(points: Reals) -> Reals:
    """Return points (..., d) with an additional last coordinate 1."""
    return np.concatenate([points, np.ones((*points.shape[:-1], 1), points.dtype)], -1)
