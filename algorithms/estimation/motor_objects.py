"""Lines, points and planes that a motor is estimated from: their kernels, and what they determine of the motor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generated import motor_filters as kernels
from generated import pga3

from ..arguments import Reals, finite, real_array
from ..elements import LINE, MOTOR, PLANE, POINT, Layouts, plain
from ..evidence import rank, undetermined
from ..evidence.triangles import from_triangle


@dataclass(frozen=True, slots=True)
class Kind:
    """The kernels for objects of one kind."""

    name: str
    length: int
    """The number of coefficients."""
    n_numbers: int
    """The number of residuals."""
    n_directions: int
    """The number of those that are angles."""
    sample_size: int
    """The number of objects that determine a motor."""
    update: Any
    equations: Any
    information: Any
    layouts: Layouts
    """The layouts of objects that are elements."""

    def rows(self, value: ArrayLike, name: str) -> Reals:
        """Return objects as an array, one in each row."""
        return real_array(plain(value, name, self.layouts), name, (-1, self.length))

    def usable(self, model: Reals, seen: Reals) -> Reals:
        """Return which pairs of objects (n,) are finite and have directions."""
        good = np.isfinite(model).all(1) & np.isfinite(seen).all(1)
        if self.n_directions:
            good &= (np.abs(model[:, :3]).sum(1) > 0) & (np.abs(seen[:, :3]).sum(1) > 0)
        return np.asarray(good)

    def squares(self, motor: Reals, model: Reals, seen: Reals, variances: Reals) -> Reals:
        """Return the sums of squared residuals (n,), each divided by its variance."""
        residuals = self.equations(motor, model, seen)[0]
        parts = residuals[:, : self.n_directions], residuals[:, self.n_directions :]
        return np.asarray(sum((part**2).sum(1) / variance for part, variance in zip(parts, variances, strict=True)))


LINES = Kind(
    "lines", 6, 4, 2, 2, kernels.update_by_lines.bind(), kernels.line_equations, kernels.information_of_lines, LINE
)
POINTS = Kind(
    "points", 3, 3, 0, 3, kernels.update_by_points.bind(), kernels.point_equations, kernels.information_of_points, POINT
)
PLANES = Kind(
    "planes", 4, 3, 2, 3, kernels.update_by_planes.bind(), kernels.plane_equations, kernels.information_of_planes, PLANE
)


@dataclass(frozen=True, slots=True, eq=False)
class Observability:
    """What measured objects determine of a motor."""

    rank: int
    """The number of determined directions, of 6: 4 for a line, 5 for parallel lines, 6 for two other lines."""
    information: Reals
    """(6, 6) The inverse covariance of the error of the motor by the objects alone."""
    undetermined: Reals
    """(6 - rank, 6) Twists that the objects do not determine, as lines of `generated.pga3`."""


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

    Raises
    ------
    TypeError, ValueError
        If an argument has another type or shape, or objects are not finite.
    """
    at = unit_motor(motor)
    information = np.zeros((6, 6))
    for kind, objects in ((LINES, lines), (POINTS, points), (PLANES, planes)):
        if objects is not None:
            rows = finite(kind.rows(objects, kind.name).astype(float), kind.name)
            if rows.ndim != 2:
                raise ValueError(f"{kind.name}: shape {rows.shape}; expected (k, {rows.shape[-1]})")
            information += from_triangle(kind.information(at, rows, variances_of(sigma)), 6)
    return Observability(rank(information), information, undetermined(information))


def unit_motor(value: ArrayLike) -> Reals:
    """Return a motor (8,) without the rounding errors of its norm; `value` may be in error by a thousandth."""
    motor = finite(real_array(plain(value, "motor", MOTOR), "motor", (8,)).astype(float), "motor")
    if motor.ndim != 1:
        raise ValueError(f"motor: shape {motor.shape}; expected (8,), one motor")
    if abs(np.linalg.norm(motor[:4]) - 1) > 1e-3:
        raise ValueError(f"motor: norm {np.linalg.norm(motor[:4])}; expected a unit motor, see pga3.normalize_motor")
    return np.asarray(pga3.normalize_motor(motor))


def covariance_matrix(value: ArrayLike, name: str, n: int = 6) -> Reals:
    """Return a matrix (n, n) that is given as such, as its diagonal, or as one number for its diagonal."""
    array = finite(real_array(value, name).astype(float), name)
    if array.ndim < 2:
        array = np.diag(np.broadcast_to(array, (n,)))
    if array.shape != (n, n):
        raise ValueError(f"{name}: shape {array.shape}; expected ({n}, {n}), ({n},) or a number")
    return array


def variances_of(sigma: ArrayLike) -> Reals:
    """Return the squares of one or two standard deviations, twice that of one."""
    if type(sigma) is float and 0 < sigma < np.inf:
        return np.array((sigma * sigma, sigma * sigma))
    pair = finite(real_array(sigma, "sigma").astype(float), "sigma")
    if pair.size not in (1, 2) or (pair <= 0).any():
        raise ValueError(f"sigma: {pair.tolist()}; expected a positive number, or two")
    return np.array(np.broadcast_to(pair.ravel() ** 2, (2,)))
