"""Statuses of estimates from image points, and validation of points."""

from __future__ import annotations

from math import isfinite

import numpy as np

from ..arguments import Reals
from ..evidence import Status


class VisionStatus(Status):
    """Whether points determine the result."""

    OK = 0
    TOO_FEW = 1
    """There are fewer points, views or planes than the unknowns require."""
    DEGENERATE = 2
    """There are enough points, but the result is not unique: they are on a line or plane, or seen from one centre."""
    NOT_FINITE = 3
    """A coordinate is infinite or not a number."""
    NO_CONSENSUS = 4
    """No model agrees with more points than expected by chance."""
    NOT_CONVERGED = 5
    """The iterations or samples ended early, or at a result that contradicts the data, which is not reliable."""
    AMBIGUOUS = 6
    """Several results agree with the data, which cannot separate them."""
    BEHIND = 7
    """A point is behind a camera that sees it."""
    DISCONNECTED = 8
    """Nothing connects it with what is held fixed: its pose relative to that is arbitrary."""


class DegenerateError(ValueError):
    """Points do not determine the result; `status` is the reason."""

    def __init__(self, message: str, status: VisionStatus) -> None:
        super().__init__(message)
        self.status = status


def check_points(arrays: dict[str, Reals], least: int, what: str) -> VisionStatus:
    """Return OK, TOO_FEW or NOT_FINITE for arrays (n, d) of the same points; ValueError if shapes differ."""
    (first, one), *_ = arrays.items()
    n = len(one) if one.ndim else 0
    for name, array in arrays.items():
        if array.ndim != 2:
            raise ValueError(f"{name}: shape {array.shape}; expected (n, {array.shape[-1]}), one set of {what}")
        if len(array) != n:
            raise ValueError(f"{name}: {len(array)} {what}; expected {n}, as many as {first} has")
    if n < least:
        return VisionStatus.TOO_FEW
    for array in arrays.values():
        # A finite sum of squares, which takes a third of the time, has finite terms.
        if not isfinite(np.vdot(array, array)) and not np.isfinite(array).all():
            return VisionStatus.NOT_FINITE
    return VisionStatus.OK


def one_set(array: Reals) -> Reals:
    """Return points (n, d), also from (n, 1, d), the shape of OpenCV's."""
    return array[:, 0] if array.ndim == 3 and array.shape[1] == 1 else array


def distinct(places: Reals, least: int) -> int:
    """Return the number of distinct points, counted up to `least`."""
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
