"""Planes of symmetry that one depth image determines, and what they say of the hidden side of an object.

The mirror image of an object is where no line of sight shows that nothing is. This bounds where the plane may be.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from ..arguments import Reals
from ..evidence import WRONG, certain_deviations, largest_ratio
from ..geometry.meshes import Flags
from ..vision.camera import Camera

_PLACES = 400
"""Limit on work: the number of points whose mirror images are tested."""
_OFFSETS = 160
"""Limit on work: the number of offsets of a plane that are tried."""
_LEAST_SHARE = 0.05
"""Limit on work: the least part of what is seen that a face covers, if its normal is tried."""
_SAME = np.cos(np.radians(4))
"""A limit on work: normals within this angle may belong to one face, and planes of such normals are one."""


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A depth image in the frame of its camera, and which lines of sight end at the object."""

    camera: Camera
    """At the origin."""
    depth: Reals
    """(h, w) To where lines of sight are free; the least one of neighbouring pixels."""
    shadow: Flags
    """(h, w) Pixels of the object and their neighbours."""

    @classmethod
    def of(cls, camera: Camera, known: Reals, own: Flags) -> View:
        """Return the image of a camera whose depths are known, or zero."""
        here = replace(camera, pose=np.eye(8)[0])
        return cls(here, scipy.ndimage.minimum_filter(known, 3), np.asarray(scipy.ndimage.maximum_filter(own, 3)))

    def free(self, points: Reals, margin: float = 0.0) -> tuple[Flags, Flags]:
        """Return which points (n, 3) are seen to be free, and which are hidden by the object or part of it."""
        found, hidden = np.zeros((2, len(points)), bool)
        ahead = np.flatnonzero(points[:, 2] > 0)
        with np.errstate(all="ignore"):
            pixels = np.rint(self.camera.project(points[ahead]))
        inside = ((pixels >= 0) & (pixels < self.depth.shape[::-1])).all(1)
        ahead, (column, row) = ahead[inside], pixels[inside].astype(int).T
        found[ahead] = points[ahead, 2] < self.depth[row, column] - margin
        hidden[ahead] = self.shadow[row, column]
        return found, hidden & ~found


@dataclass(frozen=True, slots=True, eq=False)
class Mirror:
    """A plane of symmetry in the frame of the camera, and between which offsets it is."""

    normal: Reals
    """(3,) A unit vector away from the camera."""
    low: float
    high: float
    angle: float
    """A bound of the error of the normal, in radians."""

    @property
    def width(self) -> float:
        """How far the mirror image may be nearer along the normal than that by the largest offset."""
        return 2 * (self.high - self.low)

    def image(self, points: Reals, offset: float) -> Reals:
        """Return the mirror images of points (n, 3) by a plane with an offset."""
        return points - 2 * (points @ self.normal - offset)[:, None] * self.normal

    def direction(self, directions: Reals) -> Reals:
        """Return the mirror images of directions (n, 3)."""
        return self.image(directions, 0.0)

    def frees(self, view: View, points: Reals) -> Flags:
        """Return which points (n, 3) that the object hides are free, as their mirror images are seen to be free."""
        _, hidden = view.free(points)
        return hidden & view.free(self.image(points, self.low))[0] & view.free(self.image(points, self.high))[0]


def mirrors(view: View, points: Reals, normals: Reals, errors: Reals, noise: float, most: float) -> list[Mirror]:
    """Return planes of symmetry that a depth image determines up to some uncertainty, the most certain first.

    Normals are those of flat faces, and the common directions of two of these.

    Parameters
    ----------
    view : View
    points, normals : array, (k, 3)
        Those of the object with tangent planes.
    errors : array, (k,)
        Bounds of the errors of the points along their normals.
    noise : float
    most : float
        The largest width.
    """
    faces = _faces(points, normals, noise)
    candidates = [*faces]
    for k, (a, by) in enumerate(faces):
        for b, too in faces[:k]:
            c = np.cross(a, b)
            sine = float(np.linalg.norm(c))
            if sine > 0.5:
                candidates.append((c / sine, (by + too) / sine))
    rows = np.arange(0, len(points), max(1, len(points) // _PLACES))
    margin = certain_deviations(WRONG / len(rows)) * noise
    found = list[Mirror]()
    for axis, angle in candidates:
        normal = axis if axis[2] > 0 else -axis
        along = points @ normal
        low, high = float(along.min()), float(along.max())
        own = np.append(rows, [along.argmin(), along.argmax()])
        places, across = points[own], errors[own, None] * normals[own]
        offsets = np.linspace(low, high, _OFFSETS)
        one = Mirror(normal, low, high, angle)
        seen_free = np.ones((_OFFSETS, len(own)), bool)
        for shifted in (places, places + across, places - across):
            images = np.concatenate([one.image(shifted, c) for c in offsets])
            seen_free &= view.free(images, margin)[0].reshape(_OFFSETS, -1)
        fits = offsets[~seen_free.any(1)]
        step = float(offsets[1] - offsets[0])
        if len(fits) and fits[0] > offsets[0] and fits[-1] < offsets[-1]:
            found.append(Mirror(normal, float(fits[0]) - step, float(fits[-1]) + step, angle))
    kept = list[Mirror]()
    for one in sorted(found, key=lambda one: one.width):
        if one.width <= most and all(abs(one.normal @ other.normal) < _SAME for other in kept):
            kept.append(one)
    return kept


def _faces(points: Reals, normals: Reals, noise: float) -> list[tuple[Reals, float]]:
    """Return the normals of flat faces, with bounds of their errors."""
    left, found = np.ones(len(points), bool), list[tuple[Reals, float]]()
    few = normals[:: max(1, len(normals) // _PLACES)]
    votes = (few @ few.T > _SAME).sum(1)
    while left.any():
        best = few[int(votes.argmax())]
        own = left & (normals @ best > _SAME)
        if not votes.max() > 0 or own.sum() < _LEAST_SHARE * len(points):
            return found
        off = points[own] - points[own].mean(0)
        _, sizes, axes = np.linalg.svd(off, full_matrices=False)
        # A curved surface is farther from its plane than the noise explains.
        freedom = int(own.sum()) - 3
        if freedom > 0 and sizes[2] ** 2 < noise * noise * freedom * largest_ratio(freedom):
            found.append((axes[2], certain_deviations(WRONG) * noise / float(sizes[1])))
        left &= ~own
        votes = np.where(few @ best > _SAME, 0, votes)
    return found
