"""The quaternion Fourier transform of images, computed by two complex transforms between two passes of kernels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from generated import quaternion

from ..arguments import Reals, real_array, whole_number
from ..precision import NEGLIGIBLE
from .colours import quaternions_meant, refuse_channels
from .planes import Complexes, Directions, check_norm, through_planes
from .sharing import in_threads, slices

Axis = str | Sequence[float]
"""A square root of -1: i, j, k, or the coordinates of a unit vector."""


class Side(Enum):
    """The side of a pixel f at (x, y) of an M x N image on which the exponentials are.

    ``TWO``: ``exp(-mu 2 pi u x / M) f exp(-nu 2 pi v y / N)``. ``LEFT``: ``exp(-mu 2 pi (u x / M + v y / N)) f``.
    ``RIGHT``: ``f exp(-nu 2 pi (u x / M + v y / N))``. mu and nu are the two axes of the transform.
    """

    TWO = "two"
    LEFT = "left"
    RIGHT = "right"


_NAMES = {"i": (1.0, 0.0, 0.0), "j": (0.0, 1.0, 0.0), "k": (0.0, 0.0, 1.0)}
_BLOCK = 2**18
"""Bytes of the image that are converted to quaternions at a time, in the cache."""


@dataclass(frozen=True, slots=True)
class _Plan:
    """The decomposition of a transform into complex transforms, after multiplication from both sides.

    Attributes
    ----------
    left, right : array, (4,), or None
        The unit quaternions that multiply the field to rotate its axes to those of the plan: i, and j on the right for
        the two-sided transform with orthogonal axes. The result is multiplied by their inverses.
    symplectic : bool
        Whether a quaternion is written as ``A + B j`` with complex A and B, which needs no arithmetic; otherwise it is
        ``(A (1 + k) + B (1 - k)) / 2``.
    directions : (directions, directions)
        The directions of A and of B.
    """

    left: NDArray[np.float64] | None
    right: NDArray[np.float64] | None
    symplectic: bool
    directions: tuple[Directions, Directions]


def qft(
    image: ArrayLike,
    side: str = "two",
    axes: tuple[Axis, Axis] = ("i", "j"),
    norm: str | None = None,
    workers: int | None = None,
    values: str | None = None,
) -> Reals:
    """Compute the quaternion Fourier transform of images.

    Parameters
    ----------
    image : array_like, (..., M, N) or (..., M, N, 4)
        Real images, or quaternions (w, x, y, z), for example from `from_rgb`. Integers are converted to float64.
    side : str
        "two", "left" or "right": the side of the exponentials, see `Side`.
    axes : (axis, axis)
        mu and nu of `Side`: "i", "j", "k", or unit vectors (x, y, z). The left transform uses mu only, the right
        transform nu only.
    norm : str, optional
        "backward" (the default: factor 1 forward, 1 / (M N) inverse), "ortho" or "forward", as in `scipy.fft`.
    workers : int, optional
        As in `scipy.fft`.
    values : str, optional
        "real" or "quaternion"; the latter is the default for three axes or more, the last of length 4. Arrays
        that may be pictures with channels are rejected then: other lengths, and RGBA in integers of 8 and 16 bits.

    Returns
    -------
    array, (..., M, N, 4)
        Quaternions (w, x, y, z). The frequency (u, v) is at [u, v], as in `scipy.fft.fft2`.

    Raises
    ------
    TypeError, ValueError
        If `image` is not an array of real numbers with at least two axes, none of them empty, or may be a picture with
        channels; if it or its transform is not finite; or if a side, an axis, a norm or a kind of values is unknown.

    Notes
    -----
    Every quaternion is a sum of two parts that the exponentials multiply like complex numbers (Ell and Sangwine, *IEEE
    Trans. Image Processing* 16:22, 2007; Hitzer, *Adv. Appl. Clifford Algebras* 17:497, 2007). The transform therefore
    consists of two complex transforms; for a real image the two are the same.
    """
    array = real_array(image, "image")
    where, mu, nu = _options(side, axes, norm)
    if not quaternions_meant(array, np.asarray(image).dtype, values):
        array = real_array(array, "image", (-1, -1), "real images M N, or quaternions M N 4")
        _check_size(array.shape, "image")
        return _checked(_of_real(array, _exponents(where, mu, nu), array.shape[-1], norm, workers), "image")
    return _of_quaternions(array, "image", _plan(where, mu, nu), False, norm, workers)


def iqft(
    spectrum: ArrayLike,
    side: str = "two",
    axes: tuple[Axis, Axis] = ("i", "j"),
    norm: str | None = None,
    workers: int | None = None,
) -> Reals:
    """Compute the inverse of `qft` with the same options.

    Parameters
    ----------
    spectrum : array_like, (..., M, N, 4)
        Quaternions (w, x, y, z).
    side, axes, norm, workers
        As in `qft`.

    Returns
    -------
    array, (..., M, N, 4)
        Quaternions (w, x, y, z); for the spectrum of a real image, only w is nonzero (up to rounding).

    Raises
    ------
    TypeError, ValueError
        As in `qft`.
    """
    array = real_array(spectrum, "spectrum", (-1, -1, 4), "quaternions M N 4")
    return _of_quaternions(array, "spectrum", _plan(*_options(side, axes, norm)), True, norm, workers)


def rqft(
    image: ArrayLike,
    side: str = "two",
    axes: tuple[Axis, Axis] = ("i", "j"),
    norm: str | None = None,
    workers: int | None = None,
) -> Reals:
    """Compute the frequencies ``v <= N / 2`` of the quaternion Fourier transform of real images, at half the cost.

    Parameters
    ----------
    image : array_like, (..., M, N)
        Real images.
    side, axes, norm, workers
        As in `qft`.

    Returns
    -------
    array, (..., M, N // 2 + 1, 4)
        The values of `qft` at these frequencies. The others follow from ``F = CC - mu SC - nu CS + mu nu SS``, with
        cosine and sine sums: at (u, -v) the last two terms have the opposite sign.

    Raises
    ------
    TypeError, ValueError
        As in `qft`.
    """
    array = real_array(image, "image", (-1, -1), "real images M N")
    refuse_channels(array.shape, "image")
    _check_size(array.shape, "image")
    where, mu, nu = _options(side, axes, norm)
    return _checked(_of_real(array, _exponents(where, mu, nu), array.shape[-1] // 2 + 1, norm, workers), "image")


def irqft(
    spectrum: ArrayLike,
    columns: int | None = None,
    side: str = "two",
    axes: tuple[Axis, Axis] = ("i", "j"),
    norm: str | None = None,
    workers: int | None = None,
) -> Reals:
    """Return the real images of spectra computed by `rqft` with the same options.

    Parameters
    ----------
    spectrum : array_like, (..., M, N // 2 + 1, 4)
        Quaternions (w, x, y, z). Parts that no spectrum of a real image has are ignored, as by `scipy.fft.irfft2`.
    columns : int, optional
        N; the default is the even one of the two possible numbers.
    side, axes, norm, workers
        As in `rqft`.

    Returns
    -------
    array, (..., M, N)

    Raises
    ------
    TypeError, ValueError
        As in `qft`, and if N columns have a different number of frequencies.
    """
    array = real_array(spectrum, "spectrum", (-1, -1, 4), "quaternions M N//2+1 4")
    _check_size(array.shape[:-1], "spectrum")
    half = array.shape[-2]
    count = 2 * (half - 1) if columns is None else whole_number(columns, "columns")
    if count < 1 or count // 2 + 1 != half:
        expected = "1" if half == 1 else f"{2 * half - 2} or {2 * half - 1}"
        raise ValueError(f"columns: {count} for {half} frequencies along the last axis; expected {expected}")
    mu, nu = _exponents(*_options(side, axes, norm))
    opposite = float(mu @ nu) < 0
    packed = quaternion.pack_real(array, mu.astype(array.dtype), (-nu if opposite else nu).astype(array.dtype))
    size = (array.shape[-3], count)
    images = np.asarray(scipy.fft.irfft2(_as_complex(packed)[..., 0], size, norm=norm, workers=workers), array.dtype)
    if not np.isfinite(images[..., 0, 0]).all():
        raise ValueError("spectrum: a number, or the sum of all, is not finite; expected finite numbers")
    return _mirrored(images, -1) if opposite else images


def _of_quaternions(
    array: Reals, name: str, plan: _Plan, inverse: bool, norm: str | None, workers: int | None
) -> Reals:
    _check_size(array.shape[:-1], name)
    factors = None if plan.left is None and plan.right is None else _pair(plan.left, plan.right, array.dtype)
    back = None if factors is None else _pair(_conjugate(plan.left), _conjugate(plan.right), array.dtype)

    def pack(q: Reals, out: tuple[Reals, ...]) -> None:
        if not plan.symplectic:
            if factors is None:
                quaternion.pack_two_sided(q, out=out)
            else:
                quaternion.pack_turned(factors[0], q, factors[1], out=out)
            return
        if factors is not None:
            q = quaternion.product_of_three(factors[0], q, factors[1])
        for part, pair in zip(out, (q[..., :2], q[..., 2:]), strict=True):
            _copy(part, pair)

    def unpack(first: Reals, second: Reals, out: Reals) -> None:
        if not plan.symplectic:
            if back is None:
                quaternion.unpack_two_sided(first, second, out=out)
            else:
                quaternion.unpack_turned(first, second, *back, out=out)
            return
        for part, pair in zip((out[..., :2], out[..., 2:]), (first, second), strict=True):
            _copy(part, pair)
        if back is not None:
            quaternion.product_of_three(back[0], out, back[1], out=out)

    return through_planes(array, name, pack, unpack, plan.directions, inverse, norm, workers)


def _of_real(
    image: Reals,
    exponents: tuple[NDArray[np.float64], NDArray[np.float64]],
    wanted: int,
    norm: str | None,
    workers: int | None,
) -> Reals:
    """Return the two-sided transform of a real image for the first `wanted` frequencies v: all, or the first half."""
    rows, columns = image.shape[-2:]
    half = columns // 2 + 1
    mu, nu = (axis.astype(image.dtype) for axis in exponents)
    spectra = scipy.fft.rfft2(image.reshape(-1, rows, columns), norm=norm, workers=workers)
    spectra = np.asarray(spectra, np.result_type(image.dtype, np.complex64))
    result = np.empty((len(spectra), rows, wanted, 4), image.dtype)

    def unpacked(place: tuple[int, slice]) -> None:
        k, inside = place
        here = spectra[k, inside]
        there = spectra[k, -np.arange(inside.start, inside.stop) % rows]
        pair = _as_real(here), _as_real(there)
        result[k, inside, :half] = quaternion.unpack_real(*pair, mu, nu)
        if wanted > half:
            # The columns of the other half are those of -v, in reverse order.
            others = quaternion.unpack_real(*pair, mu, -nu)
            result[k, inside, half:] = others[:, columns - half : 0 : -1]

    places = [
        (k, part) for k in range(len(spectra)) for part in slices(rows, max(_BLOCK // (columns * image.itemsize), 1))
    ]
    in_threads(unpacked, places, workers)
    return result.reshape(*image.shape[:-1], wanted, 4)


def _pair(left: NDArray[np.float64] | None, right: NDArray[np.float64] | None, dtype: Any) -> tuple[Reals, Reals]:
    p, r = (np.array((1.0, 0.0, 0.0, 0.0) if one is None else one, dtype) for one in (left, right))
    return p, r


def _conjugate(q: NDArray[np.float64] | None) -> NDArray[np.float64] | None:
    return None if q is None else quaternion.conjugate(q)


def _options(
    side: str, axes: tuple[Axis, Axis], norm: str | None
) -> tuple[Side, NDArray[np.float64], NDArray[np.float64]]:
    try:
        where = Side(side)
    except ValueError:
        raise ValueError(f"side: {side!r}; expected {', '.join(repr(one.value) for one in Side)}") from None
    check_norm(norm)
    if isinstance(axes, str) or not isinstance(axes, Sequence) or len(axes) != 2:
        raise ValueError(f"axes: {axes!r}; expected a pair such as ('i', 'j')")
    mu, nu = (_axis(axis) for axis in axes)
    return where, mu, nu


def _exponents(
    where: Side, mu: NDArray[np.float64], nu: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the axes of the two-sided transform that is equal for real images, which commute with everything."""
    return (mu if where is not Side.RIGHT else nu), (nu if where is not Side.LEFT else mu)


def _plan(where: Side, mu: NDArray[np.float64], nu: NDArray[np.float64]) -> _Plan:
    same: Directions = ((0, 1), ())
    mixed: Directions = ((0,), (1,))
    opposite: Directions = ((), (0, 1))
    if where is not Side.TWO:
        rotation = _rotation(mu if where is Side.LEFT else nu, None)
        # B j exp(-i s) = B exp(i s) j
        return _Plan(rotation, _conjugate(rotation), True, (same, same if where is Side.LEFT else opposite))
    cosine = float(mu @ nu)
    if abs(cosine) < NEGLIGIBLE:
        rotation = _rotation(mu, nu)
        return _Plan(rotation, _conjugate(rotation), False, (mixed, same))
    # With the rotation b of nu to mu: f exp(-nu t) = (f ~b) exp(-mu t) b. The same holds for the opposite of nu.
    parallel = nu if cosine > 0 else -nu
    rotation = _rotation(mu, None)
    right = _conjugate(rotation)
    if not np.allclose(parallel, mu, rtol=0, atol=NEGLIGIBLE):
        back = quaternion.conjugate(quaternion.between_vectors(parallel, mu))
        right = back if right is None else quaternion.product(back, right)
    return _Plan(rotation, right, True, (same, mixed) if cosine > 0 else (mixed, same))


def _axis(axis: Axis) -> NDArray[np.float64]:
    if isinstance(axis, str):
        if axis not in _NAMES:
            raise ValueError(f"axes: {axis!r}; expected 'i', 'j', 'k' or a unit vector (x, y, z)")
        return np.array(_NAMES[axis])
    vector = np.array(real_array(axis, "axes", (3,), "a unit vector"), np.float64)
    if vector.ndim != 1 or not abs(np.linalg.norm(vector) - 1) < NEGLIGIBLE:
        raise ValueError(f"axes: {axis!r}; expected 'i', 'j', 'k' or a unit vector (x, y, z)")
    return vector


def _rotation(mu: NDArray[np.float64], nu: NDArray[np.float64] | None) -> NDArray[np.float64] | None:
    """Return the rotation that maps mu to i and, if given, nu to j; None if it is the identity."""
    if nu is None:
        nu = np.roll(mu, 1) if np.abs(mu).max() == 1 else np.cross(mu, np.eye(3)[np.abs(mu).argmin()])
        nu = nu / np.linalg.norm(nu)
    matrix = np.stack([mu, nu, np.cross(mu, nu)])
    return None if np.array_equal(matrix, np.eye(3)) else quaternion.from_matrix(matrix)


def _mirrored(image: Reals, axis: int) -> Reals:
    """Return the image at -y, with periodic indices."""
    return np.roll(np.flip(image, axis), 1, axis=axis)


def _copy(to: Reals, pairs: Reals) -> None:
    """Copy pairs of numbers; as complex numbers, twice as fast, if the numbers of each pair are adjacent."""
    if to.strides[-1] == pairs.strides[-1] == to.itemsize:
        to, pairs = _as_complex(to), _as_complex(pairs)
    to[...] = pairs


def _as_complex(parts: Reals) -> Complexes:
    """Return pairs along the last axis, real part first, as complex numbers; the result is a view."""
    return parts.view(np.result_type(parts.dtype, np.complex64))


def _as_real(numbers: Complexes) -> Reals:
    """Return complex numbers as pairs along a new last axis, real part first."""
    dense = np.ascontiguousarray(numbers)
    return dense[..., None].view(dense.real.dtype)


def _check_size(shape: tuple[int, ...], name: str) -> None:
    if 0 in shape[-2:]:
        raise ValueError(f"{name}: {shape[-2]} x {shape[-1]} pixels; expected at least one")


def _checked(result: Reals, name: str) -> Reals:
    """Return `result` after checking that it is finite: every number is a term of the first element of the result."""
    if not np.isfinite(result[..., 0, 0, :]).all():
        raise ValueError(f"{name}: a number, or the sum of all, is not finite; expected finite numbers")
    return result
