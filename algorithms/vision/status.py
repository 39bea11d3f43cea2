"""What an estimate from image points may meet, by name."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from ..arguments import Reals


class VisionStatus(IntEnum):
    """Whether points determine what was asked for."""

    OK = 0
    TOO_FEW = 1
    """Fewer points, views or planes than unknowns need."""
    DEGENERATE = 2
    """Enough points, but in a place that leaves more than one answer: on a line or plane, or seen from one centre."""
    NOT_FINITE = 3
    """A coordinate is infinite or not a number."""
    NO_CONSENSUS = 4
    """No model agrees with more points than chance alone gives."""
    NOT_CONVERGED = 5
    """The iterations, or the samples, ended early, or in a place that contradicts the data: no answer to rely on."""


class DegenerateError(ValueError):
    """Points that do not determine an answer; `status` says why."""

    def __init__(self, message: str, status: VisionStatus) -> None:
        super().__init__(message)
        self.status = status


def check_points(arrays: dict[str, Reals], least: int, what: str) -> VisionStatus:
    """OK, TOO_FEW or NOT_FINITE for arrays (n, d) of the same points; ValueError where their shapes differ."""
    lengths = {name: array.shape for name, array in arrays.items()}
    for name, shape in lengths.items():
        if len(shape) != 2:
            raise ValueError(f"{name}: shape {shape}; expected (n, {shape[-1]}), one set of {what}")
    first, n = next((name, shape[0]) for name, shape in lengths.items())
    for name, shape in lengths.items():
        if shape[0] != n:
            raise ValueError(f"{name}: {shape[0]} {what}; expected {n}, as many as {first} has")
    if n < least:
        return VisionStatus.TOO_FEW
    return VisionStatus.OK if all(np.isfinite(array).all() for array in arrays.values()) else VisionStatus.NOT_FINITE


def distinct(places: Reals, least: int) -> int:
    """Return how many points differ; none beyond the least that are enough are counted."""
    found: set[bytes] = set()
    for place in places + 0.0:  # -0.0 is 0.0
        found.add(place.tobytes())
        if len(found) == least:
            break
    return len(found)


def refuse(status: VisionStatus, where: str, expected: str) -> None:
    """Raise `DegenerateError` unless the status is OK."""
    if status != VisionStatus.OK:
        raise DegenerateError(f"{where}: {status.name.lower().replace('_', ' ')}; expected {expected}", status)
