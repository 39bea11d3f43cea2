"""Splines: smooth motions through motors at given times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array
from ..elements import MOTOR, plain, restorer


@dataclass(frozen=True, slots=True, eq=False)
class MotorSpline:
    """A piecewise cubic Hermite motion through motors, with continuous velocity.

    On each interval the motion is ``m exp(b1 w1) exp(b2 w2) exp(b3 w3)`` with the cumulative Bernstein polynomials b1,
    b2, b3 of the third degree (Kim, Kim and Shin, *SIGGRAPH* 1995, for quaternions). Construct it with `through`.
    """

    times: Reals
    """(n) Increasing."""
    motors: Reals
    """(n, 8) The motors at these times, each with the sign nearer to the previous motor."""
    twists: Reals
    """(n, 6) Twists at these times, in the body frame."""

    restored: Callable[[Any], Any] = np.asarray
    """Takes the coefficients of a motor to the result of a call: an element if the spline is through elements."""

    @classmethod
    def through(cls, times: ArrayLike, motors: ArrayLike, twists: ArrayLike | None = None) -> MotorSpline:
        """Return the spline through given motors.

        Parameters
        ----------
        times : array_like, (n)
            Increasing times, at least two.
        motors : array_like, (n, 8), or multivectors
            Unit motors of either sign. Between consecutive motors the smaller rotation is used, so that rotations by
            more than 180 degrees need intermediate motors.
        twists : array_like, (n, 6), optional
            Twists in the body frame. By default they are estimated from parabolas through three consecutive motors;
            motions with a constant twist are reproduced.

        Raises
        ------
        TypeError, ValueError
            If an argument has a wrong shape or type, or times do not increase.
        """
        at = real_array(times, "times", (-1,), "times")
        given = real_array(plain(motors, "motors", MOTOR), "motors", (len(at), 8), "a unit motor for each time")
        if at.ndim != 1 or given.ndim != 2 or len(at) < 2:
            raise ValueError(f"times: shape {at.shape}, motors: shape {given.shape}; expected (n) and (n, 8), n > 1")
        if not np.all(np.diff(at) > 0):
            raise ValueError("times: expected increasing numbers")
        between = np.einsum("ni,ni->n", given[:-1, :4], given[1:, :4])
        signed = given * np.cumprod(np.concatenate([[1], np.where(between < 0, -1, 1)]))[:, None]
        if twists is None:
            mean_rates = _twists(signed[:-1], signed[1:]) / np.diff(at)[:, None]
            rates = _parabolic(mean_rates, np.diff(at))
        else:
            rates = real_array(twists, "twists", (len(at), 6), "a twist for each time")
        return cls(at, signed, rates, restorer(motors, MOTOR))

    def __call__(self, t: ArrayLike) -> Any:
        """Evaluate the spline. Outside the interval the first and last cubics are extrapolated.

        Parameters
        ----------
        t : array_like, (...)

        Returns
        -------
        array, (..., 8)
        """
        where = real_array(t, "t")
        k = np.clip(np.searchsorted(self.times, where, side="right") - 1, 0, len(self.times) - 2)
        step = (self.times[k + 1] - self.times[k])[..., None]
        s = (where - self.times[k])[..., None] / step
        first, last = self.twists[k] * step / 3, self.twists[k + 1] * step / 3
        start, end = self.motors[k], self.motors[k + 1]
        after = pga3.motor_product(start, pga3.motor_from_twist(first))
        before = pga3.motor_product(end, pga3.motor_from_twist(-last))
        middle = _twists(after, before)
        found = start
        for weight, twist in ((1 - (1 - s) ** 3, first), (s * s * (3 - 2 * s), middle), (s**3, last)):
            found = pga3.motor_product(found, pga3.motor_from_twist(weight * twist))
        return self.restored(found)


def _twists(a: Reals, b: Reals) -> Reals:
    return np.asarray(pga3.motor_to_twist(pga3.motor_relative(a, b)))


def _parabolic(rates: Reals, steps: Reals) -> Reals:
    """Return derivatives at the nodes of parabolas through three values, from the mean rates of the intervals.

    At the ends, the parabolas through the first and the last three values are used.
    """
    if len(rates) == 1:
        return np.repeat(rates, 2, 0)
    h, k = steps[:-1, None], steps[1:, None]
    inner = (k * rates[:-1] + h * rates[1:]) / (h + k)
    return np.concatenate([2 * rates[:1] - inner[:1], inner, 2 * rates[-1:] - inner[-1:]])
