"""Maps in space: vertical planes of laser lines, and points, lines, planes and spheres of a stereo head."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike

from generated import navigation as kernels
from generated import pga2, pga3

from ..arguments import Reals, real_array
from ..elements import LINE, MOTOR, elements
from ..vision.stereo import RectifiedPair
from .localization import Lines


class SolidKind(IntEnum):
    """Kinds of objects in space."""

    PLANE = 0
    SPHERE = 1


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A plane or a sphere of conformal space."""

    kind: SolidKind
    vector: Reals
    """(5,) The dual plane or dual sphere of `generated.cga3`, with square 1."""
    corners: Reals
    """(k, 3) The boundary of the part of a plane that was seen; without rows for spheres."""
    name: str = ""

    @property
    def centre(self) -> Reals:
        """(3,) The centre of a sphere, or of the corners of a plane."""
        if self.kind == SolidKind.SPHERE:
            return np.asarray(self.vector[:3] / self.vector[3])
        return np.asarray(self.corners.mean(0))

    @property
    def radius(self) -> float:
        """The radius of a sphere; infinite for a plane."""
        return abs(1 / float(self.vector[3])) if self.vector[3] else float("inf")

    @property
    def plane(self) -> Reals:
        """(4,) A plane as a vector of `generated.pga3`.

        Raises
        ------
        ValueError
            For a sphere.
        """
        if self.kind != SolidKind.PLANE:
            raise ValueError(f"{self.name or 'object'}: a sphere; expected a plane")
        return np.append(self.vector[:3], -self.vector[4])


def pose_in_space(motor: ArrayLike, height: float = 0.0) -> Reals:
    """Return the motors (..., 8) of `generated.pga3` of poses (..., 4) in the plane, at a height."""
    pose = real_array(motor, "motor", (4,), "motors of generated.pga2").astype(float)
    nothing = np.zeros_like(pose[..., :1])
    rotor = np.concatenate([pose[..., :2], nothing, nothing], -1)
    place = np.asarray(pga2.motor_to_angle_translation(pose)[1])
    return np.asarray(pga3.motor_from_rotor_translation(rotor, np.concatenate([place, nothing + height], -1)))


def vertical_planes(lines: Lines, low: float, high: float) -> tuple[Solid, ...]:
    """Return the vertical planes through lines of the ground, between two heights.

    Parameters
    ----------
    lines : Lines
        Of a map from laser scans, such as `Segments`.
    low, high : float
        Metres above the plane of the scans.
    """
    found = []
    for normal, offset, (start, end) in zip(lines.normals, lines.offsets, lines.ends, strict=True):
        corners = [(*start, low), (*end, low), (*end, high), (*start, high)]
        vector = np.array([normal[0], normal[1], 0.0, 0.0, offset])
        found.append(Solid(SolidKind.PLANE, vector, np.array(corners)))
    return tuple(found)


@elements(pose=MOTOR)
def stereo_points(
    pair: RectifiedPair,
    pixels: ArrayLike,
    disparities: ArrayLike,
    pose: ArrayLike,
    sigma: float = 0.5,
    disparity_sigma: float | None = None,
) -> tuple[Reals, Reals]:
    """Return points of a stereo camera in the frame of the map, and their covariances.

    Parameters
    ----------
    pair : RectifiedPair
    pixels : array_like, (..., 2)
        In the left image.
    disparities : array_like, (...)
        In pixels.
    pose : array_like, (..., 8)
        From the frame of the left camera to that of the map: the product of the pose of the robot (`pose_in_space`), of
        the mount of the head, and of the head's pose at its angles (`BodyEye.pose`, or `Robot.forward` of a pan-tilt
        head).
    sigma : float
        The standard deviation of pixels,
    disparity_sigma : float, optional
        and of disparities; by default that of a difference of two pixels.

    Returns
    -------
    points : array, (..., 3)
        NaN where the disparity is not that of a point in front of the cameras.
    covariances : array, (..., 6)
        Upper triangles, row by row.
    """
    places = real_array(pixels, "pixels", (2,), "x y in pixels").astype(float)
    shifts = real_array(disparities, "disparities").astype(float)
    known = np.where(pair.valid(shifts), shifts + pair.offset, np.nan)
    image = np.concatenate([places, np.expand_dims(known, -1)], -1)
    numbers = np.array([pair.focal_length, *pair.centre, pair.baseline])
    other = sigma * np.sqrt(2) if disparity_sigma is None else disparity_sigma
    points, covariances = kernels.stereo_point(
        image, numbers, real_array(pose, "pose", (8,), "motors"), np.array([sigma**2, other**2])
    )
    return np.asarray(points), np.asarray(covariances)


@elements(LINE, pose=MOTOR)
def stereo_lines(pair: RectifiedPair, left: ArrayLike, right: ArrayLike, pose: ArrayLike) -> Reals:
    """Return lines (..., 6) of `generated.pga3` in the frame of the map: the meets of planes through both images.

    Parameters
    ----------
    pair : RectifiedPair
    left, right : array_like, (..., 2, 2)
        Two pixels on the line in each image; they need not correspond.
    pose : array_like, (..., 8)
        As for `stereo_points`.

    Returns
    -------
    array, (..., 6)
        Unit lines; NaN for lines in a plane with the baseline, whose two planes are the same.
    """
    planes = []
    for ends, shift, aside in ((left, 0.0, 0.0), (right, pair.offset, pair.baseline)):
        pixels = real_array(ends, "left" if aside == 0 else "right", (2, 2), "two pixels of each line").astype(float)
        x = (pixels[..., 0] - pair.centre[0] - shift) / pair.focal_length
        y = (pixels[..., 1] - pair.centre[1]) / pair.focal_length
        rays = np.stack([x + aside, y, np.ones_like(x)], -1)
        centre = np.array([aside, 0.0, 0.0])
        planes.append(pga3.normalize_plane(pga3.join_three_points(centre, rays[..., 0, :], rays[..., 1, :])))
    meet = np.asarray(pga3.meet_planes(*planes))
    size = np.linalg.norm(meet[..., :3], axis=-1, keepdims=True)
    unit = np.divide(meet, size, out=np.full_like(meet, np.nan), where=size > 1e-6)
    return np.asarray(pga3.move_line(real_array(pose, "pose", (8,), "motors"), unit))


@dataclass(frozen=True, slots=True)
class Map3D:
    """A map in space; adding returns another map."""

    solids: tuple[Solid, ...] = ()
    clouds: tuple[Reals, ...] = ()
    """Arrays of points (k, 3)."""
    lines: tuple[Reals, ...] = ()
    """Segments (2, 3)."""

    def with_solids(self, more: Iterable[Solid]) -> Map3D:
        """Return the map with further planes and spheres."""
        return replace(self, solids=(*self.solids, *more))

    def with_points(self, points: ArrayLike) -> Map3D:
        """Return the map with further points (k, 3); those that are not finite are left out."""
        places = real_array(points, "points", (3,), "points").astype(float).reshape(-1, 3)
        return replace(self, clouds=(*self.clouds, places[np.isfinite(places).all(1)]))

    def with_segments(self, ends: ArrayLike) -> Map3D:
        """Return the map with further segments (k, 2, 3)."""
        pairs = real_array(ends, "ends", (2, 3), "segments").astype(float).reshape(-1, 2, 3)
        return replace(self, lines=(*self.lines, *pairs))
