"""A motor from a recording of one measured line at a time, in one call of a kernel."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from generated import motor_filters as kernels

from ..arguments import Reals, finite, real_array
from ..evidence.gates import checked_gate
from ..evidence.triangles import from_triangle, to_triangle
from .matrices import as_definite
from .motor_objects import covariance_matrix, unit_motor, variances_of


def filter_lines(
    motor: ArrayLike,
    covariance: ArrayLike,
    model: ArrayLike,
    measured: ArrayLike,
    sigma: ArrayLike,
    *,
    noise: ArrayLike = 0.0,
    dt: ArrayLike = 1.0,
    gate: float = np.inf,
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
    times = finite(real_array(dt, "dt"), "dt")
    if times.shape not in ((), (1,), one.shape[-2:-1]):
        raise ValueError(f"dt: shape {times.shape}; expected a number, or one for each of {one.shape[-2]} lines")
    steps = np.broadcast_to(np.maximum(times.astype(float), 0), (one.shape[-2],))
    growth = steps[:, None] * to_triangle(as_definite(covariance_matrix(noise, "noise"))[0])
    spread = to_triangle(as_definite(covariance_matrix(covariance, "covariance"))[0])
    motors, triangles, numbers = kernels.filter_lines(
        unit_motor(motor), spread, one, two, growth, variances_of(sigma), checked_gate(gate)
    )
    return motors, from_triangle(triangles, 6), numbers
