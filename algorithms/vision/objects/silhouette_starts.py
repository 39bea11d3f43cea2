"""Poses to begin with from the silhouette of an object, without an estimate of its pose.

The cone of the lines of sight of a sphere determines its centre. For other models, outlines from directions all around
the object are scaled, turned by their second moments, and compared with the silhouette.
"""

from __future__ import annotations

import numpy as np
import scipy

from generated import pga3

from ...arguments import Reals
from ...geometry.fits import axis_frame
from ..camera import Camera
from .pose_features import ball_of_rays, poses_of_rotations
from .pose_models import ObjectModel
from .pose_record import twist_between
from .predicted_curves import Mesh, predicted_curves
from .silhouettes import Silhouette, hull_area

_DIRECTIONS = 90
"""Number of directions from which outlines are compared."""
_ROUND, _TURNS = 1.35, 12
"""Ratio of the second moments up to which outlines are turned to this number of angles instead of two."""
_PLAIN = 600.0
"""Focal length in pixels of the camera with which outlines are computed."""
_APART = 0.35
"""Starts differ by at least this angle in radians."""


def starts_of_silhouette(model: ObjectModel, silhouette: Silhouette, mesh: Mesh, most: int) -> Reals:
    """Return at most `most` poses (k, 8) whose outlines are similar to a silhouette, the most similar first.

    Parameters
    ----------
    model : ObjectModel
    silhouette : Silhouette
        With at least ten points.
    mesh : (array, (n, 3), array, (m, 3))
        As for `predicted_curves`.
    most : int
    """
    is_ball = len(model.balls) == 1 and not any(map(len, (model.edges, model.tubes, model.points)))
    if is_ball:
        return _ball(model, silhouette)
    return _similar(model, silhouette, mesh, most)


def _ball(model: ObjectModel, silhouette: Silhouette) -> Reals:
    """Return the pose of a sphere from its silhouette."""
    camera = silhouette.camera.pinhole
    place = ball_of_rays(camera.rays(silhouette.pixels), float(model.balls[0, 3]))
    if place is None:
        return np.zeros((0, 8))
    return poses_of_rotations(np.eye(3)[None], (camera.centre + place - model.balls[0, :3])[None])


def _similar(model: ObjectModel, silhouette: Silhouette, mesh: Mesh, most: int) -> Reals:
    camera = silhouette.camera.pinhole
    sights = camera.rays(silhouette.pixels)
    axes = axis_frame(sights.sum(0) / np.linalg.norm(sights.sum(0)))
    seen = _in_plane(axes, sights)
    area, centroid, axis, ratio = _moments(seen)
    if not area > 0:
        return np.zeros((0, 8))
    plain = Camera.from_intrinsics(_PLAIN, (0.0, 0.0))
    tree = scipy.spatial.cKDTree(seen)
    found = []
    for rotation in _rotations():
        depth = _PLAIN * model.size * 1.5 / np.sqrt(area)
        for _ in range(2):
            pose = _placed(rotation, np.array([0, 0, max(depth, 2.5 * model.size)]), model)
            curves = predicted_curves(model, pose, plain, mesh)
            if curves is None:
                break
            outline = curves.pixels[curves.is_outline & curves.is_visible]
            own_area, own_centroid, own_axis, own_ratio = _moments(outline)
            if not own_area > 0:
                break
            depth *= float(np.sqrt(own_area / area))
        else:
            is_round = min(ratio, own_ratio) < _ROUND
            turns = np.arange(_TURNS) * 2 * np.pi / _TURNS if is_round else np.array([0, np.pi])
            for angle in axis - own_axis + turns:
                turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
                there = (outline - own_centroid) @ turn.T * np.sqrt(area / own_area) + centroid
                score = tree.query(there)[0].mean() + scipy.spatial.cKDTree(there).query(seen)[0].mean()
                whole = np.eye(3)
                whole[:2, :2] = turn
                shift = np.array([*(centroid - turn @ own_centroid), _PLAIN]) * depth / _PLAIN
                found.append((score, _placed(whole @ rotation, shift, model)))
    found.sort(key=lambda one: one[0])
    poses: list[Reals] = []
    for _, pose in found:
        if len(poses) < most and all(_apart(pose, other) for other in poses):
            poses.append(pose)
    to_world = poses_of_rotations(axes.T[None], camera.centre[None])
    return np.asarray(pga3.motor_product(to_world, np.array(poses).reshape(-1, 8)))


def _placed(rotation: Reals, centre: Reals, model: ObjectModel) -> Reals:
    """Return the pose with a rotation, at which the centre of the model is at a point."""
    return np.asarray(poses_of_rotations(rotation[None], (centre - rotation @ model.centre)[None])[0])


def _rotations() -> list[Reals]:
    """Return rotations by which directions all around an object point to the camera (a Fibonacci lattice)."""
    k = np.arange(_DIRECTIONS)
    z = 1 - (2 * k + 1) / _DIRECTIONS
    angle = k * np.pi * (3 - np.sqrt(5))
    r = np.sqrt(1 - z * z)
    return [np.asarray(axis_frame(-d)) for d in np.column_stack([r * np.cos(angle), r * np.sin(angle), z])]


def _in_plane(axes: Reals, sights: Reals) -> Reals:
    """Return the pixels of directions (n, 3) in a camera with given axes, as rows, and the focal length of outlines."""
    own = sights @ axes.T
    return np.asarray(_PLAIN * own[:, :2] / own[:, 2:])


def _moments(pixels: Reals) -> tuple[float, Reals, float, float]:
    """Return area, centroid, angle of the longer axis, and ratio of the axes of the convex hull of pixels."""
    area = hull_area(pixels)
    if not area > 0:
        return 0.0, np.zeros(2), 0.0, 1.0
    corners = pixels[scipy.spatial.ConvexHull(pixels).vertices]
    a, b = corners - corners[0], np.roll(corners, -1, 0) - corners[0]
    parts = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    centre = (parts @ (a + b)) / 3 / parts.sum()
    # The second moment of a triangle with one corner at the origin.
    products = np.einsum("n,ni,nj->ij", parts, a, a) + np.einsum("n,ni,nj->ij", parts, b, b)
    mixed = np.einsum("n,ni,nj->ij", parts, a, b)
    second = (2 * products + mixed + mixed.T) / 12 / parts.sum() - np.outer(centre, centre)
    values, vectors = np.linalg.eigh(second)
    ratio = float(np.sqrt(max(values[1], 0) / max(values[0], 1e-12)))
    return area, corners[0] + centre, float(np.arctan2(vectors[1, 1], vectors[0, 1])), ratio


def _apart(a: Reals, b: Reals) -> bool:
    """Return whether the angle of the rotation between two poses is large."""
    return 2 * float(np.linalg.norm(twist_between(a, b, np.inf, np.zeros((0, 6))))) > _APART
