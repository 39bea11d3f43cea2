"""Solver for the motion that satisfies the equations of all nodes and is smooth except at few places."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generated import filters, images

from ..arguments import Reals
from .flow_equations import half_gaussian, widened

_KNEE = 0.04**2
"""Squared difference of the motions of neighbours, in pixels, above which the penalty is linear, not quadratic."""
_DEGREES = 4.0
"""Degrees of freedom of the t distribution of residuals: equations that fit badly get small weights."""
_ROUNDS = 2
"""Number of reweightings; each computes the weights from the current motion."""
_TREND = half_gaussian(3.0, 10)
"""A Gaussian over which the motion is averaged; only differences from the average are to be smooth."""
_FILLING = 32
"""Sweeps for hidden pixels, whose motion starts with that of the nearest visible ones."""


def solved(sums: Reals, motion: Reals, noise: float, stiffness: float, sweeps: int) -> Reals:
    """Return the motion that best satisfies the equations and the smoothness term.

    Parameters
    ----------
    sums : array, (6, m, n)
        Results of `images.motion_terms`, averaged, for a correction of `motion`.
    motion : array, (2, m, n)
        The current motion.
    noise : float
        Squared difference of the images. The larger it is, the larger the region over which the motion is averaged.
    stiffness : float
        Weight of squared differences of neighbours relative to squared residuals in units of the noise.
    sweeps : int
        Number of sweeps over all nodes for one reweighting, a power of 2.

    Returns
    -------
    array, (2, m, n)

    Notes
    -----
    The motion minimizes ``sum w r / noise + stiffness sum rho(difference of neighbours)``. Here r is the squared
    residual, ``w = 1 / (1 + r / (noise degrees))``, and rho is quadratic for small and linear for large differences
    (Charbonnier et al., *IEEE Trans. Image Processing* 6:298, 1997). The differences are those of the motion without
    its local average, so that rotations and enlargements are not penalized.
    """
    trend: Reals = filters.smoothed(motion, _TREND)
    sides = np.full((2, *motion.shape[1:]), stiffness, np.float32)
    sides[0, :, -1], sides[1, -1] = 0, 0
    parameters = np.array([1 / noise, 1 / (noise * _DEGREES), 1 / _KNEE], np.float32)
    return trend + _relaxed(sums, motion - trend, sides, parameters, _ROUNDS, sweeps)


def _relaxed(sums: Reals, motion: Reals, sides: Reals, parameters: Reals, rounds: int, sweeps: int) -> Reals:
    """Return the motion (2, m, n) after some reweightings and sweeps; see `images.relaxed_motion`."""
    repeated = np.zeros(rounds, np.float32)
    further = parameters, repeated, _factors(sweeps)
    relaxed_motion: Any = images.relaxed_motion  # mypy takes seconds to find that unpacked arguments fit no overload
    return np.stack(relaxed_motion(*sums, *motion, *motion, *sides, *further))


@lru_cache
def _factors(sweeps: int) -> Reals:
    """Return the factors of relaxation that reduce most what is left after `sweeps` sweeps, a power of 2.

    The factors belong to the zeros of a Chebyshev polynomial, in an order in which rounding errors do not grow (Lebedev
    and Finogenov, *USSR Computational Mathematics and Mathematical Physics* 16:70, 1976). They suit a spectral radius
    of about ``1 - 1 / sweeps``: slower components need more sweeps than there are.
    """
    order = [1]
    while len(order) < sweeps:
        order = [number for one in order for number in (one, 4 * len(order) - one)]
    radius = (1 - 1 / (2 * sweeps)) ** 2
    return (1 / (1 - radius * np.cos(np.pi / (2 * sweeps) * np.array(order)))).astype(np.float32)


def filled(uv: Reals, known: NDArray[np.bool_], image: Reals, contrast: float) -> Reals:
    """Return the motion of pixels, with unknown values replaced by those of neighbours of similar brightness.

    Parameters
    ----------
    uv : array, (2, M, N)
    known : array of bool, (M, N)
    image : array, (m, n)
        The brightness of the nodes.
    contrast : float
        The difference of neighbours across which little motion is propagated.

    Returns
    -------
    array, (2, M, N)
    """
    motion = np.ascontiguousarray(uv[:, ::2, ::2])
    # Boundaries are accurate to a pixel or two, so the nearest nodes may have the motion of the wrong side.
    hidden = ~known[::2, ::2]
    sure = ~(widened(hidden, 0) | widened(hidden, 1))
    if not sure.any():
        return uv
    start = _from_nearest(motion, sure)
    firm = np.where(sure, np.float32(1e6), np.float32(0))
    none = np.zeros_like(firm)
    sides = np.zeros((2, *image.shape), np.float32)
    across, down = (np.exp(-((np.diff(image, axis=axis) / contrast) ** 2) / 2) + 1e-3 for axis in (1, 0))
    sides[0, :, :-1], sides[1, :-1] = across, down
    sums, parameters = np.stack([firm, none, firm, none, none, none]), np.array([1, 0, 0], np.float32)
    nodes = _relaxed(sums, start, sides, parameters, 1, _FILLING)
    # Pixels between known and other nodes have the motion of the latter.
    row, column = np.nonzero(~known)
    last = np.array(sure.shape)[:, None] - 1
    ends = [np.minimum((np.stack([row, column]) + step) // 2, last) for step in (0, 1)]
    around = [(ends[down][0], ends[across][1]) for down in (0, 1) for across in (0, 1)]
    weight = sum((~sure[place]).astype(np.float32) for place in around)
    total = sum(nodes[:, *place] * ~sure[place] for place in around)
    between = weight > 0
    found = uv.copy()
    found[:, row[between], column[between]] = (total / np.where(between, weight, 1))[:, between]
    return found


def _from_nearest(motion: Reals, known: NDArray[np.bool_]) -> Reals:
    """Return a motion (2, m, n) with that of unknown nodes replaced by the nearest known one of their row or column.

    Where there is none, those that were found count as known.
    """
    motion, known = motion.copy(), known.copy()
    while not known.all():
        row, column = np.nonzero(~known)
        offers = []
        for axis, own in ((0, row), (1, column)):
            size = known.shape[axis]
            lines = np.moveaxis(known, axis, 0)
            numbers = np.arange(size)[:, None]
            before = np.maximum.accumulate(np.where(lines, numbers, -size), 0)
            after = np.minimum.accumulate(np.where(lines, numbers, 2 * size)[::-1], 0)[::-1]
            for nearest in (before, after):
                other = np.moveaxis(nearest, 0, axis)[row, column]
                offers.append((np.where((other < 0) | (other >= size), np.inf, np.abs(other - own)), other))
        distance = np.stack([each for each, _ in offers])
        best = distance.argmin(0)
        found = distance.min(0) < np.inf
        row, column, best = row[found], column[found], best[found]
        other = np.stack([each for _, each in offers])[:, found][best, np.arange(len(best))]
        from_column = best < 2
        motion[:, row, column] = motion[:, np.where(from_column, other, row), np.where(from_column, column, other)]
        known[row, column] = True
    return motion
