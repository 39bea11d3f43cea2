"""Parts of a path between times at which nothing measures the motion, and which of them closures of loops join."""

from __future__ import annotations

import numpy as np

from ..arguments import Reals


class Parts:
    """The parts of a path of poses. It has one owner, the builder of the map."""

    def __init__(self) -> None:
        self._starts, self._labels = [0], [0]
        """The first pose of each part, and the first part that it is joined with."""

    def begin(self, row: int) -> None:
        """Begin a part with a pose."""
        self._labels.append(len(self._starts))
        self._starts.append(row)

    def join(self, one: int, other: int) -> None:
        """Join the parts of two poses."""
        low, high = sorted(self._labels[k] for k in np.searchsorted(self._starts, [one, other], "right") - 1)
        self._labels = [low if label == high else label for label in self._labels]

    @property
    def start(self) -> int:
        """The first pose of the last part."""
        return self._starts[-1]

    @property
    def lost_since(self) -> int | None:
        """The first of the last poses that are not joined with the first one; None if the last one is."""
        if not self._labels[-1]:
            return None
        return self._starts[1 + max(k for k, label in enumerate(self._labels) if not label)]

    def certain(self, count: int) -> Reals:
        """Return whether each of so many poses is joined with the first one."""
        ends = np.diff([*self._starts, max(count, self._starts[-1])])
        return np.repeat(np.array(self._labels) == 0, ends)[:count]
