"""The side of an object that one depth camera sees: contacts with bounds of their errors, and space seen to be free.

Planes have inverse depths that are affine functions of the coordinates in the image. Hence local fits of inverse depths
by polynomials of the second degree give tangent planes, with covariances by the noise of the depth.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array
from ..cubes import thinned
from ..evidence import WRONG, Noise, certain_deviations, largest_ratio
from ..geometry.meshes import Flags, Integers
from ..precision import CONVERGED, TINY
from ..vision.camera import Camera
from .closing import APPROACH
from .clusters import clusters_of
from .hand_poses import Body
from .hands import Hand
from .meshes import SAMPLES, Surface
from .mirrors import Mirror, View, mirrors
from .status import GraspStatus

_HALF = 5
"""Limit on work: tangent planes are fitted to pixels up to this number of rows and columns away."""
_POWERS = tuple((a, n - a) for n in range(4) for a in range(n, -1, -1))
"""The exponents of the terms, of which the first ones are those of the second degree."""
_FEWER = 6
"""The number of terms of up to the second degree."""
_FITTED = 2048
"""Limit on work: the number of pixels whose tangent planes are computed at a time."""
_STEP = 0.004
"""The distance of points on the boundary of free space, in metres: less than the radii of fingers."""
_POSTURES = 64
"""Limit on work: the number of random postures from which the reach of a hand is computed."""


class Tangents(NamedTuple):
    """Tangent planes at pixels, in the frame of the camera."""

    points: Reals
    """(n, 3)"""
    normals: Reals
    """(n, 3) Unit normals, towards the camera."""
    angles: Reals
    """(n,) Bounds of the errors of normals, in radians; infinite where the surface is not smooth up to the noise."""
    errors: Reals
    """(n,) Bounds of the errors of points along the normals."""


def tangents(sights: Reals, depth: Reals, rows: Reals, noise: float, n_contacts: int) -> Tangents:
    """Return tangent planes at some pixels (n, 2) of a depth image (h, w), which is NaN beside the object.

    Parameters
    ----------
    sights : array, (h, w, 2)
        Directions of pixels with the depth 1.
    depth, rows, noise
    n_contacts : int
        Bounds hold for this number of contacts together, with a probability of 0.999.
    """
    parts = [_tangents(sights, depth, rows[k : k + _FITTED], noise, n_contacts) for k in range(0, len(rows), _FITTED)]
    return Tangents(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def _tangents(sights: Reals, depth: Reals, rows: Reals, noise: float, n_contacts: int) -> Tangents:
    by = np.stack(np.meshgrid(*[np.arange(-_HALF, _HALF + 1)] * 2, indexing="ij"), -1).reshape(-1, 2)
    near = rows[:, None] + by
    inside = ((near >= 0) & (near < depth.shape)).all(-1)
    i, j = np.moveaxis(np.clip(near, 0, np.array(depth.shape) - 1), -1, 0)
    centre, z = sights[tuple(rows.T)], depth[tuple(rows.T)]
    used = inside & np.isfinite(depth[i, j])
    unit = np.abs(sights[i, j] - centre[:, None]).max((1, 2))
    x, y = np.moveaxis((sights[i, j] - centre[:, None]) / unit[:, None, None], -1, 0)
    terms = np.where(used[..., None], np.stack([x**a * y**b for a, b in _POWERS], -1), 0)
    off = np.where(used, 1 / np.where(used, depth[i, j], 1) - 1 / z[:, None], 0)
    normal, side = np.swapaxes(terms, 1, 2) @ terms, (off[:, None] @ terms)[:, 0]
    regular = np.linalg.eigvalsh(normal)[:, 0] > CONVERGED * len(by)
    safe = np.where(regular[:, None, None], normal, np.eye(len(_POWERS)))
    inverse = np.linalg.inv(safe)
    found = (inverse @ side[..., None])[..., 0]
    cost = np.maximum(np.square(off).sum(1) - (found * side).sum(1), 0)
    variance = (noise / z**2) ** 2
    freedom = used.sum(1) - len(_POWERS)
    smooth = np.zeros(len(rows), bool)
    for n in np.unique(freedom[regular & (freedom > 0)]):
        own = freedom == n
        smooth[own] = ~Noise(1.0).contradicted(cost[own] / variance[own], int(n))
    smooth &= regular
    # A tangent plane is m . X = 1, and m is linear in the value and the slopes of the inverse depth.
    to_plane = np.zeros((len(rows), 3, 3))
    to_plane[:, 0, 1] = to_plane[:, 1, 2] = 1 / unit
    to_plane[:, 2] = np.column_stack([np.ones(len(rows)), *(-centre / unit[:, None]).T])
    value = found[:, :3] + np.outer(1 / z, [1, 0, 0])
    m = (to_plane @ value[..., None])[..., 0]
    size = np.linalg.norm(m, axis=1)
    normals = -m / size[:, None]
    # What the terms of the third degree change is a bound of what further ones would.
    fewer = np.linalg.solve(safe[:, :_FEWER, :_FEWER], side[:, :_FEWER, None])[..., 0]
    change = (to_plane @ (found[:, :3] - fewer[:, :3])[..., None])[..., 0]
    changed = np.linalg.norm(np.cross(normals, change), axis=1) / size
    covariance = to_plane @ inverse[:, :3, :3] @ np.swapaxes(to_plane, 1, 2)
    across = (np.eye(3) - normals[:, :, None] * normals[:, None]) / size[:, None, None]
    spread = np.linalg.eigvalsh(across @ covariance @ across)[:, -1] * variance
    angles = np.sqrt(2 * largest_ratio(2, probability=WRONG / n_contacts) * np.maximum(spread, 0)) + changed
    points = np.column_stack([centre, np.ones(len(rows))]) / value[:, :1]
    slant = np.abs((normals * points).sum(1)) * np.abs(value[:, 0])
    errors = certain_deviations(WRONG / n_contacts) * noise * np.sqrt(np.maximum(inverse[:, 0, 0], 0))
    errors = slant * (errors + np.abs(found[:, 0] - fewer[:, 0]) * z**2)
    return Tangents(points, normals, np.where(smooth, angles, np.inf), errors)


@dataclass(frozen=True, slots=True, eq=False)
class UnseenSpace:
    """All that a depth camera has not seen to be free, as an obstacle that is known by the points inside."""

    camera: Camera
    depth: Reals
    """(h, w) To where lines of sight are free."""
    view: View
    mirror: Mirror | None = None
    """A plane of symmetry of the object: what it hides is free if the mirror image is seen to be."""

    def clearance(self, ends: Reals, radii: Reals) -> Reals:
        """Return infinite distances, (...): those from the boundary are measured at its points."""
        return np.full(ends.shape[:-2], np.inf)

    def moved(self, motor: ArrayLike) -> UnseenSpace:
        """Return the space that the camera, moved by a motor (8,), has not seen to be free."""
        given = real_array(motor, "motor", (8,), "a motor")
        return replace(self, camera=replace(self.camera, pose=pga3.motor_product(given, self.camera.pose)))

    def contains(self, points: Reals) -> Flags:
        """Return which points (n, 3) of the world are not seen to be free."""
        z = self.camera.depth(points)
        free = z > 0
        with np.errstate(all="ignore"):
            pixels = np.rint(self.camera.project(points[free]))
        inside = ((pixels >= 0) & (pixels < self.depth.shape[::-1])).all(1)
        column, row = pixels[inside].astype(int).T
        free[free] = inside
        free[free] = z[free] < self.depth[row, column]
        if self.mirror is not None:
            free |= self.mirror.frees(self.view, pga3.move_point_back(self.camera.pose, points))
        return ~free


@dataclass(frozen=True, slots=True, eq=False)
class SeenSide:
    """What one depth image shows of an object and of the space around it, in a frame of the object."""

    surface: Surface
    """Its first samples are those that are seen."""
    n_seen: int
    body: Body
    unseen: UnseenSpace

    def nearest(self, samples: Integers) -> Reals:
        """Return samples (k, 3) of the surface, those of a hidden side as near as they may be."""
        mirror, contacts = self.unseen.mirror, self.surface.points[samples]
        if mirror is None:
            return contacts
        from_camera = pga3.motor_product(pga3.motor_inverse(self.surface.frame), self.unseen.camera.pose)
        off = mirror.width * pga3.move_direction(from_camera, mirror.normal)
        return np.asarray(contacts - np.where(samples[:, None] >= self.n_seen, off, 0))


def seen_sides(
    camera: Camera, depth: Reals, mask: Flags, noise: float, angle: float, hand: Hand, symmetric: bool
) -> Iterator[SeenSide] | GraspStatus:
    """Return the contacts of an object whose normals have errors below an angle, and the boundary of free space.

    For a symmetric object, there is one result for each plane of symmetry.

    Parameters
    ----------
    camera : Camera
    depth : array, (h, w)
        Infinite where a line of sight is free, NaN where nothing is known.
    mask : array of bool, (h, w)
        The pixels of the object.
    noise, angle : float
    hand : Hand
    symmetric : bool
        Whether the hidden side is the mirror image of the seen one.
    """
    h, w = depth.shape
    pixels = np.stack(np.meshgrid(np.arange(w), np.arange(h)), -1).astype(float)
    directions = camera.directions(pixels)
    sights = directions[..., :2] / directions[..., 2:]
    known = np.where(np.isfinite(sights).all(-1) & (depth > 0), depth, 0.0)
    own = mask & (known > 0) & np.isfinite(known)
    rows = np.argwhere(own)
    if not len(rows):
        return GraspStatus.EMPTY
    found = tangents(sights, np.where(own, known, np.nan), rows, noise, hand.contacts)
    seen = found.points
    middle = seen.mean(0)
    reach = float(np.linalg.norm(seen - middle, axis=1).max()) + _reach(hand)
    others = np.column_stack([sights.reshape(-1, 2), np.ones(h * w)]) * known.reshape(-1, 1)
    others = others[(~own & np.isfinite(known) & (known > 0)).ravel()]
    walls, view = _walls(sights, known, middle, reach), View.of(camera, known, own)
    certain = np.flatnonzero((found.angles < angle) & ((found.normals * seen).sum(1) < 0))
    if not len(certain):
        return GraspStatus.UNSEEN
    certain = certain[_even(seen[certain], found.normals[certain])]
    space = UnseenSpace(camera, known, view)
    boundary = np.concatenate([seen, others, walls])
    points, normals = seen[certain], found.normals[certain]
    errors = np.column_stack([found.errors, found.angles])[certain]

    def side(mirror: Mirror | None) -> SeenSide:
        if mirror is None:
            return _side(space, boundary, seen, points, normals, errors, len(points), reach)
        kept = np.concatenate([seen, others, walls[~mirror.frees(view, walls)]])
        images, behind = (mirror.image(part, mirror.high) for part in (boundary, points))
        hidden, below = view.free(behind)[1], view.free(images)[1]
        return _side(
            replace(space, mirror=mirror),
            np.concatenate([kept, images[below]]),
            seen,
            np.concatenate([points, behind[hidden]]),
            np.concatenate([normals, mirror.direction(normals)[hidden]]),
            np.concatenate([errors, errors[hidden] + [0, 2 * mirror.angle]]),
            len(points),
            reach,
        )

    if not symmetric:
        return iter([side(None)])
    smooth = np.isfinite(found.angles)
    parts = seen[smooth], found.normals[smooth], found.errors[smooth]
    planes = mirrors(view, *parts, noise, float(hand.tips.radii.min()))
    return map(side, planes) if planes else GraspStatus.UNSEEN


def _side(
    space: UnseenSpace, boundary: Reals, seen: Reals, contacts: Reals, normals: Reals, errors: Reals, n_seen: int,
    reach: float,
) -> SeenSide:  # fmt: skip
    """Return a side in a frame of the object, from arrays in that of the camera."""
    middle = seen.mean(0)
    boundary = thinned(boundary[np.linalg.norm(boundary - middle, axis=1) < reach], _STEP)
    axes = np.linalg.svd(seen - middle, full_matrices=False)[2]
    axes[2] *= np.linalg.det(axes)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes.T, middle
    frame = pga3.motor_product(space.camera.pose, pga3.motor_from_matrix(matrix))
    around = (boundary - middle) @ axes.T
    surface = Surface(
        frame,
        (contacts - middle) @ axes.T,
        normals @ axes.T,
        np.full(3, np.inf),
        float(np.linalg.norm(seen - middle, axis=1).max()),
        np.zeros((0, 3)),
        np.zeros((0, 3), np.intp),
        errors,
    )
    clusters = clusters_of(around, 32)
    return SeenSide(surface, n_seen, Body(np.ascontiguousarray(around[::16]), clusters, clusters), space)


def _reach(hand: Hand) -> float:
    """Return how far from its contacts a hand may have parts, at the beginning of its approach."""
    low, high = hand.limits.T
    q = np.random.default_rng(23).uniform(low, high, (_POSTURES, len(low)))
    ends = np.linalg.norm(hand.placed_capsules(q), axis=-1).max()
    return 2 * float(ends + hand.radii.max()) + APPROACH


def _even(points: Reals, normals: Reals) -> Reals:
    """Return the rows of at most `SAMPLES` points, evenly distributed by the areas of the surface in pixels."""
    if len(points) <= SAMPLES:
        return np.arange(len(points))
    cosines = np.abs((points * normals).sum(1)) / np.linalg.norm(points, axis=1)
    reached = np.cumsum(points[:, 2] ** 2 / np.maximum(cosines, TINY))
    steps = (np.arange(SAMPLES) + 0.5) * (reached[-1] / SAMPLES)
    return np.unique(np.minimum(np.searchsorted(reached, steps), len(points) - 1))


def _walls(sights: Reals, known: Reals, middle: Reals, reach: float) -> Reals:
    """Return points (n, 3) between lines of sight that are free up to different depths, also at the border."""
    found = [np.zeros((0, 3))]
    deep = np.pad(known, 1)
    wide = np.pad(sights, ((1, 1), (1, 1), (0, 0)), mode="edge")
    for first, second in (((slice(None, -1), slice(None)), (slice(1, None), slice(None))),
                          ((slice(None), slice(None, -1)), (slice(None), slice(1, None)))):  # fmt: skip
        low, high = np.minimum(deep[first], deep[second]), np.maximum(deep[first], deep[second])
        low, high = np.maximum(low, middle[2] - reach), np.minimum(high, middle[2] + reach)
        at = high - low > _STEP
        ray = np.column_stack([(wide[first][at] + wide[second][at]) / 2, np.ones(int(at.sum()))])
        start, stop = low[at], high[at]
        # Parts of lines of sight that are out of reach have no points.
        nearest = (ray @ middle) / (ray * ray).sum(1)
        off = np.linalg.norm(nearest[:, None] * ray - middle, axis=1)
        half = np.sqrt(np.maximum(reach**2 - off**2, 0)) / np.linalg.norm(ray, axis=1)
        start, stop = np.maximum(start, nearest - half), np.minimum(stop, nearest + half)
        counts = np.maximum(np.ceil((stop - start) / _STEP), 0).astype(int)
        each = np.repeat(np.arange(len(ray)), counts)
        within = np.arange(len(each)) - np.repeat(np.cumsum(counts) - counts, counts)
        found.append(ray[each] * (start[each] + (within + 0.5) * _STEP)[:, None])
    return np.concatenate(found)
