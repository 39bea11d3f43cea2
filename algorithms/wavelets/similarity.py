"""Similarity of the quaternionic bands of two images under a shift."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from generated import quaternion

from ..arguments import Reals, real_array
from .checks import image_pair
from .discrete import check_finite
from .phase import gabor_bank
from .sharing import Progress, in_threads, steps

_FREQUENCIES = ((0.0, 0.16), (0.0, 0.25), (0.16, 0.16), (0.25, 0.25), (0.16, 0.0), (0.25, 0.0))
"""Frequencies in cycles per pixel along rows and columns."""
_SIGMA = 1.2
"""The width of filters, in periods."""
_WINDOW = 2.5
"""Standard deviation of the neighbourhood over which bands are compared, in pixels."""


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
    pair, dtype = image_pair(first, second, ("first", "second"))
    moves = real_array(shifts, "shifts", (2,), "shifts u v").astype(float).reshape(-1, 2)
    check_finite(moves, "shifts")
    rows, columns = pair[0].shape
    if np.abs(moves[:, 0]).max() >= columns or np.abs(moves[:, 1]).max() >= rows:
        raise ValueError(
            f"shifts: up to {np.abs(moves).max()}; expected less than the size of {rows} x {columns} pixels"
        )
    return _distances(pair, moves, dtype, workers, progress)


def _distances(
    pair: tuple[Reals, Reals],
    moves: NDArray[np.float64],
    dtype: np.dtype[np.floating],
    workers: int | None,
    progress: Progress | None,
) -> Reals:
    one, two = (image.astype(dtype, copy=False) for image in pair)
    planes, energy = _planes(one, workers)
    whole = np.rint(moves).astype(int)
    fractions, group = np.unique(moves - whole, axis=0, return_inverse=True)
    across, down = (int(np.abs(whole[:, k]).max()) for k in range(2))
    rows, columns = pair[0].shape
    result = np.empty((len(moves), rows, columns), dtype)
    step_done = steps(progress, len(moves))
    for number, fraction in enumerate(fractions):
        # Filters and shifts commute, so the image is interpolated once instead of all of its bands.
        seconds, size = _planes(_between(_between(two, fraction[0], 1), fraction[1], 0), workers)
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
