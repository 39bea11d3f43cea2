"""Fourier transforms of fields of any dimension, with the pseudoscalar or with one vector for each axis."""

from __future__ import annotations

from functools import lru_cache
from itertools import product as every
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from generated import quaternion

from ..arguments import Reals, real_array
from .colours import refuse_channels
from .discrete import check_finite
from .planes import NORMS, check_norm, of_spacetime
from .sharing import Progress, steps

_LARGEST = 6
"""The largest dimension, of which kernels exist."""
_SIDES = ("right", "left")


def pseudoscalar_fft(
    field: ArrayLike,
    side: str = "right",
    norm: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Reals:
    """Compute the Clifford-Fourier transform ``f exp(-I phase)`` of fields with values in G(n) for n = 2, 3 or 6.

    Parameters
    ----------
    field : array_like, (..., N1, ..., Nn, 2**n)
        Coefficients ordered by grade and, within a grade, by the last vector, then the one before: 1 e1 e2 e3 e12 e13
        e23 e123. The pseudoscalar I has square -1 if n is 2 or 3 modulo 4.
    side : str
        "right", or "left" for ``exp(-I phase) f``, which is the same in odd dimensions.
    norm, workers
        As in `scipy.fft`.
    progress : function of (done, total), optional
        Called after each complex transform.

    Returns
    -------
    array, of the shape of `field`

    Raises
    ------
    TypeError, ValueError
        If `field` does not have this form or is not finite, or if an option is unknown.

    Notes
    -----
    The transform consists of ``2**(n-1)`` complex transforms (Hitzer and Mawardi, *Adv. Appl. Clifford Algebras*
    18:715, 2008). For n = 2 and n = 3 it is `clifford_fft`.
    """
    return _pseudoscalar(field, "field", side, False, norm, workers, progress)


def ipseudoscalar_fft(
    spectrum: ArrayLike,
    side: str = "right",
    norm: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Reals:
    """Compute the inverse of `pseudoscalar_fft` with the same options; parameters and errors are the same."""
    return _pseudoscalar(spectrum, "spectrum", side, True, norm, workers, progress)


def product_fft(
    field: ArrayLike, norm: str | None = None, workers: int | None = None, progress: Progress | None = None
) -> Reals:
    """Compute the Fourier transform ``f exp(-e1 phase1) ... exp(-en phasen)`` of fields with values in G(0,n).

    Parameters
    ----------
    field : array_like, (..., N1, ..., Nn, 2**n)
        A field of at most 6 dimensions; coefficients are ordered as in `pseudoscalar_fft`. All vectors have square -1.
    norm, workers
        As in `scipy.fft`.
    progress : function of (done, total), optional
        Called after each complex transform.

    Returns
    -------
    array, of the shape of `field`

    Raises
    ------
    TypeError, ValueError
        As in `pseudoscalar_fft`.

    Notes
    -----
    Bülow and Sommer, *IEEE Trans. Signal Processing* 49:2844, 2001. There are as many complex transforms as in
    `pseudoscalar_fft`, for each axis. `real_product_fft` is for real fields.
    """
    return _product(field, "field", False, norm, workers, progress)


def iproduct_fft(
    spectrum: ArrayLike, norm: str | None = None, workers: int | None = None, progress: Progress | None = None
) -> Reals:
    """Compute the inverse of `product_fft` with the same options; parameters and errors are the same."""
    return _product(spectrum, "spectrum", True, norm, workers, progress)


def real_product_fft(
    signal: ArrayLike, dimension: int | None = None, norm: str | None = None, workers: int | None = None
) -> Reals:
    """Compute `product_fft` of real signals with one real transform.

    Parameters
    ----------
    signal : array_like, (..., N1, ..., Nn)
    dimension : int, optional
        n, the number of last axes, up to 6; the default is all axes. It is required for volumes with the shape of
        pictures with channels, whose last axis has at most 4 elements and whose other axes are longer.
    norm, workers
        As in `scipy.fft`.

    Returns
    -------
    array, (..., N1, ..., Nn, 2**n)
        The coefficient of a blade is the sum with sines along its vectors and cosines along the other axes, negated if
        the number of its vectors is odd. In two dimensions this is `qft`, with e1, e2 and e12 for i, j and k.

    Raises
    ------
    TypeError, ValueError
        If `signal` is not an array of finite real numbers with so many axes, or if an option is unknown.
    """
    array = real_array(signal, "signal", (-1,))
    check_finite(array, "signal")
    check_norm(norm)
    if dimension == 2 or (dimension is None and array.ndim == 3):
        refuse_channels(array.shape, "signal", f"dimension={array.ndim} takes all axes for those of space")
    n = array.ndim if dimension is None else dimension
    if isinstance(n, bool) or not isinstance(n, (int, np.integer)) or not 1 <= n <= min(array.ndim, _LARGEST):
        raise ValueError(f"dimension: {n!r}; expected 1 to {min(array.ndim, _LARGEST)} for shape {array.shape}")
    # Sums with cosines and with negated sines, along one axis after the other, for half of the frequencies.
    parts = array[None]
    for k in range(n):
        spectrum = scipy.fft.rfft(parts, axis=k - n, norm=norm, workers=workers)
        parts = np.concatenate([spectrum.real, spectrum.imag])
    for k in range(n):
        size, half = array.shape[k - n], parts.shape[k - n]
        there: tuple[Any, ...] = (Ellipsis, slice(size - half, 0, -1), *(slice(None),) * (n - 1 - k))
        mirrored = parts[there].copy()
        for blade in range(1 << n):
            if blade & 1 << k:
                mirrored[blade] *= -1
        parts = np.concatenate([parts, mirrored], k - n)
    return np.ascontiguousarray(np.moveaxis(parts[list(_blades(n))], 0, -1))


def volume_time_fft(
    field: ArrayLike,
    norm: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
    along: str = "both",
) -> Reals:
    """Compute the volume-time Fourier transform ``exp(-e4 w t) f exp(-e123 u x)`` of fields in a subalgebra of G(3,1).

    Parameters
    ----------
    field : array_like, (..., T, L, M, N, 4)
        Coefficients 1 e4 e123 e1234, with time as the first axis: the subalgebra generated by the two roots of -1.
    norm, workers
        As in `scipy.fft`.
    progress : function of (done, total), optional
        Called after each complex transform.
    along : {"both", "space", "time"}
        The axes that are transformed, as in `spacetime_fft`.

    Returns
    -------
    array, (..., T, L, M, N, 4)

    Raises
    ------
    TypeError, ValueError
        If `field` does not have this form or is not finite, or if `norm` or `along` is unknown.

    Notes
    -----
    e4, e123 and -e1234 multiply as the quaternions i, j and k, so two complex transforms suffice; `spacetime_fft` needs
    eight (Hitzer, *Adv. Appl. Clifford Algebras* 17:497, 2007).
    """
    return _volume_time(field, "field", False, norm, workers, progress, along)


def ivolume_time_fft(
    spectrum: ArrayLike,
    norm: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
    along: str = "both",
) -> Reals:
    """Compute the inverse of `volume_time_fft` with the same options; parameters and errors are the same."""
    return _volume_time(spectrum, "spectrum", True, norm, workers, progress, along)


def _pseudoscalar(
    value: ArrayLike,
    name: str,
    side: str,
    inverse: bool,
    norm: str | None,
    workers: int | None,
    progress: Progress | None,
) -> Reals:
    if side not in _SIDES:
        raise ValueError(f"side: {side!r}; expected 'right' or 'left'")
    array, n = _field(value, name)
    check_norm(norm)
    if n % 4 not in (2, 3):
        raise ValueError(f"{name}: {n} dimensions, where the pseudoscalar has square 1; expected 2, 3 or 6")
    last = (1 << n) - 1
    places = {blade: k for k, blade in enumerate(_blades(n))}
    result = np.empty_like(array, order="C")
    axes, step_done = tuple(range(-n, 0)), steps(progress, 1 << (n - 1))
    for blade in _blades(n):
        if blade & 1:
            continue
        one, other, sign = places[blade], places[blade ^ last], _sign(blade, last, False)
        # In even dimensions, I commutes with even elements only.
        conjugated = side == "left" and n % 2 == 0 and blade.bit_count() % 2 == 1
        number = array[..., one] + np.asarray(sign * 1j, np.result_type(array.dtype, np.complex64)) * array[..., other]
        number = _transformed(number, axes, conjugated is inverse, inverse, norm, workers)
        result[..., one], result[..., other] = number.real, sign * number.imag
        step_done()
    return result


def _product(
    value: ArrayLike, name: str, inverse: bool, norm: str | None, workers: int | None, progress: Progress | None
) -> Reals:
    array, n = _field(value, name)
    check_norm(norm)
    places = {blade: k for k, blade in enumerate(_blades(n))}
    result, step_done = np.array(array, order="C"), steps(progress, n << (n - 1))
    for k in range(n)[::-1] if inverse else range(n):
        for blade in _blades(n):
            if blade & 1 << k:
                continue
            one, other, sign = places[blade], places[blade | 1 << k], _sign(blade, 1 << k, True)
            number = np.asarray(sign * 1j, np.result_type(array.dtype, np.complex64)) * result[..., other]
            number += result[..., one]
            number = _transformed(number, (k - n,), not inverse, inverse, norm, workers)
            result[..., one], result[..., other] = number.real, sign * number.imag
            step_done()
    return result


def _volume_time(
    value: ArrayLike,
    name: str,
    inverse: bool,
    norm: str | None,
    workers: int | None,
    progress: Progress | None,
    along: str,
) -> Reals:
    array = real_array(value, name, (-1, -1, -1, -1, 4), "fields T L M N 4 of times and volumes")
    check_finite(array, name)
    check_norm(norm)
    planes = of_spacetime(along, [((0,), (1, 2, 3)), ((0, 1, 2, 3), ())])
    quaternions = array * np.array([1, 1, 1, -1], array.dtype)
    parts, step_done = [], steps(progress, 2)
    for part, directions in zip(quaternion.pack_two_sided(quaternions), planes, strict=True):
        number = np.ascontiguousarray(part).view(np.result_type(array.dtype, np.complex64))[..., 0]
        for axes, forward in zip(directions, (not inverse, inverse), strict=True):
            if axes:
                number = _transformed(number, tuple(a - 4 for a in axes), forward, inverse, norm, workers)
        parts.append(np.ascontiguousarray(number)[..., None].view(array.dtype))
        step_done()
    result: Reals = quaternion.unpack_two_sided(*parts)
    result[..., 3] *= -1
    return result


def _transformed(
    number: NDArray[Any], axes: tuple[int, ...], forward: bool, inverse: bool, norm: str | None, workers: int | None
) -> NDArray[Any]:
    """Return the forward or backward transform of scipy with the normalization of the whole transform."""
    function = scipy.fft.fftn if forward else scipy.fft.ifftn
    scale = norm if forward is not inverse else NORMS[norm]
    result: NDArray[Any] = function(number, axes=axes, norm=scale, overwrite_x=True, workers=workers)
    return result


def _field(value: ArrayLike, name: str) -> tuple[Reals, int]:
    array = real_array(value, name, (-1, -1), "fields N1 ... Nn 2**n")
    n = max(array.shape[-1].bit_length() - 1, 0)
    if array.shape[-1] != 1 << n or not 1 <= n <= _LARGEST or array.ndim < n + 1:
        raise ValueError(
            f"{name}: shape {array.shape}; expected n axes of space, 1 to {_LARGEST}, and 2**n coefficients"
        )
    check_finite(array, name)
    return array, n


@lru_cache
def _blades(n: int) -> tuple[int, ...]:
    """Return the blades as bit masks, in the order of the coefficients."""
    return tuple(sorted(range(1 << n), key=lambda blade: (blade.bit_count(), blade)))


def _sign(a: int, b: int, negative: bool) -> int:
    """Return the sign of the product of two blades whose vectors have square 1 or, if `negative`, -1."""
    exchanges = sum(1 for i, j in every(range(_LARGEST), repeat=2) if i > j and a >> i & 1 and b >> j & 1)
    return -1 if (exchanges + (negative and (a & b).bit_count())) % 2 else 1
