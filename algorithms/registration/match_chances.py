"""How probable it is that as many wrong matches agree with a motion by chance."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..arguments import Reals
from ..evidence import Freedom, least_by_chance, log_false_alarms
from ..precision import SINGLE

FREEDOM = Freedom(sample_size=3, parameters=6, codimension=3, solutions=1, false_alarms=1e-4)
"""Of a motion by three matches."""
_EXACT = replace(FREEDOM, codimension=0)
"""The same for sites of a lattice, which have no distances."""
_ROOM = 15.0
"""Volume by the product of standard deviations in which wrong matches are assumed to be."""


class Grid(NamedTuple):
    """The step of the lattice on which the targets are, 0 without one, the sides (3,) of their volume, and rounding."""

    step: float
    widths: Reals
    rounding: float


def widths(spread: Reals) -> Reals:
    """Return the sides of the volume in which wrong matches are assumed to be, from standard deviations."""
    return np.asarray(np.cbrt(_ROOM) * np.maximum(spread, 1e-3 * spread.max()))


def log_chance(off: Reals, tolerance: float | None, grid: Grid) -> tuple[Reals, Reals]:
    """Return the least expected number of chance motions over the radius of inliers, as a logarithm, and the radius.

    The distances are those of several motions, (k, n), and the results (k,). On a lattice, a motion of the lattice
    takes a wrong match exactly to its partner with the probability of one site of all, whatever the radius.
    """
    # The volume of a normal distribution of this spread; that of a uniform one is larger.
    room = float(np.prod(grid.widths))
    floor = SINGLE * np.cbrt(room)
    site = float(np.prod(np.minimum(grid.step / grid.widths, 1)))

    def share(radii: Reals) -> Reals:
        within = np.minimum(4 / 3 * np.pi * np.maximum(radii, floor) ** 3 / room, 1)
        # Where all matches agree, none of them is known to be wrong.
        within[..., :-1] = np.maximum(within[..., :-1], site)
        return np.asarray(within)

    distances = off if tolerance is None else np.where(off <= tolerance, off, np.inf)
    logarithms, radii = map(np.asarray, least_by_chance(distances, share, FREEDOM))
    if grid.step:
        # A motion by three matches is exact on a lattice: others agree at the same site, without a margin.
        exact = log_false_alarms(off.shape[1], (off <= grid.rounding).sum(1), np.asarray(site), _EXACT)
        exact += np.log(off.shape[1])
        radii = np.where(exact < logarithms, grid.rounding, radii)
        logarithms = np.minimum(logarithms, exact)
    return logarithms / np.log(10), np.minimum(np.maximum(radii, floor), np.inf if tolerance is None else tolerance)
