"""Similarity of the quaternionic bands of two images under a shift, and disparities of stereo pairs from it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from generated import quaternion

from ..arguments import Reals, real_array
from ..evidence import explains
from .checks import in_range, single_image
from .discrete import check_finite
from .phase import gabor_bank
from .sharing import Progress, in_threads, steps

_FREQUENCIES = ((0.0, 0.16), (0.0, 0.25), (0.16, 0.16), (0.25, 0.25), (0.16, 0.0), (0.25, 0.0))
"""Frequencies in cycles per pixel along rows and columns."""
_SIGMA = 1.2
_WINDOW = 2.5
"""Standard deviation of the neighbourhood over which bands are compared, in pixels."""
_MEDIAN = 5


class Disparity(NamedTuple):
    """Result of `disparity`; arrays (M, N).

    Attributes
    ----------
    disparity : array
        In pixels: the point at column x of the left image is at ``x - disparity`` in the right image.
    confidence : array
        Between 0 and 1. It is 0 where the disparity of the right image differs by more than a pixel, for example where
        a point is visible in one image only. It is 0 everywhere if the images are constant or unrelated: if the right
        image, moved by the disparities, explains less than half of the variance of the left one.
    """

    disparity: Reals
    confidence: Reals


def similarity_distance(
    first: ArrayLike,
    second: ArrayLike,
    shifts: ArrayLike,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Reals:
    """Compute the similarity distance between the quaternionic bands of two images for the given shifts.

    Parameters
    ----------
    first, second : array_like, (M, N)
        Real images of the same size. float32 is kept; integers are converted to float64.
    shifts : array_like, (S, 2)
        (u, v) in pixels, not larger than the images: row y and column x of the first image are compared with
        ``(y + v, x + u)`` in the second image. Beyond the edges, the bands of the last pixels are repeated.
    workers : int, optional
        Number of threads that share the shifts, as in `scipy.fft`; the result does not depend on it.
    progress : function of (done, total), optional
        Called after each shift.

    Returns
    -------
    array, (S, M, N)
        From 0 for equal images to 2 for opposite images; about 1 for unrelated images.

    Raises
    ------
    TypeError, ValueError
        If arguments are not finite real numbers of these shapes, or if a shift is too large.

    Notes
    -----
    The distance is ``sum |q1 - q2|**2 / sum (|q1|**2 + |q2|**2)`` over bands and a Gaussian neighbourhood
    (Bayro-Corrochano, *J. Math. Imaging and Vision* 24:79, 2006). Between pixels, the second image is interpolated by
    cosines before it is filtered, so that bands keep their energy and distances are not least at whole pixels. The
    distance is least at the true shift to 0.03 pixels for textures whose amplitudes decrease as 1/f, and to 0.07 for
    rougher ones, which are aliased.
    """
    images, dtype = _pair(first, second, ("first", "second"))
    moves = real_array(shifts, "shifts", (2,), "shifts u v").astype(float).reshape(-1, 2)
    check_finite(moves, "shifts")
    rows, columns = images[0].shape
    if np.abs(moves[:, 0]).max() >= columns or np.abs(moves[:, 1]).max() >= rows:
        raise ValueError(
            f"shifts: up to {np.abs(moves).max()}; expected less than the size of {rows} x {columns} pixels"
        )
    return _distances(images, moves, dtype, workers, progress)


def disparity(
    left: ArrayLike,
    right: ArrayLike,
    largest: int,
    smallest: int = 0,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Disparity:
    """Compute the disparities of a rectified stereo pair: the shifts along rows of least similarity distance.

    Parameters
    ----------
    left, right : array_like, (M, N)
        Real images of the same size. float32 is kept; integers are converted to float64.
    largest, smallest : int
        Range of the disparities, both included; at least three disparities, of less than N.
    workers, progress
        As in `similarity_distance`; each disparity is a shift.

    Returns
    -------
    Disparity

    Raises
    ------
    TypeError, ValueError
        If arguments are not finite real images of the same size, or if the range is invalid.

    Notes
    -----
    Disparities are refined to fractions of pixels by a parabola through three distances and filtered by a median over
    5 x 5 pixels. The parabola shifts disparities of rough textures towards whole pixels by up to 0.07 pixels.
    `optical_flow` needs no range, but its motion is smooth except at few places. On the Motorcycle pair,
    the median error is 0.18 pixels, and 80 % of the disparities are correct to one pixel.
    """
    images, dtype = _pair(left, right, ("left", "right"))
    for name, value in (("largest", largest), ("smallest", smallest)):
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
            raise ValueError(f"{name}: {value!r}; expected a whole number of pixels")
    columns = images[0].shape[1]
    if largest - smallest < 2 or max(abs(largest), abs(smallest)) >= columns:
        raise ValueError(
            f"smallest, largest: {smallest}, {largest}; expected at least three disparities, of less than {columns}"
        )
    tried = np.arange(smallest, largest + 1)
    moves = np.stack([-tried, 0 * tried], 1).astype(float)
    distances = _distances(images, moves, np.dtype(np.float32), workers, progress)
    best = distances.argmin(0)
    inner = np.clip(best, 1, len(tried) - 2)
    before, here, after = (np.take_along_axis(distances, inner[None] + k, 0)[0] for k in (-1, 0, 1))
    bend = before - 2 * here + after
    offset = np.where(bend > 0, (before - after) / (2 * np.where(bend > 0, bend, 1)), best - inner)
    result = tried[inner] + np.clip(offset, -1, 1)
    result = scipy.ndimage.median_filter(result, _MEDIAN, mode="nearest")
    # Disparities of the right image: its point at x is at x + d in the left image.
    opposite = np.full((len(tried), *best.shape), 2, np.float32)
    for k, shift in enumerate(tried):
        there = slice(max(shift, 0), columns + min(shift, 0))
        opposite[k, :, slice(max(-shift, 0), columns - max(shift, 0))] = distances[k, :, there]
    own = tried[opposite.argmin(0)]
    places = np.clip(np.arange(columns) - np.rint(result).astype(int), 0, columns - 1)
    agrees = np.abs(np.take_along_axis(own, places, 1) - result) <= 1
    # A pair of which neither image explains the other is not of one scene, whatever fits best.
    agrees &= explains(np.take_along_axis(images[1], places, 1), images[0])
    confidence = np.where(agrees, np.clip(1 - distances.min(0), 0, 1), 0)
    return Disparity(result.astype(dtype), confidence.astype(dtype))


def _distances(
    images: list[Reals],
    moves: NDArray[np.float64],
    dtype: np.dtype[np.floating],
    workers: int | None,
    progress: Progress | None,
) -> Reals:
    images = [image.astype(dtype, copy=False) for image in images]
    planes, energy = _planes(images[0], workers)
    whole = np.rint(moves).astype(int)
    fractions, group = np.unique(moves - whole, axis=0, return_inverse=True)
    across, down = (int(np.abs(whole[:, k]).max()) for k in range(2))
    rows, columns = images[0].shape
    result = np.empty((len(moves), rows, columns), dtype)
    step_done = steps(progress, len(moves))
    for number, fraction in enumerate(fractions):
        # Filters and shifts commute, so the image is interpolated once instead of all of its bands.
        seconds, size = _planes(_between(_between(images[1], fraction[0], 1), fraction[1], 0), workers)
        other = np.pad(seconds, [(0, 0), (0, 0), (down, down), (across, across)], "edge")
        sizes = np.pad(size, [(down, down), (across, across)], "edge")
        floor = np.finfo(dtype).eps * (energy.max() + size.max()) + np.finfo(dtype).tiny

        def compare(k: int, other: Reals = other, sizes: Reals = sizes, floor: float = floor) -> None:
            u, v = whole[k]
            there = (slice(down + v, down + v + rows), slice(across + u, across + u + columns))
            common = np.einsum("bcmn,bcmn->mn", planes, other[(slice(None), slice(None), *there)])
            common = scipy.ndimage.gaussian_filter(common, _WINDOW, mode="nearest")
            both = energy + sizes[there]
            # Empty bands are equal.
            result[k] = np.where(both > floor, 1 - 2 * common / np.maximum(both, floor), 0)
            step_done()

        in_threads(compare, np.flatnonzero(group.ravel() == number).tolist(), workers)
    return np.asarray(np.clip(result, 0, 2))


def _between(image: Reals, shift: float, axis: int) -> Reals:
    """Return a mirrored image at places moved along an axis, by trigonometric interpolation.

    Each band keeps its energy at all shifts. With a kernel that attenuates high frequencies between pixels, distances
    would be least at whole pixels.
    """
    if shift == 0:
        return image
    size = image.shape[axis]
    spectrum = np.moveaxis(scipy.fft.rfft(np.concatenate([image, np.flip(image, axis)], axis), axis=axis), axis, -1)
    turned = spectrum * np.exp(1j * np.pi / size * shift * np.arange(size + 1)).astype(spectrum.dtype)
    there = np.moveaxis(scipy.fft.irfft(turned, 2 * size), -1, axis)
    return np.ascontiguousarray(there.take(np.arange(size), axis))


def _planes(image: Reals, workers: int | None) -> tuple[Reals, Reals]:
    """Return the real and imaginary parts of the two planes of all bands, (2 K, 2, M, N), and their local energy."""
    q = gabor_bank(image, _FREQUENCIES, _SIGMA, True, workers)
    planes = np.ascontiguousarray(np.moveaxis(np.concatenate(quaternion.pack_two_sided(q)), -1, 1))
    return planes, scipy.ndimage.gaussian_filter((planes**2).sum((0, 1)), _WINDOW, mode="nearest")


def _pair(
    first: ArrayLike, second: ArrayLike, names: tuple[str, str]
) -> tuple[list[Reals], np.dtype[np.floating[Any]]]:
    """Return both images, scaled to the range of float32, and the type of the results."""
    images = [single_image(image, name) for image, name in zip((first, second), names, strict=True)]
    if images[0].shape != images[1].shape:
        raise ValueError(f"{names[1]}: shape {images[1].shape}; expected that of the other image, {images[0].shape}")
    # Distances depend on relative size, so both images are divided by the same number.
    return list(in_range(np.stack(images), (0, 1, 2), np.float32)[0]), np.result_type(*images)
