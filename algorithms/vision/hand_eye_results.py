"""Results of hand-eye calibration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arguments import Reals
from ..evidence import Status


class HandEyeStatus(Status):
    """Whether motions determine the pose of the camera on the hand."""

    OK = 0
    TOO_FEW = 1
    """There are fewer than two motions, or fewer than three poses."""
    PARALLEL_AXES = 2
    """The axes of all motions are parallel: the camera can be translated along them."""
    AMBIGUOUS_SIGNS = 3
    """Fewer than two motions are not half turns: ``A X = X B`` and ``A X = -X B`` cannot be distinguished."""
    NOT_FINITE = 4
    """A coefficient of a motion, or of all poses but two, is infinite or not a number."""
    SMALL_ANGLES = 5
    """No motion rotates by more than its noise, or by more than 1e-7 radians (1e-5 in single precision), which is
    decided before anything is solved: translations do not determine the translation of X."""
    INCONSISTENT = 6
    """The motions of hand and camera contradict each other: no solution agrees with more than half of them, or
    chance explains those that agree, or the residual exceeds 0.3 radians or 0.3 times the translations: frames, their
    order or units may be mixed up. Or most of the residuals of poses is common to successive ones: the camera or its
    target has moved."""


@dataclass(frozen=True, slots=True, eq=False)
class HandEye:
    """Result of `hand_eye`: the pose of a camera on a hand, and how well motions determine it."""

    motor: Reals
    """(..., 8) X, with nonnegative scalar part; NaN if the status is TOO_FEW or NOT_FINITE."""
    status: Reals
    """(...) int, a `HandEyeStatus` each. If axes are parallel or angles small, the motor is one of the solutions."""
    singular_values: Reals
    """(..., 8) Singular values of the linear equations of motions that are not half turns, descending. The last two are
    due to noise; the sixth measures how far from parallel the axes are. Values below 1e-8 of the first are rounding."""
    residual: Reals
    """(..., 2) Root mean squares over the inliers of the residual ``~(X B) A X``: of its rotation, as
    ``2 sin(angle / 2)``, and of its translation, in the unit of length, at the end of the motions where it is less."""
    inliers: Reals
    """(..., n) bool. False for motions, or poses, that contradict most others and were left out."""

    @property
    def rotation_residual(self) -> Reals:
        """(...) The first component of `residual`, in radians if small."""
        return np.asarray(self.residual[..., 0])

    @property
    def translation_residual(self) -> Reals:
        """(...) The second component of `residual`."""
        return np.asarray(self.residual[..., 1])


@dataclass(frozen=True, slots=True, eq=False)
class HandEyeOfPoses(HandEye):
    """Result of `hand_eye_from_poses`: the pose of a camera on a hand, and that of its target."""

    world: Reals
    """(..., 8) Z, the motor from the frame of the target to the base; NaN like `motor`."""
    residual: Reals
    """(..., 2) Root mean squares over the inliers of the residual ``~(Z B) A X``: of its rotation, as
    ``2 sin(angle / 2)``, and of the displacement of the camera's origin, in the unit of length."""
    deviation: Reals
    """(..., 2) Standard deviations of the rotation of X, in radians, and of its translation, each in its least certain
    direction, from the residuals of the inliers; infinite where these do not determine it. Few poses, and what
    successive residuals have in common, make them larger, so that errors exceed 4.03 of them with a probability of a
    thousandth. Small rotations give large deviations of the translation."""
