"""The linear filter of the book on the eight coefficients of a motor."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from generated import motor_filters as kernels

from ..arguments import Reals, finite_number, real_array
from ..elements import LINE, MOTOR, Coefficients, plain, restorer
from ..evidence.triangles import from_triangle, to_triangle
from .matrices import as_definite
from .motor_objects import covariance_matrix, unit_motor


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
        self._motor, self._restored = unit_motor(motor), restorer(motor, MOTOR)
        self._covariance, _ = as_definite(covariance_matrix(covariance, "covariance", 8))

    @property
    def motor(self) -> Coefficients:
        """(8,) The estimate; an element if the filter began with one."""
        return self._restored(self._motor)

    @property
    def covariance(self) -> Reals:
        """(8, 8) The covariance of the coefficients by the linear filter."""
        return self._covariance

    def predict(self, noise: ArrayLike) -> None:
        """Add a covariance (8, 8) or its diagonal (8,)."""
        self._covariance = self._covariance + covariance_matrix(noise, "noise", 8)

    def update_lines(self, model: ArrayLike, measured: ArrayLike, sigma: float) -> None:
        """Update the motor by measured lines (k, 6); `sigma` is the standard deviation of each of eight equations."""
        one, two = (_unit_lines(x, name) for x, name in ((model, "model"), (measured, "measured")))
        variance = finite_number(sigma, "sigma") ** 2
        motor, triangle = kernels.update_linear_by_lines(self._motor, to_triangle(self._covariance), one, two, variance)
        self._motor, self._covariance = motor, from_triangle(triangle, 8)


def _unit_lines(value: ArrayLike, name: str) -> Reals:
    lines = real_array(plain(value, name, LINE), name, (-1, 6)).astype(float)
    size = np.linalg.norm(lines[..., :3], axis=-1, keepdims=True)
    return np.asarray(np.divide(lines, size, out=np.full_like(lines, np.nan), where=size > 0))
