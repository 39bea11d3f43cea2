"""Inertial measurements between two poses, summed once for all linearisations (preintegration)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import motor_graphs as kernels

from ..arguments import Reals, finite, real_array
from ..evidence.triangles import from_triangle


@dataclass(frozen=True, slots=True, eq=False)
class InertialSum:
    """Inertial samples between two states, as from `preintegrate`."""

    motion: Reals
    """(8,) The rotation, from the last frame to the first, and the change of the velocity in the first frame."""
    place: Reals
    """(3,) The change of the place in the first frame, without gravity and the first velocity."""
    duration: float
    """In seconds."""
    bias: Reals
    """(6,) The bias of rates and of forces that was subtracted."""
    by_bias: Reals
    """(9, 6) Derivatives of the rotation, the change of the velocity, and the place by the bias."""
    covariance: Reals
    """(9, 9) Of the same nine numbers, the rotation as an error in the last frame."""


def preintegrate(
    rates: ArrayLike, forces: ArrayLike, dt: ArrayLike, noise: ArrayLike, bias: ArrayLike = (0.0,) * 6
) -> InertialSum:
    """Sum the samples of an inertial sensor between two states.

    Parameters
    ----------
    rates : array_like, (n, 3)
        Angular rates in radians per second, in the frame of the sensor.
    forces : array_like, (n, 3)
        What the accelerometer measures: the acceleration minus gravity, in the frame of the sensor.
    dt : array_like, (n,) or scalar
        How long each sample lasts, in seconds.
    noise : array_like, (2,)
        Variances of rates and forces per hertz: the squares of the noise densities in data sheets.
    bias : array_like, (6,), optional
        Of rates and forces, near the true one. Sums are corrected to first order for others.

    Returns
    -------
    InertialSum

    Raises
    ------
    TypeError, ValueError
        If arguments have other shapes or types or are not finite, if times or variances are not positive, or if there
        are less than two samples, whose covariance is singular.

    Notes
    -----
    Rates and forces count as constant during a sample. The sum is then exact to rounding, for rotations of up to a
    radian in a sample, with the covariance to first order (Forster et al., *On-Manifold Preintegration*, 2017).

    Examples
    --------
    >>> rising = preintegrate(np.zeros((100, 3)), np.tile([0, 0, 10.81], (100, 1)), 0.01, [1e-6, 1e-4])
    >>> rising.duration, rising.place.round(6).tolist()
    (1.0, [0.0, 0.0, 5.405])
    """
    turning = finite(real_array(rates, "rates", (-1, 3), "vectors").astype(float), "rates")
    pushing = finite(real_array(forces, "forces", (len(turning), 3), "vectors").astype(float), "forces")
    if turning.ndim != 2 or len(turning) < 2:
        raise ValueError(f"rates: shape {turning.shape}; expected (n, 3), at least two samples")
    times = finite(real_array(dt, "dt").astype(float), "dt")
    if times.shape not in ((), (len(turning),)) or not (times > 0).all():
        raise ValueError(f"dt: shape {times.shape}, least {times.min(initial=np.inf)}; expected positive seconds, (n,)")
    variances = finite(real_array(noise, "noise", (2,)).astype(float), "noise")
    if variances.shape != (2,) or not (variances > 0).all():
        raise ValueError(f"noise: {variances}; expected two positive variances per hertz")
    subtracted = finite(real_array(bias, "bias", (6,)).astype(float), "bias").reshape(6)
    times = np.broadcast_to(times, (len(turning),)).copy()
    motion, place, by_bias, spread = kernels.preintegrate(turning, pushing, times, subtracted, variances)
    return InertialSum(motion, place, float(times.sum()), subtracted, by_bias, from_triangle(spread, 9))
