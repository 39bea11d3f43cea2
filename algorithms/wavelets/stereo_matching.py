"""Disparities of rectified stereo pairs from costs that are propagated over the image."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import filters, images

from ..arguments import Reals
from ..evidence import explains
from .checks import image_pair
from .flow_equations import half_gaussian
from .sharing import Progress, in_threads, slices, steps

_RIDGE = 1 / 400
"""Variance that is added to that of a neighbourhood, for images of contrast 1: a twentieth of the contrast is noise."""
_SMALL, _LARGE, _HIDDEN = 2.0, 4.0, 1.0
"""Costs of a change of the disparity by one, of any change, and of a pixel without a partner.

The unit is a difference of two pixels by the deviation of their neighbours. The numbers are the powers of two with the
fewest wrong disparities on random scenes (`benchmarks/stereo_scenes.py`); none was chosen on a measured pair.
"""
_PRIOR = 0.25
"""Variance of differences, a fiftieth of that of neighbours, over that of an unknown fraction of a pixel, 1/12."""
_NOISY = 1 / 16
"""Part of noise in the squares of differences of pixels above which images are smoothed: a quarter of the amplitude."""
_SMOOTH = tuple(half_gaussian(sigma, 10) for sigma in (0.7, 1.4, 2.8))
"""Filters of doubling width, of which the first that suffices is taken."""
_STRIP, _MARGIN = 256, 32
"""Rows of strips that are computed at a time, which limits memory, and rows beside them that influence them."""
_HUGE = 1e9
"""Sums of costs from here on mean that a level does not exist; see `images.best_levels`."""


class Disparity(NamedTuple):
    """Result of `disparity`; arrays (M, N).

    Attributes
    ----------
    disparity : array
        In pixels: the point at column x of the left image is at ``x - disparity`` in the right image.
    confidence : array
        Between 0 and 1: ``1 - (c + n) / s`` with the cost c of the disparity, the least cost s of those that differ by
        more than a pixel, and that of noise, n. It is 0 where another disparity is as good, such as in stripes, and
        where the disparity of the right image differs by more than a pixel, for example where a point is visible in
        one image only. It is 0 everywhere if the images are constant or unrelated: if the right image, moved by the
        disparities, explains less than half of the variance of the left one.
    """

    disparity: Reals
    confidence: Reals


def disparity(
    left: ArrayLike,
    right: ArrayLike,
    largest: int,
    smallest: int = 0,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Disparity:
    """Compute the disparities of a rectified stereo pair.

    Parameters
    ----------
    left, right : array_like, (M, N)
        Real images of the same size. float32 is kept; integers are converted to float64.
    largest, smallest : int
        Range of the disparities, both included; at least three disparities, of less than N.
    workers : int, optional
        Number of threads that share strips of 256 rows, as in `scipy.fft`; the result does not depend on it.
    progress : function of (done, total), optional
        Called after each strip.

    Returns
    -------
    Disparity

    Raises
    ------
    TypeError, ValueError
        If arguments are not finite real images of the same size, or if the range is invalid.

    Notes
    -----
    Images are smoothed if noise is more than a sixteenth of the squares of differences of pixels. Pixels are compared
    by these differences along rows and columns, after division by the deviation of 7 x 7 neighbours. Costs of all
    disparities are propagated downwards and upwards, each time from three neighbours in the row before, with a penalty
    for changes of the disparity (Hirschmueller, *IEEE Trans. PAMI* 30:328, 2008; Facciolo, de Franchis and Meinhardt,
    *BMVC* 2015). The disparity of the least sum is refined to a fraction of a pixel by least squares over 5 x 5 pixels
    of the images before smoothing. Where the check against the right image fails, it is the smaller one of the nearest
    checked disparities of the row, since hidden points are far away. Finally it is filtered by a median over 3 x 3
    pixels.
    """
    (one, two), dtype = image_pair(left, right, ("left", "right"))
    for name, value in (("largest", largest), ("smallest", smallest)):
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
            raise ValueError(f"{name}: {value!r}; expected a whole number of pixels")
    height, columns = one.shape
    if largest - smallest < 2 or max(abs(largest), abs(smallest)) >= columns:
        raise ValueError(
            f"smallest, largest: {smallest}, {largest}; expected at least three disparities, of less than {columns}"
        )
    pair = _of_contrast_one(one, two)
    smooth = _without_noise(pair)
    result, confidence = np.empty((2, height, columns), np.float32)
    parts = list(slices(height, _STRIP)) if height > _STRIP + 2 * _MARGIN else [slice(0, height)]
    step_done = steps(progress, len(parts))

    def match(part: slice) -> None:
        first = max(part.start - _MARGIN, 0)
        rows = slice(first, part.stop + _MARGIN)
        found = _matched(pair[:, rows], smooth[:, rows], int(smallest), int(largest))
        result[part], confidence[part] = (values[part.start - first : part.stop - first] for values in found)
        step_done()

    in_threads(match, parts, workers)
    # A pair of which neither image explains the other is not of one scene, whatever fits best.
    if not explains(_moved(pair[1], result), pair[0]):
        confidence[:] = 0
    return Disparity(images.medians(result).astype(dtype), confidence.astype(dtype))


def _of_contrast_one(one: Reals, two: Reals) -> Reals:
    """Return both images in single precision, with the mean 0, and with variance 1 unless they are constant."""
    pair = np.stack([image - float(image.mean(dtype=float)) for image in (one, two)])
    contrast = np.sqrt(np.mean(np.square(pair, dtype=float), (1, 2), keepdims=True))
    return (pair / np.where(contrast > 0, contrast, 1).astype(pair.dtype)).astype(np.float32, copy=False)


def _without_noise(pair: Reals) -> Reals:
    """Return images (2, M, N), smoothed as far as white noise contributes to differences of pixels that are two apart.

    The noise is the median of the finest diagonal details (Donoho and Johnstone, *Biometrika* 81:425, 1994), to which
    fine textures contribute as well.
    """
    even = pair[:, : pair.shape[1] // 2 * 2, : pair.shape[2] // 2 * 2]
    details = even[:, ::2, ::2] - even[:, 1::2, ::2] - even[:, ::2, 1::2] + even[:, 1::2, 1::2]
    variance = np.mean((np.median(np.abs(details), (1, 2)) / (2 * 0.6745)) ** 2) if details.size else 0.0
    smooth, gain = pair, 2.0
    for taps in (*_SMOOTH, None):
        squares = [np.square(part).mean() for part in (smooth[:, :, 2:] - smooth[:, :, :-2], _rows_apart(smooth))]
        if taps is None or variance * gain <= _NOISY * np.mean(squares):
            break
        smooth = filters.smoothed(pair, taps)
        whole = np.concatenate([taps[:0:-1], taps])
        gain = float((whole**2).sum() * (np.convolve(whole, [1, 0, -1]) ** 2).sum())
    return smooth


def _rows_apart(pair: Reals) -> Reals:
    """Return the differences of rows that are two apart, or of columns if there are fewer than three rows."""
    return pair[:, 2:] - pair[:, :-2] if pair.shape[1] > 2 else pair[:, :, 2:] - pair[:, :, :-2]


def _matched(pair: Reals, smooth: Reals, smallest: int, largest: int) -> tuple[Reals, Reals]:
    """Return the disparities of a pair of images (2, M, N), and their confidence; see `_without_noise`.

    A second disparity whose cost is higher by no more than a difference that may be noise is as good as the best one.
    """
    columns = pair.shape[2]
    # Level 0 pairs each column with the same one of an image that is moved by the smallest disparity.
    (here, *left), (there, *right) = _contrasts(smooth, smallest)
    if smooth.base is not pair.base:
        here, there = (planes[0] for planes in _contrasts(pair, smallest))
    levels = np.arange(largest - smallest + 1, dtype=np.float32)
    places = np.arange(columns) - levels[:, None] - smallest
    walls = np.where((places < 0) | (places >= columns), np.float32(_HUGE), 0)
    further = levels, walls, np.array([_SMALL, _LARGE, _HIDDEN], np.float32)
    above = images.costs_from_above(*left, *right, *further)  # type: ignore[call-overload]
    least, level, second, partner = images.best_levels(above, *left, *right, *further)  # type: ignore[call-overload]
    # The column of the right image, and the level that is best for it.
    numbers = np.arange(columns, dtype=np.float32)
    place = (numbers - level).astype(int) - smallest
    own = _taken(np.roll(partner, -smallest, 1), np.clip(place, 0, columns - 1))
    agrees = (place >= 0) & (place < columns) & (np.abs(own - level) <= 1)
    fine = images.refined_numbers(here, there, level, numbers, columns - 1, _PRIOR)
    result = np.clip(fine, 0, largest - smallest) + np.float32(smallest)
    noise = np.float32(_RIDGE**0.5)
    confidence = np.where(agrees & (second < _HUGE), 1 - (least + noise) / np.maximum(second, noise), 0)
    return _filled(result, agrees), np.maximum(confidence, 0)


def _contrasts(pair: Reals, shift: int) -> list[tuple[Reals, ...]]:
    """Return results of `images.contrasts` for two images, of which the second is moved to the right, cyclically."""
    return [images.contrasts(image, _RIDGE) for image in (pair[0], np.roll(pair[1], shift, 1))]


def _moved(image: Reals, disparities: Reals) -> Reals:
    """Return an image moved by disparities, by linear interpolation."""
    columns = image.shape[1]
    places = np.clip(np.arange(columns, dtype=np.float32) - disparities, 0, columns - 1)
    left = np.minimum(places.astype(int), columns - 2)
    one, two = _taken(image, left), _taken(image, left + 1)
    return np.asarray(one + (places - left) * (two - one))


def _taken(values: Reals, places: NDArray[np.int_]) -> Reals:
    """Return values of a table from columns of the same row, as `numpy.take_along_axis` in half of its time."""
    rows, columns = values.shape
    return values.ravel().take(places + np.arange(0, rows * columns, columns)[:, None])


def _filled(values: Reals, known: NDArray[np.bool_]) -> Reals:
    """Return values with unknown ones replaced by the smaller one of the nearest known ones of the row."""
    columns = values.shape[1]
    numbers = np.arange(columns, dtype=np.int32)
    before = np.maximum.accumulate(np.where(known, numbers, np.int32(-1)), 1)
    after = np.minimum.accumulate(np.where(known, numbers, np.int32(columns))[:, ::-1], 1)[:, ::-1]
    rows, places = np.nonzero(~known)
    wide = np.pad(values, [(0, 0), (1, 1)], constant_values=np.inf)
    nearest = np.minimum(*(wide[rows, side[rows, places] + 1] for side in (before, after)))
    filled = values.copy()
    filled[rows, places] = np.where(np.isfinite(nearest), nearest, values[rows, places])
    return filled
