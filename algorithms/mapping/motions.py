"""Motions between poses."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generated import pga2

from ..arguments import Reals, finite, real_array


def relative(a: Reals, b: Reals) -> Reals:
    """Return the motors of poses b in the frames of poses a."""
    return np.asarray(pga2.motor_product(pga2.motor_inverse(a), b))


def length_and_angle(motors: Reals) -> tuple[Any, Any]:
    """Return how far motors (..., 4) move the origin, and the absolute values of their angles."""
    angle, shift = pga2.motor_to_angle_translation(motors)
    return np.hypot(shift[..., 0], shift[..., 1]), np.abs(angle)


def are_near(a: Reals, b: Reals, length: Any, angle: Any) -> Any:
    """Return whether poses (..., 4) are at most a length and an angle apart; False where one is not finite."""
    moved, turned = length_and_angle(relative(a, b))
    return (moved <= length) & (turned <= angle)


def unit_motor(value: ArrayLike, name: str) -> Reals:
    """Return a motor (4,) of norm 1; raise TypeError or ValueError if the value is not one up to rounding."""
    motor = finite(real_array(value, name, (4,), "a motor").astype(float), name)
    if motor.shape != (4,) or not 0.5 < motor[0] ** 2 + motor[1] ** 2 < 2:
        raise ValueError(f"{name}: {motor.tolist()}; expected a unit motor (4,), see pga2.normalize_motor")
    return np.asarray(pga2.normalize_motor(motor))
