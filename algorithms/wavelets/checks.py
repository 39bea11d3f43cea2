"""Arguments that several wavelets share, checked once."""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import ArrayLike

from ..arguments import Reals, finite_number, real_array
from .discrete import check_finite


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
    values : array, (P, ...)
    places : array, (P, 3)
    moves : array, (K, 16)
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
    points: tuple[str, ArrayLike, str],
    versors: ArrayLike,
    frequency: float,
    sigma: float,
    weights: ArrayLike,
) -> Samples:
    """What conformal wavelets take, checked.

    Parameters
    ----------
    field : (name, array_like, shape, meaning)
        As in `real_array`.
    points : (name, array_like, meaning)
    versors, frequency, sigma, weights
        As in `conformal_wavelet`.

    Raises
    ------
    TypeError, ValueError
        Where arguments are not finite real numbers of these shapes, and frequency or sigma are not positive.
    """
    name, value, shape, meaning = field
    where, points_value, points_meaning = points
    values = real_array(value, name, shape, meaning)
    places = real_array(points_value, where, (-1, 3), points_meaning)
    moves = real_array(versors, "versors", (16,), "even elements of G(4,1)").reshape(-1, 16)
    shares = real_array(weights, "weights")
    if values.ndim != len(shape) or places.shape != (len(values), 3):
        raise ValueError(f"{where}: shape {places.shape}; expected ({len(values)}, 3), one for each of {name}")
    if shares.shape not in ((), (len(values),)):
        raise ValueError(f"weights: shape {shares.shape}; expected one number, or one for each of {where}")
    for what, array in ((name, values), (where, places), ("versors", moves), ("weights", shares)):
        check_finite(array, what)
    return Samples(
        values, places, moves, shares, positive_number(frequency, "frequency"), positive_number(sigma, "sigma")
    )
