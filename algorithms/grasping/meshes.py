"""Meshes of objects in a frame of their own: checks, moments, and samples of the surface."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from generated import grasping, pga3

from ..arguments import Reals
from ..geometry.meshes import Flags, Integers, is_closed, winding_numbers
from ..precision import NEGLIGIBLE, ROUNDING, SINGLE
from .status import GraspStatus

SAMPLES = 4096
"""Number of samples of the surface: the distance between neighbours is about a sixtieth of the object's size."""
_STEPS = np.array([0.8191725133961645, 0.6710436067037893, 0.5497004779019703])
"""The steps of a sequence of points that fill a cube evenly (Roberts' R3)."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Samples of the surface of an object in the frame of its centre of mass and principal axes."""

    frame: Reals
    """(8,) The motor from this frame to that of the mesh."""
    points: Reals
    """(n, 3) Points on the faces."""
    normals: Reals
    """(n, 3) Outward unit normals of the faces."""
    extents: Reals
    """(3,) The size along each axis."""
    length: float
    """The largest distance of a vertex from the centre of mass, by which torques are divided."""
    vertices: Reals
    """(k, 3) Those of the mesh, in its frame."""
    faces: Integers
    """(m, 3) None if only a side is known."""
    errors: Reals = field(default_factory=lambda: np.zeros((1, 2)))
    """(n, 2) or (1, 2) Bounds of the errors of the points along the normals, and of the angles of normals."""

    def is_outer(self, points: Reals, normals: Reals) -> Flags:
        """Return whether contacts (k, 3) in the frame of the mesh are on the outside of all its solids, (k,).

        Nothing surrounds the points above them. Other contacts are inside of another solid or of another part of the
        surface, or in a common face of two solids.
        """
        if not len(self.faces):
            return np.ones(len(points), bool)
        # Far from the origin, the contacts are not more precise than their coordinates.
        above = NEGLIGIBLE * self.length + ROUNDING * float(np.abs(points).max(initial=0.0))
        return np.asarray(winding_numbers(points + above * normals, self.vertices, self.faces) == 0)

    def outside(self) -> Surface:
        """Return the surface with those samples that are on the outside."""
        contacts = pga3.move_point(self.frame, self.points), pga3.move_direction(self.frame, self.normals)
        return self.with_samples(self.is_outer(*contacts))

    def certain(self, samples: Integers, friction: float) -> tuple[float, float]:
        """Return a friction whose cones at samples are within the true cones, and the bound of errors of the points."""
        errors = self.errors if len(self.errors) == 1 else self.errors[samples]
        distance, angle = errors.max(0).tolist()
        return float(np.tan(np.arctan(friction) - angle)) if angle else friction, distance

    def with_samples(self, kept: Flags) -> Surface:
        """Return the surface with some of its samples."""
        errors = self.errors if len(self.errors) == 1 else self.errors[kept]
        return replace(self, points=self.points[kept], normals=self.normals[kept], errors=errors)


def surface_of(vertices: Reals, faces: Integers) -> Surface | GraspStatus:
    """Return samples of the surface of a closed mesh, or why there are none."""
    proper = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    faces = faces if proper.all() else faces[proper]
    if not faces.size:
        return GraspStatus.EMPTY
    if not is_closed(faces):
        # The faces of some formats share no vertices; those at equal places are the same.
        vertices, same = np.unique(vertices, axis=0, return_inverse=True)
        faces = same.reshape(-1)[faces]
        if not is_closed(faces):
            return GraspStatus.OPEN_MESH
    used = np.zeros(len(vertices), bool)
    used[faces] = True
    if not used.all():
        vertices, faces = vertices[used], (np.cumsum(used) - 1)[faces]
    origin = vertices.mean(0)
    local = vertices - origin
    i, j, k = np.ascontiguousarray(faces.T)
    areas, volume, first, second = grasping.mesh_moments(local, i, j, k)
    size = float(np.ptp(local, axis=0).max())
    if not abs(volume) > NEGLIGIBLE * size**3:
        return GraspStatus.TOO_THIN
    centre = first / volume
    table = np.empty((3, 3))
    table[np.triu_indices(3)] = second / volume
    table = np.triu(table) + np.triu(table, 1).T - np.outer(centre, centre)
    turn = _principal_axes(table, local - centre)
    placed = (local - centre) @ turn
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, origin + centre
    points, normals = _samples(placed, faces, np.sign(volume) * areas @ turn)
    length = float(np.sqrt(np.square(placed).sum(1).max()))
    frame, extents = pga3.motor_from_matrix(matrix), np.ptp(placed, axis=0)
    return Surface(frame, points, normals, extents, length, vertices, faces)


def _principal_axes(table: Reals, off: Reals) -> Reals:
    """Return a rotation matrix whose columns are principal axes, the longest first, from moments and vertices.

    Directions that the moments leave open are chosen by the first vertex that distinguishes them, so that they move
    with the object.
    """
    values, axes = np.linalg.eigh(table)
    values, axes = values[::-1], axes[:, ::-1].copy()
    reach = float(np.sqrt(np.square(off).sum(1).max()))

    def first_direction(basis: Reals) -> Reals:
        inside = off @ basis
        far = np.sqrt(np.square(inside).sum(1))
        found = inside[int(np.argmax(far > 0.1 * reach))]
        return basis @ (found / np.linalg.norm(found))  # type: ignore[no-any-return]

    close = (values[:-1] - values[1:]) < SINGLE * values[0]
    if close.all():
        axes[:, 0] = first_direction(axes)
        axes[:, 1] = first_direction(np.linalg.svd(axes[:, :1].T)[2][1:].T)
    elif close[0]:
        axes[:, 0] = first_direction(axes[:, :2])
        axes[:, 2] = _signed(axes[:, 2], off)
        axes[:, 1] = np.cross(axes[:, 2], axes[:, 0])
    else:
        axes[:, 0] = _signed(axes[:, 0], off)
        axes[:, 1] = first_direction(axes[:, 1:]) if close[1] else _signed(axes[:, 1], off)
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    return axes


def _signed(axis: Reals, off: Reals) -> Reals:
    along = off @ axis
    first = along[int(np.argmax(np.abs(along) > 0.1 * float(np.abs(along).max())))]
    return axis if first > 0 else -axis


def _samples(vertices: Reals, faces: Integers, areas: Reals) -> tuple[Reals, Reals]:
    """Return points on the faces, evenly distributed by area, and the unit normals of their faces."""
    sizes = np.sqrt(np.square(areas).sum(1))
    reached = np.cumsum(sizes)
    share = (0.5 + np.arange(1, SAMPLES + 1)[:, None] * _STEPS) % 1.0
    # One sample in each of equal parts of the area, not at its middle: faces of a regular mesh may be in an order of
    # the same period.
    steps = (np.arange(SAMPLES) + share[:, 0]) * (reached[-1] / SAMPLES)
    chosen = np.minimum(np.searchsorted(reached, steps), len(faces) - 1)
    share = share[:, 1:]
    share = np.where(share.sum(1, keepdims=True) > 1, 1 - share, share)
    # A little inside the face, so that it is the nearest face of the sample.
    share = 0.96 * share + 0.04 / 3
    a, b, c = (vertices[faces[chosen, k]] for k in range(3))
    return a + share[:, :1] * (b - a) + share[:, 1:] * (c - a), areas[chosen] / sizes[chosen, None]
