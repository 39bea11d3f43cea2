"""Recordings of inertial sensors with their true orientation, and errors as they are defined for BROAD."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from algorithms.arguments import Reals

FOLDER = Path(__file__).parents[1] / "data" / "estimation"
ROTATION, COMBINED = "broad_06_fast_rotation", "broad_21_fast_combined"


@dataclass(frozen=True, slots=True)
class Recording:
    """Samples (n, 3) of an inertial sensor, and its true orientation at every fourth of them."""

    rate: float
    rates: Reals
    accelerations: Reals
    fields: Reals
    moving: Reals
    truth: Reals

    @classmethod
    def of(cls, name: str) -> Recording:
        with np.load(FOLDER / f"{name}.npz") as file:
            return cls(float(file["rate"]), *(file[k].astype(float) for k in ("rates", "accelerations", "fields")),
                       file["moving"], file["truth"].astype(float))  # fmt: skip


def product(a: Reals, b: Reals) -> Reals:
    """Return products of quaternions w, x, y, z."""
    s, t, u, v = a[..., :1], b[..., :1], a[..., 1:], b[..., 1:]
    return np.concatenate([s * t - (u * v).sum(-1, keepdims=True), s * v + t * u + np.cross(u, v)], -1)


def errors(rotors: Reals, recording: Recording, *, every: int = 4) -> tuple[float, float]:
    """Return the root mean square of total and inclination errors in degrees, while the sensor moves.

    The mean difference of headings is removed. `rotors` are those of `generated.vga3`, for all samples.
    """
    found = np.stack([rotors[:, 0], -rotors[:, 3], rotors[:, 2], -rotors[:, 1]], -1)[every - 1 :: every]
    use = recording.moving[every - 1 :: every] & np.isfinite(recording.truth).all(1)
    difference = product(found[use], recording.truth[use] * [1, -1, -1, -1])
    heading = 2 * np.arctan2(difference[:, 3], difference[:, 0])
    mean = np.angle(np.mean(np.exp(1j * heading)))
    inclination = 2 * np.arccos(np.clip(np.hypot(difference[:, 0], difference[:, 3]), 0, 1))
    # cos(total / 2) = cos(inclination / 2) cos(heading / 2)
    total = 2 * np.arccos(np.clip(np.abs(np.cos(inclination / 2) * np.cos((heading - mean) / 2)), 0, 1))
    total_error, tilt = (float(np.degrees(np.sqrt(np.mean(x**2)))) for x in (total, inclination))
    return total_error, tilt
