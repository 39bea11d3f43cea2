"""Poses along a path with the surfaces seen there, and the graph of measured motions between them."""

from __future__ import annotations

import numpy as np

from generated import line_maps, pga2

from ..arguments import Reals
from .free_space import Sight
from .motions import length_and_angle, relative
from .pose_graph import OptimisedPoses, optimise_poses
from .surfaces import Reference, Surface

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
_FLOOR = np.diag([np.radians(0.25), 0.015, 0.015]) ** 2
"""The covariance that systematic errors of scanners add to that of each measured motion: angle, x, y."""

_TOLERANCE = 1e-5
"""The relative decrease of the cost at which an optimisation ends: far below the accuracy of scans."""


def with_floor(information: Reals) -> Reals:
    """Return the information of a measured motion with the systematic errors of scanners."""
    return np.asarray(np.linalg.inv(np.linalg.inv(information + 1e-3 * np.eye(3)) + _FLOOR))


class Keyframes:
    """The poses of a path at which scans were kept. It has one owner, the builder of the map, which adds poses."""

    def __init__(self) -> None:
        self.surfaces: list[Surface] = []
        self._sights: list[Sight | None] = []
        self._looks: list[Reals] = []
        """For each point, how many other scans see it, and how many see through it."""
        self._motors = np.zeros((64, 4))
        self._travelled = np.zeros(64)
        self._edges: list[tuple[int, int]] = []
        self._motions: list[Reals] = []
        self._information: list[Reals] = []
        self._is_loop: list[bool] = []
        self.loops: list[tuple[int, int]] = []
        """The closures of loops."""
        self.covariance = np.zeros((3, 3))
        """Of the perturbation, angle and translation in its own frame, of the last pose relative to the first one."""

    def __len__(self) -> int:
        """Return the number of poses."""
        return len(self.surfaces)

    @property
    def motors(self) -> Reals:
        """(n, 4) The current estimates of the poses."""
        return self._motors[: len(self)]

    @property
    def travelled(self) -> Reals:
        """(n,) The length of the path up to each pose, in metres."""
        return self._travelled[: len(self)]

    def add(self, surface: Surface, motion: Reals, information: Reals) -> None:
        """Add a pose that follows the last one by a motion with an information matrix."""
        n = len(self)
        if n == len(self._motors):
            self._motors = np.concatenate([self._motors, np.zeros_like(self._motors)])
            self._travelled = np.concatenate([self._travelled, np.zeros_like(self._travelled)])
        if n:
            self._motors[n] = pga2.normalize_motor(pga2.motor_product(self._motors[n - 1], motion))
            self._travelled[n] = self._travelled[n - 1] + length_and_angle(motion)[0]
            self._append((n - 1, n), motion, information, False)
            self.covariance = self.spread_after(motion, np.linalg.inv(self._information[-1]))
        else:
            self._motors[0] = IDENTITY
        narrow = (each.astype(np.float32) for each in (surface.points, surface.normals))
        self.surfaces.append(Surface(*narrow))
        self._sights.append(None)
        self._looks.append(np.zeros((2, len(surface.points)), np.int16))

    def look(self, sight: Sight, first: int) -> None:
        """Count which points of poses from `first` on the last one sees or sees through, and the other way round."""
        self._sights[-1] = sight
        last = len(self) - 1
        rows = np.arange(first, last)
        if len(rows):
            chosen = [self.surfaces[row] for row in rows]
            looks = sight.looks(self._moved(chosen, rows, self.motors[last]).points)
            ends = np.cumsum([len(each.points) for each in chosen])[:-1]
            for row, more in zip(rows, np.split(looks, ends, axis=1), strict=True):
                self._looks[row] += more
        for row, motor in zip(rows, relative(self.motors[rows], self.motors[last]), strict=True):
            other = self._sights[row]
            if other is not None:
                self._looks[last] += other.looks(pga2.move_point(motor, self.surfaces[last].points))

    def is_contradicted(self, sight: Sight, motion: Reals, first: int) -> bool:
        """Return whether a scan at a motion from the last pose sees through what others have seen.

        By Laplace's rule of succession, a point that k of n scans have seen through is seen through again with the
        probability ``(k + 1) / (n + 2)``. From another place it is with a half.
        """
        rows = np.arange(first, len(self))
        seen, through = np.concatenate([self._looks[row] for row in rows], axis=1)
        frame = pga2.motor_product(self.motors[-1], motion)
        on, free = sight.looks(self._moved([self.surfaces[row] for row in rows], rows, frame).points)
        again = (through + 1) / (seen + through + 2)
        return bool((free * np.log(2 * again) + on * np.log(2 * (1 - again))).sum() < 0)

    def add_loop(self, edge: tuple[int, int], motion: Reals, information: Reals) -> None:
        """Add a measured motion between two poses that do not follow each other."""
        self._append(edge, motion, information, True)
        self.loops.append(edge)

    def _append(self, edge: tuple[int, int], motion: Reals, information: Reals, loop: bool) -> None:
        self._edges.append(edge)
        self._motions.append(motion)
        self._information.append(with_floor(information))
        self._is_loop.append(loop)

    def spread_after(self, motion: Reals, spread: Reals) -> Reals:
        """Return the covariance of a pose that follows the last one by a motion with a covariance."""
        _, by_last, by_next = line_maps.edge_of_poses(IDENTITY, motion, motion)
        back = np.linalg.inv(by_next)
        return np.asarray(back @ (by_last @ self.covariance @ by_last.T + spread) @ back.T)

    def submap(self, rows: Reals, origin: int) -> Reference:
        """Return the surfaces of some poses in the frame of one of them."""
        return Reference(self.parts(rows, origin))

    def parts(self, rows: Reals, origin: int) -> list[Surface]:
        """Return the surfaces of some poses, each in the frame of the pose `origin`, without what most see through."""
        if not len(rows):
            return []
        chosen = [self._still(row) for row in rows]
        moved = self._moved(chosen, rows, self.motors[origin])
        ends = np.cumsum([len(each.points) for each in chosen])[:-1]
        return [
            Surface(*each) for each in zip(np.split(moved.points, ends), np.split(moved.normals, ends), strict=True)
        ]

    def _moved(self, chosen: list[Surface], rows: Reals, frame: Reals) -> Surface:
        """Return the surfaces of some poses as one, in another frame."""
        # All points in one call, which takes less time than a call for each surface.
        counts = [len(each.points) for each in chosen]
        whole = Surface(*(np.concatenate(each) for each in zip(*((x.points, x.normals) for x in chosen), strict=True)))
        return whole.moved(np.repeat(relative(frame, self.motors[rows]), counts, axis=0))

    def _still(self, row: int) -> Surface:
        found, (seen, through) = self.surfaces[row], self._looks[row]
        still = seen >= through
        return found if still.all() else Surface(found.points[still], found.normals[still])

    def optimise(self) -> OptimisedPoses:
        """Make the poses agree with all measured motions."""
        found = optimise_poses(
            self.motors, np.array(self._edges).reshape(-1, 2), np.array(self._motions).reshape(-1, 4),
            np.array(self._information).reshape(-1, 3, 3), np.array(self._is_loop, bool), tolerance=_TOLERANCE,
            marginals=[len(self) - 1],
        )  # fmt: skip
        self._motors[: len(self)], self.covariance = found.motors, found.covariances[0]
        return found

    def n_bounded(self, found: OptimisedPoses) -> int:
        """Return how many closures of loops have lost more than three quarters of their weight."""
        return int((found.weights[np.array(self._is_loop, bool)] < 0.25).sum())
