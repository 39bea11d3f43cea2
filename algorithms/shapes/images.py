"""Validation of images, volumes, seeds and spacings."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, as_given, finite, real_array
from ..scaling import in_range

Mask = NDArray[np.bool_]
LARGEST = 400_000_000
"""Voxels of the largest volume that is accepted: some 10 GB of working memory."""


def checked_image(image: ArrayLike, name: str, dimensions: tuple[int, ...], least: int = 1) -> NDArray[Any]:
    """Return an image or a volume for results that do not depend on the unit of its values, as `image_in_range`."""
    return image_in_range(image, name, dimensions, least)[0]


def image_in_range(
    image: ArrayLike, name: str, dimensions: tuple[int, ...], least: int = 1
) -> tuple[NDArray[Any], int]:
    """Return an image or a volume as bool or float32, and the exponent of the power of 2 by which it was divided.

    The exponent is 0 unless the largest number is so large or small that powers would leave the range of float32.

    Raises
    ------
    TypeError
        If the values are not real numbers.
    ValueError
        If it is too large, has another number of axes, fewer than `least` elements along one, or values that are not
        finite.
    """
    array = as_given(image, name)
    if array.ndim not in dimensions:
        expected = " or ".join(str(d) for d in dimensions)
        raise ValueError(f"{name}: shape {array.shape}; expected {expected} axes; select a channel or a slice first")
    if array.size == 0:
        raise ValueError(f"{name}: shape {array.shape} has no elements; expected an image")
    if min(array.shape) < least:
        raise ValueError(f"{name}: shape {array.shape}; expected at least {least} elements along each axis")
    if array.size > LARGEST:
        raise ValueError(
            f"{name}: shape {array.shape}, {array.size:,} elements; expected at most {LARGEST:,}; crop or downsample it"
        )
    if array.dtype == np.bool_:
        return array, 0
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: dtype {array.dtype}; expected booleans or real numbers")
    floats = finite(array if array.dtype.itemsize >= 4 and array.dtype.kind == "f" else array.astype(np.float32), name)
    divided, exponents = in_range(floats, tuple(range(array.ndim)), np.float32)
    return divided.astype(np.float32), int(exponents.item())


def checked_spacing(spacing: ArrayLike, axes: int) -> Reals:
    """Return the distances of samples along the axes.

    Raises
    ------
    ValueError
        If their number is not that of the axes, or one is not positive.
    """
    numbers = real_array(spacing, "spacing", (-1,)).astype(float)
    numbers = numbers[:axes] if axes == 2 and numbers.shape == (3,) and (numbers == 1).all() else numbers
    if numbers.shape != (axes,) or not (np.isfinite(numbers) & (numbers > 0)).all():
        raise ValueError(f"spacing: {numbers.tolist()}; expected {axes} positive numbers, one for each axis")
    return numbers


def checked_seeds(seed: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.intp]:
    """Return seeds as rows of indices.

    Raises
    ------
    TypeError
        If they are not integers.
    ValueError
        If a seed is outside of the volume.
    """
    array = as_given(seed, "seed")
    if array.dtype.kind not in "iu":
        raise TypeError(f"seed: dtype {array.dtype}; expected indices, integers")
    rows = np.atleast_2d(array).astype(np.intp)
    if rows.ndim != 2 or not len(rows) or rows.shape[1] != len(shape):
        raise ValueError(f"seed: shape {array.shape}; expected {len(shape)} indices, or rows of them")
    outside = (rows < 0) | (rows >= np.array(shape))
    if outside.any():
        raise ValueError(
            f"seed: {rows[outside.any(1)][0].tolist()} is outside of the volume; expected indices from 0, below {shape}"
        )
    return rows
