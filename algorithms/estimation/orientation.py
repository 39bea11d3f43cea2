"""The orientation of an inertial sensor, with or without a magnetometer, from a recording."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import estimation as kernels
from generated import vga3

from ..arguments import Reals, finite, finite_number, real_array
from .orientation_evidence import gaps, is_too_fast
from .status import EstimationStatus

_STATES = 8
_ALIGNMENT = 2.0
"""s. The first orientation is that of the mean acceleration and field of this time."""
_SHORTEST = 1e-6
"""s. Samples without a valid time step advance by this."""
_FIELD_NOISE, _LIKELY_DELAY, _LONGEST_DELAY = 0.02, 0.01, 0.05
"""Noise of the field relative to its size; the standard deviation of its delay before it is estimated; a limit."""
_FIRST_TURN, _FIRST_BIAS, _FIRST_VELOCITY = 0.1, 0.02, 0.3
_FIRST_HEADING = 0.3


@dataclass(frozen=True, slots=True)
class OrientationSettings:
    """Physical assumptions of `estimate_orientation`. The defaults are meant for what people and robots carry about."""

    gravity: float = 9.81
    """m/s2"""
    rate_noise: float = 0.0005
    """rad/s/sqrt(Hz). Noise density of the gyroscope at rest."""
    rate_error: float = 0.0022
    """Errors of scale and of axes of the gyroscope, as noise in relation to the rate, in sqrt(s)."""
    bias_walk: float = 1e-4
    """rad/s2/sqrt(Hz). The random walk of the bias."""
    velocity: float = 0.1
    """m/s sqrt(s). The velocity is 0 on average; how much it may differ, for small accelerations."""
    velocity_ratio: float = 0.05
    """The same in relation to the root mean square of the accelerations of the last moments, in s sqrt(s)."""
    level_time: float = 1.0
    """s. Time constant of that mean square."""
    heading_noise: float = 0.18
    """rad sqrt(s). Noise of the heading of an undisturbed magnetic field."""
    disturbance: float = 8.0
    """The same in relation to the relative change of the field."""
    field_time: float = 20.0
    """s. Time after which a changed field counts as undisturbed."""
    speed: float = 5.0
    """m/s. The largest speed: accelerations that lead to more contradict the orientation."""
    rest_rate: float = 0.035
    """rad/s. At rest, rates differ by less than this from their mean, and the mean is less than twice this."""
    rest_acceleration: float = 0.5
    """m/s2. At rest, accelerations differ by less than this from their mean."""
    rest_time: float = 1.5
    """s. The sensor is at rest if it was quiet for this long."""
    rest_noise: float = 0.003
    """rad/s sqrt(s). Noise of the bias as measured at rest."""


@dataclass(frozen=True, slots=True, eq=False)
class Orientation:
    """Result of `estimate_orientation`."""

    rotors: Reals
    """(..., n, 4) 1 e12 e13 e23, from the frame of the sensor to that of the earth, z upwards, y to magnetic north."""
    biases: Reals
    """(..., n, 3) rad/s. The bias of the gyroscope."""
    deviations: Reals
    """(..., n, 3) rad. Standard deviations of the rotation about the axes of the earth, according to the settings. They
    grow where rates are missing or saturated, by the rotation that may have been missed, and remain so."""
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
    at the limit of their range or accelerations lead to impossible speeds, as without gravity or in wrong units."""


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
    """
    s = settings or OrientationSettings()
    rates, forces = (real_array(x, name, (-1, 3)).astype(float) for x, name in ((gyr, "gyr"), (acc, "acc")))
    shape = rates.shape[:-2]
    n = rates.shape[-2]
    fields = np.full((n, 3), np.nan) if mag is None else real_array(mag, "mag", (-1, 3)).astype(float)
    for name, other in (("acc", forces), ("mag", fields)):
        if other.shape[-2] != n:
            raise ValueError(f"{name}: {other.shape[-2]} samples; expected {n}, as many as gyr has")
    leading = np.broadcast_shapes(shape, forces.shape[:-2], fields.shape[:-2])
    steps, late = _steps(n, rate, times)
    rates, forces, fields = (np.array(np.broadcast_to(x, (*leading, n, 3))) for x in (rates, forces, fields))
    for each in (rates, forces, fields):
        each[..., late, :] = np.nan
    bad = np.stack([~np.isfinite(each).all(-1) for each in (rates, forces, fields)], -1)
    skipped = bad.sum(-2)
    if mag is None:
        skipped[..., 2] = 0
    status = np.where((skipped[..., :2] == n).any(-1), EstimationStatus.SKIPPED, EstimationStatus.OK)
    first = _first(rates, forces, fields, steps)
    upwards = s.gravity * vga3.rotate_vector(vga3.rotor_inverse(first), np.array([0.0, 0, 1]))
    variances = np.zeros((*leading, _STATES))
    variances[...] = [_FIRST_TURN**2] * 2 + [0.0] + [_FIRST_BIAS**2] * 3 + [_FIRST_VELOCITY**2] * 2
    has_field = skipped[..., 2] < n if mag is not None else np.zeros(leading, bool)
    variances[..., 2] = np.where(has_field, _FIRST_HEADING**2, 0)
    triangle = np.zeros((*leading, _STATES * (_STATES + 1) // 2))
    rows, columns = np.triu_indices(_STATES)
    triangle[..., rows == columns] = variances
    numbers = _numbers(s, float(np.median(steps)) if n else 1.0)
    rotors, biases, spreads, conditions = kernels.orientation_filter(
        rates, forces, fields, steps, first, np.zeros(3), upwards, triangle, np.zeros(3), numbers
    )
    missed = gaps(rates, steps)
    contradicted = is_too_fast(rotors, forces, steps, s.gravity, s.speed) | missed.saturated.any(-1)
    status = np.where((status == EstimationStatus.OK) & contradicted, EstimationStatus.INCONSISTENT, status)
    return Orientation(
        rotors,
        biases,
        np.sqrt(np.maximum(spreads, 0) + missed.variances[..., None]),
        conditions[..., 0] > 0,
        np.sqrt(conditions[..., 2]),
        conditions[..., 1],
        skipped,
        status,
    )


def _steps(n: int, rate: float, times: ArrayLike | None) -> tuple[Reals, Reals]:
    """Return time steps (n,), and which samples have a time that is not after all previous ones."""
    if times is None:
        per_second = finite_number(rate, "rate")
        if per_second <= 0:
            raise ValueError(f"rate: {rate}; expected a positive number of samples per second")
        return np.full(n, 1 / per_second), np.zeros(n, bool)
    stamps = real_array(times, "times", (-1,)).astype(float)
    if stamps.shape != (n,):
        raise ValueError(f"times: shape {stamps.shape}; expected ({n},), one for each sample of gyr")
    known = np.where(np.isfinite(stamps), stamps, -np.inf)
    before = np.maximum.accumulate(np.concatenate([[-np.inf], known[:-1]])) if n else known
    late = known <= before
    late[:1] = not np.isfinite(stamps[:1]).all()
    after = np.subtract(known, before, where=~late & np.isfinite(before), out=np.full(n, np.nan))
    usual = np.median(after[np.isfinite(after)]) if np.isfinite(after).any() else _SHORTEST
    steps = np.where(late, _SHORTEST, after)
    return np.where(np.isfinite(steps), steps, usual), late


def _first(rates: Reals, forces: Reals, fields: Reals, steps: Reals) -> Reals:
    """Return the rotors from the frame before the first sample to the earth, by the mean of the first seconds."""
    n = int(np.searchsorted(np.cumsum(steps), _ALIGNMENT)) + 1
    up, north = kernels.mean_directions(*(each[..., :n, :] for each in (rates, forces, fields)), steps[:n])  # type: ignore[call-overload]
    level = _between(up, np.array([0.0, 0, 1]))
    level_north = vga3.rotate_vector(level, north)
    level_north[..., 2] = 0
    return np.asarray(vga3.rotor_product(_between(level_north, np.array([0.0, 1, 0])), level))


def _between(a: Reals, b: Reals) -> Reals:
    """Return the rotors that take vectors to the direction b; 1 for the vector 0."""
    size = np.linalg.norm(a, axis=-1, keepdims=True)
    unit = np.where(size > 0, a / np.where(size > 0, size, 1), b)
    return np.asarray(vga3.rotor_between_vectors(unit, b))


def _numbers(s: OrientationSettings, step: float) -> Reals:
    """Return the settings of the kernel."""
    prior = 2 * (_FIELD_NOISE / step / _LIKELY_DELAY) ** 2
    values = [
        s.gravity, s.rate_noise**2, s.rate_error**2, s.bias_walk**2, s.velocity**2, s.velocity_ratio**2, s.level_time,
        s.rest_rate**2, s.rest_acceleration**2, s.rest_time, s.rest_noise**2, s.heading_noise**2, s.disturbance**2,
        s.field_time, prior, _LONGEST_DELAY,
    ]  # fmt: skip
    return finite(np.array(values), "settings")
