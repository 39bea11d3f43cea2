"""The dual-tree complex wavelet transform of signals, images and volumes."""

from __future__ import annotations

from dataclasses import dataclass
from math import log2

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, real_array
from .colours import refuse_channels
from .discrete import check_finite, checked_axes, checked_levels
from .sharing import Progress
from .tree_levels import joined, split, trees

Complexes = NDArray[np.complexfloating]

_HALF = 0.5**0.5
"""The factor of sums and differences of both trees."""

_PLACES: dict[int, dict[str, tuple[int, ...]]] = {
    1: {"D": (0,)},
    2: {"H": (0, 5), "V": (2, 3), "D": (1, 4)},
    3: {
        word: (4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3)
        for k, word in enumerate(("ada", "daa", "dda", "aad", "add", "dad", "ddd"))
    },
}
"""Indices of the complex bands of each detail. The six of images are ordered by angle: 15, 45, ... 165 degrees."""


@dataclass(frozen=True)
class DualTree:
    """Result of `dual_tree`; shapes are those for images (..., M, N) whose sizes are multiples of ``2**L``.

    Attributes
    ----------
    approx : array, (..., M / 2**(L-1), N / 2**(L-1))
        The smoothed signal at the last of L levels; samples of both trees are interleaved along each axis.
    detail : tuple of array
        Complex, finest first. For signals, ``detail[l]`` has ``2**(l+1)`` times fewer numbers than the signal. For
        images, it is (..., M / 2**(l+1), N / 2**(l+1), 6), and the six bands respond to edges at 15, 45, 75, 105, 135
        and 165 degrees. For volumes, it has 28 bands: four for each of the words ada, daa, dda, aad, add, dad and ddd,
        where d marks the axes along which the volume is differenced.
    first, later : str
        Names of the filters.
    size : tuple of int
        The lengths of the axes.
    axes : tuple of int
        The transformed axes, counted from the end of the signal.
    """

    approx: Reals
    detail: tuple[Complexes, ...]
    first: str
    later: str
    size: tuple[int, ...]
    axes: tuple[int, ...] = (-2, -1)

    def inverse(self, workers: int | None = None, progress: Progress | None = None) -> Reals:
        """Return the reconstructed signals, exact up to rounding if no coefficient was changed.

        Parameters
        ----------
        workers : int, optional
            Number of threads, as in `scipy.fft`; the result does not depend on it.
        progress : function of (done, total), optional
            Called after each level.

        Returns
        -------
        array, of the shape of the signals
        """
        places = _PLACES[len(self.axes)]
        bands = []
        for level in self.detail:
            numbers = level if len(self.axes) > 1 else level[..., None]
            bands.append({name: _samples([numbers[..., k] for k in own], self.axes) for name, own in places.items()})
        return joined(self.approx, self.axes, bands, self.first, self.later, self.size, workers, progress)


def dual_tree(
    signal: ArrayLike,
    levels: int | None = None,
    first: str = "near_sym_a",
    later: str = "qshift_a",
    workers: int | None = None,
    progress: Progress | None = None,
    axes: tuple[int, ...] | None = None,
) -> DualTree:
    """Compute the dual-tree complex wavelet transform of signals, images or volumes.

    The transform is nearly shift invariant. With n axes it has ``2**n`` times as many numbers as the signal, and
    distinguishes 6 directions in images and 28 in volumes.

    Parameters
    ----------
    signal : array_like
        Real numbers of any shape and any size, including odd sizes. float32 is kept; integers are converted to float64.
    levels : int, optional
        Number of levels. The default, and the maximum, is the largest for which ``2**levels`` is at most the smallest
        size.
    first : str
        Filters of the first level: "near_sym_a" or "near_sym_b".
    later : str
        Filters of the other levels: "qshift_06", "qshift_a" to "qshift_d". Longer filters separate directions better.
    workers : int, optional
        Number of threads, as in `scipy.fft`; the result does not depend on it.
    progress : function of (done, total), optional
        Called after each level.
    axes : tuple of int, optional
        One to three axes. The default is the last two axes, or the only one: ``(-1,)`` transforms rows of arrays,
        ``(-3, -2, -1)`` volumes. It is required for arrays with the shape of pictures with channels.

    Returns
    -------
    DualTree

    Raises
    ------
    TypeError, ValueError
        If `signal` is not an array of finite real numbers, or if filters, axes or the number of levels are invalid.

    Notes
    -----
    Kingsbury, *Appl. Comput. Harmon. Anal.* 10:234, 2001. Signals are mirrored at their ends. Mirroring exchanges the
    two trees along an axis, so that both together form one periodic orthogonal transform: of the samples of one tree
    forward, followed by those of the other backward.

    Sizes follow the rule of the dtcwt package, with the same coefficients. The last number is repeated if a size is
    odd. Each later level halves the approximation, after repeating its first and last numbers if the size is no
    multiple of 4. `DualTree.inverse` recovers the signal to 5e-15 of the largest number.
    """
    array = real_array(signal, "signal", (-1,), "signals, images or volumes")
    chosen = checked_axes(axes, array.ndim)
    if len(chosen) not in _PLACES:
        raise ValueError(f"axes: {axes}; expected one, two or three axes")
    if axes is None:
        refuse_channels(array.shape, "signal", "axes=(0, 1) takes all channels, axes=(-2, -1) images of so few columns")
    check_finite(array, "signal")
    size = tuple(array.shape[axis] for axis in chosen)
    what = f"{size[0]} numbers" if len(size) == 1 else f"arrays of {' x '.join(map(str, size))} numbers"
    count = checked_levels(levels, int(log2(min(size))), f"as {what} have")
    approx, bands = split(array, chosen, count, first, later, workers, progress)
    detail = []
    for level in bands:
        shape = [*next(iter(level.values())).shape, sum(map(len, _PLACES[len(chosen)].values()))]
        for axis in chosen:
            shape[axis - 1] //= 2
        numbers = np.empty(shape, _complex(array))
        for name, own in _PLACES[len(chosen)].items():
            for k, band in zip(own, _bands(trees(level[name], chosen)), strict=True):
                numbers[..., k] = band
        detail.append(numbers if len(chosen) > 1 else numbers[..., 0])
    return DualTree(approx, tuple(detail), first, later, size, chosen)


def _complex(array: Reals) -> np.dtype[np.complexfloating]:
    return np.result_type(array.dtype, np.complex64)


def _bands(parts: list[Reals]) -> list[Complexes]:
    """Return the complex bands of the trees: sums and differences, as the trees are nearly Hilbert transforms."""
    if len(parts) == 2:
        return [parts[0] + 1j * parts[1]]
    half = len(parts) // 2
    pairs = list(zip(_bands(parts[:half]), _bands(parts[half:]), strict=True))
    root = parts[0].dtype.type(_HALF)
    return [np.asarray((a + sign * b) * root) for sign in (1j, -1j) for a, b in pairs]


def _trees_of(bands: list[Complexes]) -> list[Reals]:
    """Return the trees whose `_bands` are given."""
    if len(bands) == 1:
        return [bands[0].real, bands[0].imag]
    half = len(bands) // 2
    pairs = list(zip(bands[:half], bands[half:], strict=True))
    root = bands[0].real.dtype.type(_HALF)
    return _trees_of([(a + b) * root for a, b in pairs]) + _trees_of([(b - a) * (1j * root) for a, b in pairs])


def _samples(bands: list[Complexes], axes: tuple[int, ...]) -> Reals:
    """Return the interleaved samples of the trees whose `_bands` are given."""
    shape = list(bands[0].shape)
    for axis in axes:
        shape[axis] *= 2
    result = np.empty(shape, bands[0].real.dtype)
    for part, values in zip(trees(result, axes), _trees_of(bands), strict=True):
        part[...] = values
    return result
