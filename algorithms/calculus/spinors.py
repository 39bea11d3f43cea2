"""Numerical spinors: two-state systems in a field, and the free Dirac equation on a periodic grid.

Pauli spinors are even elements of G(3) (``1 e12 e13 e23``), Dirac spinors even elements of G(1,3), with the layouts of
`generated.vga3` and `generated.sta`; ``hbar = c = 1``. `generated.spacetime` has the maps to columns and matrices.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import spacetime

from ..arguments import Reals, coordinates, finite_number, real_array, unmasked

_NODES = 0.5 + np.array([-1.0, 1.0]) * np.sqrt(3) / 6
"""Times within a step at which the field is evaluated: the nodes of the two-point Gauss quadrature."""
_BLADES = spacetime.dirac_to_matrix.layouts["a"].blades
_AT_G0, *_AT_RELATIVE = (_BLADES.index(name) for name in ("g0", "g10", "g20", "g30"))


def precess(
    psi: ArrayLike, angular_velocity: Callable[[float], ArrayLike], times: ArrayLike, steps: int = 1
) -> Reals:  # fmt: skip
    """Integrate a two-state spinor in a time-dependent field: Schrödinger's ``d psi/dt = I w psi / 2``, by rotors.

    The Hamiltonian is ``-w . sigma / 2``: for a magnetic moment, w is the gyromagnetic ratio times the magnetic field.
    The spin vector follows ``ds/dt = s x w``.

    Parameters
    ----------
    psi : array_like, (..., 4)
        The spinor at the first time. Leading axes are a batch.
    angular_velocity : callable
        Function from a time to the vector w, ``(..., 3)``; leading axes broadcast with those of `psi`.
    times : array_like, (T,)
    steps : int, optional
        Number of steps between two times.

    Returns
    -------
    array, (T, ..., 4)
        Spinors with the norm of `psi`.

    Raises
    ------
    TypeError, ValueError
        If shapes are inconsistent, or if a number is not finite.

    Notes
    -----
    The method is the Magnus expansion of fourth order (Iserles & Nørsett, 1999). It is exact if the direction of w is
    constant and w is at most cubic in time; otherwise the error decreases with the fourth power of the step.
    """
    start = real_array(psi, "psi", (4,), "Pauli spinors").astype(np.float64, copy=False)
    at = real_array(times, "times", (-1,), "times").astype(np.float64, copy=False)
    if at.ndim != 1 or not len(at) or not np.isfinite(at).all():
        raise ValueError(f"times: shape {at.shape}; expected (T,), finite")
    if isinstance(steps, bool) or not isinstance(steps, (int, np.integer)) or steps < 1:
        raise ValueError(f"steps: {steps!r}; expected a whole number, 1 or more")

    def velocity(t: float) -> Reals:
        return real_array(angular_velocity(t), "angular_velocity", (3,), "vectors")

    state = np.broadcast_to(start, (*np.broadcast_shapes(start.shape[:-1], velocity(float(at[0])).shape[:-1]), 4))
    history = np.empty((len(at), *state.shape))
    history[0] = state
    for i in range(1, len(at)):
        h = (at[i] - at[i - 1]) / steps
        for j in range(steps):
            first, second = (velocity(float(at[i - 1] + (j + node) * h)) for node in _NODES)
            state = spacetime.precession_step(state, h * first, h * second)
        history[i] = state
    if not np.isfinite(history).all():
        raise ValueError("psi, angular_velocity: infinite or not numbers; expected finite ones")
    return history


def dirac_columns(psi: ArrayLike) -> NDArray[np.complex128]:
    """Return columns of Dirac spinors, ``(..., 4)`` complex, from even elements ``(..., 8)``."""
    array = real_array(psi, "psi", (8,), "Dirac spinors").astype(np.float64, copy=False)
    parts = np.stack(spacetime.dirac_to_column(array), -2)
    return np.asarray(parts[..., 0] + 1j * parts[..., 1])


def dirac_spinors(columns: ArrayLike) -> Reals:
    """Return Dirac spinors, ``(..., 8)``, from columns ``(..., 4)`` of complex numbers."""
    array = np.asarray(unmasked(coordinates(columns, "columns"), "columns"))
    if array.dtype.kind not in "cfiub":
        raise TypeError(f"columns: dtype {array.dtype}; expected real or complex numbers")
    array = array.astype(np.complex128)
    if array.ndim == 0 or array.shape[-1] != 4:
        raise ValueError(f"columns: shape {array.shape}; expected (..., 4), columns of Dirac spinors")
    pairs = np.stack([array.real, array.imag], -1)
    return np.asarray(spacetime.dirac_from_column(*(pairs[..., k, :] for k in range(4))))


def free_dirac(psi: ArrayLike, size: ArrayLike, mass: float, time: float) -> Reals:
    """Propagate Dirac spinors on a periodic grid without a field: exact for the frequencies that the grid resolves.

    Parameters
    ----------
    psi : array_like, (nx, ny, nz, 8)
        Even elements of spacetime; along axes of one point the field is constant.
    size : array_like, (3,)
        Lengths of the box.
    mass : float
    time : float

    Returns
    -------
    array, (nx, ny, nz, 8)

    Raises
    ------
    TypeError, ValueError
        If shapes are inconsistent, if lengths are not positive, or if a number is not finite.

    Notes
    -----
    Each Fourier component of the column is multiplied by ``cos(w t) - i H sin(w t)/w``, with ``H = alpha . k + beta m``
    and ``w**2 = k**2 + m**2``. The total density ``psi ~psi g0 . g0`` is conserved to 1e-14.
    """
    array = real_array(psi, "psi", (-1, -1, -1, 8), "Dirac spinors of a grid").astype(np.float64, copy=False)
    if array.ndim != 4 or not array.size or not np.isfinite(array).all():
        raise ValueError(f"psi: shape {array.shape}; expected (nx, ny, nz, 8), finite, with points along every axis")
    lengths = real_array(size, "size", (3,), "lengths")
    if lengths.shape != (3,) or not (lengths > 0).all():
        raise ValueError(f"size: {lengths.tolist()}; expected three positive lengths")
    m, t = finite_number(mass, "mass"), finite_number(time, "time")
    axes = [2 * np.pi * np.fft.fftfreq(n, length / n) for n, length in zip(array.shape[:3], lengths, strict=True)]
    k = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    # H = alpha . k + beta m is the matrix of the element with k along the relative vectors gk g0 and m along g0
    element = np.zeros((*k.shape[:-1], 16))
    element[..., _AT_G0] = m
    element[..., _AT_RELATIVE] = k
    pairs = spacetime.dirac_to_matrix(element)
    hamiltonian = pairs[..., 0] + 1j * pairs[..., 1]
    frequency = np.sqrt((k * k).sum(-1) + m * m)[..., None]
    spectrum = np.fft.fftn(dirac_columns(array), axes=(0, 1, 2))
    applied = np.einsum("...ij,...j->...i", hamiltonian, spectrum)
    # sin(w t)/w at w = 0 is t
    part = t * np.sinc(frequency * t / np.pi)
    return dirac_spinors(np.fft.ifftn(np.cos(frequency * t) * spectrum - 1j * part * applied, axes=(0, 1, 2)))
