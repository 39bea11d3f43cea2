"""Gates of filters: measurements that the covariance of their innovation does not explain, and what many of them mean.

The innovation of a right measurement, divided by its covariance, has a chi-square distribution. A filter that leaves
out most of what it sees is not protected by its gate but lost: it is inconsistent, and starts again.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from .noise import largest_ratio
from .status import WRONG

WIDE = 0.3
"""rad. A prediction that is less certain than this is not the only start of an update: sines differ from angles by
more than a percent, so that linear updates are not exact."""
SETTLED, FEWEST = 0.1, 3
"""What was measured is kept, and used again with what follows, until the rotation is known to this standard deviation
in rad, at which linear updates are exact, and at least this many objects were used."""
UNLIKELY = 1e-9
"""A probability: an update is examined if its innovations are less probable than this, so that none of a million is
without a reason."""
OPEN = 1e300
"""From floating point: a gate that everything passes."""


def checked_gate(gate: float) -> float:
    """Return the value of a gate, at most `OPEN`.

    Raises
    ------
    TypeError
        If it is not a real number.
    ValueError
        If it is not positive: NaN compares as nothing does.
    """
    if isinstance(gate, bool) or not isinstance(gate, (int, float, np.integer, np.floating)):
        raise TypeError(f"gate: {gate!r}; expected a number")
    if not gate > 0:
        raise ValueError(f"gate: {gate}; expected a positive number, or infinity")
    return min(float(gate), OPEN)


def gate_of(n_numbers: int, probability: float = WRONG) -> float:
    """Return the squared innovation that a measurement of some numbers exceeds with a probability."""
    return n_numbers * largest_ratio(n_numbers, probability=probability)


def certain_deviations(probability: float = WRONG) -> float:
    """Return the number of standard deviations that the size of a normal number exceeds with a probability."""
    return sqrt(gate_of(1, probability))


def is_lost(n_used: int, n_seen: int) -> bool:
    """Return whether a filter used less than half of at least two measurements.

    Right ones are left out with the probability of the gate alone, so that this happens rarely unless half of the
    measurements are wrong or the estimate is.
    """
    return n_seen > 1 and 2 * n_used < n_seen
