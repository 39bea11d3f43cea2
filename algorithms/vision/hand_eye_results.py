"""What hand-eye calibration finds, and whether motions determine it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from ..arguments import Reals


class HandEyeStatus(IntEnum):
    """Whether motions determine the place of the camera."""

    OK = 0
    TOO_FEW = 1
    """Fewer than two motions, or three poses."""
    PARALLEL_AXES = 2
    """The axes of all motions are parallel: the camera may be moved along them."""
    AMBIGUOUS_SIGNS = 3
    """Fewer than two motions that are not half turns: ``A X = X B`` and ``A X = -X B`` cannot be told apart."""
    NOT_FINITE = 4
    """A coefficient is infinite or not a number."""
    SMALL_ANGLES = 5
    """No motion turns by more than its noise, or by more than 1e-7 radians (1e-5 in single precision), which is decided
    before anything is solved: translations leave the place of the camera open."""
    INCONSISTENT = 6
    """The motions of hand and camera contradict each other: no place agrees with more than half of them, or what
    remains is above 0.3 radians or 0.3 of what motions translate by. Frames, their order or units may be mixed up."""


@dataclass(frozen=True, slots=True, eq=False)
class HandEye:
    """The place of a camera on a hand, and how well motions determine it."""

    motor: Reals
    """(..., 8) X, with scalar part not negative; NaN where the status is TOO_FEW or NOT_FINITE."""
    status: Reals
    """(...) int, a `HandEyeStatus` each. The motor is one of the solutions where axes are parallel or angles small."""
    singular_values: Reals
    """(..., 8) Of the linear equations of motions that are not half turns, descending. The last two are what noise
    leaves; the sixth says how far from parallel the axes are. Values below 1e-8 of the first are rounding."""
    residual: Reals
    """(..., 2) Root mean squares over the inliers of what remains of ``~(X B) A X``: of its rotation, as
    ``2 sin(angle / 2)``, and of its translation, in the unit of length, at that end of the motions where it is less."""
    inliers: Reals
    """(..., n) bool. False for motions, or poses, that contradict most others and were left out."""

    @property
    def rotation_residual(self) -> Reals:
        """(...) The first of `residual`, in radians where it is small."""
        return np.asarray(self.residual[..., 0])

    @property
    def translation_residual(self) -> Reals:
        """(...) The second of `residual`."""
        return np.asarray(self.residual[..., 1])


@dataclass(frozen=True, slots=True, eq=False)
class HandEyeOfPoses(HandEye):
    """The place of a camera on a hand, and that of what it looks at."""

    world: Reals
    """(..., 8) Z, the motor from the frame of what is looked at to the base; NaN as `motor`."""
    residual: Reals
    """(..., 2) Root mean squares over the inliers of what remains of ``~(Z B) A X``: of its rotation, as
    ``2 sin(angle / 2)``, and of how far it moves the origin of the camera, in the unit of length."""
