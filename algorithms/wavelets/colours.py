"""Conversion between colour images and pure quaternions, and detection of channels in images that must not have any."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, finite_number, real_array

GREY = (3**-0.5, 3**-0.5, 3**-0.5)
"""The grey axis, for `qft` of colour images."""
_CHANNELS = {1: "one channel", 2: "grey and alpha", 3: "RGB", 4: "RGBA"}
"""Meaning of a last axis of this length in pictures."""
_ONE_BY_ONE = "Stacks of images of 1 to 4 columns are taken one image at a time"
_SCALAR = 1e-4
"""Largest scalar part of pure quaternions relative to their largest number: a bound for rounding errors of float32."""


def from_rgb(image: ArrayLike) -> Reals:
    """Convert colour images to pure quaternions ``R i + G j + B k``, for `qft`.

    Parameters
    ----------
    image : array_like, (..., M, N, 3)
        Red, green and blue. float32 is kept; integers are converted to float64 without scaling: bytes give 0 to 255.

    Returns
    -------
    array, (..., M, N, 4)
        Quaternions (0, R, G, B).

    Raises
    ------
    TypeError, ValueError
        If `image` is not an array of real numbers with three channels. Images with alpha are rejected because alpha is
        not a colour: pass ``image[..., :3]``, or blend with a background first.

    Notes
    -----
    With the grey axis ``(1, 1, 1) / sqrt(3)``, the left and right transforms keep luminance and chrominance separate
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
    """Convert pure quaternions to colours: the inverse of `from_rgb`.

    Parameters
    ----------
    q : array_like, (..., M, N, 4)
        Quaternions (w, x, y, z).
    tolerance : float
        Largest w allowed, relative to the largest number of `q`. With ``numpy.inf``, w is dropped in any case.

    Returns
    -------
    array, (..., M, N, 3)
        x, y and z as red, green and blue; not clipped to any range.

    Raises
    ------
    TypeError, ValueError
        If `q` is not an array of real numbers of this shape, or if its scalar part is not negligible.
    """
    array = real_array(q, "q", (-1, -1, 4), "quaternions M N 4")
    bound = np.inf if tolerance == np.inf else finite_number(tolerance, "tolerance")
    if array.size and bound < np.inf:
        scalar, largest = np.abs(array[..., 0]).max(), np.abs(array).max()
        if not scalar <= bound * largest:
            raise ValueError(
                f"q: scalar parts up to {scalar:.3g} with numbers up to {largest:.3g}; expected pure quaternions; "
                "tolerance=numpy.inf drops scalar parts"
            )
    return np.ascontiguousarray(array[..., 1:])


def refuse_channels(shape: tuple[int, ...], name: str, choice: str = _ONE_BY_ONE) -> None:
    """Reject shapes (..., M, N) whose last axis may hold channels instead of columns.

    The shape alone does not decide. A shape is rejected if its last axis has length 1 to 4 and the two axes before it
    are longer and at least 4: pictures with channels have such shapes, and stacks of images very rarely do.

    Parameters
    ----------
    shape : tuple of int
    name : str
        Name of the argument in error messages.
    choice : str, optional
        Sentence that explains how to pass images of 1 to 4 columns nevertheless.

    Raises
    ------
    ValueError
        If the shape is rejected.
    """
    if len(shape) > 2 and shape[-1] in _CHANNELS and min(shape[-3:-1]) > max(shape[-1], 3):
        raise ValueError(
            f"{name}: shape {shape}; expected images M N, but the last axis looks like {_CHANNELS[shape[-1]]}: take "
            "grey values, or numpy.moveaxis(image, -1, 0) for each channel as an image; from_rgb makes quaternions of "
            f"colours, for qft. {choice}"
        )


def quaternions_meant(array: Reals, dtype: np.dtype[Any], values: str | None) -> bool:
    """Return whether an image that was passed with this data type holds quaternions instead of real numbers."""
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
