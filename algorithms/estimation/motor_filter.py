"""Filters that estimate a rigid motion, as a motor with a covariance, from measured lines, points and planes."""

from __future__ import annotations

from functools import lru_cache
from math import inf, isfinite, nan
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from generated import motor_filters as kernels
from generated import pga3

from ..arguments import Reals, finite, finite_number, real_array
from ..elements import MOTOR, Coefficients, restorer
from ..evidence import rank
from ..evidence.gates import FEWEST, LATELY, SETTLED, UNLIKELY, WIDE, Record, checked_gate, gate_of, is_lost
from ..evidence.triangles import from_triangle, to_triangle
from .matrices import as_definite
from .motor_objects import LINES, PLANES, POINTS, Kind, covariance_matrix, unit_motor, variances_of
from .motor_starts import Beginning, Fit, Update
from .status import EstimationStatus

Model = Literal["random walk", "constant twist"]

_ONES, _IDENTITY = np.ones(2), np.eye(8)[0]


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
        Objects are left out if their sum of squared innovations, divided by their variances, exceeds this. A filter
        that leaves out most of what it sees is INCONSISTENT. If this happens again, and the objects of an update
        determine another motor with which most of them agree, it starts again from this one. It remains INCONSISTENT
        while fewer objects agree with this motor than with the one before, or while innovations are more likely for
        twice the stated variance, by odds of 1,000.

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
        gate: float = inf,
    ) -> None:
        if model not in ("random walk", "constant twist"):
            raise ValueError(f"model: {model!r}; expected 'random walk' or 'constant twist'")
        self._motor, self._restored = unit_motor(motor), restorer(motor, MOTOR)
        spread, definite = as_definite(covariance_matrix(covariance, "covariance"))
        self._triangle = to_triangle(spread)
        self._variance = _rotation_variance(self._triangle.tolist())
        self._is_walk = model == "random walk"
        walk, self._good_noise = as_definite(covariance_matrix(noise, "noise"))
        self._noise = to_triangle(walk)
        self._is_noisy = bool(self._noise.any())
        self._step, self._more = 0.0, np.zeros_like(self._noise)
        self._growth = _rotation_variance(self._noise.tolist())
        self._twist = finite(real_array(twist, "twist", (6,)).astype(float), "twist").reshape(6)
        self._twist_covariance, good_twist = as_definite(covariance_matrix(twist_covariance, "twist_covariance"))
        self._cross = np.zeros((6, 6))
        twist_walk, good_walk = as_definite(covariance_matrix(twist_noise, "twist_noise"))
        self._twist_noise = to_triangle(twist_walk)
        self._good_noise &= good_walk
        self._gate = checked_gate(gate)
        self._information = np.zeros((6, 6))
        self._rank = 0
        self._observed = EstimationStatus.UNOBSERVED
        good = definite and good_twist and self._good_noise
        self._status = EstimationStatus.UNOBSERVED if good else EstimationStatus.NOT_DEFINITE
        self._innovation = (0.0, 0)
        self._skipped = 0
        self._lately = 0, 0
        self._record = Record()
        self._beginning: Beginning | None = None
        self._sigma = 1.0
        self._variances = variances_of(self._sigma)

    @property
    def motor(self) -> Coefficients:
        """(8,) The estimate; an element if the filter began with one."""
        return self._restored(self._motor)

    @property
    def covariance(self) -> Reals:
        """(6, 6) The covariance of the error of the motor."""
        return from_triangle(self._triangle, 6)

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
        step = dt if type(dt) is float else _seconds(dt)
        if not 0 <= step < inf:
            self._status = EstimationStatus.BAD_TIME
            return self._status
        if not self._is_walk:
            self._predict_by_twist(step)
        elif self._is_noisy:
            if step != self._step:
                self._step, self._more = step, step * self._noise
            self._triangle = self._triangle + self._more
            self._variance += step * self._growth
            if self._beginning is not None:
                self._beginning = self._beginning.with_noise(self._more)
        self._status = self._observed if self._good_noise else EstimationStatus.NOT_DEFINITE
        return self._status

    def _predict_by_twist(self, step: float) -> None:
        joint = np.block([[self.covariance, self._cross], [self._cross.T, self._twist_covariance]])
        motor, triangle = kernels.predict_by_twist(
            self._motor, self._twist, to_triangle(joint), step, self._noise, self._twist_noise
        )
        joint = from_triangle(triangle, 12)
        self._motor = motor
        self._set_covariance(to_triangle(joint[:6, :6]))
        self._cross, self._twist_covariance = joint[:6, 6:], joint[6:, 6:]
        self._beginning = None

    def move(self, motion: ArrayLike, noise: ArrayLike = 0.0) -> EstimationStatus:
        """Predict the motor after a known motion D in the frame of reference, ``D M``, with a covariance of its error.

        Parameters
        ----------
        motion : array_like, (8,)
            Unit motor.
        noise : array_like, (6, 6) or (6,)
            Covariance of the error of the motion, or its diagonal.
        """
        step = unit_motor(motion)
        spread, good = as_definite(covariance_matrix(noise, "noise"))
        self._motor, triangle = kernels.predict_by_motion(self._motor, self._triangle, step, to_triangle(spread))
        self._set_covariance(triangle)
        self._beginning = None
        self._status = self._observed if good else EstimationStatus.NOT_DEFINITE
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
        return self._update(LINES, model, measured, sigma)

    def update_points(self, model: ArrayLike, measured: ArrayLike, sigma: float) -> EstimationStatus:
        """Update the motor by measured points (k, 3), with the standard deviation `sigma` of each coordinate."""
        return self._update(POINTS, model, measured, sigma)

    def update_planes(self, model: ArrayLike, measured: ArrayLike, sigma: ArrayLike) -> EstimationStatus:
        """Update the motor by measured planes (k, 4) with oriented normals.

        `sigma` is the standard deviation of normals, in rad, and of the distance of planes at their points closest to
        the origin; one number stands for both.
        """
        return self._update(PLANES, model, measured, sigma)

    def _update(self, kind: Kind, model: ArrayLike, measured: ArrayLike, sigma: ArrayLike) -> EstimationStatus:
        if self._beginning is None and self._variance <= WIDE**2 and self._attempted(kind, model, measured, sigma):
            return self._status
        one, two = kind.rows(model, "model"), kind.rows(measured, "measured")
        if one.ndim != 2 or one.shape != two.shape:
            raise ValueError(f"measured: shape {two.shape}; expected {one.shape} as for model, one row for each object")
        one, two = one.astype(float, copy=False), two.astype(float, copy=False)
        variances = variances_of(sigma)
        first = self._began(kind, one, two, variances)
        update = (
            Update(kind, self._motor, self._triangle, one, two, variances, self._gate)
            if first is None
            else Update(kind, first.motor, first.triangle, first.model, first.seen, variances, self._gate)
        )
        first_found = update.started_at(self._motor)
        usable = kind.usable(update.model, update.seen)
        n_new = int(kind.usable(one, two).sum())
        if not n_new:
            self._skipped += len(one)
            self._status, self._innovation = EstimationStatus.SKIPPED, (0.0, 0)
            return self._status
        used = int(first_found[2][2])
        settled = first_found[2][3] and first_found[2][1] <= _limit(max(kind.n_numbers * used, 1))
        if first is None and used == usable.sum() and settled:
            fit = Fit(0.0, first_found, usable)
        else:
            fit = update.best(first_found, self._motor, self.covariance)
        lost = is_lost(int(fit.used.sum()), int(usable.sum()))
        if self._beginning is None:
            self._record.begin()
        again = self._lately[1] > 0
        if lost and again and first is None:
            other = self._restarted(kind, one[usable], two[usable], variances)
            if other is not None:
                first, fit = other
                self._record.give_up()
        (motor, triangle, numbers), used = fit.found, int(fit.used.sum())
        known = 0 if self._beginning is None else len(self._beginning.model)
        n_used = int(fit.used[known:].sum())
        self._lately = (0, 0) if used == usable.sum() else self._later(n_used, n_new)
        self._skipped += len(one) - n_used
        if not (used and np.isfinite(update.triangle).all()):
            unused = again and is_lost(*self._lately)
            self._status = EstimationStatus.INCONSISTENT if unused else EstimationStatus.REJECTED
            self._innovation = (0.0, 0)
            return self._status
        if not (numbers[3] and np.isfinite(motor).all() and np.isfinite(triangle).all()):
            self._status = EstimationStatus.NOT_CONVERGED
            return self._status
        if first is None:
            self._accept(kind, motor, triangle, one[fit.used])
        else:
            self._information = np.zeros((6, 6))
            self._rank = 0
            self._accept(kind, motor, triangle, first.model[fit.used])
        is_known = self._rank == 6 and used >= FEWEST and self._variance < SETTLED**2
        self._beginning = None if is_known and not lost else first
        self._innovation = (float(numbers[1]), kind.n_numbers * used)
        contradicts = lost or numbers[1] > _limit(kind.n_numbers * used)
        contradicts |= self._record.again(*self._innovation, 0 if contradicts else used) or is_lost(*self._lately)
        self._status = EstimationStatus.INCONSISTENT if contradicts else self._observed
        return self._status

    def _restarted(self, kind: Kind, model: Reals, seen: Reals, variances: Reals) -> tuple[Beginning, Fit] | None:
        """Return a beginning without a prediction, and the motor of most of the objects, if these determine one."""
        reach = 1.0 + max(float(np.abs(each).max()) for each in (model, seen))
        wide = to_triangle(np.diag([np.pi**2] * 3 + [(2 * reach) ** 2] * 3))
        first = Beginning(self._motor, wide, kind, variances, model, seen)
        update = Update(kind, self._motor, wide, model, seen, variances, self._gate)
        fit = update.best(update.started_at(self._motor), self._motor, from_triangle(wide, 6))
        if is_lost(int(fit.used.sum()), len(model)):
            return None
        information = from_triangle(kind.information(_IDENTITY, model[fit.used], _ONES), 6)
        return (first, fit) if rank(information) == 6 else None

    def _later(self, n_used: int, n_seen: int) -> tuple[int, int]:
        """Return how many of the objects since all of an update were used, or of the last ones, were used."""
        used, seen = self._lately
        if seen > LATELY:
            used, seen = used // 2, seen // 2
        return used + n_used, seen + n_seen

    def _attempted(self, kind: Kind, model: ArrayLike, measured: ArrayLike, sigma: ArrayLike) -> bool:
        """Update by arrays that the kernel takes without checks, if it uses all objects and they agree with the motor.

        Otherwise, nothing is changed, and the result is False.
        """
        if sigma is not self._sigma:
            if type(sigma) is not float:
                return False
            self._sigma, self._variances = sigma, variances_of(sigma)
        motor = self._motor
        found = kind.update.attempt(motor, self._triangle, model, measured, self._variances, self._gate, motor)
        if found is None or found[0].ndim != 1:
            return False
        motor, triangle, numbers = found
        _, square, used, settled, _ = numbers.tolist()
        freedom = kind.n_numbers * int(used)
        if not (used and used == len(measured) and settled and square <= _limit(freedom)):  # type: ignore[arg-type]
            return False
        entries = triangle.tolist()
        if not isfinite(sum(entries) + sum(motor.tolist())):
            return False
        if self._is_walk and self._rank == 6:
            self._motor, self._triangle = motor, triangle
            self._variance = max(entries[0], entries[6], entries[11])
        else:
            self._accept(kind, motor, triangle, model)
        self._innovation = (square, freedom)
        self._lately = (0, 0)
        contradicted = self._record.add(square, freedom, int(used))
        self._status = EstimationStatus.INCONSISTENT if contradicted else self._observed
        return True

    def _began(self, kind: Kind, model: Reals, seen: Reals, variances: Reals) -> Beginning | None:
        """Return what is used together, if the rotation is uncertain."""
        good = np.isfinite(model).all(1) & np.isfinite(seen).all(1)
        first = self._beginning
        if first is not None and first.fits(kind, variances):
            return first.with_objects(model[good], seen[good])
        if self._is_walk and good.any() and self._variance > WIDE**2:
            return Beginning(self._motor, self._triangle, kind, variances, model[good], seen[good])
        return None

    def _accept(self, kind: Kind, motor: Reals, triangle: Reals, model: ArrayLike) -> None:
        """Take the result of an update, which used objects of the model."""
        if not self._is_walk:
            # The twist is corrected by its regression on the motor.
            before, after = self.covariance, from_triangle(triangle, 6)
            gain = np.linalg.solve(before, self._cross).T
            error = -2 * pga3.motor_logarithm(pga3.motor_product(motor, pga3.motor_inverse(self._motor)))
            self._twist = self._twist + gain @ error
            self._twist_covariance = self._twist_covariance + gain @ (after - before) @ gain.T
            self._cross = after @ gain.T
        self._motor = motor
        self._set_covariance(triangle)
        if self._rank < 6:
            # In the frame of the model, errors of the estimate do not turn what remains undetermined.
            self._information += from_triangle(kind.information(_IDENTITY, model, _ONES), 6)
            self._rank = rank(self._information)
            self._observed = EstimationStatus.OK if self._rank == 6 else EstimationStatus.UNOBSERVED

    def _set_covariance(self, triangle: Reals) -> None:
        self._triangle = triangle
        self._variance = _rotation_variance(triangle.tolist())


def _rotation_variance(triangle: list[float]) -> float:
    """Return the largest variance of the rotation about an axis of the frame of reference."""
    return max(triangle[0], triangle[6], triangle[11])


def _seconds(dt: object) -> float:
    """Return a time, or NaN if it is not finite."""
    try:
        return finite_number(dt, "dt")
    except ValueError:
        return nan


@lru_cache(maxsize=1000)
def _limit(freedom: int) -> float:
    return gate_of(freedom, UNLIKELY)
