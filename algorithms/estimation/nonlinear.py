"""Kalman filters for nonlinear motions and measurements: extended by derivatives, or unscented by sigma points."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite, sqrt

import numpy as np
from numpy.typing import ArrayLike

from generated import kalman as kernels

from ..arguments import Reals, finite, real_array
from ..evidence.gates import UNLIKELY, checked_gate, gate_of
from .matrices import as_definite, definite_once
from .status import EstimationStatus

Linearised = Callable[[Reals], tuple[ArrayLike, ArrayLike]]
"""A function of the state (n,) that returns a value (m,) and its derivatives (m, n)."""
Mapped = Callable[[Reals], ArrayLike]
"""A function of states (k, n) that returns a value (k, m) for each."""
Difference = Callable[[Reals, Reals], Reals]
"""The difference of two values (..., m), for example of angles."""


class _NonlinearFilter:
    """The estimate of one state, with predictions and updates that are linear already."""

    def __init__(self, state: ArrayLike, covariance: ArrayLike, gate: float) -> None:
        self._state = finite(real_array(state, "state", (-1,)).astype(float), "state")
        n = len(self._state)
        if self._state.ndim != 1 or not n:
            raise ValueError(f"state: shape {self._state.shape}; expected (n,) with n from 1")
        given = finite(real_array(covariance, "covariance", (n, n)).astype(float), "covariance")
        self._covariance, definite = as_definite(given)
        self._gates = np.array([np.inf, checked_gate(gate)])
        self._still = np.zeros(n)
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
        """The status of the last call: OK, SKIPPED, REJECTED, NOT_CONVERGED, INCONSISTENT or NOT_DEFINITE."""
        return self._status

    def _predicted(self, after: Reals, rows: Reals, noise: Reals, definite: bool) -> EstimationStatus:
        """Move the state to `after`, with the derivatives `rows` by the state before."""
        self._status = EstimationStatus.NOT_CONVERGED
        if _are_finite(after) and _are_finite(rows):
            self._covariance = kernels.predict(self._state, self._covariance, rows, noise, self._still)[1]
            self._state = after.reshape(self._still.shape)
            self._status = EstimationStatus.OK if definite else EstimationStatus.NOT_DEFINITE
        return self._status

    def _updated(
        self,
        measurement: ArrayLike,
        noise: ArrayLike,
        linearise: Callable[[Reals, Reals], tuple[Reals, Reals, Reals | None]],
        n: int,
    ) -> EstimationStatus:
        """Update the state by a measurement, linearised n times, each time at its own result.

        ``linearise(z, at)`` returns the innovation at a state, its derivatives, and the covariance of what is not
        linear, which is added to the noise.
        """
        z = real_array(measurement, "measurement", (-1,)).astype(float)
        m = len(z)
        spread, definite = definite_once(noise, "noise", m)
        if not np.isfinite(z).any():
            self._status = EstimationStatus.SKIPPED
            return self._status
        at, covariance = self._state, self._covariance
        for k in range(n):
            innovation, rows, bent = linearise(z, at)
            self._status = EstimationStatus.NOT_CONVERGED
            if not (_are_finite(rows) and _are_finite(innovation[np.isfinite(z)])):
                return self._status
            # What would be measured at the prediction, linearised at the present state.
            rest = innovation - rows @ (self._state - at) if k else innovation
            # The change of a state is that of a state 0 by the innovation.
            change, covariance, _, square, count = kernels.update(
                self._still, self._covariance, rest, rows, spread if bent is None else spread + bent, self._gates
            )
            at = self._state + change
            if not k:
                self._square = float(square)
            if not count:
                self._status = EstimationStatus.REJECTED
                return self._status
        self._state, self._covariance = at, covariance
        if self._square > gate_of(int(count), UNLIKELY):
            self._status = EstimationStatus.INCONSISTENT
        else:
            self._status = EstimationStatus.OK if definite else EstimationStatus.NOT_DEFINITE
        return self._status


class ExtendedKalmanFilter(_NonlinearFilter):
    """Extended Kalman filter for one state x.

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
        super().__init__(state, covariance, gate)
        if n_linearisations < 1:
            raise ValueError(f"n_linearisations: {n_linearisations}; expected at least 1")
        self._count = n_linearisations

    def predict(self, motion: Linearised, noise: ArrayLike) -> EstimationStatus:
        """Predict the state by a function that returns the next state and its derivatives by the present one."""
        n = len(self._state)
        after, rows = _with_derivatives("motion", motion, self._state, n)
        return self._predicted(after, rows, *definite_once(noise, "noise", n))

    def update(
        self, measurement: ArrayLike, expected: Linearised, noise: ArrayLike, *, difference: Difference = np.subtract
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

        def linearise(z: Reals, at: Reals) -> tuple[Reals, Reals, None]:
            value, rows = _with_derivatives("expected", expected, at, len(z))
            return np.asarray(difference(z, value)), rows, None

        return self._updated(measurement, noise, linearise, self._count)


class UnscentedKalmanFilter(_NonlinearFilter):
    """Unscented Kalman filter for one state x: functions are evaluated at sigma points, and need no derivatives.

    The points lie ``max(n, 3)**0.5`` standard deviations from the state, in n directions: for up to three numbers,
    they have the fourth moments of a Gaussian distribution; for more, the covariances stay positive semidefinite
    (Julier and Uhlmann, *Proceedings of the IEEE* 92:401, 2004).

    Parameters
    ----------
    state : array_like, (n,)
    covariance : array_like, (n, n)
    gate : float
        As for `KalmanFilter`.

    Examples
    --------
    >>> f = UnscentedKalmanFilter([3.0, 4.0], 0.1 * np.eye(2))
    >>> f.update([5.2], lambda x: np.hypot(x[:, 0], x[:, 1])[:, None], [[0.01]]).name
    'OK'
    """

    def __init__(self, state: ArrayLike, covariance: ArrayLike, *, gate: float = np.inf) -> None:
        super().__init__(state, covariance, gate)
        self._distance = sqrt(max(len(self._state), 3))

    def predict(self, motion: Mapped, noise: ArrayLike) -> EstimationStatus:
        """Predict the state by a function that returns the next state for each of some states (k, n)."""
        n = len(self._state)
        spread, definite = definite_once(noise, "noise", n)
        middle, mean, rows, bent = self._linearised("motion", motion, n, np.subtract)
        return self._predicted(middle + mean, rows, spread + bent, definite)

    def update(
        self, measurement: ArrayLike, expected: Mapped, noise: ArrayLike, *, difference: Difference = np.subtract
    ) -> EstimationStatus:
        """Update the state by a measurement (m,).

        Parameters
        ----------
        measurement : array_like, (m,)
            Numbers that are not finite are left out.
        expected : callable
            Returns the measurement expected for each of some states (k, n).
        noise : array_like, (m, m)
        difference : callable
            The difference of measurements (..., m), for example of angles.
        """

        def linearise(z: Reals, at: Reals) -> tuple[Reals, Reals, Reals]:
            middle, mean, rows, bent = self._linearised("expected", expected, len(z), difference)
            return np.asarray(difference(z, middle)) - mean, rows, bent

        return self._updated(measurement, noise, linearise, 1)

    def _linearised(
        self, name: str, function: Mapped, m: int, difference: Difference
    ) -> tuple[Reals, Reals, Reals, Reals]:
        """Return the value (m,) at the state, and the results of `kernels.linearise`."""
        offsets, forward, backward = kernels.sigma_points(self._state, self._covariance, self._distance)
        points = np.concatenate([self._state[None], forward, backward])
        values = np.asarray(function(points), float)
        if values.shape != (len(points), m):
            raise ValueError(
                f"{name}: returned shape {values.shape}; expected ({len(points)}, {m}), a row for each state"
            )
        n, changes = len(offsets), np.asarray(difference(values[1:], values[0]))
        return values[0], *kernels.linearise(offsets, changes[:n], changes[n:], self._distance)


def _with_derivatives(name: str, function: Linearised, state: Reals, m: int) -> tuple[Reals, Reals]:
    """Return the value of a function, m numbers, and its derivatives (m, n)."""
    found = function(state)
    if not isinstance(found, (tuple, list)) or len(found) != 2:
        raise TypeError(f"{name}: returned {type(found).__name__}; expected a pair, a value and its derivatives")
    value, rows = (np.asarray(x, float) for x in found)
    if value.size != m or rows.shape != (m, len(state)):
        raise ValueError(
            f"{name}: returned shapes {value.shape} and {rows.shape}; expected ({m},) and ({m}, {len(state)})"
        )
    return value.reshape(m), rows


def _are_finite(numbers: Reals) -> bool:
    """Return whether all numbers are finite. The sum of squares is computed faster, but may overflow."""
    return isfinite(np.vdot(numbers, numbers)) or bool(np.isfinite(numbers).all())
