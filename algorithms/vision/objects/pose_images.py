"""Elements whose images are too thin to be used: edges seen end-on, and circles seen edge-on."""

from __future__ import annotations

import numpy as np

from generated import object_poses as kernels
from generated import pga3

from ...arguments import Reals
from ..camera import Camera
from .pose_models import Measurements, ObjectModel, with_weights

_SHORT, _THIN = 40.0, 10.0
"""Least length of the image of an edge, and least minor half-axis of that of a circle, in standard deviations.

The line through a shorter image turns so easily that it meets wrong pixels, and the distance from a thinner ellipse is
not given by its first derivative."""


def without_thin_images(model: ObjectModel, motor: Reals, seen: Measurements, noise: float) -> Measurements | None:
    """Return the measurements without those of elements with thin images at a pose; None if there are none.

    All are kept if fewer than six equations would remain.
    """
    weights: dict[str, Reals] = {}
    for kind, extents in (("edges", _lengths), ("rims", _half_axes)):
        if kind not in seen.kinds:
            continue
        least = noise * (_SHORT if kind == "edges" else _THIN)
        wide = np.array([extents(model, motor, camera) for camera in seen.cameras]) >= least
        one = seen.of[kind]
        kept = wide[one.cameras, one.rows]
        if not kept.all():
            weights[kind] = one.weights * kept
    if not weights:
        return None
    found = with_weights(seen, weights)
    return found if found.n_equations >= 6 else None


def with_rims_turned(model: ObjectModel, motor: Reals, seen: Measurements, noise: float) -> Reals:
    """Return poses (b, 8) in which circles with thin images are seen from the other side.

    A descent stops where a circle is seen edge-on, since distances from its image are not smooth there.
    """
    found = [np.zeros((0, 8))]
    for camera, matrix in zip(seen.cameras, seen.matrices, strict=True):
        for row in np.flatnonzero(_half_axes(model, motor, camera) < noise * _THIN):
            centre, axis = model.rims[row, :3].copy(), model.rims[row, 3:6]
            # The reflection in a plane through the axis leaves the circle as it is.
            side = np.linalg.svd(axis[None])[2][1].copy()
            found.append(kernels.reverse_depth(motor, side, centre, matrix)[None])
    return np.concatenate(found)


def _lengths(model: ObjectModel, motor: Reals, camera: Camera) -> Reals:
    """Return the lengths in pixels of the images of edges."""
    with np.errstate(all="ignore"):
        ends = camera.project(pga3.move_point(motor, model.edges))
    return np.asarray(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))


def _half_axes(model: ObjectModel, motor: Reals, camera: Camera) -> Reals:
    """Return the minor half-axes in pixels of the images of circles, to first order."""
    sight = pga3.move_point(motor, model.rims[:, :3].copy()) - camera.centre
    away = np.linalg.norm(sight, axis=1)
    cosines = np.abs((sight * pga3.move_direction(motor, model.rims[:, 3:6].copy())).sum(1)) / away
    focal = np.sqrt(np.abs(camera.intrinsics[0, 0] * camera.intrinsics[1, 1]))
    return np.asarray(focal * model.rims[:, 6] / away * cosines)
