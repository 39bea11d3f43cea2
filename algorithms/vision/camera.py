"""Cameras: intrinsic parameters, the pose as a motor, and the distortion of the lens."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import lenses, pga3, projective2, projective3

from ..arguments import Reals, finite_number, real_array
from ..precision import SINGLE
from .distortion import Distortion


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """A camera that looks along its z axis, x to the right and y down in the image.

    Attributes
    ----------
    intrinsics : array, (3, 3)
        The upper triangular matrix K from directions in the camera frame to pixels, ``K[2, 2] = 1``.
    pose : array, (8,)
        The unit motor from the camera frame to the world frame, in the order of `generated.pga3`.
    distortion : Distortion, optional
        The distortion of the lens; None for a pinhole camera.
    """

    intrinsics: NDArray[np.float64]
    pose: NDArray[np.float64]
    distortion: Distortion | None = None

    @classmethod
    def from_intrinsics(
        cls,
        focal_length: float | tuple[float, float],
        centre: tuple[float, float],
        pose: ArrayLike | None = None,
        skew: float = 0.0,
        distortion: Distortion | None = None,
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
        distortion : Distortion, optional
            The distortion of the lens; none by default.

        Raises
        ------
        TypeError, ValueError
            If a number is not finite, if the focal length is 0, if the pose is not a unit motor, or if `distortion` is
            not a `Distortion`.
        """
        if distortion is not None and not isinstance(distortion, Distortion):
            raise TypeError(f"distortion: {type(distortion).__name__}; expected a Distortion, or None")
        lengths = focal_length if isinstance(focal_length, tuple) else (focal_length, focal_length)
        fx, fy = _pair(lengths, "focal_length")
        if fx == 0 or fy == 0:
            raise ValueError("focal_length: 0; expected another number of pixels")
        cx, cy = _pair(centre, "centre")
        motor = _unit_motor(np.eye(8)[0] if pose is None else pose)
        return cls(matrix_of((fx, fy, cx, cy, finite_number(skew, "skew"))), motor, distortion)

    @property
    def pinhole(self) -> Camera:
        """The camera without distortion; its pixels are those of `undistort`."""
        return self if self.distortion is None else replace(self, distortion=None)

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The matrix ``K [R | t]``, (3, 4), from homogeneous world points to homogeneous pixels of `pinhole`."""
        to_camera = pga3.motor_to_matrix(pga3.motor_inverse(self.pose))
        return np.asarray(self.intrinsics @ to_camera[:3])

    @property
    def centre(self) -> NDArray[np.float64]:
        """The centre of the camera in the world, (3,), from which all lines of sight start."""
        return np.asarray(pga3.move_point(self.pose, np.zeros(3)))

    def project(self, points: ArrayLike) -> Reals:
        """Project points to pixels.

        Parameters
        ----------
        points : array_like, (..., 3)
            World coordinates, in the unit of length of the pose.

        Returns
        -------
        array, (..., 2)
            Pixels (x, y). Without distortion, points behind the camera are projected too (see `depth`), and points in
            the plane of its centre have infinite or NaN coordinates. With distortion, both are NaN unless a fisheye
            lens shows them, and so are points beyond the range of the lens (`Distortion.limit`).

        Raises
        ------
        TypeError, ValueError
            If `points` is not an array of points.
        """
        array = real_array(points, "points", (3,), "x y z")
        if self.distortion is None:
            return projective3.project_point(self.matrix.astype(array.dtype), array)
        exact = np.asarray(array, np.float64)
        lens, to_camera = self.distortion, pga3.motor_to_matrix(pga3.motor_inverse(self.pose))[:3]
        project = lenses.project_brown if lens.model == "brown" else lenses.project_fisheye
        with np.errstate(all="ignore"):
            pixels, is_valid = project(to_camera, intrinsics_of(self.intrinsics), lens.array, lens.limit, exact)
        return np.where(np.asarray(is_valid)[..., None] > 0, pixels, np.nan).astype(array.dtype)

    def distort(self, pixels: ArrayLike) -> Reals:
        """Return where the lens shows the pixels of a pinhole camera.

        Parameters
        ----------
        pixels : array_like, (..., 2)
            As of `pinhole`.

        Returns
        -------
        array, (..., 2)
            Pixels of this camera; NaN beyond the range of the lens. Without distortion, the same pixels.

        Raises
        ------
        TypeError, ValueError
            If `pixels` is not an array of pixels.
        """
        array = real_array(pixels, "pixels", (2,), "x y in pixels")
        if self.distortion is None:
            return array
        places = projective2.transform_point(np.linalg.inv(self.intrinsics), np.asarray(array, np.float64))
        seen = self.distortion.distort(np.concatenate([places, np.ones((*places.shape[:-1], 1))], -1))
        return np.asarray(projective2.transform_point(self.intrinsics, seen), array.dtype)

    def undistort(self, pixels: ArrayLike) -> Reals:
        """Return the pixels of a pinhole camera that the lens shows at pixels: the inverse of `distort`.

        Parameters
        ----------
        pixels : array_like, (..., 2)

        Returns
        -------
        array, (..., 2)
            Pixels of `pinhole`; NaN where the lens shows none, and for directions of a fisheye lens at a right angle
            from the axis or more, which `directions` returns. Without distortion, the same pixels.

        Raises
        ------
        TypeError, ValueError
            If `pixels` is not an array of pixels.
        """
        array = real_array(pixels, "pixels", (2,), "x y in pixels")
        if self.distortion is None:
            return array
        sights = self._sights(np.asarray(array, np.float64))
        with np.errstate(all="ignore"):
            places = np.where(sights[..., 2:] > 0, sights[..., :2] / sights[..., 2:], np.nan)
        return np.asarray(projective2.transform_point(self.intrinsics, places), array.dtype)

    def directions(self, pixels: ArrayLike) -> Reals:
        """Return the directions of pixels in the camera frame.

        Parameters
        ----------
        pixels : array_like, (..., 2)

        Returns
        -------
        array, (..., 3)
            Of norm 1; NaN where the lens shows none.

        Raises
        ------
        TypeError, ValueError
            If `pixels` is not an array of pixels.
        """
        array = real_array(pixels, "pixels", (2,), "x y in pixels")
        sights = self._sights(np.asarray(array, np.float64))
        return np.asarray(sights / np.linalg.norm(sights, axis=-1, keepdims=True), array.dtype)

    def rays(self, pixels: ArrayLike) -> NDArray[np.float64]:
        """Return the directions of lines of sight in the world.

        Parameters
        ----------
        pixels : array_like, (..., 2)

        Returns
        -------
        array, (..., 3)
            As `directions`, in the world frame.

        Raises
        ------
        TypeError, ValueError
            If `pixels` is not an array of pixels.
        """
        return np.asarray(pga3.move_direction(self.pose, np.asarray(self.directions(pixels), np.float64)))

    def _sights(self, pixels: Reals) -> Reals:
        places = projective2.transform_point(np.linalg.inv(self.intrinsics), pixels)
        if self.distortion is None:
            return np.concatenate([places, np.ones((*places.shape[:-1], 1))], -1)
        return self.distortion.undistort(places)

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
    """Return the matrix of a camera without distortion, or validated matrices (..., 3, 4)."""
    if not isinstance(camera, Camera):
        return real_array(camera, name, (3, 4), "a camera or its matrix")
    if camera.distortion is not None:
        raise ValueError(
            f"{name}: a camera with distortion, which no matrix describes; expected one without; pass camera.pinhole, "
            "which goes with camera.undistort(pixels)"
        )
    return camera.matrix


def pinhole_pixels(
    camera: Camera | ArrayLike, pixels: ArrayLike, name: str, shape: tuple[int, ...] = (2,)
) -> tuple[ArrayLike, Reals]:
    """Return the matrix K of a camera, or what is given in its place, and the pixels of the pinhole camera."""
    if not isinstance(camera, Camera):
        return camera, real_array(pixels, name, shape, "x y in pixels")
    return camera.intrinsics, camera.undistort(real_array(pixels, name, shape, "x y in pixels"))


def intrinsics_of(matrices: Reals) -> NDArray[np.float64]:
    """Return ``fx fy cx cy skew`` of matrices K (..., 3, 3)."""
    return np.asarray(matrices[..., [0, 1, 0, 1, 0], [0, 1, 2, 2, 1]], np.float64)


def matrix_of(intrinsics: Iterable[float]) -> NDArray[np.float64]:
    """Return the matrix K of ``fx fy cx cy skew``."""
    fx, fy, cx, cy, skew = intrinsics
    return np.array([[fx, skew, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def _unit_motor(pose: ArrayLike) -> NDArray[np.float64]:
    motor = np.array(real_array(pose, "pose", (8,), "one unit motor"), np.float64)
    if motor.ndim != 1:
        raise ValueError(f"pose: shape {motor.shape}; expected (8), one unit motor")
    if not np.abs(motor - pga3.normalize_motor(motor)).max() < SINGLE:
        raise ValueError("pose: not a unit motor; expected m ~m = 1; use pga3.normalize_motor(pose)")
    motor.flags.writeable = False
    return motor


def _pair(values: tuple[float, ...], name: str) -> tuple[float, float]:
    if len(values) != 2:
        raise ValueError(f"{name}: {len(values)} numbers; expected 2")
    return finite_number(values[0], name), finite_number(values[1], name)
