"""Arguments that several functions share, checked once: images, their range, and what conformal wavelets take."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, finite_number, real_array
from .colours import refuse_channels
from .discrete import check_finite


def image_stack(value: ArrayLike, name: str = "image", least: int = 1) -> Reals:
    """Real images (..., M, N), checked.

    Parameters
    ----------
    value : array_like, (..., M, N)
        Leading axes are those of a stack; pictures with channels are refused, see `refuse_channels`.
    name : str
        What the caller calls the argument.
    least : int
        Rows and columns that are needed.

    Returns
    -------
    array, (..., M, N)
        float32 or float64.

    Raises
    ------
    TypeError, ValueError
        Where `value` is not an array of finite real numbers with two axes, has channels, or is too small.
    """
    array = real_array(value, name, (-1, -1), "images M N")
    refuse_channels(array.shape, name)
    check_finite(array, name)
    if min(array.shape[-2:]) < least:
        raise ValueError(f"{name}: shape {array.shape}; expected images of at least {least} x {least} pixels")
    return array


def single_image(value: ArrayLike, name: str = "image", least: int = 1) -> Reals:
    """One real image (M, N), checked as by `image_stack`; stacks are refused."""
    array = real_array(value, name, (-1, -1), "one image M N")
    refuse_channels(array.shape, name)
    if array.ndim != 2 or min(array.shape) < least:
        raise ValueError(f"{name}: shape {array.shape}; expected one image of at least {least} x {least} pixels")
    check_finite(array, name)
    return array


def in_range(
    array: Reals, axes: tuple[int, ...] = (-2, -1), dtype: type[np.floating] | None = None
) -> tuple[Reals, NDArray[np.intc]]:
    """Images, divided by powers of 2 where their largest numbers are so large, or small, that powers leave the range.

    Parameters
    ----------
    array : array, (..., M, N)
        Finite.
    axes : tuple of int
        Of one image.
    dtype : type, optional
        Of the floats, if they are not those of `array`.

    Returns
    -------
    array, (..., M, N)
        Itself where the fourth powers of the largest numbers are in the range of floats; else exactly divided, to
        largest numbers from 1/2 to 1.
    exponents : array of int, (..., 1, 1)
        0, or those of the powers of 2.
    """
    limit = np.finfo(array.dtype if dtype is None else dtype).maxexp // 5
    largest = np.maximum(array.max(axes, keepdims=True), -array.min(axes, keepdims=True))
    exponents = np.frexp(largest)[1]
    exponents = np.where(np.abs(exponents) > limit, exponents, 0).astype(np.intc)
    return (np.ldexp(array, -exponents) if exponents.any() else array), exponents


def back_in_range(array: Reals, exponents: NDArray[np.intc], name: str = "image") -> Reals:
    """What was found from images of `in_range`, times the powers of 2.

    Raises
    ------
    ValueError
        Where that is larger than any float.
    """
    if not exponents.any():
        return array
    with np.errstate(over="ignore", under="ignore"):
        result = np.ldexp(array, exponents)
    if not np.isfinite(result).all():
        raise ValueError(f"{name}: so large that results overflow; expected numbers below a tenth of the largest float")
    return result


def positive_number(value: object, name: str) -> float:
    """`value` as a float; refused where it is not a positive number."""
    number = finite_number(value, name)
    if number <= 0:
        raise ValueError(f"{name}: {number}; expected positive numbers")
    return number


class Samples(NamedTuple):
    """A sampled field, and the wavelets that it is compared with.

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
    """What conformal wavelets take, checked.

    Parameters
    ----------
    field : (name, array_like, shape, meaning)
        As in `real_array`.
    points, versors : (name, array_like, length, meaning)
        Of the last axis.
    frequency, sigma, weights
        As in `conformal_wavelet`.
    per_versor : bool
        Whether there is one value for each versor, rather than for each point.

    Raises
    ------
    TypeError, ValueError
        Where arguments are not finite real numbers of these shapes, and frequency or sigma are not positive.
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
