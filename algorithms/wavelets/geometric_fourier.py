"""The Fourier transform of fields with any roots of -1 on either side, in any algebra."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import ArrayLike

from ..arguments import Reals, real_array
from .discrete import check_finite
from .planes import check_norm
from .sharing import Progress, steps

Product = Callable[..., Any]
"""A generated kernel of two multivectors that is linear in both, such as ``sta.geometric_product``."""

Factors = Sequence[tuple[ArrayLike, Sequence[int]]]
"""Roots of -1, each with the axes whose phases it has."""


def geometric_fft(
    field: ArrayLike,
    product: Product,
    left: Factors = (),
    right: Factors = (),
    norm: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Reals:
    """The Fourier transform ``product of exp(-a phase) f product of exp(-b phase)`` with any roots of -1.

    Parameters
    ----------
    field : array_like, (*space, n)
        Coefficients last. Axes that no factor has stay as they are. float32 stays; integers become float64.
    product : kernel
        What multiplies the values, of any algebra, degenerate ones too.
    left, right : sequence of (root, axes)
        What stands on either side of the value, from left to right: a multivector (n,) whose square is -1, which need
        not be a blade, with the axes of the field whose phases ``2 pi u x / N`` it has. Each axis may occur once.
    norm, workers
        As in `scipy.fft`.
    progress : function of (done, total), optional
        Called after each of the transforms that it takes.

    Returns
    -------
    array, of the shape of `field`

    Raises
    ------
    TypeError, ValueError
        Where arguments are not finite real numbers of these shapes, a square is not -1, an axis occurs twice or is no
        axis of space, and for an unknown norm.

    Notes
    -----
    Bujack, Scheuermann and Hitzer, in *Quaternion and Clifford Fourier Transforms and Wavelets*, 2013. For every root,
    the coefficients are transformed as real signals, which costs as much as half as many complex ones, and then
    ``Re + root Im`` is taken.
    """
    return _geometric(field, "field", product, left, right, False, norm, workers, progress)


def igeometric_fft(
    spectrum: ArrayLike,
    product: Product,
    left: Factors = (),
    right: Factors = (),
    norm: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Reals:
    """The inverse of `geometric_fft` with the same options, which has the same arguments and errors."""
    return _geometric(spectrum, "spectrum", product, left, right, True, norm, workers, progress)


def _geometric(
    value: ArrayLike,
    name: str,
    product: Product,
    left: Factors,
    right: Factors,
    inverse: bool,
    norm: str | None,
    workers: int | None,
    progress: Progress | None,
) -> Reals:
    array = real_array(value, name, (-1, -1), "fields with coefficients last")
    check_finite(array, name)
    check_norm(norm)
    size, space = array.shape[-1], array.ndim - 1

    def from_left(a: Any, b: Any) -> Any:
        return product(b, a)

    # The ones next to the value act first, and are undone last.
    factors = [("left", factor, from_left) for factor in reversed(list(left))]
    factors += [("right", factor, product) for factor in right]
    seen: list[int] = []
    checked = []
    for side, (root, axes), multiply in factors:
        number = real_array(root, side, (size,), f"a root of -1 with {size} coefficients").astype(array.dtype)
        basis = np.eye(size, dtype=array.dtype)
        check_finite(number, side)
        if number.ndim != 1 or np.abs(multiply(multiply(basis, number), number) + basis).max() > 1e-6:
            raise ValueError(f"{side}: the square of {root!r} is not -1; expected roots of -1")
        chosen = [axis if axis >= 0 else axis + space for axis in axes]
        if any(not 0 <= axis < space for axis in chosen) or len(set(chosen + seen)) < len(chosen + seen):
            raise ValueError(f"{side}: axes {tuple(axes)}; expected each axis of space, 0 to {space - 1}, at most once")
        seen += chosen
        if chosen:
            checked.append((number, tuple(chosen), multiply))
    function = scipy.fft.ifftn if inverse else scipy.fft.fftn
    told = steps(progress, len(checked))
    for number, along, multiply in checked[::-1] if inverse else checked:
        spectrum = function(array, axes=along, norm=norm, workers=workers)
        # The imaginary part has the sines with the sign of the exponent.
        array = spectrum.real + multiply(spectrum.imag, number)
        told()
    return array
