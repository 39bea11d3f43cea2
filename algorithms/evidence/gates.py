"""Gates of filters: measurements that the covariance of their innovation does not explain, and what many of them mean.

The innovation of a right measurement, divided by its covariance, has a chi-square distribution. A filter that leaves
out most of what it sees is not protected by its gate but lost: it is inconsistent, and starts again.
"""

from __future__ import annotations

from math import log, sqrt

import numpy as np

from ..precision import HUGE
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
LATELY = 20
"""A limit on memory: of more measurements than these, only the last ones say whether a filter is lost."""
_CONTRADICTED = -log(WRONG)
"""From a probability: the odds of a `Record` exceed this for right noise at a given time with that of `WRONG`."""

_HALF_LOG_2 = log(2) / 2
"""From a probability: what a variance of twice the size costs in the logarithm of the likelihood of a number."""


def checked_gate(gate: float) -> float:
    """Return the value of a gate, at most `precision.HUGE`, with which everything passes.

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
    return min(float(gate), HUGE)


def gate_of(n_numbers: int, probability: float = WRONG) -> float:
    """Return the squared innovation that a measurement of some numbers exceeds with a probability."""
    return n_numbers * largest_ratio(n_numbers, probability=probability)


def certain_deviations(probability: float = WRONG) -> float:
    """Return the number of standard deviations that the size of a normal number exceeds with a probability."""
    return sqrt(gate_of(1, probability))


class Record:
    """What the innovations of a filter so far say of its noise, and how many measurements agree with its estimate.

    The first is Page's cumulative sum (*Biometrika* 41:100, 1954): the largest logarithm of the likelihood ratio of
    twice the variance over all sequences of innovations up to now. For the stated variance, it exceeds x with a
    probability of at most ``exp(-x)``. It is kept below twice its limit, so that as much evidence as led to a
    contradiction ends it.

    A filter that gave up its estimate for another one is contradicted until as many measurements agree with that.
    """

    __slots__ = ("_before", "_needed", "_odds", "_used")

    def __init__(self) -> None:
        self._odds, self._used, self._needed = 0.0, 0, 0
        self._before = 0.0, 0

    def add(self, square: float, freedom: int, used: int) -> bool:
        """Take an innovation, squared and divided by its covariance, and return whether the filter is contradicted.

        Parameters
        ----------
        square : float
        freedom : int
            The number of measured numbers.
        used : int
            The number of measurements that agree.
        """
        odds = self._odds + 0.25 * square - _HALF_LOG_2 * freedom
        self._used += used
        if odds <= 0:
            self._odds = 0.0
            return self._used < self._needed
        self._odds = min(odds, 2 * _CONTRADICTED)
        return odds > _CONTRADICTED or self._used < self._needed

    def begin(self) -> None:
        """Mark the time after which all innovations are taken together."""
        self._before = self._odds, self._used

    def again(self, square: float, freedom: int, used: int) -> bool:
        """Take the innovations since the mark together, instead of one by one."""
        self._odds, self._used = self._before
        return self.add(square, freedom, used)

    def give_up(self) -> None:
        """Begin with another estimate, after the mark."""
        self._needed = min(max(self._before[1], self._needed), LATELY)
        self._before = self._before[0], 0


def is_lost(n_used: int, n_seen: int) -> bool:
    """Return whether a filter used less than half of at least two measurements.

    Right ones are left out with the probability of the gate alone, so that this happens rarely unless half of the
    measurements are wrong or the estimate is.
    """
    return n_seen > 1 and 2 * n_used < n_seen
