"""Filters that estimate a rotation, as a rotor with a covariance, from measured vectors and angular rates."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generated import estimation as kernels
from generated import vga3

from ..arguments import Reals, finite, finite_number, real_array
from ..elements import ROTOR, plain, restorer
from .matrices import as_definite, from_triangle, to_triangle
from .status import EstimationStatus


class RotorFilter:
    """Error-state Kalman filter for a rotor R: vectors measured are ``R v ~R`` for vectors v of a model.

    The true rotor is ``exp(-b/2) R`` with the bivector b of a rotation about the axes of the frame of reference.

    Parameters
    ----------
    rotor : array_like, (4,)
        Unit rotor of `generated.vga3`.
    covariance : array_like, (3, 3)
        Of the rotation about x, y, z, in rad.
    gate : float
        Vectors are left out if the square of their innovation, divided by its covariance, exceeds this.
    """

    def __init__(self, rotor: ArrayLike, covariance: ArrayLike, *, gate: float = np.inf) -> None:
        self._rotor, self._restored = _unit_rotor(rotor), restorer(rotor, ROTOR)
        self._covariance, definite = as_definite(finite(real_array(covariance, "covariance", (3, 3)), "covariance"))
        self._gate = min(float(gate), 1e300)
        self._innovation = (0.0, 0)
        self._status = EstimationStatus.UNOBSERVED if definite else EstimationStatus.NOT_DEFINITE

    @property
    def rotor(self) -> Any:
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
        turn = real_array(rate, "rate", (3,)).astype(float)
        if not (np.isfinite(turn).all() and np.isfinite(dt) and dt >= 0):
            self._status = EstimationStatus.BAD_TIME
            return self._status
        step = vga3.rotor_from_rotation_vector(dt * turn)
        self._rotor = np.asarray(vga3.normalize_rotor(vga3.rotor_product(self._rotor, step)))
        self._covariance = self._covariance + dt * finite_number(noise, "noise") * np.eye(3)
        self._status = EstimationStatus.OK
        return self._status

    def update(self, vectors: ArrayLike, measured: ArrayLike, sigma: float) -> EstimationStatus:
        """Update the rotor by measured vectors (k, 3), with the standard deviation `sigma` of each coordinate."""
        one, two = _pair(vectors, measured)
        variance = finite_number(sigma, "sigma") ** 2
        rotor, triangle, numbers = kernels.update_by_vectors(
            self._rotor, to_triangle(self._covariance), one, two, variance, self._gate
        )
        self._innovation = float(numbers[0]), int(numbers[1])
        if not numbers[1]:
            is_there = np.isfinite(two).all(1).any() if len(two) else False
            self._status = EstimationStatus.REJECTED if is_there else EstimationStatus.SKIPPED
            return self._status
        self._rotor, self._covariance = rotor, from_triangle(triangle, 3)
        good = one[np.isfinite(two).all(1)]
        values = np.linalg.eigvalsh(good.T @ good)
        # Parallel vectors leave the rotation about themselves; the others of the past may have determined it.
        is_full = values[1] > 1e-12 * values[2]
        self._status = EstimationStatus.OK if is_full else EstimationStatus.UNOBSERVED
        return self._status


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
    def rotor(self) -> Any:
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
    one, two = (real_array(x, n, (-1, 3)).astype(float) for x, n in ((vectors, "vectors"), (measured, "measured")))
    if one.ndim != 2 or one.shape != two.shape:
        raise ValueError(f"measured: shape {two.shape}; expected {one.shape} as for vectors, one row for each vector")
    return one, two
