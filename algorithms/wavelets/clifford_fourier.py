"""Fourier transforms of fields with values in G(2), G(3) and G(3,1), as complex transforms between two kernels."""

from __future__ import annotations

from numpy.typing import ArrayLike

from generated import sta, vga2, vga3

from ..arguments import Reals, real_array
from .planes import Directions, of_spacetime, through_planes
from .sharing import Progress

_SIDES = ("right", "left")
_PLANE, _SPACE, _SPACETIME = (-1, -1, 4), (-1, -1, -1, 8), (-1, -1, -1, -1, 16)
"""Shapes of fields in the plane, in space and in spacetime."""
_MEANING = {4: "fields M N 4 of G(2)", 8: "fields L M N 8 of G(3)"}


def clifford_fft(
    field: ArrayLike,
    side: str = "right",
    norm: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Reals:
    """Compute the Clifford-Fourier transform of fields of multivectors in the plane or in space.

    Parameters
    ----------
    field : array_like, (..., M, N, 4) or (..., L, M, N, 8)
        Elements of G(2), coefficients 1 e1 e2 e12, or of G(3), coefficients 1 e1 e2 e3 e12 e13 e23 e123, as in
        `generated.vga2` and `generated.vga3`. float32 gives float32; integers are converted to float64.
    side : str
        "right" for ``f exp(-I w x)`` or "left" for ``exp(-I w x) f``, with the pseudoscalar I. In G(3) it commutes with
        everything, and both transforms are the same.
    norm, workers
        As in `scipy.fft`.
    progress : function of (done, total), optional
        Called after each step with the number of completed steps and the total, to report progress on large volumes.

    Returns
    -------
    array, of the shape of `field`
        The memory layout is that of `field`, with coefficients first or last; neither layout is copied.

    Raises
    ------
    TypeError, ValueError
        If `field` does not have this form, has an empty axis or is not finite, or if `side` or `norm` is unknown.

    Notes
    -----
    The transform consists of two complex transforms in G(2) and four in G(3) (Ebling and Scheuermann, *IEEE Trans.
    Visualization and Computer Graphics* 11:469, 2005). In G(3), the spectrum of a convolution is the product of the
    spectra. In G(2), e12 anticommutes with vectors: for ``h = h_even + h_odd``, the right-sided spectrum of ``f * h``
    is ``F(w) H_even(w) + F(-w) H_odd(w)``, not the product.
    """
    return _clifford(field, "field", side, False, norm, workers, progress)


def iclifford_fft(
    spectrum: ArrayLike,
    side: str = "right",
    norm: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Reals:
    """Compute the inverse of `clifford_fft` with the same options; parameters and errors are the same."""
    return _clifford(spectrum, "spectrum", side, True, norm, workers, progress)


def spacetime_fft(
    field: ArrayLike,
    norm: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
    along: str = "both",
) -> Reals:
    """Compute the space-time Fourier transform ``exp(-e4 w t) f exp(-e123 u x)`` of fields in G(3,1).

    Parameters
    ----------
    field : array_like, (..., T, L, M, N, 16)
        Elements of G(3,1), with time as the first axis and coefficients 1 e1 e2 e3 e4 e12 e13 e23 e14 e24 e34 e123 e124
        e134 e234 e1234. The time vector e4 and the volume e123 have square -1 and anticommute. float32 gives float32.
    norm, workers, progress
        As in `clifford_fft`.
    along : {"both", "space", "time"}
        The axes that are transformed. One transform after the other is that along both, so that fields larger than
        memory are transformed in blocks: parts of time along space, then parts of space along time.

    Returns
    -------
    array, (..., T, L, M, N, 16)

    Raises
    ------
    TypeError, ValueError
        If `field` does not have this form, has an empty axis or is not finite, or if `norm` or `along` is unknown.

    Notes
    -----
    ``(f + e4 f e123)/2`` and ``(f - e4 f e123)/2`` are transformed as fields of four complex numbers each, with
    opposite signs of time (Hitzer, *Adv. Appl. Clifford Algebras* 17:497, 2007).
    """
    return _spacetime(field, "field", False, norm, workers, progress, along)


def ispacetime_fft(
    spectrum: ArrayLike,
    norm: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
    along: str = "both",
) -> Reals:
    """Compute the inverse of `spacetime_fft` with the same options; parameters and errors are the same."""
    return _spacetime(spectrum, "spectrum", True, norm, workers, progress, along)


def _clifford(
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
    array = real_array(value, name)
    size = array.shape[-1] if array.ndim else 0
    if size not in _MEANING:
        raise ValueError(f"{name}: shape {array.shape}; expected {_MEANING[4]} or {_MEANING[8]}")
    array = real_array(array, name, _PLANE if size == 4 else _SPACE, _MEANING[size])
    if size == 8:
        return through_planes(
            array, name, vga3.pack_field, vga3.unpack_field, [((0, 1, 2), ())] * 4, inverse, norm, workers, progress
        )
    # Moving the exponential from the left past the vectors e1 z conjugates it.
    forward: Directions = ((0, 1), ())
    odd: Directions = forward if side == "right" else ((), (0, 1))
    planes = [forward, odd]
    return through_planes(array, name, vga2.pack_field, vga2.unpack_field, planes, inverse, norm, workers, progress)


def _spacetime(
    value: ArrayLike,
    name: str,
    inverse: bool,
    norm: str | None,
    workers: int | None,
    progress: Progress | None,
    along: str,
) -> Reals:
    array = real_array(value, name, _SPACETIME, "fields T L M N 16 of G(3,1)")
    planes = of_spacetime(along, [((1, 2, 3), (0,))] * 4 + [((0, 1, 2, 3), ())] * 4)
    kernels = sta.pack_spacetime, sta.unpack_spacetime
    return through_planes(array, name, *kernels, planes, inverse, norm, workers, progress, 4)
