"""Which points and lines agree with one pose of a camera, if some are wrong and no threshold is given."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..arguments import Reals
from ..evidence import WRONG, Freedom, Noise, least_by_chance
from ..evidence.consensus import Indices
from ..evidence.misfit import exceeds_noise
from ..precision import TINY
from .starts import ROUNDS

SAMPLES = 400
"""A limit on work: the number of samples of three items: 12 items have 220 of them, and if half of many items are
wrong, 50 of these are free of wrong ones."""
FEWEST = 6
"""From a probability: of five items, one of which is wrong, chance explains the others."""
SIGMAS = 2.5
"""From the noise: the multiple of it that thresholds usually are, up to twice which images of an item differ."""


def agreeing_items(
    poses: Reals,
    squares: Callable[[Reals], Reals],
    minimum: Callable[[Reals, Indices], tuple[Reals, Reals]],
    shares: Reals,
    once: Indices,
    noise: Noise,
    freedom: Freedom,
) -> Indices | None:
    """Return which items agree with a pose, up to the noise of these, or None if chance or two poses explain them.

    The pose is taken with which the others agree in the least likely way.

    Parameters
    ----------
    poses : array, (m, 3, 4)
        Poses [R | t] of samples.
    squares : callable
        Function from poses (..., 3, 4) to the squared distances (..., n) of all items.
    minimum : callable
        Function from a pose and items (n,) to the pose with the least squares of these, and the sum of squares.
    shares : array, (n,)
        The probability that an unrelated item is as near as 1 pixel; it grows with the square of the distance.
    once : array of bool, (n,)
        Items that do not repeat others.
    noise : Noise
    freedom : Freedom
    """
    poses = poses[np.isfinite(poses).all((1, 2))]
    if not len(poses) or not np.isfinite(shares).all():
        return None
    floor = min(float(shares.max()) * noise.variance, 1.0)

    def by_chance(pose: Reals) -> tuple[float, float]:
        return least_by_chance((shares * squares(pose)).compress(once), lambda r: np.clip(r, floor, 1), freedom)

    # The median prefers no number of inliers; the best tenth is compared by chance.
    samples = squares(poses)
    order = np.argsort(np.median(shares * samples, axis=1), kind="stable")[: max(len(poses) // 10, 1)]
    chances = [by_chance(pose) for pose in poses[order]]
    best = int(np.argmin([each for each, _ in chances]))
    pose = poses[order[best]]
    inliers: Indices = shares * squares(pose) <= chances[best][1]
    for _ in range(ROUNDS):
        if inliers.sum() < 4:
            return None
        (pose, cost), before = minimum(pose, inliers), inliers
        inliers = ~noise.outlying(squares(pose), 2, np.asarray(cost)[None], 2 * int(before.sum()) - freedom.parameters)
        if np.array_equal(inliers, before):
            break
    # Two poses, each of some of the items, may explain so much more that none is that of all of them. There are 2^n
    # divisions of n items into two parts.
    n, by_one = int(inliers.sum()), float(squares(pose)[inliers].sum())
    by_two = float(np.minimum(samples[order[0], inliers], samples[:, inliers]).sum(1).min())
    among = 2 * (n - freedom.parameters)
    if exceeds_noise(by_one - by_two, by_one, freedom.parameters, among, 0.0, max(WRONG / 2.0**n, TINY)):
        return None
    return inliers if by_chance(pose)[0] <= np.log(WRONG) else None
