"""Validation of images, volumes, seeds and spacings."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, as_given, finite, real_array

Mask = NDArray[np.bool_]
LARGEST = 400_000_000
"""Voxels of the largest volume that is accepted: some 10 GB of working memory."""


def checked_image(image: ArrayLike, name: str, dimensions: tuple[int, ...]) -> NDArray[Any]:
    """Return an image or a volume as bool or float32.

    Raises
    ------
    TypeError
        If the values are not real numbers.
    ValueError
        If it is empty or too large, has another number of axes, or values that are not finite.
    """
    array = as_given(image, name)
    if array.ndim not in dimensions:
        expected = " or ".join(str(d) for d in dimensions)
        raise ValueError(f"{name}: shape {array.shape}; expected {expected} axes; select a channel or a slice first")
    if array.size == 0:
        raise ValueError(f"{name}: shape {array.shape} has no elements; expected an image")
    if array.size > LARGEST:
        raise ValueError(
            f"{name}: shape {array.shape}, {array.size:,} elements; expected at most {LARGEST:,}; crop or downsample it"
        )
    if array.dtype == np.bool_:
        return array
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: dtype {array.dtype}; expected booleans or real numbers")
    return finite(array.astype(np.float32), name)


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
        raise ValueError(f"seed: {rows[outside.any(1)][0].tolist()} is outside of the volume with shape {shape}")
    return rows
