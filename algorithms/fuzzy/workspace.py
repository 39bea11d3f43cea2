"""Arrays for intermediate results."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..arguments import Reals


@dataclass(frozen=True, eq=False)
class Workspace:
    """Arrays for the intermediate results of at most `size` elements, which are used again for each part of a batch.

    Memory that is new to the process takes longer to fill than the results take to compute.
    """

    size: int
    _reals: dict[str, Reals] = field(default_factory=dict)
    _integers: dict[str, NDArray[np.int64]] = field(default_factory=dict)

    def array(self, name: str, count: int, *shape: int) -> Reals:
        """Return the first `count` rows of an array of the shape (size, ...), which the first call creates."""
        if name not in self._reals:
            self._reals[name] = np.empty((self.size, *shape))
        return self._reals[name][:count]

    def indices(self, name: str, count: int, *shape: int) -> NDArray[np.int64]:
        """Return the same of integers."""
        if name not in self._integers:
            self._integers[name] = np.empty((self.size, *shape), np.int64)
        return self._integers[name][:count]
