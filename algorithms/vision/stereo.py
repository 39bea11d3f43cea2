"""Rectified stereo pairs: disparity and depth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import pga3

from ..arguments import Reals, real_array
from .camera import Camera

_NO_ROTATION = np.array([1.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True, slots=True)
class RectifiedPair:
    """Two equal cameras side by side with aligned rows. The frame of the left one, the first, is the world frame.

    A point at depth Z is at pixel (x, y) of the left image and at (x - d, y) of the right image, with the disparity
    ``d = focal_length * baseline / Z - offset``.

    Attributes
    ----------
    focal_length : float
        In pixels.
    centre : (float, float)
        Principal point of the left camera, in pixels.
    offset : float
        The x coordinate of the right camera's principal point minus that of the left, in pixels.
    baseline : float
        Distance of the centres; its unit is the unit of depth.
    """

    focal_length: float
    centre: tuple[float, float]
    offset: float
    baseline: float

    def cameras(self) -> tuple[Camera, Camera]:
        """Return the left and the right camera."""
        x, y = self.centre
        aside = pga3.motor_from_rotor_translation(_NO_ROTATION, np.array([self.baseline, 0.0, 0.0]))
        return (
            Camera.from_intrinsics(self.focal_length, (x, y)),
            Camera.from_intrinsics(self.focal_length, (x + self.offset, y), aside),
        )

    def valid(self, disparity: ArrayLike) -> NDArray[np.bool_]:
        """Return where a disparity is finite and belongs to a point in front of the cameras.

        Parameters
        ----------
        disparity : array_like, (...)
            In pixels.

        Returns
        -------
        array of bool, (...)
        """
        array = real_array(disparity, "disparity")
        return np.asarray(np.isfinite(array) & (array + self.offset > 0))

    def depth(self, disparity: ArrayLike) -> Reals:
        """Return the depths of disparities.

        Parameters
        ----------
        disparity : array_like, (...)
            In pixels; infinite or NaN where unknown.

        Returns
        -------
        array, (...)
            ``focal_length * baseline / (disparity + offset)`` in the unit of the baseline; NaN where `disparity` is not
            `valid`.
        """
        array = real_array(disparity, "disparity")
        known = self.valid(array)
        depth = np.full(array.shape, np.nan, array.dtype)
        np.divide(self.focal_length * self.baseline, array + self.offset, out=depth, where=known)
        return depth

    def correspondences(self, disparity: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the pixels of the left image with valid disparity, and their partners in the right image.

        Parameters
        ----------
        disparity : array_like, (M, N)
            Disparity of every pixel of the left image.

        Returns
        -------
        pixels, partners : array, (n, 2)
            (x, y), in row-major order of the image.

        Raises
        ------
        TypeError, ValueError
            If `disparity` is not an image.
        """
        array = real_array(disparity, "disparity", (-1, -1), "one image")
        if array.ndim != 2:
            raise ValueError(f"disparity: shape {array.shape}; expected (M, N), one image")
        rows, columns = np.nonzero(self.valid(array))
        pixels = np.stack([columns, rows], -1).astype(np.float64)
        partners = pixels.copy()
        partners[:, 0] -= array[rows, columns]
        return pixels, partners
