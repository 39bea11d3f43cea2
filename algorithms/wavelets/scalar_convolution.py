"""Convolution and correlation of fields of numbers, with what scipy has outside their edges."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, finite_number, real_array
from .colours import refuse_channels
from .convolution import clifford_convolve, clifford_correlate

_ZEROS = ("full", "same", "valid")
_PADDING = {"reflect": "symmetric", "constant": "constant", "nearest": "edge", "mirror": "reflect", "wrap": "wrap"}
"""Names of `scipy.ndimage`, with those of `numpy.pad`."""


def convolve(
    field: ArrayLike,
    mask: ArrayLike,
    mode: str = "full",
    fill: float = 0.0,
    method: str = "auto",
    workers: int | None = None,
) -> Reals:
    """The convolution of a field of numbers with a mask: the sum of ``field(y) mask(x - y)``.

    Parameters
    ----------
    field : array_like, (..., N1, ..., Nn)
        Real numbers, in as many last axes as the mask has; axes before them are those of a stack. float32 is kept
        where both are; integers become float64.
    mask : array_like, (K1, ..., Kn)
        May be larger than the field, except for "valid".
    mode : str
        With zeros outside, as in `scipy.signal.convolve`: "full", of size N + K - 1; "same", the middle of that, of the
        size of the field; "valid", of size N - K + 1, where nothing outside is needed. Or what is outside, as in
        `scipy.ndimage.convolve`, and of the size of the field: "reflect" (d c b a | a b c d | d c b a), "mirror"
        (d c b | a b c d | c b a), "nearest" (a a a | a b c d | d d d), "wrap" (b c d | a b c d | a b c) or "constant".
    fill : float
        What is outside for "constant".
    method : str
        "direct" runs over the mask, "fft" takes Fourier transforms; "auto" takes the one of less work.
    workers : int, optional
        As in `scipy.fft`.

    Returns
    -------
    array, (..., M1, ..., Mn)

    Raises
    ------
    TypeError, ValueError
        Where arguments are not finite real numbers of such shapes, an axis is empty, the mask does not fit, and for
        unknown options. Pictures with channels are refused for masks with two axes.

    Notes
    -----
    Numbers are those of scipy to 1e-14 of the largest times the sum of the mask's sizes. For masks of an even size, the
    middle is the place ``(K - 1) // 2`` for "same", and ``K // 2`` for the modes of `scipy.ndimage`, as there.
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
    """The correlation of a field of numbers with a mask: the sum of ``field(x + y) mask(y)``.

    It is the convolution with the mask turned round, in the positions of `scipy.signal.correlate` and
    `scipy.ndimage.correlate`. Arguments, results and errors are those of `convolve`.
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
    # A stack is one field whose values have many coefficients, and the mask has one.
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
