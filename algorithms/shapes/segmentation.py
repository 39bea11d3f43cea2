"""Segmentation of slices and volumes by growing a region from a seed (section 22.2)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arguments import Reals
from .images import Mask, checked_image, checked_seeds, checked_spacing

_STEPS = 10
"""Steps of edge-preserving smoothing."""
_EDGE = 3.0
"""Differences of neighbours that count as an edge, in standard deviations of the noise."""
_CLIP = 40.0
_WIDTH = 3.0
"""Half the width of the interval of accepted densities, in standard deviations of the smoothed region."""
_GROWTH, _SETTLED = 1.25, 0.02
"""Factor for the standard deviation of the region, which its interval truncates, and change below which it is final."""
_LEAK = 1.2
"""Ratio of volumes from which on a region has leaked through necks."""
_NECK = 0.3
"""Radius of the necks that are cut, as a fraction of the depth of the region around the seed."""
_ROUNDS = 6
_MOST_GROWN = 3.0
"""Ratio of volumes up to which a region is extended towards its surroundings."""
_SIDES, _FEW, _TAIL = 3, 0.02, 4.0
"""Rounds of the levels between a region and its surroundings, the least part of these on a side, and the difference, in
standard deviations of the region, from which on they are not a tail of the region."""
_MANY = 2_000_000
"""Voxels from which on the interval is adapted in three rounds."""
Report = Callable[[str], None]


def segment(
    volume: ArrayLike,
    seed: ArrayLike | None = None,
    spacing: ArrayLike = (1, 1, 1),
    *,
    neck: float | None = None,
    progress: Report | None = None,
) -> Mask:
    """Segment the region of a slice or a volume that contains a seed.

    The texture at the seed, the robust standard deviation of its neighbourhood, is the scale of an edge-preserving
    diffusion. Voxels are accepted whose density is then in an interval around that of the region, which is adapted to
    the region. Narrow connections to other regions are cut by distances in units of the spacing if much more is
    connected by them, and holes are filled.

    Parameters
    ----------
    volume : array_like, (rows, columns) or (slices, rows, columns)
        Real numbers of any type.
    seed : array_like of int, (axes,) or (k, axes), optional
        Indices of voxels of the region. By default the voxel at the greatest distance from edges is chosen.
    spacing : array_like, (axes,), optional
        Distances of voxels along the axes.
    neck : float, optional
        Radius, in units of the spacing, of the widest connection that is cut. By default 0.3 times the depth of the
        region around the seed.
    progress : callable, optional
        Is called with the name of each stage.

    Returns
    -------
    array of bool
        The region, with the shape of the volume; it contains voxels near the seed.

    Raises
    ------
    ValueError
        If the volume is constant, not finite or too large, a seed is outside, the spacing is not positive, or no
        region remains.
    """
    image = checked_image(volume, "volume", (2, 3)).astype(np.float32)
    step = checked_spacing(spacing, image.ndim)
    if neck is not None and not neck >= 0:
        raise ValueError(f"neck: {neck}; expected a radius of at least 0")
    if image.min() == image.max():
        raise ValueError(f"volume: all voxels are {image.flat[0]}; expected different values")
    report = progress if progress is not None else _silent
    report("smoothing")
    seeds = checked_seeds(seed, image.shape) if seed is not None else automatic_seed(image)[None]
    middle, noise = _statistics(image, seeds, 3)
    noise = max(noise, 1e-6 * float(np.ptp(image)))
    smooth = smoothed(np.clip(image, middle - _CLIP * noise, middle + _CLIP * noise), _EDGE * noise, _STEPS)
    report("growing")
    core, accepted, radius = _grown(smooth, seeds, noise, step, neck)
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
    return filled(core)


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


def _grown(smooth: Reals, seeds: Reals, noise: float, step: Reals, neck: float | None) -> tuple[Mask, Mask, float]:
    """Return the region without narrow connections, the accepted voxels, and the radius of the connections cut."""
    middle, spread = _statistics(smooth, seeds, 2)
    spread = max(spread, noise / 4)
    core = accepted = np.zeros(smooth.shape, bool)
    radius = 0.0
    for _ in range(_ROUNDS if smooth.size < _MANY else 3):
        accepted = np.abs(smooth - middle) < _WIDTH * spread
        accepted[tuple(seeds.T)] = True
        depth = _depth(accepted, step)
        radius = neck if neck is not None else _NECK * _climbed(depth, seeds)
        core = _components(depth > radius, seeds, step)
        if not core.any():
            break
        before = spread
        middle, spread = float(smooth[core].mean()), max(_GROWTH * float(smooth[core].std()), noise / 4)
        if abs(spread - before) < _SETTLED * before:
            break
    if not core.any():
        raise ValueError(f"seed: {seeds[0].tolist()}: no region grows from it; move the seed, or pass a smaller neck")
    return core, accepted, radius


def _between_neighbours(smooth: Reals, region: Mask, seeds: Reals, step: Reals) -> Mask:
    """Return the region up to halfway between its density and those of its surroundings, on both sides.

    The levels are adapted to the region in rounds. A side on which the surroundings are hardly different is the tail of
    the distribution of the region, and is not limited. A result of a very different size is not used.
    """
    found = region
    for _ in range(_SIDES):
        inner = scipy.ndimage.binary_erosion(found)
        values = smooth[inner if inner.any() else found]
        middle = float(np.median(values))
        spread = 1.4826 * float(np.median(np.abs(values - middle)))
        around = smooth[scipy.ndimage.binary_dilation(found, iterations=3) & ~found]
        accepted = np.ones(smooth.shape, bool)
        for side in (-1, 1):
            beside = side * (around - middle)
            beside = beside[beside > 2 * spread]
            away = float(np.median(beside)) if len(beside) > _FEW * len(around) else 0.0
            if away > _TAIL * spread:
                accepted &= side * (smooth - middle) < away / 2
        accepted[tuple(seeds.T)] = True
        found = _components(accepted, seeds, step)
    grown = found.sum() / region.sum()
    return found if 0.5 < grown < _MOST_GROWN else region


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
    parts = [image[tuple(slice(max(0, i - reach), i + reach + 1) for i in seed)].ravel() for seed in seeds]
    near = np.concatenate(parts)
    middle = float(np.median(near))
    return middle, 1.4826 * float(np.median(np.abs(near - middle)))


def _part(axis: int, part: slice, axes: int) -> tuple[slice, ...]:
    return tuple(part if a == axis else slice(None) for a in range(axes))


def _silent(stage: str) -> None:
    """Ignore the name of a stage."""
