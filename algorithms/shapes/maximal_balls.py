"""Models of few balls: greedily chosen balls of the distance transform, refined in conformal space."""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike

from generated import sphere_models

from ..arguments import Reals, finite_number
from .rasterising import Mask, ball_in_grid, checked_mask, checked_spacing, filled
from .rasterising import overlap as overlap_of
from .sphere_status import BallStatus

_GROWTHS = (0.9, 0.6, 0.3, 0.0)
"""Lengths, in edges of voxels, by which balls may exceed the object: the first that reaches the overlap is used."""
_SLACK = 0.7
"""A ball is chosen if it adds this part of what the next one may add."""
_RIDGE = 0.1
"""Edges of a voxel by which the distance at a candidate may be less than that of its neighbours."""
_STEPS = (0.5, 0.35, 0.5, 0.25)
"""Edges of voxels by which a refinement changes centres and radii."""


@dataclass(frozen=True, eq=False)
class BallModel:
    """A model of an object by balls.

    Attributes
    ----------
    balls : array, (k, 4)
        Centres and radii, in the unit of the spacing; the centre of the first voxel is the origin.
    overlap : float
        The voxels in balls and mask divided by those in either, counted after the last step.
    status : BallStatus
    """

    balls: Reals
    overlap: float
    status: BallStatus


class _Choice:
    """The choice of balls one by one, by the number of voxels that each adds."""

    def __init__(self, inside: Mask, edges: Reals) -> None:
        self.inside, self.edges = inside, edges
        # The nearest outer voxel must not count as inside by rounding of the square of the distance.
        self.depth = scipy.ndimage.distance_transform_edt(inside, sampling=edges) * (1 - 1e-9)
        self.edge = float(np.prod(edges) ** (1 / 3))
        self.size = int(np.count_nonzero(inside))

    def run(self, growth: float, enough: float, most: int) -> tuple[list[Reals], float]:
        """Return balls that exceed the object by up to `growth`, and their overlap."""
        # The voxels of the object and outside of it that no ball has.
        self.open, self.outside = self.inside.copy(), ~self.inside
        self.hits = self.extra = 0
        self.balls: list[Reals] = []
        while not self._round(growth, enough, most):
            growth = growth / 2 if growth > 0.2 else 0.0
        return self.balls, self._overlap()

    def _overlap(self) -> float:
        return self.hits / (self.size + self.extra)

    def _candidates(self) -> Reals:
        """Return voxels that are ridges of the distance, at first of the object, later of what is not covered."""
        first = not self.balls
        depth = self.depth if first else np.where(self.open, self.depth, 0)
        ridge = depth >= scipy.ndimage.maximum_filter(depth, 3) - (_RIDGE * self.edge if first else 0)
        return np.argwhere(ridge & (depth > 0))

    def _round(self, growth: float, enough: float, most: int) -> bool:
        """Add balls about candidates until none is of use. Return whether that is all."""
        places = self._candidates()
        radii = self.depth[tuple(places.T)] + growth * self.edge
        # More than the number of voxels with a centre in the ball; later, the last count, which can only decrease.
        bounds = 5 * (radii / self.edge + 1) ** 3
        queue = [(-bound, i) for i, bound in enumerate(bounds.tolist())]
        heapq.heapify(queue)
        before = len(self.balls)
        while queue:
            _, i = heapq.heappop(queue)
            part, ball = ball_in_grid(places[i] * self.edges, float(radii[i]), self.inside.shape, self.edges)
            hits = int(np.count_nonzero(self.open[part] & ball))
            needed = -_SLACK * queue[0][0] if queue else 0
            # Voxels outside are counted only if those of the object are enough.
            gain = hits if hits < needed else hits - int(np.count_nonzero(self.outside[part] & ball))
            if gain <= 0:
                continue
            if gain < needed:
                heapq.heappush(queue, (-gain, i))
                continue
            self.hits, self.extra = self.hits + hits, self.extra + hits - gain
            for voxels in (self.open, self.outside):
                voxels[part] &= ~ball
            self.balls.append(np.array([*(places[i] * self.edges), radii[i]]))
            if self._overlap() >= enough or len(self.balls) >= most:
                return True
        return len(self.balls) == before and growth == 0


class _Refinement:
    """Changes of single balls that increase the overlap, and the removal of balls that are no longer needed."""

    def __init__(self, balls: Reals, inside: Mask, edges: Reals) -> None:
        self.balls, self.inside, self.edges = balls.copy(), inside, edges
        self.counts = np.zeros(inside.shape, np.int16)
        for ball in balls:
            self._change(ball, 1)
        self.size = int(np.count_nonzero(inside))

    def _grid(self, ball: Reals) -> tuple[tuple[slice, slice, slice], Mask]:
        return ball_in_grid(ball[:3], float(ball[3]), self.inside.shape, self.edges)

    def _change(self, ball: Reals, by: int) -> None:
        part, inside = self._grid(ball)
        self.counts[part] += inside.astype(np.int16) * np.int16(by)

    def gain(self, ball: Reals, others: int = 0) -> int:
        """Return the voxels in a ball that as many balls cover as stated: those of the object, less those outside."""
        part, inside = self._grid(ball)
        alone = inside & (self.counts[part] == others)
        hits = int(np.count_nonzero(alone & self.inside[part]))
        return 2 * hits - int(np.count_nonzero(alone))

    def _gains_of_moves(self, ball: Reals, moves: Reals) -> Reals:
        """Return the gains of balls that differ little from a ball, by the voxels around it that no ball covers."""
        reach = float(np.abs(moves).sum(1).max())
        part, inside = self._grid(ball + np.array([0.0, 0.0, 0.0, reach]))
        free = np.flatnonzero(inside & (self.counts[part] == 0))
        places = np.stack(np.unravel_index(free, inside.shape), 1) + [p.start for p in part]
        away = places * self.edges - ball[:3]
        # The square of the distance from a moved centre, from that of the first centre.
        square = (away**2).sum(1)[:, None] - 2 * away @ moves[:, :3].T + (moves[:, :3] ** 2).sum(1)
        within = square < np.maximum(ball[3] + moves[:, 3], 0) ** 2
        return np.asarray(np.where(self.inside[part].ravel()[free], 1.0, -1.0) @ within)

    def overlap(self) -> float:
        covered = self.counts > 0
        return overlap_of(covered, self.inside)

    def sweep(self, step: float) -> None:
        """Replace each ball by the best of small changes, one of which is the sphere fitted to its surface."""
        border = self.inside & ~scipy.ndimage.binary_erosion(self.inside)
        surface = np.argwhere(border) * self.edges
        tree = scipy.spatial.cKDTree(surface)
        moves = step * np.vstack([np.zeros(4), np.eye(4), -np.eye(4)])
        for i, ball in enumerate(self.balls):
            self._change(ball, -1)
            gains = self._gains_of_moves(ball, moves)
            best = int(np.argmax(gains))
            tried = ball + moves[best]
            points = surface[tree.query_ball_point(ball[:3], ball[3] + step)]
            points = points[np.abs(np.linalg.norm(points - ball[:3], axis=1) - ball[3]) < 2 * step]
            if len(points) > 3:
                fitted = np.asarray(sphere_models.ball_of_points(ball, points))
                if 0 < fitted[3] < 2 * ball[3] and self.gain(fitted) > gains[best]:
                    tried = fitted
            self.balls[i] = tried
            self._change(tried, 1)

    def prune(self, enough: float) -> None:
        """Remove balls with the smallest gains while the overlap remains sufficient."""
        covered = self.counts > 0
        hits = int(np.count_nonzero(covered & self.inside))
        extra = int(np.count_nonzero(covered)) - hits
        gains = [self.gain(ball, 1) for ball in self.balls]
        keep = np.ones(len(self.balls), bool)
        for i in np.argsort(gains, kind="stable"):
            self._change(self.balls[i], -1)
            part, inside = self._grid(self.balls[i])
            freed = inside & (self.counts[part] == 0)
            lost = int(np.count_nonzero(freed & self.inside[part]))
            less = int(np.count_nonzero(freed)) - lost
            if (hits - lost) / (self.size + extra - less) < enough:
                self._change(self.balls[i], 1)
                break
            keep[i], hits, extra = False, hits - lost, extra - less
        self.balls = self.balls[keep]


def fit_balls(
    mask: ArrayLike, overlap: float = 0.95, spacing: ArrayLike = (1, 1, 1), *, most: int = 20_000
) -> BallModel:
    """Model an object by few balls, and report the overlap that they reach.

    Balls touch the outside, or exceed it by less than a voxel. They are chosen greedily: each adds more voxels of the
    object, less those outside, than nearly all others would. The result is drawn and counted.

    Parameters
    ----------
    mask : array_like, three axes
        The object, where voxels are not zero. Beyond the border is outside.
    overlap : float, optional
        The requested overlap, between 0 and 1.
    spacing : array_like, (3,), optional
        The edges of a voxel.
    most : int, optional
        The largest number of balls.

    Returns
    -------
    BallModel
        With the status LIMIT_REACHED if `most` balls do not reach the overlap.
    """
    inside, edges = checked_mask(mask), checked_spacing(spacing)
    enough = finite_number(overlap, "overlap")
    if not 0 < enough < 1:
        raise ValueError(f"overlap: {enough}; expected a number between 0 and 1")
    if isinstance(most, bool) or not isinstance(most, (int, np.integer)) or most < 1:
        raise ValueError(f"most: {most!r}; expected a positive number of balls")
    padded = np.pad(inside, 2)
    choice = _Choice(padded, edges)
    best: tuple[Reals, float] = (np.zeros((0, 4)), 0.0)
    for growth in _GROWTHS:
        balls, reached = choice.run(growth, enough, int(most))
        if reached > best[1]:
            best = np.array(balls), reached
        if reached >= enough:
            break
    return _counted(best[0], padded, edges, enough)


def _counted(balls: Reals, padded: Mask, edges: Reals, enough: float) -> BallModel:
    """Refine balls if they reach the overlap, and count what the result covers."""
    shape = padded.shape
    if overlap_of(filled(balls, shape, edges), padded) >= enough:
        refinement = _Refinement(balls, padded, edges)
        for step in _STEPS:
            refinement.sweep(step * float(np.prod(edges) ** (1 / 3)))
            refinement.prune(enough)
        balls = refinement.balls
    found = overlap_of(filled(balls, shape, edges), padded)
    shifted = balls - np.array([*(2 * edges), 0.0])
    return BallModel(shifted, found, BallStatus.OK if found >= enough else BallStatus.LIMIT_REACHED)


def maximal_balls(mask: ArrayLike, overlap: float = 0.95, spacing: ArrayLike = (1, 1, 1)) -> Reals:
    """Return balls (k, 4), centres and radii in the unit of the spacing, that overlap an object by a given part.

    See `fit_balls`, which also returns the overlap.

    Raises
    ------
    ValueError
        If 20,000 balls do not reach the overlap. The message gives what they reach.
    """
    model = fit_balls(mask, overlap, spacing)
    if model.status is not BallStatus.OK:
        raise ValueError(
            f"overlap: {len(model.balls)} balls reach {model.overlap:.4f}; expected {overlap}; request less, or call "
            "fit_balls, which returns these balls"
        )
    return model.balls
