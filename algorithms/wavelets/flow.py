"""Optical flow between two images from their differences, coarse to fine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import images

from ..arguments import Reals, finite_number
from .checks import single_image
from .flow_boundaries import Comparison, chosen, interpolated, joined, visible
from .flow_equations import LARGE, Level, halved, too_fine
from .flow_solver import filled, solved
from .sharing import Progress, n_threads, steps

_ROUNDS = 2, 2, 4
"""Comparisons of the images at each level, fine to coarse: few at the finest level, which costs most."""
_SWEEPS = 8, 16, 32
"""Sweeps of the solver at each level; motion comes from farther away where levels are coarse."""
_CHOSEN = 3
"""Number of levels, from the finest one on, at which nodes choose among candidate motions."""
_SHARP = 2
"""Number of levels, from the finest one on, at which each pixel chooses its motion at boundaries."""
_SMALLEST = 8
"""The least number of rows and columns of an image of a pyramid."""
_STIFFNESS = 12.0, 100.0
"""Weights of the smoothness of the motion, without noise and with much noise."""
_NOISE = 0.4
"""Noise-to-contrast ratio (standard deviations) at which the stiffness is halfway between the two."""
_SOFTER = 0.7
"""Factor of the stiffness from a level to the next coarser one, where motions vary more from pixel to pixel."""
_CONTRAST = 0.1
"""For an image of contrast 1: hidden pixels take no motion from neighbours that differ by more than this."""


class Flow(NamedTuple):
    """The motion between two images.

    Attributes
    ----------
    uv : array, (M, N, 2)
        In pixels: the point at row y and column x of the first image is at ``(y + v, x + u)`` in the second one.
    confidence : array, (M, N)
        Between 0 and 1. It is 0 where the motion along some direction is undetermined, so that noise alone explains the
        structure in this direction with a probability above 1/1000, and where the pixel is not visible. It is low where
        the equations disagree.
    visible : array of bool, (M, N)
        True where the motion ends inside the image and, near boundaries of the motion, the images agree there and no
        pixel that moves differently agrees better at the same place. Elsewhere, for example where a pixel of the first
        image is hidden in the second one, the motion is interpolated from visible neighbours. It is False everywhere if
        the moved image explains less than half of the variance of the other one, as for unrelated or constant images.
        The default is True everywhere.
    """

    uv: Reals
    confidence: Reals
    visible: NDArray[np.bool_] = np.ones((), bool)


def optical_flow(
    first: ArrayLike,
    second: ArrayLike,
    levels: int | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
    noise: float | None = None,
) -> Flow:
    """Compute the dense motion between two images of one scene.

    Parameters
    ----------
    first, second : array_like, (M, N)
        Real grey images of the same size, at least 8 x 8. Changes of brightness and contrast of a whole image have
        no influence. float32 is kept; integers are converted to float64.
    levels : int, optional
        Number of pyramid levels, each of half the size of the previous one: motions of up to about ``2**levels`` pixels
        are found. The default is 5, or as many levels as leave 8 pixels. Levels whose pixels are too large for the
        structure of the images, such as fine stripes, are left out.
    workers : int, optional
        Number of threads that share the filters of several images, as in `scipy.fft`; the result does not depend on it.
    progress : function of (done, total), optional
        Called after each step at each level.
    noise : float, optional
        Standard deviation of the white noise of both images, in units of their values. By default, it is estimated from
        second differences of each image. The more noise, the smoother the motion.

    Returns
    -------
    Flow

    Raises
    ------
    TypeError, ValueError
        If the images are not finite real numbers of the same size, are too small or in colour, if `noise` is negative,
        or if there are too many levels.

    Notes
    -----
    At each level of a pyramid, the second image is moved by the motion found so far. Its differences from the first
    image give linear equations for a correction, which are averaged over a Gaussian of 1.5 pixels (Bruhn, Weickert and
    Schnörr, *Int. J. Computer Vision* 61:211, 2005). The images are filtered by the difference of two Gaussians, so
    that slow changes of brightness have no influence. The motion satisfies the equations in units of their noise, which
    is estimated from the residuals. It is smooth except at few places, apart from its local average. Where there is
    much noise or little texture, it is propagated from farther away. Equations that fit badly get small weights. The
    unknowns are the motions of every other row and column, the nodes. At boundaries, nodes and then pixels choose among
    their own motion and those of neighbours by the differences of the images, which keeps boundaries sharp.

    Of the motions of a periodic pattern, the smallest one is found if it is at most a third of the period. Along edges
    and stripes that extend through the whole image, the motion is undetermined: without noise it is 0 there, and with
    noise it may be several pixels. Its confidence is 0 except at about one place of a thousand.

    Mean errors for translations of textures without noise are below 0.02 pixels. Changes of brightness within a few
    pixels, as by small highlights, look like motion.
    """
    pair = [single_image(image, name, _SMALLEST) for image, name in ((first, "first"), (second, "second"))]
    if pair[0].shape != pair[1].shape:
        raise ValueError(f"second: shape {pair[1].shape}; expected that of the first image, {pair[0].shape}")
    rows, columns = pair[0].shape
    dtype = np.result_type(*pair)
    most = int(np.log2(min(pair[0].shape) / _SMALLEST)) + 1
    count = min(5, most) if levels is None else levels
    if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or not 1 <= count <= most:
        raise ValueError(f"levels: {levels!r}; expected 1 to {most} for images of {rows} x {columns} pixels")
    threads = n_threads(workers)
    normalized, contrasts = zip(*(_normalized(image) for image in pair), strict=True)
    share = _noise_share(normalized, contrasts, noise)
    stiffness = _STIFFNESS[0] + (_STIFFNESS[1] - _STIFFNESS[0]) * share**2 / (share**2 + _NOISE**2)
    pyramid = [np.stack(normalized)]
    while len(pyramid) < count and not too_fine(pyramid[-1]):
        pyramid.append(halved(pyramid[-1], threads))
    uv, confidence = _motion(pyramid, stiffness, threads, steps(progress, sum(_rounds(len(pyramid)))))
    half = pyramid[1] if len(pyramid) > 1 else halved(pyramid[0], threads)
    seen = visible(Comparison(*normalized), half, uv)
    if seen.any() and not seen.all():
        uv = filled(uv, seen, half[0], _CONTRAST)
    confidence = np.where(seen, interpolated(confidence, seen.shape), 0)
    return Flow(np.ascontiguousarray(np.moveaxis(uv, 0, -1), dtype), confidence.astype(dtype), seen)


def _noise_share(normalized: Sequence[Reals], contrasts: Sequence[float], noise: float | None) -> float:
    """Return the ratio of the standard deviation of the noise to the contrast of the images.

    Images are `normalized`; `contrasts` and `noise` refer to the images as the caller passed them.
    """
    if noise is None:
        shares = [_white_noise(image) for image in normalized]
    else:
        number = finite_number(noise, "noise")
        if number < 0:
            raise ValueError(f"noise: {number}; expected 0 or more")
        # An image without contrast has nothing to smooth.
        shares = [min(number / contrast, 1.0) if contrast else 0.0 for contrast in contrasts]
    return float(np.sqrt(np.mean(np.square(shares))))


def _white_noise(image: Reals) -> float:
    """Estimate the standard deviation of white noise of an image from the median of its second differences.

    Differences along both axes have 36 times the variance of the noise, and little of the image. The median of absolute
    values of a normal distribution is 0.6745 standard deviations. Every other row is used, every fourth of large
    images.
    """
    step = 4 if image.size > 4 * LARGE else 2
    down = image[:-2:step] + image[2::step] - 2 * image[1:-1:step]
    both = down[:, :-2] + down[:, 2:] - 2 * down[:, 1:-1]
    return float(np.median(np.abs(both)) / (6 * 0.6745))


def _motion(
    pyramid: Sequence[Reals], stiffness: float, threads: int, step_done: Callable[[], None]
) -> tuple[Reals, Reals]:
    """Return the motion of pixels between the images of a pyramid, coarse to fine, and the confidence of nodes."""
    rows, columns = pyramid[-1].shape[1:]
    uv: Reals = np.zeros((2, -(-rows // 2), -(-columns // 2)), np.float32)
    for k, pair in reversed(list(enumerate(pyramid))):
        level, comparison, motion = Level(pair, threads), Comparison(*pair), 2 * uv
        stiff, sweeps = stiffness * _SOFTER**k, _SWEEPS[min(k, len(_SWEEPS) - 1)]
        for _ in range(_ROUNDS[min(k, len(_ROUNDS) - 1)]):
            sums, confidence, noise = level.equations(motion)
            motion = images.medians(solved(sums, motion, noise, stiff, sweeps), num_threads=threads)
            step_done()
        if k < _CHOSEN:
            motion = chosen(comparison, motion)
        uv = level.pixels(motion)
        if k < _SHARP:
            uv = joined(comparison, motion, uv)
    return uv, confidence


def _rounds(levels: int) -> list[int]:
    """Return the number of comparisons at each level, coarse to fine."""
    return [_ROUNDS[min(k, len(_ROUNDS) - 1)] for k in range(levels)][::-1]


def _normalized(image: Reals) -> tuple[Reals, float]:
    """Return the image with mean 0 and contrast 1, and its original contrast.

    The image is in single precision, whose rounding errors are far below the errors of the method.
    """
    # No square and no sum of numbers up to 1 overflows.
    largest = float(max(image.max(), -image.min())) or 1.0
    centred = image / largest
    centred -= centred.mean(dtype=float)
    single = centred.astype(np.float32)
    contrast = float(np.sqrt(np.square(single).mean(dtype=float)))
    return single / np.float32(contrast or 1.0), contrast * largest
