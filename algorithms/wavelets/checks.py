"""Validation of arguments that several functions share: images, their range, and samples of conformal wavelets."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, positive_number, real_array
from ..scaling import in_range
from .colours import refuse_channels
from .discrete import check_finite

TRUNCATE = 4.0
"""Standard deviations at which Gaussians are truncated, as in `scipy.ndimage`: there they are 3e-4 of their maximum."""
MEDIAN = 0.6744897501960817
"""From a probability: the median of the absolute value of a standard normal variable."""


def image_stack(value: ArrayLike, name: str = "image", least: int = 1) -> Reals:
    """Return real images (..., M, N) after validation.

    Parameters
    ----------
    value : array_like, (..., M, N)
        Leading axes are those of a stack; pictures with channels are rejected, see `refuse_channels`.
    name : str
        Name of the argument in error messages.
    least : int
        Minimum number of rows and columns.

    Returns
    -------
    array, (..., M, N)
        float32 or float64.

    Raises
    ------
    TypeError, ValueError
        If `value` is not an array of finite real numbers with two axes, has channels, or is too small.
    """
    array = real_array(value, name, (-1, -1), "images M N")
    refuse_channels(array.shape, name)
    check_finite(array, name)
    if min(array.shape[-2:]) < least:
        raise ValueError(f"{name}: shape {array.shape}; expected images of at least {least} x {least} pixels")
    return array


def single_image(value: ArrayLike, name: str = "image", least: int = 1) -> Reals:
    """Return one real image (M, N) after validation as in `image_stack`; stacks are rejected."""
    array = real_array(value, name, (-1, -1), "one image M N")
    refuse_channels(array.shape, name)
    if array.ndim != 2 or min(array.shape) < least:
        raise ValueError(f"{name}: shape {array.shape}; expected one image of at least {least} x {least} pixels")
    check_finite(array, name)
    return array


def image_pair(
    first: ArrayLike, second: ArrayLike, names: tuple[str, str]
) -> tuple[tuple[Reals, Reals], np.dtype[np.floating[Any]]]:
    """Return two images of the same size after validation, in the range of float32, and the type of results."""
    pair = [single_image(image, name) for image, name in zip((first, second), names, strict=True)]
    if pair[0].shape != pair[1].shape:
        raise ValueError(f"{names[1]}: shape {pair[1].shape}; expected that of the other image, {pair[0].shape}")
    # What is compared depends on relative size, so both images are divided by the same number.
    one, two = in_range(np.stack(pair), (0, 1, 2), np.float32)[0]
    return (one, two), np.result_type(*pair)


def places_of(moved: Reals, number: int) -> tuple[Reals, Reals]:
    """Return the places (P, n) and the weights (P,) of null vectors (P, n + 2), which a versor has moved.

    Raises
    ------
    ValueError
        If a point is at infinity, or the versor has no size. `number` is that of the versor.
    """
    weight = moved[:, -2]
    if not np.abs(weight).min(initial=1.0) > 0:
        raise ValueError(f"versors: number {number} takes a point of the field to infinity; expected finite points")
    return moved[:, :-2] / weight[:, None], weight


class Samples(NamedTuple):
    """A sampled field and the wavelets with which it is compared.

    Attributes
    ----------
    values : array, (P, ...), or (K, ...)
    places : array, (P, n)
    moves : array, (K, 2**(n + 1))
    weights : array, (P,) or ()
    frequency, sigma : float
    """

    values: Reals
    places: Reals
    moves: Reals
    weights: Reals
    frequency: float
    sigma: float


def samples(
    field: tuple[str, ArrayLike, tuple[int, ...], str],
    points: tuple[str, ArrayLike, int, str],
    versors: tuple[str, ArrayLike, int, str],
    frequency: float,
    sigma: float,
    weights: ArrayLike,
    per_versor: bool = False,
) -> Samples:
    """Validate the arguments of conformal wavelets.

    Parameters
    ----------
    field : (name, array_like, shape, meaning)
        As in `real_array`.
    points, versors : (name, array_like, length, meaning)
        As in `real_array`, with the length of the last axis.
    frequency, sigma, weights
        As in `conformal_wavelet`.
    per_versor : bool
        Whether there is one value for each versor instead of one for each point.

    Raises
    ------
    TypeError, ValueError
        If arguments are not finite real numbers of these shapes, or if `frequency` or `sigma` is not positive.
    """
    name, value, shape, meaning = field
    where, points_value, dimension, points_meaning = points
    versors_name, versors_value, size, versors_meaning = versors
    values = real_array(value, name, shape, meaning)
    places = real_array(points_value, where, (-1, dimension), points_meaning)
    moves = real_array(versors_value, versors_name, (size,), versors_meaning).reshape(-1, size)
    shares = real_array(weights, "weights")
    if per_versor:
        if values.ndim != len(shape) or len(values) != len(moves) or places.ndim != 2:
            raise ValueError(f"{name}: shape {values.shape}; expected one for each of {len(moves)} {versors_name}")
    elif values.ndim != len(shape) or places.shape != (len(values), dimension):
        raise ValueError(
            f"{where}: shape {places.shape}; expected ({len(values)}, {dimension}), one for each of {name}"
        )
    if shares.shape not in ((), (len(places),)):
        raise ValueError(f"weights: shape {shares.shape}; expected one number, or one for each of {where}")
    for what, array in ((name, values), (where, places), (versors_name, moves), ("weights", shares)):
        check_finite(array, what)
    return Samples(
        values, places, moves, shares, positive_number(frequency, "frequency"), positive_number(sigma, "sigma")
    )
