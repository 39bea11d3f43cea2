"""Images and fields of any size of their numbers: exact division by powers of 2, and multiplication of the results."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .arguments import Reals


def in_range(
    array: Reals, axes: tuple[int, ...] = (-2, -1), dtype: type[np.floating] | None = None
) -> tuple[Reals, NDArray[np.intc]]:
    """Scale images by powers of 2 if their largest numbers are so large or small that powers would leave the range.

    Parameters
    ----------
    array : array, (..., M, N)
        Finite numbers.
    axes : tuple of int
        The axes of one image.
    dtype : type, optional
        The type of the floats, if not that of `array`.

    Returns
    -------
    array, (..., M, N)
        The array itself if the fourth powers of the largest numbers are in the range of floats. Otherwise the images
        are divided exactly, to largest numbers between 1/2 and 1.
    exponents : array of int, (..., 1, 1)
        The exponents of the powers of 2; 0 for images that were not divided.
    """
    limit = np.finfo(array.dtype if dtype is None else dtype).maxexp // 5
    largest = np.maximum(array.max(axes, keepdims=True), -array.min(axes, keepdims=True))
    exponents = np.frexp(largest)[1]
    exponents = np.where(np.abs(exponents) > limit, exponents, 0).astype(np.intc)
    return (np.ldexp(array, -exponents) if exponents.any() else array), exponents


def back_in_range(array: Reals, exponents: NDArray[np.intc], name: str = "image") -> Reals:
    """Multiply results computed from images of `in_range` by the powers of 2.

    Raises
    ------
    ValueError
        If a result overflows.
    """
    if not exponents.any():
        return array
    with np.errstate(over="ignore", under="ignore"):
        result = np.ldexp(array, exponents)
    if not np.isfinite(result).all():
        raise ValueError(f"{name}: so large that results overflow; expected numbers below a tenth of the largest float")
    return result
