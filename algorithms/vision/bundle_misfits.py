"""What residuals of bundle adjustment say of lenses that are not what they are taken for, and of moving objects."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from generated import pga3

from ..arguments import Reals
from ..evidence import Noise
from ..evidence.misfit import NO_MISFIT, coherence, misfit_across
from ..precision import HUGE, NEGLIGIBLE
from .bundle_descent import Information
from .bundle_system import Scene, State


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
        share = _common(scene, state, rest)
    growth = 1 + share * rest.size / max(len(np.unique(scene.camera)), 1)
    columns = np.concatenate([_lens_terms(scene, state, used), rest[None]])
    # Without a robust loss, the derivatives with the residuals vanish.
    moves, found = [information.moves(each) for each in (columns if scene.kind else columns[:-1])], NO_MISFIT
    steps = [tuple(each) for each in moves if each is not None]
    if steps and len(steps) == len(moves) and freedom > 0:
        if not scene.kind:
            steps.append(tuple(np.zeros_like(each) for each in steps[0]))
        slopes, moved = (np.array([np.append(each[i], each[i + 1]) for each in steps]) for i in (0, 2))
        flat = columns.reshape(len(columns), -1)
        normal = flat @ flat.T + slopes @ moved.T
        found = misfit_across((normal + normal.T) / 2, freedom, noise, rounding)
    refused = found.contradicts or 2 * share > 1
    if found.more is None:
        n, m = information.layout.n_blocks, information.layout.n_points
        return BundleMisfit(refused, growth, np.zeros((0, n, 6)), np.zeros((0, m, 3)), np.zeros((0, 0)))
    blocks, points = (np.array([each[i] for each in steps[:-1]]) for i in (2, 3))
    for (camera, _), turn in zip(scene.scaled, information.equations.turns, strict=True):
        blocks[:, camera, 3:] = blocks[:, camera, 3:] @ turn.T
    return BundleMisfit(refused, growth, blocks, points, found.more)


def _lens_terms(scene: Scene, state: State, used: Reals) -> Reals:
    """Return displacements (4, k, 2), of norm 1, by focal length, centre and radial distortion, times factors (k,)."""
    there = np.asarray(pga3.move_point_back(state.motors[scene.camera], state.points[scene.point]))
    with np.errstate(all="ignore"):
        seen = there[:, :2] / there[:, 2:]
        if scene.model == "fisheye":
            far = np.hypot(there[:, 0], there[:, 1])
            seen = there[:, :2] * (np.arctan2(far, there[:, 2]) / np.where(far > 0, far, 1))[:, None]
        focal = state.lenses[scene.camera, :2]
        along = np.where(np.isfinite(seen), seen * focal, 0) * used[:, None]
        radial = along * np.minimum((seen**2).sum(1), HUGE)[:, None]
    centre = np.zeros((2, *along.shape))
    centre[0, :, 0] = centre[1, :, 1] = used
    found = np.stack([along, *centre, np.where(np.isfinite(radial), radial, 0)])
    norms = np.sqrt(np.einsum("tki,tki->t", found, found))[:, None, None]
    return np.asarray(found / np.where(norms > 0, norms, 1))


def _common(scene: Scene, state: State, rest: Reals) -> float:
    """Return the share of squares that neighbours have in common."""
    seen = np.unique(scene.point)
    if len(seen) < 2:
        return 0.0
    nearest = np.full(len(state.points), -1)
    nearest[seen] = seen[scipy.spatial.cKDTree(state.points[seen]).query(state.points[seen], 2)[1][:, 1]]
    m = len(state.points)
    keys = scene.camera * np.int64(m) + scene.point
    order = np.argsort(keys, kind="stable")
    wanted = scene.camera * np.int64(m) + nearest[scene.point]
    at = order[np.minimum(np.searchsorted(keys, wanted, sorter=order), len(keys) - 1)]
    pairs = (keys[at] == wanted) & (at != np.arange(len(keys)))
    both = np.count_nonzero(pairs & (at[at] == np.arange(len(keys))))
    own, other = rest[pairs], rest[at[pairs]]
    return coherence(float((own**2).sum()), float((own * other).sum()), own.size, 2 * int(both))
