"""Arguments and results of bundle adjustment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arguments import Reals
from .camera import Camera
from .status import VisionStatus


@dataclass(frozen=True, slots=True, eq=False)
class Observations:
    """Where cameras see points: a row for each pair of a camera and a point."""

    camera: Reals
    """(k,) int. The number of the camera."""
    point: Reals
    """(k,) int. The number of the point."""
    pixels: Reals
    """(k, 2) x, y."""


@dataclass(frozen=True, slots=True, eq=False)
class BundleAdjustment:
    """Result of `bundle_adjust`."""

    cameras: tuple[Camera, ...]
    """The adjusted cameras; those whose status is TOO_FEW, DISCONNECTED or NOT_FINITE are as they were."""
    points: Reals
    """(m, 3) The adjusted points; those whose status is TOO_FEW, DISCONNECTED or NOT_FINITE are as they were."""
    distortion: Reals
    """(c, n) The coefficients of the distortion of each camera; (c, 0) without distortion."""
    status: VisionStatus
    """OK if the minimum was reached, agrees with the noise, and determines all cameras; otherwise why not."""
    camera_status: Reals
    """(c,) int, a `VisionStatus` each. TOO_FEW: the camera sees too few points that others see. DISCONNECTED: no chain
    of points leads to what is fixed. DEGENERATE: noise may explain a turn by a radian, a shift by the distance of its
    points and of fixed cameras, as with parts of unknown scale, or a focal length of 0. BEHIND: half of its
    points are behind the camera. NO_CONSENSUS: with a robust loss, half of its pixels are far from their points."""
    point_status: Reals
    """(m,) int, a `VisionStatus` each. TOO_FEW: less than two cameras see the point. DISCONNECTED: as for cameras.
    DEGENERATE: noise may move it by the distance of the nearest camera. BEHIND: it is behind a camera that sees it.
    NO_CONSENSUS: with a robust loss, half of its pixels or more are far from it."""
    cost: float
    """Half the sum of the losses of squared distances, in square pixels, over the observations that were used."""
    residuals: Reals
    """(k,) The distance of each pixel from the image of its point, in pixels."""
    weights: Reals
    """(k,) The influence of each observation: 1 for squares, less for far ones with a robust loss, 0 if not used."""
    steps: int
    """The number of steps."""
    lines: Reals
    """(l, 2, 3) Two points of each adjusted line, next to those of the start; others are as they were."""
    line_status: Reals
    """(l,) int, a `VisionStatus` each, as for points. TOO_FEW: less than three cameras see the line."""
    line_residuals: Reals
    """(kl,) The root of the sum of the squared distances of both pixels of each line from its image."""
    line_weights: Reals
    """(kl,) The influence of each of these."""
    camera_covariance: Reals
    """(c, 6, 6) Of rotation vector and translation in the frame of each camera; 0 if fixed, NaN if not known."""
    lens_covariance: Reals
    """(lenses, p, p) Of the estimated numbers of each lens; NaN if not known."""
    point_covariance: Reals
    """(m, 3, 3) If requested; 0 for fixed points, otherwise NaN."""
    line_covariance: Reals
    """(l, 6, 6) Of both points of each line, which move across it, if requested; otherwise NaN."""

    @property
    def poses(self) -> Reals:
        """The motors (c, 8) from the frames of cameras to that of the world."""
        return np.array([camera.pose for camera in self.cameras]).reshape(-1, 8)
