"""Whether another focal length explains the pixels of a pose better, and what that says about the pose."""

from __future__ import annotations

import numpy as np

from generated import camera_poses, focal_poses

from ..arguments import Reals
from ..evidence import Noise, likely
from .pose_refinement import motions_between
from .robust import ALL
from .starts import STEPS


def moved_by_another_focal(pose: Reals, places: Reals, image: Reals, k: Reals, noise: Noise) -> tuple[bool, Reals]:
    """Return whether a pose is that of another camera, and how far another focal length would move it.

    A wrong focal length moves the camera along its axis, and leaves less of the distances than the depth of the points
    suggests. The pose is refused if the best focal length explains more of the squares than it leaves, and if the
    given one is unlikely in relation to it. If it is only unlikely, the pose may be off by the motion between both.

    Parameters
    ----------
    pose : array, (3, 4)
        With the least squares for the given camera.
    places, image : array, (n, 3), (n, 2)
        Points about their centroid, and their pixels.
    k : array, (3, 3)
    noise : Noise

    Returns
    -------
    refused : bool
    shift : array, (2,)
        By the rotation, and by the centre of the camera.
    """
    focal, n, still = float(np.sqrt(abs(k[0, 0] * k[1, 1]))), len(places), np.zeros(2)
    y = (image[:, 1] - k[1, 2]) / k[1, 1]
    x = (image[:, 0] - k[0, 2] - k[0, 1] * y) / k[0, 0]
    seen, own = focal * np.stack([x, y], 1), np.diag([focal, focal, 1.0])
    other, _, _, numbers = focal_poses.descend_camera((own @ pose)[None], places, seen, ALL, STEPS)
    cost, least = float(np.sum(camera_poses.pixel_squares(pose, own, places, seen))), float(np.asarray(numbers)[0, 0])
    if likely(np.array([cost, least]), 2 * n, 2 * n - 7, noise)[0]:
        return False, still
    if cost > 2 * least:
        return True, still
    found = np.asarray(other)[0]
    turned = motions_between(pose, found, 1.0)[:3]
    centres = [-each[:, :3].T @ each[:, 3] for each in (pose, found)]
    return False, np.array([np.linalg.norm(turned), np.linalg.norm(centres[0] - centres[1])])
