"""Initial poses of objects: from points as in `localize`, from silhouettes, and rotations of a cube."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np

from generated import linear_views, pga3
from generated import object_poses as kernels

from ...arguments import Reals
from ...evidence import all_or_some_sets
from ...geometry.fits import axis_frame
from ...precision import NEGLIGIBLE
from ..camera import Camera
from ..pose_refinement import camera_motors
from ..pose_starts import FEW, three_points
from ..starts import SETS
from .pose_features import Features, features, on_line, places_of_rotations, poses_of_rotations
from .pose_models import KINDS, Measurements, ObjectModel, fullest_camera, points_of_camera

_ENOUGH = 6
"""Number of measured points from which turned poses are no likely minima."""
_TURNS = 12
"""Number of rotations about a known direction."""
_AXES = 3
"""Largest number of cylinders whose directions are used."""


def _rotations() -> Reals:
    """Return the 24 rotations of a cube as matrices."""
    found = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            matrix = np.eye(3)[list(order)] * np.array(signs)[:, None]
            if np.linalg.det(matrix) > 0:
                found.append(matrix)
    return np.array(found)


_TILT = np.array(
    pga3.motor_to_matrix(pga3.motor_from_rotation_vector_translation(np.array([0.31, 0.22, 0.13]), np.zeros(3)))
)[:3, :3]
"""A rotation that takes directions of a cube out of those of symmetric models, where descents begin at saddles."""
_CUBE = _rotations() @ _TILT
_AROUND = 2 * np.pi / _TURNS * np.arange(_TURNS)
"""Angles about an axis."""


def quick_starts(seen: Measurements) -> Reals | None:
    """Return initial poses (b, 8) from the points of a camera, or None if no camera sees four of them."""
    k = fullest_camera(seen, ("points",))
    places, pixels = points_of_camera(seen, k)
    return _of_points(seen.cameras[k], places, pixels) if len(places) >= 4 else None


def thorough_starts(model: ObjectModel, seen: Measurements) -> Reals:
    """Return initial poses (b, 8) with rotations that silhouettes suggest, and those of a cube.

    The translation of each follows from the rotation by linear equations. Those from three to seven points that a
    camera sees are added.
    """
    found = features(model, seen)
    camera = seen.cameras[fullest_camera(seen, KINDS)]
    rotations = np.concatenate([*_suggested(found), pga3.motor_to_matrix(camera.pose)[:3, :3] @ _CUBE])
    shifts = places_of_rotations(rotations, found.constraints)
    if shifts is None:
        shifts = _placed(model, seen, rotations)
    points = [(camera, *points_of_camera(seen, k)) for k, camera in enumerate(seen.cameras)]
    few = [_of_points(*one) for one in points if 3 <= len(one[1]) <= FEW]
    return np.concatenate([*few, poses_of_rotations(rotations, shifts)])


def _of_points(camera: Camera, places: Reals, pixels: Reals) -> Reals:
    """Return poses (b, 8) by linear equations for the points that a camera sees, and of few points by all triples."""
    middle = places.sum(0) / len(places)
    centred = places - middle
    found = np.asarray(linear_views.starts_of_pose(centred, pixels, camera.intrinsics))
    if len(places) <= FEW:
        triples, sights = all_or_some_sets(len(places), 3, SETS), camera.directions(pixels)
        fits = three_points(centred[triples], (sights[:, :2] / sights[:, 2:])[triples])
        found = np.concatenate([found, fits.reshape(-1, 3, 4)])
    # Missing ones are zeros or NaN.
    return pose_seen_by(camera, camera_motors(found[found[:, 2, 3] > 0], middle))


def pose_seen_by(camera: Camera, motors: Reals) -> Reals:
    """Return poses (..., 8) of an object from those of a camera in its frame."""
    return np.asarray(pga3.motor_product(camera.pose, pga3.motor_inverse(motors)))


def _suggested(found: Features) -> list[Reals]:
    """Return rotations (b, 3, 3) from the centres of spheres, the axes of cylinders, or the normals of circles."""
    groups = []
    if found.centres:
        ours, theirs = (np.array(part) for part in zip(*found.centres, strict=True))
        groups.append(_between_points(ours, theirs))
    pairs = [(ours, sign * theirs) for ours, theirs in found.axes[:_AXES] for sign in (1, -1)]
    if not pairs:
        pairs = [(ours, sign * one) for ours, two in found.circles[:_AXES] for one in two for sign in (1, -1)]
    groups += [_about(ours, theirs) for ours, theirs in pairs]
    return groups


def _between_points(ours: Reals, theirs: Reals) -> Reals:
    """Return rotations between corresponding points: one, or for points on a line, several about it."""
    ours, theirs = ours - ours.mean(0), theirs - theirs.mean(0)
    left, sizes, right = np.linalg.svd(theirs.T @ ours)
    if sizes[1] > 1e-3 * sizes[0] > 0:
        left[:, 2] *= np.linalg.det(left @ right)
        return np.asarray(left @ right)[None]
    return _about(right[0], left[:, 0]) if sizes[0] > 0 else np.zeros((0, 3, 3))


def _about(ours: Reals, theirs: Reals) -> Reals:
    """Return rotations (b, 3, 3) that take a unit vector to another, at equal angles about it."""
    first, last = axis_frame(ours), axis_frame(theirs)
    cosines, sines = np.cos(_AROUND), np.sin(_AROUND)
    turns = np.zeros((_TURNS, 3, 3))
    turns[:, 0, 0] = turns[:, 1, 1] = cosines
    turns[:, 1, 0], turns[:, 0, 1], turns[:, 2, 2] = sines, -sines, 1
    return np.asarray(last.T @ turns @ first)


def _placed(model: ObjectModel, seen: Measurements, rotations: Reals) -> Reals:
    """Return translations (b, 3): near the lines of sight of all views, or at the depth that the size suggests."""
    sights, deepest = [], 0.0
    for k, camera in enumerate(seen.cameras):
        pixels = np.concatenate([seen.of[kind].pixels[seen.of[kind].cameras == k] for kind in KINDS])
        if len(pixels):
            rays = camera.rays(pixels)
            ray = rays.mean(0)
            sights.append(on_line(ray, model.centre, camera.centre))
            away = model.size / max(float(np.sqrt(np.square(rays - ray).sum(1).mean())), NEGLIGIBLE)
            if len(pixels) > deepest:
                deepest, rough = len(pixels), camera.centre + away * ray
    places = places_of_rotations(rotations, sights)
    return rough - rotations @ model.centre if places is None else places


def reversals(model: ObjectModel, motor: Reals, seen: Measurements) -> Reals:
    """Return poses (b, 8) at which other minima are likely: the reversal of depth, and turns about principal axes.

    Edges, cylinders and spheres may coincide with themselves after a half turn, and few points determine a pose badly.
    """
    back = kernels.reverse_depth(motor, model.axes[0][2], model.centre, seen.matrices[0])[None]
    if len(seen.of["points"].pixels) >= _ENOUGH:
        return np.asarray(back)
    return np.concatenate([back, pga3.motor_product(motor, model.half_turns)])
