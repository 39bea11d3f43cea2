"""How sure a motion is among all that odometry leaves possible, by what they explain of a scan."""

from __future__ import annotations

import numpy as np

from generated import mapping as kernels
from generated import pga2

from ..arguments import Reals
from ..evidence import WRONG
from .motions import relative
from .narrow_objects import JOINED, NARROW
from .surfaces import Reference, Surface

_CELL, _COARSE = 0.1, 3
"""Metres of cells, and about those by which the motions that are compared differ; cells along an edge of larger ones,
within which readings have known surfaces near by."""
RARE = 3.3
"""From a probability: deviations that a number exceeds with a probability of a thousandth."""
_MOST_POINTS, _STEPS = 90, (3, 6)
"""Limits on work: readings that are compared, and the least and the most steps in each direction."""


class Rivals:
    """What a scan says of the motions that odometry leaves possible.

    Parameters
    ----------
    reference : Reference
    seen : Surface
        In the frame of the robot.
    prior : array, (4,)
        The pose by odometry.
    information : array, (3, 3)
        The inverse covariance of its angle, x and y.

    Notes
    -----
    Readings are on known surfaces with one probability at the right motion, and with another one by chance: the largest
    share and the mean share of the motions that are compared. Wheels slip with the probability `WRONG`, so that no
    motion is less likely than that by odometry alone.
    """

    def __init__(self, reference: Reference, seen: Surface, prior: Reals, information: Reals) -> None:
        every = 1 + len(seen.points) // _MOST_POINTS
        self._points = np.ascontiguousarray(seen.points[::every])
        self._counts = np.add.reduceat(_independent(seen.points), np.arange(0, len(seen.points), every))
        self._low = reference.points.min(0) - 2 * _CELL
        cells = np.floor((reference.points - self._low) / _CELL).astype(int)
        self._walls, self._known = _occupied(cells), _occupied(cells // _COARSE + 1)
        arm = float(np.median(np.hypot(*self._points.T)))
        units = np.array([_CELL / max(arm, _CELL), _CELL, _CELL])
        reach = RARE * np.sqrt(np.diag(np.linalg.inv(information)))
        n = np.clip(np.ceil(reach / units), *_STEPS).astype(int)
        self._steps = np.maximum(reach / n, units)
        sides = (step * np.arange(-k, k + 1) for step, k in zip(self._steps, n, strict=True))
        off = np.stack(np.meshgrid(*sides, indexing="ij"), -1).reshape(-1, 3)
        self._prior, self._information = prior, information
        self._motors = np.asarray(pga2.motor_product(prior, pga2.motor_from_angle_translation(off[:, 0], off[:, 1:])))
        self._found = self._compared(self._motors)
        self._by_odometry = self._log_prior(off)

    @property
    def best(self) -> Reals:
        """(4,) The most likely motion."""
        scores = self._by_odometry + self._likelihoods(self._found, self._found)
        return np.asarray(self._motors[int(scores.argmax())])

    def is_slip(self, motor: Reals) -> bool:
        """Return whether wheels slip more often than odometry errs that much."""
        return bool(self._log_prior(_between(self._prior, motor[None]))[0] <= np.log(WRONG))

    def are_unlike(self, motor: Reals, other: Reals) -> bool:
        """Return whether a motion explains so many more readings than another that this one is wrong."""
        found = self._compared(np.stack([motor, other]))
        one, two = self._likelihoods(found, np.concatenate([self._found, found]))
        return bool(one - two > -np.log(WRONG))

    def around(self, motor: Reals) -> tuple[Reals, Reals]:
        """Return the mean motion and its covariance (3, 3) by those that differ from the one that was found."""
        found = np.concatenate([self._found, self._compared(motor[None])])
        own = self._log_prior(_between(self._prior, motor[None]))
        off = np.concatenate([_between(motor, self._motors), np.zeros((1, 3))])
        off[(np.abs(off) < 1.5 * self._steps).all(1)] = 0
        scores = np.append(self._by_odometry, own) + self._likelihoods(found, found)
        weights = np.exp(scores - scores.max())
        weights /= weights.sum()
        mean = weights @ off
        spread = (off * weights[:, None]).T @ off - np.outer(mean, mean)
        return np.asarray(pga2.motor_product(motor, pga2.motor_from_angle_translation(mean[0], mean[1:]))), spread

    def _compared(self, motors: Reals) -> Reals:
        """Return how many readings are on known surfaces and how many are beside them, (k, 2), for motions (k, 4)."""
        cells = np.floor((np.asarray(kernels.moved_points(motors, self._points)) - self._low) / _CELL).astype(int)
        cells = np.where(((cells >= 0) & (cells < self._walls.shape)).all(-1, keepdims=True), cells, 0)
        on = self._walls[cells[..., 0], cells[..., 1]]
        cells = cells // _COARSE + 1
        return np.stack([on @ self._counts, (self._known[cells[..., 0], cells[..., 1]] & ~on) @ self._counts], -1)

    def _log_prior(self, off: Reals) -> Reals:
        return np.asarray(np.maximum(-0.5 * np.einsum("ki,ij,kj->k", off, self._information, off), np.log(WRONG)))

    def _likelihoods(self, found: Reals, among: Reals) -> Reals:
        """Return logarithms of likelihoods of counts (k, 2): what is not known yet says nothing."""
        on, total = among[:, 0], among.sum(1)
        shares = (on + 0.5) / (total + 1)
        right, chance = shares.max(), float((self._found[:, 0].sum() + 0.5) / (self._found.sum() + 1))
        return np.asarray(found @ np.log([right / chance, (1 - right) / (1 - chance)]))


def _between(motor: Reals, motors: Reals) -> Reals:
    """Return angles, x and y (k, 3) of motions after another one."""
    angles, shifts = pga2.motor_to_angle_translation(relative(motor, motors))
    return np.column_stack([angles, shifts])


def _independent(points: Reals) -> Reals:
    """Return how many independent readings each of the points (n, 2) in sequence counts for.

    People and furniture move as a whole, so that readings of one object, or of a part of a wall as wide as people, are
    on known surfaces together or not at all. Between readings that are farther apart than cells, walls are not known.
    """
    steps = np.hypot(*np.diff(points, axis=0).T)
    is_dense = np.append(steps, np.inf) < _COARSE * _CELL
    is_dense[1:] |= is_dense[:-1]
    begins = np.concatenate([[0], np.flatnonzero(steps > JOINED) + 1])
    lengths = np.add.reduceat(np.append(np.where(steps > JOINED, 0, steps), 0.0), begins)
    counts = np.diff([*begins, len(points)])
    return np.asarray(is_dense * np.repeat(np.minimum(np.maximum(lengths / NARROW, 1) / counts, 1), counts))


def _occupied(cells: Reals) -> Reals:
    """Return a grid whose cells say whether they, or one beside them, are among those (n, 2) of points."""
    grid = np.zeros(cells.max(0) + 3, bool)
    for i in (-1, 0, 1):
        for j in (-1, 0, 1):
            grid[cells[:, 0] + i, cells[:, 1] + j] = True
    return grid
