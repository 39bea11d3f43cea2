"""Kalman filters with any number of states up to twelve, for single problems and batches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import kalman as kernels

from ..arguments import Reals, finite, real_array
from .matrices import as_definite, from_triangle, to_triangle
from .status import EstimationStatus

_JOINT = {2: 1, 4: 2, 6: 3}
"""The numbers of states of kernels, and how many measured numbers their joint updates take."""
LARGEST = 12
"""The largest number of states."""
_OPEN = 1e300
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
        self._state = finite(real_array(state, "state", (-1,)).astype(float), "state")
        n = self.n_states
        if not 0 < n <= LARGEST:
            raise ValueError(f"state: {n} numbers; expected 1 to {LARGEST}")
        rows = finite(real_array(measurement, "measurement", (-1, n)).astype(float), "measurement")
        self._rows = rows.reshape(-1, n)
        self._transition = _square(transition, "transition", n)
        first, definite = _definite(covariance, "covariance", n)
        self._process, process_definite = _definite(process_noise, "process_noise", n)
        self._noise, noise_definite = _definite(measurement_noise, "measurement_noise", len(self._rows))
        self._covariance = np.broadcast_to(first, (*self._state.shape[:-1], n, n)).copy()
        self._gate = min(float(gate), _OPEN)
        self._innovation = np.full((*self._state.shape[:-1], len(self._rows)), np.nan)
        self._square = np.zeros(self._state.shape[:-1])
        good = definite and process_definite and noise_definite
        self._status = np.full(self._state.shape[:-1], EstimationStatus.OK if good else EstimationStatus.NOT_DEFINITE)

    @property
    def n_states(self) -> int:
        """The number n of states."""
        return int(self._state.shape[-1])

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
        return self._square

    @property
    def status(self) -> Reals:
        """(...) int, an `EstimationStatus` each: OK, SKIPPED, REJECTED or NOT_DEFINITE, of the last call."""
        return self._status

    def predict(self, transition: ArrayLike | None = None, process_noise: ArrayLike | None = None) -> None:
        """Predict the next state, with another F or Q if given."""
        n = self.n_states
        move = self._transition if transition is None else _square(transition, "transition", n)
        noise = self._process if process_noise is None else _definite(process_noise, "process_noise", n)[0]
        self._state, self._covariance = predicted(self._state, self._covariance, move, noise)
        self._status = np.full(self._state.shape[:-1], EstimationStatus.OK)

    def update(self, measurement: ArrayLike, *, in_sequence: bool = False) -> None:
        """Update the state by a measurement (..., m).

        With `in_sequence`, the numbers are taken one after the other, and the gate applies to each of them.
        """
        z = real_array(measurement, "measurement", (len(self._rows),)).astype(float)
        self._innovation = z - self._state @ self._rows.T
        found = updated(
            self._state, self._covariance, self._innovation, self._rows, self._noise, self._gate, in_sequence
        )
        self._state, self._covariance, self._square, used = found
        missing = ~np.isfinite(self._innovation).any(-1)
        status = np.where(missing, EstimationStatus.SKIPPED, EstimationStatus.REJECTED)
        self._status = np.where(used & ~missing, EstimationStatus.OK, status)

    def run(self, measurements: ArrayLike) -> Filtered:
        """Filter a recording: predict and update for each measurement (..., t, m).

        The state of the filter becomes that after the last measurement.
        """
        z = real_array(measurements, "measurements", (-1, len(self._rows))).astype(float)
        leading = np.broadcast_shapes(self._state.shape[:-1], z.shape[:-2])
        n, m = self.n_states, len(self._rows)
        size = _size(n)
        if size in _JOINT and m <= _JOINT[size]:
            wide = _JOINT[size]
            found = getattr(kernels, f"filter_{size}_{wide}")(
                _padded(self._state, size), to_triangle(_padded_square(self._covariance, size)),
                _padded(z, wide), _padded_square(self._transition, size),
                to_triangle(_padded_square(self._process, size)), _padded_rows(self._rows, wide, size),
                to_triangle(_padded_square(self._noise, wide)), self._gate,
            )  # fmt: skip
            states, triangles, before, before_triangles, innovations, squares, used = found
            parts: _Parts = (
                states[..., :n], from_triangle(triangles, size)[..., :n, :n], before[..., :n],
                from_triangle(before_triangles, size)[..., :n, :n], innovations[..., :m], squares, used > 0,
            )  # fmt: skip
        else:
            parts = self._steps(np.broadcast_to(z, (*leading, *z.shape[-2:])))
        if z.shape[-2]:
            self._state, self._covariance = parts[0][..., -1, :].copy(), parts[1][..., -1, :, :].copy()
        missing = (~np.isfinite(np.broadcast_to(z, (*leading, *z.shape[-2:])))).sum((-1, -2))
        return Filtered(*parts, n_missing=missing)

    def _steps(self, measurements: Reals) -> _Parts:
        rows: list[tuple[Reals, ...]] = []
        leading = measurements.shape[:-2]
        self._state = np.broadcast_to(self._state, (*leading, self.n_states)).copy()
        self._covariance = np.broadcast_to(self._covariance, (*leading, *self._covariance.shape[-2:])).copy()
        for z in np.moveaxis(measurements, -2, 0):
            self.predict()
            before, spread = self._state, self._covariance
            self.update(z)
            used = self._status == EstimationStatus.OK
            rows.append((self._state, self._covariance, before, spread, self._innovation, self._square, used))
        columns = [list(column) for column in zip(*rows, strict=True)]
        states, befores, innovations = (np.stack(columns[k], -2) for k in (0, 2, 4))
        spreads, spreads_before = (np.stack(columns[k], -3) for k in (1, 3))
        squares, used = (np.stack(columns[k], -1) for k in (5, 6))
        return states, spreads, befores, spreads_before, innovations, squares, used

    def smooth(self, filtered: Filtered) -> Smoothed:
        """Smooth a recording that was filtered with `run` (Rauch, Tung and Striebel, *AIAA Journal* 3:1445, 1965)."""
        n, size = self.n_states, _size(self.n_states)
        states, spreads = filtered.states, filtered.covariances
        following = np.concatenate([filtered.predicted[..., 1:, :], states[..., -1:, :]], -2)
        following_spreads = np.concatenate([filtered.predicted_covariances[..., 1:, :, :], spreads[..., -1:, :, :]], -3)
        if size in _JOINT:
            ahead = np.ones(states.shape[-2])
            ahead[-1:] = 0
            last, last_spread = _padded(states[..., -1, :], size), _padded_square(spreads[..., -1, :, :], size)
            found, triangles = getattr(kernels, f"smooth_{size}")(
                _padded(states, size), to_triangle(_padded_square(spreads, size)), _padded(following, size),
                to_triangle(_padded_square(following_spreads, size)), ahead, last, to_triangle(last_spread),
                _padded_square(self._transition, size),
            )  # fmt: skip
            return Smoothed(found[..., :n], from_triangle(triangles, size)[..., :n, :n])
        after, after_spread = states.copy(), spreads.copy()
        for t in reversed(range(states.shape[-2] - 1)):
            gain = np.linalg.solve(following_spreads[..., t, :, :], self._transition @ spreads[..., t, :, :])
            change = (after[..., t + 1, :] - following[..., t, :])[..., None]
            after[..., t, :] += (np.swapaxes(gain, -1, -2) @ change)[..., 0]
            more = after_spread[..., t + 1, :, :] - following_spreads[..., t, :, :]
            after_spread[..., t, :, :] += np.swapaxes(gain, -1, -2) @ more @ gain
        return Smoothed(after, after_spread)


def predicted(state: Reals, covariance: Reals, transition: Reals, noise: Reals) -> tuple[Reals, Reals]:
    """Return the next states (..., n) and covariances, by the kernel of the next larger size."""
    n, size = state.shape[-1], _size(state.shape[-1])
    after, triangle = getattr(kernels, f"predict_{size}")(
        _padded(state, size), to_triangle(_padded_square(covariance, size)), _padded_square(transition, size),
        to_triangle(_padded_square(noise, size)),
    )  # fmt: skip
    return after[..., :n], from_triangle(triangle, size)[..., :n, :n]


def updated(
    state: Reals,
    covariance: Reals,
    innovation: Reals,
    rows: Reals,
    noise: Reals,
    gate: float,
    in_sequence: bool = False,
) -> tuple[Reals, Reals, Reals, Reals]:
    """Return states, covariances, squared innovations and whether measurements are used.

    `rows` (m, n) are the derivatives of the measured numbers by the state.
    """
    n, m = state.shape[-1], innovation.shape[-1]
    size = _size(n)
    wide = _JOINT.get(size, 0)
    first = _padded(state, size), to_triangle(_padded_square(covariance, size))
    if m <= wide and not in_sequence:
        after, triangle, numbers = getattr(kernels, f"update_{size}_{wide}")(
            *first, _padded(innovation, wide), _padded_rows(rows, wide, size), to_triangle(_padded_square(noise, wide)),
            gate,
        )  # fmt: skip
        used = numbers[..., 1] > 0
    else:
        run = getattr(kernels, f"update_in_sequence_{size}")
        white, independent, variances = _whitened(innovation, rows, noise)
        after, triangle, numbers = run(
            *first, white, _padded_rows(independent, m, size), variances, gate if in_sequence else _OPEN
        )
        used = numbers[..., 1] > 0
        if not in_sequence:
            used &= numbers[..., 0] <= gate
            after = np.where(used[..., None], after, first[0])
            triangle = np.where(used[..., None], triangle, first[1])
    return after[..., :n], from_triangle(triangle, size)[..., :n, :n], numbers[..., 0], used


def _whitened(innovation: Reals, rows: Reals, noise: Reals) -> tuple[Reals, Reals, Reals]:
    """Return innovations and rows with independent noise, and its variances."""
    if np.array_equal(noise, np.diag(np.diag(noise))):
        return innovation, rows, np.diag(noise)
    seen = np.isfinite(innovation)
    if seen.all():
        factor = np.linalg.cholesky(noise)
        return (
            np.linalg.solve(factor, innovation[..., None])[..., 0],
            np.linalg.solve(factor, rows),
            np.ones(len(noise)),
        )
    both = seen[..., :, None] & seen[..., None, :]
    factor = np.linalg.cholesky(np.where(both, noise, np.eye(len(noise))))
    white = np.linalg.solve(factor, np.where(seen, innovation, 0)[..., None])[..., 0]
    return np.where(seen, white, np.nan), np.linalg.solve(factor, rows * seen[..., None]), np.ones(len(noise))


def _size(n: int) -> int:
    return next(size for size in (*_JOINT, LARGEST) if n <= size)


def _padded(vector: Reals, size: int) -> Reals:
    """Return vectors with zeros appended."""
    more = size - vector.shape[-1]
    return vector if not more else np.concatenate([vector, np.zeros((*vector.shape[:-1], more))], -1)


def _padded_rows(rows: Reals, m: int, n: int) -> Reals:
    found = np.zeros((*rows.shape[:-2], m, n))
    found[..., : rows.shape[-2], : rows.shape[-1]] = rows
    return found


def _padded_square(matrix: Reals, size: int) -> Reals:
    """Return matrices with ones appended to the diagonal: states and measured numbers of their own."""
    n = matrix.shape[-1]
    if n == size:
        return matrix
    found = np.zeros((*matrix.shape[:-2], size, size))
    found[..., range(n, size), range(n, size)] = 1
    found[..., :n, :n] = matrix
    return found


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
