"""Poses of one model of spheres on another from all rotations, by soft assignments of many poses at once."""

from __future__ import annotations

import numpy as np

from generated import pga3
from generated import registration as kernels

from ..arguments import Reals
from ..precision import TINY
from ..registration.hypotheses import rotation_grid
from ..registration.weighted_matches import form_about_means
from .sphere_maps import Map

_ROTATIONS = 288
"""A limit on work: rotations that are tried. None is farther from one of them than 40 degrees, from where matching
finds its way."""
_BALLS = 96
"""A limit on work: the largest balls of each model that are compared."""
_ROUNDS = ((0.06, 288), (0.04, 96), (0.025, 48), (0.016, 24), (0.01, 24))
"""A limit on work: the temperature of each round, in squares of the size of the models, and the poses left for it."""
OUTLIER = float(np.exp(-4.5))
"""Affinity of an outlier: that of a pair three standard deviations apart."""
_RADII = 8.0
"""From a probability: the factor of squared relative differences of radii that have a standard deviation of a
quarter."""
_CHOSEN, _APART = 4, np.cos(np.radians(30.0) / 2)
"""Limits on work: poses that are returned, and the cosine of half the angle between their rotations at least."""


def likely_poses(first: Reals, second: Reals) -> list[Map]:
    """Return the poses that assign most balls to each other, best first, for models of size 1 about the origin."""
    one, two = (balls[np.argsort(-balls[:, 3], kind="stable")[:_BALLS]] for balls in (first, second))
    x, y = np.ascontiguousarray(one[:, :3]), np.ascontiguousarray(two[:, :3])
    between = (one[:, None, 3] - two[:, 3]) / np.maximum(one[:, None, 3] + two[:, 3], TINY)
    alike = np.exp(-_RADII * between**2)
    zero = np.zeros(3)
    motors = np.asarray(kernels.motor_of_rotor(rotation_grid(_ROTATIONS), zero, zero))
    scores = np.zeros(len(motors))
    for temperature, most in _ROUNDS:
        motors = motors[np.argsort(-scores, kind="stable")[:most]]
        moved = np.asarray(pga3.move_point(motors[:, None], x))
        square = (moved**2).sum(-1)[..., None] + (y**2).sum(-1) - 2 * moved @ y.T
        share = alike * np.exp(-square / (2 * temperature))
        share /= share.sum(1, keepdims=True) + OUTLIER
        share /= share.sum(2, keepdims=True) + OUTLIER
        matched = share.sum(2)
        scores = matched.sum(1)
        target = share @ y / np.maximum(matched, TINY)[..., None]
        form, from_here, to_here = form_about_means(x, target, matched)
        motors = np.asarray(kernels.motor_of_rotor(np.linalg.eigh(form)[1][:, :, 0], from_here, to_here))
    chosen: list[int] = []
    for row in np.argsort(-scores, kind="stable"):
        if len(chosen) < _CHOSEN and (np.abs(motors[chosen, :4] @ motors[row, :4]) < _APART).all():
            chosen.append(int(row))
    return [lambda p, motor=motors[row]: np.asarray(pga3.move_point(motor, p)) for row in chosen]  # type: ignore[misc]
