"""The Fourier transform of fields in any algebra, with any roots of -1 on either side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arguments import Reals, real_array
from ..precision import SINGLE
from .discrete import check_finite
from .planes import check_norm
from .sharing import Progress, steps

Product = Callable[..., Any]
"""A generated kernel of two multivectors that is bilinear, such as ``sta.geometric_product``."""

Factors = Sequence[tuple[ArrayLike, Sequence[int]]]
"""Roots of -1, each with the axes of its phase."""


def geometric_fft(
    field: ArrayLike,
    product: Product,
    left: Factors = (),
    right: Factors = (),
    norm: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Reals:
    """Compute the Fourier transform ``product of exp(-a phase) f product of exp(-b phase)`` with any roots of -1.

    Parameters
    ----------
    field : array_like, (*space, n)
        Coefficients last. Axes without a factor are not transformed. float32 is kept; integers become float64.
    product : kernel
        The kernel that multiplies the values, of any algebra, including degenerate ones.
    left, right : sequence of (root, axes)
        The factors on either side of the value, from left to right. Each is a multivector (n,) with square -1, not
        necessarily a blade, and the axes of the field whose phases ``2 pi u x / N`` it has. Each axis may occur once.
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
        If arguments are not finite real numbers of these shapes, if a square is not -1, if an axis occurs twice or is
        not a spatial axis, or if `norm` is unknown.

    Notes
    -----
    Bujack, Scheuermann and Hitzer, in *Quaternion and Clifford Fourier Transforms and Wavelets*, 2013. For each root,
    the coefficients are transformed as real signals, which costs half as much as complex transforms of the same number
    of signals, and combined as ``Re + root Im``.
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
    """Compute the inverse of `geometric_fft` with the same options; parameters and errors are the same."""
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

    # The factors next to the value act first and are undone last.
    factors = [("left", factor, from_left) for factor in reversed(list(left))]
    factors += [("right", factor, product) for factor in right]
    seen: list[int] = []
    checked = []
    for side, (root, axes), multiply in factors:
        number = real_array(root, side, (size,), f"a root of -1 with {size} coefficients").astype(array.dtype)
        basis = np.eye(size, dtype=array.dtype)
        check_finite(number, side)
        if number.ndim != 1 or np.abs(multiply(multiply(basis, number), number) + basis).max() > SINGLE:
            raise ValueError(f"{side}: the square of {root!r} is not -1; expected roots of -1")
        chosen = [axis if axis >= 0 else axis + space for axis in axes]
        if any(not 0 <= axis < space for axis in chosen) or len(set(chosen + seen)) < len(chosen + seen):
            raise ValueError(f"{side}: axes {tuple(axes)}; expected each axis of space, 0 to {space - 1}, at most once")
        seen += chosen
        if chosen:
            checked.append((number, tuple(chosen), multiply))
    function = scipy.fft.ifftn if inverse else scipy.fft.fftn
    step_done = steps(progress, len(checked))
    for number, along, multiply in checked[::-1] if inverse else checked:
        spectrum = function(array, axes=along, norm=norm, workers=workers)
        # The imaginary part contains the sines with the sign of the exponent.
        array = spectrum.real + multiply(spectrum.imag, number)
        step_done()
    return array
