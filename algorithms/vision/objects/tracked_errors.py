"""Bounds of errors of a pose from edges in images, whose errors are not independent, and agreement of single images."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import scipy

from generated import pga3

from ...arguments import Reals
from ...evidence.status import RARE
from ...precision import NEGLIGIBLE
from .edge_measurement import MeasuredEdges
from .pose_estimation import estimated_pose
from .pose_models import KINDS, ObjectModel, View
from .pose_record import PoseEstimate, bounds_of
from .pose_status import PoseStatus

_COMMON = 0.02
"""The standard deviation in pixels of the part of an edge's error that is the same along a curve. With it, the median
of the quotients of errors and bounds in rendered images is that of normal errors."""
_LEAST_POINTS = 3
"""Least number of points of a curve whose median offset is used."""
_MOST_POINTS = 24
"""Largest number of points with a common error: half of a circle, whose sides have different backgrounds."""
_LEAST_AGREEING = 0.75
"""Least part of the edges of one image that agree with the pose."""
_COMPARED = (PoseStatus.OK, PoseStatus.SYMMETRIC, PoseStatus.UNCERTAIN)


def with_common_errors(estimate: PoseEstimate, parts: Sequence[MeasuredEdges]) -> PoseEstimate:
    """Return an estimate with the covariance for errors that have a part in common along each curve of an image.

    Shading, the background, and other things beside a curve displace its edge points to the same side. If n points of a
    curve have independent errors of variance v and a common one of variance c, they determine it as n independent
    points of variance v + n c do. The common variance is estimated from the median offset of each curve from the pose.
    """
    counts, medians = _curves(estimate, parts)
    if not len(counts) or not estimate.residual > 0:
        return estimate
    mean = float((np.minimum(counts, _MOST_POINTS) * counts).sum() / counts.sum())
    whole = medians[counts >= _LEAST_POINTS]
    # The pose is adapted to up to six of the offsets; of few curves, half are regarded as redundant.
    redundant = max(len(whole) - 6 + len(estimate.freedoms), len(whole) / 2, 1)
    common = max(_COMMON**2, float(whole @ whole) / redundant)
    return replace(estimate, covariance=estimate.covariance * (1 + mean * common / estimate.residual**2))


def _curves(estimate: PoseEstimate, parts: Sequence[MeasuredEdges]) -> tuple[Reals, Reals]:
    """Return for each curve in each image the number of points that agree with the pose, and their median offset."""
    counts, medians = [], []
    first = [0] * len(parts)
    for k, _, rows, agree in _parts(estimate, [one.view for one in parts]):
        offsets = parts[k].offsets[first[k] : first[k] + len(rows)]
        first[k] += len(rows)
        for row in np.unique(rows[agree]):
            own = offsets[agree & (rows == row)]
            counts.append(len(own))
            medians.append(float(np.median(own)))
    return np.array(counts, float), np.array(medians)


def without_refuted_curves(parts: Sequence[MeasuredEdges], estimate: PoseEstimate) -> list[MeasuredEdges] | None:
    """Leave out the curves of single images that are refuted by most of their points: something else hides them.

    None if there are no such curves, or if they have too many points for the others to be trusted.
    """
    kept = [{kind: getattr(one.view, kind) for kind in KINDS} for one in parts]
    offsets: list[list[Reals]] = [[] for _ in parts]
    first, total, left = [0] * len(parts), 0, 0
    for k, kind, rows, agree in _parts(estimate, [one.view for one in parts]):
        is_right = (2 * np.bincount(rows, agree) > np.bincount(rows))[rows]
        pixels = np.asarray(kept[k][kind][1])
        kept[k][kind] = (rows[is_right], pixels[is_right]) if is_right.any() else None
        offsets[k].append(parts[k].offsets[first[k] : first[k] + len(rows)][is_right])
        first[k], total, left = first[k] + len(rows), total + len(rows), left + int(is_right.sum())
    if left == total or left < _LEAST_AGREEING * total:
        return None
    return [
        replace(one, view=View(one.view.camera, **kept[k]), offsets=np.concatenate([np.zeros(0), *offsets[k]]))
        for k, one in enumerate(parts)
    ]


def exceeds(estimate: PoseEstimate, limits: tuple[float, float]) -> bool:
    """Return whether the bounds of errors, apart from motions that change no image, exceed an angle or a length."""
    covariance = estimate.covariance.copy()
    known = np.isfinite(covariance.diagonal())
    covariance[~known], covariance[:, ~known] = 0, 0
    return any(bound > limit for bound, limit in zip(bounds_of(covariance), limits, strict=True))


def disagreeing(
    model: ObjectModel, parts: Sequence[MeasuredEdges], estimate: PoseEstimate, noise: float,
    limits: tuple[float, float],
) -> list[int]:  # fmt: skip
    """Return which images disagree with the pose that was estimated from all of them.

    An image disagrees if too few of its edges are near the pose, or if the pose from this image alone differs
    from it by more than its covariance explains. Edges of something else may be consistent with a wrong pose in one
    image; the other images then determine another one.
    """
    views = [one.view for one in parts]
    right, total = np.zeros(len(views)), np.zeros(len(views))
    for k, _, rows, agree in _parts(estimate, views):
        right[k] += agree.sum()
        total[k] += len(rows)
    found = right < _LEAST_AGREEING * total
    for k, one in enumerate(parts):
        if len(parts) > 1 and not found[k]:
            alone = estimated_pose(model, one.view, estimate.motor, noise, limits)
            found[k] = alone.status in _COMPARED and _differ(model, with_common_errors(alone, [one]), estimate)
    return np.flatnonzero(found).tolist()


def _parts(estimate: PoseEstimate, views: Sequence[View]) -> Iterator[tuple[int, str, Reals, Reals]]:
    """Yield the kinds and elements of the points in each view, and whether their points agree with the pose."""
    for kind in KINDS:
        first = 0
        for k, view in enumerate(views):
            seen = getattr(view, kind)
            if seen is not None and kind != "points":
                rows = np.asarray(seen[0])
                yield k, kind, rows, estimate.inliers[kind][first : first + len(rows)]
                first += len(rows)


def _differ(model: ObjectModel, alone: PoseEstimate, estimate: PoseEstimate) -> bool:
    """Return whether a pose differs from another one by more than its covariance explains."""
    between = pga3.motor_to_matrix(pga3.motor_product(pga3.motor_inverse(alone.motor), estimate.motor))
    turn = between[:3, :3]
    # The rotation vector to first order: differences that matter are small.
    angles = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    off = np.concatenate([angles, between[:3] @ np.append(model.centre, 1.0) - model.centre])
    known = np.isfinite(alone.covariance.diagonal())
    if not known.any():
        return False
    off, covariance = off[known], alone.covariance[np.ix_(known, known)]
    return bool(
        off @ np.linalg.pinv(covariance, NEGLIGIBLE, hermitian=True) @ off > scipy.special.chdtri(len(off), RARE)
    )
