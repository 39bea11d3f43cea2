"""The orientation of an inertial sensor, with or without a magnetometer, from a recording."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import estimation as kernels

from ..arguments import Reals, real_array
from .orientation_starts import OrientationSettings, contradicted, first_state, positive_rate
from .status import EstimationStatus


@dataclass(frozen=True, slots=True, eq=False)
class Orientation:
    """Result of `estimate_orientation`."""

    rotors: Reals
    """(..., n, 4) 1 e12 e13 e23, from the frame of the sensor to that of the earth, z upwards, y to magnetic north."""
    biases: Reals
    """(..., n, 3) rad/s. The bias of the gyroscope."""
    deviations: Reals
    """(..., n, 3) rad. Standard deviations of the rotation about the axes of the earth, according to the settings. They
    grow where rates are missing or saturated, by the rotation that may have been missed, and where the magnetic field
    is no longer the one that the heading relies on."""
    at_rest: Reals
    """(..., n) bool. Whether the sensor is at rest."""
    disturbance: Reals
    """(..., n) The difference of the magnetic field from its mean of the past, relative to the mean."""
    delays: Reals
    """(..., n) s. The estimated delay of the magnetometer relative to the gyroscope."""
    n_skipped: Reals
    """(..., 3) int. The numbers of samples of the gyroscope, the accelerometer and the magnetometer that were skipped
    because they are not finite or their time is not after that of the previous sample."""
    status: Reals
    """(...) int, an `EstimationStatus` each: SKIPPED if no rate or no acceleration is finite, INCONSISTENT if rates are
    at the limit of their range, accelerations lead to impossible speeds, as without gravity or in wrong units, or mean
    velocities or headings over `return_time` contradict their noise, as for a wrong scale, wrong axes, a delay of the
    rates, or an acceleration that lasts, or if the field follows less than half of the rotation."""


def orientation(
    gyr: ArrayLike,
    acc: ArrayLike,
    mag: ArrayLike | None = None,
    rate: float = 285.7,
    *,
    times: ArrayLike | None = None,
    settings: OrientationSettings | None = None,
) -> Reals:
    """Estimate the orientation of an inertial sensor; the rotors (..., n, 4) of `estimate_orientation`.

    Parameters
    ----------
    gyr, acc, mag : array_like, (..., n, 3)
        Rates in rad/s, accelerations in m/s2 including the reaction to gravity, and the magnetic field in any unit.
    rate : float
        Samples per second.
    times, settings
        As for `estimate_orientation`.

    Returns
    -------
    array, (..., n, 4)
        Rotors of `generated.vga3`, from the frame of the sensor to that of the earth.
    """
    return estimate_orientation(gyr, acc, mag, rate, times=times, settings=settings).rotors


def estimate_orientation(
    gyr: ArrayLike,
    acc: ArrayLike,
    mag: ArrayLike | None = None,
    rate: float = 285.7,
    *,
    times: ArrayLike | None = None,
    settings: OrientationSettings | None = None,
) -> Orientation:
    """Estimate the orientation of an inertial sensor for every sample of a recording.

    An error-state Kalman filter estimates the rotation, the bias of the gyroscope and a horizontal velocity, which is 0
    on average because the sensor remains in reach; so accelerations tilt the estimate only as far as they last. The
    magnetic field corrects the heading alone, with less weight the more its size and dip differ from their means, and
    is moved to the time of the rates by a delay that is estimated from the recording. The first two seconds determine
    the first orientation; apart from this, the estimate at a sample uses no later samples.

    Parameters
    ----------
    gyr, acc : array_like, (..., n, 3)
        Rates in rad/s, and accelerations in m/s2 including the reaction to gravity: at rest, they point upwards.
        Samples that are not finite are skipped and counted.
    mag : array_like, (..., n, 3), optional
        The magnetic field in any unit. Without it, the heading is that of the gyroscope, and 0 at the beginning.
    rate : float
        Samples per second.
    times : array_like, (n,), optional
        Time stamps in seconds, instead of `rate`. Samples whose time is not after all previous times are skipped.
    settings : OrientationSettings, optional

    Returns
    -------
    Orientation

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or the rate is not positive.

    Notes
    -----
    The rate of a sample is held since the previous sample, as in other filters (VQF).

    Some errors leave no trace. Without a magnetometer, a wrong scale or a delay of turns about the vertical, or a bias
    about it, is not seen: the deviations contain only the `rate_error` and the first bias of the settings. An
    acceleration that lasts from the first sample on, or a constant error of the accelerometer while the sensor hardly
    turns, equals a tilt by its ratio to gravity, which the deviations do not contain. Iron beside a sensor that never
    turns is part of the field.
    """
    s = settings or OrientationSettings()
    per_second = positive_rate(rate)
    rates, forces = (real_array(x, name, (-1, 3), "vectors").astype(float) for x, name in ((gyr, "gyr"), (acc, "acc")))
    shape = rates.shape[:-2]
    n = rates.shape[-2]
    fields = np.full((n, 3), np.nan) if mag is None else real_array(mag, "mag", (-1, 3), "vectors").astype(float)
    for name, other in (("acc", forces), ("mag", fields)):
        if other.shape[-2] != n:
            raise ValueError(f"{name}: {other.shape[-2]} samples; expected {n}, as many as gyr has")
    leading = np.broadcast_shapes(shape, forces.shape[:-2], fields.shape[:-2])
    stamps, known = _stamps(n, per_second, times)
    rates, forces, fields = (np.broadcast_to(x, (*leading, n, 3))[..., known, :] for x in (rates, forces, fields))
    if n and not len(stamps):
        stamps, (rates, forces, fields) = np.zeros(1), np.full((3, *leading, 1, 3), np.nan)
    finite = np.stack([np.isfinite(each).all(-1) for each in (rates, forces, fields)], -1).sum(-2)
    skipped = n - finite
    if mag is None:
        skipped[..., 2] = 0
    status = np.where((finite[..., :2] == 0).any(-1), EstimationStatus.SKIPPED, EstimationStatus.OK)
    state, numbers, step = first_state(rates, forces, fields, stamps, per_second, s)
    steps = np.diff(stamps, prepend=stamps[:1] - step)
    found = kernels.orientation_filter(rates, forces, fields, steps, state, numbers)
    doubted = found[3][..., -1:, 3].any(-1) | contradicted(found[3], s).any(-1)
    status = np.where((status == EstimationStatus.OK) & doubted, EstimationStatus.INCONSISTENT, status)
    # A sample that is skipped leaves the estimate as it was before; the first ones have that of the first known one.
    rows = slice(None) if known.all() else np.maximum(np.cumsum(known) - 1, 0)
    rotors, biases, variances, conditions = (each[..., rows, :] for each in found)
    return Orientation(
        rotors,
        biases,
        np.sqrt(np.maximum(variances, 0)),
        conditions[..., 0] > 0,
        np.sqrt(conditions[..., 2]),
        conditions[..., 1],
        skipped,
        status,
    )


def _stamps(n: int, rate: float, times: ArrayLike | None) -> tuple[Reals, Reals]:
    """Return the increasing times of the samples that are used, and which of the n samples are."""
    if times is None:
        return np.arange(n) / rate, np.ones(n, bool)
    stamps = real_array(times, "times", (-1,)).astype(float)
    if stamps.shape != (n,):
        raise ValueError(f"times: shape {stamps.shape}; expected ({n},), one for each sample of gyr")
    finite = np.where(np.isfinite(stamps), stamps, -np.inf)
    before = np.maximum.accumulate(np.concatenate([[-np.inf], finite]))[:-1]
    known = finite > before
    return stamps[known], known
