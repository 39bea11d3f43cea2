"""Curves that a camera sees of an object at a predicted pose: which are visible, and which are its outline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from ...arguments import Reals
from ..camera import Camera
from .pose_models import KINDS, ObjectModel
from .scene_silhouettes import element_pixels
from .surface_rays import Surfaces, first_hits

Mesh = tuple[Reals, Reals]
"""Vertices (n, 3) and faces (m, 3)."""
_STEP = 0.5
"""Distance in pixels on both sides of a curve at which lines of sight decide whether it is the outline."""
_BESIDE = 0.005
"""The same distance for lines of sight that decide whether a curve is hidden."""
_BEHIND = 0.02
"""A point is hidden by a mesh that is nearer by more than this part of the size of the model."""
NEAR = 1e-3
"""The least depth of a point that a camera sees, in units of length."""
_CURVES = ("edges", "balls", "tubes", "rims")


@dataclass(frozen=True, eq=False)
class PredictedCurves:
    """Points of the curves of a model in one image, without lens distortion."""

    kinds: NDArray[np.intp]
    """(n,) Indices of `KINDS`."""
    elements: NDArray[np.intp]
    """(n,) Rows of the elements of their kind."""
    pixels: Reals
    """(n, 2)"""
    normals: Reals
    """(n, 2) Unit normals, away from the object on its outline."""
    steps: Reals
    """(n,) Distances in pixels from neighbours on the curve."""
    is_outline: NDArray[np.bool_]
    """(n,) Whether the object is seen on one side only."""
    is_visible: NDArray[np.bool_]
    """(n,) Whether no part of the object is in front."""

    def part(self, where: Reals) -> PredictedCurves:
        """Return some of the points."""
        return PredictedCurves(
            self.kinds[where], self.elements[where], self.pixels[where], self.normals[where], self.steps[where],
            self.is_outline[where], self.is_visible[where],
        )  # fmt: skip


def surface_of_model(model: ObjectModel) -> Mesh:
    """Return the convex hull of the ends of edges and of the points, or an empty mesh if these are flat or too few."""
    corners = np.concatenate([model.edges.reshape(-1, 3), model.points])
    try:
        return corners, scipy.spatial.ConvexHull(corners).simplices
    except (scipy.spatial.QhullError, ValueError):
        return np.zeros((0, 3)), np.zeros((0, 3), int)


def predicted_curves(model: ObjectModel, pose: Reals, camera: Camera, mesh: Mesh) -> PredictedCurves | None:
    """Return the curves of a model at a pose; None if it has no curves, or a part of it is not in front of the camera.

    Parameters
    ----------
    model : ObjectModel
    pose : array, (8,)
    camera : Camera
    mesh : (array, (n, 3), array, (m, 3))
        The surface in the frame of the object that hides parts of it, in addition to spheres and cylinders.
    """
    parts = [(kind, *found) for kind, found in element_pixels(model, pose, camera).items() if kind in _CURVES]
    parts = [part for part in parts if len(part[1])]
    if not parts or not all((camera.depth(places) > NEAR).all() for _, _, places in parts):
        return None
    pairs = [_along(camera, *part) for part in parts]
    kinds = np.concatenate([np.full(len(index), KINDS.index(kind)) for kind, index, _ in parts])
    elements = np.concatenate([index for _, index, _ in parts])
    places = np.concatenate([place for _, _, place in parts])
    at, along = (np.concatenate([pair[k] for pair in pairs]) for k in (0, 1))
    steps = np.linalg.norm(along, axis=1)
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.maximum(steps, 1e-12)[:, None]
    surfaces = Surfaces.at(pose, *mesh, model.balls, model.tubes)
    probes = np.concatenate([at + _STEP * normals, at - _STEP * normals])
    hits = np.isfinite(first_hits(camera.centre, camera.rays(probes), surfaces)).reshape(2, -1)
    is_outline = hits[0] != hits[1]
    normals = np.where((is_outline & hits[0])[:, None], -normals, normals)
    beside = np.where(is_outline, -_BESIDE, _BESIDE)[:, None] * normals
    directions = camera.rays(np.concatenate([at + beside, at - np.where(is_outline[:, None], -beside, beside)]))
    is_visible = _visible(model, kinds, elements, places, camera, surfaces, directions, is_outline)
    return PredictedCurves(kinds, elements, at, normals, steps, is_outline, is_visible)


def _along(camera: Camera, kind: str, index: Reals, places: Reals) -> tuple[Reals, Reals]:
    """Return pixels (n, 2) of points of curves and their differences per point along the curve."""
    pixels = camera.project(places)
    n_curves = len(np.unique(index)) * (2 if kind == "tubes" else 1)
    rows = pixels.reshape(n_curves, -1, 2)
    if kind in ("balls", "rims"):
        change: Reals = (np.roll(rows, -1, 1) - np.roll(rows, 1, 1)) / 2
    else:
        change = np.asarray(np.gradient(rows, axis=1))
    return pixels, change.reshape(-1, 2)


def _visible(
    model: ObjectModel, kinds: Reals, elements: Reals, places: Reals, camera: Camera, surfaces: Surfaces,
    directions: Reals, is_outline: Reals,
) -> Reals:  # fmt: skip
    """Return which points are visible: neither behind other parts of the object, nor on the back of their own.

    Lines of sight are slightly beside a curve: on both sides, or on the outline on the side of the object.
    """
    origin = camera.centre
    away = np.linalg.norm(places - origin, axis=1)
    n = len(away)
    visible = np.zeros(n, bool)
    for kind, name in enumerate(KINDS):
        for element in np.unique(elements[kinds == kind]):
            at = np.flatnonzero((kinds == kind) & (elements == element))
            own, tolerance = None, _BEHIND * model.size
            if name == "balls":
                own, tolerance = int(element), float(model.balls[element, 3])
            elif name in ("tubes", "rims"):
                tube = int(element) % len(model.tubes)
                own, tolerance = tube + len(model.balls), float(model.tubes[tube, 6])
            sides = np.stack([at, at + n])
            near = first_hits(origin, directions[sides.ravel()], surfaces, own).reshape(2, -1)
            visible[at] = near.min(0) >= away[at] - tolerance
            if name == "rims":
                visible[at] &= is_outline[at] | _faces_camera(model, int(element), surfaces, origin)
            elif name in ("balls", "tubes"):
                visible[at] &= is_outline[at] | (len(surfaces.faces) + len(model.balls) + len(model.tubes) > 1)
    return visible


def _faces_camera(model: ObjectModel, rim: int, surfaces: Surfaces, origin: Reals) -> bool:
    """Return whether the end of a cylinder with a rim is seen from the front."""
    tube = surfaces.tubes[rim % len(model.tubes)]
    outwards = tube[:3] - tube[3:6] if rim < len(model.tubes) else tube[3:6] - tube[:3]
    centre = tube[:3] if rim < len(model.tubes) else tube[3:6]
    return bool(outwards @ (origin - centre) > 0)
