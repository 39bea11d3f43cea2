"""The orientation of an inertial sensor, sample by sample."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import estimation as kernels

from ..arguments import Reals, real_array
from .orientation_starts import ALIGNMENT, OrientationSettings, contradicted, first_state, positive_rate
from .status import EstimationStatus

_FLOAT64 = np.dtype(np.float64)
_Sample = tuple[Reals, Reals, Reals, float]
"""Rate, acceleration, field and time."""


class _Reading(NamedTuple):
    """What a state of the kernel says."""

    rotor: Reals
    bias: Reals
    covariance: Reals
    conditions: Reals


class OrientationFilter:
    """Estimate the orientation of an inertial sensor, with or without a magnetometer, sample by sample.

    It is the filter of `estimate_orientation`, with the same estimates: those after each sample use the samples up to
    this one. During the first two seconds, the first orientation is that of all samples so far, and is estimated again
    when a property is read; from then on, an update takes 1.3 microseconds.

    Parameters
    ----------
    rate : float
        Samples per second, for updates without a time.
    settings : OrientationSettings, optional

    Raises
    ------
    TypeError, ValueError
        If the rate is not a positive number or a setting is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from algorithms.estimation import OrientationFilter
    >>> f = OrientationFilter()
    >>> for k in range(300):
    ...     f.update(gyr=[0, 0, 0], acc=[0, 0, 9.81], mag=[0, 20, -40], time=0.01 * k)
    >>> f.status.name, f.at_rest
    ('OK', True)
    >>> np.abs(f.rotor - [1, 0, 0, 0]).max() < 1e-9
    np.True_

    Notes
    -----
    Several sensors that are read at the same times are one filter with samples (..., 3); the first update determines
    the leading axes of all properties. `pickle` and `copy.deepcopy` store a filter, which continues where it was.
    """

    def __init__(self, rate: float = 285.7, settings: OrientationSettings | None = None) -> None:
        self._rate, self._settings = positive_rate(rate), settings or OrientationSettings()
        self._shape: tuple[int, ...] | None = None
        self._no_field = self._state = self._spare = self._numbers = np.empty(0)
        self._first: list[_Sample] | None = []
        self._time, self._last_stamp, self._n_after = -np.inf, 0.0, -1
        self._n_updates, self._is_late = 0, False
        self._read: _Reading | None = None

    def update(self, gyr: ArrayLike, acc: ArrayLike, mag: ArrayLike | None = None, time: float | None = None) -> None:
        """Update the estimate by one sample.

        Parameters
        ----------
        gyr, acc : array_like, (..., 3)
            Rates in rad/s, and accelerations in m/s2 including the reaction to gravity. Numbers that are not finite
            were not measured.
        mag : array_like, (..., 3), optional
            The magnetic field in any unit, if it was measured with this sample.
        time : float, optional
            In seconds. If it is not after that of the previous sample, or not finite, the sample is left out, and the
            status is BAD_TIME. Without it, the time since the previous sample is the inverse of the rate.

        Raises
        ------
        TypeError, ValueError
            If an argument has a wrong shape or type.
        """
        if type(gyr) is not np.ndarray or gyr.shape != self._shape or gyr.dtype is not _FLOAT64:
            gyr = self._checked(gyr, "gyr")
        if type(acc) is not np.ndarray or acc.shape != self._shape or acc.dtype is not _FLOAT64:
            acc = self._checked(acc, "acc")
        if mag is None:
            mag = self._no_field
        elif type(mag) is not np.ndarray or mag.shape != self._shape or mag.dtype is not _FLOAT64:
            mag = self._checked(mag, "mag")
        before, now = self._time, self._now(time)
        self._n_updates, self._read, self._is_late = self._n_updates + 1, None, not before < now < np.inf
        if self._is_late:
            return
        self._time = now
        if self._first is not None:
            self._begin((gyr.copy(), acc.copy(), mag.copy(), now))
            return
        kernels.orientation_step(gyr, acc, mag, now - before, self._state, self._numbers, out=self._spare)
        self._state, self._spare = self._spare, self._state

    @property
    def rotor(self) -> Reals:
        """(..., 4) The rotor 1 e12 e13 e23 from the frame of the sensor to that of the earth, z upwards, y to north."""
        return self._reading.rotor

    @property
    def bias(self) -> Reals:
        """(..., 3) rad/s. The bias of the gyroscope."""
        return self._reading.bias

    @property
    def covariance(self) -> Reals:
        """(..., 3, 3) rad2. Of the rotation about the axes of the earth, according to the settings.

        It grows where rates are missing or saturated, by the rotation that may have been missed, and where the magnetic
        field is no longer the one that the heading relies on.
        """
        return self._reading.covariance

    @property
    def at_rest(self) -> Reals:
        """(...) bool. Whether the sensor is at rest."""
        return np.asarray(self._reading.conditions[..., 0] > 0)[()]

    @property
    def delay(self) -> Reals:
        """(...) s. The estimated delay of the magnetometer relative to the gyroscope."""
        return np.asarray(self._reading.conditions[..., 1])[()]

    @property
    def disturbance(self) -> Reals:
        """(...) The difference of the magnetic field from its mean of the past, relative to the mean."""
        return np.asarray(np.sqrt(self._reading.conditions[..., 2]))[()]

    @property
    def n_skipped(self) -> Reals:
        """(..., 3) int. How many rates, accelerations and fields were not measured, not finite, or came late."""
        return np.asarray(self._n_updates - self._reading.conditions[..., 7:].astype(int))

    @property
    def status(self) -> EstimationStatus | Reals:
        """The status after the last update: an `EstimationStatus`, or for several sensors an array (...) of them.

        BAD_TIME if its time is not after the previous one, UNOBSERVED before the first finite rate and acceleration,
        SKIPPED if neither of the last sample is finite, INCONSISTENT if rates are at the limit of their range,
        accelerations contradict the orientation, as without gravity or in wrong units, or mean velocities or headings
        contradicted their noise, until as much evidence speaks for it. Without a magnetometer, the heading is then
        still that of the rates before.
        """
        conditions, s = self._reading.conditions, EstimationStatus
        doubted = (conditions[..., 3] > 0) | contradicted(conditions, self._settings)
        status = np.where(doubted, s.INCONSISTENT, s.OK)
        status = np.where(conditions[..., 6] > 0, status, s.SKIPPED)
        status = np.where((conditions[..., 7:9] > 0).all(-1), status, s.UNOBSERVED)
        if self._is_late:
            status = np.full_like(status, s.BAD_TIME)
        return status if status.ndim else s(int(status))

    def _checked(self, value: ArrayLike, name: str) -> Reals:
        array = real_array(value, name, (3,), "a vector").astype(float)
        if self._shape is None:
            self._shape, self._no_field = array.shape, np.full(array.shape, np.nan)
        if array.shape != self._shape:
            raise ValueError(f"{name}: shape {array.shape}; expected {self._shape}, as in the first update")
        return array

    def _now(self, time: float | None) -> float:
        if time is None:
            # As a multiple of the step, which sums of steps would differ from by rounding.
            self._n_after += 1
            return self._last_stamp + self._n_after / self._rate
        if not isinstance(time, (int, float, np.integer, np.floating)) or isinstance(time, bool):
            raise TypeError(f"time: {time!r}; expected a number of seconds")
        if self._time < time < np.inf:
            self._last_stamp, self._n_after = float(time), 0
        return float(time)

    def _begin(self, sample: _Sample) -> None:
        """Store a sample of the first seconds; the last one of these completes the first orientation."""
        assert self._first is not None
        self._first.append(sample)
        if sample[3] >= self._first[0][3] + ALIGNMENT:
            self._state, self._numbers = self._aligned(self._first)
            self._first, self._spare = None, np.empty_like(self._state)

    def _aligned(self, samples: list[_Sample]) -> tuple[Reals, Reals]:
        """Return the state after the first samples, whose mean determines the first orientation, and the settings."""
        shape = self._shape or (3,)
        parts = [np.array([each[k] for each in samples]).reshape(-1, *shape) for k in range(3)]
        times = np.array([each[3] for each in samples])
        rates, forces, fields = (np.moveaxis(part, 0, -2) for part in parts)
        state, numbers, step = first_state(rates, forces, fields, times, self._rate, self._settings)
        for gyr, acc, mag, dt in zip(*parts, np.diff(times, prepend=times[:1] - step), strict=True):
            state = kernels.orientation_step(gyr, acc, mag, dt, state, numbers)
        return state, numbers

    @property
    def _reading(self) -> _Reading:
        if self._read is None:
            first = self._first
            state, numbers = (self._state, self._numbers) if first is None else self._aligned(first)
            self._read = _Reading(*kernels.orientation_reading(state, numbers))
        return self._read
