"""The settings of orientation filters and their state before the first sample, by the mean of the first seconds."""

from __future__ import annotations

from dataclasses import dataclass
from math import log

import numpy as np

from generated import estimation as kernels
from generated import vga3

from ..arguments import Reals, finite, finite_number
from ..evidence.status import WRONG
from ..evidence.triangles import to_triangle

_STATES = 8
"""The number of states: rotation, bias and mean velocity."""
ALIGNMENT = 2.0
"""s. The first orientation is that of the mean acceleration and field of this time."""
_FIELD_NOISE, _LIKELY_DELAY, _LONGEST_DELAY = 0.02, 0.01, 0.05
"""Noise of the field relative to its size; the standard deviation of its delay before it is estimated; a limit."""
_FIRST_TURN, _FIRST_BIAS, _FIRST_VELOCITY = 0.1, 0.02, 0.3
"""Standard deviations at the start: of the inclination in rad, of the bias in rad/s and of velocities in m/s."""
_FIRST_HEADING = 0.3
"""The standard deviation of the heading at the start, in rad, if the magnetic field is seen."""


@dataclass(frozen=True, slots=True)
class OrientationSettings:
    """Physical assumptions of `estimate_orientation` and `OrientationFilter`.

    The defaults are meant for what people and robots carry about.
    """

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
    return_time: float = 4.0
    """s. Mean velocities over times as long are independent of each other: within it, what is carried about moves there
    and back."""
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


def contradicted(conditions: Reals, s: OrientationSettings) -> Reals:
    """Return whether conditions (..., k) of the kernel contradict the settings at a sample."""
    return np.asarray((conditions[..., 4] > (2 * s.speed) ** 2) | (conditions[..., 5] > -log(WRONG)))


def positive_rate(rate: float) -> float:
    """Return a number of samples per second, or raise ValueError or TypeError."""
    if finite_number(rate, "rate") <= 0:
        raise ValueError(f"rate: {rate}; expected a positive number of samples per second")
    return float(rate)


def first_state(
    rates: Reals, forces: Reals, fields: Reals, times: Reals, rate: float, s: OrientationSettings
) -> tuple[Reals, Reals, float]:
    """Return the states before the first sample, the settings of kernels, and the time step of the first sample.

    They depend on samples (..., n, 3) at increasing times (n,) of the first seconds only, and on the usual rate if
    there is one sample.
    """
    n = int(np.searchsorted(times, times[0] + ALIGNMENT)) + 1 if len(times) else 0
    times = times[:n]
    rates, forces, fields = (each[..., :n, :] for each in (rates, forces, fields))
    step = float(np.median(np.diff(times))) if len(times) > 1 else 1 / rate
    numbers = _numbers(s, step)
    up, north = kernels.mean_directions(rates, forces, fields, np.diff(times, prepend=times[:1] - step))
    level = _between(up, np.array([0.0, 0, 1]))
    level_north = vga3.rotate_vector(level, north)
    level_north[..., 2] = 0
    first = vga3.rotor_product(_between(level_north, np.array([0.0, 1, 0])), level)
    upwards = s.gravity * vga3.rotate_vector(vga3.rotor_inverse(first), np.array([0.0, 0, 1]))
    knows_north = np.isfinite(fields).all(-1).any(-1)
    variances = np.zeros((*up.shape[:-1], _STATES))
    variances[...] = [_FIRST_TURN**2] * 2 + [0.0] + [_FIRST_BIAS**2] * 3 + [_FIRST_VELOCITY**2] * 2
    variances[..., 2] = np.where(knows_north, _FIRST_HEADING**2, 0)
    triangle = to_triangle(variances[..., None] * np.eye(_STATES))
    return kernels.orientation_start(first, upwards, triangle, knows_north.astype(float), numbers), numbers, step


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
        s.field_time, prior, _LONGEST_DELAY, s.return_time,
    ]  # fmt: skip
    return finite(np.array(values), "settings")
