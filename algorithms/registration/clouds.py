"""Clouds of points for registration: valid rows, thinning by voxels, weights by local density, and normals."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from generated import tensor_voting

from ..arguments import Reals, moderate, real_array
from ..precision import ROUNDING, TINY
from .rigid_status import RegistrationStatus

FEWEST = 20
"""Different points that a cloud needs."""
_NEIGHBOURS, _NORMAL_NEIGHBOURS = 6, 12
"""Neighbours to the farthest of which the spacing is measured, and points to which planes are fitted for normals."""
_MOST_WEIGHT = 3.0
"""The largest weight of a point: denser ones would dominate."""
_UNEVEN = (0.3, 0.95)
"""Quantiles of distances of neighbours whose ratio is large among outliers."""
_STRAY, _MOST_NEAR = 10.0, 0.9
"""Points are stray if they are farther from the median than this multiple of the distance within which this part of the
cloud is. Uniform outliers, which weights handle, are not so far."""
_STRICT = 2e-3
"""Ratio of extents below which a cloud has no thickness that could be compared with another one."""
_LINE, _FLAT, _ALSO = 0.02, 0.12, 1.5
"""Ratios of the second to the first extent of a line, and of the third to the second extent of a flat cloud. The other
cloud may have this factor more, so that noise and missing parts do not decide."""
_PRIOR = 0.05
"""Spread, as part of the whole, that is added in the directions orthogonal to a prior."""
_VOXEL_TRIES = 4
"""A limit on work: how often the edge of voxels is corrected until the number of points is within a fifth of
the required one."""
_HASH = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)
"""Odd factors of the bits of coordinates."""


@dataclass(frozen=True, eq=False)
class Cloud:
    """Points with their k-d tree, weights and spacing.

    Attributes
    ----------
    points : array, (n, 3)
    tree : cKDTree
    weights : array, (n,)
        Large where points are dense, at most 3: uniform outliers have small weights.
    spacing : float
        The median distance to the sixth neighbour.
    unevenness : float
        The ratio of large to small distances to the sixth neighbour, which outliers increase.
    """

    points: Reals
    tree: Any
    weights: Reals
    spacing: float
    unevenness: float

    @property
    def centre(self) -> Reals:
        """The weighted mean."""
        return np.asarray(self.weights @ self.points / self.weights.sum())

    @property
    def size(self) -> float:
        """The weighted root mean square distance from the centre."""
        squares = ((self.points - self.centre) ** 2).sum(1)
        return float(np.sqrt(self.weights @ squares / self.weights.sum()))


def valid_points(value: ArrayLike, name: str) -> tuple[Reals, Any]:
    """Return the finite points (n, 3) of an array without repeated ones, and a mask of the finite rows."""
    array = real_array(value, name, (-1, 3), "points").astype(float)
    if array.ndim != 2:
        raise ValueError(f"{name}: shape {array.shape}; expected (n, 3), points")
    rows = np.isfinite(array).all(1)
    points = moderate(array[rows], name) + 0.0  # -0.0 becomes 0.0, so that equal points have equal bits
    # Sorting one hash is faster than sorting rows; different points with one hash would only be separated.
    keys = points.view(np.uint64) @ _HASH
    order = np.argsort(keys)
    ordered = points[order]
    first = np.ones(len(points), bool)
    first[1:] = (ordered[1:] != ordered[:-1]).any(1)
    return points[np.sort(order[first])], rows


def without_stray(points: Reals) -> Reals:
    """Return points without the few that are far from all others, so that extents are those of the object."""
    if len(points) < FEWEST:
        return points
    far = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    return np.asarray(points[far <= _STRAY * np.quantile(far, _MOST_NEAR)])


class Shape(IntEnum):
    """Of how many dimensions clouds are."""

    SOLID = 0
    FLAT = 1
    LINE = 2
    MIXED = 3
    """One is exactly flat or a line, and the other is not."""


def shape_of(source: Reals, target: Reals) -> tuple[Shape, RegistrationStatus]:
    """Return how two clouds are to be registered, and the status if they are too few or of different shapes."""
    if min(len(source), len(target)) < FEWEST:
        return Shape.MIXED, RegistrationStatus.TOO_FEW_POINTS
    extents = [np.linalg.svd(points - points.mean(0), compute_uv=False) for points in (source, target)]
    narrow, thin = (np.array([e[k] / max(e[k - 1], TINY) for e in extents]) for k in (1, 2))
    if narrow.min() < _LINE and narrow.max() < _ALSO * _LINE:
        return Shape.LINE, RegistrationStatus.OK
    if narrow.min() < _STRICT:
        return Shape.MIXED, RegistrationStatus.COLLINEAR
    if thin.min() < _FLAT and thin.max() < _ALSO * _FLAT:
        return Shape.FLAT, RegistrationStatus.OK
    flat = min(e[2] / e[0] for e in extents)
    return (Shape.MIXED, RegistrationStatus.COPLANAR) if flat < _STRICT else (Shape.SOLID, RegistrationStatus.OK)


def thickness(source: Reals, target: Reals) -> float:
    """Return the smaller ratio of the third to the second extent of two clouds."""
    extents = [np.linalg.svd(points - points.mean(0), compute_uv=False) for points in (source, target)]
    return float(min(e[2] / e[1] for e in extents))


def cloud_of(points: Reals) -> Cloud:
    """Build the tree of a cloud, and weights of points by the distance to their neighbours."""
    tree = scipy.spatial.cKDTree(points)
    far = tree.query(points, min(_NEIGHBOURS, len(points) - 1) + 1)[0][:, -1]
    spacing = float(np.median(far))
    # Of points that coincide, as in voxels that several scans fill, some or most have the distance 0.
    ratio = np.divide(spacing, far, out=np.full_like(far, _MOST_WEIGHT), where=far > ROUNDING * spacing)
    weights = np.minimum(ratio**2, _MOST_WEIGHT)
    low, high = np.quantile(far, _UNEVEN)
    return Cloud(points, tree, weights, spacing, float(high / low if low else np.inf if high else 1.0))


def thinned(points: Reals, voxel: float) -> Reals:
    """Return the mean of the points of each voxel."""
    cells = np.floor((points - points.min(0)) / voxel).astype(np.int64)
    size = cells.max(0) + 1
    keys = (cells[:, 0] * size[1] + cells[:, 1]) * size[2] + cells[:, 2]
    _, row, count = np.unique(keys, return_inverse=True, return_counts=True)
    return np.stack([np.bincount(row, points[:, k]) / count for k in range(3)], 1)


def voxel_for(points: Reals, most: int) -> float:
    """Return the size of voxels that leaves about `most` points of a surface."""
    few = points[:: max(1, len(points) // (8 * most))]
    voxel = float(np.linalg.norm(few.std(0))) * np.sqrt(8.0 / most)
    for _ in range(_VOXEL_TRIES):
        count = len(thinned(few, voxel))
        if 0.8 * most < count < 1.2 * most:
            break
        voxel *= float(np.sqrt(count / most))
    return float(voxel)


def levels(source: Reals, target: Reals, most: int) -> tuple[Cloud, Cloud]:
    """Return clouds of at most about so many points, thinned by the same voxels."""
    larger = max(source, target, key=len)
    if len(larger) <= 2 * most:
        return cloud_of(source), cloud_of(target)
    voxel = voxel_for(larger, most)
    return cloud_of(thinned(source, voxel)), cloud_of(thinned(target, voxel))


def normals_of(cloud: Cloud, prior: Reals | None = None) -> Reals:
    """Return unit normals (n, 3), of unknown sign: the direction of least spread of weighted neighbours.

    With a prior, a unit vector, spreads that do not determine a direction, as on a curve, give this one.
    `estimate_normals` takes the axes of votes, by the same kernel. As a target of registration, they fitted slightly
    worse among outliers than spreads with the weights of the cloud.
    """
    near = cloud.tree.query(cloud.points, min(_NORMAL_NEIGHBOURS, len(cloud.points)))[1]
    weights = cloud.weights[near]
    offsets = cloud.points[near] - cloud.points[:, None]
    offsets -= np.einsum("nk,nki->ni", weights, offsets)[:, None] / weights.sum(1)[:, None, None]
    spread = np.matmul((weights[..., None] * offsets).transpose(0, 2, 1), offsets)
    if prior is not None:
        size = np.trace(spread, axis1=1, axis2=2)
        spread += _PRIOR * size[:, None, None] * (np.eye(3) - np.outer(prior, prior))
    upper = np.triu_indices(3)
    return np.asarray(tensor_voting.spectrum(spread[:, upper[0], upper[1]])[1][:, 2])
