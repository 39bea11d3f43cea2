"""Detection of wrong poses or motions in hand-eye calibration.

Two motions with ``A X = X B`` are screws of the same angle and pitch for any X. Items that violate this more than the
others are suspected at little cost. If there are any, the solution with which most items agree is sought among the
solutions for small samples (least median of squares: Rousseeuw and Leroy, *Robust Regression and Outlier Detection*,
1987).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import scipy
from numpy.typing import NDArray

from ..arguments import Reals
from ..evidence import WRONG, Freedom, all_or_some_sets, log_false_alarms, share_of, unrelated
from ..evidence.sampling import without_copies
from ..evidence.status import RARE
from ..precision import CONVERGED, TINY
from .starts import ROUNDS

Flags = NDArray[np.bool_]
Indices = NDArray[np.intp]

_SUSPECTED = 3.0
"""A pose is suspected if it contradicts the others by more than this multiple of the usual contradiction."""
_SUSPECTED_MOTION = 10.0
"""The same for motions; a single number, whose noise depends on the angle, varies more than a median of many."""
_FEWEST = 5
"""From a probability: with fewer poses, too few would be left to agree."""
_SAMPLES = 400
"""Maximum number of samples: if a third of the poses is wrong, about a hundred samples contain none of these."""


def copies(one: Reals, two: Reals) -> Iterator[tuple[int, Indices, Indices]]:
    """Yield the problems with exact copies of pairs of poses (p, n, 8), whose signs are irrelevant.

    The other two values are those of `without_copies`.
    """
    one, two = _of_one_sign(one), _of_one_sign(two)
    in_order = np.sort(one[..., 0], axis=1)
    for p in np.flatnonzero((in_order[:, 1:] == in_order[:, :-1]).any(1)):
        kept, again = without_copies(one[p], two[p])
        if len(kept) < one.shape[1]:
            yield int(p), kept, again


def _of_one_sign(motors: Reals) -> Reals:
    """Return motors (..., 8) with the sign that makes the largest coefficient of the rotation positive."""
    largest = np.abs(motors[..., :4]).argmax(-1, keepdims=True)
    return np.asarray(motors * np.copysign(1.0, np.take_along_axis(motors, largest, -1)))


def suspect_poses(misfits: Reals, n_poses: int) -> Flags:
    """Return which problems (p,) have poses that contradict the others.

    Parameters
    ----------
    misfits : array, (p, n (n - 1) / 2, 2)
        Differences of the screws of the motions between two poses, for all pairs in the order of `numpy.triu_indices`.
    n_poses : int
        With fewer than five poses none is suspected, because too few would be left to agree.
    """
    if n_poses < _FEWEST:
        return np.zeros(len(misfits), np.bool_)
    i, j = np.triu_indices(n_poses, 1)
    size = np.full((len(misfits), n_poses, n_poses, 2), np.inf)
    size[:, i, j] = size[:, j, i] = np.abs(misfits)
    # A correct pose agrees with most others, so the lower median over its partners is noise.
    middle = (n_poses - 2) // 2
    return _beyond(np.partition(size, middle, axis=2)[:, :, middle], _SUSPECTED)


def suspect_motions(misfits: Reals) -> Flags:
    """Return which problems (p,) have motions that contradict the others, for misfits (p, n, 2) of at least five."""
    if misfits.shape[1] < _FEWEST:
        return np.zeros(len(misfits), np.bool_)
    return _beyond(np.abs(misfits), _SUSPECTED_MOTION)


def _beyond(size: Reals, times: float) -> Flags:
    middle = size.shape[1] // 2
    usual = np.partition(size, middle, axis=1)[:, middle]
    found = np.asarray((size.max(1) > times * usual + CONVERGED).any(1))
    if np.count_nonzero(found):
        found &= np.isfinite(size).all((1, 2))
    return found


def agreeing(
    one: Reals,
    two: Reals,
    sample_size: int,
    place: Callable[[Reals], Reals],
    squares: Callable[[Reals, Reals, Reals], Reals],
) -> tuple[Flags, bool]:
    """Return which items (n,) agree with the solution with which most of them agree, and whether to trust it.

    It is trusted if all agree, or if these are more than half, so that no others agree with another solution, and if
    chance does not explain them: unrelated items are like those with the partners of others.

    Parameters
    ----------
    one, two : array, (n, 8)
        The motors of the hand, and of the camera.
    sample_size : int
        Number of items that determine a solution.
    place : callable
        Function from index sets (h, k) of k items to solutions (h, ...).
    squares : callable
        Function from solutions (h, ...) and items to squared misfits (h, n, 2), in rotation and in translation.
    """
    n_items = len(one)
    most = max(n_items // 2, sample_size)
    """Index of the median, or of an item that is not in the sample; one more item than this is the majority."""
    median = float(scipy.special.chdtri(3, 0.5))
    """Of the sum of the squares of three standard normal variables."""
    found = np.nan_to_num(squares(place(all_or_some_sets(n_items, sample_size, _SAMPLES)), one, two), nan=np.inf)
    medians = np.partition(found, most, axis=1)[:, most]
    best = found[int(np.argmin(np.log(medians + TINY).sum(-1)))]
    variance = np.maximum(np.median(best, axis=0) / median, 1e-30)
    chosen = np.argsort((best / variance).sum(-1), kind="stable")[: most + 1]
    inliers = np.zeros(n_items, bool)
    inliers[chosen] = True
    for round_ in range(ROUNDS):
        model = place(np.flatnonzero(inliers)[None])
        rest = np.nan_to_num(squares(model, one, two)[0], nan=np.inf)
        count = int(inliers.sum())
        # Each item has six numbers, and a sample plus one item has as many numbers as there are unknowns.
        free = max(count - sample_size + 1, 1)
        variance = np.median(rest, axis=0) / median if round_ == 0 else rest[inliers].sum(0) / (3 * free)
        # The misfit of an item that was left out includes the error of the solution.
        # The upper quantile of F(6, 6 free) is the reciprocal of the lower one of F(6 free, 6).
        limit = 6 / float(scipy.special.fdtri(6 * free, 6, RARE)) * (2 - free / count)
        before, inliers = inliers, (rest / np.maximum(variance, CONVERGED**2)).sum(-1) <= limit
        if inliers.sum() <= sample_size or (round_ and np.array_equal(inliers, before)):
            break
    count = int(inliers.sum())
    if 2 * count <= n_items or count == n_items:
        return inliers, count == n_items
    sigma = np.sqrt(np.maximum(variance, CONVERGED**2))
    far = np.sqrt(squares(model, *unrelated(one, two))[0])
    radius = float((np.sqrt(rest[inliers]) / sigma).max())
    share = np.prod([share_of(far[:, k] / sigma[k], 3)(radius) for k in (0, 1)], keepdims=True)
    freedom = Freedom(sample_size, 6 * (sample_size - 1), 6, 1, WRONG)
    # Any number of items could have been those that agree.
    logarithm = log_false_alarms(n_items, np.array([count]), share, freedom)[0]
    return inliers, bool(logarithm + np.log(n_items) <= np.log(WRONG))
