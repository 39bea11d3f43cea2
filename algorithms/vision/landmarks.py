"""Landmarks of coplanar points that are learned from some views and recognised in others by their p2-invariants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import projective2

from ..arguments import Reals, finite_number, real_array
from ..evidence import WRONG, Noise, likely
from ..precision import ROUNDING
from .invariants import each_pencil
from .normalization import extents, flatness, homogeneous, normalized, undone
from .planes import linear_homography
from .status import DegenerateError, VisionStatus

_LEARNED, _COMPARED, _TRUSTED = 90, 40, 3000
"""Numbers of sets of five points that are kept of a landmark and compared of a query, and of pairs of both that are
followed. If two of ten points are hidden, a fifth of the kept sets is seen, and others rank before them by chance."""
_LEAST = 8
"""Minimum number of points. Any four points can be mapped to any other four: fewer points match too often by chance."""
_LIMIT, _FAR = 2.5, 4.0
"""Landmarks fit up to the first multiple of the noise; single points up to the root of the second multiple of that."""
_FLAT = 1e-3
"""Directions are on a line if their second extent is less than this part of the first."""
_FIRST, _TRIED = 8, 40
"""Number of the best maps that are fitted again to all points that they match; and, if none fits, of further ones."""


@dataclass(frozen=True, slots=True, eq=False)
class Recognition:
    """Result of `LandmarkMap.recognize`."""

    landmark: int
    """Index of the landmark in the map; -1 if the status is not OK."""
    status: VisionStatus
    """NO_CONSENSUS if no landmark fits, AMBIGUOUS if the data do not separate two of them."""
    distance: float
    """The root mean square of the angles between points that are seen and those of the landmark, in radians."""
    matches: Reals
    """(n,) int, the point of the landmark for each point that is seen, or -1."""


class _Fit(NamedTuple):
    """A landmark mapped to the observed points."""

    cost: float
    landmark: int
    matches: Reals
    distance: float
    farthest: float
    """The largest angle between matched points."""


@dataclass(frozen=True, slots=True, eq=False)
class LandmarkMap:
    """Landmarks, and the invariants of sets of five of their points by which they are recognised."""

    points: Reals
    """(m, k, 2) Points of each landmark, in some image of its plane; padded with NaN if there are fewer than k."""
    invariants: Reals
    """(s, 5) p2-invariants of sets of five points."""
    deviations: Reals
    """(s, 5) Standard deviations of these for points with noise of 1, from derivatives."""
    sets: Reals
    """(s, 6) int: the landmark, and its five points in the order of their invariants."""
    errors: Reals
    """(m,) Standard error of the points of each landmark relative to their spread; NaN if there was only one view."""

    @classmethod
    def learn(cls, landmarks: Sequence[ArrayLike]) -> LandmarkMap:
        """Learn landmarks from views of each.

        All views of a landmark are mapped to one of them by homographies, and their mean is stored.

        Parameters
        ----------
        landmarks : sequence of array_like, (v, n, 3)
            For each landmark, the directions of its n coplanar points, at least eight, in v views, in the same order
            and in one half-space; for example results of `OmnidirectionalCamera.directions`.

        Raises
        ------
        TypeError, ValueError
            If these are not views of points.
        DegenerateError
            If points are too few, not finite, on a line, or not in one half-space.
        """
        pairs = [_learned(each, f"landmarks[{k}]") for k, each in enumerate(landmarks)]
        shapes = [shape for shape, _ in pairs]
        width = max((len(shape) for shape in shapes), default=0)
        points = np.full((len(shapes), width, 2), np.nan)
        found, moved, sets = [np.empty((0, 5))], [np.empty((0, 5))], [np.empty((0, 6), int)]
        for k, shape in enumerate(shapes):
            points[k, : len(shape)] = shape
            values, deviations, orders = _signatures(shape, _LEARNED)
            found.append(values)
            moved.append(deviations)
            sets.append(np.column_stack([np.full(len(orders), k), orders]))
        errors = np.array([error for _, error in pairs])
        return cls(points, np.concatenate(found), np.concatenate(moved), np.concatenate(sets), errors)

    def recognize(self, directions: ArrayLike, noise: float) -> Recognition:
        """Recognise the landmark whose points are seen.

        Sets of five points with the invariants of learned sets propose landmarks and homographies, which are then
        tested with all points.

        Parameters
        ----------
        directions : array_like, (n, 3)
            Directions in any order, at least eight.
        noise : float
            Standard deviation of directions, in radians: that of a pixel divided by the focal length. A landmark is
            recognised if the root mean square of angles is at most 2.5 times the combination of this noise and the
            error of the learned points, and if three quarters of its points, at least eight, are seen. With noise of 1
            pixel and 50 landmarks of ten points with five views each, 98 % are recognised if all points are seen, and
            93 % if eight are; none was confused with another.

        Returns
        -------
        Recognition
            The status is DEGENERATE for points on a line or not in one half-space.

        Raises
        ------
        TypeError, ValueError
            If `directions` are not directions, or if `noise` is not a positive number.
        """
        array = real_array(directions, "directions", (-1, 3), "directions")
        if array.ndim != 2:
            raise ValueError(f"directions: shape {array.shape}; expected (n, 3), one set")
        size = finite_number(noise, "noise")
        if size <= 0:
            raise ValueError(f"noise: {size}; expected more than 0 radians")
        unmatched = np.full(len(array), -1)
        if len(array) < _LEAST or not len(self.sets):
            return Recognition(-1, VisionStatus.TOO_FEW, np.nan, unmatched)
        if not np.isfinite(array).all():
            return Recognition(-1, VisionStatus.NOT_FINITE, np.nan, unmatched)
        seen = _flat(array)
        if seen is None or flatness(seen) <= _FLAT:
            return Recognition(-1, VisionStatus.DEGENERATE, np.nan, unmatched)
        values, deviations, orders = _signatures(seen, _COMPARED)
        if not len(values):
            return Recognition(-1, VisionStatus.DEGENERATE, np.nan, unmatched)
        # Likelihoods of all pairs of sets: differences relative to their noise, and the size of that noise.
        compared, moved = values[:, None], deviations[:, None]
        pairs = compared, self.invariants, moved, self.deviations
        unlike = projective2.unlikeness(*pairs, size**2, ROUNDING).ravel()
        near = np.argpartition(unlike, min(_TRUSTED, unlike.size) - 1)[:_TRUSTED]
        of_query, learned = np.divmod(near, len(self.sets))
        who, places = self.sets[learned, 0], self.sets[learned, 1:]
        maps = _proposed(self.points[who[:, None], places], seen[orders[of_query]])
        # The noise of a single learned view is assumed to be that of this one.
        of_map = np.where(np.isnan(self.errors), size / _spread(self.points), self.errors) * _spread(seen)
        limits = _LIMIT * np.hypot(size, of_map)
        costs, _ = self._judged(who, maps, seen, limits[who])
        order, fitting = np.argsort(costs), list[_Fit]()
        for some in (order[:_FIRST], order[_FIRST:_TRIED]):
            results = (self._fitted(int(who[k]), maps[k], seen, limits[who[k]]) for k in some)
            fitting += [each for each in results if self._fits(each, limits[each.landmark], seen, unlike.size)]
            if fitting:
                break
        if not fitting:
            return Recognition(-1, VisionStatus.NO_CONSENSUS, np.nan, unmatched)
        best_fit = min(fitting, key=lambda result: result.cost)
        if self._is_ambiguous(best_fit, fitting):
            return Recognition(-1, VisionStatus.AMBIGUOUS, np.nan, unmatched)
        return Recognition(best_fit.landmark, VisionStatus.OK, best_fit.distance, best_fit.matches)

    def _is_ambiguous(self, best: _Fit, fitting: list[_Fit]) -> bool:
        """Return whether another landmark is likely, too: costs are mean squares in units of squared limits."""
        known = np.isfinite(self.points[..., 0]).sum(1)
        others = [each for each in fitting if each.landmark != best.landmark]
        squares = np.array([each.cost * known[each.landmark] * _LIMIT**2 for each in (best, *others)])
        return bool(likely(squares, 0, 0, Noise(1.0))[1:].any())

    def _fits(self, result: _Fit, limit: float, seen: Reals, n_tried: int) -> bool:
        """Return whether enough points of a landmark match, and more closely than expected by chance.

        Any four points can be matched exactly by some homography. Each further point is within an angle r by chance
        with probability ``k r^2 / R^2``, for k points spread over a disc of radius R. The product of these
        probabilities, times the number of pairs of sets and of choices of points, bounds the expected
        number of such maps (Moisan and Stival, *IJCV* 57:201, 2004).
        """
        known = int(np.isfinite(self.points[result.landmark, :, 0]).sum())
        n_matched = int((result.matches >= 0).sum())
        if n_matched < max(0.75 * known, _LEAST) or not result.distance <= limit:
            return False
        chance = min(float(known * result.farthest**2 / (2 * _spread(seen) ** 2)), 1.0)
        choices = n_tried * comb(len(seen), n_matched)
        return bool(choices * chance ** (n_matched - 4) <= WRONG)

    def _judged(self, who: Reals, maps: Reals, seen: Reals, limits: Reals) -> tuple[Reals, Reals]:
        """Return truncated mean squares of angles of points of landmarks from the nearest ones seen, and all squares.

        Each square is divided by the square of its limit and truncated, so that landmarks are comparable.
        """
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            there = projective2.transform_point(maps[:, None], self.points[who])
            x, y = (there[:, :, None, k] - seen[:, k] for k in (0, 1))
            # In the tangent plane of the sphere of directions, steps away from its centre and across are longer.
            far = 1 + (seen**2).sum(-1)
            squares = (x * x + y * y) / far - ((x * seen[:, 0] + y * seen[:, 1]) / far) ** 2
        squares = np.where(np.isfinite(squares), squares, np.inf)
        known = np.isfinite(self.points[who, :, 0])
        least = np.minimum(squares.min(-1) / limits[:, None] ** 2, _FAR) * known
        return least.sum(-1) / known.sum(-1), squares

    def _fitted(self, landmark: int, matrix: Reals, seen: Reals, limit: float) -> _Fit:
        """Fit a map again, twice, to all points that it matches; return the fit and its residual."""
        matches, distance, farthest, cost = np.full(len(seen), -1), np.inf, np.inf, np.inf
        for round_ in range(3):
            costs, squares = self._judged(np.array([landmark]), matrix[None], seen, np.array([limit]))
            nearest = squares[0].argmin(0)
            close = (squares[0].min(0) <= _FAR * limit**2) & (squares[0].argmin(1)[nearest] == np.arange(len(seen)))
            if close.sum() < 5:
                break
            before, matches, cost = matches, np.where(close, nearest, -1), float(costs[0])
            least = squares[0].min(0)[close]
            distance, farthest = float(np.sqrt(least.mean())), float(np.sqrt(least.max()))
            if round_ and np.array_equal(matches, before):
                break  # The map has already been fitted to these.
            matrix, _ = linear_homography(self.points[landmark, nearest[close]], seen[close])
        return _Fit(cost, landmark, matches, distance, farthest)


def _proposed(first: Reals, second: Reals) -> Reals:
    """Return homographies of sets of five points that do not map the centre of the first points to infinity."""
    one, scale = normalized(first)
    two, other = normalized(second)
    rows = projective2.homography_equations(one, two).reshape(len(first), -1, 9)
    normal = np.swapaxes(rows, -1, -2) @ rows
    normal[:, range(8), range(8)] += ROUNDING
    found = np.linalg.solve(normal[:, :8, :8], -normal[:, :8, 8:])[..., 0]
    matrix = np.insert(found, 8, 1.0, axis=-1).reshape(-1, 3, 3)
    return np.asarray(undone(other) @ matrix @ scale)


def _flat(directions: Reals) -> Reals | None:
    """Return the intersections of directions with the plane at distance 1 across their mean; None if some miss it."""
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


def _spread(points: Reals) -> Reals:
    """Return the root mean square distance (...) of points (..., k, 2) from their centroid, ignoring NaN."""
    centred = points - np.nanmean(points, axis=-2, keepdims=True)
    return np.asarray(np.sqrt(np.nanmean((centred**2).sum(-1), axis=-1)))


def _learned(views: ArrayLike, name: str) -> tuple[Reals, float]:
    """Return the mean (n, 2) of the views of a landmark, and its standard error relative to its spread."""
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
    # Map to the view that is least oblique, in which the noise of all views is least.
    best = int(np.argmax(extents(images)[0]))
    maps, _ = linear_homography(images, np.broadcast_to(images[best], images.shape))
    there = projective2.transform_point(maps[:, None], images)
    mean = there.mean(0)
    n_views, n_points = there.shape[:2]
    if n_views == 1:
        return mean, np.nan
    # Each view but one has eight parameters of a homography to that one, and the mean has two for each point.
    free = (n_views - 1) * (2 * n_points - 8)
    error = np.sqrt(((there - mean) ** 2).sum() / free / n_views)
    return mean, float(error / _spread(mean))


def _signatures(points: Reals, most: int) -> tuple[Reals, Reals, Reals]:
    """Return p2-invariants (s, 5) of sets of five points, their deviations for noise of 1, and the points in order.

    The sets are those farthest from having three points on a line.
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
    derivatives = (each_pencil(five[:, None] + steps) - each_pencil(five[:, None] - steps)) / 2e-4
    deviations = matrix[0, 0] * np.linalg.norm(derivatives, axis=1)
    usable = np.isfinite(values).all(-1) & np.isfinite(deviations).all(-1)
    values, deviations, sets = values[usable], deviations[usable], sets[usable]
    order = np.argsort(values, -1)
    return tuple(np.take_along_axis(each, order, -1) for each in (values, deviations, sets))  # type: ignore[return-value]
