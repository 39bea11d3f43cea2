"""The result of localization, which poses of cameras and of rigs share."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..arguments import Reals
from .status import VisionStatus


@dataclass(frozen=True, slots=True, eq=False)
class Localization:
    """Result of `localize`: the pose of a camera, and how well points determine it."""

    pose: Reals
    """(8,) The unit motor from the camera frame to the world frame; NaN if the status is not OK."""
    status: VisionStatus
    residual: float
    """The root mean square distance of pixels over the inliers, in pixels."""
    inliers: Reals
    """(n,) bool"""
    poses: Reals
    """(m, 8) All poses that the data cannot separate, the most likely one first: one if the status is OK, two or more
    if it is AMBIGUOUS, otherwise none."""
    deviation: Reals
    """(2,) Standard deviations of the rotation, in radians, and of the centre of the camera, each in its least certain
    direction, for the most likely pose; infinite without one."""
    line_inliers: Reals = field(default_factory=lambda: np.zeros(0, bool))
    """(m,) bool, for the lines."""


def no_localization(status: VisionStatus, n_points: int, n_lines: int = 0) -> Localization:
    """Return a result without a pose."""
    return Localization(
        np.full(8, np.nan),
        status,
        np.nan,
        np.zeros(n_points, bool),
        np.empty((0, 8)),
        np.full(2, np.inf),
        np.zeros(n_lines, bool),
    )
