"""Disparities of rectified stereo pairs from costs that are propagated over the image."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import images

from ..arguments import Reals
from ..evidence import explains
from .checks import image_pair
from .sharing import Progress, in_threads, slices, steps

_RIDGE = 1 / 400
"""Variance that is added to that of a neighbourhood, for images of contrast 1: a twentieth of the contrast is noise."""
_SMALL, _LARGE, _HIDDEN = 1.0, 3.0, 1.0
"""Costs of a change of the disparity by one, of any change, and of a pixel without a partner.

The unit is a difference of two pixels by the deviation of their neighbours. The numbers are round; half and twice each
of them change the share of wrong disparities of the Motorcycle pair by less than 0.04.
"""
_PRIOR = 0.25
"""Variance of differences, a fiftieth of that of neighbours, over that of an unknown fraction of a pixel, 1/12."""
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
        Between 0 and 1: ``1 - c / s`` with the cost c of the disparity, and the least cost s of those that differ by
        more than a pixel. It is 0 where the disparity of the right image differs by more than a pixel, for example where
        a point is visible in one image only. It is 0 everywhere if the images are constant or unrelated: if the right
        image, moved by the disparities, explains less than half of the variance of the left one.
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
    Pixels are compared by their brightness and its derivatives relative to the mean and the deviation of 7 x 7
    neighbours. Costs of all disparities are propagated downwards and upwards, each time from three neighbours in the
    row before, with a penalty for changes of the disparity (Hirschmueller, *IEEE Trans. PAMI* 30:328, 2008; Facciolo,
    de Franchis and Meinhardt, *BMVC* 2015). The disparity of the least sum is refined to a fraction of a pixel by least
    squares over 5 x 5 pixels. Where the check against the right image fails, it is the smaller one of the nearest
    checked disparities of the row, since hidden points are far away. Finally it is filtered by a median over 3 x 3
    pixels.
    """
    (one, two), dtype = image_pair(left, right, ("left", "right"))
    for name, value in (("largest", largest), ("smallest", smallest)):
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
            raise ValueError(f"{name}: {value!r}; expected a whole number of pixels")
    rows, columns = one.shape
    if largest - smallest < 2 or max(abs(largest), abs(smallest)) >= columns:
        raise ValueError(
            f"smallest, largest: {smallest}, {largest}; expected at least three disparities, of less than {columns}"
        )
    pair = _of_contrast_one(one, two)
    result, confidence = np.empty((2, rows, columns), np.float32)
    parts = list(slices(rows, _STRIP)) if rows > _STRIP + 2 * _MARGIN else [slice(0, rows)]
    step_done = steps(progress, len(parts))

    def match(part: slice) -> None:
        first = max(part.start - _MARGIN, 0)
        found = _matched(pair[:, first : part.stop + _MARGIN], int(smallest), int(largest))
        result[part], confidence[part] = (values[part.start - first : part.stop - first] for values in found)
        step_done()

    in_threads(match, parts, workers)
    # A pair of which neither image explains the other is not of one scene, whatever fits best.
    if not explains(_moved(pair[1], result), pair[0]):
        confidence[:] = 0
    return Disparity(images.medians(result).astype(dtype), confidence.astype(dtype))


def _of_contrast_one(one: Reals, two: Reals) -> Reals:
    """Return both images in single precision, with the mean 0 and a mean variance of 1 unless they are constant."""
    pair = np.stack([one - one.mean(dtype=float), two - two.mean(dtype=float)])
    contrast = np.sqrt(np.mean(pair**2, dtype=float))
    return (pair / (contrast if contrast > 0 else 1)).astype(np.float32)


def _matched(pair: Reals, smallest: int, largest: int) -> tuple[Reals, Reals]:
    """Return the disparities of a pair of images (2, M, N), and their confidence."""
    columns = pair.shape[2]
    # Level 0 pairs each column with the same one of an image that is moved by the smallest disparity.
    other = np.roll(pair[1], smallest, 1)
    (here, *planes), (there, *others) = (images.contrasts(image, _RIDGE) for image in (pair[0], other))
    planes += others
    levels = np.arange(largest - smallest + 1, dtype=np.float32)
    places = np.arange(columns) - levels[:, None] - smallest
    walls = np.where((places < 0) | (places >= columns), np.float32(_HUGE), 0)
    further = levels, walls, np.array([_SMALL, _LARGE, _HIDDEN], np.float32)
    above = images.costs_from_above(*planes, *further)
    least, level, second, partner = images.best_levels(above, *planes, *further)
    # The column of the right image, and the level that is best for it.
    numbers = np.arange(columns, dtype=np.float32)
    place = (numbers - level).astype(int) - smallest
    own = np.take_along_axis(np.roll(partner, -smallest, 1), np.clip(place, 0, columns - 1), 1)
    agrees = (place >= 0) & (place < columns) & (np.abs(own - level) <= 1)
    fine = images.refined_numbers(here, there, level, numbers, columns - 1, _PRIOR)
    result = np.clip(fine, 0, largest - smallest) + np.float32(smallest)
    confidence = np.where(agrees & (second < _HUGE), 1 - least / np.maximum(second, np.finfo(np.float32).tiny), 0)
    return _filled(result, agrees), np.maximum(confidence, 0)


def _moved(image: Reals, disparities: Reals) -> Reals:
    """Return an image moved by disparities, by linear interpolation."""
    columns = image.shape[1]
    places = np.clip(np.arange(columns) - disparities, 0, columns - 1)
    left = np.minimum(places.astype(int), columns - 2)
    one, two = (np.take_along_axis(image, left + k, 1) for k in (0, 1))
    return np.asarray(one + (places - left) * (two - one))


def _filled(values: Reals, known: NDArray[np.bool_]) -> Reals:
    """Return values with unknown ones replaced by the smaller one of the nearest known ones of the row."""
    columns = values.shape[1]
    numbers = np.arange(columns)
    before = np.maximum.accumulate(np.where(known, numbers, -1), 1)
    after = np.minimum.accumulate(np.where(known, numbers, columns)[:, ::-1], 1)[:, ::-1]
    wide = np.pad(values, [(0, 0), (1, 1)], constant_values=np.inf)
    nearest = np.minimum(np.take_along_axis(wide, before + 1, 1), np.take_along_axis(wide, after + 1, 1))
    return np.where(np.isfinite(nearest), nearest, values)
