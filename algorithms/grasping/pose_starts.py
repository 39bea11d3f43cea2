"""Initial poses of objects: from points under scaled parallel projection, and rotated copies of a pose."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np

from generated import pga3

from ..arguments import Reals
from .pose_models import KINDS, Measurements, ObjectModel


def _rotations() -> Reals:
    """Return the 24 rotations of a cube as matrices."""
    found = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            matrix = np.eye(3)[list(order)] * np.array(signs)[:, None]
            if np.linalg.det(matrix) > 0:
                found.append(matrix)
    return np.array(found)


_CUBE = _rotations()
_TILT = np.array(
    pga3.motor_to_matrix(pga3.motor_from_rotation_vector_translation(np.array([0.31, 0.22, 0.13]), np.zeros(3)))
)[:3, :3]
"""A rotation that takes directions of a cube out of those of symmetric models, where descents begin at saddles."""


def starts(model: ObjectModel, seen: Measurements) -> Reals:
    """Return initial poses (b, 8): from points if there are four, with their reversal, otherwise 24 rotations."""
    camera = int(np.bincount(np.concatenate([seen.of_camera[kind] for kind in KINDS])).argmax())
    matrix = seen.cameras[camera]
    # The camera frame: the matrix is K [R | t], and R are the axes of the camera, by Gram-Schmidt from the last row.
    axes, k = camera_axes(matrix)
    centre = -axes.T @ np.linalg.solve(k, matrix[:, 3])
    own = seen.of_camera["points"] == camera
    pixels, places = seen.pixels["points"][own], seen.elements["points"][own]
    if len(places) >= 4:
        found = _parallel(places, _normalised(pixels, k))
        whole = np.tile(np.eye(4), (len(found), 1, 1))
        whole[:, :3, :3] = axes.T @ found[:, :, :3]
        whole[:, :3, 3] = found[:, :, 3] @ axes + centre
    else:
        rotations = axes.T @ _CUBE @ _TILT
        whole = np.tile(np.eye(4), (len(rotations), 1, 1))
        whole[:, :3, :3] = rotations
        whole[:, :3, 3] = _place(model, seen, camera) - rotations @ model.centre
    return np.asarray(pga3.motor_from_matrix(whole))


def _place(model: ObjectModel, seen: Measurements, camera: int) -> Reals:
    """Return where an object is: at the depth that its size suggests, or nearest to the lines of sight of all views."""
    sums, right, rough = np.zeros((3, 3)), np.zeros(3), np.zeros(3)
    n_views = 0
    for k, matrix in enumerate(seen.cameras):
        pixels = np.concatenate([seen.pixels[kind][seen.of_camera[kind] == k] for kind in KINDS])
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


def reversals(model: ObjectModel, motor: Reals, matrix: Reals) -> Reals:
    """Return poses (4, 8) at which other minima are likely: turns about principal axes, and the reversal of depth.

    Reversal is the product of the motor and two reflections, in the principal plane of the thinnest direction and in
    the plane orthogonal to the line of sight: under parallel projection it changes no image of a flat object.
    """
    directions = model.axes[0]
    centre = model.centre
    halves = pga3.motor_product(motor, model.half_turns)
    there = pga3.move_point(motor, centre)
    sight = there + np.linalg.solve(matrix[:, :3], matrix[:, 3])
    mirror = np.eye(3) - 2 * np.outer(sight, sight) / (sight @ sight)
    thin = np.eye(3) - 2 * np.outer(directions[2], directions[2])
    whole = np.eye(4)
    whole[:3, :3] = mirror @ pga3.motor_to_matrix(motor)[:3, :3] @ thin
    whole[:3, 3] = there - whole[:3, :3] @ centre
    return np.concatenate([halves, pga3.motor_from_matrix(whole)[None]])


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


def _normalised(pixels: Reals, k: Reals) -> Reals:
    y = (pixels[:, 1] - k[1, 2]) / k[1, 1]
    return np.stack([(pixels[:, 0] - k[0, 2] - k[0, 1] * y) / k[0, 0], y], -1)


def _parallel(places: Reals, seen: Reals) -> Reals:
    """Return [R | t] (2, 3, 4) in the camera frame by scaled parallel projection of points.

    The image of the points is an affine map of rank two. For flat points its component along the thin direction is
    unknown; two rotations complete the others, and both are returned.
    """
    centre, middle = places.mean(0), seen.mean(0)
    about = places - centre
    u, lengths, directions = np.linalg.svd(about, full_matrices=False)
    wide = lengths > 1e-2 * lengths[0]
    affine = (u[:, wide].T @ (seen - middle)) / lengths[wide, None]
    rows = affine.T @ directions[wide]
    left, scales, right = np.linalg.svd(rows, full_matrices=False)
    size = max(float(scales[0]), 1e-300)
    if wide.sum() == 3:
        size = max(float(scales.mean()), 1e-300)
        two = left @ right
        options = [np.vstack([two, cross(two[0], two[1])])]
        thin = directions[2]
    else:
        # The affine map of a plane has singular values s and s cos(tilt): two tilts have the same image.
        thin = np.array(cross(directions[0], directions[1]))
        cosine = min(float(scales[1]) / size, 1.0)
        sine = np.sqrt(1 - cosine * cosine)
        options = []
        for sign in (1, -1):
            short = cosine * right[1] + sign * sine * thin
            two = left @ np.stack([right[0], short])
            options.append(np.vstack([two, cross(two[0], two[1])]))
    if len(options) == 1:
        mirrored = np.diag([1.0, 1.0, -1.0]) @ options[0] @ (np.eye(3) - 2 * np.outer(thin, thin))
        options.append(mirrored)
    place = np.array([*middle, 1.0]) / size
    return np.array([np.column_stack([r, place - r @ centre]) for r in options])
