"""Spinors in numbers: two-state systems in a field, and Dirac's free equation on a periodic grid.

Pauli spinors are even elements of G(3) (``1 e12 e13 e23``), Dirac spinors even elements of G(1,3), with the layouts of
`generated.vga3` and `generated.sta`; ``hbar = c = 1``. `generated.spacetime` has the maps to columns and matrices.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import spacetime

from ..arguments import Reals, finite_number, real_array

_NODES = 0.5 + np.array([-1.0, 1.0]) * np.sqrt(3) / 6
"""Where in a step the field is taken: the nodes of Gauss's quadrature of two points."""
_BLADES = spacetime.dirac_to_matrix.layouts["a"].blades
_AT_G0, *_AT_RELATIVE = (_BLADES.index(name) for name in ("g0", "g10", "g20", "g30"))


def precess(
    psi: ArrayLike, angular_velocity: Callable[[float], ArrayLike], times: ArrayLike, steps: int = 1
) -> Reals:  # fmt: skip
    """Return a two-state spinor in a field that changes with time: Schrödinger's ``d psi/dt = I w psi / 2``, a rotor a step.

    The Hamiltonian is ``-w . sigma / 2``: for a magnetic moment, w is the gyromagnetic ratio times the magnetic field.
    The spin vector follows ``ds/dt = s x w``.

    Parameters
    ----------
    psi : array_like, (..., 4)
        At the first time. Leading axes are a batch.
    angular_velocity : callable
        The vector w at a time, ``(..., 3)``; leading axes broadcast with those of `psi`.
    times : array_like, (T,)
    steps : int, optional
        Steps between two times.

    Returns
    -------
    array, (T, ..., 4)
        Each of the length that `psi` has.

    Raises
    ------
    TypeError, ValueError
        If shapes do not fit or something is not finite.

    Notes
    -----
    Magnus's expansion of fourth order (Iserles & Nørsett, 1999): exact where the direction of w stays the same and w is
    at most cubic in time, otherwise the error falls with the fourth power of the step.
    """
    start = real_array(psi, "psi", (4,), "Pauli spinors").astype(np.float64, copy=False)
    at = real_array(times, "times", (-1,), "times").astype(np.float64, copy=False)
    if at.ndim != 1 or not len(at) or not np.isfinite(at).all():
        raise ValueError(f"times: shape {at.shape}; expected (T,), finite")
    if isinstance(steps, bool) or not isinstance(steps, (int, np.integer)) or steps < 1:
        raise ValueError(f"steps: {steps!r}; expected a whole number, 1 or more")

    def turned(t: float) -> Reals:
        return real_array(angular_velocity(t), "angular_velocity", (3,), "vectors")

    state = np.broadcast_to(start, (*np.broadcast_shapes(start.shape[:-1], turned(float(at[0])).shape[:-1]), 4))
    history = np.empty((len(at), *state.shape))
    history[0] = state
    for i in range(1, len(at)):
        h = (at[i] - at[i - 1]) / steps
        for j in range(steps):
            first, second = (turned(float(at[i - 1] + (j + node) * h)) for node in _NODES)
            state = spacetime.precession_step(state, h * first, h * second)
        history[i] = state
    if not np.isfinite(history).all():
        raise ValueError("psi, angular_velocity: infinite or not numbers; expected finite ones")
    return history


def dirac_columns(psi: ArrayLike) -> NDArray[np.complex128]:
    """Return the columns of Dirac spinors, ``(..., 4)`` complex, of even elements ``(..., 8)``."""
    array = real_array(psi, "psi", (8,), "Dirac spinors").astype(np.float64, copy=False)
    parts = np.stack(spacetime.dirac_to_column(array), -2)
    return np.asarray(parts[..., 0] + 1j * parts[..., 1])


def dirac_spinors(columns: ArrayLike) -> Reals:
    """Dirac spinors, ``(..., 8)``, of columns ``(..., 4)`` of complex numbers."""
    array = np.asarray(columns, np.complex128)
    if array.ndim == 0 or array.shape[-1] != 4:
        raise ValueError(f"columns: shape {array.shape}; expected (..., 4), columns of Dirac spinors")
    pairs = np.stack([array.real, array.imag], -1)
    return np.asarray(spacetime.dirac_from_column(*(pairs[..., k, :] for k in range(4))))


def free_dirac(psi: ArrayLike, size: ArrayLike, mass: float, time: float) -> Reals:
    """Dirac spinors on a periodic grid after some time without a field: exact for what the grid resolves.

    Parameters
    ----------
    psi : array_like, (nx, ny, nz, 8)
        Even elements of spacetime; axes of one point are axes along which nothing changes.
    size : array_like, (3,)
        The lengths of the box.
    mass : float
    time : float

    Returns
    -------
    array, (nx, ny, nz, 8)

    Raises
    ------
    TypeError, ValueError
        If shapes do not fit, lengths are not positive, or something is not finite.

    Notes
    -----
    Each Fourier component of the column turns by ``cos(w t) - i H sin(w t)/w``, ``H = alpha . k + beta m``,
    ``w**2 = k**2 + m**2``. The total density ``psi ~psi g0 . g0`` stays the same to 1e-14.
    """
    array = real_array(psi, "psi", (-1, -1, -1, 8), "Dirac spinors of a grid").astype(np.float64, copy=False)
    if array.ndim != 4 or not np.isfinite(array).all():
        raise ValueError(f"psi: shape {array.shape}; expected (nx, ny, nz, 8), finite")
    lengths = real_array(size, "size", (3,), "lengths")
    if lengths.shape != (3,) or not (lengths > 0).all():
        raise ValueError(f"size: {lengths.tolist()}; expected three positive lengths")
    m, t = finite_number(mass, "mass"), finite_number(time, "time")
    axes = [2 * np.pi * np.fft.fftfreq(n, length / n) for n, length in zip(array.shape[:3], lengths, strict=True)]
    k = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    # H = alpha . k + beta m is the matrix of (k + m) with relative vectors gk g0, and g0
    element = np.zeros((*k.shape[:-1], 16))
    element[..., _AT_G0] = m
    element[..., _AT_RELATIVE] = k
    pairs = spacetime.dirac_to_matrix(element)
    hamiltonian = pairs[..., 0] + 1j * pairs[..., 1]
    frequency = np.sqrt((k * k).sum(-1) + m * m)[..., None]
    spectrum = np.fft.fftn(dirac_columns(array), axes=(0, 1, 2))
    turned = np.einsum("...ij,...j->...i", hamiltonian, spectrum)
    # sin(w t)/w at w = 0 is t
    part = t * np.sinc(frequency * t / np.pi)
    return dirac_spinors(np.fft.ifftn(np.cos(frequency * t) * spectrum - 1j * part * turned, axes=(0, 1, 2)))
