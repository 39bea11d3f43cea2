"""Colour images as pure quaternions, and the colours that images of one number per pixel do not have."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, finite_number, real_array

GREY = (3**-0.5, 3**-0.5, 3**-0.5)
"""The axis of grey, for `qft` of colours."""
_CHANNELS = {1: "one channel", 2: "grey and alpha", 3: "RGB", 4: "RGBA"}
"""What the last axis of pictures means where it is this short."""
_ONE_BY_ONE = "Stacks of images of 1 to 4 columns are taken one image at a time"
_SCALAR = 1e-4
"""Largest scalar part of pure quaternions, relative to their largest number: what rounding of float32 may leave."""


def from_rgb(image: ArrayLike) -> Reals:
    """Colour images as pure quaternions ``R i + G j + B k``, for `qft`.

    Parameters
    ----------
    image : array_like, (..., M, N, 3)
        Red, green and blue. float32 is kept; integers become float64, and are not scaled: bytes give numbers up to 255.

    Returns
    -------
    array, (..., M, N, 4)
        Quaternions (0, R, G, B).

    Raises
    ------
    TypeError, ValueError
        Where `image` is not an array of real numbers with three channels; images with alpha are refused, as alpha is
        no colour: take ``image[..., :3]``, or blend with a background first.

    Notes
    -----
    With the axis ``(1, 1, 1) / sqrt(3)`` of grey, the left and right transforms keep luminance and chrominance apart
    (Ell and Sangwine, *IEEE Trans. Image Processing* 16:22, 2007).
    """
    array = real_array(image, "image")
    if array.ndim < 3 or array.shape[-1] != 3:
        hint = "; leave alpha out: image[..., :3]" if array.ndim > 2 and array.shape[-1] == 4 else ""
        raise ValueError(f"image: shape {array.shape}; expected (..., any, any, 3), RGB images M N 3{hint}")
    result = np.zeros((*array.shape[:-1], 4), array.dtype)
    result[..., 1:] = array
    return result


def to_rgb(q: ArrayLike, tolerance: float = _SCALAR) -> Reals:
    """The colours of pure quaternions: the inverse of `from_rgb`.

    Parameters
    ----------
    q : array_like, (..., M, N, 4)
        Quaternions (w, x, y, z).
    tolerance : float
        How large w may be, relative to the largest number of `q`. ``numpy.inf`` drops it, whatever it is.

    Returns
    -------
    array, (..., M, N, 3)
        x, y and z as red, green and blue; not clipped to any range.

    Raises
    ------
    TypeError, ValueError
        Where `q` is not an array of real numbers of that shape, or has a scalar part: then it is no colour image.
    """
    array = real_array(q, "q", (-1, -1, 4), "quaternions M N 4")
    bound = np.inf if tolerance == np.inf else finite_number(tolerance, "tolerance")
    if array.size and bound < np.inf:
        scalar, largest = np.abs(array[..., 0]).max(), np.abs(array).max()
        if not scalar <= bound * largest:
            raise ValueError(
                f"q: scalar parts up to {scalar:.3g} beside numbers up to {largest:.3g}; expected pure quaternions; "
                "tolerance=numpy.inf drops scalar parts"
            )
    return np.ascontiguousarray(array[..., 1:])


def refuse_channels(shape: tuple[int, ...], name: str, choice: str = _ONE_BY_ONE) -> None:
    """Refuse shapes (..., M, N) of which the last axis may be that of channels rather than of columns.

    A shape does not say which it is. What is refused has a last axis of 1 to 4, after two axes that are longer, and at
    least 4: pictures with channels have that shape, and stacks of images hardly ever.

    Parameters
    ----------
    shape : tuple of int
    name : str
        What the caller calls the argument.
    choice : str, optional
        How a function takes images of 1 to 4 columns all the same.

    Raises
    ------
    ValueError
        For such a shape.
    """
    if len(shape) > 2 and shape[-1] in _CHANNELS and min(shape[-3:-1]) > max(shape[-1], 3):
        raise ValueError(
            f"{name}: shape {shape}; expected images M N, but the last axis looks like {_CHANNELS[shape[-1]]}: take "
            "grey values, or numpy.moveaxis(image, -1, 0) for each channel as an image; from_rgb makes quaternions of "
            f"colours, for qft. {choice}"
        )


def quaternions_meant(array: Reals, dtype: np.dtype[Any], values: str | None) -> bool:
    """Whether an image, which came with this type, is one of quaternions rather than real."""
    if values is not None:
        if values not in ("real", "quaternion"):
            raise ValueError(f"values: {values!r}; expected 'real', 'quaternion' or None")
        if values == "quaternion":
            real_array(array, "image", (-1, -1, 4), "quaternions M N 4")
        return values == "quaternion"
    four = array.ndim > 2 and array.shape[-1] == 4
    if not four or (dtype.kind == "u" and dtype.itemsize <= 2):
        refuse_channels(array.shape, "image", "values='real' takes stacks of images of so few columns")
    return four
