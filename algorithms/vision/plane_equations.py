"""Equations between planes and a camera without distortion: homographies, circular points, and what bends a lens."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from generated import projective2

from ..arguments import Reals, listed, real_array
from ..evidence.misfit import contradicts, explained_by, root_of
from ..precision import NEGLIGIBLE, SINGLE
from .normalization import flatness, homogeneous, similarity
from .planes import linear_homography
from .status import VisionStatus, check_points, one_set

_BENDINGS = 4
"""Number of terms of `_bending`."""


def closed_form(matrices: Reals, scale: Reals, own: Reals, skew: bool) -> tuple[Reals, Reals]:
    """Return K by the images of circular points, and the singular values of the equations.

    Parameters
    ----------
    matrices : array, (v, 3, 3)
        Homographies of planes.
    scale : array, (3, 3)
        A similarity that normalises pixels.
    own : array, (v, 3, 3)
        Similarities from normalised points of planes to points. Like all similarities they preserve the circular
        points; with them, the equations of all views have equal weight.
    skew : bool
        Whether the skew is estimated.

    Returns
    -------
    intrinsics : array, (3, 3)
        NaN if the planes leave it undetermined, or if there is no such camera.
    values : array
    """
    rows = projective2.circular_point_equations(scale @ (matrices / _third(matrices, own)) @ own).reshape(-1, 6)
    if not skew:
        rows = np.delete(rows, 1, axis=1)
    _, values, right = np.linalg.svd(rows)
    if len(values) < rows.shape[1] - 1 or values[rows.shape[1] - 2] <= SINGLE * values[0]:
        return np.full((3, 3), np.nan), values
    conic = right[-1] if skew else np.insert(right[-1], 1, 0.0)
    return intrinsics_of_conics(conic[None], scale)[0], values


def normalizations(places: list[Reals]) -> Reals:
    """Return the similarities (v, 3, 3) from normalised points of planes to the points."""
    return np.stack([np.linalg.inv(similarity(a)) for a in places])


def intrinsics_of_conics(conics: Reals, scale: Reals) -> Reals:
    """Return K from images of the absolute conic (n, 6) in scaled coordinates; NaN if there is no such camera."""
    a, b, c, d, e, f = np.moveaxis(conics, -1, 0)
    rows = [np.stack(row, -1) for row in ((a, b / 2, d / 2), (b / 2, c, e / 2), (d / 2, e / 2, f))]
    matrix = np.stack(rows, -2)
    matrix = matrix * np.sign(np.trace(matrix, axis1=-2, axis2=-1))[:, None, None]
    good = np.linalg.eigvalsh(matrix)[:, 0] > 0
    safe = np.where(good[:, None, None], matrix, np.eye(3))
    upper = np.linalg.inv(np.swapaxes(np.linalg.cholesky(safe), 1, 2))
    found = np.linalg.inv(scale) @ upper
    return np.where(good[:, None, None], found / found[:, 2:, 2:], np.nan)


def planes_of(planes: ArrayLike | Sequence[ArrayLike], n: int) -> list[Reals]:
    """Return the points (k, 2) of the planes of n views, from those of one plane for all views or of one for each."""
    given = listed(planes, "planes", "points, or of arrays (n, 2)")
    if not given or np.ndim(given[0]) < 2:
        return [real_array(planes, "planes", (2,), "x y")] * n  # type: ignore[arg-type]
    if len(given) != n:
        raise ValueError(f"planes: {len(given)} planes; expected {n}, one for each view")
    return [real_array(plane, f"planes[{k}]", (2,), "x y") for k, plane in enumerate(given)]


def homographies_of(
    planes: ArrayLike | Sequence[ArrayLike], views: Sequence[ArrayLike] | Reals, least: int
) -> tuple[Reals, list[Reals], list[Reals], VisionStatus]:
    """Return the homography of each view, and the points and pixels; empty if the status is not OK."""
    given = listed(views, "views", "arrays (n, 2), x y")
    pixels = [one_set(real_array(view, f"views[{k}]", (2,), "x y")) for k, view in enumerate(given)]
    places = planes_of(planes, len(pixels))
    pairs = list(zip(places, pixels, strict=True))
    states = [check_points({f"planes[{k}]": a, f"views[{k}]": b}, 4, "points") for k, (a, b) in enumerate(pairs)]
    worst = VisionStatus.TOO_FEW if len(pixels) < least else max(states)
    if worst != VisionStatus.OK:
        return np.empty((0, 3, 3)), places, pixels, worst
    if any(min(flatness(a), flatness(b)) <= SINGLE for a, b in pairs):
        return np.empty((0, 3, 3)), places, pixels, VisionStatus.DEGENERATE
    matrices, gaps = zip(*(linear_homography(a, b) for a, b in pairs), strict=True)
    status = VisionStatus.OK if min(gaps) > NEGLIGIBLE else VisionStatus.DEGENERATE
    return np.stack(matrices), places, pixels, status


def _third(matrices: Reals, own: Reals) -> Reals:
    """Return the last entry of each homography at the centroid of its plane: the weight of the pixel there."""
    return (matrices @ own)[:, 2:, 2:]


def bending_of(
    intrinsics: Reals, matrices: Reals, places: list[Reals], pixels: list[Reals]
) -> tuple[float, float, VisionStatus]:
    """Return the coefficient of radial distortion that residuals show, their root mean square, and a status.

    The status is NOT_CONVERGED if distortion explains the residuals better than noise.

    Residuals and their derivatives by terms of distortion are compared across the derivatives by the homographies,
    which would follow them. Their ratio has Fisher's distribution, with as many degrees of freedom as there are terms.
    """
    inverse, normal, freedom, rounding = np.linalg.inv(intrinsics), np.zeros((_BENDINGS + 1,) * 2), -_BENDINGS, 0.0
    for matrix, place, image in zip(matrices, places, pixels, strict=True):
        there = homogeneous(place) @ matrix.T
        seen = there[:, :2] / there[:, 2:]
        off = (image - seen).ravel()
        ray = homogeneous(seen) @ inverse.T
        bent = (_bending(ray[:, :2]) @ intrinsics[:2, :2].T).reshape(_BENDINGS, -1)
        across, nothing = homogeneous(place) / there[:, 2:], np.zeros((len(place), 3))
        rows = np.stack(
            [
                np.concatenate([across, nothing, -seen[:, :1] * across], 1),
                np.concatenate([nothing, across, -seen[:, 1:] * across], 1),
            ],
            1,
        ).reshape(-1, 9)
        basis = np.linalg.svd(rows / np.linalg.norm(rows, axis=0), full_matrices=False)[0][:, :8]
        columns = np.stack([*bent, off], 1)
        columns = columns - basis @ (basis.T @ columns)
        normal += columns.T @ columns
        freedom, rounding = freedom + len(off) - 8, rounding + (NEGLIGIBLE**2 * image**2).sum()
    cost, scale = float(normal[-1, -1]), np.sqrt(np.diag(normal))
    scale = np.where(scale > 0, scale, 1)
    root = root_of(normal / np.outer(scale, scale))
    found = explained_by(root)
    is_bent = contradicts(float(found.squares[-1]) * cost, cost, int(found.n_terms[-1]), freedom, rounding)
    coefficients = np.linalg.solve(root[:-1, :-1].T, root[-1, :-1]) * scale[-1] / scale[:-1]
    status = VisionStatus.NOT_CONVERGED if is_bent else VisionStatus.OK
    residual = float(np.sqrt(cost / sum(map(len, pixels))))
    return float(coefficients[0]), residual, status


def _bending(ray: Reals) -> Reals:
    """Return displacements (4, n, 2) of directions by two radial terms, and by those of another centre (Brown 1971)."""
    x, y = ray.T
    square = x * x + y * y
    terms = [x * square, y * square], [x * square**2, y * square**2]
    return np.moveaxis(np.array([*terms, [square + 2 * x * x, 2 * x * y], [2 * x * y, square + 2 * y * y]]), 1, 2)
