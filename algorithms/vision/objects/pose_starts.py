"""Initial poses of objects: from points under scaled parallel projection, from silhouettes, and rotations of a cube."""

from __future__ import annotations

from itertools import combinations, permutations, product

import numpy as np

from generated import object_poses as kernels
from generated import pga3

from ...arguments import Reals
from ...vision.pose_starts import FEW
from ..pose_starts import three_points
from .pose_features import Features, features, places_of_rotations
from .pose_models import KINDS, Measurements, ObjectModel

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


def quick_starts(seen: Measurements) -> Reals | None:
    """Return two initial poses (2, 8) from the points of a camera, or None if no camera sees four of them."""
    places, pixels, cameras, *_ = seen.of["points"]
    if len(places) < 4:
        return None
    camera = 0
    if len(seen.cameras) > 1:
        camera = int(np.bincount(cameras).argmax())
        own = cameras == camera
        places, pixels = places[own], pixels[own]
        if len(places) < 4:
            return None
    return np.array(kernels.parallel_poses(seen.cameras[camera], places, pixels))


def thorough_starts(model: ObjectModel, seen: Measurements) -> Reals:
    """Return initial poses (b, 8) with rotations that silhouettes suggest, and those of a cube.

    The translation of each follows from the rotation by linear equations. If a camera sees three to seven points, the
    poses that fit three of them exactly are added.
    """
    found = features(model, seen)
    camera = int(np.bincount(np.concatenate([seen.of[kind].cameras for kind in KINDS])).argmax())
    axes, _ = camera_axes(seen.cameras[camera])
    rotations = np.concatenate([*_suggested(found), axes.T @ _CUBE])
    places = places_of_rotations(rotations, found.constraints)
    if places is None:
        places = _place(model, seen, camera) - rotations @ model.centre
    whole = np.tile(np.eye(4), (len(rotations), 1, 1))
    whole[:, :3, :3], whole[:, :3, 3] = rotations, places
    return np.concatenate([*_of_triples(seen), pga3.motor_from_matrix(whole)])


def _of_triples(seen: Measurements) -> list[Reals]:
    """Return for each camera that sees a few points the poses (b, 8) that fit three of them exactly."""
    groups = []
    for k, matrix in enumerate(seen.cameras):
        own = seen.of["points"].cameras == k
        if not 3 <= int(own.sum()) <= FEW:
            continue
        places = seen.of["points"].elements[own]
        axes, calibration = camera_axes(matrix)
        back = np.linalg.inv(calibration)
        pixels = np.column_stack([seen.of["points"].pixels[own], np.ones(len(places))]) @ back.T
        triples = np.array(list(combinations(range(len(places)), 3)))
        with np.errstate(all="ignore"):
            found = three_points(places[triples], pixels[triples, :2] / pixels[triples, 2:]).reshape(-1, 3, 4)
        found = found[np.isfinite(found).all((1, 2))]
        whole = np.tile(np.eye(4), (len(found), 1, 1))
        whole[:, :3, :3] = axes.T @ found[:, :, :3]
        whole[:, :3, 3] = (found[:, :, 3] - back @ matrix[:, 3]) @ axes
        groups.append(np.asarray(pga3.motor_from_matrix(whole)))
    return groups


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
    first, last = _frame(ours), _frame(theirs)
    cosines, sines = np.cos(_AROUND), np.sin(_AROUND)
    turns = np.zeros((_TURNS, 3, 3))
    turns[:, 0, 0] = turns[:, 1, 1] = cosines
    turns[:, 1, 0], turns[:, 0, 1], turns[:, 2, 2] = sines, -sines, 1
    return np.asarray(last.T @ turns @ first)


def _frame(z: Reals) -> Reals:
    """Return orthonormal axes as rows, the last of which is given."""
    x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
    x = x / np.linalg.norm(x)
    return np.array([x, np.cross(z, x), z])


def _place(model: ObjectModel, seen: Measurements, camera: int) -> Reals:
    """Return where an object is: at the depth that its size suggests, or nearest to the lines of sight of all views."""
    sums, right, rough = np.zeros((3, 3)), np.zeros(3), np.zeros(3)
    n_views = 0
    for k, matrix in enumerate(seen.cameras):
        pixels = np.concatenate([seen.of[kind].pixels[seen.of[kind].cameras == k] for kind in KINDS])
        if not len(pixels):
            continue
        back = np.linalg.inv(matrix[:, :3])
        middle = pixels.mean(0)
        direction, centre = back @ np.array([*middle, 1.0]), -back @ matrix[:, 3]
        if k == camera:
            off = (pixels - middle) @ back[:, :2].T
            spread = max(float(np.sqrt(np.square(off).sum(1).mean())), 1e-9)
            rough = centre + direction * model.size / spread
        across = np.eye(3) - np.outer(direction, direction) / (direction @ direction)
        sums, right, n_views = sums + across, right + across @ centre, n_views + 1
    if n_views < 2 or np.linalg.eigvalsh(sums)[0] < 1e-3:
        return rough
    return np.asarray(np.linalg.solve(sums, right))


def reversals(model: ObjectModel, motor: Reals, seen: Measurements) -> Reals:
    """Return poses (b, 8) at which other minima are likely: the reversal of depth, and turns about principal axes.

    Edges, cylinders and spheres may coincide with themselves after a half turn, and few points determine a pose badly.
    """
    back = kernels.reverse_depth(motor, model.axes[0][2], model.centre, seen.cameras[0])[None]
    if len(seen.of["points"].pixels) >= _ENOUGH:
        return np.asarray(back)
    return np.concatenate([back, pga3.motor_product(motor, model.half_turns)])


def cross(a: Reals, b: Reals) -> list[float]:
    """Return the cross product of two vectors; numpy's takes ten times as long for a single pair."""
    (x, y, z), (u, v, w) = a.tolist(), b.tolist()
    return [y * w - z * v, z * u - x * w, x * v - y * u]


def camera_axes(matrix: Reals) -> tuple[Reals, Reals]:
    """Return the axes of a camera as rows, and its upper triangular matrix."""
    first, second, third = matrix[:, :3]
    y = second - (second @ third) * third
    fy = np.sqrt(y @ y)
    y = y / fy
    x = np.array(cross(y, third))
    k = np.array([[first @ x, first @ y, first @ third], [0, fy, second @ third], [0, 0, 1.0]])
    return np.array([x, y, third]), k
