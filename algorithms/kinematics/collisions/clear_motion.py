"""Motions that are clear of obstacles at every moment, not only at samples."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...arguments import Reals

_LEAST = 2.5e-4
"""Clearance that samples must have, in metres: the larger it is, the fewer samples are needed near obstacles."""
_MOST = 4096
"""The largest number of samples of a motion; a motion that needs more is regarded as a collision."""

Clearances = Callable[[Reals], Reals]
"""Returns the clearance of each body (..., c) at variables (..., n)."""


def is_clear(path: Reals, clearances: Clearances, speeds: Reals) -> bool:
    """Determine whether all clearances are positive along the segments between consecutive points of a path.

    Between two points, a clearance decreases from either end by at most the displacement of the body. It is positive on
    the whole segment if the sum at both ends is larger than the displacement between them; if not, the segment is
    halved.

    Parameters
    ----------
    path : array, (k, n)
        Variables, such as joints; k is at least 1.
    clearances : callable
        Clearances (m, c) at variables (m, n).
    speeds : array, (c, n)
        Bounds of the displacement of each body for a change of each variable by 1.

    Returns
    -------
    bool
        False if a clearance is less than 0.25 mm at a sample.
    """
    values = clearances(path)
    if not (values >= _LEAST).all():
        return False
    first, last, low, high = path[:-1], path[1:], values[:-1], values[1:]
    count = len(path)
    while True:
        moves = np.abs(last - first) @ speeds.T
        open_ = ~(low + high > moves).all(1)
        if not open_.any():
            return True
        count += int(open_.sum())
        if count > _MOST:
            return False
        first, last, low, high = first[open_], last[open_], low[open_], high[open_]
        middle = (first + last) / 2
        between = clearances(middle)
        if not (between >= _LEAST).all():
            return False
        first, last = np.concatenate([first, middle]), np.concatenate([middle, last])
        low, high = np.concatenate([low, between]), np.concatenate([between, high])
