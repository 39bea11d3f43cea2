"""Detection of wrong observations in tracks of points through many views.

Sampling uses least median of squares (Rousseeuw 1984), which needs no threshold: noise is estimated from the median.
Images are normalised, so that the mean distance of points from the origin is of order one.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from generated import projective3

from ..arguments import Reals
from ..evidence import random_sets
from ..evidence.noise import ENOUGH, NORMAL
from ..precision import NEGLIGIBLE
from .fundamental import eight_points
from .linear_cameras import camera_equations, unit_moments
from .normalization import homogeneous

Flags = NDArray[np.bool_]

_FIRST, _SAMPLES = 30, 300
"""Number of samples that are drawn first, and if fewer than most points fit the best of them: with a quarter of the
tracks wrong, 30 of these contain none of the wrong ones."""
_MOST = 0.9
"""A limit on work: if this share of points fits the first samples, no more are drawn."""
_SURE = 5.0
"""An observation is wrong if it is off by more than this multiple of the noise, as one correct one in 270,000 is."""
_MEDIAN = 1.1774
"""Median of the distance of a point with noise of 1 in both coordinates."""
_SPREAD = 0.1
"""Larger noise is not noise: the images then match unrelated points by chance."""
_PAIRS = 40
"""Maximum number of pairs of views that propose a position for a point with wrong observations."""


def majority_of_pair(one: Reals, two: Reals) -> Flags:
    """Return which of the pairs of pixels (n, 2) fit the F with the least median distance."""
    n = len(one)
    if n < ENOUGH:
        return np.ones(n, np.bool_)

    def fitting(sets: Reals) -> Flags:
        off = np.abs(projective3.sampson_distance(eight_points(one[sets], two[sets])[:, None], one, two))
        median = np.median(np.nan_to_num(off, nan=np.inf), axis=1)
        best = int(np.argmin(median))
        # Finite-sample correction of Rousseeuw and Leroy (1987), for the points that are not in the sample.
        noise = NORMAL * (1 + 5 / (n - 8)) * median[best]
        return np.asarray(off[best] <= np.maximum(_SURE * noise, NEGLIGIBLE))

    return _by_samples(n, 8, fitting)


def seen_by_camera(image: Reals, points: Reals) -> Flags:
    """Return which of the pixels (n, 2) of points (n, 4) fit the camera with the least median distance."""
    n = len(image)
    even, _ = unit_moments(points)

    def fitting(sets: Reals) -> Flags:
        null = np.linalg.svd(camera_equations(image[sets], even[sets]))[2][:, -1]
        off = distances(image[None], null.reshape(-1, 3, 4), even)
        median = np.median(np.nan_to_num(off, nan=np.inf), axis=1)
        best = int(np.argmin(median))
        noise = (1 + 5 / max(n - 6, 1)) * median[best] / _MEDIAN
        return np.asarray(off[best] <= np.maximum(_SURE * noise, NEGLIGIBLE))

    return _by_samples(n, 6, fitting)


def distances(image: Reals, cameras: Reals, points: Reals) -> Reals:
    """Return distances (v, n) of pixels (v, n, 2) from the images of points (n, 4) in cameras (v, 3, 4)."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        there = np.einsum("vij,nj->vni", cameras, points)
        return np.asarray(np.linalg.norm(there[..., :2] / there[..., 2:] - image, axis=-1))


def noise_of(off: Reals, used: Flags) -> float:
    """Return the noise of pixels from the median of used distances (v, n); infinite if it is too large for noise."""
    if not used.any():
        return np.inf
    # A point uses three of the numbers of its images, two for each image, a camera eleven of those of its points.
    of_points, of_views = 1 - 1.5 / np.maximum(used.sum(0), 2), 1 - 5.5 / np.maximum(used.sum(1), 8)
    left = np.nan_to_num(off, nan=np.inf) / np.sqrt(of_points * of_views[:, None])
    noise = float(np.median(left[used])) / _MEDIAN
    return noise if noise <= _SPREAD else np.inf


def agreeing(off: Reals, seen: Flags, noise: float) -> Flags:
    """Return which observations (v, n) are consistent with the noise."""
    return np.asarray(seen & (off <= max(_SURE * noise, NEGLIGIBLE)))


def points_of_most(image: Reals, seen: Flags, cameras: Reals) -> Reals:
    """Return points (n, 4) from the two of their views with the least median distance in all views that see them."""
    n_views, n_points = seen.shape
    best, least = np.full((n_points, 4), np.nan), np.full(n_points, np.inf)
    pairs = list(combinations(range(n_views), 2))
    for i, j in [pairs[k] for k in np.linspace(0, len(pairs) - 1, min(len(pairs), _PAIRS)).astype(int)]:
        both = seen[i] & seen[j]
        if not both.any():
            continue
        pair = cameras[[i, j]]
        rows = [
            homogeneous(image[v, both])[:, k, None] * camera[2] - camera[k]
            for v, camera in zip((i, j), pair, strict=True)
            for k in (0, 1)
        ]
        found = np.linalg.svd(np.stack(rows, 1))[2][:, -1]
        off = np.where(seen[:, both], distances(image[:, both], cameras, found), np.nan)
        middle = np.nanmedian(np.nan_to_num(off, nan=np.nan, posinf=1e300), axis=0)
        better = middle < least[both]
        place = np.flatnonzero(both)[better]
        best[place], least[place] = found[better], middle[better]
    return best


def _by_samples(n: int, size: int, fitting: Callable[[Reals], Flags]) -> Flags:
    """Return which of n points fit the best of some samples; more samples are drawn if these are not nearly all."""
    sets = random_sets(n, size, _SAMPLES)
    found = fitting(sets[:_FIRST])
    return found if found.mean() >= _MOST else fitting(sets)
