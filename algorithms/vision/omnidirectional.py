"""Cameras with a mirror or a fish-eye lens: the unified model with a unit sphere, in conformal geometry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import cga3, omnidirectional, pga3, projective2

from ..arguments import Reals, finite_number, real_array
from .camera import Camera
from .distortion import Distortion
from .normalization import homogeneous


@dataclass(frozen=True, slots=True, eq=False)
class OmnidirectionalCamera:
    """A camera of the unified model: points are projected to a unit sphere, and from a pole of it to the image.

    Attributes
    ----------
    camera : Camera
        Intrinsic parameters of the projection from the sphere, and the motor from the camera frame to the world frame.
        Its `distortion` may be Brown's, as in `cv2.omnidir` and in Mei's toolbox: it moves places of the image plane.
    mirror : float
        Distance of the pole from the centre of the sphere: 1 for a parabolic mirror, less for a hyperbolic one, 0 for a
        camera without mirror; it may be larger for fish-eye lenses.
    """

    camera: Camera
    mirror: float

    def __post_init__(self) -> None:
        if self.camera.distortion is not None and self.camera.distortion.model != "brown":
            raise ValueError(
                "camera: with a fisheye lens; expected Brown's distortion or none: a fisheye lens without a sphere is "
                "Camera.from_intrinsics(..., distortion=Distortion('fisheye', ...))"
            )

    @classmethod
    def from_intrinsics(
        cls,
        focal_length: float | tuple[float, float],
        centre: tuple[float, float],
        mirror: float,
        pose: ArrayLike | None = None,
        distortion: Distortion | None = None,
    ) -> OmnidirectionalCamera:
        """Return a camera with given calibration parameters; see `Camera.from_intrinsics`.

        Raises
        ------
        TypeError, ValueError
            If a number is not finite, if the focal length is 0, if the pose is not a unit motor, or if `mirror` is
            negative.
        """
        distance = finite_number(mirror, "mirror")
        if distance < 0:
            raise ValueError(f"mirror: {distance}; expected a distance, 0 or more")
        return cls(Camera.from_intrinsics(focal_length, centre, pose, distortion=distortion), distance)

    def project(self, points: ArrayLike) -> Reals:
        """Project points to pixels.

        Parameters
        ----------
        points : array_like, (..., 3)
            World coordinates.

        Returns
        -------
        array, (..., 2)
            Infinite or NaN for the viewpoint itself and for directions without an image: those whose line from the pole
            does not meet the image plane from above, or meets the sphere first. With distortion, NaN also beyond the
            range of the lens.

        Raises
        ------
        TypeError, ValueError
            If `points` is not an array of points.
        """
        array = real_array(points, "points", (3,), "x y z")
        place = pga3.move_point_back(self.camera.pose.astype(array.dtype), array)
        mirror = array.dtype.type(self.mirror)
        # From a pole outside the sphere only the cap in front of the tangents is visible: z > -1 / mirror.
        least = array.dtype.type(-min(self.mirror, 1 / self.mirror) if self.mirror > 0 else 0)
        image = omnidirectional.project_place(mirror, least, place)
        return self.camera.distort(projective2.transform_point(self.camera.intrinsics.astype(array.dtype), image))

    def directions(self, pixels: ArrayLike) -> Reals:
        """Return the viewing directions of pixels: points of the unit sphere in the camera frame.

        Parameters
        ----------
        pixels : array_like, (..., 2)

        Returns
        -------
        array, (..., 3)
            Directions of norm 1; NaN for pixels outside the image of the sphere, which is bounded if `mirror` is
            more than 1, and where the lens shows nothing.

        Raises
        ------
        TypeError, ValueError
            If `pixels` is not an array of pixels.

        Notes
        -----
        The error is at most 1e-12 if the direction is at least 0.01 radians from the boundary of the visible
        directions.
        """
        array = self.camera.undistort(pixels)
        inverse = np.linalg.inv(self.camera.intrinsics).astype(array.dtype)
        with np.errstate(invalid="ignore"):
            found = omnidirectional.lift_image(
                array.dtype.type(self.mirror), projective2.transform_point(inverse, array)
            )
        return np.asarray(found)

    def conic_of_line(self, first: ArrayLike, second: ArrayLike) -> Reals:
        """Return the conic that contains the images of all points of a line.

        Parameters
        ----------
        first, second : array_like, (..., 3)
            Two points of the line, in world coordinates.

        Returns
        -------
        array, (..., 6)
            (a, b, c, d, e, f) of ``a x^2 + b x y + c y^2 + d x + e y + f = 0`` in pixels, of norm 1; NaN for lines
            through the viewpoint.

        Raises
        ------
        TypeError, ValueError
            If the arguments are not points, or if the camera has distortion: the image is then no conic.
        """
        one, two = self._places(first, second)
        conic = omnidirectional.image_conic_of_line(one.dtype.type(self.mirror), one, two)
        a, b, c, d, e, f = (conic[..., k] for k in range(6))
        rows = [[a, b / 2, d / 2], [b / 2, c, e / 2], [d / 2, e / 2, f]]
        inverse = np.linalg.inv(self.camera.intrinsics)
        m = inverse.T @ np.stack([np.stack(row, -1) for row in rows], -2) @ inverse
        found = np.stack(
            [m[..., 0, 0], 2 * m[..., 0, 1], m[..., 1, 1], 2 * m[..., 0, 2], 2 * m[..., 1, 2], m[..., 2, 2]], -1
        )
        through = np.linalg.norm(np.cross(one, two), axis=-1)
        size = np.linalg.norm(one, axis=-1) * np.linalg.norm(two, axis=-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            found = found / np.linalg.norm(found, axis=-1, keepdims=True)
        return np.where((through > 1e-14 * size)[..., None], found, np.nan)

    def circle_of_line(self, first: ArrayLike, second: ArrayLike) -> tuple[Reals, Reals]:
        """Return centre and radius, in pixels, of the circle that is the image of a line in a parabolic mirror.

        The plane of the line and the viewpoint meets the sphere in a great circle, which an inversion maps to the
        image.

        Parameters
        ----------
        first, second : array_like, (..., 3)
            Two points of the line, in world coordinates.

        Returns
        -------
        centre : array, (..., 2)
        radius : array, (...)
            Infinite or NaN, like the centre, if the line and the axis of the camera are coplanar: the image is then
            straight.

        Raises
        ------
        TypeError, ValueError
            If the arguments are not points, if `mirror` is not 1, if pixels are not square, or with distortion.
        """
        k: NDArray[np.float64] = self.camera.intrinsics
        if self.mirror != 1 or abs(k[0, 0]) != abs(k[1, 1]) or k[0, 1] != 0:
            raise ValueError("circle_of_line: images of lines are circles only for mirror 1 and square pixels")
        circle = omnidirectional.parabolic_image_of_line(*self._places(first, second))
        with np.errstate(divide="ignore", invalid="ignore"):
            centre, square = cga3.circle_centre(circle), cga3.circle_radius_squared(circle)
            middle = np.asarray(centre[..., :2] * np.diag(k)[:2] + k[:2, 2])
            return middle, np.asarray(np.abs(k[0, 0]) * np.sqrt(square))

    def _places(self, first: ArrayLike, second: ArrayLike) -> tuple[Reals, Reals]:
        """Return two points of lines, whose images are conics, in the frame of the camera."""
        if self.camera.distortion is not None:
            raise ValueError("camera: with distortion; expected none, for conics and circles in undistorted pixels")
        one, two = real_array(first, "first", (3,), "x y z"), real_array(second, "second", (3,), "x y z")
        back = pga3.move_point_back
        return back(self.camera.pose, one.astype(float)), back(self.camera.pose, two.astype(float))


def conic_value(conic: ArrayLike, pixels: ArrayLike) -> Reals:
    """Return ``a x^2 + b x y + c y^2 + d x + e y + f``, which is 0 on the conic.

    Parameters
    ----------
    conic : array_like, (..., 6)
    pixels : array_like, (..., 2)

    Returns
    -------
    array, (...)

    Raises
    ------
    TypeError, ValueError
        If an argument has a different shape or type.
    """
    numbers, array = real_array(conic, "conic", (6,), "a conic"), real_array(pixels, "pixels", (2,), "x y")
    x, y, w = np.moveaxis(homogeneous(array), -1, 0)
    return np.asarray((numbers * np.stack([x * x, x * y, y * y, x * w, y * w, w * w], -1)).sum(-1))
