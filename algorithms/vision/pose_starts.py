"""Initial poses of cameras, from linear equations and from three points, for least squares in the image.

Points are given relative to their centroid, so that the effect of noise on rotations does not depend on the origin of
the world. All functions take leading axes.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from generated import linear_views, matrices

from ..arguments import Reals
from .normalization import homogeneous
from .planes import linear_homography

_FEW = 7
"""Number of points up to which linear equations are ill-conditioned or underdetermined; triples are tried too."""
_TRIPLES = 10


def pose_starts(places: Reals, seen: Reals) -> Reals:
    """Return candidates [R | t] (..., s, 3, 4) for centred points (..., n, 3) and their images x/z, y/z (..., n, 2).

    Two candidates are for points near a plane and agree with its homography to first order, one is for points in space
    (n at least 6), and for few points the best of those that fit three points exactly are added. Missing ones are NaN.
    """
    n = places.shape[-2]
    found = [*_from_plane(places, seen)]
    if n >= 6:
        found.append(_from_space(places, seen))
    if n <= _FEW:
        found += list(_from_triples(places, seen))
    return np.stack(found, -3)


def reversed_pose(pose: Reals, places: Reals) -> Reals:
    """Return poses (..., 3, 4) whose plane of largest extent is mirrored in the plane orthogonal to the line of sight.

    Both have the same image under parallel projection (Necker reversal): the other minimum of the distances in the
    image is near the reversed pose of points that are in a plane, and are small or distant.
    """
    return np.asarray(linear_views.reversed_pose(pose, _plane_axes(places)))


def three_points(places: Reals, seen: Reals) -> Reals:
    """Return the four [R | t] (..., 4, 3, 4) of three points (..., 3, 3) with images (..., 3, 2); missing ones are NaN.

    Distances between the points give two conics in the ratios of the depths, and those give a quartic (Grunert 1841).
    For complex roots, which noise makes of double roots, the real part is used.
    """
    rays = homogeneous(seen)
    rays = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    alpha, beta, gamma = ((rays[..., i, :] * rays[..., j, :]).sum(-1) for i, j in ((1, 2), (0, 2), (0, 1)))
    a, b, c = (((places[..., i, :] - places[..., j, :]) ** 2).sum(-1) for i, j in ((1, 2), (0, 2), (0, 1)))
    with np.errstate(all="ignore"):
        ratio, other = (a - c) / b, c / b
        # Depths are s, u s and v s; u = numerator / denominator, and u^2 - 2 gamma u + rest = 0, polynomials in v.
        numerator = np.stack([1 + ratio, -2 * ratio * beta, ratio - 1], -1)
        denominator = np.stack([2 * gamma, -2 * alpha], -1)
        rest = np.stack([1 - other, 2 * other * beta, -other], -1)
        quartic = _product(numerator, numerator) + _product(rest, _product(denominator, denominator))
        quartic[..., :4] -= 2 * gamma[..., None] * _product(numerator, denominator)
        v = _roots(quartic)
        u = _at(numerator, v) / _at(denominator, v)
        first = np.sqrt(b[..., None] / (1 + v * v - 2 * v * beta[..., None]))
        depths = np.stack([first, u * first, v * first], -1)
        depths = np.where((depths > 0).all(-1, keepdims=True), depths, np.nan)
        there = _frame(depths[..., None] * rays[..., None, :, :])
        rotation = there @ np.swapaxes(_frame(places), -1, -2)[..., None, :, :]
    shift = (depths[..., None] * rays[..., None, :, :]).mean(-2) - (rotation @ places.mean(-2)[..., None, :, None])[
        ..., 0
    ]
    return np.concatenate([rotation, shift[..., None]], -1)


def linear_camera_and_gap(places: Reals, pixels: Reals) -> tuple[Reals, float]:
    """Return the camera matrix of one set of points, and the ratio of the eleventh to the first singular value."""
    matrix, gap = _camera(places, pixels)
    return matrix, float(gap)


def _camera(places: Reals, pixels: Reals) -> tuple[Reals, Reals]:
    equations, left, right = linear_views.camera_equations(places, pixels)
    entries, gap, _ = matrices.null_vector(equations.reshape(*equations.shape[:-3], -1, 12))
    return np.asarray(linear_views.camera_of_entries(entries, left, right)), np.asarray(gap)


def _from_space(places: Reals, seen: Reals) -> Reals:
    matrix, _ = _camera(places, seen)
    return np.asarray(linear_views.pose_of_camera(np.where(np.isfinite(matrix), matrix, 0)))


def _from_plane(places: Reals, seen: Reals) -> tuple[Reals, Reals]:
    """Return the pose by the homography of the plane of largest extent, and its reversal."""
    axes = _plane_axes(places)
    matrix, _ = linear_homography(places @ np.swapaxes(axes[..., :2, :], -1, -2), seen)
    pose = np.asarray(linear_views.pose_of_plane(np.where(np.isfinite(matrix), matrix, 0), axes))
    return pose, np.asarray(linear_views.reversed_pose(pose, axes))


def _from_triples(places: Reals, seen: Reals) -> Reals:
    """Return the poses (4, ..., 3, 4) of triples with all points in front of the camera and the least residuals."""
    every = np.array(list(combinations(range(places.shape[-2]), 3)))
    triples = every[np.linspace(0, len(every) - 1, min(_TRIPLES, len(every))).round().astype(int)]
    found = three_points(places[..., triples, :], seen[..., triples, :])
    found = found.reshape(*places.shape[:-2], -1, 3, 4)
    in_camera = homogeneous(places)[..., None, :, :] @ np.swapaxes(found, -1, -2)
    with np.errstate(all="ignore"):
        off = ((in_camera[..., :2] / in_camera[..., 2:] - seen[..., None, :, :]) ** 2).sum((-1, -2))
    off = np.where((in_camera[..., 2] > 0).all(-1), off, np.inf)
    best = np.argsort(off, axis=-1)[..., :4]
    return np.moveaxis(np.take_along_axis(found, best[..., None, None], -3), -3, 0)


def _plane_axes(places: Reals) -> Reals:
    """Return axes, as rows (..., 3, 3), of which the first two are those of the largest extents of centred points."""
    return np.swapaxes(matrices.singular_vectors(places)[1], -1, -2)


def _frame(triangle: Reals) -> Reals:
    """Return orthonormal axes, as columns, of triangles (..., 3, 3): first edge, in-plane normal, normal."""
    edge, other = triangle[..., 1, :] - triangle[..., 0, :], triangle[..., 2, :] - triangle[..., 0, :]
    x = edge / np.linalg.norm(edge, axis=-1, keepdims=True)
    z = np.cross(x, other)
    z = z / np.linalg.norm(z, axis=-1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], -1)


def _product(one: Reals, two: Reals) -> Reals:
    """Return the products of polynomials, with coefficients on the last axis."""
    result = np.zeros((*one.shape[:-1], one.shape[-1] + two.shape[-1] - 1))
    for k in range(two.shape[-1]):
        result[..., k : k + one.shape[-1]] += one * two[..., k, None]
    return result


def _at(polynomial: Reals, x: Reals) -> Reals:
    value = np.zeros_like(x)
    for k in range(polynomial.shape[-1] - 1, -1, -1):
        value = value * x + polynomial[..., k, None]
    return value


def _roots(quartic: Reals) -> Reals:
    """Return the real parts of the four roots, NaN if the leading coefficient is 0 or NaN."""
    rest = quartic[..., 3::-1] / quartic[..., 4:]
    usable = np.isfinite(rest).all(-1, keepdims=True)
    return np.where(usable, matrices.polynomial_roots(np.where(usable, rest, 0))[0], np.nan)
