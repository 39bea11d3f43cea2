"""Intrinsic parameters from views of planes: all circular points of planes are on the image of the absolute conic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from generated import projective2

from ..arguments import Reals, real_array
from .normalization import flatness, similarity
from .planes import linear_homography
from .status import VisionStatus, check_points

_RANK = 1e-9
"""Points of a view on a line, but for noise, leave an eighth singular value below this part of the first."""
_OPEN = 1e-6
"""Equations whose last but one singular value is below this part of the first leave more than one conic."""
_FLAT = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class PlaneCalibration:
    """The intrinsic parameters that views of planes give."""

    intrinsics: Reals
    """(3, 3) as in `Camera`; NaN where the status is not OK."""
    status: VisionStatus
    homographies: Reals
    """(v, 3, 3) from each plane to its view, of norm 1."""
    singular_values: Reals
    """Of the equations, descending: the last is what noise leaves, the one before says how well the views differ."""


def calibrate_from_planes(
    planes: ArrayLike | Sequence[ArrayLike], views: Sequence[ArrayLike] | Reals, skew: bool = False
) -> PlaneCalibration:
    """Return the intrinsic parameters of a camera that saw known points of planes.

    The homography of a plane takes its circular points to ``h1 + i h2`` and its conjugate, which lie on the image of
    the absolute conic, ``(K K')^-1``: two real equations a view (Zhang 2000 by another way). Their least squares is
    found in coordinates of size 1.

    Parameters
    ----------
    planes : array_like, (n, 2), or a sequence of (n_k, 2)
        Points of one plane for all views, or of one for each, in any unit.
    views : sequence of array_like, (n_k, 2)
        Their pixels, of a lens without distortion.
    skew : bool
        Whether entry (0, 1) of K is sought too: then three views are needed, else two.

    Returns
    -------
    PlaneCalibration
        DEGENERATE where points of a plane are on a line, planes are parallel, or the conic is not that of a camera.

    Raises
    ------
    TypeError, ValueError
        If these are not as many points as pixels.
    """
    nothing = np.full((3, 3), np.nan)
    matrices, places, pixels, status = _homographies(planes, views, 3 if skew else 2)
    if status != VisionStatus.OK:
        return PlaneCalibration(nothing, status, matrices, np.empty(0))
    scale = similarity(np.concatenate(pixels))
    # Planes in coordinates of size 1 too: the circular points stay, and equations of all views weigh alike.
    own = np.stack([np.linalg.inv(similarity(a)) for a in places])
    rows = projective2.circular_point_equations(scale @ (matrices / _third(matrices, own)) @ own).reshape(-1, 6)
    if not skew:
        rows = np.delete(rows, 1, axis=1)
    _, values, right = np.linalg.svd(rows)
    if len(values) < rows.shape[1] - 1 or values[rows.shape[1] - 2] <= _OPEN * values[0]:
        return PlaneCalibration(nothing, VisionStatus.DEGENERATE, matrices, values)
    conic = right[-1] if skew else np.insert(right[-1], 1, 0.0)
    intrinsics = _intrinsics(conic[None], scale)[0]
    good = bool(np.isfinite(intrinsics).all())
    return PlaneCalibration(intrinsics, VisionStatus.OK if good else VisionStatus.DEGENERATE, matrices, values)


def calibrate_by_pascal(
    planes: ArrayLike | Sequence[ArrayLike], views: Sequence[ArrayLike] | Reals
) -> PlaneCalibration:
    """Return the intrinsic parameters of a camera from conics through images of circular points, by Pascal's theorem.

    Every three views show six circular points. Five of them, which are complex, determine the image of the absolute
    conic by brackets; the sixth completes Pascal's hexagon where there is no noise. Of all triples of views, and of the
    three ways to leave out one point, the medians of the parameters are taken (Bayro-Corrochano, *Geometric Computing*,
    2010, 14.3).

    Parameters
    ----------
    planes, views
        As for `calibrate_from_planes`; at least three views.

    Returns
    -------
    PlaneCalibration
        With skew. Its singular values are the magnitudes of Pascal's bracket for all triples of views, ascending, of
        points of norm 1: 0 without noise. DEGENERATE where no triple gives a camera.

    Raises
    ------
    TypeError, ValueError
        If these are not as many points as pixels.
    """
    nothing = np.full((3, 3), np.nan)
    matrices, _, pixels, status = _homographies(planes, views, 3)
    if status != VisionStatus.OK:
        return PlaneCalibration(nothing, status, matrices, np.empty(0))
    scale = similarity(np.concatenate(pixels))
    circular = scale @ (matrices[:, :, 0] + 1j * matrices[:, :, 1])[..., None]
    points = circular[..., 0] / np.linalg.norm(circular[..., 0], axis=-1, keepdims=True)
    triples = points[np.array(list(combinations(range(len(points)), 3)))]
    hexagons = np.stack([triples, triples.conj()], -2).reshape(len(triples), 6, 3)
    defects = np.sort(np.abs(projective2.pascal_bracket(hexagons)))
    turned = np.concatenate([np.roll(hexagons, 2 * k, axis=1) for k in range(3)])
    conics = projective2.conic_from_points(turned[:, :5])
    sizes = np.linalg.norm(conics, axis=-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        conics = conics / sizes
        # Up to a factor it is real: the one that makes the sum of its squares positive.
        phase = np.sqrt((conics**2).sum(-1, keepdims=True))
        real = (conics * (phase.conj() / np.abs(phase))).real
    usable = np.isfinite(real).all(-1) & (sizes[:, 0] > _OPEN**2)
    found = _intrinsics(real[usable], scale)
    found = found[np.isfinite(found).all((1, 2))]
    if not len(found):
        return PlaneCalibration(nothing, VisionStatus.DEGENERATE, matrices, defects)
    return PlaneCalibration(np.median(found, axis=0), VisionStatus.OK, matrices, defects)


def _intrinsics(conics: Reals, scale: Reals) -> Reals:
    """K from images of the absolute conic (n, 6) in scaled coordinates; NaN for those of no camera."""
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
    """Return the homography of each view, and the points and pixels; empty where the status is not OK."""
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
