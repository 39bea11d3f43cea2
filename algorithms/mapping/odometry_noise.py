"""The noise of odometry, learnt while scans are matched."""

from __future__ import annotations

from collections import deque

import numpy as np

from ..arguments import Reals

_REMEMBERED, _CAUTION, _LEAST_FACTOR = 40, 2.0, 0.1
"""The errors of odometry are judged by this number of motions; their standard deviations are multiplied by a factor for
caution, and are at least this share of what is assumed at first."""


class OdometryNoise:
    """How large the errors of odometry are, compared with what is assumed at first."""

    def __init__(self) -> None:
        self._ratios: deque[tuple[float, float]] = deque(maxlen=_REMEMBERED)
        self._factors = np.ones(3)

    def add(self, deviation: Reals, variances: Reals) -> None:
        """Take the difference of a matched motion and that by odometry: angle, x, y."""
        ratio = np.abs(deviation) / np.sqrt(variances)
        self._ratios.append((float(ratio[0]), float(np.hypot(*ratio[1:]))))
        if len(self._ratios) >= _REMEMBERED // 2:
            # Medians of the absolute values of one and of two normal errors.
            turn, shift = np.median(np.array(self._ratios), axis=0) / (0.67, 1.18)
            self._factors = np.clip(np.array([turn, shift, shift]) * _CAUTION, _LEAST_FACTOR, 1.0)

    def learnt(self, variances: Reals) -> Reals:
        """Return variances with what was learnt."""
        return np.asarray(variances * self._factors**2)
