"""The dual-tree complex wavelet transform of images, as orthogonal periodic transforms of rearranged samples."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals
from .checks import image_stack
from .discrete import checked_levels
from .families import orthogonal_filters
from .filter_bank import Taps, as_taps, extended, merge, merge_taps, split_taps, stack
from .filter_bank import split as filtered
from .filters import LEVEL_ONE_ANALYSIS, LEVEL_ONE_SYNTHESIS, QSHIFT
from .sharing import Progress, in_threads, n_threads, steps

Complexes = NDArray[np.complexfloating]

BANDS = {"H": ("d", "a"), "V": ("a", "d"), "D": ("d", "d")}
"""Whether each axis is smoothed (a) or differenced (d)."""

_HALF = 0.5**0.5

_PAIRS = {"H": (0, 5), "V": (2, 3), "D": (1, 4)}
"""Indices of the two complex bands of a quad among the six, which are ordered by angle: 15, 45, ... 165 degrees."""


@dataclass(frozen=True)
class DualTree:
    """Result of `dual_tree`.

    Attributes
    ----------
    approx : array, (..., M / 2**(L-1), N / 2**(L-1))
        The smoothed image at the last of L levels; samples of the four trees are interleaved.
    detail : tuple of array
        ``detail[l]`` is complex, (..., M / 2**(l+1), N / 2**(l+1), 6), finest first; the six bands respond to edges at
        15, 45, 75, 105, 135 and 165 degrees.
    first, later : str
        Names of the filters.
    size : (int, int)
        M and N, before padding to multiples of ``2**L``.
    """

    approx: Reals
    detail: tuple[Complexes, ...]
    first: str
    later: str
    size: tuple[int, int]

    def inverse(self, workers: int | None = None, progress: Progress | None = None) -> Reals:
        """Return the reconstructed images, exact up to rounding if no coefficient was changed.

        Parameters
        ----------
        workers : int, optional
            Number of threads, as in `scipy.fft`; the result does not depend on it.
        progress : function of (done, total), optional
            Called after each level.

        Returns
        -------
        array, (..., M, N)
        """
        bands = [{name: _samples(level[..., pair]) for name, pair in _PAIRS.items()} for level in self.detail]
        return joined(self.approx, bands, self.first, self.later, self.size, workers, progress)


def dual_tree(
    image: ArrayLike,
    levels: int | None = None,
    first: str = "near_sym_a",
    later: str = "qshift_a",
    workers: int | None = None,
    progress: Progress | None = None,
) -> DualTree:
    """Compute the dual-tree complex wavelet transform of images.

    The transform is nearly shift invariant, distinguishes six directions and has four times as many numbers as the
    image.

    Parameters
    ----------
    image : array_like, (..., M, N)
        Real images of any size; if a size is not a multiple of ``2**levels``, the last row or column is repeated.
        float32 is kept; integers are converted to float64.
    levels : int, optional
        Number of levels. The default, and the maximum, is the largest for which ``2**levels`` is at most the smaller
        size.
    first : str
        Filters of the first level: "near_sym_a" or "near_sym_b".
    later : str
        Filters of the other levels: "qshift_06", "qshift_a" to "qshift_d". Longer filters separate directions better.
    workers : int, optional
        Number of threads, as in `scipy.fft`; the result does not depend on it.
    progress : function of (done, total), optional
        Called after each level.

    Returns
    -------
    DualTree

    Raises
    ------
    TypeError, ValueError
        If `image` is not an array of finite real numbers with two axes, or if filters or the number of levels are
        invalid.

    Notes
    -----
    Kingsbury, *Appl. Comput. Harmon. Anal.* 10:234, 2001. Images are mirrored at their edges. Mirroring exchanges the
    two trees along an axis, so that both together form one periodic orthogonal transform: of the samples of one tree
    forward, followed by those of the other backward. The coefficients agree with those of the dtcwt package;
    `DualTree.inverse` recovers the image to 1e-14 of the largest number.
    """
    array = image_stack(image)
    size = array.shape[-2:]
    most = int(np.log2(min(size)))
    count = checked_levels(levels, most, f"as images of {size[0]} x {size[1]} pixels have")
    approx, bands = split(array, count, first, later, workers, progress)
    detail = []
    for level in bands:
        numbers = np.empty((*level["H"].shape[:-2], *(n // 2 for n in level["H"].shape[-2:]), 6), _complex(array))
        for name, pair in _PAIRS.items():
            numbers[..., pair] = _pair(level[name])
        detail.append(numbers)
    return DualTree(approx, tuple(detail), first, later, (size[0], size[1]))


def split(
    array: Reals,
    levels: int,
    first: str,
    later: str,
    workers: int | None = None,
    progress: Progress | None = None,
) -> tuple[Reals, list[dict[str, Reals]]]:
    """Return the approximation and the details H, V and D of each level, with the trees interleaved along both axes."""
    _check_filters(first, later)
    n_threads(workers)
    step_done = steps(progress, levels)
    missing = [-n % 2**levels for n in array.shape[-2:]]
    if any(missing):
        array = np.pad(array, [(0, 0)] * (array.ndim - 2) + [(0, n) for n in missing], "edge")
    bands = []
    for level in range(levels):
        # A large single allocation is served by the system in large pages.
        work = list(np.empty((3, 2, *array.shape), array.dtype)) if level == 0 else None
        low, high = _both(array, level, first, later, -2, work, workers)
        parts = {"a": low, "d": high}
        halves = {name: _both(part, level, first, later, -1, work, workers) for name, part in parts.items()}
        array = halves["a"][0]
        bands.append({name: halves[word[0]]["ad".index(word[1])] for name, word in BANDS.items()})
        step_done()
    return array.copy() if levels == 1 else array, bands


def joined(
    approx: Reals,
    bands: list[dict[str, Reals]],
    first: str,
    later: str,
    size: tuple[int, int],
    workers: int | None = None,
    progress: Progress | None = None,
) -> Reals:
    """Return the images whose `split` is given: the inverse of `split`."""
    n_threads(workers)
    array, step_done = approx, steps(progress, len(bands))
    for level in range(len(bands) - 1, -1, -1):
        band = bands[level]
        low = _back(array, band["V"], level, first, later, -1, workers)
        high = _back(band["H"], band["D"], level, first, later, -1, workers)
        array = _back(low, high, level, first, later, -2, workers)
        step_done()
    return np.ascontiguousarray(array[..., : size[0], : size[1]])


def _both(
    array: Reals, level: int, first: str, later: str, axis: int, work: list[Reals] | None, workers: int | None
) -> tuple[Reals, Reals]:
    """Split one level along one axis. The first level keeps all samples: its trees take the even and the odd ones."""
    shape, x = array.shape, stack(array, axis)
    size = x.shape[1]
    if level == 0:
        taps = _level_one_taps(first, x.dtype)
        reach = taps.every.shape[1] // 2
        out = None if work is None else work.pop().reshape(2, *x.shape, copy=False)
        low, high = filtered(extended(x, "symmetric", reach - 1, reach), 1, taps, size, workers, out)
        return low.reshape(shape), high.reshape(shape)
    # The transform is periodic over the samples of one tree forward, followed by those of the other backward.
    taps = _later_taps(later, x.dtype)[0]
    before = taps.every.shape[1] // 2 - 1
    y = extended(x.take(_there_and_back(size, 0), 1), "periodic", before, before)
    low, high = filtered(y, 2, taps, size // 2, workers)
    halved = list(shape)
    halved[axis] //= 2
    parts = low.take(_and_back(size // 2, 0), 1), high.take(_and_back(size // 2, 1), 1)
    return parts[0].reshape(halved), parts[1].reshape(halved)


def _back(low: Reals, high: Reals, level: int, first: str, later: str, axis: int, workers: int | None) -> Reals:
    if level == 0:
        parts = [np.empty_like(low), np.empty_like(high)]
        work = list(zip((low, high), _level_one(first)[2:], parts, strict=True))
        in_threads(lambda each: scipy.ndimage.convolve1d(each[0], each[1], axis, each[2], "reflect"), work, workers)
        return parts[0] + parts[1]
    shape, size = list(low.shape), low.shape[axis]
    taps = _later_taps(later, low.dtype)[1]
    half = taps.every.shape[2]
    bands = [
        extended(stack(band, axis).take(_there_and_back(size, start), 1), "periodic", half // 2, half // 2)
        for start, band in enumerate((low, high))
    ]
    around = merge(bands[0], bands[1], taps, size + 1 - half % 2, workers)
    shape[axis] *= 2
    return around[:, (half - 1) % 2 :].take(_and_back(2 * size, 0), 1).reshape(shape)


@lru_cache
def _level_one(name: str) -> tuple[NDArray[np.float64], ...]:
    """Return symmetric filters: low and high pass of the analysis, low and high pass of the synthesis."""
    low, back = np.array(LEVEL_ONE_ANALYSIS[name]), np.array(LEVEL_ONE_SYNTHESIS[name])
    high, high_back = (taps * (-1.0) ** (np.arange(len(taps)) - len(taps) // 2) for taps in (back, low))
    return low, high, back, high_back


@lru_cache
def _level_one_taps(name: str, dtype: np.dtype[np.floating]) -> Taps:
    """Return both analysis filters with the same even length: zeros before the shorter one, and one after both."""
    filters = _level_one(name)[:2]
    reach = max(map(len, filters)) // 2
    padded = [np.pad(taps, (reach - len(taps) // 2, reach - len(taps) // 2 + 1)) for taps in filters]
    return as_taps(np.stack(padded), dtype)


@lru_cache
def _later_taps(name: str, dtype: np.dtype[np.floating]) -> tuple[Taps, Taps]:
    """Return the taps of analysis and of synthesis."""
    filters = orthogonal_filters(np.array(QSHIFT[name])[::-1])
    return split_taps(filters.low, filters.high, dtype), merge_taps(filters.low_back, filters.high_back, dtype)


@lru_cache
def _there_and_back(size: int, start: int) -> NDArray[np.intp]:
    """Return the samples of one tree forward, then those of the other one backward."""
    forward = np.arange(start, size, 2)
    return np.concatenate([forward, np.arange(1 - start, size, 2)[::-1]])


@lru_cache
def _and_back(size: int, start: int) -> NDArray[np.intp]:
    """Return the inverse of the permutation `_there_and_back`."""
    return np.argsort(_there_and_back(size, start))


def _check_filters(first: str, later: str) -> None:
    for name, value, known in (("first", first, LEVEL_ONE_ANALYSIS), ("later", later, QSHIFT)):
        if value not in known:
            raise ValueError(f"{name}: {value!r}; expected {', '.join(map(repr, known))}")


def _complex(array: Reals) -> np.dtype[np.complexfloating]:
    return np.result_type(array.dtype, np.complex64)


def _pair(samples: Reals) -> Complexes:
    """Return the two complex bands of four trees: sums and differences, as the trees are nearly Hilbert transforms."""
    a, b, c, d = quads(samples)
    p, q = (a + 1j * b) * _HALF, (d - 1j * c) * _HALF
    return np.stack([p - q, p + q], -1).astype(_complex(samples), copy=False)


def _samples(pair: Complexes) -> Reals:
    p, q = (pair[..., 1] + pair[..., 0]) * _HALF, (pair[..., 1] - pair[..., 0]) * _HALF
    result = np.empty((*p.shape[:-2], *(2 * n for n in p.shape[-2:])), p.real.dtype)
    for part, value in zip(quads(result), (p.real, p.imag, -q.imag, q.real), strict=True):
        part[...] = value
    return result


def quads(samples: Reals) -> tuple[Reals, Reals, Reals, Reals]:
    """Return the four trees: first along both axes, second along columns, second along rows, second along both."""
    return samples[..., ::2, ::2], samples[..., ::2, 1::2], samples[..., 1::2, ::2], samples[..., 1::2, 1::2]
