"""Rows of the page of evidence, and functions that their scenes share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from generated import pga3

BOUND = 4.03
"""Standard deviations that the largest of three errors exceeds with a probability of a thousandth."""


class Trial(NamedTuple):
    """What an estimator said of one scene."""

    ok: bool
    """Whether the status is OK."""
    right: bool
    """Whether the result is right."""


@dataclass(frozen=True, slots=True)
class Row:
    """A generator of scenes for an estimator."""

    estimator: str
    scene: str
    good: bool
    """Whether the data are good: they should not be refused."""
    slow: bool
    """Whether a trial takes more than a twentieth of a second."""
    trial: Callable[[np.random.Generator], Trial]

    @property
    def name(self) -> str:
        """The name of the function."""
        return self.trial.__name__


ROWS: list[Row] = []


def row(
    estimator: str, scene: str, *, good: bool = False, slow: bool = False
) -> Callable[..., Callable[[np.random.Generator], Trial]]:
    """Register a function as a row of the page."""

    if any((estimator, scene) == (each.estimator, each.scene) for each in ROWS):
        raise ValueError(f"{estimator}: {scene!r} is there; expected another scene")

    def registered(trial: Callable[[np.random.Generator], Trial]) -> Callable[[np.random.Generator], Trial]:
        ROWS.append(Row(estimator, scene, good, slow, trial))
        return trial

    return registered


def is_within(found: np.ndarray, true: np.ndarray, deviation: np.ndarray, bound: float = BOUND) -> bool:
    """Return whether rotation and translation of a motor are within a multiple of their deviations (2,)."""
    off = pga3.motor_relative(true, found)
    turn, shift = pga3.rotor_to_rotation_vector(off[:4]), pga3.move_point(off, np.zeros(3))
    return bool((np.linalg.norm([turn, shift], axis=1) <= bound * deviation).all())


def rotation(rng: np.random.Generator, most: float) -> np.ndarray:
    """A rotation about a random axis by a random angle up to `most`, which is about z too if it is less than pi."""
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    angle = rng.uniform(0, most)
    cross = np.cross(np.eye(3), axis)
    turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    roll = rng.uniform(0, 2 * np.pi)
    about = np.array([[np.cos(roll), -np.sin(roll), 0], [np.sin(roll), np.cos(roll), 0], [0, 0, 1]])
    return np.asarray(turn @ about)
