"""Relocation over several scans: hypotheses that odometry carries on until the readings decide."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import pga2

from ..arguments import Reals
from .cells import Lines, cells_of
from .motions import are_near, length_and_angle, unit_motor
from .outlines import still_points
from .relocation import (
    Relocation,
    aligned_places,
    compared,
    different,
    found_places,
    nowhere,
    scores_of,
)
from .scan import Scan
from .status import MappingStatus

_CARRIED = 40
"""A limit on work: places that are carried on,"""
_REMEMBERED = 6
"""and scans by which they are judged."""
_NEW_VIEW, _NEW_TURN = 0.3, float(np.radians(20.0))
"""Metres or radians from the last scan from which on a scan counts as another view; nearer ones replace the last."""
_STILL = np.array([1.0, 0.0, 0.0, 0.0])
"""The motion of a robot that stands."""
_SLACK, _SLACK_ANGLE = np.array([0.15, 0.1]), np.array([float(np.radians(4.0)), 0.1])
"""How far the alignment may move a place that odometry predicts: metres and radians, and shares of the motion. Beyond
this, the place is that by odometry."""


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """A scan by which places are judged."""

    points: Reals
    motion: Reals
    """(4,) The motion from the previous view, by odometry."""


class Relocator:
    """Find the pose in a map of lines from a sequence of scans, without a prior.

    The first scan gives hypotheses, as `relocate` does. Odometry moves them to the next scans, which align and judge
    them, and add others, which are judged by the scans before as well. Rooms that look alike from one place differ from
    others, so that one hypothesis remains.

    Parameters
    ----------
    line_map : Lines
        A `LineMap`, or anything with its normals, offsets and ends.
    n_hypotheses : int
        The most poses to return.

    Raises
    ------
    ValueError
        If `n_hypotheses` is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from algorithms.mapping import FloorPlan, Relocator, simulate_scan
    >>> from generated import pga2
    >>> walls = [[[0, 0], [8, 0]], [[8, 0], [8, 5]], [[8, 5], [0, 5]], [[0, 5], [0, 0]], [[3, 0], [3, 2.2]]]
    >>> plan = FloorPlan.from_walls(walls)
    >>> step = pga2.motor_from_angle_translation(0.1, np.array([0.5, 0.0]))
    >>> pose, finder = pga2.motor_from_angle_translation(0.4, np.array([1.0, 1.0])), Relocator(plan.segments)
    >>> for k in range(3):
    ...     found = finder.add(simulate_scan(plan, pose, seed=k).scan, None if k == 0 else step)
    ...     truth, pose = pose, pga2.motor_product(pose, step)
    >>> found.status.name, bool(np.abs(found.motor - truth).max() < 0.02)
    ('OK', True)
    """

    def __init__(self, line_map: Lines, *, n_hypotheses: int = 5) -> None:
        if n_hypotheses < 1:
            raise ValueError(f"n_hypotheses: {n_hypotheses}; expected at least 1")
        self._map, self._cells, self._most = line_map, cells_of(line_map), n_hypotheses
        self._views: list[_View] = []
        self._motors, self._scores = np.zeros((0, 4)), np.zeros((0, 0))
        """The places of the last view (c, 4), and their scores in all views (c, v)."""
        self._information = np.zeros((0, 6))
        self._since = _STILL
        """The motion from the last view to the scan."""

    @property
    def n_views(self) -> int:
        """The number of different views by which the hypotheses are judged."""
        return len(self._views)

    def add(self, scan: Scan, motion: ArrayLike | None = None) -> Relocation:
        """Take the next scan.

        Parameters
        ----------
        scan : Scan
        motion : array_like, (4,), optional
            The motion from the previous scan by odometry: a unit motor of `generated.pga2`, the pose of this scan in
            the frame of the previous one. Without it the search begins again.

        Returns
        -------
        Relocation
            Of this scan, with scores that are means over the views. AMBIGUOUS until the views decide. A scan with too
            few readings moves the hypotheses by the odometry and has the status TOO_FEW_READINGS.

        Raises
        ------
        TypeError, ValueError
            If `scan` is no `Scan`, or the motion is no finite unit motor.
        """
        if not isinstance(scan, Scan):
            raise TypeError(f"scan: {type(scan).__name__}; expected a Scan")
        if motion is None:
            self._views, self._since = [], _STILL
        else:
            step = unit_motor(motion, "motion")
            self._since = np.asarray(pga2.normalize_motor(pga2.motor_product(self._since, step)))
        found = found_places(scan, self._cells, self._map)
        if found is MappingStatus.TOO_FEW_READINGS:
            return nowhere(MappingStatus.TOO_FEW_READINGS)
        points = still_points(scan)
        carried = self._carried(points)
        fresh = self._judged(found) if not isinstance(found, MappingStatus) else carried[:0]
        places = [each for each in (carried, fresh) if len(each)]
        if not places:
            return nowhere(MappingStatus.NOT_MATCHED)
        table = np.concatenate(places)
        means = table[:, 10:].mean(1)
        table = table[different(table[:, :4], means)[:_CARRIED]]
        self._motors, self._information, self._scores = table[:, :4], table[:, 4:10], table[:, 10:]
        return compared(self._motors, self._scores.mean(1), self._information, self._most, self._scores.shape[1])

    def _carried(self, points: Reals) -> Reals:
        """Return rows of places of a scan, their information and their scores, from the places of the last view."""
        if not self._views:
            self._views = [_View(points, self._since)]
            self._since = _STILL
            return np.zeros((0, 11))
        motors, scores, information = self._aligned(self._motors, points, self._since)
        length, angle = length_and_angle(self._since)
        before = self._scores
        motion = self._since
        if length < _NEW_VIEW and angle < _NEW_TURN:
            # The robot has hardly moved: the scan says again what the last one said.
            last = self._views.pop()
            before, motion = before[:, :-1], np.asarray(pga2.motor_product(last.motion, motion))
        self._views = [*self._views, _View(points, motion)][-_REMEMBERED:]
        self._since = _STILL
        scores = np.column_stack([before, scores])[:, -len(self._views) :]
        return np.column_stack([motors, information, scores])

    def _judged(self, found: tuple[Reals, Reals, Reals]) -> Reals:
        """Return rows, as `_carried` does, of places of the last view that all views judge."""
        motors, scores, information = found
        columns, there = [scores], motors
        for view, after in zip(self._views[-2::-1], self._views[:0:-1], strict=True):
            there, score, _ = self._aligned(there, view.points, np.asarray(pga2.motor_inverse(after.motion)))
            columns.append(score)
        return np.column_stack([motors, information, *columns[::-1]])

    def _aligned(self, motors: Reals, points: Reals, motion: Reals) -> tuple[Reals, Reals, Reals]:
        """Return places moved by odometry, aligned with the map unless that moves them too far, with their scores."""
        predicted = np.asarray(pga2.normalize_motor(pga2.motor_product(motors, motion)))
        aligned, scores, information = aligned_places(predicted, points, self._cells)
        length, angle = length_and_angle(motion)
        far = ~are_near(predicted, aligned, _SLACK @ [1, length], _SLACK_ANGLE @ [1, angle])
        if far.any():
            aligned[far] = predicted[far]
            scores[far] = scores_of(predicted[far], points, self._cells)
        return aligned, scores, information
