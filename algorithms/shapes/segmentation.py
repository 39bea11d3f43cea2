"""Segmentation of slices and volumes by growing a region from a seed (section 22.2)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals
from .images import Mask, checked_image, checked_seeds, checked_spacing
from .segment_status import SegmentStatus

_STEPS = 10
"""Steps of edge-preserving smoothing."""
_EDGE = 3.0
"""Differences of neighbours that count as an edge, in standard deviations of the noise."""
_CLIP = 40.0
_WIDTH = 3.0
"""Half the width of the interval of accepted densities, in standard deviations of the smoothed region."""
_GROWTH, _SETTLED = 1.25, 0.02
"""Factor for the standard deviation of the region, which its interval truncates, and relative change below which it or
the volume of the region is final."""
_LEAK = 1.2
"""Ratio of volumes from which on a region has leaked through necks."""
_NECK = 0.3
"""Radius of the necks that are cut, as a fraction of the depth of the region around the seed."""
_ROUNDS = 6
_MOST_GROWN = 3.0
"""Ratio of volumes up to which a region is extended towards its surroundings."""
_SIDES, _EDGE_WIDTH, _TAIL = 5, 3, 4.0
"""Most rounds of the levels between a region and its surroundings, the width of an edge in voxels, and the difference,
in standard deviations of the region, up to which surroundings are a tail of its distribution."""
_MANY = 2_000_000
"""Voxels from which on the interval is adapted in three rounds."""
_AGREEMENT = 0.85
"""The Dice coefficient that the status OK promises."""
_SEEDS = 4
"""A limit on work: other seeds from which the region is grown again."""
_OTHERS = ((1.0, 1.5), (1.5, 1.0), (2 / 3, 1.0))
"""A limit on work: other radii of necks and widths of the interval, in units of the first. A narrower interval cuts the
distribution of a region, and so contradicts no region."""
_MARGIN = 0.5
"""A limit on work: the part of the volume in which regions are grown again has this margin, in extents of the region.
One that fills it has eight times the volume, and so does not agree."""
Report = Callable[[str], None]


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
        The least Dice coefficient of the region and those from other seeds and radii, from 0 to 1. They are grown
        until one of them is below 0.85.
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


class _Region(NamedTuple):
    mask: Mask
    smooth: Reals
    interval: tuple[float, float]
    neck: float


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
    connected by them, and holes are filled. The region is then grown again from other seeds in it, and with other radii
    of connections: if one of these regions differs, the status is not OK.

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
    image, present = _completed(volume, valid)
    step = checked_spacing(spacing, image.ndim)
    if neck is not None and not neck >= 0:
        raise ValueError(f"neck: {neck}; expected a radius of at least 0")
    if image.min() == image.max():
        raise ValueError(f"volume: all voxels are {image.flat[0]}; expected different values")
    report = progress if progress is not None else _silent
    seeds = checked_seeds(seed, image.shape) if seed is not None else automatic_seed(image)[None]
    if present is not None and seed is not None and not present[tuple(seeds.T)].all():
        raise ValueError(
            f"seed: {seeds[~present[tuple(seeds.T)]][0].tolist()} is a missing voxel; expected a valid one"
        )
    found = _region(image, seeds, step, neck, (1, 1), report)
    if found is None:
        return Segment(np.zeros(image.shape, bool), SegmentStatus.NOTHING, 0.0, (np.nan, np.nan), 0.0, seeds)
    report("comparing")
    mask = found.mask if present is None else found.mask & present
    if _border_share(mask) > 0.5:
        return Segment(mask, SegmentStatus.UNBOUNDED, 0.0, found.interval, found.neck, seeds)
    if _share(mask, seeds) < 0.5:  # The breakdown point of the median that gave the density.
        return Segment(mask, SegmentStatus.TOO_SMALL, 0.0, found.interval, found.neck, seeds)
    confidence = _confidence(image, found, seeds, step, neck)
    status = SegmentStatus.OK if confidence >= _AGREEMENT else SegmentStatus.AMBIGUOUS
    return Segment(mask, status, confidence, found.interval, found.neck, seeds)


def _completed(volume: ArrayLike, valid: ArrayLike | None) -> tuple[Reals, Mask | None]:
    """Return the volume with missing voxels replaced by the nearest ones, and which are present."""
    if valid is None:
        return np.ascontiguousarray(checked_image(volume, "volume", (2, 3)), np.float32), None
    present = np.asarray(valid)
    array = np.asarray(volume)
    if present.dtype != np.bool_ or present.shape != array.shape or not present.any():
        raise ValueError(
            f"valid: {present.dtype}, shape {present.shape}, {np.count_nonzero(present)} true; expected bool, "
            f"{array.shape}, at least one"
        )
    image = checked_image(np.where(present, array, array[present].flat[0]), "volume", (2, 3))
    at = scipy.ndimage.distance_transform_edt(~present, return_distances=False, return_indices=True)
    return np.ascontiguousarray(image[tuple(at)], np.float32), present


def _region(
    image: Reals, seeds: Reals, step: Reals, neck: float | None, factors: tuple[float, float], report: Report
) -> _Region | None:
    """Return the region of seeds, with multiples of the radius of necks and the interval; None if nothing grows."""
    report("smoothing")
    middle, noise = _statistics(image, seeds, 3)
    noise = max(noise, 1e-6 * float(np.ptp(image)))
    smooth = smoothed(np.clip(image, middle - _CLIP * noise, middle + _CLIP * noise), _EDGE * noise, _STEPS)
    report("growing")
    core, accepted, radius = _grown(smooth, seeds, noise, step, neck, factors)
    if not core.any():
        return None
    report("filling")
    if radius > 0:
        opened = (scipy.ndimage.distance_transform_edt(~core, sampling=step) <= radius + 0.5 * step.min()) & accepted
        whole = _components(accepted, seeds, step)
        # If little is connected by necks, nothing has leaked through them, and they belong to the region.
        core = opened
        if neck is None and whole.sum() < _LEAK * opened.sum():
            core = _between_neighbours(smooth, whole, seeds, step)
    elif neck == 0:
        core = _between_neighbours(smooth, core, seeds, step)
    inside = smooth[core]
    return _Region(filled(core), smooth, (float(inside.min()), float(inside.max())), radius)


def _share(mask: Mask, seeds: Reals) -> float:
    """Return the part of the neighbourhoods of the seeds that is in the region."""
    return float(np.median([mask[_around(seed, 2)].mean() for seed in seeds]))


def _border_share(mask: Mask) -> float:
    """Return the part of the surface of the region that is the border of the volume."""
    border = sum(int(np.count_nonzero(mask.take([0, -1], axis))) for axis in range(mask.ndim))
    inner = sum(int(np.count_nonzero(np.diff(mask, axis=axis))) for axis in range(mask.ndim))
    return border / max(border + inner, 1)


def _confidence(image: Reals, found: _Region, seeds: Reals, step: Reals, neck: float | None) -> float:
    """Return the least Dice coefficient of the region and others, which are grown until one is below the limit."""
    window = _window(found.mask, lambda extent: _MARGIN * extent)
    part, mask = image[window], found.mask[window]
    low = np.array([w.start for w in window])
    confidence = 1.0
    for others, factors in _alternatives(mask, found.smooth[window], seeds - low, step, neck):
        other = _region(part, others, step, neck, factors, _silent)
        grown = np.zeros(part.shape, bool) if other is None else other.mask
        confidence = min(confidence, 2 * float((grown & mask).sum()) / float(grown.sum() + mask.sum()))
        if confidence < _AGREEMENT:
            break
    return confidence


def _alternatives(
    mask: Mask, smooth: Reals, seeds: Reals, step: Reals, neck: float | None
) -> Iterator[tuple[Reals, tuple[float, float]]]:
    """Yield other seeds, and multiples of the radius of necks and of the interval of densities."""
    labels, count = scipy.ndimage.label(mask)
    depth = _depth(mask, step)
    places = []
    for label in range(1, count + 1):
        own = labels == label
        values = smooth[own]
        middle = np.median(values)
        usual = own & (np.abs(smooth - middle) <= 1.4826 * np.median(np.abs(values - middle)) + 1e-12)
        places.append(np.argwhere(usual & (depth >= 0.5 * depth[own].max())))
    rng = np.random.default_rng(0)
    usable = [rows for rows in places if len(rows)]
    for _ in range(_SEEDS if usable else 0):
        yield np.array([rows[rng.integers(len(rows))] for rows in usable]), (1.0, 1.0)
    for factors in _OTHERS:
        if neck is None or factors[0] == 1:
            yield seeds, factors


def _window(mask: Mask, margin: Callable[[int], float]) -> tuple[slice, ...]:
    """Return the box of a region with margins, functions of its extents."""
    box = scipy.ndimage.find_objects(mask.astype(np.uint8))[0]
    margins = [int(np.ceil(margin(w.stop - w.start))) for w in box]
    return tuple(slice(max(w.start - m, 0), w.stop + m) for w, m in zip(box, margins, strict=True))


def smoothed(image: Reals, edge: float, steps: int) -> Reals:
    """Smooth by anisotropic diffusion (Perona and Malik): differences well above `edge` are preserved."""
    found = image.astype(np.float32, copy=True)
    rate = np.float32(1 / (2 * image.ndim + 1))
    for _ in range(steps):
        change = np.zeros_like(found)
        for axis in range(image.ndim):
            flow = np.diff(found, axis=axis)
            flow *= np.exp(-((flow / np.float32(edge)) ** 2))
            change[_part(axis, slice(0, -1), image.ndim)] += flow
            change[_part(axis, slice(1, None), image.ndim)] -= flow
        change *= rate
        found += change
    return found


def automatic_seed(image: Reals) -> Reals:
    """Return the index of the voxel at the greatest distance from strong edges and from the border."""
    size = scipy.ndimage.gaussian_gradient_magnitude(image, 1.0)
    # Of a large background of one value, nothing is wanted: only voxels above the mean of the image are candidates.
    flat = np.pad((size < np.percentile(size, 75)) & (image > image.mean()), 1)
    inside = tuple(slice(1, -1) for _ in image.shape)
    depth = scipy.ndimage.distance_transform_edt(flat)[inside]
    return np.array(np.unravel_index(int(depth.argmax()), image.shape))


def filled(mask: Mask) -> Mask:
    """Fill the holes of a region."""
    box = scipy.ndimage.find_objects(mask.astype(np.uint8))
    result = mask.copy()
    if box and box[0] is not None:
        result[box[0]] = scipy.ndimage.binary_fill_holes(mask[box[0]])
    return result


def _grown(
    smooth: Reals, seeds: Reals, noise: float, step: Reals, neck: float | None, factors: tuple[float, float]
) -> tuple[Mask, Mask, float]:
    """Return the region without narrow connections, the accepted voxels, and the radius of the connections cut."""
    middle, spread = _statistics(smooth, seeds, 2)
    spread = max(spread, noise / 4)
    core = accepted = np.zeros(smooth.shape, bool)
    radius = 0.0
    for _ in range(_ROUNDS if smooth.size < _MANY else 3):
        accepted = np.abs(smooth - middle) < factors[1] * _WIDTH * spread
        accepted[tuple(seeds.T)] = True
        depth = _depth(accepted, step)
        radius = neck if neck is not None else factors[0] * _NECK * _climbed(depth, seeds)
        core = _components(depth > radius, seeds, step)
        if not core.any():
            break
        before = spread
        middle, spread = float(smooth[core].mean()), max(_GROWTH * float(smooth[core].std()), noise / 4)
        if abs(spread - before) < _SETTLED * before:
            break
    return core, accepted, radius


def _between_neighbours(smooth: Reals, region: Mask, seeds: Reals, step: Reals) -> Mask:
    """Return the region up to where densities are nearer to those beyond its edge than to its own.

    What is beyond is the density a few voxels outside of the nearest part of the edge, so that each neighbour has its
    own level. Where it is not different, the edge is a cut, which is kept. A result of a very different size is not
    used.
    """
    window = _window(region, lambda extent: 4 * _EDGE_WIDTH)
    result = region.copy()
    smooth, region, seeds = smooth[window], region[window], seeds - np.array([w.start for w in window])
    found = region
    for _ in range(_SIDES):
        inner = scipy.ndimage.binary_erosion(found)
        values = smooth[inner if inner.any() else found]
        middle = float(np.median(values))
        spread = 1.4826 * float(np.median(np.abs(values - middle)))
        outside = ~scipy.ndimage.binary_dilation(found, iterations=_EDGE_WIDTH)
        if not outside.any():
            break
        at = scipy.ndimage.distance_transform_edt(~outside, return_distances=False, return_indices=True)
        beyond = smooth[tuple(at)]
        nearer = np.abs(smooth - middle) < np.abs(smooth - beyond)
        accepted = np.where(np.abs(beyond - middle) > _TAIL * spread, nearer, found)
        accepted[tuple(seeds.T)] = True
        before, found = found, _components(accepted, seeds, step)
        if abs(found.sum() - before.sum()) < _SETTLED * before.sum():
            break
    if 0.5 < found.sum() / region.sum() < _MOST_GROWN:
        result[window] = found
    return result


def _depth(mask: Mask, step: Reals) -> Reals:
    """Return the distances from the outside. The border of the volume does not limit regions."""
    return np.asarray(scipy.ndimage.distance_transform_edt(mask, sampling=step), np.float32)


def _climbed(depth: Reals, seeds: Reals) -> float:
    """Return the largest depth that is reached from the seeds by steps to larger depths."""
    best = 0.0
    for seed in seeds:
        at = tuple(int(i) for i in seed)
        while True:
            window = tuple(slice(max(0, i - 2), i + 3) for i in at)
            around = depth[window]
            top = np.unravel_index(int(around.argmax()), around.shape)
            if around[top] <= depth[at]:
                break
            at = tuple(int(w.start + t) for w, t in zip(window, top, strict=True))
        best = max(best, float(depth[at]))
    return best


def _components(mask: Mask, seeds: Reals, step: Reals) -> Mask:
    """Return the components of a mask that contain the seeds or are nearest to them."""
    labels, count = scipy.ndimage.label(mask)
    if not count:
        return np.zeros(mask.shape, bool)
    chosen = set()
    nearest = None
    for seed in seeds:
        at = tuple(int(i) for i in seed)
        if not labels[at] and nearest is None:
            nearest = scipy.ndimage.distance_transform_edt(
                ~mask, sampling=step, return_distances=False, return_indices=True
            )
        label = labels[at] if labels[at] or nearest is None else labels[tuple(int(a[at]) for a in nearest)]
        chosen.add(int(label))
    return np.asarray(np.isin(labels, list(chosen)))


def _statistics(image: Reals, seeds: Reals, reach: int) -> tuple[float, float]:
    """Return the median of the voxels around the seeds, and their robust standard deviation."""
    parts = [image[_around(seed, reach)].ravel() for seed in seeds]
    near = np.concatenate(parts)
    middle = float(np.median(near))
    return middle, 1.4826 * float(np.median(np.abs(near - middle)))


def _around(seed: Reals, reach: int) -> tuple[slice, ...]:
    return tuple(slice(max(0, int(i) - reach), int(i) + reach + 1) for i in seed)


def _part(axis: int, part: slice, axes: int) -> tuple[slice, ...]:
    return tuple(part if a == axis else slice(None) for a in range(axes))


def _silent(stage: str) -> None:
    """Ignore the name of a stage."""
