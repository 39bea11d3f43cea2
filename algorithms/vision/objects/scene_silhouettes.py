"""Points of the world that cameras see as points, edges and silhouettes of an object."""

from __future__ import annotations

import numpy as np

from generated import pga3

from ...arguments import Reals
from ...geometry.fits import axis_frame
from ..camera import Camera
from .pose_models import ObjectModel

_ALONG, _AROUND = 24, 48
"""Numbers of pixels of an edge, or of one side of a cylinder, and of a circle or the silhouette of a sphere."""


def element_pixels(model: ObjectModel, pose: Reals, camera: Camera) -> dict[str, tuple[Reals, Reals]]:
    """Return for each kind of element the indices of elements and points (n, 3) of the world on them."""
    centre = camera.centre
    found = {"points": (np.arange(len(model.points)), _moved(pose, model.points))}
    if len(model.edges):
        ends = _moved(pose, model.edges)
        t = np.linspace(0, 1, _ALONG)[:, None]
        places = ends[:, None, 0] + t * (ends[:, None, 1] - ends[:, None, 0])
        found["edges"] = _numbered(places)
    if len(model.balls):
        balls = [
            _tangent_circle(p, r, centre)
            for p, r in zip(_moved(pose, model.balls[:, :3]), model.balls[:, 3], strict=True)
        ]
        found["balls"] = _numbered(np.array(balls))
    if len(model.tubes):
        ends = _moved(pose, model.tubes[:, :6].reshape(-1, 2, 3))
        sides = [_sides(pair, r, centre) for pair, r in zip(ends, model.tubes[:, 6], strict=True)]
        kept = [k for k, side in enumerate(sides) if side is not None]
        index, places = _numbered(np.array([sides[k] for k in kept]).reshape(len(kept), -1, 3))
        found["tubes"] = (np.array(kept, int)[index], places)
        normals = pga3.move_direction(pose, model.rims[:, 3:6].copy())
        centres = _moved(pose, model.rims[:, :3])
        rims = [_circle(p, n, r) for p, n, r in zip(centres, normals, model.rims[:, 6], strict=True)]
        found["rims"] = _numbered(np.array(rims))
    return found


def _moved(pose: Reals, points: Reals) -> Reals:
    return np.asarray(pga3.move_point(pose, np.ascontiguousarray(points)))


def _numbered(places: Reals) -> tuple[Reals, Reals]:
    return np.repeat(np.arange(len(places)), places.shape[1]), places.reshape(-1, 3)


def _circle(centre: Reals, normal: Reals, radius: float) -> Reals:
    angles = np.linspace(0, 2 * np.pi, _AROUND, endpoint=False)
    return centre + radius * np.column_stack([np.cos(angles), np.sin(angles)]) @ axis_frame(normal)[:2]


def _tangent_circle(place: Reals, radius: float, centre: Reals) -> Reals:
    """Return points of the circle in which the tangents from a camera's centre touch a sphere."""
    to = place - centre
    far = float(np.linalg.norm(to))
    sine = min(radius / far, 1.0)
    return _circle(place - to / far * radius * sine, to / far, radius * np.sqrt(1 - sine * sine))


def _sides(ends: Reals, radius: float, centre: Reals) -> Reals | None:
    """Return points of the two lines in which the tangents touch a cylinder; None if the camera is inside it."""
    axis = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    to = ends[0] - centre
    across = to - (to @ axis) * axis
    far = float(np.linalg.norm(across))
    if far <= radius:
        return None
    near, aside = -across / far, np.cross(axis, across / far)
    cosine, sine = radius / far, np.sqrt(1 - (radius / far) ** 2)
    t = np.linspace(0, 1, _ALONG)[:, None] * (ends[1] - ends[0])
    return np.concatenate([ends[0] + t + radius * (cosine * near + side * sine * aside) for side in (1, -1)])
