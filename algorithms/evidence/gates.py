"""Gates of filters: measurements that the covariance of their innovation does not explain, and what many of them mean.

The innovation of a right measurement, divided by its covariance, has a chi-square distribution. A filter that leaves
out most of what it sees is not protected by its gate but lost: it is inconsistent, and starts again.
"""

from __future__ import annotations

from .noise import largest_ratio
from .status import WRONG


def gate_of(n_numbers: int, probability: float = WRONG) -> float:
    """Return the squared innovation that a measurement of some numbers exceeds with a probability."""
    return n_numbers * largest_ratio(n_numbers, probability=probability)


def is_lost(n_used: int, n_seen: int) -> bool:
    """Return whether a filter used less than half of at least two measurements.

    Right ones are left out with the probability of the gate alone, so that this happens rarely unless half of the
    measurements are wrong or the estimate is.
    """
    return n_seen > 1 and 2 * n_used < n_seen
