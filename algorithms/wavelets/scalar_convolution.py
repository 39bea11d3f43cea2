"""Convolution and correlation of fields of numbers, with the boundary modes of scipy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, finite_number, real_array
from .colours import refuse_channels
from .convolution import clifford_convolve, clifford_correlate

_ZEROS = ("full", "same", "valid")
_PADDING = {"reflect": "symmetric", "constant": "constant", "nearest": "edge", "mirror": "reflect", "wrap": "wrap"}
"""Modes of `scipy.ndimage`, with the corresponding modes of `numpy.pad`."""


def convolve(
    field: ArrayLike,
    mask: ArrayLike,
    mode: str = "full",
    fill: float = 0.0,
    method: str = "auto",
    workers: int | None = None,
) -> Reals:
    """Convolve a field of numbers with a mask: the sum of ``field(y) mask(x - y)``.

    Parameters
    ----------
    field : array_like, (..., N1, ..., Nn)
        Real numbers; the last axes are spatial, as many as the mask has, and the axes before them are those of a stack.
        float32 is kept if both arguments have it; integers are converted to float64.
    mask : array_like, (K1, ..., Kn)
        It may be larger than the field, except with "valid".
    mode : str
        With zeros outside, as in `scipy.signal.convolve`: "full", of size N + K - 1; "same", the middle part, of the
        size of the field; "valid", of size N - K + 1, the part that needs no values outside. With an extension as in
        `scipy.ndimage.convolve`, of the size of the field: "reflect" (d c b a | a b c d | d c b a), "mirror"
        (d c b | a b c d | c b a), "nearest" (a a a | a b c d | d d d), "wrap" (b c d | a b c d | a b c) or "constant".
    fill : float
        Value outside the field with "constant".
    method : str
        "direct" sums over the mask, "fft" uses Fourier transforms, and "auto" chooses the cheaper method.
    workers : int, optional
        As in `scipy.fft`.

    Returns
    -------
    array, (..., M1, ..., Mn)

    Raises
    ------
    TypeError, ValueError
        If arguments are not finite real numbers of these shapes, if an axis is empty, if the mask does not fit, or if
        an option is unknown. Pictures with channels are rejected for masks with two axes.

    Notes
    -----
    Results agree with scipy to 1e-14 of the largest number times the sum of the absolute values of the mask. The centre
    of a mask of even size is at ``(K - 1) // 2`` for "same" and at ``K // 2`` for the modes of `scipy.ndimage`, as in
    scipy.
    """
    return _combined(clifford_convolve, field, mask, mode, fill, method, workers)


def correlate(
    field: ArrayLike,
    mask: ArrayLike,
    mode: str = "full",
    fill: float = 0.0,
    method: str = "auto",
    workers: int | None = None,
) -> Reals:
    """Correlate a field of numbers with a mask: the sum of ``field(x + y) mask(y)``.

    It is the convolution with the flipped mask, at the positions of `scipy.signal.correlate` and
    `scipy.ndimage.correlate`. Parameters, results and errors are those of `convolve`.
    """
    return _combined(clifford_correlate, field, mask, mode, fill, method, workers)


def _combined(
    combine: Callable[..., Reals],
    field: ArrayLike,
    mask: ArrayLike,
    mode: str,
    fill: float,
    method: str,
    workers: int | None,
) -> Reals:
    if mode not in _ZEROS and mode not in _PADDING:
        raise ValueError(f"mode: {mode!r}; expected {', '.join(map(repr, (*_ZEROS, *_PADDING)))}")
    outside = finite_number(fill, "fill")
    weights = real_array(mask, "mask", (-1,))
    n = weights.ndim
    values = real_array(field, "field", (-1,) * n, f"as many axes as the mask, {n}")
    if 0 in (*values.shape, *weights.shape):
        raise ValueError(f"field, mask: shapes {values.shape} and {weights.shape}; expected no empty axis")
    if n == 2:
        refuse_channels(values.shape, "field")
    stack, space = values.shape[: values.ndim - n], values.shape[values.ndim - n :]
    # A stack is treated as one field with many coefficients, and the mask has one coefficient.
    values = np.moveaxis(values.reshape(-1, *space), 0, -1)
    if mode in _PADDING:
        sizes = [(k - 1 - k // 2, k // 2) for k in weights.shape]
        if combine is clifford_correlate:
            sizes = [(after, before) for before, after in sizes]
        options = {"constant_values": outside} if mode == "constant" else {}
        values = np.pad(values, [*sizes, (0, 0)], _PADDING[mode], **options)  # type: ignore[call-overload]
    inside = "valid" if mode in _PADDING else mode
    result = combine(values, weights[..., None], np.multiply, inside, method=method, workers=workers)
    return np.ascontiguousarray(np.moveaxis(result, -1, 0)).reshape(*stack, *result.shape[:-1])
