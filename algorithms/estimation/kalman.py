"""Kalman filters for any number of states, for single problems and batches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import kalman as kernels

from ..arguments import Reals, finite, real_array
from ..evidence import WRONG
from ..evidence.gates import UNLIKELY, checked_gate, gate_of
from .matrices import as_definite, definite_once
from .status import EstimationStatus

_FLOAT64 = np.dtype(np.float64)
_PREDICTED = np.full((), EstimationStatus.OK)
_PREDICTED.flags.writeable = False


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
    """(..., t) bool. Whether the measurement was used: a number of it is finite, and it is within the gate."""
    n_missing: Reals
    """(...) int. How many measured numbers are not finite."""
    transitions: Reals
    """(1, n, n) or (t, n, n) The matrices F of the predictions."""


@dataclass(frozen=True, slots=True, eq=False)
class Smoothed:
    """A smoothed recording: estimates from all measurements, earlier and later ones."""

    states: Reals
    """(..., t, n)"""
    covariances: Reals
    """(..., t, n, n)"""


class KalmanFilter:
    """Kalman filter for ``x' = F x + B u + w`` and ``z = H x + v`` with covariances Q of w and R of v.

    The covariance of an innovation is eliminated row by row, and the update has the Joseph form. Numbers of a
    measurement that are not finite are left out. Methods take matrices that differ from those of the filter.

    Parameters
    ----------
    state : array_like, (..., n)
        Leading axes are a batch of filters.
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
    control : array_like, (n, k), optional
        B. The controls u are passed to `predict` and `run`.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type or is not finite.
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
        *,
        control: ArrayLike | None = None,
    ) -> None:
        self._state = finite(real_array(state, "state", (-1,)).astype(float), "state")
        n = self._state.shape[-1]
        if not n:
            raise ValueError("state: no numbers; expected at least one")
        self._transition = _matrix(transition, "transition", (n, n))
        self._rows = _matrix(measurement, "measurement", (-1, n))
        m = len(self._rows)
        spread, definite = _definite(covariance, "covariance", n)
        self._process, self._good_process = _definite(process_noise, "process_noise", n)
        self._noise, self._good_noise = _definite(measurement_noise, "measurement_noise", m)
        leading = self._state.shape[:-1]
        self._covariance = np.ascontiguousarray(np.broadcast_to(spread, (*leading, n, n)))
        self._control = None if control is None else _matrix(control, "control", (n, -1))
        self._still = np.zeros(n)
        limit = checked_gate(gate)
        self._gates, self._each = np.array([np.inf, limit]), np.array([limit, np.inf])
        self._innovation = np.full((*leading, m), np.nan)
        self._square, self._count = np.zeros(leading), np.zeros(leading)
        self._recorded: tuple[Reals, Reals, Reals] | None = None
        self._good = definite and self._good_process and self._good_noise
        self._status: Reals | None = self._known_status(leading)

    @property
    def n_states(self) -> int:
        """The number n of states."""
        return len(self._still)

    @property
    def state(self) -> Reals:
        """(..., n) The estimate."""
        return self._state

    @property
    def covariance(self) -> Reals:
        """(..., n, n) The covariance of its error."""
        return self._covariance

    @property
    def innovation(self) -> Reals:
        """(..., m) Measured minus predicted numbers of the last update."""
        return self._innovation

    @property
    def square(self) -> Reals:
        """(...) The square of the last innovation divided by its covariance."""
        return np.asarray(self._square)

    @property
    def status(self) -> Reals:
        """(...) int, an `EstimationStatus` each: OK, SKIPPED, REJECTED, INCONSISTENT or NOT_DEFINITE, of the last call.

        After `run` it is INCONSISTENT if the squares of all innovations are larger than a correct model leaves with a
        probability of a thousandth, or if less than half of the measurements were used. After `update`, which is called
        many times, the probability is a billionth.
        """
        if self._status is None:
            # Computed here, because it takes longer than an update.
            missing = ~np.isfinite(self._innovation).any(-1)
            inconsistent = self._is_inconsistent()
            if inconsistent.ndim:
                status = np.where(missing, EstimationStatus.SKIPPED, EstimationStatus.REJECTED)
                status = np.where((self._count > 0) & ~missing, self._known_status(()), status)
                self._status = np.where(inconsistent, EstimationStatus.INCONSISTENT, status)
            elif inconsistent:
                self._status = np.array(EstimationStatus.INCONSISTENT)
            elif self._count > 0 and not missing:
                self._status = self._known_status(())
            else:
                self._status = np.array(EstimationStatus.SKIPPED if missing else EstimationStatus.REJECTED)
        return self._status

    def _is_inconsistent(self) -> Reals:
        """Return whether the innovations of the last call are larger than their covariances let them be."""
        if self._recorded is None:
            squares, count, probability = self._square, self._count, UNLIKELY
            lost = np.zeros(np.shape(count), np.bool_)
        else:
            innovations, each, counts = self._recorded
            used, seen = (counts > 0).sum(-1), np.isfinite(innovations).any(-1).sum(-1)
            squares, count, probability = np.where(counts > 0, each, 0).sum(-1), counts.sum(-1), WRONG
            lost = (seen > 1) & (2 * used < seen)
        if not np.ndim(count):
            return np.asarray(lost | (count > 0 and squares > gate_of(int(count), probability)))
        numbers, where = np.unique(np.asarray(count, int), return_inverse=True)
        limits = np.array([gate_of(int(n), probability) if n else np.inf for n in numbers])
        return np.asarray((squares > limits[where].reshape(np.shape(count))) | lost)

    def _known_status(self, leading: tuple[int, ...]) -> Reals:
        """Return the status of a call whose measurement, if any, was used."""
        return np.full(leading, EstimationStatus.OK if self._good else EstimationStatus.NOT_DEFINITE)

    def predict(
        self,
        transition: ArrayLike | None = None,
        process_noise: ArrayLike | None = None,
        *,
        control: ArrayLike | None = None,
    ) -> None:
        """Predict the next state, with another F or Q if given, and for the control u (..., k)."""
        n = len(self._still)
        move = self._transition if transition is None else _matrix(transition, "transition", (n, n))
        noise, self._good = self._process, self._good_process
        if process_noise is not None:
            noise, self._good = _definite(process_noise, "process_noise", n)
        shift = self._still if control is None else self._shift(control, "control")
        self._state, self._covariance = kernels.predict(self._state, self._covariance, move, noise, shift)
        leading = self._state.shape[:-1]
        self._status = _PREDICTED if self._good and not leading else self._known_status(leading)

    def update(
        self,
        measurement: ArrayLike,
        *,
        rows: ArrayLike | None = None,
        noise: ArrayLike | None = None,
        in_sequence: bool = False,
    ) -> None:
        """Update the state by a measurement.

        Parameters
        ----------
        measurement : array_like, (..., m)
            Leading axes are those of the filter, or 1.
        rows : array_like, (m, n), optional
            Another H.
        noise : array_like, (m, m), optional
            Another R.
        in_sequence : bool
            Whether the gate applies to one number after the other, instead of to all of them together.
        """
        own, spread, good = self._rows, self._noise, self._good_noise
        if rows is not None:
            own = _matrix(rows, "rows", (-1, len(self._still)))
        m = len(own)
        if noise is not None:
            spread, good = definite_once(noise, "noise", m)
        elif len(spread) != m:
            raise ValueError(f"rows: {m} measured numbers; expected {len(spread)}, or noise= for those")
        z = measurement
        if type(z) is not np.ndarray or z.dtype is not _FLOAT64 or z.shape != (m,):
            z = real_array(measurement, "measurement", (m,)).astype(float)
            whole = (*self._state.shape[:-1], m)
            if z.ndim > len(whole) or any(a not in (1, b) for a, b in zip(z.shape, whole[-z.ndim :], strict=True)):
                raise ValueError(f"measurement: shape {z.shape}; expected {whole}, the numbers of each filter")
        self._state, self._covariance, self._innovation, self._square, self._count = kernels.update(
            self._state, self._covariance, z, own, spread, self._each if in_sequence else self._gates
        )
        self._status, self._recorded, self._good = None, None, good

    def run(
        self,
        measurements: ArrayLike,
        *,
        controls: ArrayLike | None = None,
        transitions: ArrayLike | None = None,
        process_noises: ArrayLike | None = None,
        rows: ArrayLike | None = None,
        noises: ArrayLike | None = None,
    ) -> Filtered:
        """Filter a recording: predict and update for each measurement.

        The state, and what is known about the last update, become those of the last measurement.

        Parameters
        ----------
        measurements : array_like, (..., t, m)
        controls : array_like, (..., t, k), optional
            The control u before each measurement.
        transitions, process_noises : array_like, (t, n, n), optional
            F and Q before each measurement.
        rows : array_like, (t, m, n), optional
            H of each measurement.
        noises : array_like, (t, m, m), optional
            R of each measurement.
        """
        n, m = len(self._still), len(self._rows)
        z = real_array(measurements, "measurements", (-1, m)).astype(float)
        t = z.shape[-2]
        shifts = np.zeros((t, n)) if controls is None else self._shift(controls, "controls", t)
        leading = np.broadcast_shapes(self._state.shape[:-1], z.shape[:-2], shifts.shape[:-2])
        known = self._transition, self._process, self._rows, self._noise
        named = getattr(kernels, f"filter_recording_{n}_{m}", None)
        given = transitions, process_noises, rows, noises
        if named is not None and all(x is None for x in given):
            found = named(self._state, self._covariance, z, shifts, *known, self._gates)
            used, self._good = self._transition[None], self._good_process and self._good_noise
        else:
            system, (used, process, seen, noise), self._good = _systems(t, known, given)
            found = kernels.filter_recording(
                self._state, self._covariance, z, shifts, used, process, seen, noise, system, self._gates
            )
            self._good &= (process_noises is not None or self._good_process) and (
                noises is not None or self._good_noise
            )
        states, covariances, before, spreads, innovations, squares, count = found
        if t:
            self._state, self._covariance = states[..., -1, :].copy(), covariances[..., -1, :, :].copy()
            self._innovation, self._square, self._count = innovations[..., -1, :], squares[..., -1], count[..., -1]
            self._status = None
            self._recorded = innovations, squares, count
        missing = (~np.isfinite(np.broadcast_to(z, (*leading, t, m)))).sum((-1, -2))
        return Filtered(states, covariances, before, spreads, innovations, squares, count > 0, missing, used)

    def smooth(self, filtered: Filtered) -> Smoothed:
        """Smooth a recording that was filtered with `run` (Rauch, Tung and Striebel, *AIAA Journal* 3:1445, 1965)."""
        states, spreads = filtered.states, filtered.covariances
        following = np.concatenate([filtered.predicted[..., 1:, :], states[..., -1:, :]], -2)
        following_spreads = np.concatenate([filtered.predicted_covariances[..., 1:, :, :], spreads[..., -1:, :, :]], -3)
        t = states.shape[-2]
        if not t:
            return Smoothed(states, spreads)
        ahead = np.ones(t)
        ahead[-1] = 0
        rows = states, spreads, following, following_spreads, ahead, states[..., -1, :], spreads[..., -1, :, :]
        transitions = filtered.transitions
        named = getattr(kernels, f"smooth_{states.shape[-1]}", None)
        if named is not None and len(transitions) == 1:
            return Smoothed(*named(*rows, transitions[0]))
        # The transition after a measurement is that before the next one.
        system = np.minimum(np.arange(t) + 1, len(transitions) - 1)
        return Smoothed(*kernels.smooth(*rows, transitions, system))

    def _shift(self, control: ArrayLike, name: str, *t: int) -> Reals:
        """Return ``B u``."""
        if self._control is None:
            raise ValueError(f"{name}: given, but the filter has no matrix of controls; pass control=B to KalmanFilter")
        u = real_array(control, name, (*t, self._control.shape[1])).astype(float)
        return np.asarray(finite(u, name) @ self._control.T)


def _systems(
    t: int, known: tuple[Reals, ...], given: tuple[ArrayLike | None, ...]
) -> tuple[NDArray[np.intp], list[Reals], bool]:
    """Return the number of the matrices of each measurement, the matrices F, Q, H and R, and whether Q and R are good.

    Good ones are positive semidefinite.
    """
    if all(x is None for x in given):
        return np.zeros(t, np.intp), [own[None] for own in known], True
    matrices, good = [], True
    for own, x, name in zip(known, given, ("transitions", "process_noises", "rows", "noises"), strict=True):
        whole = (t, *own.shape)
        matrix = np.broadcast_to(own, whole) if x is None else _matrix(x, name, whole)
        is_covariance = name.endswith("noises")
        if is_covariance and x is not None:
            matrix, definite = as_definite(matrix)
            good &= definite
        matrices.append(matrix)
    return np.arange(t), matrices, good


def _matrix(value: ArrayLike, name: str, shape: tuple[int, ...]) -> Reals:
    """Return a finite matrix of a shape, in which -1 matches any length."""
    matrix = finite(real_array(value, name).astype(float), name)
    if matrix.ndim != len(shape) or any(want not in (-1, have) for want, have in zip(shape, matrix.shape, strict=True)):
        expected = ", ".join("any" if x < 0 else str(x) for x in shape)
        raise ValueError(f"{name}: shape {matrix.shape}; expected ({expected})")
    return matrix


def _definite(value: ArrayLike, name: str, n: int) -> tuple[Reals, bool]:
    """Return symmetric positive semidefinite matrices (..., n, n), and whether all given ones are."""
    return as_definite(finite(real_array(value, name, (n, n)).astype(float), name))
