"""Convolution and correlation of fields of multivectors, with the products of any generated algebra."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product as every
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, real_array
from ..scaling import back_in_range, in_range
from .discrete import check_finite
from .sharing import n_threads

Product = Callable[..., Any]
"""A generated kernel of two multivectors that is bilinear, such as ``pga3.geometric_product``."""

_MODES = ("full", "same", "valid", "wrap")
_METHODS = ("auto", "direct", "fft")


def clifford_convolve(
    field: ArrayLike,
    mask: ArrayLike,
    product: Product,
    mode: str = "full",
    side: str = "right",
    method: str = "auto",
    workers: int | None = None,
) -> Reals:
    """Convolve a field of multivectors with a mask of multivectors: the sum of ``field(y) mask(x - y)``.

    Parameters
    ----------
    field : array_like, (*space, n)
        A field with as many spatial axes as `mask`; coefficients last.
    mask : array_like, (*space, m)
    product : kernel
        The kernel that multiplies the values, such as ``vga3.geometric_product`` or, for vectors,
        ``vga3.vector_product``. Any algebra is allowed, including degenerate ones.
    mode : str
        "full", "same" or "valid", as in `scipy.signal.convolve`, with zeros outside; or "wrap", with the size of the
        field, which is assumed periodic.
    side : str
        "right" if the mask is the right factor of the product, "left" if it is the left factor.
    method : str
        "direct" sums over the mask, "fft" transforms each coefficient, and "auto" chooses the cheaper method.
    workers : int, optional
        As in `scipy.fft`.

    Returns
    -------
    array, (*space, k)
        Values with the coefficients of the product; float32 if both arguments are.

    Raises
    ------
    TypeError, ValueError
        If arguments are not finite real numbers, if numbers of axes differ, if an axis is empty, if the mask does not
        fit, if the kernel does not accept the values, or if an option is unknown.

    Notes
    -----
    Transforming the coefficients and multiplying over the complex numbers is correct in every algebra, even where no
    simple convolution theorem of a Clifford-Fourier transform exists. Errors of "fft" are relative to the largest
    value.
    """
    return _combined(field, mask, product, mode, side, method, workers, False)


def clifford_correlate(
    field: ArrayLike,
    mask: ArrayLike,
    product: Product,
    mode: str = "full",
    side: str = "right",
    method: str = "auto",
    workers: int | None = None,
) -> Reals:
    """Correlate a field of multivectors with a mask: the sum of ``field(x + y) mask(y)``.

    The values are not reversed: with ``vga2.vector_product`` or ``vga3.vector_product``, the scalar part is the
    correlation of the vectors and the bivector part describes the rotation of the field relative to the mask (Ebling
    and Scheuermann, *IEEE Trans. Visualization and Computer Graphics* 11:469, 2005). Parameters, results and errors are
    those of `clifford_convolve`; positions in `mode` are those of `scipy.signal.correlate`; with "wrap", y starts at 0.
    """
    return _combined(field, mask, product, mode, side, method, workers, True)


def _combined(
    field: ArrayLike,
    mask: ArrayLike,
    product: Product,
    mode: str,
    side: str,
    method: str,
    workers: int | None,
    correlation: bool,
) -> Reals:
    n_threads(workers)
    for name, value, known in (("mode", mode, _MODES), ("side", side, ("right", "left")), ("method", method, _METHODS)):
        if value not in known:
            raise ValueError(f"{name}: {value!r}; expected {', '.join(map(repr, known))}")
    values, weights = real_array(field, "field", (-1, -1)), real_array(mask, "mask", (-1, -1))
    if values.ndim != weights.ndim:
        raise ValueError(f"mask: shape {weights.shape} for a field of shape {values.shape}; expected as many axes")
    for name, array in (("field", values), ("mask", weights)):
        check_finite(array, name)
    dtype = np.result_type(values, weights)
    values, weights = values.astype(dtype, copy=False), weights.astype(dtype, copy=False)
    (values, moved), (weights, moved_too) = (in_range(each, tuple(range(each.ndim))) for each in (values, weights))
    exponents = (moved + moved_too).reshape(1)
    large, small = values.shape[:-1], weights.shape[:-1]
    if mode in ("valid", "wrap") and any(n > m for m, n in zip(large, small, strict=True)):
        raise ValueError(f"mask: {small} is larger than the field, {large}; expected one that fits for mode {mode!r}")
    if side == "left":
        original = product

        def product(f: Any, h: Any) -> Any:
            return original(h, f)

    space = tuple(range(len(large)))
    if correlation:
        weights = np.flip(weights, space)
    if method == "auto":
        method = "direct" if np.prod(small) <= 3 ** len(small) else "fft"
    whole = large if mode == "wrap" else tuple(m + n - 1 for m, n in zip(large, small, strict=True))
    combine = _direct if method == "direct" else _by_fourier
    result = combine(values, weights, product, whole, workers)
    if mode == "wrap":
        # A flipped mask starts at 1 - its size.
        return back_in_range(
            np.roll(result, [1 - n for n in small], space) if correlation else result, exponents, "field"
        )
    start = {"full": (0,) * len(small), "same": [(n - 1) // 2 for n in small], "valid": [n - 1 for n in small]}[mode]
    size = {"full": whole, "same": large, "valid": [m - n + 1 for m, n in zip(large, small, strict=True)]}[mode]
    return back_in_range(result[tuple(slice(a, a + n) for a, n in zip(start, size, strict=True))], exponents, "field")


def _direct(values: Reals, weights: Reals, product: Product, whole: tuple[int, ...], workers: int | None) -> Reals:
    """Return the sum of the products of the whole field with each element of the mask."""
    large = values.shape[:-1]
    result: Reals | None = None
    for place in every(*(range(n) for n in weights.shape[:-1])):
        terms = product(values, weights[place])
        if result is None:
            result = np.zeros((*whole, terms.shape[-1]), terms.dtype)
        if whole == large:
            result += np.roll(terms, place, tuple(range(len(large))))
        else:
            result[tuple(slice(a, a + n) for a, n in zip(place, large, strict=True))] += terms
    assert result is not None
    return result


def _by_fourier(values: Reals, weights: Reals, product: Product, whole: tuple[int, ...], workers: int | None) -> Reals:
    """Return the convolution by FFT.

    Coefficients come first in the transforms and last in the products, without copies.
    """
    fast = whole if whole == values.shape[:-1] else tuple(scipy.fft.next_fast_len(n, real=True) for n in whole)
    axes = tuple(range(1, len(whole) + 1))
    f, h = (
        np.moveaxis(scipy.fft.rfftn(np.moveaxis(array, -1, 0), fast, axes, workers=workers), 0, -1)
        for array in (values, weights)
    )
    spectrum = np.moveaxis(_complex_product(f, h, product), -1, 0)
    result = scipy.fft.irfftn(spectrum, fast, axes, overwrite_x=True, workers=workers)
    inside = result[(slice(None), *(slice(n) for n in whole))]
    return np.ascontiguousarray(np.moveaxis(inside, 0, -1), values.dtype)


def _complex_product(f: NDArray[Any], h: NDArray[Any], product: Product) -> NDArray[Any]:
    """Return the bilinear product over the complex numbers, from four real products."""
    real = product(f.real, h.real)
    shape = (real.shape[-1], *real.shape[:-1])
    result = np.moveaxis(np.empty(shape, np.result_type(real.dtype, np.complex64)), 0, -1)
    np.subtract(real, product(f.imag, h.imag), out=result.real)
    np.add(product(f.real, h.imag), product(f.imag, h.real), out=result.imag)
    return result
