"""Optical flow between two images from the local phases of quaternionic Gabor bands."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.ndimage
from numpy.typing import ArrayLike

from generated import quaternion

from ..arguments import Reals, real_array
from .discrete import check_finite
from .phase import gabor_taps
from .separable import filter_bank, median_5, sampled

_FREQUENCIES = (0.7, 1.2)
"""Radians per pixel, at every level of the pyramid."""
_SIGMA = 2.2
_NEIGHBOURHOOD = gabor_taps(0.0, 2.5, False)[0][None]
"""A Gaussian over which equations are averaged."""
_WARPS = 3
"""Steps at each level; one less at the last, which costs most."""
_FLOOR = 0.1
"""Bands count where they are larger than this part of their median."""
_SMALLEST = 8


class Flow(NamedTuple):
    """The motion between two images.

    Attributes
    ----------
    uv : array, (M, N, 2)
        In pixels: what is at row y and column x of the first image is at ``(y + v, x + u)`` in the second one.
    confidence : array, (M, N)
        From 0, where nothing is known along some direction or the equations disagree, to 1. Errors grow with
        ``sqrt(1 / c - 1)`` of a confidence c.
    """

    uv: Reals
    confidence: Reals


def optical_flow(first: ArrayLike, second: ArrayLike, levels: int | None = None) -> Flow:
    """Dense motion between two images of one scene.

    Parameters
    ----------
    first, second : array_like, (M, N)
        Real images of one size, at least 8 x 8. Brightness and contrast do not count. float32 stays; integers become
        float64.
    levels : int, optional
        Of the pyramid, each of half the size: motions of up to about ``2**levels`` pixels are found. By default 5, or
        as many as leave 8 pixels.

    Returns
    -------
    Flow

    Raises
    ------
    TypeError, ValueError
        Where images are not finite real numbers of one size, are too small, and for too many levels.

    Notes
    -----
    Every complex band of a quaternionic Gabor filter moves its phase by frequency times motion (Fleet and Jepson, *Int.
    J. Computer Vision* 5:77, 1990); the frequency is the local one, from the phases of neighbours. All bands give
    linear equations for the motion, weighted by their amplitudes, averaged over a neighbourhood and solved, coarse to
    fine (Magarey and Kingsbury, *IEEE Trans. Signal Processing* 46:1069, 1998; Bayro-Corrochano, *J. Math. Imaging and
    Vision* 24:79, 2006). Mean errors on smooth motions of textures are below 0.035 pixels; motion that jumps is
    smoothed over some 6 pixels.
    """
    images = [
        real_array(image, name, (-1, -1), "an image M N") for image, name in ((first, "first"), (second, "second"))
    ]
    for image, name in zip(images, ("first", "second"), strict=True):
        if image.ndim != 2 or min(image.shape) < _SMALLEST:
            raise ValueError(
                f"{name}: shape {image.shape}; expected one image of at least {_SMALLEST} x {_SMALLEST} pixels"
            )
        check_finite(image, name)
    if images[0].shape != images[1].shape:
        raise ValueError(f"second: shape {images[1].shape}; expected that of the first image, {images[0].shape}")
    rows, columns = images[0].shape
    dtype = np.result_type(*images)
    most = int(np.log2(min(images[0].shape) / _SMALLEST)) + 1
    count = min(5, most) if levels is None else levels
    if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or not 1 <= count <= most:
        raise ValueError(f"levels: {levels!r}; expected 1 to {most} for images of {rows} x {columns} pixels")
    pyramid = [_normalized(images)]
    while len(pyramid) < count:
        pyramid.append(tuple(_halved(image) for image in pyramid[-1]))
    uv = np.zeros((2, *pyramid[-1][0].shape), np.float32)
    confidence = uv[0]
    for a, b in pyramid[::-1]:
        if uv.shape[1:] != a.shape:
            uv = 2 * _enlarged(uv, a.shape)
        bands = _bands(a)
        sizes = (bands[:, :, ::3, ::3] ** 2).sum(1)
        floors = (_FLOOR * np.sqrt(np.median(sizes, (1, 2)))).astype(bands.dtype)
        spline = scipy.ndimage.spline_filter(b, 3, np.float32)
        for _ in range(_WARPS - (a.shape == images[0].shape)):
            moved = sampled(spline, uv) if uv.any() else b
            change, confidence = _step(bands, floors, _bands(moved))
            uv = np.stack([median_5(part) for part in uv + change])
    return Flow(np.ascontiguousarray(np.moveaxis(uv, 0, -1), dtype), confidence.astype(dtype))


def _step(bands: Reals, floors: Reals, moved: Reals) -> tuple[Reals, Reals]:
    """The motion that is left, by all bands, and how sure it is.

    Bands are as of `_bands`; those of smaller amplitude than their floor do not count.
    """
    rows, columns = bands.shape[2] - 2, bands.shape[3]
    # As one line of numbers, where neighbours are so many places apart. Borders at the sides are computed, and cut off.
    lines, other = (np.swapaxes(each.reshape(len(each), 2, -1), 1, 2) for each in (bands, moved))
    inside, size = columns, rows * columns
    total = np.zeros((6, size), bands.dtype)
    equation = np.empty_like(total)

    def at(line: Reals, offset: int) -> Reals:
        start = inside + offset
        return line[max(start, 0) : start + size]

    for line, there, floor in zip(lines, other, floors, strict=True):
        first, last = 1, size - 1
        quaternion.phase_equation(
            at(line, 0)[first:last],
            at(there, 0)[first:last],
            at(line, -1)[first:last],
            at(line, 1)[first:last],
            at(line, -columns)[first:last],
            at(line, columns)[first:last],
            floor,
            out=equation.T[first:last],
        )
        total[:, first:last] += equation[:, first:last]
    sums = total.reshape(6, rows, columns)[:, :, 1:-1]
    along = np.concatenate([filter_bank(part, _NEIGHBOURHOOD, 0)[0] for part in sums])
    smooth = filter_bank(along, _NEIGHBOURHOOD, 1)[0].reshape(6, rows, -1)
    # Waves of size 1 give sums of about 1, so that the second part counts only where there is nothing.
    ridge = 1e-4 * (smooth[0].mean() + smooth[2].mean()) + 1e-12
    u, v, confidence = quaternion.solve_motion(*smooth, np.asarray(ridge, bands.dtype))
    return np.stack([u, v]), confidence


def _bands(image: Reals) -> Reals:
    """The complex bands of an image, (K, 2, M, N).

    They have a border of one pixel. For each frequency: the two planes of the quaternionic filter, of diagonal waves,
    and waves along rows and columns.
    """
    padded = np.pad(image, 1, "symmetric")
    result = np.empty((4 * len(_FREQUENCIES), 2, *padded.shape), image.dtype)
    smooth = gabor_taps(0.0, _SIGMA, False)[0]
    waves = [gabor_taps(frequency, _SIGMA, True) for frequency in _FREQUENCIES]
    smoothed, *along = filter_bank(padded, np.array([smooth, *(taps for wave in waves for taps in wave)]), 0)
    result[3::4] = filter_bank(smoothed, np.array([taps for wave in waves for taps in wave]), 1).reshape(
        len(waves), 2, *padded.shape
    )
    for k, wave in enumerate(waves):
        # Of the even part along columns and of the odd one, at once.
        both = np.concatenate(along[2 * k : 2 * k + 2])
        parts = filter_bank(both, np.array([smooth, *wave]), 1).reshape(3, 2, *padded.shape)
        result[4 * k + 2] = parts[0]
        q = np.moveaxis(parts[1:].reshape(4, *padded.shape), 0, -1)
        quaternion.pack_two_sided(q, out=tuple(np.moveaxis(result[4 * k + n], 0, -1) for n in range(2)))
    return result


def _normalized(images: list[Reals]) -> tuple[Reals, ...]:
    """In single precision, whose rounding is far below the errors of the method, brightness 0 and contrast 1."""
    result = []
    for image in images:
        centred = image - image.mean(dtype=float)
        contrast = float(np.sqrt((centred**2).mean(dtype=float)))
        result.append((centred / (contrast or 1.0)).astype(np.float32))
    return tuple(result)


def _halved(image: Reals) -> Reals:
    """Every other pixel of the smoothed image; both its rows and its columns begin at the first."""
    smooth: Reals = scipy.ndimage.gaussian_filter(image, 1.0, mode="reflect")
    return smooth[::2, ::2]


def _enlarged(uv: Reals, shape: tuple[int, ...]) -> Reals:
    """Twice as many rows and columns, one less where they are odd, with the means of neighbours between them."""
    for axis, size in ((1, shape[0]), (2, shape[1])):
        lines = np.moveaxis(uv, axis, 0)
        result = np.empty((*uv.shape[:axis], size, *uv.shape[axis + 1 :]), uv.dtype)
        to = np.moveaxis(result, axis, 0)
        to[::2] = lines
        to[1 : 2 * len(lines) - 1 : 2] = (lines[:-1] + lines[1:]) / 2
        to[2 * len(lines) - 1 :] = lines[-1]
        uv = result
    return uv
