"""Whether an inertial recording contradicts its orientations: saturated rates, gaps, and speeds beyond all limits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from generated import vga3

from ..arguments import Reals

_WINDOW = 2.0
"""s. Time over which accelerations are integrated to a change of the velocity. A wrong tilt of more than half a right
angle that lasts as long is detected; it was not tuned on recordings."""
_FASTEST_AT_REST = 2.0
"""rad/s. The least measuring range of gyroscopes is 125 degrees per second: equal rates below this are no limit."""
_EQUAL = 3
"""From a probability: noise does not give the largest rate in as many successive samples."""
_BRIDGED = 0.1
"""s. Rates change little within a time as short, so that missing samples are bridged by others."""


class Gaps(NamedTuple):
    """Samples of the gyroscope that say less than others."""

    saturated: Reals
    """(..., n) bool. Rates at the limit of the measuring range."""
    variances: Reals
    """(..., n) rad2. What rotations during earlier gaps, and beyond the range, add to the variance about any axis."""


def gaps(rates: Reals, steps: Reals) -> Gaps:
    """Return the saturated samples of rates (..., n, 3), and the variances that these and missing samples leave.

    The rate in a gap is as large as the others are on average, and in saturation as much above the limit as below.
    """
    n = rates.shape[-2]
    size = np.abs(rates)
    finite: Reals = np.asarray(np.isfinite(rates).all(-1))
    largest = np.where(finite[..., None], size, 0).max(-2, keepdims=True, initial=0.0)
    at_limit = (size == largest) & (largest >= _FASTEST_AT_REST)
    saturated = (_long_runs(at_limit, _EQUAL) & ~at_limit.all(-2, keepdims=True)).any(-1)
    mean_square = np.where(finite[..., None], rates**2, 0).sum((-1, -2)) / np.maximum(finite.sum(-1), 1)
    square = np.where(saturated, (largest**2).max((-1, -2))[..., None], mean_square[..., None])
    times = np.broadcast_to(steps, finite.shape)
    unknown: Reals = np.asarray(saturated | ~finite)
    # In a gap that has lasted for t, the rotation grows by the rate times t, its variance by the square.
    lasted = np.zeros(finite.shape)
    before = np.zeros(finite.shape[:-1])
    for k in range(n) if unknown.any() else ():
        before = np.where(unknown[..., k], before + times[..., k], 0)
        lasted[..., k] = before
    long = lasted > _BRIDGED
    first = np.where(long, lasted - times, 0)
    variances = np.cumsum(np.where(long, square * (lasted**2 - first**2), 0), -1)
    return Gaps(saturated, variances)


def _long_runs(flags: Reals, least: int) -> Reals:
    """Return which flags (..., n, 3) are in runs of at least `least` along the second last axis."""
    n = flags.shape[-2]
    found = np.zeros_like(flags)
    if n < least:
        return found
    starts = np.ones((*flags.shape[:-2], n - least + 1, flags.shape[-1]), bool)
    for k in range(least):
        starts &= flags[..., k : n - least + 1 + k, :]
    for k in range(least):
        found[..., k : n - least + 1 + k, :] |= starts
    return found


def is_too_fast(rotors: Reals, forces: Reals, steps: Reals, gravity: float, speed: float) -> Reals:
    """Return whether velocities (...,) would change within two seconds by more than twice the largest speed.

    `forces` (..., n, 3) are accelerations including the reaction to gravity. A missing gravity, a wrong unit of rates
    or accelerations and a lost orientation all leave an acceleration that no motion in reach has.
    """
    known = np.isfinite(forces).all(-1, keepdims=True)
    world = np.asarray(vga3.rotate_vector(rotors, np.where(known, forces, 0))) - [0, 0, gravity]
    velocity = np.cumsum(np.where(known, world, 0) * steps[:, None], -2)
    time = np.cumsum(steps)
    later = np.searchsorted(time, time + _WINDOW)
    rows = np.flatnonzero(later < len(time))
    if not len(rows):
        return np.zeros(rotors.shape[:-2], np.bool_)
    change = velocity[..., later[rows], :] - velocity[..., rows, :]
    return np.asarray(((change**2).sum(-1) > (2 * speed) ** 2).any(-1))
