"""Filters that estimate a rotation, as a rotor with a covariance, from measured vectors and angular rates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from generated import estimation as kernels
from generated import vga3

from ..arguments import Reals, finite, finite_number, real_array
from ..elements import ROTOR, Coefficients, plain, restorer
from ..evidence.gates import FEWEST, SETTLED, UNLIKELY, WIDE, Record, checked_gate, gate_of, is_lost
from ..evidence.triangles import from_triangle, to_triangle
from ..precision import HUGE, ROUNDING
from .matrices import as_definite
from .rotor_starts import Beginning
from .status import EstimationStatus


class RotorFilter:
    """Error-state Kalman filter for a rotor R: vectors measured are ``R v ~R`` for vectors v of a model.

    The true rotor is ``exp(-b/2) R`` with the bivector b of a rotation about the axes of the frame of reference. While
    the rotation is uncertain, all vectors since the beginning are used together, from several starts. If the vectors
    contradict the prediction, the status is INCONSISTENT; if they agree on another rotor, the filter starts from it.
    It remains INCONSISTENT while fewer vectors agree with this rotor than with the one before, or while the innovations
    of several updates are more likely for twice the stated variance, by odds of 1,000.

    Parameters
    ----------
    rotor : array_like, (4,)
        Unit rotor of `generated.vga3`.
    covariance : array_like, (3, 3)
        Of the rotation about x, y, z, in rad.
    gate : float
        Vectors are left out if the square of their innovation, divided by its covariance, exceeds this.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or is not finite, or the rotor is not a unit rotor.
    """

    def __init__(self, rotor: ArrayLike, covariance: ArrayLike, *, gate: float = np.inf) -> None:
        self._rotor, self._restored = _unit_rotor(rotor), restorer(rotor, ROTOR)
        self._covariance, definite = as_definite(finite(real_array(covariance, "covariance", (3, 3)), "covariance"))
        self._gate = checked_gate(gate)
        self._innovation = (0.0, 0)
        self._record = Record()
        self._beginning: Beginning | None = None
        self._contradicted = False
        self._status = EstimationStatus.UNOBSERVED if definite else EstimationStatus.NOT_DEFINITE

    @property
    def rotor(self) -> Coefficients:
        """(4,) The estimate; an element if the filter began with one."""
        return self._restored(self._rotor)

    @property
    def covariance(self) -> Reals:
        """(3, 3) The covariance of the rotation by which it is wrong."""
        return self._covariance

    @property
    def innovation(self) -> tuple[float, int]:
        """The squared innovation of the last update, divided by its covariance, and the number of vectors used."""
        return self._innovation

    @property
    def status(self) -> EstimationStatus:
        """The status of the last call."""
        return self._status

    def predict(self, rate: ArrayLike, dt: float, noise: float = 0.0) -> EstimationStatus:
        """Predict the rotor after a time at an angular rate (3,) in the moving frame, with its noise in rad2/s."""
        turn = real_array(rate, "rate", (3,), "a vector").astype(float)
        if not (np.isfinite(turn).all() and np.isfinite(dt) and dt >= 0):
            self._status = EstimationStatus.BAD_TIME
            return self._status
        step = vga3.rotor_from_rotation_vector(dt * turn)
        self._rotor = np.asarray(vga3.normalize_rotor(vga3.rotor_product(self._rotor, step)))
        if finite_number(noise, "noise") < 0:
            raise ValueError(f"noise: {noise}; expected 0 or more")
        more = dt * float(noise) * np.eye(3)
        self._covariance = self._covariance + more
        if self._beginning is not None:
            self._beginning = self._beginning.moved(step, more)
        self._status = EstimationStatus.OK
        return self._status

    def update(self, vectors: ArrayLike, measured: ArrayLike, sigma: float) -> EstimationStatus:
        """Update the rotor by measured vectors (k, 3), with the standard deviation `sigma` of each coordinate."""
        one, two = _pair(vectors, measured)
        variance = finite_number(sigma, "sigma") ** 2
        rotor, triangle, numbers = kernels.update_by_vectors(
            self._rotor, to_triangle(self._covariance), one, two, variance, self._gate
        )
        seen, used = int(np.isfinite(two).all(1).sum()), int(numbers[1])
        if not seen:
            self._innovation, self._status = (0.0, 0), EstimationStatus.SKIPPED
            return self._status
        wide = self._beginning is not None or float(np.trace(self._covariance)) > WIDE**2
        unlikely = used < seen or numbers[0] > gate_of(3 * used, UNLIKELY)
        if wide or unlikely:
            return self._updated_from_several_starts(one, two, float(np.sqrt(variance)), seen, wide)
        self._contradicted = False
        self._innovation = float(numbers[0]), used
        self._rotor, self._covariance = rotor, from_triangle(triangle, 3)
        contradicted = self._record.add(float(numbers[0]), 3 * used, used)
        self._status = _observed(one[np.isfinite(two).all(1)])
        if contradicted:
            self._status = EstimationStatus.INCONSISTENT
        return self._status

    def _updated_from_several_starts(
        self, one: Reals, two: Reals, sigma: float, n_seen: int, wide: bool
    ) -> EstimationStatus:
        """Update by the best rotor of the prediction and the vectors, or by that of the vectors alone."""
        if self._beginning is None:
            self._record.begin()
        empty = np.empty((0, 3))
        first = self._beginning or Beginning(self._rotor, self._covariance, empty, empty, np.empty(0))
        first = first.with_vectors(one, two, sigma)
        fit = first.best(self._gate)
        unlikely = _is_unlikely(fit.square, fit.used)
        if unlikely and (self._contradicted or self._gate == HUGE):
            # The prediction is given up if most vectors agree on another rotor.
            again = replace(first, covariance=np.pi**2 * np.eye(3))
            other = again.best(self._gate)
            if not (_is_unlikely(other.square, other.used) or other.ambiguous) and len(first.vectors) > 1:
                first, fit, wide = again, other, True
                self._record.give_up()
        self._contradicted = unlikely
        new = fit.used[len(first.vectors) - n_seen :]
        self._innovation = fit.square, int(new.sum())
        if not new.any():
            self._innovation, self._status = (0.0, 0), EstimationStatus.REJECTED
            return self._status
        self._rotor, self._covariance = fit.rotor, fit.covariance
        known = fit.used.sum() >= FEWEST and np.trace(fit.covariance) < SETTLED**2 and not fit.ambiguous
        self._beginning = first if wide and not (known and not unlikely) else None
        self._status = _observed(first.vectors[fit.used])
        if self._status == EstimationStatus.OK and fit.ambiguous:
            self._status = EstimationStatus.AMBIGUOUS
        n_used = int(fit.used.sum())
        if self._record.again(fit.square, 3 * n_used, 0 if unlikely else n_used) or unlikely:
            self._status = EstimationStatus.INCONSISTENT
        return self._status


def _is_unlikely(square: float, used: Reals) -> bool:
    """Return whether vectors contradict a rotor, or most of them are left out."""
    count = int(used.sum())
    return is_lost(count, len(used)) or square > gate_of(3 * max(count, 1), UNLIKELY)


def _observed(vectors: Reals) -> EstimationStatus:
    """Return OK, or UNOBSERVED if vectors (n, 3) are parallel and leave the rotation about themselves."""
    values = np.linalg.eigvalsh(vectors.T @ vectors)
    # The vectors of the past may have determined it.
    return EstimationStatus.OK if values[1] > ROUNDING * values[2] else EstimationStatus.UNOBSERVED


class LinearRotorFilter:
    """The filter of the book on the four coefficients of a rotor (section 18.5.3): ``R v - w R = 0`` is linear in R.

    Its noise depends on the rotor; all four equations get the same variance. The rotor is normalised after each vector.

    Parameters
    ----------
    rotor : array_like, (4,)
    covariance : array_like, (4, 4)
    """

    def __init__(self, rotor: ArrayLike, covariance: ArrayLike) -> None:
        self._rotor, self._restored = _unit_rotor(rotor), restorer(rotor, ROTOR)
        self._covariance = as_definite(finite(real_array(covariance, "covariance", (4, 4)), "covariance"))[0]

    @property
    def rotor(self) -> Coefficients:
        """(4,) The estimate; an element if the filter began with one."""
        return self._restored(self._rotor)

    @property
    def covariance(self) -> Reals:
        """(4, 4) The covariance of the coefficients by the linear filter."""
        return self._covariance

    def update(self, vectors: ArrayLike, measured: ArrayLike, sigma: float) -> None:
        """Update the rotor by measured vectors (k, 3); `sigma` is the standard deviation of each equation."""
        one, two = _pair(vectors, measured)
        rotor, triangle = kernels.update_linear_by_vectors(
            self._rotor, to_triangle(self._covariance), one, two, finite_number(sigma, "sigma") ** 2
        )
        self._rotor, self._covariance = rotor, from_triangle(triangle, 4)


def _unit_rotor(value: ArrayLike) -> Reals:
    rotor = finite(real_array(plain(value, "rotor", ROTOR), "rotor", (4,)).astype(float), "rotor")
    if rotor.ndim != 1 or abs(np.linalg.norm(rotor) - 1) > 1e-3:
        raise ValueError(f"rotor: {rotor}; expected one unit rotor (4,), see vga3.normalize_rotor")
    return np.asarray(rotor / np.linalg.norm(rotor))


def _pair(vectors: ArrayLike, measured: ArrayLike) -> tuple[Reals, Reals]:
    pairs = ((vectors, "vectors"), (measured, "measured"))
    one, two = (real_array(x, name, (-1, 3), "vectors").astype(float) for x, name in pairs)
    if one.ndim != 2 or one.shape != two.shape:
        raise ValueError(f"measured: shape {two.shape}; expected {one.shape} as for vectors, one row for each vector")
    return one, two
