"""Recordings of poses in `tests/data/estimation`."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from generated import pga3

Array = np.ndarray[Any, Any]
FOLDER = Path(__file__).parents[1] / "data" / "estimation"


class Arm(NamedTuple):
    """Poses of the hand of an arm in its base, and of the camera on it in the frame of its target."""

    hand_times: Array
    hand: Array
    camera_times: Array
    camera: Array


def arm(name: str) -> Arm:
    """The recording robot_arm_real or robot_arm_sim, with poses as motors."""
    with np.load(FOLDER / f"{name}.npz") as stored:
        motors = []
        for key in ("hand", "camera"):
            rows = stored[key].astype(np.float64)
            turns = rows[:, [6, 3, 4, 5]]
            turns /= np.linalg.norm(turns, axis=1, keepdims=True)
            motors.append(pga3.motor_from_quaternion_translation(turns, rows[:, :3]))
        return Arm(stored["hand_times"], motors[0], stored["camera_times"], motors[1])
