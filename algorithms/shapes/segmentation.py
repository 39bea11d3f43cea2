"""Segmentation of slices and volumes by growing a region from a seed (section 22.2)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, as_given, finite_number
from ..evidence import deviation_of_most
from .images import Mask, checked_seeds, checked_spacing, image_in_range
from .region_growing import Region, Report, automatic_seed, depth_of, grown_region, neighbourhood, silent, window_of
from .segment_status import SegmentStatus

_AGREEMENT = 0.85
"""The Dice coefficient that the status OK promises."""
_SEEDS = 4
"""A limit on work: other seeds from which the region is computed again."""
_OTHERS = ((1.0, 1.5), (1.5, 1.0), (2 / 3, 1.0))
"""A limit on work: other radii of necks and widths of the interval, in units of the first. A narrower interval cuts the
distribution of a region, and so contradicts no region."""
_MARGIN = 0.5
"""A limit on work: the part of the volume in which regions are computed again has this margin, in extents of the
region. One that fills it has eight times the volume, and so does not agree."""


@dataclass(frozen=True, eq=False)
class Segment:
    """A region of a slice or a volume. ``numpy.asarray(segment)`` is its mask.

    Attributes
    ----------
    mask : array of bool
        The region, with the shape of the volume; it contains voxels near the seeds.
    status : SegmentStatus
        OK means that the data determine the region: it does not depend on which of its voxels is the seed, nor on the
        radius of necks unless that is given.
    confidence : float
        The least Dice coefficient of the region and those from other seeds and radii, from 0 to 1. They are
        computed until one of them is below 0.85.
    interval : (float, float)
        The least and the largest smoothed density that was accepted.
    neck : float
        The radius of the widest connections that were cut, in units of the spacing.
    seeds : int array, (k, axes)
        Indices of the seeds: those passed, or the chosen one.
    """

    mask: Mask
    status: SegmentStatus
    confidence: float
    interval: tuple[float, float]
    neck: float
    seeds: NDArray[np.intp]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """Return the mask."""
        return np.array(self.mask, dtype) if copy else np.asarray(self.mask, dtype)


def segment(
    volume: ArrayLike,
    seed: ArrayLike | None = None,
    spacing: ArrayLike = (1, 1, 1),
    *,
    neck: float | None = None,
    valid: ArrayLike | None = None,
    progress: Report | None = None,
) -> Segment:
    """Segment the region of a slice or a volume that contains a seed.

    The texture at the seed, the robust standard deviation of its neighbourhood, is the scale of an edge-preserving
    diffusion. Voxels are accepted whose density is then in an interval around that of the region, which is adapted to
    the region. Narrow connections to other regions are cut by distances in units of the spacing if much more is
    connected by them, and holes are filled. The region is then computed again from other seeds in it, and with other
    radii of connections: if one of these regions differs, the status is not OK.

    Parameters
    ----------
    volume : array_like, (rows, columns) or (slices, rows, columns)
        Real numbers of any type, in any order in memory.
    seed : array_like of int, (axes,) or (k, axes), optional
        Indices of voxels of the region. By default the voxel at the greatest distance from edges is chosen.
    spacing : array_like, (axes,), optional
        Distances of voxels along the axes.
    neck : float, optional
        Radius, in units of the spacing, of the widest connection that is cut. By default 0.3 times the depth of the
        region around the seed.
    valid : array_like of bool, optional
        Where data exist, with the shape of the volume. Missing voxels may have any value, such as NaN. They are taken
        like the nearest voxel while the region grows, and are not in the result.
    progress : callable, optional
        Is called with the name of each stage.

    Returns
    -------
    Segment

    Raises
    ------
    ValueError
        If the volume is constant, not finite or too large, a seed is outside or missing, the spacing is not positive,
        or `valid` has another shape or no true element.
    """
    image, present, exponent = _completed(volume, valid)
    step = checked_spacing(spacing, image.ndim)
    if neck is not None and not finite_number(neck, "neck") >= 0:
        raise ValueError(f"neck: {neck}; expected a radius of at least 0")
    if image.min() == image.max():
        raise ValueError("volume: all voxels are equal; expected different values")
    report = progress if progress is not None else silent
    seeds = checked_seeds(seed, image.shape) if seed is not None else automatic_seed(image)[None]
    if present is not None and seed is not None and not present[tuple(seeds.T)].all():
        raise ValueError(
            f"seed: {seeds[~present[tuple(seeds.T)]][0].tolist()} is a missing voxel; expected a valid one"
        )
    found = grown_region(image, seeds, step, neck, (1, 1), report)
    if found is None:
        return Segment(np.zeros(image.shape, bool), SegmentStatus.NOTHING, 0.0, (np.nan, np.nan), 0.0, seeds)
    report("comparing")
    interval = (math.ldexp(found.interval[0], exponent), math.ldexp(found.interval[1], exponent))
    mask = found.mask if present is None else found.mask & present
    if _border_share(mask) > 0.5:
        return Segment(mask, SegmentStatus.UNBOUNDED, 0.0, interval, found.neck, seeds)
    if _share(mask, seeds) < 0.5:  # The breakdown point of the median that gave the density.
        return Segment(mask, SegmentStatus.TOO_SMALL, 0.0, interval, found.neck, seeds)
    confidence = _confidence(image, found, seeds, step, neck)
    status = SegmentStatus.OK if confidence >= _AGREEMENT else SegmentStatus.AMBIGUOUS
    return Segment(mask, status, confidence, interval, found.neck, seeds)


def _completed(volume: ArrayLike, valid: ArrayLike | None) -> tuple[Reals, Mask | None, int]:
    """Return the volume as `image_in_range`, with missing voxels like the nearest ones, and which are present."""
    if valid is None:
        image, exponent = image_in_range(volume, "volume", (2, 3))
        return np.ascontiguousarray(image, np.float32), None, exponent
    present = as_given(valid, "valid")
    array = as_given(volume, "volume")
    if present.dtype != np.bool_ or present.shape != array.shape or not present.any():
        raise ValueError(
            f"valid: {present.dtype}, shape {present.shape}, {np.count_nonzero(present)} true; expected bool, "
            f"{array.shape}, at least one"
        )
    image, exponent = image_in_range(np.where(present, array, array[present].flat[0]), "volume", (2, 3))
    at = scipy.ndimage.distance_transform_edt(~present, return_distances=False, return_indices=True)
    return np.ascontiguousarray(image[tuple(at)], np.float32), present, exponent


def _share(mask: Mask, seeds: Reals) -> float:
    """Return the part of the neighbourhoods of the seeds that is in the region."""
    return float(np.median([mask[neighbourhood(seed, 2)].mean() for seed in seeds]))


def _border_share(mask: Mask) -> float:
    """Return the part of the surface of the region that is the border of the volume."""
    border = sum(int(np.count_nonzero(mask.take([0, -1], axis))) for axis in range(mask.ndim))
    inner = sum(int(np.count_nonzero(np.diff(mask, axis=axis))) for axis in range(mask.ndim))
    return border / max(border + inner, 1)


def _confidence(image: Reals, found: Region, seeds: Reals, step: Reals, neck: float | None) -> float:
    """Return the least Dice coefficient of the region and others, which are computed until one is below the limit."""
    window = window_of(found.mask, lambda extent: _MARGIN * extent)
    part, mask = image[window], found.mask[window]
    low = np.array([w.start for w in window])
    confidence = 1.0
    for others, factors in _alternatives(mask, found.smooth[window], seeds - low, step, neck):
        other = grown_region(part, others, step, neck, factors, silent)
        again = np.zeros(part.shape, bool) if other is None else other.mask
        confidence = min(confidence, 2 * float((again & mask).sum()) / float(again.sum() + mask.sum()))
        if confidence < _AGREEMENT:
            break
    return confidence


def _alternatives(
    mask: Mask, smooth: Reals, seeds: Reals, step: Reals, neck: float | None
) -> Iterator[tuple[Reals, tuple[float, float]]]:
    """Yield other seeds, and multiples of the radius of necks and of the interval of densities."""
    labels, count = scipy.ndimage.label(mask)
    depth = depth_of(mask, step)
    places = []
    for label in range(1, count + 1):
        own = labels == label
        values = smooth[own]
        middle = np.median(values)
        usual = own & (np.abs(smooth - middle) <= deviation_of_most(values - middle) + 1e-12)
        places.append(np.argwhere(usual & (depth >= 0.5 * depth[own].max())))
    rng = np.random.default_rng(0)
    usable = [rows for rows in places if len(rows)]
    for _ in range(_SEEDS if usable else 0):
        yield np.array([rows[rng.integers(len(rows))] for rows in usable]), (1.0, 1.0)
    for factors in _OTHERS:
        if neck is None or factors[0] == 1:
            yield seeds, factors
