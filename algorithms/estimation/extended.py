"""Extended Kalman filters: nonlinear motions and measurements, given as functions with their derivatives."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, finite, real_array
from ..evidence.gates import checked_gate
from .kalman_steps import LARGEST, predicted, updated
from .matrices import as_definite
from .status import EstimationStatus

Linearised = Callable[[Reals], tuple[ArrayLike, ArrayLike]]
"""A function of the state (n,) that returns a value (m,) and its derivatives (m, n)."""


class ExtendedKalmanFilter:
    """Extended Kalman filter for one state x of up to twelve numbers.

    Parameters
    ----------
    state : array_like, (n,)
    covariance : array_like, (n, n)
    gate : float
        As for `KalmanFilter`.
    n_linearisations : int
        How often an update is linearised, each time at its own result (the iterated filter, a Gauss-Newton method).
    """

    def __init__(
        self, state: ArrayLike, covariance: ArrayLike, *, gate: float = np.inf, n_linearisations: int = 1
    ) -> None:
        self._state = finite(real_array(state, "state", (-1,)).astype(float), "state")
        n = len(self._state)
        if self._state.ndim != 1 or not 0 < n <= LARGEST:
            raise ValueError(f"state: shape {self._state.shape}; expected (n,) with n from 1 to {LARGEST}")
        if n_linearisations < 1:
            raise ValueError(f"n_linearisations: {n_linearisations}; expected at least 1")
        self._covariance, definite = as_definite(finite(real_array(covariance, "covariance", (n, n)), "covariance"))
        self._gate = checked_gate(gate)
        self._count = n_linearisations
        self._square = 0.0
        self._status = EstimationStatus.OK if definite else EstimationStatus.NOT_DEFINITE

    @property
    def state(self) -> Reals:
        """(n,) The estimate."""
        return self._state

    @property
    def covariance(self) -> Reals:
        """(n, n) The covariance of its error."""
        return self._covariance

    @property
    def square(self) -> float:
        """The square of the last innovation divided by its covariance."""
        return self._square

    @property
    def status(self) -> EstimationStatus:
        """The status of the last call: OK, SKIPPED, REJECTED, NOT_CONVERGED or NOT_DEFINITE."""
        return self._status

    def predict(self, motion: Linearised, noise: ArrayLike) -> EstimationStatus:
        """Predict the state by a function that returns the next state and its derivatives by the present one."""
        n = len(self._state)
        after, rows = (np.asarray(x, float) for x in motion(self._state))
        spread = _definite(real_array(noise, "noise", (n, n)).astype(float).tobytes(), n)
        if not (_are_finite(after) and _are_finite(rows)):
            self._status = EstimationStatus.NOT_CONVERGED
            return self._status
        self._covariance = predicted(self._state, self._covariance, rows, spread)[1]
        self._state = after.reshape(n)
        self._status = EstimationStatus.OK
        return self._status

    def update(
        self,
        measurement: ArrayLike,
        expected: Linearised,
        noise: ArrayLike,
        *,
        difference: Callable[[Reals, Reals], Reals] = np.subtract,
    ) -> EstimationStatus:
        """Update the state by a measurement (m,).

        Parameters
        ----------
        measurement : array_like, (m,)
            Numbers that are not finite are left out.
        expected : callable
            Returns the measurement expected for a state, and its derivatives.
        noise : array_like, (m, m)
        difference : callable
            The difference of a measured and an expected measurement, for example of angles.
        """
        z = real_array(measurement, "measurement", (-1,)).astype(float)
        spread = _definite(real_array(noise, "noise", (len(z), len(z))).astype(float).tobytes(), len(z))
        if not np.isfinite(z).any():
            self._status = EstimationStatus.SKIPPED
            return self._status
        at = self._state
        for k in range(self._count):
            value, rows = (np.asarray(x, float) for x in expected(at))
            if not (_are_finite(value) and _are_finite(rows)):
                self._status = EstimationStatus.NOT_CONVERGED
                return self._status
            # What would be measured at the prediction, linearised at the present state.
            innovation = np.asarray(difference(z, value))
            if k:
                innovation = innovation - rows @ (self._state - at)
            found = updated(self._state, self._covariance, innovation, rows, spread, self._gate)
            if not k:
                self._square = float(found[2])
            if not found[3]:
                self._status = EstimationStatus.REJECTED
                return self._status
            at = found[0]
        self._state, self._covariance = found[0], found[1]
        self._status = EstimationStatus.OK
        return self._status


@lru_cache(maxsize=64)
def _definite(noise: bytes, n: int) -> Reals:
    """Return the nearest positive semidefinite matrix; the same noise is usually given again and again."""
    found = as_definite(np.frombuffer(noise).reshape(n, n))[0]
    found.flags.writeable = False
    return found


def _are_finite(numbers: Reals) -> bool:
    """Return whether all numbers are finite. The sum of squares is computed faster, but may overflow."""
    return isfinite(np.vdot(numbers, numbers)) or bool(np.isfinite(numbers).all())
