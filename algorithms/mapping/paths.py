"""Paths of lines and arcs, as unit vectors of conformal space: one formula gives the distance from both."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import cga2, pga2
from generated import navigation as kernels

from ..arguments import Reals, real_array
from .navigation_status import PathStatus

_LARGEST_TURN = np.pi - 1e-3
"""rad; no arc touches both lines of a path that turns back."""


class Located(NamedTuple):
    """The points of a path that are nearest to points."""

    distance: Reals
    """(...) Signed distances from the path, positive on its left; infinite if nothing was in range."""
    position: Reals
    """(...) Metres along the path."""
    piece: Reals
    """(...) int. Indices of pieces, or -1."""


@dataclass(frozen=True, eq=False)
class PlanarPath:
    """A path of lines and arcs without corners.

    Attributes
    ----------
    starts : array, (n, 4)
        Poses at the starts of the pieces, as motors of `generated.pga2`; the x axis is the direction of the path.
    curvatures : array, (n,)
        1/m, positive where the path turns left, 0 for lines.
    lengths : array, (n,)
        Metres.
    status : PathStatus
        A path whose status is not OK has no piece.
    """

    starts: Reals
    curvatures: Reals
    lengths: Reals
    status: PathStatus

    @classmethod
    def from_pieces(cls, start: ArrayLike, lengths: ArrayLike, radii: ArrayLike) -> PlanarPath:
        """Construct a path from the lengths of its pieces and the radii of its arcs.

        Parameters
        ----------
        start : array_like, (4,)
            The pose at the start.
        lengths : array_like, (n,)
            Pieces whose length is not positive are left out.
        radii : array_like, (n,)
            Positive for left turns, negative for right turns, infinite for lines. An arc has less than a full turn.

        Raises
        ------
        TypeError, ValueError
            If an argument has a different shape or type, or an arc has a full turn.
        """
        pose = real_array(start, "start", (4,), "a motor").astype(float)
        pieces = real_array(lengths, "lengths", (-1,)).astype(float)
        bends = real_array(radii, "radii", (len(pieces),)).astype(float)
        keep = ~(pieces <= 0)
        pieces, bends = pieces[keep], bends[keep]
        if not (np.isfinite(pieces).all() and np.isfinite(pose).all()) or np.isnan(bends).any():
            return _nothing(PathStatus.NOT_FINITE)
        if not len(pieces):
            return _nothing(PathStatus.EMPTY)
        if not bends.all():
            return _nothing(PathStatus.ZERO_RADIUS)
        curvatures = 1 / bends
        turns = np.abs(curvatures * pieces)
        if (turns >= 2 * np.pi).any():
            at = int(np.argmax(turns))
            raise ValueError(f"lengths: piece {at} turns by {turns[at]} rad; expected less than a full turn; divide it")
        starts = [pose]
        for step in _along(curvatures, pieces):
            starts.append(np.asarray(pga2.normalize_motor(pga2.motor_product(starts[-1], step))))
        return cls(np.array(starts[:-1]), curvatures, pieces, PathStatus.OK)

    @classmethod
    def through(cls, points: ArrayLike, radius: float) -> PlanarPath:
        """Construct a path along a chain of points, whose corners are arcs that touch both lines.

        Parameters
        ----------
        points : array_like, (n, 2)
            Points that coincide with their predecessor are left out.
        radius : float
            Of the arcs, in metres. It is smaller where a line is too short. The status is ZERO_RADIUS if it is not
            positive, or if the path turns back.

        Raises
        ------
        TypeError, ValueError
            If an argument has a different shape or type.
        """
        corners = real_array(points, "points", (2,), "points").astype(float).reshape(-1, 2)
        if not (np.isfinite(corners).all() and np.isfinite(radius)):
            return _nothing(PathStatus.NOT_FINITE)
        steps = np.diff(corners, axis=0)
        moved = np.hypot(*steps.T) > 0
        if not moved.any():
            return _nothing(PathStatus.EMPTY)
        steps = steps[moved]
        lengths = np.hypot(*steps.T)
        headings = np.arctan2(steps[:, 1], steps[:, 0])
        turns = (np.diff(headings) + np.pi) % (2 * np.pi) - np.pi
        if (radius <= 0 and turns.any()) or (np.abs(turns) > _LARGEST_TURN).any():
            return _nothing(PathStatus.ZERO_RADIUS)
        # The arc of a corner begins before it and ends behind it at this distance.
        slopes = np.tan(np.abs(turns) / 2)
        room = np.minimum(lengths[:-1], lengths[1:]) / 2
        room[:1] = np.minimum(lengths[:-1], np.maximum(room, lengths[1:] / 2))[:1]
        cuts = np.minimum(radius * slopes, room)
        before, after = np.append(cuts, 0.0), np.append(0.0, cuts)
        straight = lengths - before - after
        with np.errstate(invalid="ignore", divide="ignore"):
            radii = np.where(turns == 0, np.inf, np.sign(turns) * cuts / slopes)
        arcs = np.where(turns == 0, 0.0, np.abs(np.where(turns == 0, 1.0, radii) * turns))
        pieces, bends = np.empty(2 * len(lengths) - 1), np.full(2 * len(lengths) - 1, np.inf)
        pieces[::2], pieces[1::2], bends[1::2] = straight, arcs, radii
        begin = pga2.motor_from_angle_translation(headings[0], corners[:-1][moved][0])
        return cls.from_pieces(begin, np.where(pieces < 1e-12, 0.0, pieces), bends)

    @property
    def length(self) -> float:
        """The length of the path in metres."""
        return float(self.lengths.sum())

    @property
    def positions(self) -> Reals:
        """(n,) The positions of the starts of the pieces along the path."""
        return np.asarray(np.cumsum(self.lengths) - self.lengths)

    @property
    def vectors(self) -> Reals:
        """(n, 4) Dual lines and dual circles of `generated.cga2` with square 1, positive on the left of the path."""
        angles, shifts = pga2.motor_to_angle_translation(self.starts)
        motors = cga2.motor_from_rotor_translation(cga2.rotor_from_angle(angles), shifts)
        # At the origin, along the x axis, a line is e2, and an arc with the curvature k is e2 + k e0.
        n = len(self.lengths)
        local = np.stack([np.zeros(n), np.ones(n), self.curvatures, np.zeros(n)], 1)
        return np.asarray(cga2.move_vector(motors, local))

    def pose(self, position: ArrayLike) -> Reals:
        """Return poses (..., 4) at positions along the path, which are limited to it.

        Raises
        ------
        ValueError
            If the path has no piece.
        """
        if not len(self.lengths):
            raise ValueError(f"path: status {self.status.name}; expected a path with pieces")
        place = np.clip(real_array(position, "position").astype(float), 0, self.length)
        begins = self.positions
        piece = np.maximum(np.searchsorted(begins, place, side="right") - 1, 0)
        step = _along(self.curvatures[piece], place - begins[piece])
        return np.asarray(pga2.motor_product(self.starts[piece], step))

    def curvature(self, position: ArrayLike) -> Reals:
        """Return the curvature (...) at positions along the path."""
        place = np.clip(real_array(position, "position").astype(float), 0, self.length)
        piece = np.maximum(np.searchsorted(self.positions, place, side="right") - 1, 0)
        return np.asarray(self.curvatures[piece])

    def locate(self, points: ArrayLike, low: float = -1e29, high: float = 1e29) -> Located:
        """Return the nearest points of the path, at positions from `low` to `high`, to points (..., 2)."""
        places = real_array(points, "points", (2,), "points").astype(float)
        angles, shifts = (np.asarray(x) for x in pga2.motor_to_angle_translation(self.starts))
        starts = np.concatenate([shifts, np.cos(angles)[:, None], np.sin(angles)[:, None]], 1)
        spans = np.stack([self.positions, self.lengths], 1)
        distance, position, piece = kernels.nearest_on_path(places, self.vectors, starts, spans, low, high)
        rows = np.asarray(piece).astype(int)
        return Located(np.where(rows < 0, np.inf, distance), np.asarray(position), rows)


def _along(curvatures: Reals, lengths: Reals) -> Reals:
    """Return motions (..., 4) along arcs from the origin, ahead along the x axis."""
    ahead = np.stack([lengths, np.zeros_like(lengths)], -1)
    return np.asarray(pga2.motor_from_twist(pga2.twist_from_velocities(curvatures * lengths, ahead)))


def _nothing(status: PathStatus) -> PlanarPath:
    return PlanarPath(np.zeros((0, 4)), np.zeros(0), np.zeros(0), status)
