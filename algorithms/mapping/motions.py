"""Motions between poses."""

from __future__ import annotations

from typing import Any

import numpy as np

from generated import pga2

from ..arguments import Reals


def relative(a: Reals, b: Reals) -> Reals:
    """Return the motors of poses b in the frames of poses a."""
    return np.asarray(pga2.motor_product(pga2.motor_inverse(a), b))


def length_and_angle(motors: Reals) -> tuple[Any, Any]:
    """Return how far motors (..., 4) move the origin, and the absolute values of their angles."""
    angle, shift = pga2.motor_to_angle_translation(motors)
    return np.hypot(shift[..., 0], shift[..., 1]), np.abs(angle)
