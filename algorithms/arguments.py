"""Validation of arguments: shapes and types. Error messages name the argument."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated.gac_runtime.arrays import entries_of, masked_in

Reals = NDArray[Any]
"""An array of float32 or float64."""

_FLOAT32, _FLOAT64 = np.dtype(np.float32), np.dtype(np.float64)
_FLOATS = (_FLOAT64, _FLOAT32)
_LARGE = 1e60
"""From floating point: fifth powers of larger coordinates overflow."""
_VECTORS = {"VGA2.VECTOR", "VGA3.VECTOR"}
_COORDINATES = (
    (
        re.compile(r".*\b(points?|places?|pixels?|vertices|corners|starts and ends|x,? y(,? z)?)\b"),
        {"PGA2.POINT", "PGA3.POINT", "CGA2.POINT", "CGA3.POINT", *_VECTORS},
    ),
    (
        re.compile(r"(a |unit |wave |two |three )*(vectors?|directions?|velocities|electric fields)( as rows)?$"),
        {"PGA2.DIRECTION", "PGA3.DIRECTION", *_VECTORS},
    ),
    (re.compile(r"(a |one |unit )*motors?\b"), {"PGA2.MOTOR", "PGA3.MOTOR", "CGA3.MOTOR"}),
    (
        re.compile(r"(a |unit )*rotors?\b"),
        {f"{algebra}{n}.ROTOR" for algebra in ("VGA", "PGA", "CGA") for n in (2, 3)},
    ),
)
"""Meanings of arguments, and the layouts whose coefficients are the coordinates of what is meant."""


def real_array(value: ArrayLike, name: str, shape: tuple[int, ...] = (), meaning: str = "") -> Reals:
    """Convert `value` to an array of floats and check the shape of its last axes.

    Parameters
    ----------
    value : array_like, (..., *shape)
        Real numbers. float32 is kept; integers and booleans, which are exact, are converted to float64. Masked arrays
        are accepted if no element is masked. Points are accepted as their coordinates if points are meant, directions
        if vectors are meant, and vectors of VGA2 and VGA3 in both cases; motors and rotors as their coefficients.
    name : str
        The name of the argument, for error messages.
    shape : tuple of int
        The expected last axes; -1 matches any length.
    meaning : str, optional
        The meaning of the last axes, for error messages.

    Returns
    -------
    array, (..., *shape)
        float32 or float64, in native byte order. Not a copy where that is possible.

    Raises
    ------
    TypeError
        If the values are not real numbers, or other multivectors: their coefficients depend on the layout.
    ValueError
        If the shape differs, or elements are masked.
    """
    if type(value) is np.ndarray and value.dtype in _FLOATS and _has_shape(value, shape):  # what most calls pass
        return value
    value = unmasked(coordinates(value, name, shape, meaning), name)
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name}: not an array of numbers ({error}); expected {_shape_text(shape, meaning)}") from None
    if array.dtype.kind not in "fiub":
        raise TypeError(f"{name}: dtype {array.dtype}; expected real numbers, float32 or float64")
    if not _has_shape(array, shape):
        raise ValueError(f"{name}: shape {array.shape}; expected {_shape_text(shape, meaning)}")
    return array.astype(_FLOAT32 if array.dtype.kind == "f" and array.dtype.itemsize == 4 else _FLOAT64, copy=False)


def as_given(value: Any, name: str) -> NDArray[Any]:
    """Convert `value` to an array of its own type, for labels, indices, flags and complex numbers.

    Raises
    ------
    TypeError
        If it is a multivector, or a list with one.
    ValueError
        If it is a masked array with masked elements, or a list with such arrays.
    """
    return np.asarray(unmasked(coordinates(value, name), name))


def unmasked(value: Any, name: str) -> Any:
    """Return `value` if it has no masked numbers, which numpy would convert to what is behind the mask.

    Raises
    ------
    ValueError
        If it is a masked array with masked elements, or a list with such arrays.
    """
    found = masked_in(name, value)
    if found:
        raise ValueError(
            f"{found[0]}: {found[1]} masked numbers; expected an array without a mask; fill them with numpy.ma.filled, "
            "or remove them"
        )
    return value


def _has_shape(array: Reals, shape: tuple[int, ...]) -> bool:
    """Return whether the last axes of an array have the given lengths, of which -1 matches any."""
    if shape == (-1,):
        return array.ndim > 0
    found = array.shape[max(array.ndim - len(shape), 0) :]
    if found == shape:  # the usual case, without a loop
        return True
    return len(found) == len(shape) and all(want in (-1, have) for want, have in zip(shape, found, strict=True))


def coordinates(value: Any, name: str, shape: tuple[int, ...] = (), meaning: str = "") -> Any:
    """Return elements as coordinates, also in lists and arrays of them, and all else unchanged.

    The arguments are those of `real_array`.

    Raises
    ------
    TypeError
        If the value is or has an element of another kind than what is meant.
    """
    value, is_list = entries_of(value)
    if is_list:
        return [coordinates(each, f"{name}[{k}]", shape, meaning) for k, each in enumerate(value)]
    stored = getattr(value, "stored", None)
    if stored is None:
        return value
    values, own = stored
    meant = next((names for words, names in _COORDINATES if words.match(meaning)), ())
    if own.name not in meant or not shape or shape[-1] not in (-1, len(own.blades)):
        raise TypeError(f"{name} is {own.name}; expected {_shape_text(shape, meaning)}")
    return values


def finite(array: Reals, name: str) -> Reals:
    """Return `array` if all of its elements are finite.

    Raises
    ------
    ValueError
        If an element is infinite or NaN. The message gives the index of the first one.
    """
    if not np.isfinite(array).all():
        at = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"{name}: {array[at]} at {at}; expected finite numbers")
    return array


def moderate(points: Reals, name: str) -> Reals:
    """Return finite points if powers of their distances neither overflow nor underflow.

    Raises
    ------
    ValueError
        If coordinates exceed 1e60, or points that differ are less than 1e-60 apart along every axis.
    """
    if points.size:
        largest, extent = float(np.abs(points).max()), float(np.ptp(points, axis=0).max())
        if largest > _LARGE or 0 < extent < 1 / _LARGE:
            raise ValueError(
                f"{name}: coordinates up to {largest:.3g} in {extent:.3g}; expected a unit in which coordinates are "
                f"at most {_LARGE:g} and extents at least {1 / _LARGE:g}"
            )
    return points


def finite_number(value: object, name: str) -> float:
    """Convert `value` to a finite float.

    Raises
    ------
    TypeError
        If it is not a real number.
    ValueError
        If it is infinite or NaN.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise TypeError(f"{name}: {value!r}; expected a number")
    number = float(value)
    if not np.isfinite(number):
        raise ValueError(f"{name}: {number}; expected a finite number")
    return number


def positive_number(value: object, name: str) -> float:
    """Return `value` as a float; raise an error if it is not a positive number, as in `finite_number`."""
    number = finite_number(value, name)
    if number <= 0:
        raise ValueError(f"{name}: {number}; expected a positive number")
    return number


def check_pixels(value: object, name: str) -> None:
    """Raise an error unless `value` is None or a positive number of pixels, as in `finite_number`."""
    if value is not None and finite_number(value, name) <= 0:
        raise ValueError(f"{name}: {value}; expected more than 0 pixels, or None")


def whole_number(value: object, name: str, least: int = 0) -> int:
    """Convert `value` to an integer.

    Raises
    ------
    TypeError
        If it is not an integer.
    ValueError
        If it is below `least`.
    """
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise TypeError(f"{name}: {value!r}; expected a whole number")
    if value < least:
        raise ValueError(f"{name}: {value}; expected a whole number, {least} or more")
    return int(value)


def leading_axes(*shapes: tuple[str, tuple[int, ...]]) -> tuple[int, ...]:
    """Return the shape to which the leading axes of some arguments, given by name, broadcast.

    Raises
    ------
    ValueError
        If they do not broadcast.
    """
    try:
        return np.broadcast_shapes(*(shape for _, shape in shapes))
    except ValueError:
        names, found = (", ".join(map(str, each)) for each in zip(*shapes, strict=True))
        raise ValueError(f"{names}: leading axes {found}; expected equal ones, or ones that broadcast") from None


def listed(value: Any, name: str, of: str) -> list[Any]:
    """Return the elements of a sequence of `of`.

    Raises
    ------
    TypeError
        If `value` is not a sequence.
    """
    try:
        return list(value)
    except TypeError:
        raise TypeError(f"{name}: {type(value).__name__}; expected a sequence of {of}") from None


def _shape_text(shape: tuple[int, ...], meaning: str) -> str:
    text = ", ".join(["...", *("any" if length < 0 else str(length) for length in shape)])
    return f"({text})" + (f", {meaning}" if meaning else "")
