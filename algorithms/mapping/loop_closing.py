"""When loops are looked for along the path of a robot, which ones are accepted, and when poses are optimised."""

from __future__ import annotations

import numpy as np

from ..arguments import Reals
from .keyframes import Keyframes
from .loops import Closure, StoredScans, agree, find_certain, find_far_loop, find_loop
from .parts import Parts

_SHIFT, _RARELY, _MOST_NEW_LOOPS = 0.15, 100, 50
"""Poses are optimised if a loop moves the last one by more than this and the path is longer by a hundredth, or after
this many loops."""
_LONG_AGO, _SELDOM, _CONFIRMED_WITHIN = 25.0, 3, 8.0
"""Loops without a prior are looked for at every third scan after this length of path without a loop, in metres, and
are confirmed by another one within this length."""
_CERTAIN_APART = 2.0
"""The two loops that say where a lost robot is are at least this far apart, in metres: scans of one place show the same
walls, which may be alike elsewhere."""
_CARRIED = np.array([np.pi, 30.0, 30.0])
"""Standard deviations of the motion of a robot that may have been carried: any turn, and as far as scanners reach."""


class Loops:
    """The loops of a path. It has one owner, the builder of the map."""

    def __init__(self) -> None:
        self.parts = Parts()
        self.optimised_at = 0
        """The number of poses when they were optimised."""
        self._pending: Closure | None = None
        """A loop without a prior that no other one has confirmed."""
        self._closed_at = 0.0
        self._new_loops = 0

    def begin_part(self, row: int) -> Reals:
        """Begin a part of the path with a pose, and return the information of a motion to it that nothing measures."""
        self.parts.begin(row)
        self._pending = None
        return np.asarray(np.diag(1 / _CARRIED**2))

    def close(self, path: Keyframes, scans: StoredScans) -> bool:
        """Look for a loop that ends at the last pose, and return whether it shows where a lost robot is."""
        here, is_lost = float(path.travelled[-1]), self.parts.lost_since is not None
        if is_lost:
            found = find_certain(path, scans, self.parts.certain(len(path)), self.parts.start)
            found = self._confirmed(path, found, _CERTAIN_APART)
        else:
            found = find_loop(path, here - self._closed_at)
            if found is not None:
                self._pending = None
            elif here - self._closed_at > _LONG_AGO and len(path) % _SELDOM == 0:
                found = self._confirmed(path, find_far_loop(path, scans, here - self._closed_at))
        if found is None:
            return False
        self._closed_at = here
        path.add_loop(found.edge, found.motion, found.information)
        if is_lost:
            self.parts.join(*found.edge)
        self._new_loops += 1
        n = len(path)
        is_due = found.shift > _SHIFT and n - self.optimised_at > n / _RARELY
        if is_lost or is_due or self._new_loops > max(_MOST_NEW_LOOPS, n / 20):
            path.optimise()
            self._new_loops, self.optimised_at = 0, n
        return is_lost

    def _confirmed(self, path: Keyframes, found: Closure | None, apart: float = 0.0) -> Closure | None:
        """Return a loop without a prior if the previous one, a short way before, corrects the path alike.

        Both have to be a length of the path apart: next to each other, scans show the same.
        """
        before = self._pending
        if found is None:
            return None
        self._pending = found
        if before is None:
            return None
        passed = path.travelled[-1] - path.travelled[before.edge[1]]
        if passed > _CONFIRMED_WITHIN or not agree(path, before, found):
            return None
        if passed < apart:
            self._pending = before
            return None
        self._pending = None
        path.add_loop(before.edge, before.motion, before.information)
        return found
