"""First intersections of lines of sight with the surfaces of objects: spheres, closed cylinders and triangle meshes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from generated import cga2, cga3, pga3

from ...arguments import Reals
from ...geometry.fits import axis_frame
from ...geometry.meshes import hit_mesh
from .pose_features import poses_of_rotations


@dataclass(frozen=True, eq=False)
class Surfaces:
    """The surfaces of an object in the world, which is the union of its parts."""

    vertices: Reals
    """(n, 3)"""
    faces: Reals
    """(m, 3)"""
    balls: Reals
    """(k, 4) Centres and radii of spheres."""
    tubes: Reals
    """(k, 7) The centres of both ends of closed cylinders, and radii."""

    @classmethod
    def at(cls, pose: Reals, vertices: Reals, faces: Reals, balls: Reals, tubes: Reals) -> Surfaces:
        """Return surfaces that are given in the frame of an object at a pose of the object."""
        ends = pga3.move_point(pose, np.ascontiguousarray(tubes[:, :6].reshape(-1, 2, 3)))
        centres = pga3.move_point(pose, np.ascontiguousarray(balls[:, :3]))
        return cls(
            pga3.move_point(pose, np.ascontiguousarray(vertices, dtype=float)), np.asarray(faces),
            np.hstack([centres, balls[:, 3:]]), np.hstack([ends.reshape(-1, 6), tubes[:, 6:]]),
        )  # fmt: skip


def hit_ball(origin: Reals, directions: Reals, ball: Reals) -> tuple[Reals, Reals]:
    """Return the distances (n) at which rays from a point meet a sphere, in lengths of directions, and unit normals."""
    with np.errstate(all="ignore"):
        t = np.asarray(cga3.hit_ray_sphere(origin, directions, cga3.sphere_from_centre(ball[:3], ball[3])))
        t = np.where(np.isfinite(t), t, np.inf)
        normals = (origin + t[:, None] * directions - ball[:3]) / ball[3]
    return t, normals


def hit_tube(origin: Reals, directions: Reals, tube: Reals) -> tuple[Reals, Reals]:
    """Return the distances (n) at which rays from an outer point meet a closed cylinder, and unit normals.

    In the frame of the cylinder, the side is a circle of the plane, and the ends are planes.
    """
    frame, height = _frame_of_tube(tube)
    start = np.asarray(pga3.move_point_back(frame, np.ascontiguousarray(origin)))
    along = np.asarray(pga3.move_direction(pga3.motor_inverse(frame), np.ascontiguousarray(directions)))
    radius = float(tube[6])
    best = np.full(len(along), np.inf)
    normals = np.full_like(along, np.nan)
    with np.errstate(all="ignore"):
        circle = cga2.circle_from_centre(np.zeros(2), radius)
        t = np.asarray(cga2.hit_ray_circle(start[:2].copy(), np.ascontiguousarray(along[:, :2]), circle))
        place = start + t[:, None] * along
        hit = (t > 0) & (place[:, 2] >= 0) & (place[:, 2] <= height)
        best[hit] = t[hit]
        normals[hit] = place[hit] * [1, 1, 0] / radius
        for level, sign in ((0.0, -1.0), (height, 1.0)):
            plane = pga3.plane_from_point_normal(np.array([0, 0, level]), np.array([0, 0, 1.0]))
            t, place = pga3.hit_ray_plane(start, along, plane)
            hit = (t > 0) & (t < best) & (np.square(place[:, :2]).sum(1) <= radius * radius)
            best[hit] = t[hit]
            normals[hit] = [0, 0, sign]
    return best, np.asarray(pga3.move_direction(frame, normals))


def first_hits(origin: Reals, directions: Reals, parts: Surfaces, without: int | None = None) -> Reals:
    """Return the distances (n) of the first hits of rays from a point, in lengths of directions; infinite without one.

    Parameters
    ----------
    origin : array, (3,)
    directions : array, (n, 3)
    parts : Surfaces
    without : int, optional
        The index of a part that rays pass: spheres are counted first, then cylinders.
    """
    best = np.full(len(directions), np.inf)
    if len(parts.faces):
        best = hit_mesh(origin, directions, parts.vertices, parts.faces).distance
    for k, ball in enumerate(parts.balls):
        if k != without:
            best = np.minimum(best, hit_ball(origin, directions, ball)[0])
    for k, tube in enumerate(parts.tubes):
        if k + len(parts.balls) != without:
            best = np.minimum(best, hit_tube(origin, directions, tube)[0])
    return np.asarray(best)


def _frame_of_tube(tube: Reals) -> tuple[Reals, float]:
    """Return the motor from the frame of a cylinder, with its axis z from the first end, and its height."""
    along = tube[3:6] - tube[:3]
    height = float(np.linalg.norm(along))
    return poses_of_rotations(axis_frame(along / height).T[None], tube[None, :3])[0], height
