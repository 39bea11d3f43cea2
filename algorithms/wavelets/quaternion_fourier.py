"""The quaternion Fourier transform of images, by two complex transforms between two passes of generated kernels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import ArrayLike, NDArray

from generated import quaternion

from ..arguments import Reals, real_array

Complexes = NDArray[Any]
"""An array of complex64 or complex128."""

Axis = str | Sequence[float]
"""A square root of -1: i, j, k, or the coordinates of a unit vector."""


class Side(Enum):
    """On which side of a pixel f, at (x, y) of an M x N image, the exponentials stand.

    ``TWO``: ``exp(-mu 2 pi u x / M) f exp(-nu 2 pi v y / N)``. ``LEFT``: ``exp(-mu 2 pi (u x / M + v y / N)) f``.
    ``RIGHT``: ``f exp(-nu 2 pi (u x / M + v y / N))``. mu and nu are the two axes of the transform.
    """

    TWO = "two"
    LEFT = "left"
    RIGHT = "right"


_NORMS = {None: "forward", "backward": "forward", "forward": "backward", "ortho": "ortho"}
"""scipy's norms, with the one that gives a transform with the sign of the exponent turned round the same scale."""

_NAMES = {"i": (1.0, 0.0, 0.0), "j": (0.0, 1.0, 0.0), "k": (0.0, 0.0, 1.0)}
_UNIT = 1e-9
"""How far from unit length, or from orthogonal, axes that are given by coordinates may be."""


@dataclass(frozen=True, slots=True)
class _Plan:
    """How a transform falls apart into complex ones, after a rotation of i, j and k.

    Attributes
    ----------
    turn : array, (4,), or None
        The unit quaternion that takes the axes to those of the plan: i, and j for the two-sided transform with
        orthogonal axes.
    symplectic : bool
        Whether a quaternion is taken as ``A + B j`` with complex A, B, which are there without arithmetic; else it is
        ``(A (1 + k) + B (1 - k)) / 2``.
    signs : ((bool, bool), (bool, bool))
        For A and for B, along x and along y: whether the exponent keeps the sign of the transform.
    """

    turn: NDArray[np.float64] | None
    symplectic: bool
    signs: tuple[tuple[bool, bool], tuple[bool, bool]]


def qft(
    image: ArrayLike,
    side: str = "two",
    axes: tuple[Axis, Axis] = ("i", "j"),
    norm: str | None = None,
    workers: int | None = None,
) -> Reals:
    """The quaternion Fourier transform of images.

    Parameters
    ----------
    image : array_like, (..., M, N) or (..., M, N, 4)
        Real images, or quaternions (w, x, y, z), scalar first. An array of three axes or more whose last has length 4
        is taken for quaternions. float32 gives float32; integers become float64.
    side : str
        "two", "left" or "right": where the exponentials stand, see `Side`.
    axes : (axis, axis)
        mu and nu of `Side`: "i", "j", "k", or unit vectors (x, y, z). The left transform uses the first only, the right
        one the second only; for the two-sided one they are orthogonal, equal or opposite.
    norm : str, optional
        "backward" (the default: 1 forward, 1 / (M N) inverse), "ortho" or "forward", as in `scipy.fft`.
    workers : int, optional
        As in `scipy.fft`.

    Returns
    -------
    array, (..., M, N, 4)
        Quaternions (w, x, y, z). Frequency (u, v) is at [u, v], as in `scipy.fft.fft2`.

    Raises
    ------
    TypeError, ValueError
        Where `image` is not an array of real numbers with two axes and no empty one, where it, or its transform, is
        not finite, and for an unknown side, axis or norm.

    Notes
    -----
    Every quaternion falls into two complex numbers that the exponentials multiply (Ell and Sangwine, *IEEE Trans. Image
    Processing* 16:22, 2007; Hitzer, *Adv. Appl. Clifford Algebras* 17:497, 2007), and so the transform into two complex
    ones; of a real image these two are one and the same.
    """
    array = real_array(image, "image")
    plan = _plan(side, axes, norm)
    if array.ndim < 3 or array.shape[-1] != 4:
        array = real_array(array, "image", (-1, -1), "real images M N, or quaternions M N 4")
        _check_size(array.shape, "image")
        return _checked(_of_real(array, plan, norm, workers), "image")
    _check_size(array.shape[:-1], "image")
    return _checked(_of_quaternions(array, plan, False, norm, workers), "image")


def iqft(
    spectrum: ArrayLike,
    side: str = "two",
    axes: tuple[Axis, Axis] = ("i", "j"),
    norm: str | None = None,
    workers: int | None = None,
) -> Reals:
    """The inverse of `qft` with the same options.

    Parameters
    ----------
    spectrum : array_like, (..., M, N, 4)
        Quaternions (w, x, y, z).
    side, axes, norm, workers
        As in `qft`.

    Returns
    -------
    array, (..., M, N, 4)
        Quaternions (w, x, y, z); of the spectrum of a real image, only w is not 0 (to rounding).

    Raises
    ------
    TypeError, ValueError
        As in `qft`.
    """
    array = real_array(spectrum, "spectrum", (-1, -1, 4), "quaternions M N 4")
    _check_size(array.shape[:-1], "spectrum")
    return _checked(_of_quaternions(array, _plan(side, axes, norm), True, norm, workers), "spectrum")


def _of_quaternions(array: Reals, plan: _Plan, inverse: bool, norm: str | None, workers: int | None) -> Reals:
    field = array
    if plan.turn is not None:
        field = array.copy()
        quaternion.rotate_vector(plan.turn.astype(field.dtype), array[..., 1:], out=field[..., 1:])
    if plan.symplectic:
        pairs = _as_complex(np.array(field, order="C"))
        for k, signs in enumerate(plan.signs):
            pairs[..., k] = _transform(pairs[..., k], signs, inverse, norm, workers)
        result = pairs.view(field.dtype)
    else:
        parts = quaternion.pack_two_sided(field)
        plus, minus = (
            _transform(_as_complex(part)[..., 0], signs, inverse, norm, workers)
            for part, signs in zip(parts, plan.signs, strict=True)
        )
        result = quaternion.unpack_two_sided(_as_real(plus), _as_real(minus))
    return _turned_back(result, plan)


def _of_real(image: Reals, plan: _Plan, norm: str | None, workers: int | None) -> Reals:
    """Of a real image, A and B have the same transform (B none, where they are symplectic), but for signs of v."""
    complex_type = np.result_type(image.dtype, np.complex64)
    result = np.zeros((*image.shape, 4), image.dtype)
    spectrum = np.asarray(scipy.fft.fft2(image, norm=norm, workers=workers), complex_type)
    if plan.symplectic:
        _as_complex(result)[..., 0] = spectrum if plan.signs[0][1] else _reversed_last(spectrum)
    else:
        quaternion.unpack_two_sided(_as_real(_reversed_last(spectrum)), _as_real(spectrum), out=result)
    return _turned_back(result, plan)


def _turned_back(field: Reals, plan: _Plan) -> Reals:
    if plan.turn is not None:
        quaternion.rotate_vector_back(plan.turn.astype(field.dtype), field[..., 1:], out=field[..., 1:])
    return field


def _transform(
    part: Complexes, signs: tuple[bool, bool], inverse: bool, norm: str | None, workers: int | None
) -> Complexes:
    """The complex transform over the last two axes, each with its own sign of the exponent."""
    forward = (signs[0] is not inverse, signs[1] is not inverse)
    if forward[0] is forward[1]:
        both = scipy.fft.fft2 if forward[0] else scipy.fft.ifft2
        return np.asarray(both(part, norm=_norm(norm, forward[0], inverse), overwrite_x=True, workers=workers))
    for axis, keeps in zip((-2, -1), forward, strict=True):
        one = scipy.fft.fft if keeps else scipy.fft.ifft
        part = one(part, axis=axis, norm=_norm(norm, keeps, inverse), overwrite_x=True, workers=workers)
    return part


def _norm(norm: str | None, forward: bool, inverse: bool) -> str | None:
    """The norm for scipy's forward or inverse function, so that its scale is that of the transform as a whole."""
    return norm if forward is not inverse else _NORMS[norm]


def _plan(side: str, axes: tuple[Axis, Axis], norm: str | None) -> _Plan:
    try:
        where = Side(side)
    except ValueError:
        raise ValueError(f"side: {side!r}; expected {', '.join(repr(one.value) for one in Side)}") from None
    if norm not in _NORMS:
        raise ValueError(f"norm: {norm!r}; expected None, 'backward', 'ortho' or 'forward'")
    if isinstance(axes, str) or not isinstance(axes, Sequence) or len(axes) != 2:
        raise ValueError(f"axes: {axes!r}; expected a pair such as ('i', 'j')")
    mu, nu = (_axis(axis) for axis in axes)
    same, turned = (True, True), (True, False)
    if where is Side.LEFT:
        return _Plan(_turn(mu, None), True, (same, same))
    if where is Side.RIGHT:
        # B j exp(-i s) = B exp(i s) j
        return _Plan(_turn(nu, None), True, (same, (False, False)))
    cosine = float(mu @ nu)
    if abs(cosine) < _UNIT:
        return _Plan(_turn(mu, nu), False, (turned, same))
    if cosine > 1 - _UNIT:
        return _Plan(_turn(mu, None), True, (same, turned))
    if cosine < _UNIT - 1:
        return _Plan(_turn(mu, None), True, (turned, same))
    raise ValueError(
        f"axes: {axes!r} are {np.degrees(np.arccos(cosine)):.6g} degrees apart; "
        "expected orthogonal, equal or opposite axes for the two-sided transform"
    )


def _axis(axis: Axis) -> NDArray[np.float64]:
    if isinstance(axis, str):
        if axis not in _NAMES:
            raise ValueError(f"axes: {axis!r}; expected 'i', 'j', 'k' or a unit vector (x, y, z)")
        return np.array(_NAMES[axis])
    vector = np.array(real_array(axis, "axes", (3,), "a unit vector"), np.float64)
    if vector.ndim != 1 or not abs(np.linalg.norm(vector) - 1) < _UNIT:
        raise ValueError(f"axes: {axis!r}; expected 'i', 'j', 'k' or a unit vector (x, y, z)")
    return vector


def _turn(mu: NDArray[np.float64], nu: NDArray[np.float64] | None) -> NDArray[np.float64] | None:
    """The rotation that takes mu to i and, if given, nu to j; None where it is none."""
    if nu is None:
        nu = np.roll(mu, 1) if np.abs(mu).max() == 1 else np.cross(mu, np.eye(3)[np.abs(mu).argmin()])
        nu = nu / np.linalg.norm(nu)
    matrix = np.stack([mu, nu, np.cross(mu, nu)])
    return None if np.array_equal(matrix, np.eye(3)) else quaternion.from_matrix(matrix)


def _reversed_last(spectrum: Complexes) -> Complexes:
    """The transform at (u, -v)."""
    return np.roll(spectrum[..., ::-1], 1, axis=-1)


def _as_complex(parts: Reals) -> Complexes:
    """Pairs along the last axis, real part first, as complex numbers in the same memory."""
    return parts.view(np.result_type(parts.dtype, np.complex64))


def _as_real(numbers: Complexes) -> Reals:
    """Complex numbers as pairs along a new last axis, real part first."""
    dense = np.ascontiguousarray(numbers)
    return dense[..., None].view(dense.real.dtype)


def _check_size(shape: tuple[int, ...], name: str) -> None:
    if 0 in shape[-2:]:
        raise ValueError(f"{name}: {shape[-2]} x {shape[-1]} pixels; expected at least one")


def _checked(result: Reals, name: str) -> Reals:
    """`result`, unless an argument was not finite: every one of its numbers is a term of the first of the result."""
    if not np.isfinite(result[..., 0, 0, :]).all():
        raise ValueError(f"{name}: a number, or the sum of all, is not finite; expected finite numbers")
    return result
