"""Kalman filters with any number of states up to twelve, for single problems and batches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import kalman as kernels

from ..arguments import Reals, finite, real_array
from ..evidence.gates import checked_gate
from ..evidence.triangles import from_triangle, to_triangle
from .kalman_steps import (
    JOINT,
    LARGEST,
    System,
    Whitened,
    padded,
    padded_square,
    updated_in_sequence,
)
from .matrices import as_definite
from .status import EstimationStatus

_FLOAT64 = np.dtype(np.float64)
_PREDICTED = np.full((), EstimationStatus.OK)
_PREDICTED.flags.writeable = False
_Parts = tuple[Reals, Reals, Reals, Reals, Reals, Reals, Reals]
"""The first fields of `Filtered`."""


@dataclass(frozen=True, slots=True, eq=False)
class Filtered:
    """A filtered recording of t measurements."""

    states: Reals
    """(..., t, n) After each measurement."""
    covariances: Reals
    """(..., t, n, n)"""
    predicted: Reals
    """(..., t, n) Before each measurement."""
    predicted_covariances: Reals
    """(..., t, n, n)"""
    innovations: Reals
    """(..., t, m) Measured minus predicted numbers; NaN where nothing was measured."""
    squares: Reals
    """(..., t) The squares of innovations divided by their covariances; chi-square distributed for a correct model."""
    used: Reals
    """(..., t) bool. Whether the measurement was used: it is within the gate."""
    n_missing: Reals
    """(...) int. How many measured numbers are not finite."""


@dataclass(frozen=True, slots=True, eq=False)
class Smoothed:
    """A smoothed recording: estimates from all measurements, earlier and later ones."""

    states: Reals
    """(..., t, n)"""
    covariances: Reals
    """(..., t, n, n)"""


class KalmanFilter:
    """Kalman filter for ``x' = F x + w`` and ``z = H x + v`` with covariances Q of w and R of v.

    Updates have the Joseph form. Joint updates factorise the covariance of the innovation by Cholesky's method within
    the kernel; larger measurements are whitened and taken one number after the other, with the same result. Numbers of
    a measurement that are not finite are left out.

    Parameters
    ----------
    state : array_like, (..., n)
        n is at most 12. Leading axes are a batch of filters.
    covariance : array_like, (..., n, n) or (n, n)
    transition : array_like, (n, n)
        F.
    process_noise : array_like, (n, n)
        Q.
    measurement : array_like, (m, n)
        H.
    measurement_noise : array_like, (m, m)
        R.
    gate : float
        Measurements are left out if the square of their innovation, divided by its covariance, exceeds this.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type or is not finite, or there are too many states.
    """

    def __init__(
        self,
        state: ArrayLike,
        covariance: ArrayLike,
        transition: ArrayLike,
        process_noise: ArrayLike,
        measurement: ArrayLike,
        measurement_noise: ArrayLike,
        gate: float = np.inf,
    ) -> None:
        first = finite(real_array(state, "state", (-1,)).astype(float), "state")
        n = self._n = first.shape[-1]
        if not 0 < n <= LARGEST:
            raise ValueError(f"state: {n} numbers; expected 1 to {LARGEST}")
        rows = finite(real_array(measurement, "measurement", (-1, n)).astype(float), "measurement").reshape(-1, n)
        m = len(rows)
        move = _square(transition, "transition", n)
        spread, definite = _definite(covariance, "covariance", n)
        process, process_definite = _definite(process_noise, "process_noise", n)
        self._noise, noise_definite = _definite(measurement_noise, "measurement_noise", m)
        self._system = System.of(move, process, rows, self._noise)
        self._whitened: Whitened | None = None
        leading = first.shape[:-1]
        self._state = padded(first, self._system.size)
        self._triangle = to_triangle(padded_square(np.broadcast_to(spread, (*leading, n, n)), self._system.size))
        self._gate = checked_gate(gate)
        self._shape = (m,)
        self._innovation = np.full((*leading, m), np.nan)
        self._numbers = np.zeros((*leading, 2))
        good = definite and process_definite and noise_definite
        self._status: Reals | None = np.full(leading, EstimationStatus.OK if good else EstimationStatus.NOT_DEFINITE)

    @property
    def n_states(self) -> int:
        """The number n of states."""
        return int(self._n)

    @property
    def state(self) -> Reals:
        """(..., n) The estimate."""
        return self._state[..., : self._n]

    @property
    def covariance(self) -> Reals:
        """(..., n, n) The covariance of its error."""
        return from_triangle(self._triangle, self._system.size)[..., : self._n, : self._n]

    @property
    def innovation(self) -> Reals:
        """(..., m) Measured minus predicted numbers of the last update."""
        return self._innovation

    @property
    def square(self) -> Reals:
        """(...) The square of the last innovation divided by its covariance."""
        return np.asarray(self._numbers[..., 0])

    @property
    def status(self) -> Reals:
        """(...) int, an `EstimationStatus` each: OK, SKIPPED, REJECTED or NOT_DEFINITE, of the last call."""
        if self._status is None:
            # Computed here, because it takes longer than an update.
            missing = ~np.isfinite(self._innovation).any(-1)
            status = np.where(missing, EstimationStatus.SKIPPED, EstimationStatus.REJECTED)
            self._status = np.where((self._numbers[..., 1] > 0) & ~missing, EstimationStatus.OK, status)
        return self._status

    def predict(self, transition: ArrayLike | None = None, process_noise: ArrayLike | None = None) -> None:
        """Predict the next state, with another F or Q if given."""
        system, n = self._system, self._n
        move, noise = system.transition, system.process
        if transition is not None:
            move = padded_square(_square(transition, "transition", n), system.size)
        if process_noise is not None:
            noise = to_triangle(padded_square(_definite(process_noise, "process_noise", n)[0], system.size))
        self._state, self._triangle = system.predict(self._state, self._triangle, move, noise)
        leading = self._state.shape[:-1]
        self._status = np.full(leading, EstimationStatus.OK) if leading else _PREDICTED

    def update(self, measurement: ArrayLike, *, in_sequence: bool = False) -> None:
        """Update the state by a measurement (..., m).

        With `in_sequence`, the numbers are taken one after the other, and the gate applies to each of them. Leading
        axes are those of the filter, or 1.
        """
        z, system, m = measurement, self._system, self._shape[0]
        if type(z) is not np.ndarray or z.dtype is not _FLOAT64 or z.shape != self._shape:
            z = real_array(measurement, "measurement", (m,)).astype(float)
            whole = (*self._state.shape[:-1], m)
            if z.ndim > len(whole) or any(a not in (1, b) for a, b in zip(z.shape, whole[-z.ndim :], strict=True)):
                raise ValueError(f"measurement: shape {z.shape}; expected {whole}, the numbers of each filter")
        innovation = self._innovation = z - self._state @ system.columns
        if system.wide and not in_sequence:
            self._state, self._triangle, self._numbers = system.update(
                self._state, self._triangle, innovation if m == system.wide else padded(innovation, system.wide),
                system.rows, system.noise, self._gate,
            )  # fmt: skip
        else:
            if self._whitened is None:
                self._whitened = Whitened.of(system.rows[:m], self._noise)
            self._state, self._triangle, self._numbers = updated_in_sequence(
                self._state, self._triangle, innovation, system.rows[:m], self._noise, self._whitened, self._gate,
                in_sequence,
            )  # fmt: skip
        self._status = None

    def run(self, measurements: ArrayLike) -> Filtered:
        """Filter a recording: predict and update for each measurement (..., t, m).

        The state of the filter becomes that after the last measurement.
        """
        m = self._shape[0]
        z = real_array(measurements, "measurements", (-1, m)).astype(float)
        leading = np.broadcast_shapes(self._state.shape[:-1], z.shape[:-2])
        whole = np.broadcast_to(z, (*leading, *z.shape[-2:]))
        parts = self._recorded(z) if self._system.wide else self._steps(whole)
        return Filtered(*parts, n_missing=(~np.isfinite(whole)).sum((-1, -2)))

    def _recorded(self, z: Reals) -> _Parts:
        """Filter a recording by one kernel."""
        system, n, m = self._system, self._n, self._shape[0]
        size, wide = system.size, system.wide
        states, triangles, before, before_triangles, innovations, squares, used = getattr(
            kernels, f"filter_{size}_{wide}"
        )(
            self._state, self._triangle, padded(z, wide), system.transition, system.process, system.rows, system.noise,
            self._gate,
        )  # fmt: skip
        if z.shape[-2]:
            self._state, self._triangle = states[..., -1, :].copy(), triangles[..., -1, :].copy()
        return (
            states[..., :n], from_triangle(triangles, size)[..., :n, :n], before[..., :n],
            from_triangle(before_triangles, size)[..., :n, :n], innovations[..., :m], squares, used > 0,
        )  # fmt: skip

    def _steps(self, measurements: Reals) -> _Parts:
        """Filter a recording step by step."""
        leading, n_steps = measurements.shape[:-2], measurements.shape[-2]
        n, m = self._n, self._shape[0]
        self._state = np.broadcast_to(self._state, (*leading, self._system.size)).copy()
        self._triangle = np.broadcast_to(self._triangle, (*leading, self._triangle.shape[-1])).copy()
        states, before = (np.empty((*leading, n_steps, n)) for _ in range(2))
        spreads, spreads_before = (np.empty((*leading, n_steps, n, n)) for _ in range(2))
        innovations, squares = np.empty((*leading, n_steps, m)), np.empty((*leading, n_steps))
        used = np.empty((*leading, n_steps), bool)
        for k in range(n_steps):
            self.predict()
            before[..., k, :], spreads_before[..., k, :, :] = self.state, self.covariance
            self.update(measurements[..., k, :])
            states[..., k, :], spreads[..., k, :, :] = self.state, self.covariance
            innovations[..., k, :], squares[..., k] = self._innovation, self.square
            used[..., k] = self.status == EstimationStatus.OK
        return states, spreads, before, spreads_before, innovations, squares, used

    def smooth(self, filtered: Filtered) -> Smoothed:
        """Smooth a recording that was filtered with `run` (Rauch, Tung and Striebel, *AIAA Journal* 3:1445, 1965)."""
        n, size = self._n, self._system.size
        transition = self._system.transition[:n, :n]
        states, spreads = filtered.states, filtered.covariances
        following = np.concatenate([filtered.predicted[..., 1:, :], states[..., -1:, :]], -2)
        following_spreads = np.concatenate([filtered.predicted_covariances[..., 1:, :, :], spreads[..., -1:, :, :]], -3)
        if size in JOINT:
            ahead = np.ones(states.shape[-2])
            ahead[-1:] = 0
            last, last_spread = padded(states[..., -1, :], size), padded_square(spreads[..., -1, :, :], size)
            found, triangles = getattr(kernels, f"smooth_{size}")(
                padded(states, size), to_triangle(padded_square(spreads, size)), padded(following, size),
                to_triangle(padded_square(following_spreads, size)), ahead, last, to_triangle(last_spread),
                self._system.transition,
            )  # fmt: skip
            return Smoothed(found[..., :n], from_triangle(triangles, size)[..., :n, :n])
        after, after_spread = states.copy(), spreads.copy()
        for t in reversed(range(states.shape[-2] - 1)):
            gain = np.linalg.solve(following_spreads[..., t, :, :], transition @ spreads[..., t, :, :])
            change = (after[..., t + 1, :] - following[..., t, :])[..., None]
            after[..., t, :] += (np.swapaxes(gain, -1, -2) @ change)[..., 0]
            more = after_spread[..., t + 1, :, :] - following_spreads[..., t, :, :]
            after_spread[..., t, :, :] += np.swapaxes(gain, -1, -2) @ more @ gain
        return Smoothed(after, after_spread)


def _square(value: ArrayLike, name: str, n: int) -> Reals:
    matrix = finite(real_array(value, name).astype(float), name)
    if matrix.shape != (n, n):
        raise ValueError(f"{name}: shape {matrix.shape}; expected ({n}, {n})")
    return matrix


def _definite(value: ArrayLike, name: str, n: int) -> tuple[Reals, bool]:
    """Return symmetric positive semidefinite matrices (..., n, n), and whether all given ones are."""
    given = finite(real_array(value, name, (n, n)).astype(float), name)
    found, good = given.copy(), True
    for k in np.ndindex(given.shape[:-2]):
        found[k], is_definite = as_definite(given[k])
        good &= is_definite
    return found, good
