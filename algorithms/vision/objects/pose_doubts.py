"""What errors of the cameras and of the model, stated or suspected, say of a pose."""

from __future__ import annotations

from typing import Any

import numpy as np

from generated import object_poses as kernels

from ...arguments import Reals
from ...evidence import Noise
from ...evidence.misfit import NO_MISFIT, SUSPECTED, Misfit, Tested, misfit, misfit_of_all
from ...evidence.noise import USUAL_WEIGHT
from ...precision import SINGLE
from ..plane_adjustment import N_POSE
from .pose_minima import SCALE, PoseTask
from .pose_models import EXACT, with_weights
from .pose_record import PoseEstimate


def doubts(found: PoseEstimate, task: PoseTask, freedom: int) -> list[Misfit]:
    """Return what stated errors, others in common, and a displaced camera explain of the distances in a pose.

    Covariances are those of bivectors whose translations are in sizes of the model.
    """
    seen, noise = task.seen, Noise(task.noise**2, USUAL_WEIGHT)
    kernel: Any = kernels.object_misfits  # mypy takes seconds to find that unpacked arguments fit no overload
    sums, explained = kernel(found.motor, *seen.arguments, task.model.size, SCALE * task.noise, seen.lenses)
    n_terms = len(sums) - N_POSE - 1
    _, cost, by_all, by_one = explained.tolist()
    is_suspected = any(Tested(cost, by_all, by_one, n_terms, freedom - n_terms).exceed(noise))
    if not is_suspected and task.shared == EXACT and len(seen.cameras) == 1:
        return []
    norms = np.sqrt(sums.diagonal())
    for part in (slice(6), slice(8, 11)):
        # What changes nothing is rounding, in relation to what does.
        norms[part] = np.maximum(norms[part], SINGLE * norms[part].max())
    stated = _stated_deviations(task)
    size, parts = N_POSE + int(np.count_nonzero(stated)), []
    if stated.any():
        order = np.array(
            [*range(N_POSE), *(N_POSE + np.flatnonzero(stated)), *(N_POSE + np.flatnonzero(stated == 0)), -1]
        )
        sums, norms = sums[np.ix_(order, order)], norms[order]
        held = range(N_POSE, size)
        # The statement that an error is zero is one more measurement of it.
        sums[held, held] += (task.noise / stated[stated > 0]) ** 2
        norms[held] = np.sqrt(sums[held, held])
        parts.append(_by_stated(sums, norms, len(held), max(task.noise, found.residual)))
    if stated.any() or is_suspected:
        parts.append(misfit(sums, size, freedom, noise, norms=norms))
    if len(seen.cameras) > 1:
        parts += _by_cameras(found, task, freedom, noise, norms)
    return [part if part.more is None else part._replace(more=part.more[:N_POSE, :N_POSE]) for part in parts]


def _stated_deviations(task: PoseTask) -> Reals:
    """Return the deviations (5) of the coefficients of the terms of the kernel."""
    shared = task.shared
    focal = 1 / float(task.seen.lenses[:, 2].mean())
    return np.array([shared.focal * focal, shared.distortion * focal, shared.size, shared.size, shared.size])


def _by_stated(sums: Reals, norms: Reals, n: int, deviation: float) -> Misfit:
    """Return how far errors move a pose that has been stated not to be zero exactly."""
    size = N_POSE + n
    scale = np.where(norms[:size] > 0, norms[:size], 1)
    table, slopes = sums[:size, :size] / np.outer(scale, scale), sums[:size, -1] / scale
    inverse = np.linalg.pinv(table[:N_POSE, :N_POSE], rcond=SINGLE, hermitian=True)
    moves = -inverse @ table[:N_POSE, N_POSE:]
    spread = np.linalg.inv(table[N_POSE:, N_POSE:] + table[N_POSE:, :N_POSE] @ moves)
    coefficients = spread @ (slopes[N_POSE:] + moves.T @ slopes[:N_POSE])
    by = moves / scale[:N_POSE, None]
    return NO_MISFIT._replace(more=by @ (deviation**2 * spread + np.outer(coefficients, coefficients)) @ by.T)


def _by_cameras(found: PoseEstimate, task: PoseTask, freedom: int, noise: Noise, norms: Reals) -> list[Misfit]:
    """Return what a displacement of each camera explains: the distances in its image follow from another pose."""
    seen, parts = task.seen, []
    kernel: Any = kernels.object_misfits
    for k in range(len(seen.cameras)):
        own = {kind: seen.of[kind].weights * (seen.of[kind].cameras == k) for kind in seen.kinds}
        given = with_weights(seen, own).arguments
        parts.append(kernel(found.motor, *given, task.model.size, SCALE * task.noise, seen.lenses)[0])
    poses = np.array([*range(N_POSE), -1])
    tables = np.array(parts)[:, poses[:, None], poses]
    whole, results = tables.sum(0), []
    for table in tables:
        sums = np.block([[whole[:N_POSE, :N_POSE], table[:N_POSE]], [table[:, :N_POSE], table]])
        sums[-1, :N_POSE] = sums[:N_POSE, -1] = whole[:N_POSE, -1]
        sums[-1, -1] = whole[-1, -1]
        every = np.concatenate([norms[:N_POSE], norms[:N_POSE], [np.sqrt(whole[-1, -1])]])
        results.append(misfit_of_all(sums, N_POSE, freedom, noise, SUSPECTED / len(tables), every))
    return results
