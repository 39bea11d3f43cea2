"""Regions that grow from seeds: smoothing, intervals of densities, necks, and the levels at their edges."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy

from ..arguments import Reals
from ..evidence import deviation_of_most
from .images import Mask

_STEPS = 10
"""Steps of edge-preserving smoothing."""
_EDGE = 3.0
"""Differences of neighbours that count as an edge, in standard deviations of the noise."""
_CLIP = 40.0
"""Densities are clipped at this distance from that of the seeds, in standard deviations of the noise."""
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
"""A limit on work: how often the interval and the region are computed in turn."""
_MOST_GROWN = 3.0
"""Ratio of volumes up to which a region is extended towards its surroundings."""
_SIDES, _EDGE_WIDTH, _TAIL = 5, 3, 4.0
"""Most rounds of the levels between a region and its surroundings, the width of an edge in voxels, and the difference,
in standard deviations of the region, up to which surroundings are a tail of its distribution."""
_MANY = 2_000_000
"""Voxels from which on the interval is adapted in three rounds."""
Report = Callable[[str], None]


class Region(NamedTuple):
    """A region, the smoothed densities, the interval of those in it, and the radius of the necks that were cut."""

    mask: Mask
    smooth: Reals
    interval: tuple[float, float]
    neck: float


def grown_region(
    image: Reals, seeds: Reals, step: Reals, neck: float | None, factors: tuple[float, float], report: Report
) -> Region | None:
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
    return Region(filled(core), smooth, (float(inside.min()), float(inside.max())), radius)


def window_of(mask: Mask, margin: Callable[[int], float]) -> tuple[slice, ...]:
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
        depth = depth_of(accepted, step)
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
    window = window_of(region, lambda extent: 4 * _EDGE_WIDTH)
    result = region.copy()
    smooth, region, seeds = smooth[window], region[window], seeds - np.array([w.start for w in window])
    found = region
    for _ in range(_SIDES):
        inner = scipy.ndimage.binary_erosion(found)
        values = smooth[inner if inner.any() else found]
        middle = float(np.median(values))
        spread = deviation_of_most(values - middle)
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


def depth_of(mask: Mask, step: Reals) -> Reals:
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
    parts = [image[neighbourhood(seed, reach)].ravel() for seed in seeds]
    near = np.concatenate(parts)
    middle = float(np.median(near))
    return middle, deviation_of_most(near - middle)


def neighbourhood(seed: Reals, reach: int) -> tuple[slice, ...]:
    """Return the box around a seed."""
    return tuple(slice(max(0, int(i) - reach), int(i) + reach + 1) for i in seed)


def _part(axis: int, part: slice, axes: int) -> tuple[slice, ...]:
    return tuple(part if a == axis else slice(None) for a in range(axes))


def silent(stage: str) -> None:
    """Ignore the name of a stage."""
