"""What distances of pixels in a pose say of a camera that is not what it is taken for, or of several moving objects."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from generated import camera_poses

from ..arguments import Reals
from ..evidence import WRONG, Noise
from ..evidence.misfit import NO_MISFIT, SUSPECTED, Tested, anisotropy, coherence, misfit
from ..precision import NEGLIGIBLE
from .plane_adjustment import N_POSE

N_CAMERA_TERMS = 8
"""Number of parameters of a camera by which `camera_poses.pose_misfits` explains distances."""
_NEIGHBOURS = 128
"""A limit on work: the number of pixels whose distances are compared with those of their neighbours."""


class Doubt(NamedTuple):
    """What structure in the residuals of a pose means for it."""

    is_certain: bool
    """Whether it is more than noise would leave,"""
    refused: bool
    """and more than the rest of the residuals."""
    more: Reals
    """(2,) The squares of how far it may move the rotation, and the centre."""
    growth: float
    """The factor by which it makes the variance larger."""


NO_DOUBT = Doubt(False, False, np.zeros(2), 1.0)


class Offsets(NamedTuple):
    """Sums over pixels and their nearest neighbours."""

    sums: Reals
    """(5,) As of `camera_poses.neighbouring_offsets`."""
    n: int
    """Number of coordinates."""

    def plus(self, other: Offsets) -> Offsets:
        """Return the sums over the pixels of both."""
        return Offsets(self.sums + other.sums, self.n + other.n)

    def shares(self, noise: Noise, probability: float) -> tuple[float, float]:
        """Return the shares of squares that neighbours have in common, and that have one direction.

        Distances that are smaller than the noise that is stated may have any structure: the shares are those of its
        squares.
        """
        squares, products, along, across, radial = self.sums.tolist()
        squares = max(squares, self.n * float(noise.raised(squares, max(self.n - N_POSE, 1))))
        return (
            coherence(squares, products, self.n, self.n, probability),
            anisotropy(squares, along, across, radial, (self.n - N_POSE) // 2, probability),
        )


def camera_misfits(pose: Reals, k: Reals, places: Reals, image: Reals) -> tuple[Reals, Reals, Offsets]:
    """Return sums of products (15, 15), what other parameters of the camera explain (3,), and what neighbours share."""
    sums, explained = camera_poses.pose_misfits(pose, k, places, image)
    every = -(-len(places) // _NEIGHBOURS)
    offsets = np.asarray(camera_poses.neighbouring_offsets(pose, k, places[::every], image[::every]))
    n = 2 * -(-len(places) // every)
    is_exact = offsets[0] <= n * (NEGLIGIBLE * k[0, 0]) ** 2
    return np.asarray(sums), np.asarray(explained)[1:], Offsets(np.zeros(5) if is_exact else offsets, n)


def doubt_of(sums: Reals, explained: Reals | None, offsets: Offsets, n: int, noise: Noise) -> Doubt:
    """Return what the sums over n pixels say of a pose.

    Parameters
    ----------
    sums : array, (q, q)
        Of products of the derivatives by a pose, those by other terms, and the distances.
    explained : array, (3,), optional
        The sum of squares of these, what the terms explain of it, and what one does; it saves time if that is little.
    offsets : Offsets
    n : int
    noise : Noise
    """
    freedom, found = 2 * n - N_POSE, NO_MISFIT
    n_terms = len(sums) - N_POSE - 1
    cost, by_all, by_one = (np.inf, np.inf, np.inf) if explained is None else explained.tolist()
    if explained is None or any(Tested(cost, by_all, by_one, n_terms, freedom - n_terms).exceed(noise)):
        found = misfit(sums, N_POSE, freedom, noise)
    share = max(offsets.shares(noise, SUSPECTED))
    if found.more is None and not share:
        return NO_DOUBT
    more = np.zeros(2)
    if found.more is not None:
        more = np.array([np.linalg.eigvalsh(found.more[part, part])[-1] for part in (slice(3), slice(3, 6))])
    # Each of three tests may refuse what noise explains.
    certain = max(offsets.shares(noise, WRONG / 3))
    return Doubt(found.is_certain or certain > 0, found.contradicts or 2 * certain > 1, more, 1 + 2 * n * share)
