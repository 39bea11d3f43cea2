"""Landmarks that are learned from some views and recognised in others: points of a plane, by their p2-invariants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from generated import projective2

from ..arguments import Reals, finite_number, real_array
from .invariants import each_pencil
from .landmark_loops import unlikeness
from .normalization import flatness, homogeneous, normalized, undone
from .planes import linear_homography
from .status import DegenerateError, VisionStatus

_LEARNED, _ASKED, _TRUSTED = 60, 32, 500
"""So many sets of five points of a landmark are kept, and of a query compared; so many pairs of both are followed."""
_LEAST = 8
"""Any four points go onto any other four: fewer points than this are too often alike by chance."""
_LIMIT, _FAR = 2.5, 2.0
"""Landmarks fit up to so many times the noise; single points up to the root of so many times that."""
_FLAT = 1e-3
_ALIKE, _DAMPING = 1e-12, 1e-12
"""What rounding adds to variances of invariants, and to sums of squares of equations."""
_TRIED = 10
"""So many of the best maps are fitted again to all points that they bring together."""


@dataclass(frozen=True, slots=True, eq=False)
class Recognition:
    """Which landmark is seen."""

    landmark: int
    """Its place in the map; -1 where the status is not OK."""
    status: VisionStatus
    """NO_CONSENSUS where no landmark fits."""
    distance: float
    """The root of the mean square of the angles between points that are seen and those of the landmark, in radians."""
    matches: Reals
    """(n,) int, for each point that is seen that of the landmark, or -1."""


@dataclass(frozen=True, slots=True, eq=False)
class LandmarkMap:
    """Landmarks, and the invariants of five of their points each to find them by."""

    points: Reals
    """(m, k, 2) Of each landmark, in some image of its plane; NaN behind the last of fewer than k."""
    invariants: Reals
    """(s, 5) p2-invariants of sets of five points."""
    deviations: Reals
    """(s, 5) How far noise of 1 of the points moves these, by derivatives."""
    sets: Reals
    """(s, 6) int: the landmark, and its five points in the order of their invariants."""

    @classmethod
    def learn(cls, landmarks: Sequence[ArrayLike]) -> LandmarkMap:
        """Landmarks from views of each.

        All views of a landmark are brought onto the first by homographies and their mean is kept.

        Parameters
        ----------
        landmarks : sequence of array_like, (v, n, 3)
            For each landmark the directions in which its n points, at least eight of a plane, are seen in v views, in
            the same order and in one half of space; those of `OmnidirectionalCamera.directions` for example.

        Raises
        ------
        TypeError, ValueError
            Where these are not views of points.
        DegenerateError
            Where points are too few, not finite, on a line, or not in one half of space.
        """
        shapes = [_learned(each, f"landmarks[{k}]") for k, each in enumerate(landmarks)]
        width = max((len(shape) for shape in shapes), default=0)
        points = np.full((len(shapes), width, 2), np.nan)
        found, moved, sets = [np.empty((0, 5))], [np.empty((0, 5))], [np.empty((0, 6), int)]
        for k, shape in enumerate(shapes):
            points[k, : len(shape)] = shape
            values, deviations, orders = _signatures(shape, _LEARNED)
            found.append(values)
            moved.append(deviations)
            sets.append(np.column_stack([np.full(len(orders), k), orders]))
        return cls(points, np.concatenate(found), np.concatenate(moved), np.concatenate(sets))

    def recognize(self, directions: ArrayLike, noise: float) -> Recognition:
        """The landmark whose points are seen.

        Sets of five points with the invariants of some that were learned propose a landmark and a homography, which all
        points then judge.

        Parameters
        ----------
        directions : array_like, (n, 3)
            In any order, eight and more.
        noise : float
            Of directions, in radians: that of a pixel by the focal length. A landmark is recognised where the root mean
            square of angles is up to 2.5 times that, and three quarters of its points, at least eight, are seen.

        Returns
        -------
        Recognition
            DEGENERATE for points on a line or not in one half of space.

        Raises
        ------
        TypeError, ValueError
            Where these are not directions, or `noise` is not a positive number.
        """
        array = real_array(directions, "directions", (-1, 3), "x y z")
        if array.ndim != 2:
            raise ValueError(f"directions: shape {array.shape}; expected (n, 3), one set")
        size = finite_number(noise, "noise")
        if size <= 0:
            raise ValueError(f"noise: {size}; expected more than 0 radians")
        nobody = np.full(len(array), -1)
        if len(array) < _LEAST or not len(self.sets):
            return Recognition(-1, VisionStatus.TOO_FEW, np.nan, nobody)
        if not np.isfinite(array).all():
            return Recognition(-1, VisionStatus.NOT_FINITE, np.nan, nobody)
        seen = _flat(array)
        if seen is None or flatness(seen) <= _FLAT:
            return Recognition(-1, VisionStatus.DEGENERATE, np.nan, nobody)
        values, deviations, orders = _signatures(seen, _ASKED)
        if not len(values):
            return Recognition(-1, VisionStatus.DEGENERATE, np.nan, nobody)
        # Likelihoods of all pairs of sets: differences by their noise, and the size of that noise.
        unlike = unlikeness(values, deviations, self.invariants, self.deviations, size**2, _ALIKE).ravel()
        near = np.argpartition(unlike, min(_TRUSTED, unlike.size) - 1)[:_TRUSTED]
        of_query, of_map = np.divmod(near, len(self.sets))
        who, places = self.sets[of_map, 0], self.sets[of_map, 1:]
        maps = _proposed(self.points[who[:, None], places], seen[orders[of_query]])
        limit = _LIMIT * size
        costs, _ = self._judged(who, maps, seen, limit)
        best = np.argsort(costs)[:_TRIED]
        results = [self._fitted(int(who[k]), maps[k], seen, limit) for k in best]
        cost, landmark, matches, distance = min(results, key=lambda result: result[0])
        enough = (matches >= 0).sum() >= max(0.75 * np.isfinite(self.points[landmark, :, 0]).sum(), _LEAST)
        if not enough or not distance <= limit or not np.isfinite(cost):
            return Recognition(-1, VisionStatus.NO_CONSENSUS, np.nan, nobody)
        return Recognition(landmark, VisionStatus.OK, distance, matches)

    def _judged(self, who: Reals, maps: Reals, seen: Reals, limit: float) -> tuple[Reals, Reals]:
        """Truncated mean squares of distances of all points of landmarks from the next that is seen, and these."""
        with np.errstate(divide="ignore", invalid="ignore"):
            there = projective2.transform_point(maps[:, None], self.points[who])
            squares = ((there[:, :, None] - seen) ** 2).sum(-1)
        squares = np.where(np.isfinite(squares), squares, np.inf)
        known = np.isfinite(self.points[who, :, 0])
        least = np.minimum(squares.min(-1), _FAR * limit**2) * known
        return least.sum(-1) / known.sum(-1), squares

    def _fitted(self, landmark: int, matrix: Reals, seen: Reals, limit: float) -> tuple[float, int, Reals, float]:
        """A map fitted again, twice, to all points that it brings together, and what remains."""
        matches, distance, cost = np.full(len(seen), -1), np.inf, np.inf
        for turn in range(3):
            costs, squares = self._judged(np.array([landmark]), matrix[None], seen, limit)
            nearest = squares[0].argmin(0)
            close = (squares[0].min(0) <= _FAR * limit**2) & (squares[0].argmin(1)[nearest] == np.arange(len(seen)))
            if close.sum() < 5:
                break
            before, matches, cost = matches, np.where(close, nearest, -1), float(costs[0])
            distance = float(np.sqrt(squares[0].min(0)[close].mean()))
            if turn and np.array_equal(matches, before):
                break  # The map is fitted to these.
            matrix, _ = linear_homography(self.points[landmark, nearest[close]], seen[close])
        return cost, landmark, matches, distance


def _proposed(first: Reals, second: Reals) -> Reals:
    """Homographies of sets of five points, for those that take no point of the middle of the first to infinity."""
    one, scale = normalized(first)
    two, other = normalized(second)
    rows = projective2.homography_equations(one, two).reshape(len(first), -1, 9)
    normal = np.swapaxes(rows, -1, -2) @ rows
    normal[:, range(8), range(8)] += _DAMPING
    found = np.linalg.solve(normal[:, :8, :8], -normal[:, :8, 8:])[..., 0]
    matrix = np.insert(found, 8, 1.0, axis=-1).reshape(-1, 3, 3)
    return np.asarray(undone(other) @ matrix @ scale)


def _flat(directions: Reals) -> Reals | None:
    """Where directions meet the plane at distance 1 across their mean; None if some do not."""
    unit = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    mean = unit.mean(-2)
    length = np.linalg.norm(mean)
    if not length > 1e-6:
        return None
    axis = mean / length
    frame = np.linalg.svd(axis[None])[2]
    across = unit @ frame[1:].T
    along = unit @ axis
    return np.asarray(across / along[:, None]) if (along > 0.05).all() else None


def _learned(views: ArrayLike, name: str) -> Reals:
    array = real_array(views, name, (-1, -1, 3), "views, points, x y z")
    if array.ndim != 3 or not len(array):
        raise ValueError(f"{name}: shape {array.shape}; expected (v, n, 3), views of one landmark")
    expected = f"{name}: expected at least 8 finite points of a plane in one half of space"
    if array.shape[1] < _LEAST:
        raise DegenerateError(f"{expected}; found {array.shape[1]}", VisionStatus.TOO_FEW)
    if not np.isfinite(array).all():
        raise DegenerateError(f"{expected}; found numbers that are not finite", VisionStatus.NOT_FINITE)
    flat = [_flat(view) for view in array]
    if any(each is None or flatness(each) <= _FLAT for each in flat):
        raise DegenerateError(f"{expected}; found others", VisionStatus.DEGENERATE)
    images = np.array(flat)
    maps, _ = linear_homography(images, np.broadcast_to(images[0], images.shape))
    return np.asarray(projective2.transform_point(maps[:, None], images).mean(0))


def _signatures(points: Reals, most: int) -> tuple[Reals, Reals, Reals]:
    """p2-invariants (s, 5) of sets of five points, how noise of 1 moves them, and the points in order.

    Of the sets farthest from having three points on a line.
    """
    sets = np.array(list(combinations(range(len(points)), 5)))
    scaled, matrix = normalized(points)
    scaled = homogeneous(scaled)
    corners = list(combinations(range(5), 3))
    five = scaled[sets]
    areas = np.stack([projective2.bracket(five[:, i], five[:, j], five[:, k]) for i, j, k in corners], -1)
    best = np.argsort(-np.abs(areas).min(-1), kind="stable")[:most]
    five, sets = five[best], sets[best]
    values = each_pencil(five)
    steps = np.zeros((10, 5, 3))
    steps[np.arange(10), np.arange(10) // 2, np.arange(10) % 2] = 1e-4
    slopes = (each_pencil(five[:, None] + steps) - each_pencil(five[:, None] - steps)) / 2e-4
    deviations = matrix[0, 0] * np.linalg.norm(slopes, axis=1)
    usable = np.isfinite(values).all(-1) & np.isfinite(deviations).all(-1)
    values, deviations, sets = values[usable], deviations[usable], sets[usable]
    order = np.argsort(values, -1)
    return tuple(np.take_along_axis(each, order, -1) for each in (values, deviations, sets))  # type: ignore[return-value]
