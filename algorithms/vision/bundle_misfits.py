"""What residuals of bundle adjustment say of lenses that are not what they are taken for, and of moving objects."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from generated import pga3

from ..arguments import Reals
from ..evidence import Noise
from ..evidence.misfit import NO_MISFIT, coherence, dominance, misfit_across
from ..precision import HUGE, NEGLIGIBLE, TINY
from .bundle_descent import Information
from .bundle_system import Scene, State

_DENSE = 8
"""A limit on work: tables of points and cameras with fewer places for each observation are dense."""


class BundleMisfit(NamedTuple):
    """What the model of a bundle lacks."""

    refused: bool
    """Whether that explains more of the residuals than it leaves."""
    growth: float
    """The factor by which what neighbours have in common makes the variance larger."""
    cameras: Reals
    """(t, b, 6) Steps of blocks by each term of lenses, none unless these explain more than noise,"""
    points: Reals
    """(t, m, 3) those of points,"""
    spread: Reals
    """(t, t) and what the terms add to the covariance, for these steps."""


def bundle_misfit(
    scene: Scene, state: State, information: Information, weights: Reals, freedom: int, noise: Noise
) -> BundleMisfit:
    """Return what terms of one lens for all cameras explain, and which share of the squares neighbours have in common.

    The neighbour of a pixel is that of the point that is nearest in space, in the same camera. The terms are those that
    move cameras the farthest: the focal length, the centre, and a radial term.
    """
    rest, used = np.asarray(information.equations.rest), np.sqrt(weights)
    if scene.kind:
        # Far pixels of a robust loss are not noise.
        near = weights > 0.5
        rest, used = rest * near[:, None], used * near
        freedom -= 2 * int(np.count_nonzero(~near))
    share = 0.0
    rounding = rest.size * (NEGLIGIBLE * float(np.abs(state.lenses[:, 0]).max())) ** 2
    if (rest**2).sum() > rounding:
        share = max(_common(scene, state, rest), _together(scene, rest, freedom, noise))
    growth = 1 + share * rest.size / max(int(np.count_nonzero(np.bincount(scene.camera))), 1)
    columns = _lens_terms(scene, state, used, rest)
    # Without a robust loss, the derivatives with the residuals vanish.
    moves, found = information.moves(columns if scene.kind else columns[:-1]), NO_MISFIT
    if moves is not None and freedom > 0:
        flat = columns.reshape(len(columns), -1)
        normal, n = flat @ flat.T, len(moves[0])
        slopes, steps = (np.concatenate([each.reshape(n, -1) for each in part], 1) for part in (moves[:2], moves[2:]))
        own = slopes @ steps.T
        normal[:n, :n] += (own + own.T) / 2
        found = misfit_across(normal, freedom, noise, rounding)
    refused = found.contradicts or 2 * share > 1
    if found.more is None or moves is None:
        n, m = information.layout.n_blocks, information.layout.n_points
        return BundleMisfit(refused, growth, np.zeros((0, n, 6)), np.zeros((0, m, 3)), np.zeros((0, 0)))
    blocks, points = (each[: len(columns) - 1] for each in moves[2:])
    for (camera, _), turn in zip(scene.scaled, information.equations.turns, strict=True):
        blocks[:, camera, 3:] = blocks[:, camera, 3:] @ turn.T
    return BundleMisfit(refused, growth, blocks, points, found.more)


def _lens_terms(scene: Scene, state: State, used: Reals, rest: Reals) -> Reals:
    """Return displacements (5, k, 2), of norm 1, by focal length, centre and radial distortion, times factors (k,).

    The last ones are the residuals (k, 2).
    """
    there = np.asarray(pga3.move_point_back(state.motors[scene.camera], state.points[scene.point]))
    x, y, z = np.ascontiguousarray(there.T)
    with np.errstate(all="ignore"):
        if scene.model == "fisheye":
            far = np.hypot(x, y)
            z = np.where(far > 0, far, 1) / np.arctan2(far, z)
        seen = np.stack([x / z, y / z])
        along = np.where(np.isfinite(seen), seen * state.lenses[:, :2].T[:, scene.camera], 0) * used
        radial = along * np.minimum((seen * seen).sum(0), HUGE)
    found = np.zeros((5, len(x), 2))
    found[0], found[1, :, 0], found[2, :, 1], found[4] = along.T, used, used, rest
    found[3] = np.where(np.isfinite(radial), radial, 0).T
    for each in found[:-1].reshape(4, -1):
        each /= max(float(np.sqrt(each @ each)), TINY)
    return found


def _common(scene: Scene, state: State, rest: Reals) -> float:
    """Return the share of squares that neighbours have in common."""
    seen, m = np.flatnonzero(np.bincount(scene.point)), len(state.points)
    if len(seen) < 2:
        return 0.0
    tree = scipy.spatial.cKDTree(state.points[seen], balanced_tree=False, compact_nodes=False)
    nearest = np.full(m, -1)
    nearest[seen] = seen[tree.query(tree.data, 2)[1][:, 1]]
    row = scene.camera * np.int64(m)
    keys, wanted = row + scene.point, row + nearest[scene.point]
    order = np.argsort(keys, kind="stable")
    keys, wanted, rest = keys[order], wanted[order], rest[order]
    at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    there = np.arange(len(keys))
    pairs = (keys[at] == wanted) & (at != there)
    both = np.count_nonzero(pairs & (at[at] == there))
    own, other = rest[pairs].ravel(), rest[at[pairs]].ravel()
    return coherence(float(own @ own), float(own @ other), own.size, 2 * int(both))


def _together(scene: Scene, rest: Reals, freedom: int, noise: Noise) -> float:
    """Return the share of squares of a part of the points that moves together, by its own motion in each camera."""
    n_points, n_cameras = (np.count_nonzero(np.bincount(each)) for each in (scene.point, scene.camera))
    m, c = int(scene.point.max()) + 1, int(scene.camera.max()) + 1
    if m * c <= _DENSE * len(rest):
        at = scene.point * np.int64(c) + scene.camera
        table = np.stack([np.bincount(at, each, m * c) for each in rest.T], 1).reshape(m, 2 * c)
        largest = float(np.linalg.eigvalsh(table.T @ table if m > 2 * c else table @ table.T)[-1])
    else:
        columns = 2 * scene.camera[:, None] + np.arange(2)
        parts = rest.ravel(), (np.repeat(scene.point, 2), columns.ravel())
        values = scipy.sparse.linalg.svds(scipy.sparse.csr_array(parts, (m, 2 * c)), 1, return_singular_vectors=False)
        largest = float(values[0]) ** 2
    squares, shape = float((rest**2).sum()), (int(n_points), 2 * int(n_cameras))
    return dominance(largest, squares, shape, float(noise.raised(squares, freedom)))
