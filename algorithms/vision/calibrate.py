"""Intrinsic parameters from views of planes: the circular points of planes lie on the image of the absolute conic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from generated import projective2

from ..arguments import Reals, real_array
from ..evidence import Noise, largest_ratio
from .normalization import flatness, homogeneous, similarity
from .planes import linear_homography
from .status import VisionStatus, check_points

_RANK = 1e-9
"""Points of a view are on a line, up to noise, if the eighth singular value is below this fraction of the first."""
_OPEN = 1e-6
"""Equations are underdetermined if their last but one singular value is below this fraction of the first."""
_FLAT = 1e-6
"""From floating point: points are on a line if their extent across it is below this fraction of that along it."""
_BENDINGS = 4
"""Number of terms of `_bending`."""
_ROUNDING = 1e-9
"""From floating point: distances below this fraction of pixels are rounding errors."""


@dataclass(frozen=True, slots=True, eq=False)
class PlaneCalibration:
    """Intrinsic parameters estimated from views of planes."""

    intrinsics: Reals
    """(3, 3) as in `Camera`; NaN if the status is neither OK nor NOT_CONVERGED."""
    status: VisionStatus
    homographies: Reals
    """(v, 3, 3) from each plane to its view, of norm 1."""
    singular_values: Reals
    """Singular values of the equations, descending. The last is due to noise; the one before measures how much the
    views differ."""
    residual: float = np.nan
    """The root mean square distance of pixels from the images of the points by the homographies, in pixels."""
    distortion: float = np.nan
    """The coefficient of the square of the radius, in focal lengths, of the radial distortion that residuals show."""


def calibrate_from_planes(
    planes: ArrayLike | Sequence[ArrayLike], views: Sequence[ArrayLike] | Reals, skew: bool = False
) -> PlaneCalibration:
    """Estimate the intrinsic parameters of a camera from views of known points of planes.

    The homography of a plane maps its circular points to ``h1 + i h2`` and its conjugate, which lie on the image of
    the absolute conic, ``(K K')^-1``: each view gives two real equations (as in Zhang 2000, derived differently). The
    equations are solved by least squares in normalised coordinates.

    Parameters
    ----------
    planes : array_like, (n, 2), or a sequence of (n_k, 2)
        Points of one plane for all views, or of one plane for each view, in any unit.
    views : sequence of array_like, (n_k, 2)
        Their pixels, without lens distortion.
    skew : bool
        Whether entry (0, 1) of K is estimated too. This requires three views, otherwise two suffice.

    Returns
    -------
    PlaneCalibration
        DEGENERATE if points of a plane are on a line, if planes are parallel, or if the conic is not that of a camera.
        NOT_CONVERGED if the residuals contradict a camera without distortion: if radial distortion explains more of
        them than it leaves, and than noise would with a probability of a thousandth. `intrinsics` are then those
        without distortion.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points and pixels differ.
    """
    nothing = np.full((3, 3), np.nan)
    matrices, places, pixels, status = _homographies(planes, views, 3 if skew else 2)
    if status != VisionStatus.OK:
        return PlaneCalibration(nothing, status, matrices, np.empty(0))
    scale = similarity(np.concatenate(pixels))
    # Normalise the planes too: this preserves the circular points and gives the equations of all views equal weight.
    own = np.stack([np.linalg.inv(similarity(a)) for a in places])
    rows = projective2.circular_point_equations(scale @ (matrices / _third(matrices, own)) @ own).reshape(-1, 6)
    if not skew:
        rows = np.delete(rows, 1, axis=1)
    _, values, right = np.linalg.svd(rows)
    if len(values) < rows.shape[1] - 1 or values[rows.shape[1] - 2] <= _OPEN * values[0]:
        return PlaneCalibration(nothing, VisionStatus.DEGENERATE, matrices, values)
    conic = right[-1] if skew else np.insert(right[-1], 1, 0.0)
    intrinsics = _intrinsics(conic[None], scale)[0]
    return _calibration(intrinsics, matrices, values, places, pixels)


def calibrate_by_pascal(
    planes: ArrayLike | Sequence[ArrayLike], views: Sequence[ArrayLike] | Reals
) -> PlaneCalibration:
    """Estimate the intrinsic parameters of a camera from images of circular points, by Pascal's theorem.

    Every three views give six circular points. Five of them, which are complex, determine the image of the absolute
    conic by brackets; without noise the sixth one completes Pascal's hexagon. The result is the median of the
    parameters over all triples of views and three choices of the omitted point (Bayro-Corrochano, *Geometric
    Computing*, 2010, 14.3).

    Parameters
    ----------
    planes, views
        As for `calibrate_from_planes`, with at least three views.

    Returns
    -------
    PlaneCalibration
        The skew is estimated. The singular values are the magnitudes of Pascal's bracket for all triples of views,
        ascending, for points of norm 1: 0 without noise. The status is DEGENERATE if no triple gives a camera, and
        NOT_CONVERGED as for `calibrate_from_planes`.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points and pixels differ.
    """
    nothing = np.full((3, 3), np.nan)
    matrices, places, pixels, status = _homographies(planes, views, 3)
    if status != VisionStatus.OK:
        return PlaneCalibration(nothing, status, matrices, np.empty(0))
    scale = similarity(np.concatenate(pixels))
    circular = scale @ (matrices[:, :, 0] + 1j * matrices[:, :, 1])[..., None]
    points = circular[..., 0] / np.linalg.norm(circular[..., 0], axis=-1, keepdims=True)
    triples = points[np.array(list(combinations(range(len(points)), 3)))]
    hexagons = np.stack([triples, triples.conj()], -2).reshape(len(triples), 6, 3)
    defects = np.sort(np.abs(projective2.pascal_bracket(hexagons)))
    cyclic = np.concatenate([np.roll(hexagons, 2 * k, axis=1) for k in range(3)])
    conics = projective2.conic_from_points(cyclic[:, :5])
    sizes = np.linalg.norm(conics, axis=-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        conics = conics / sizes
        # The conic is real up to a factor: the one that makes the sum of its squares positive.
        phase = np.sqrt((conics**2).sum(-1, keepdims=True))
        real = (conics * (phase.conj() / np.abs(phase))).real
    usable = np.isfinite(real).all(-1) & (sizes[:, 0] > _OPEN**2)
    found = _intrinsics(real[usable], scale)
    found = found[np.isfinite(found).all((1, 2))]
    if not len(found):
        return PlaneCalibration(nothing, VisionStatus.DEGENERATE, matrices, defects)
    return _calibration(np.median(found, axis=0), matrices, defects, places, pixels)


def _calibration(
    intrinsics: Reals, matrices: Reals, values: Reals, places: list[Reals], pixels: list[Reals]
) -> PlaneCalibration:
    """Return the result with its residual, and whether radial distortion explains that better than noise.

    Residuals and their derivatives by terms of distortion are compared across the derivatives by the homographies,
    which would follow them. Their ratio has Fisher's distribution, with as many degrees of freedom as there are terms.
    """
    if not np.isfinite(intrinsics).all():
        return PlaneCalibration(intrinsics, VisionStatus.DEGENERATE, matrices, values)
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
        freedom, rounding = freedom + len(off) - 8, rounding + (_ROUNDING**2 * image**2).sum()
    cost = float(normal[-1, -1])
    coefficients = np.linalg.lstsq(normal[:-1, :-1], normal[:-1, -1], rcond=None)[0]
    explained = float(normal[:-1, -1] @ coefficients)
    noise = Noise(0.0, 0.0).raised(np.asarray(cost - explained), freedom)
    # A distortion that leaves more than it explains is hidden in the noise, and moves the parameters as little.
    is_bent = (
        freedom > 0
        and explained > max(_BENDINGS * largest_ratio(_BENDINGS, freedom) * float(noise), cost - explained) + rounding
    )
    status = VisionStatus.NOT_CONVERGED if is_bent else VisionStatus.OK
    residual = float(np.sqrt(cost / sum(map(len, pixels))))
    return PlaneCalibration(intrinsics, status, matrices, values, residual, float(coefficients[0]))


def _bending(ray: Reals) -> Reals:
    """Return displacements (4, n, 2) of directions by two radial terms, and by those of another centre (Brown 1971)."""
    x, y = ray.T
    square = x * x + y * y
    terms = [x * square, y * square], [x * square**2, y * square**2]
    return np.moveaxis(np.array([*terms, [square + 2 * x * x, 2 * x * y], [2 * x * y, square + 2 * y * y]]), 1, 2)


def _intrinsics(conics: Reals, scale: Reals) -> Reals:
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


def _homographies(
    planes: ArrayLike | Sequence[ArrayLike], views: Sequence[ArrayLike] | Reals, least: int
) -> tuple[Reals, list[Reals], list[Reals], VisionStatus]:
    """Return the homography of each view, and the points and pixels; empty if the status is not OK."""
    pixels = [real_array(view, f"views[{k}]", (2,), "x y") for k, view in enumerate(views)]
    one_plane = np.ndim(planes[0] if len(pixels) else 0) < 2  # type: ignore[index]
    given: Sequence[ArrayLike] = [planes] * len(pixels) if one_plane else planes  # type: ignore[assignment, list-item]
    if len(given) != len(pixels):
        raise ValueError(f"planes: {len(given)} planes; expected {len(pixels)}, one for each view")
    places = [real_array(plane, f"planes[{k}]", (2,), "x y") for k, plane in enumerate(given)]
    pairs = list(zip(places, pixels, strict=True))
    states = [check_points({f"planes[{k}]": a, f"views[{k}]": b}, 4, "points") for k, (a, b) in enumerate(pairs)]
    worst = VisionStatus.TOO_FEW if len(pixels) < least else max(states)
    if worst != VisionStatus.OK:
        return np.empty((0, 3, 3)), places, pixels, worst
    if any(min(flatness(a), flatness(b)) <= _FLAT for a, b in pairs):
        return np.empty((0, 3, 3)), places, pixels, VisionStatus.DEGENERATE
    matrices, gaps = zip(*(linear_homography(a, b) for a, b in pairs), strict=True)
    status = VisionStatus.OK if min(gaps) > _RANK else VisionStatus.DEGENERATE
    return np.stack(matrices), places, pixels, status


def _third(matrices: Reals, own: Reals) -> Reals:
    """Return the last entry of each homography at the centroid of its plane: the weight of the pixel there."""
    return (matrices @ own)[:, 2:, 2:]
