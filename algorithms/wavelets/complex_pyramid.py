"""The complex wavelet transform of Magarey and Kingsbury: short filters close to Gabor filters, six directions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import quaternion

from ..arguments import Reals
from .pyramid import QuaternionPyramid
from .sharing import Progress

Complexes = NDArray[Any]

_PAIRS = {"H": (0, 5), "V": (2, 3), "D": (1, 4)}
"""Indices of the two complex bands of a quaternion among the six, as in `dual_tree`."""


@dataclass(frozen=True)
class ComplexPyramid:
    """Result of `complex_pyramid`.

    Attributes
    ----------
    approx : array, (..., m, n, 2)
        The approximation after all levels, for waves along rising and along falling diagonals.
    detail : tuple of array
        ``detail[l]``, (..., m, n, 6), finest first: bands for edges at 15, 45, 75, 105, 135 and 165 degrees.
    size : (int, int)
        M and N, before padding to multiples of ``2**levels``.
    """

    approx: Complexes
    detail: tuple[Complexes, ...]
    size: tuple[int, int]

    def inverse(self) -> Reals:
        """Return the images whose coefficients are the nearest to these coefficients, (..., M, N), to 1e-9.

        The filters have no finite inverse; the equations are solved by conjugate gradients, see
        `QuaternionPyramid.inverse`.
        """
        start = QuaternionPyramid(np.zeros(self.size), 0, "gabor")
        start.approx = _quaternions(self.approx)
        start.detail = tuple(
            {name: _quaternions(level[..., pair]) for name, pair in _PAIRS.items()} for level in self.detail
        )
        return start.inverse()


def complex_pyramid(image: ArrayLike, levels: int = 4, progress: Progress | None = None) -> ComplexPyramid:
    """Compute the complex discrete wavelet transform of images with filters of four taps.

    Parameters
    ----------
    image : array_like, (..., M, N)
        Real images of any size; if a size is not a multiple of ``2**levels``, the last row or column is repeated. The
        image is extended periodically.
    levels : int
        Number of levels; ``2**levels`` must not exceed the smaller size.
    progress : function of (done, total), optional
        Called after each level.

    Returns
    -------
    ComplexPyramid

    Raises
    ------
    TypeError, ValueError
        If `image` is not an array of finite real numbers with two axes, or if there are too many levels.

    Notes
    -----
    Magarey and Kingsbury, *IEEE Trans. Signal Processing* 46:1069, 1998. The bands are the two planes of
    ``QuaternionPyramid(image, levels, "gabor")``: with the filter r along x and c along y, one band is that of r and c,
    the other that of r and the conjugate of c.
    """
    pyramid = QuaternionPyramid(image, levels, "gabor", progress=progress)
    detail = []
    for level in pyramid.detail:
        bands = {name: _planes(band) for name, band in level.items()}
        numbers = np.empty((*bands["H"].shape[:-1], 6), bands["H"].dtype)
        for name, pair in _PAIRS.items():
            numbers[..., pair] = bands[name]
        detail.append(numbers)
    return ComplexPyramid(_planes(pyramid.approx), tuple(detail), pyramid.size)


def _planes(q: Reals) -> Complexes:
    numbers = np.result_type(q.dtype, np.complex64)
    return np.stack([np.ascontiguousarray(part).view(numbers)[..., 0] for part in quaternion.pack_two_sided(q)], -1)


def _quaternions(planes: Complexes) -> Reals:
    parts = (np.ascontiguousarray(planes[..., k])[..., None].view(planes.real.dtype) for k in range(2))
    result: Reals = quaternion.unpack_two_sided(*parts)
    return result
