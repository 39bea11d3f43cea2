"""Filters that estimate a rigid motion, as a motor with a covariance, from measured lines, points and planes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtri

from generated import motor_filters as kernels
from generated import pga3

from ..arguments import Reals, finite, finite_number, real_array
from ..motors.recovery import motor_from_objects
from .matrices import as_definite, from_triangle, to_triangle
from .status import EstimationStatus

Model = Literal["random walk", "constant twist"]

_UNLIKELY = 1e-9
"""An update is examined if its innovations are less probable than this."""
_UNDETERMINED = 1e-9
"""Eigenvalues of the scaled information below this count as zero."""
_WIDE = 0.3
"""rad. A prediction that is less certain than this is not the only start of an update."""
_SETTLED, _FEWEST = 0.1, 3
"""Objects are kept, and used again with those measured next, until the rotation is known to this standard deviation in
rad and at least this many were used."""
_NONE = np.inf


@dataclass(frozen=True, slots=True, eq=False)
class Observability:
    """What measured objects determine of a motor."""

    rank: int
    """The number of determined directions, of 6: 4 for a line, 5 for parallel lines, 6 for two other lines."""
    information: Reals
    """(6, 6) The inverse covariance of the error of the motor by the objects alone."""
    undetermined: Reals
    """(6 - rank, 6) Twists that the objects do not determine, as lines of `generated.pga3`."""


@dataclass(frozen=True, slots=True)
class _Kind:
    """The kernels for objects of one kind."""

    name: str
    length: int
    n_numbers: int
    update: Callable[..., Any]
    information: Callable[..., Any]


_LINES = _Kind("lines", 6, 4, kernels.update_by_lines, kernels.information_of_lines)
_POINTS = _Kind("points", 3, 3, kernels.update_by_points, kernels.information_of_points)
_PLANES = _Kind("planes", 4, 3, kernels.update_by_planes, kernels.information_of_planes)


@dataclass(frozen=True, slots=True, eq=False)
class _Beginning:
    """A wide prediction and all objects measured since, from which the motor is estimated again with each update."""

    motor: Reals
    covariance: Reals
    kind: _Kind
    variances: Reals
    model: Reals
    seen: Reals

    def fits(self, kind: _Kind, variances: Reals) -> bool:
        return self.kind is kind and np.array_equal(self.variances, variances)


class MotorFilter:
    """Error-state Kalman filter for a motor M: objects measured are ``M x ~M`` for objects x of a model.

    The true motor is ``exp(-x/2) M`` with an error x in the frame of reference. Each update is linearised at its own
    result, as often as necessary, and if the prediction is far off, also from starts that are determined by the objects
    or by the covariance. While the rotation is uncertain, the objects since the beginning are used together. Methods
    return the status.

    Parameters
    ----------
    motor : array_like, (8,)
        Unit motor of `generated.pga3`. Its sign has no meaning.
    covariance : array_like, (6, 6)
        Of the error, with the coefficients e12 e13 e23 e01 e02 e03 of lines: rotation in rad, and translation of what
        is at the origin.
    model : {"random walk", "constant twist"}
        How the motor moves between measurements.
    noise : array_like, (6, 6) or (6,), optional
        Covariance per second by which the error of the motor grows, or its diagonal; by default 0.
    twist, twist_covariance, twist_noise : array_like, optional
        For a constant twist: the twist v (6,) of ``exp(-dt/2 v)`` in the frame of reference, its covariance, by default
        1, and its growth per second, by default 0.
    gate : float
        Objects are left out if their sum of squared innovations, divided by their variances, exceeds this.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or is not finite, or the motor is not a unit motor.
    """

    def __init__(
        self,
        motor: ArrayLike,
        covariance: ArrayLike,
        *,
        model: Model = "random walk",
        noise: ArrayLike = 0.0,
        twist: ArrayLike = (0.0,) * 6,
        twist_covariance: ArrayLike = 1.0,
        twist_noise: ArrayLike = 0.0,
        gate: float = _NONE,
    ) -> None:
        if model not in ("random walk", "constant twist"):
            raise ValueError(f"model: {model!r}; expected 'random walk' or 'constant twist'")
        self._motor = _unit_motor(motor)
        self._covariance, definite = as_definite(_matrix(covariance, "covariance"))
        self._model = model
        self._noise = as_definite(_matrix(noise, "noise"))[0]
        self._twist = finite(real_array(twist, "twist", (6,)).astype(float), "twist").reshape(6)
        self._twist_covariance = as_definite(_matrix(twist_covariance, "twist_covariance"))[0]
        self._cross = np.zeros((6, 6))
        self._twist_noise = as_definite(_matrix(twist_noise, "twist_noise"))[0]
        self._gate = min(float(gate), 1e300)
        self._information = np.zeros((6, 6))
        self._rank = 0
        self._status = EstimationStatus.UNOBSERVED if definite else EstimationStatus.NOT_DEFINITE
        self._innovation = (0.0, 0)
        self._skipped = 0
        self._beginning: _Beginning | None = None

    @property
    def motor(self) -> Reals:
        """(8,) The estimate."""
        return self._motor

    @property
    def covariance(self) -> Reals:
        """(6, 6) The covariance of the error of the motor."""
        return self._covariance

    @property
    def twist(self) -> Reals:
        """(6,) The twist of the motor in the frame of reference; 0 for a random walk."""
        return self._twist

    @property
    def twist_covariance(self) -> Reals:
        """(6, 6) The covariance of the twist."""
        return self._twist_covariance

    @property
    def status(self) -> EstimationStatus:
        """The status of the last call."""
        return self._status

    @property
    def innovation(self) -> tuple[float, int]:
        """The squared innovation of the last update, divided by its covariance, and its degrees of freedom."""
        return self._innovation

    @property
    def n_skipped(self) -> int:
        """How many objects were not used so far because they are not finite, have no direction, or failed the gate."""
        return self._skipped

    @property
    def rank(self) -> int:
        """How many of the 6 directions all measurements so far determine."""
        return self._rank

    def predict(self, dt: float) -> EstimationStatus:
        """Predict the motor after a time in seconds. A negative time changes nothing and gives BAD_TIME."""
        try:
            step = finite_number(dt, "dt")
        except ValueError:
            step = -1.0
        if step < 0:
            self._status = EstimationStatus.BAD_TIME
            return self._status
        if self._model == "random walk":
            self._covariance = self._covariance + step * self._noise
            if (first := self._beginning) is not None:
                self._beginning = replace(first, covariance=first.covariance + step * self._noise)
        else:
            self._beginning = None
            joint = np.block([[self._covariance, self._cross], [self._cross.T, self._twist_covariance]])
            motor, triangle = kernels.predict_by_twist(
                self._motor, self._twist, to_triangle(joint), step, to_triangle(self._noise),
                to_triangle(self._twist_noise),
            )  # fmt: skip
            joint = from_triangle(triangle, 12)
            self._motor, self._covariance = motor, joint[:6, :6]
            self._cross, self._twist_covariance = joint[:6, 6:], joint[6:, 6:]
        self._status = self._observed()
        return self._status

    def move(self, motion: ArrayLike, noise: ArrayLike = 0.0) -> EstimationStatus:
        """Predict the motor after a known motion D in the frame of reference, ``D M``, with a covariance of its error.

        Parameters
        ----------
        motion : array_like, (8,)
            Unit motor.
        noise : array_like, (6, 6) or (6,)
            Covariance of the error of the motion, or its diagonal.
        """
        step = _unit_motor(motion)
        spread = as_definite(_matrix(noise, "noise"))[0]
        moved = kernels.predict_by_motion(self._motor, to_triangle(self._covariance), step, to_triangle(spread))
        self._motor, self._covariance = moved[0], from_triangle(moved[1], 6)
        self._beginning = None
        self._status = self._observed()
        return self._status

    def update_lines(self, model: ArrayLike, measured: ArrayLike, sigma: ArrayLike) -> EstimationStatus:
        """Update the motor by measured lines ``M x ~M``.

        Parameters
        ----------
        model, measured : array_like, (k, 6)
            Directed lines of `generated.pga3`, of any norm. Lines that are not finite are skipped.
        sigma : float or pair of floats
            The standard deviation of directions, in rad, and of the position of lines at their points closest to the
            origin; one number stands for both.
        """
        return self._update(_LINES, model, measured, sigma)

    def update_points(self, model: ArrayLike, measured: ArrayLike, sigma: float) -> EstimationStatus:
        """Update the motor by measured points (k, 3), with the standard deviation `sigma` of each coordinate."""
        return self._update(_POINTS, model, measured, sigma)

    def update_planes(self, model: ArrayLike, measured: ArrayLike, sigma: ArrayLike) -> EstimationStatus:
        """Update the motor by measured planes (k, 4) with oriented normals.

        `sigma` is the standard deviation of normals, in rad, and of the distance of planes at their points closest to
        the origin; one number stands for both.
        """
        return self._update(_PLANES, model, measured, sigma)

    def _update(self, kind: _Kind, model: ArrayLike, measured: ArrayLike, sigma: ArrayLike) -> EstimationStatus:
        one, two = (real_array(x, name, (-1, kind.length)) for x, name in ((model, "model"), (measured, "measured")))
        if one.ndim != 2 or one.shape != two.shape:
            raise ValueError(f"measured: shape {two.shape}; expected {one.shape} as for model, one row for each object")
        one, two = one.astype(float, copy=False), two.astype(float, copy=False)
        variances = _variances(sigma)
        first = self._began(kind, one, two, variances)
        at, spread = (self._motor, self._covariance) if first is None else (first.motor, first.covariance)
        taken = (one, two) if first is None else (first.model, first.seen)
        prior = to_triangle(spread)
        found = kind.update(at, prior, *taken, variances, self._gate, self._motor)
        used = int(found[2][2])
        if not used:
            self._skipped += len(one)
            self._status = EstimationStatus.REJECTED if np.isfinite(two).all(1).any() else EstimationStatus.SKIPPED
            self._innovation = (0.0, 0)
            return self._status
        limit = _limit(kind.n_numbers * used)
        if first is not None or not (found[2][3] and found[2][1] <= limit):
            found = self._from_other_starts(kind, at, prior, *taken, variances, found)
        motor, triangle, numbers = found
        used = int(numbers[2])
        limit = _limit(max(kind.n_numbers * used, 1))
        if not (numbers[3] and np.isfinite(motor).all() and np.isfinite(triangle).all()):
            self._status = EstimationStatus.NOT_CONVERGED
            return self._status
        known = 0 if self._beginning is None else len(self._beginning.model)
        self._skipped += max(len(one) - max(used - known, 0), 0)
        self._innovation = (float(numbers[1]), kind.n_numbers * used)
        self._accept(motor, from_triangle(triangle, 6))
        if self._rank < 6:
            self._information += from_triangle(kind.information(motor, one[np.isfinite(two).all(1)], _ONES), 6)
            self._rank = _rank(self._information)
        is_known = self._rank == 6 and used >= _FEWEST and self._turn() < _SETTLED
        self._beginning = None if is_known else first
        self._status = EstimationStatus.INCONSISTENT if numbers[1] > limit else self._observed()
        return self._status

    def _turn(self) -> float:
        """Return the largest standard deviation of the rotation about an axis of the frame of reference."""
        spread = self._covariance
        return float(max(spread[0, 0], spread[1, 1], spread[2, 2]) ** 0.5)

    def _began(self, kind: _Kind, model: Reals, seen: Reals, variances: Reals) -> _Beginning | None:
        """Return what is used together, if the rotation is uncertain."""
        good = np.isfinite(model).all(1) & np.isfinite(seen).all(1)
        first = self._beginning
        if first is not None and first.fits(kind, variances):
            more = np.concatenate([first.model, model[good]]), np.concatenate([first.seen, seen[good]])
            return replace(first, model=more[0], seen=more[1])
        if self._model == "random walk" and good.any() and self._turn() > _WIDE:
            return _Beginning(self._motor, self._covariance, kind, variances, model[good], seen[good])
        return None

    def _accept(self, motor: Reals, covariance: Reals) -> None:
        if self._model == "constant twist":
            # The twist is corrected by its regression on the motor.
            gain = np.linalg.solve(self._covariance, self._cross).T
            error = -2 * pga3.motor_logarithm(pga3.motor_product(motor, pga3.motor_inverse(self._motor)))
            self._twist = self._twist + gain @ error
            self._twist_covariance = self._twist_covariance + gain @ (covariance - self._covariance) @ gain.T
            self._cross = covariance @ gain.T
        self._motor, self._covariance = motor, covariance

    def _from_other_starts(
        self, kind: _Kind, motor: Reals, prior: Reals, model: Reals, seen: Reals, variances: Reals, first: Any
    ) -> Any:
        """Return the best of the updates from several starts: that with the smallest sum of squares."""
        best, cost = first, _cost(first[2])
        for start in self._starts(kind, model, seen):
            found = kind.update(motor, prior, model, seen, variances, self._gate, start)
            if _cost(found[2]) < cost:
                best, cost = found, _cost(found[2])
            if cost <= kind.n_numbers * found[2][2]:
                break
        return best

    def _starts(self, kind: _Kind, model: Reals, seen: Reals) -> list[Reals]:
        good = np.isfinite(model).all(1) & np.isfinite(seen).all(1)
        if kind is not _POINTS:
            good &= (np.abs(model[:, :3]).sum(1) > 0) & (np.abs(seen[:, :3]).sum(1) > 0)
        starts = []
        if good.any():
            fit = motor_from_objects(**{kind.name: (model[good], seen[good])})
            starts.append(np.asarray(fit.motor, float))
        values, vectors = np.linalg.eigh(self._covariance[:3, :3])
        for value, axis in zip(values[::-1], vectors.T[::-1], strict=True):
            if value < _WIDE**2:
                continue
            follow = self._covariance[3:, :3] @ axis / value
            for angle in (0.5, -0.5, 1.0, -1.0, 1.5, -1.5):
                error = angle * min(2.0, np.sqrt(value)) * np.concatenate([axis, follow])
                starts.append(pga3.motor_product(pga3.motor_exponential(-error / 2), self._motor))
        return starts

    def _observed(self) -> EstimationStatus:
        return EstimationStatus.OK if self._rank == 6 else EstimationStatus.UNOBSERVED


_ONES = np.ones(2)


def observability(
    motor: ArrayLike,
    *,
    lines: ArrayLike | None = None,
    points: ArrayLike | None = None,
    planes: ArrayLike | None = None,
    sigma: ArrayLike = 1.0,
) -> Observability:
    """Compute what objects of a model determine of a motor, and what not.

    Parameters
    ----------
    motor : array_like, (8,)
        Unit motor of `generated.pga3`.
    lines, points, planes : array_like, (k, 6), (k, 3) or (k, 4), optional
        Objects of the model.
    sigma : float or pair of floats
        Standard deviations as in `MotorFilter`.

    Returns
    -------
    Observability
    """
    at = _unit_motor(motor)
    information = np.zeros((6, 6))
    for kind, objects in ((_LINES, lines), (_POINTS, points), (_PLANES, planes)):
        if objects is not None:
            rows = real_array(objects, kind.name, (-1, kind.length)).astype(float)
            information += from_triangle(kind.information(at, rows, _variances(sigma)), 6)
    values, vectors, scale = _spectrum(information)
    rank = int((values > _UNDETERMINED).sum())
    free = vectors[:, : 6 - rank].T * scale
    return Observability(rank, information, free / np.linalg.norm(free, axis=1, keepdims=True))


def filter_lines(
    motor: ArrayLike,
    covariance: ArrayLike,
    model: ArrayLike,
    measured: ArrayLike,
    sigma: ArrayLike,
    *,
    noise: ArrayLike = 0.0,
    dt: ArrayLike = 1.0,
    gate: float = _NONE,
) -> tuple[Reals, Reals, Reals]:
    """Filter a recording of one measured line at a time, for a motor in a random walk, in one call of a kernel.

    Each line is linearised once; for a start that is far off, use `MotorFilter`.

    Parameters
    ----------
    motor, covariance, noise, gate
        As for `MotorFilter`.
    model, measured : array_like, (..., n, 6)
    sigma
        As for `MotorFilter.update_lines`.
    dt : float or array_like, (n,)
        The time before each line. Negative times count as 0.

    Returns
    -------
    motors : array, (..., n, 8)
    covariances : array, (..., n, 6, 6)
    numbers : array, (..., n, 2)
        The squared innovation of each line divided by its covariance, and whether the line is used.
    """
    one, two = (real_array(x, name, (-1, 6)).astype(float) for x, name in ((model, "model"), (measured, "measured")))
    steps = np.broadcast_to(np.maximum(np.nan_to_num(np.asarray(dt, float)), 0), (one.shape[-2],))
    growth = steps[:, None] * to_triangle(as_definite(_matrix(noise, "noise"))[0])
    spread = to_triangle(as_definite(_matrix(covariance, "covariance"))[0])
    motors, triangles, numbers = kernels.filter_lines(
        _unit_motor(motor), spread, one, two, growth, _variances(sigma), min(float(gate), 1e300)
    )
    return motors, from_triangle(triangles, 6), numbers


class LinearMotorFilter:
    """The filter of the book on the eight coefficients of a motor, from lines: ``M x - y M = 0`` is linear in M.

    Its noise depends on the motor and is singular for each line, which a linear filter cannot represent: all eight
    equations get the same variance. It needs no linearisation, but its covariance is not that of the error. After each
    line, the motor is projected to the Study quadric. Use `MotorFilter` where the covariance matters.

    Parameters
    ----------
    motor : array_like, (8,)
    covariance : array_like, (8, 8)
    """

    def __init__(self, motor: ArrayLike, covariance: ArrayLike) -> None:
        self._motor = _unit_motor(motor)
        self._covariance, _ = as_definite(_matrix(covariance, "covariance", 8))

    @property
    def motor(self) -> Reals:
        """(8,) The estimate."""
        return self._motor

    @property
    def covariance(self) -> Reals:
        """(8, 8) The covariance of the coefficients by the linear filter."""
        return self._covariance

    def predict(self, noise: ArrayLike) -> None:
        """Add a covariance (8, 8) or its diagonal (8,)."""
        self._covariance = self._covariance + _matrix(noise, "noise", 8)

    def update_lines(self, model: ArrayLike, measured: ArrayLike, sigma: float) -> None:
        """Update the motor by measured lines (k, 6); `sigma` is the standard deviation of each of eight equations."""
        one, two = (_unit_lines(x, name) for x, name in ((model, "model"), (measured, "measured")))
        variance = finite_number(sigma, "sigma") ** 2
        motor, triangle = kernels.update_linear_by_lines(self._motor, to_triangle(self._covariance), one, two, variance)
        self._motor, self._covariance = motor, from_triangle(triangle, 8)


def _unit_lines(value: ArrayLike, name: str) -> Reals:
    lines = real_array(value, name, (-1, 6)).astype(float)
    size = np.linalg.norm(lines[..., :3], axis=-1, keepdims=True)
    return np.asarray(np.divide(lines, size, out=np.full_like(lines, np.nan), where=size > 0))


def _unit_motor(value: ArrayLike) -> Reals:
    motor = finite(real_array(value, "motor", (8,)).astype(float), "motor")
    if motor.ndim != 1:
        raise ValueError(f"motor: shape {motor.shape}; expected (8,), one motor")
    if abs(np.linalg.norm(motor[:4]) - 1) > 1e-3:
        raise ValueError(f"motor: norm {np.linalg.norm(motor[:4])}; expected a unit motor, see pga3.normalize_motor")
    return np.asarray(pga3.normalize_motor(motor))


def _matrix(value: ArrayLike, name: str, n: int = 6) -> Reals:
    array = finite(real_array(value, name).astype(float), name)
    if array.ndim < 2:
        array = np.diag(np.broadcast_to(array, (n,)))
    if array.shape != (n, n):
        raise ValueError(f"{name}: shape {array.shape}; expected ({n}, {n}), ({n},) or a number")
    return array


def _variances(sigma: ArrayLike) -> Reals:
    if type(sigma) is float and 0 < sigma < np.inf:
        return np.array((sigma * sigma, sigma * sigma))
    pair = finite(real_array(sigma, "sigma").astype(float), "sigma")
    if pair.size not in (1, 2) or (pair <= 0).any():
        raise ValueError(f"sigma: {pair.tolist()}; expected a positive number, or two")
    return np.array(np.broadcast_to(pair.ravel() ** 2, (2,)))


@lru_cache(maxsize=1000)
def _limit(freedom: int) -> float:
    return float(chdtri(freedom, _UNLIKELY))


def _cost(numbers: Reals) -> float:
    return float(numbers[1]) if numbers[3] and np.isfinite(numbers[1]) else np.inf


def _spectrum(information: Reals) -> tuple[Reals, Reals, Reals]:
    """Return eigenvalues and vectors of the information scaled to ones on its diagonal, and the scale."""
    diagonal = np.diag(information)
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1))
    values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
    return values, vectors, scale


def _rank(information: Reals) -> int:
    return int((_spectrum(information)[0] > _UNDETERMINED).sum())
