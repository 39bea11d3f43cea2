"""Bodies that an arm must not touch: meshes, half-spaces and capsules, and their distances from capsules."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from generated import collisions, grasping, pga3

from ...arguments import Reals, finite, finite_number, moderate, real_array
from ...elements import MOTOR, elements
from ...geometry.meshes import Integers, checked_mesh, winding_numbers

_FEW = 64
"""Distances from meshes with at most so many triangles are always exact."""
_COARSE = 0.02
"""Size of the cells, in metres, of which one vertex each is used for distant capsules."""
_STILL = np.array([1.0, 0, 0, 0, 0, 0, 0, 0])


class Obstacle(Protocol):
    """A body that is at rest."""

    def clearance(self, ends: Reals, radii: Reals) -> Reals:
        """Return lower bounds of the distances of capsules, (..., 2, 3) and (...), which are exact near the body."""

    def contains(self, points: Reals) -> Reals:
        """Return whether points (n, 3) are inside."""

    def moved(self, motor: ArrayLike) -> Obstacle:
        """Return the body, moved by a motor, (8,)."""


@dataclass(frozen=True, slots=True, eq=False)
class MeshObstacle:
    """A rigid body whose surface is a mesh. Made by `mesh_obstacle`."""

    triangles: Reals
    """(m, 3, 3) In the frame of the body."""
    levels: tuple[tuple[Reals, float], ...]
    """Points of the surface, (n, 3), from few to many, and how far the surface is from the nearest of them."""
    pose: Reals
    """(8,) The motor to the world."""

    def clearance(self, ends: Reals, radii: Reals) -> Reals:
        """Return the distances of capsules from the surface; lower bounds if they are more than some millimetres.

        Parameters
        ----------
        ends : array, (..., 2, 3)
            The ends of the axes.
        radii : array, (...)

        Returns
        -------
        array, (...)
            Negative if a capsule intersects the surface. A body that is inside does not intersect it: see `contains`.
        """
        capsules = real_array(ends, "ends", (2, 3), "starts and ends")
        shape = capsules.shape[:-2]
        local = pga3.move_point_back(self.pose, capsules).reshape(-1, 2, 3)
        width = np.broadcast_to(radii, shape).reshape(-1)
        found = np.full(len(local), -np.inf)
        limit = np.inf
        for points, cover in self.levels:
            near = np.flatnonzero(found < limit)
            start, end = np.ascontiguousarray(local[near, 0]), np.ascontiguousarray(local[near, 1])
            found[near] = grasping.capsule_clearance(points, start, end, width[near]) - cover
            limit = 2 * cover
        near = np.flatnonzero(found < limit)
        if len(near):
            start, end = np.ascontiguousarray(local[near, 0]), np.ascontiguousarray(local[near, 1])
            found[near] = collisions.capsule_triangle_clearance(self.triangles, start, end, width[near])
        return found.reshape(shape)

    def contains(self, points: Reals) -> Reals:
        """Return whether points (n, 3) are inside the closed surface, or inside one of several solids."""
        flat = self.triangles.reshape(-1, 3)
        local = pga3.move_point_back(self.pose, real_array(points, "points", (3,), "points"))
        found = ((local >= flat.min(0)) & (local <= flat.max(0))).all(-1)
        corners = self.triangles.reshape(-1, 3)
        found[found] = winding_numbers(local[found], corners, np.arange(len(corners)).reshape(-1, 3)) != 0
        return np.asarray(found)

    @elements(motor=MOTOR)
    def moved(self, motor: ArrayLike) -> MeshObstacle:
        """Return the body, moved by a motor, (8,)."""
        by = finite(real_array(motor, "motor", (8,), "a motor"), "motor")
        return replace(self, pose=pga3.motor_product(by, self.pose))


@dataclass(frozen=True, slots=True, eq=False)
class PlaneObstacle:
    """A half-space, such as a table. Made by `plane_obstacle`."""

    plane: Reals
    """(4,) The unit plane; its normal points to the free side."""

    def clearance(self, ends: Reals, radii: Reals) -> Reals:
        """Return the distances of capsules, (..., 2, 3) and (...), above the plane."""
        capsules = real_array(ends, "ends", (2, 3), "starts and ends")
        width = np.broadcast_to(radii, capsules.shape[:-2])
        return collisions.capsule_plane_clearance(self.plane[None], capsules[..., 0, :], capsules[..., 1, :], width)

    def contains(self, points: Reals) -> Reals:
        """Return whether points (n, 3) are below the plane."""
        return np.asarray(real_array(points, "points", (3,), "points") @ self.plane[:3] + self.plane[3] < 0)

    @elements(motor=MOTOR)
    def moved(self, motor: ArrayLike) -> PlaneObstacle:
        """Return the half-space, moved by a motor, (8,)."""
        by = finite(real_array(motor, "motor", (8,), "a motor"), "motor")
        return PlaneObstacle(np.asarray(pga3.move_plane(by, self.plane)))


@dataclass(frozen=True, slots=True, eq=False)
class CapsuleObstacle:
    """A capsule, or a sphere if its ends are equal. Made by `capsule_obstacle`."""

    ends: Reals
    """(2, 3)"""
    radius: float

    def clearance(self, ends: Reals, radii: Reals) -> Reals:
        """Return the distances of capsules, (..., 2, 3) and (...)."""
        start, end = np.moveaxis(real_array(ends, "ends", (2, 3), "starts and ends"), -2, 0)
        width = np.broadcast_to(radii, start.shape[:-1]) + self.radius
        return collisions.capsule_pair_clearance(start, end, self.ends[0], self.ends[1], width)

    def contains(self, points: Reals) -> Reals:
        """Return whether points (n, 3) are inside."""
        places = real_array(points, "points", (3,), "points")
        return np.asarray(self.clearance(np.stack([places, places], -2), np.zeros(len(places))) < 0)

    @elements(motor=MOTOR)
    def moved(self, motor: ArrayLike) -> CapsuleObstacle:
        """Return the capsule, moved by a motor, (8,)."""
        by = finite(real_array(motor, "motor", (8,), "a motor"), "motor")
        return CapsuleObstacle(np.asarray(pga3.move_point(by, self.ends)), self.radius)


@elements(pose=MOTOR)
def mesh_obstacle(vertices: ArrayLike, faces: ArrayLike, pose: ArrayLike = _STILL) -> MeshObstacle:
    """Return a mesh as an obstacle.

    Parameters
    ----------
    vertices : array_like, (n, 3)
        In metres.
    faces : array_like of int, (m, 3)
        At least one triangle. Only a closed mesh with faces oriented alike has an inside. There may be several solids
        that overlap, and a surface that intersects itself.
    pose : array_like, (8,)
        The motor from the frame of the mesh to the world.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong type or shape, a coordinate is not finite, or there is no face.
    """
    points, corners = checked_mesh(vertices, faces, "mesh_obstacle")
    place = finite(real_array(pose, "mesh_obstacle: pose", (8,), "a motor"), "mesh_obstacle: pose").astype(float)
    if not len(corners):
        raise ValueError("mesh_obstacle: faces: none; expected at least one triangle")
    triangles = np.ascontiguousarray(points[corners])
    levels = () if len(triangles) <= _FEW else _levels(points[np.unique(corners)], triangles)
    return MeshObstacle(triangles, levels, place)


def _levels(points: Reals, triangles: Reals) -> tuple[tuple[Reals, float], ...]:
    longest = np.linalg.norm(triangles - np.roll(triangles, 1, 1), axis=-1).max()
    # A point of a triangle is at most so far from the nearest corner.
    cover = float(longest / np.sqrt(3))
    cells = np.floor((points - points.min(0)) / _COARSE).astype(np.intp)
    _, first = np.unique(cells, axis=0, return_index=True)
    chosen: Integers = np.sort(first)
    coarse = points[chosen], float(cover + np.sqrt(3) * _COARSE)
    return (coarse, (points, cover)) if 2 * len(chosen) < len(points) else ((points, cover),)


def plane_obstacle(normal: ArrayLike, point: ArrayLike) -> PlaneObstacle:
    """Return the half-space below a plane as an obstacle.

    Parameters
    ----------
    normal : array_like, (3,)
        The direction of the free side, of any length.
    point : array_like, (3,)
        A point of the plane.

    Raises
    ------
    TypeError, ValueError
        If shapes or types are wrong, a number is not finite, or `normal` has no length.
    """
    n = finite(real_array(normal, "plane_obstacle: normal", (3,), "a vector"), "plane_obstacle: normal").astype(float)
    p = finite(real_array(point, "plane_obstacle: point", (3,), "a point"), "plane_obstacle: point").astype(float)
    moderate(n, "plane_obstacle: normal")
    length = float(np.linalg.norm(n))
    if not length > 0:
        raise ValueError("plane_obstacle: normal: length 0; expected a direction")
    return PlaneObstacle(np.asarray(pga3.plane_from_point_normal(p, n / length)))


def capsule_obstacle(start: ArrayLike, end: ArrayLike, radius: float) -> CapsuleObstacle:
    """Return a capsule, or a sphere if its ends are equal, as an obstacle.

    Parameters
    ----------
    start, end : array_like, (3,)
        The ends of the axis.
    radius : float
        Positive.

    Raises
    ------
    TypeError, ValueError
        If shapes or types are wrong, a number is not finite, or `radius` is not positive.
    """
    ends = [
        finite(real_array(value, f"capsule_obstacle: {name}", (3,), "a point"), f"capsule_obstacle: {name}")
        for name, value in (("start", start), ("end", end))
    ]
    if not finite_number(radius, "capsule_obstacle: radius") > 0:
        raise ValueError(f"capsule_obstacle: radius: {radius}; expected a positive number")
    return CapsuleObstacle(np.array(ends, float), float(radius))
