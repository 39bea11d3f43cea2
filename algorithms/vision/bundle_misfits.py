"""What residuals of bundle adjustment say of lenses that are not what they are taken for, and of moving objects."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from generated import bundles, pga3

from ..arguments import Reals
from ..evidence import Noise
from ..evidence.misfit import NO_MISFIT, coherence, dominance, misfit_across
from ..precision import HUGE, NEGLIGIBLE, TINY
from .bundle_descent import Information
from .bundle_scene import Scene, State

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
    items: list[Reals]
    """those of points (t, m, 3), and of lines (t, l, 4) if there are any,"""
    spread: Reals
    """(t, t) and what the terms add to the covariance, for these steps."""


def bundle_misfit(
    scene: Scene, state: State, information: Information, weights: Reals, freedom: int, of_points: int, noise: Noise
) -> BundleMisfit:
    """Return what terms of one lens for all cameras explain, and which share of the squares neighbours have in common.

    The neighbour of a pixel is that of the point that is nearest in space, in the same camera. The terms are those that
    move cameras the farthest: the focal length, the centre, and a radial term. `weights` (k + kl,) are those of points
    and lines; without lines, there are `of_points` degrees of freedom.
    """
    rests, used = [np.asarray(each.rest) for each in information.equations.sums], np.sqrt(weights)
    if scene.kind:
        # Far pixels of a robust loss are not noise.
        near = weights > 0.5
        used = used * near
        rests = [rest * each[:, None] for rest, each in zip(rests, np.split(near, [len(scene.point)]), strict=False)]
        freedom -= 2 * int(np.count_nonzero(~near))
        of_points -= 2 * int(np.count_nonzero(~near[: len(scene.point)]))
    share, rest = 0.0, rests[0]
    rounding = 2 * len(weights) * (NEGLIGIBLE * float(np.abs(state.lenses[:, 0]).max())) ** 2
    if (rest**2).sum() > rounding and of_points > 0:
        share = max(_common(scene, state, rest), _together(scene, rest, of_points, noise))
    growth = 1 + share * rest.size / max(int(np.count_nonzero(np.bincount(scene.camera))), 1)
    columns = _lens_terms(scene, state, used, rests)
    # Without a robust loss, the derivatives with the residuals vanish.
    found = NO_MISFIT
    moves = information.moves([each if scene.kind else each[:-1] for each in columns])
    if moves is not None and freedom > 0:
        flat = np.concatenate([each.reshape(len(each), -1) for each in columns], 1)
        normal, n = flat @ flat.T, len(moves.blocks)
        slopes, steps = (
            np.concatenate([each.reshape(n, -1) for each in part], 1)
            for part in ([moves.slopes, *moves.of_items], [moves.blocks, *moves.items])
        )
        own = slopes @ steps.T
        normal[:n, :n] += (own + own.T) / 2
        found = misfit_across(normal, freedom, noise, rounding)
    refused = found.contradicts or 2 * share > 1
    if found.more is None or moves is None:
        return BundleMisfit(refused, growth, np.zeros((0, information.layout.n_blocks, 6)), [], np.zeros((0, 0)))
    blocks, *items = (each[: len(columns[0]) - 1] for each in (moves.blocks, *moves.items))
    for (camera, _), turn in zip(scene.scaled, information.equations.turns, strict=True):
        blocks[:, camera, 3:] = blocks[:, camera, 3:] @ turn.T
    return BundleMisfit(refused, growth, blocks, items, found.more)


def _lens_terms(scene: Scene, state: State, used: Reals, rests: list[Reals]) -> list[Reals]:
    """Return what the focal length, the centre and a radial distortion displace, times factors (k + kl,).

    These are offsets of points (5, k, 2), and of pixels from lines (5, kl, 2) if there are any. The first four are of
    norm 1 together, the last ones are the residuals.
    """
    there = np.asarray(pga3.move_point_back(state.motors[scene.camera], state.points[scene.point]))
    x, y, z = np.ascontiguousarray(there.T)
    with np.errstate(all="ignore"):
        if scene.model == "fisheye":
            far = np.hypot(x, y)
            z = np.where(far > 0, far, 1) / np.arctan2(far, z)
        seen = np.stack([x / z, y / z], 1)
    found = [_displacements(seen, state.lenses[scene.camera])]
    if len(rests) > 1:
        motors, ends, lenses, pixels = scene.of_lines(state)
        first, second = (np.asarray(bundles.place_in_camera(motors, ends[:, k])) for k in range(2))
        normalised = (pixels - lenses[:, None, 2:4]) / lenses[:, None, :2]
        offsets = np.asarray(bundles.line_offsets(first, second, lenses, pixels))
        moved = pixels + _displacements(normalised, lenses[:, None])
        # What displaces an image by as much as its pixels leaves them where they are.
        found.append(offsets - np.asarray(bundles.line_offsets(first, second, lenses, moved)))
    factors = np.split(used[:, None], [len(scene.point)])
    terms = [np.where(np.isfinite(each), each, 0) * factor for each, factor in zip(found, factors, strict=False)]
    norms = np.sqrt(sum((each**2).sum((1, 2)) for each in terms))[:, None, None]
    return [
        np.concatenate([each / np.maximum(norms, TINY), rest[None]]) for each, rest in zip(terms, rests, strict=True)
    ]


def _displacements(seen: Reals, lenses: Reals) -> Reals:
    """Return displacements (4, ..., 2) of normalised pixels by these terms, for lenses (..., q)."""
    along = seen * lenses[..., :2]
    one, two = np.broadcast_to([1.0, 0.0], seen.shape), np.broadcast_to([0.0, 1.0], seen.shape)
    with np.errstate(all="ignore"):
        radial = along * np.minimum((seen * seen).sum(-1, keepdims=True), HUGE)
    return np.stack([along, one, two, radial])


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
