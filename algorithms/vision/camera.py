"""The pinhole camera: intrinsic parameters, and its pose as a motor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import pga3, projective3

from ..arguments import Reals, finite_number, real_array


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """A pinhole camera that looks along its z axis, x to the right and y down in the image.

    Attributes
    ----------
    intrinsics : array, (3, 3)
        The upper triangular matrix K from directions in the camera frame to pixels, ``K[2, 2] = 1``.
    pose : array, (8,)
        The unit motor from the camera frame to the world frame, in the order of `generated.pga3`.
    """

    intrinsics: NDArray[np.float64]
    pose: NDArray[np.float64]

    @classmethod
    def from_intrinsics(
        cls,
        focal_length: float | tuple[float, float],
        centre: tuple[float, float],
        pose: ArrayLike | None = None,
        skew: float = 0.0,
    ) -> Camera:
        """Return a camera with given calibration parameters.

        Parameters
        ----------
        focal_length : float or (float, float)
            In pixels; a pair if pixels are not square. It must not be 0.
        centre : (float, float)
            Principal point (x, y) in pixels.
        pose : array_like, (8,), optional
            Unit motor from the camera frame to the world frame; the default is the identity.
        skew : float, optional
            Entry (0, 1) of K.

        Raises
        ------
        TypeError, ValueError
            If a number is not finite, if the focal length is 0, or if the pose is not a unit motor.
        """
        lengths = focal_length if isinstance(focal_length, tuple) else (focal_length, focal_length)
        fx, fy = _pair(lengths, "focal_length")
        if fx == 0 or fy == 0:
            raise ValueError("focal_length: 0; expected another number of pixels")
        cx, cy = _pair(centre, "centre")
        motor = _unit_motor(np.eye(8)[0] if pose is None else pose)
        return cls(np.array([[fx, finite_number(skew, "skew"), cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]), motor)

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The matrix ``K [R | t]``, (3, 4), from homogeneous world points to homogeneous pixels."""
        to_camera = pga3.motor_to_matrix(pga3.motor_inverse(self.pose))
        return np.asarray(self.intrinsics @ to_camera[:3])

    def project(self, points: ArrayLike) -> Reals:
        """Project points to pixels.

        Parameters
        ----------
        points : array_like, (..., 3)
            World coordinates, in the unit of length of the pose.

        Returns
        -------
        array, (..., 2)
            Pixels (x, y). Points behind the camera are projected too (see `depth`); points in the plane of its centre
            have infinite or NaN coordinates.

        Raises
        ------
        TypeError, ValueError
            If `points` is not an array of points.
        """
        array = real_array(points, "points", (3,), "x y z")
        return projective3.project_point(self.matrix.astype(array.dtype), array)

    def depth(self, points: ArrayLike) -> Reals:
        """Return the depths of points: their z coordinates in the camera frame.

        Parameters
        ----------
        points : array_like, (..., 3)

        Returns
        -------
        array, (...)
            Negative behind the camera.

        Raises
        ------
        TypeError, ValueError
            If `points` is not an array of points.
        """
        array = real_array(points, "points", (3,), "x y z")
        in_camera: Reals = pga3.move_point_back(self.pose.astype(array.dtype), array)
        return np.asarray(in_camera[..., 2])


def camera_matrix(camera: Camera | ArrayLike, name: str) -> Reals:
    """Return the matrix of a camera, or validated matrices (..., 3, 4)."""
    return camera.matrix if isinstance(camera, Camera) else real_array(camera, name, (3, 4), "a camera or its matrix")


def _unit_motor(pose: ArrayLike) -> NDArray[np.float64]:
    motor = np.array(real_array(pose, "pose", (8,), "one unit motor"), np.float64)
    if motor.ndim != 1:
        raise ValueError(f"pose: shape {motor.shape}; expected (8), one unit motor")
    if not np.abs(motor - pga3.normalize_motor(motor)).max() < 1e-6:
        raise ValueError("pose: not a unit motor; expected m ~m = 1; use pga3.normalize_motor(pose)")
    motor.flags.writeable = False
    return motor


def _pair(values: tuple[float, ...], name: str) -> tuple[float, float]:
    if len(values) != 2:
        raise ValueError(f"{name}: {len(values)} numbers; expected 2")
    return finite_number(values[0], name), finite_number(values[1], name)
