"""Rectification: two views, of any cameras, as seen by equal cameras side by side, whose rows correspond."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3, projective2

from ..arguments import Reals, check_pixels, real_array
from ..precision import NEGLIGIBLE, ROUNDING
from .camera import Camera
from .status import DegenerateError, VisionStatus
from .stereo import RectifiedPair
from .undistortion import sampled

_SIDE = 64
"""A limit on work: the number of places on each side of an image whose directions give its extent."""
_WIDEST = np.tan(np.radians(80))
"""A limit on work: coordinates of a rectified image, in focal lengths, beyond which it is magnified thirtyfold."""


@dataclass(frozen=True, slots=True, eq=False)
class Rectification:
    """Result of `rectify`: the cameras of the rectified views, and the maps to them."""

    originals: tuple[Camera, Camera]
    cameras: tuple[Camera, Camera]
    """Pinhole cameras at the places of the original ones, with equal orientation and focal length and without skew. The
    line between their centres is parallel to their rows. Only the x coordinates of their principal points differ."""
    size: tuple[int, int]
    """Width and height of the rectified images."""

    @property
    def rotations(self) -> Reals:
        """(2, 3, 3) From the frames of the original cameras to those of the rectified ones."""
        found = [
            pga3.motor_to_matrix(pga3.motor_product(pga3.motor_inverse(new.pose), old.pose))[:3, :3]
            for new, old in zip(self.cameras, self.originals, strict=True)
        ]
        return np.array(found)

    @property
    def is_swapped(self) -> bool:
        """Whether the second camera is on the left, so that disparities are negative."""
        return self._baseline() < 0

    def pair(self) -> RectifiedPair:
        """Return the rectified pair, whose disparities give depths.

        Raises
        ------
        ValueError
            If the second camera is on the left (`is_swapped`).
        """
        if self.is_swapped:
            raise ValueError("rectify: the second camera is on the left; expected the left camera first; swap both")
        k, other = (camera.intrinsics for camera in self.cameras)
        return RectifiedPair(
            float(k[0, 0]), (float(k[0, 2]), float(k[1, 2])), float(other[0, 2] - k[0, 2]), self._baseline()
        )

    def points(self, pixels: ArrayLike, which: int) -> Reals:
        """Return where pixels of an original image are in the rectified one.

        Parameters
        ----------
        pixels : array_like, (..., 2)
        which : {0, 1}
            The first or the second camera.

        Returns
        -------
        array, (..., 2)
            NaN for directions that are behind the rectified camera.

        Raises
        ------
        TypeError, ValueError
            If `pixels` is not an array of pixels, or if `which` is neither 0 nor 1.
        """
        array = real_array(pixels, "pixels", (2,), "x y in pixels")
        _check_which(which)
        turned = np.asarray(self.originals[which].directions(array), np.float64) @ self.rotations[which].T
        with np.errstate(all="ignore"):
            places = np.where(turned[..., 2:] > 0, turned[..., :2] / turned[..., 2:], np.nan)
        return np.asarray(projective2.transform_point(self.cameras[which].intrinsics, places), array.dtype)

    def map(self, which: int) -> Reals:
        """Return the pixel of the original image at each pixel of the rectified one (`initUndistortRectifyMap`).

        Parameters
        ----------
        which : {0, 1}
            The first or the second camera.

        Returns
        -------
        array, (h, w, 2)
            x and y; NaN where the lens shows nothing.

        Raises
        ------
        ValueError
            If `which` is neither 0 nor 1.
        """
        _check_which(which)
        width, height = self.size
        pixels = np.stack(np.meshgrid(np.arange(float(width)), np.arange(float(height))), -1)
        places = projective2.transform_point(np.linalg.inv(self.cameras[which].intrinsics), pixels)
        sights = np.concatenate([places, np.ones((height, width, 1))], -1) @ self.rotations[which]
        original = self.originals[which]
        own = Camera(original.intrinsics, np.eye(8)[0], original.distortion)
        seen = np.asarray(own.project(sights))
        # A pinhole camera also projects points of negative depth.
        return seen if original.distortion is not None else np.where(sights[..., 2:] > 0, seen, np.nan)

    def image(self, image: ArrayLike, which: int) -> Reals:
        """Return a rectified image, by bilinear interpolation.

        Parameters
        ----------
        image : array_like, (h, w) or (h, w, c)
            Of the original camera.
        which : {0, 1}
            The first or the second camera.

        Returns
        -------
        array, (h, w) or (h, w, c)
            float32 or float64; NaN where the original image shows nothing.

        Raises
        ------
        TypeError, ValueError
            If `image` is not an image, or if `which` is neither 0 nor 1.
        """
        array = real_array(image, "image")
        if array.ndim not in (2, 3) or 0 in array.shape:
            raise ValueError(f"image: shape {array.shape}; expected (h, w) or (h, w, c), not empty")
        return sampled(array, self.map(which))

    def _baseline(self) -> float:
        """Return the x coordinate of the second centre in the frame of the first rectified camera."""
        first, second = (camera.pose for camera in self.cameras)
        return float(pga3.motor_to_matrix(pga3.motor_product(pga3.motor_inverse(first), second))[0, 3])


def rectify(
    first: Camera,
    second: Camera,
    size: tuple[int, int],
    *,
    second_size: tuple[int, int] | None = None,
    new_size: tuple[int, int] | None = None,
    focal_length: float | None = None,
) -> Rectification:
    """Rectify two views of any two cameras: turn both so that corresponding points are in the same row.

    Both are turned so that their x axes are along the line between the centres, and their common z axis is as near as
    possible to the mean of the original ones (`stereoRectify`). Lenses and cameras may differ. The maps of the result
    remove the distortion too.

    Parameters
    ----------
    first, second : Camera
        With their poses in one frame, such as those of `calibrate_stereo` or `bundle_adjust`.
    size : (int, int)
        Width and height of the images of the first camera.
    second_size : (int, int), optional
        Of the second camera; by default the same.
    new_size : (int, int), optional
        Of the rectified images; by default `size`.
    focal_length : float, optional
        Of the rectified cameras, in pixels. By default it is such that they show all of both original images; a larger
        one shows the middle magnified.

    Returns
    -------
    Rectification

    Raises
    ------
    TypeError, ValueError
        If a camera is not a `Camera`, if a size is not positive, or if `focal_length` is not positive.
    DegenerateError
        If both centres coincide, or if an image contains the epipole, as after a forward motion: the lines through it
        cannot become rows of a pinhole camera.
    """
    sizes = [_checked_size(size, "size"), _checked_size(second_size or size, "second_size")]
    target = _checked_size(new_size or size, "new_size")
    for camera, name in ((first, "first"), (second, "second")):
        if not isinstance(camera, Camera):
            raise TypeError(f"{name}: {type(camera).__name__}; expected a Camera")
    check_pixels(focal_length, "focal_length")
    frames = [pga3.motor_to_matrix(camera.pose) for camera in (first, second)]
    turn = _common_axes(*frames)
    low, high = np.empty((2, 2)), np.empty((2, 2))
    for k, (camera, frame, own) in enumerate(zip((first, second), frames, sizes, strict=True)):
        border = _border(own)
        sights = np.asarray(camera.directions(border)) @ (turn @ frame[:3, :3]).T
        sights = sights[np.isfinite(sights).all(1)]
        with np.errstate(all="ignore"):
            places = sights[:, :2] / sights[:, 2:]
        if not len(sights) or not (sights[:, 2] > 0).all() or np.abs(places[:, 0]).max() > _WIDEST:
            raise DegenerateError(
                f"rectify: {'first' if k == 0 else 'second'} shows directions along the line between the centres; "
                "expected cameras side by side",
                VisionStatus.DEGENERATE,
            )
        low[k], high[k] = places.min(0), places.max(0)
    extent = np.array([(high - low)[:, 0].max(), high[:, 1].max() - low[:, 1].min()])
    f = float(((np.array(target) - 1) / extent).min()) if focal_length is None else float(focal_length)
    middle = (np.array(target) - 1) / 2
    y = middle[1] - f * (high[:, 1].max() + low[:, 1].min()) / 2
    cameras = []
    for k, frame in enumerate(frames):
        whole = np.eye(4)
        whole[:3, :3], whole[:3, 3] = turn.T, frame[:3, 3]
        x = middle[0] - f * (low[k, 0] + high[k, 0]) / 2
        cameras.append(Camera.from_intrinsics(f, (float(x), float(y)), pga3.motor_from_matrix(whole)))
    return Rectification((first, second), (cameras[0], cameras[1]), target)


def _common_axes(first: Reals, second: Reals) -> Reals:
    """Return the axes of the rectified cameras, as rows, in the world frame."""
    line = second[:3, 3] - first[:3, 3]
    length = np.linalg.norm(line)
    if not length > ROUNDING * np.abs([first[:3, 3], second[:3, 3]]).max():
        raise DegenerateError("rectify: equal centres; expected two places", VisionStatus.DEGENERATE)
    x = line / length
    mean = first[:3, :3] + second[:3, :3]
    if x @ mean[:, 0] < 0:
        x = -x
    z = mean[:, 2] - (x @ mean[:, 2]) * x
    size = np.linalg.norm(z)
    if not size > NEGLIGIBLE:
        raise DegenerateError(
            "rectify: the cameras look along the line between their centres, or in opposite directions; "
            "expected cameras side by side",
            VisionStatus.DEGENERATE,
        )
    z = z / size
    return np.array([x, np.cross(z, x), z])


def _border(size: tuple[int, int]) -> Reals:
    """Return pixels on the border of an image."""
    x, y = (np.linspace(0, side - 1, _SIDE) for side in size)
    edges = [(x, 0 * x), (x, 0 * x + size[1] - 1), (0 * y, y), (0 * y + size[0] - 1, y)]
    return np.concatenate([np.stack(edge, 1) for edge in edges])


def _checked_size(size: tuple[int, int], name: str) -> tuple[int, int]:
    whole = isinstance(size, (tuple, list)) and len(size) == 2
    if not whole or any(isinstance(s, bool) or not isinstance(s, (int, np.integer)) for s in size):
        raise TypeError(f"{name}: {size!r}; expected the width and the height of an image")
    if min(size) < 2:
        raise ValueError(f"{name}: {size[0]} x {size[1]}; expected at least 2 x 2 pixels")
    return int(size[0]), int(size[1])


def _check_which(which: int) -> None:
    if which not in (0, 1):
        raise ValueError(f"which: {which!r}; expected 0 or 1, the first or the second camera")
