"""Intrinsic parameters from views of planes: all circular points of planes are on the image of the absolute conic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import projective2

from ..arguments import Reals, real_array
from .normalization import flatness, similarity
from .planes import linear_homography
from .status import VisionStatus, check_points

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
    """The intrinsic parameters of a camera that saw known points of planes.

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
        Where these are not as many points as pixels.
    """
    pixels = [real_array(view, f"views[{k}]", (2,), "x y") for k, view in enumerate(views)]
    nothing = np.full((3, 3), np.nan)
    one_plane = np.ndim(planes[0] if len(pixels) else 0) < 2  # type: ignore[index]
    given: Sequence[ArrayLike] = [planes] * len(pixels) if one_plane else planes  # type: ignore[assignment, list-item]
    if len(given) != len(pixels):
        raise ValueError(f"planes: {len(given)} planes; expected {len(pixels)}, one for each view")
    places = [real_array(plane, f"planes[{k}]", (2,), "x y") for k, plane in enumerate(given)]
    pairs = list(zip(places, pixels, strict=True))
    states = [check_points({f"planes[{k}]": a, f"views[{k}]": b}, 4, "points") for k, (a, b) in enumerate(pairs)]
    worst = VisionStatus.TOO_FEW if len(pixels) < (3 if skew else 2) else max(states)
    if worst != VisionStatus.OK:
        return PlaneCalibration(nothing, worst, np.empty((0, 3, 3)), np.empty(0))
    if any(min(flatness(a), flatness(b)) <= _FLAT for a, b in pairs):
        return PlaneCalibration(nothing, VisionStatus.DEGENERATE, np.empty((0, 3, 3)), np.empty(0))
    matrices = np.stack([linear_homography(a, b)[0] for a, b in pairs])
    scale = similarity(np.concatenate(pixels))
    # Planes in coordinates of size 1 too: the circular points stay, and equations of all views weigh alike.
    own = np.stack([np.linalg.inv(similarity(a)) for a, _ in pairs])
    rows = projective2.circular_point_equations(scale @ (matrices / _third(matrices, own)) @ own).reshape(-1, 6)
    if not skew:
        rows = np.delete(rows, 1, axis=1)
    _, values, right = np.linalg.svd(rows)
    if len(values) < rows.shape[1] - 1 or values[rows.shape[1] - 2] <= _OPEN * values[0]:
        return PlaneCalibration(nothing, VisionStatus.DEGENERATE, matrices, values)
    a, b, c, d, e, f = right[-1] if skew else np.insert(right[-1], 1, 0.0)
    conic = np.array([[a, b / 2, d / 2], [b / 2, c, e / 2], [d / 2, e / 2, f]])
    conic = conic * np.sign(np.trace(conic))
    if np.linalg.eigvalsh(conic)[0] <= 0:
        return PlaneCalibration(nothing, VisionStatus.DEGENERATE, matrices, values)
    intrinsics = np.linalg.inv(scale) @ np.linalg.inv(np.linalg.cholesky(conic).T)
    return PlaneCalibration(intrinsics / intrinsics[2, 2], VisionStatus.OK, matrices, values)


def _third(matrices: Reals, own: Reals) -> Reals:
    """The last entry of each homography at the centroid of its plane: the weight of the pixel there."""
    return (matrices @ own)[:, 2:, 2:]
