"""Electromagnetic fields ``F = E + I B`` in spacetime: plane waves, moving observers, energy and momentum.

Fields are bivectors of `generated.sta`, events and vectors have coefficients (t, x, y, z), and ``c = 1``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generated import spacetime, sta

from ..arguments import Reals, real_array
from ..precision import NEGLIGIBLE


def plane_wave(
    wave_vector: ArrayLike, electric: ArrayLike, events: ArrayLike, electric_sine: ArrayLike | None = None
) -> Reals:  # fmt: skip
    """Return the plane wave whose electric field is ``electric cos(phase) + electric_sine sin(phase)``.

    The phase is ``|k| t - k . x``. Equal and orthogonal amplitudes give circular polarisation.

    Parameters
    ----------
    wave_vector : array_like, (..., 3)
        A nonzero vector.
    electric : array_like, (..., 3)
        Orthogonal to the wave vector.
    events : array_like, (..., 4)
        (t, x, y, z).
    electric_sine : array_like, (..., 3), optional
        The default is zero.

    Returns
    -------
    array, (..., 6)
        Bivectors of `generated.sta`.

    Raises
    ------
    TypeError, ValueError
        If shapes are inconsistent, if a wave vector is zero, or if an amplitude is not orthogonal to it.
    """
    k = real_array(wave_vector, "wave_vector", (3,), "wave vectors").astype(np.float64, copy=False)
    frequency = np.linalg.norm(k, axis=-1, keepdims=True)
    if not (frequency > 0).all():
        raise ValueError("wave_vector: zero or not a number; expected a direction")
    potentials = []
    for name, given in (
        ("electric", electric),
        ("electric_sine", np.zeros(3) if electric_sine is None else electric_sine),
    ):
        amplitude = real_array(given, name, (3,), "electric fields").astype(np.float64, copy=False)
        along = np.abs((amplitude * k).sum(-1))
        if not (along <= NEGLIGIBLE * frequency[..., 0] * np.linalg.norm(amplitude, axis=-1)).all():
            raise ValueError(f"{name}: not orthogonal to wave_vector; expected a transverse field")
        # k ^ a has the relative vector -|k| a, the electric field
        potentials.append(_spatial(-amplitude / frequency))
    x = real_array(events, "events", (4,), "events (t, x, y, z)")
    lightlike = np.concatenate([frequency, k], -1)
    wave: Any = spacetime.electromagnetic_wave  # mypy takes seconds to find that unpacked arguments fit no overload
    return np.asarray(wave(lightlike, *potentials, x))


def field_seen_by(field: ArrayLike, velocity: ArrayLike) -> Reals:
    """Return the field in the coordinates of a moving observer: ``~R F R`` with the boost R to its velocity.

    Parameters
    ----------
    field : array_like, (..., 6)
    velocity : array_like, (..., 3)
        Velocity, slower than light.

    Raises
    ------
    TypeError, ValueError
        If shapes are inconsistent, or if a velocity is not below 1.
    """
    f = real_array(field, "field", (6,), "bivectors of spacetime")
    v = real_array(velocity, "velocity", (3,), "velocities")
    if not (np.linalg.norm(v, axis=-1) < 1).all():
        raise ValueError("velocity: 1 or more, or not a number; expected below 1, the speed of light")
    return np.asarray(sta.transform_bivector(sta.rotor_inverse(sta.boost_from_velocity(v)), f))


def stress_energy(field: ArrayLike) -> Reals:
    """Return the stress-energy tensor ``T(n) = F n ~F / 2`` as a matrix: ``T[m, n] = g^m . T(g^n)``.

    Parameters
    ----------
    field : array_like, (..., 6)

    Returns
    -------
    array, (..., 4, 4)
        Symmetric and traceless. ``T[0, 0]`` is the energy density, ``T[0, k]`` the Poynting vector ``E x B`` and
        ``-T[j, k]`` the Maxwell stress.

    Raises
    ------
    TypeError, ValueError
        If the shape is wrong.
    """
    f = real_array(field, "field", (6,), "bivectors of spacetime")
    columns = sta.field_stress_energy(f[..., None, :], np.diag([1.0, -1.0, -1.0, -1.0]))
    # both indices belong to reciprocal vectors: coefficients of T(g^n) are those along g^m
    return np.asarray(np.swapaxes(columns, -1, -2))


def _spatial(vectors: Reals) -> Reals:
    return np.concatenate([np.zeros_like(vectors[..., :1]), vectors], -1)
