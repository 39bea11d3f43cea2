"""Objects of maps in the plane: segments, circles and boxes with pose motors, fitted to points of scans."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import cga2, pga2
from generated import navigation as kernels

from ..arguments import Reals, real_array
from ..evidence import Freedom, Noise, all_or_some_sets, by_chance, certain_deviations
from ..evidence.sampling import without_copies
from ..precision import SINGLE
from .navigation_status import FitStatus
from .outline_evidence import follows_shape, is_bent, is_straight, scatter
from .round_fitting import fit_round

_FEWEST = 3
"""Points that determine a circle."""
_ROUNDS, _SAMPLES = 8, 60
"""Limits on work: selections of inliers, and sets of three points from which circles are computed."""
_FREEDOM = Freedom(3, 3, 1, 1, 1.0)
"""Points that are given to a fit are expected to be of one object, so that a single false alarm is accepted."""
_ANYWHERE = np.random.default_rng(0).uniform(-1, 1, (500, 2))
"""A limit on work: points at random, whose distances those of unrelated points are like."""
_SURE = 4.0
"""Points are on a line unless the curvature of the circle exceeds this multiple of its standard deviation."""


class ObjectKind(IntEnum):
    """Kinds of objects."""

    SEGMENT = 0
    CIRCLE = 1
    BOX = 2


@dataclass(frozen=True, slots=True, eq=False)
class MapObject:
    """An object: a box in the frame of its pose, enlarged by a radius."""

    kind: ObjectKind
    motor: Reals
    """(4,) The pose, as a motor of `generated.pga2`, from the frame of the object to that of the map."""
    size: Reals
    """(3,) Half the length along x, half the width along y, and the radius."""
    name: str = ""

    @classmethod
    def circle(cls, centre: ArrayLike, radius: float, name: str = "") -> MapObject:
        """Construct a circle."""
        motor = pga2.motor_from_angle_translation(0.0, real_array(centre, "centre", (2,), "a point"))
        return cls(ObjectKind.CIRCLE, np.asarray(motor), np.array([0.0, 0.0, radius]), name)

    @classmethod
    def segment(cls, start: ArrayLike, end: ArrayLike, name: str = "") -> MapObject:
        """Construct a segment, with the x axis along it."""
        a, b = (real_array(x, name_, (2,), "a point").astype(float) for x, name_ in ((start, "start"), (end, "end")))
        angle, length = np.arctan2(*(b - a)[::-1]), float(np.hypot(*(b - a)))
        motor = pga2.motor_from_angle_translation(angle, (a + b) / 2)
        return cls(ObjectKind.SEGMENT, np.asarray(motor), np.array([length / 2, 0.0, 0.0]), name)

    @classmethod
    def box(cls, motor: ArrayLike, length: float, width: float, name: str = "") -> MapObject:
        """Construct a box about the origin of its pose."""
        pose = np.asarray(pga2.normalize_motor(real_array(motor, "motor", (4,), "a motor")))
        return cls(ObjectKind.BOX, pose, np.array([length / 2, width / 2, 0.0]), name)

    @property
    def centre(self) -> Reals:
        """(2,) The place of the object."""
        return np.asarray(pga2.motor_to_angle_translation(self.motor)[1])

    @property
    def outline(self) -> Reals:
        """(k, 2) A closed outline for pictures."""
        if self.kind == ObjectKind.CIRCLE:
            turn = np.linspace(0, 2 * np.pi, 49)
            local = self.size[2] * np.stack([np.cos(turn), np.sin(turn)], 1)
        else:
            local = self.size[:2] * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1]])
        return np.asarray(pga2.move_point(self.motor, local))

    def moved(self, motor: ArrayLike) -> MapObject:
        """Return the object moved by a motor, as from the frame of a robot to that of the map."""
        after = pga2.normalize_motor(pga2.motor_product(real_array(motor, "motor", (4,), "a motor"), self.motor))
        return MapObject(self.kind, np.asarray(after), self.size, self.name)


class ObjectDistance(NamedTuple):
    """The nearest objects."""

    distance: Reals
    """(...) Signed distances, negative inside; infinite without objects."""
    row: Reals
    """(...) int. Indices of objects, or -1."""


@dataclass(frozen=True, slots=True)
class ObjectMap:
    """Objects that were added to a map; adding returns another map."""

    objects: tuple[MapObject, ...] = ()

    def __len__(self) -> int:
        """Return the number of objects."""
        return len(self.objects)

    def with_objects(self, more: Iterable[MapObject], pose: ArrayLike | None = None) -> ObjectMap:
        """Return the map with further objects, moved by the pose of a robot if they are in its frame."""
        added = [each if pose is None else each.moved(pose) for each in more]
        return ObjectMap((*self.objects, *added))

    def distance(self, points: ArrayLike) -> ObjectDistance:
        """Return the distances of points (..., 2) from the nearest objects."""
        places = real_array(points, "points", (2,), "points").astype(float)
        poses = np.array([each.motor for each in self.objects]).reshape(-1, 4)
        sizes = np.array([each.size for each in self.objects]).reshape(-1, 3)
        distance, row = kernels.distance_to_objects(places, poses, sizes)
        found = np.asarray(row).astype(int)
        return ObjectDistance(np.where(found < 0, np.inf, distance), found)


@dataclass(frozen=True, slots=True, eq=False)
class ObjectFit:
    """Result of `fit_circle` and `fit_box`."""

    fitted: MapObject | None
    """None unless the status is OK."""
    residual: float
    """Root mean square distance of the points that agree, in metres."""
    inliers: Reals
    """(n,) bool. The points that agree."""
    status: FitStatus
    bounds: Reals = field(default_factory=lambda: np.full(2, np.nan))
    """(2,) How far the length and the width of a box may be off: by the noise, and by half of the step between the last
    point on a side and the next beam, which missed it. NaN for circles and without a result."""


def fit_circle(points: ArrayLike, sigma: float = 0.01, name: str = "") -> ObjectFit:
    """Fit a circle to points of scans, such as a column.

    The unit vector of conformal space with the least sum of squared distances is found by Gauss-Newton steps that
    begin at the vector most nearly orthogonal to all points. Points farther away than 3 standard deviations are left
    out; the first ones are those near a circle through three of them.

    Parameters
    ----------
    points : array_like, (n, 2)
        What is not finite is left out. Exact copies count once.
    sigma : float
        The standard deviation of each coordinate, in metres.
    name : str, optional

    Returns
    -------
    ObjectFit
        DEGENERATE if the points are on a line within their noise, or if a line explains those that agree nearly as
        well. UNEXPLAINED if most points do not agree, if the distances of those that do are larger than their noise, if
        points at random would agree with some circle as well, or if distances follow a shape along the circle and what
        continues it, such as those of corners and ellipses.
    """
    places = real_array(points, "points", (2,), "points").astype(float).reshape(-1, 2)
    kept, again = without_copies(places)
    if len(kept) < len(places):
        once = fit_circle(places[kept], sigma, name)
        return replace(once, inliers=once.inliers[again])
    inliers = np.isfinite(places).all(1)
    if inliers.sum() < _FEWEST:
        return ObjectFit(None, np.nan, np.zeros(len(places), bool), FitStatus.TOO_FEW)
    shift = places[inliers].mean(0)
    local = places - shift
    inliers = _agreeing(local, inliers, 3 * sigma)
    status, vector = FitStatus.OK, np.zeros(4)
    for _ in range(_ROUNDS):
        chosen = local[inliers]
        start = _start(chosen)
        if start is None:
            return ObjectFit(None, np.nan, inliers, FitStatus.DEGENERATE)
        spreads = np.tile([sigma**2, 0.0, sigma**2], (len(chosen), 1))
        vector, converged = fit_round(kernels.circle_step, chosen, spreads, start, curved=True)
        status = FitStatus.OK if converged else FitStatus.NOT_CONVERGED
        off = np.abs(_distances(local, vector))
        again = np.isfinite(places).all(1) & (off <= 3 * sigma)
        if again.sum() < _FEWEST:
            return ObjectFit(None, np.nan, again, FitStatus.TOO_FEW)
        if np.array_equal(again, inliers):
            break
        inliers = again
    curvature = vector[2]
    off = _distances(local[inliers], vector)
    extent = float(np.abs(local[inliers]).max())
    # The standard deviation of the curvature of points along a nearly straight arc: Gluckstern, *Nucl. Instrum.
    # Methods* 24:381, 1963.
    uncertain = sigma / (2 * extent) ** 2 * np.sqrt(720 / (inliers.sum() + 4)) if extent > 0 else np.inf
    if not np.isfinite(vector).all() or abs(curvature) < _SURE * uncertain or is_straight(local[inliers], off, sigma):
        return ObjectFit(None, np.nan, inliers, FitStatus.DEGENERATE)
    found = MapObject.circle(vector[:2] / curvature + shift, 1 / abs(float(curvature)), name)
    residual = float(np.sqrt(np.mean(off**2)))
    good = np.isfinite(places).all(1)
    if _is_contradicted(local[good], _distances(local[good], vector), inliers[good], vector, sigma):
        return ObjectFit(None, residual, inliers, FitStatus.UNEXPLAINED)
    return ObjectFit(found if status == FitStatus.OK else None, residual, inliers, status)


def _is_contradicted(points: Reals, off: Reals, inliers: Reals, vector: Reals, sigma: float) -> bool:
    """Return whether points at some distances from a circle contradict it, or if chance explains those that agree."""
    some = off[inliers] / sigma
    if 2 * len(some) < len(off) or Noise(1.0).contradicted(some @ some, len(some) - _FEWEST):
        return True
    around = points - vector[:2] / vector[2]
    order = np.argsort(np.arctan2(*around.T))
    if follows_shape(points[order], off[order] / sigma, inliers[order], sigma):
        return True
    low, high = points.min(0), points.max(0)
    half = (high - low).max() / 2
    wrong = _distances((low + high) / 2 + half * _ANYWHERE, vector)
    return by_chance(np.abs(off), np.abs(wrong), 3 * sigma, _FREEDOM)


def fit_box(points: ArrayLike, sigma: float = 0.01, viewpoint: ArrayLike = (0.0, 0.0), name: str = "") -> ObjectFit:
    """Fit a box to the points of its two visible sides, which meet in a corner.

    Of all directions, that of the least sum of distances from the two sides is chosen and refined; each side is then
    the mean of its points. The other ends of the sides are half a step behind their last points, where a step leads to
    the beam that missed the side.

    Parameters
    ----------
    points : array_like, (n, 2)
        What is not finite is left out. Exact copies count once.
    sigma : float
        The standard deviation of each coordinate, in metres.
    viewpoint : array_like, (2,)
        The place of the scanner.
    name : str, optional

    Returns
    -------
    ObjectFit
        DEGENERATE if only one side is visible, if a single line explains the points within their noise, or if a size
        may be off by all of it. UNEXPLAINED if distances from the sides are larger than their noise, or follow a shape
        along a side, such as those of cylinders.
    """
    places = real_array(points, "points", (2,), "points").astype(float).reshape(-1, 2)
    eye = real_array(viewpoint, "viewpoint", (2,), "a place").astype(float)
    kept, again = without_copies(places)
    if len(kept) < len(places):
        once = fit_box(places[kept], sigma, viewpoint, name)
        return replace(once, inliers=once.inliers[again])
    inliers = np.isfinite(places).all(1)
    if inliers.sum() < 2 * _FEWEST:
        return ObjectFit(None, np.nan, np.zeros(len(places), bool), FitStatus.TOO_FEW)
    good = places[inliers]
    best, width = 0.0, np.pi / 4
    for width in (np.pi / 4, np.radians(1.0), np.radians(0.05)):
        angles = best + np.linspace(-width, width, 91)
        costs = [np.minimum(_to_sides(good, eye, angle).away, 5 * sigma).sum() for angle in angles]
        best = float(angles[int(np.argmin(costs))])
    for _ in range(_ROUNDS):
        seen = _to_sides(good, eye, best)
        best += _slope(seen, seen.away <= 3 * sigma)
    seen = _to_sides(good, eye, best)
    near = seen.away <= 3 * sigma
    sides = [near & (seen.side == k) for k in range(2)]
    inliers[np.flatnonzero(inliers)] = near
    if min(int(side.sum()) for side in sides) < _FEWEST or near.sum() < 0.5 * len(good):
        return ObjectFit(None, np.nan, inliers, FitStatus.DEGENERATE)
    first = np.array([seen.local[side, k].mean() for k, side in enumerate(sides)])
    turned = certain_deviations() * sigma / np.sqrt(_slopes(seen, near)[1])
    last, off = np.array([_end(seen, sides[1 - k], k, float(first[1 - k]), turned) for k in range(2)]).T
    bounds = off + certain_deviations() * sigma * np.sqrt(1 + 1 / np.array([side.sum() for side in sides]))
    if (bounds > np.abs(last - first)).any() or not is_bent(good[near], sigma):
        return ObjectFit(None, np.nan, inliers, FitStatus.DEGENERATE)
    if (seen.signs * (seen.eye - first) <= 0).any():
        return ObjectFit(None, np.nan, inliers, FitStatus.DEGENERATE)
    outward = seen.signs * (seen.local - first)
    rests = np.take_along_axis(outward, np.abs(outward).argmin(1)[:, None], 1)[:, 0] / sigma
    order = np.argsort(np.unwrap(np.arctan2(*(seen.local - seen.eye).T)))
    if Noise(1.0).contradicted(rests[near] @ rests[near], int(near.sum()) - _FEWEST) or follows_shape(
        good[order], rests[order], near[order], sigma
    ):
        return ObjectFit(None, np.nan, inliers, FitStatus.UNEXPLAINED)
    turned = pga2.motor_from_angle_translation(best, np.zeros(2))
    pose = pga2.motor_from_angle_translation(best, pga2.move_point(turned, (first + last) / 2))
    size = np.abs(last - first)
    found = MapObject.box(pose, float(size[0]), float(size[1]), name)
    residual = float(np.sqrt(np.mean(ObjectMap((found,)).distance(good[near]).distance ** 2)))
    return ObjectFit(found, residual, inliers, FitStatus.OK, bounds)


class _Sides(NamedTuple):
    """Points in the directions of a box, and its two sides that face the scanner."""

    away: Reals
    """(n,) The distance from the nearest of both sides, the first orthogonal to x, the second to y."""
    side: Reals
    local: Reals
    eye: Reals
    signs: Reals
    """(2,) 1 if the side is that with the largest coordinate, -1 with the smallest."""


def _to_sides(points: Reals, eye: Reals, angle: float) -> _Sides:
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.array([[cosine, -sine], [sine, cosine]])
    local, seen_from = points @ turn, eye @ turn
    signs = np.where(seen_from > np.median(local, axis=0), 1.0, -1.0)
    outward = signs * local
    extreme, span = outward.max(0), np.ptp(outward, axis=0)
    away = [
        np.abs(outward[:, k] - np.median(outward[outward[:, k] >= extreme[k] - 0.05 * span[k], k])) for k in range(2)
    ]
    both = np.stack(away, 1)
    return _Sides(both.min(1), both.argmin(1), local, seen_from, signs)


def _slope(seen: _Sides, near: Reals) -> float:
    """Return the angle of the common slope of the points of both sides."""
    top, bottom = _slopes(seen, near)
    return top / bottom if bottom > 0 else 0.0


def _slopes(seen: _Sides, near: Reals) -> tuple[float, float]:
    """Return the sums of products and of squares along both sides, whose quotient is their common slope."""
    top = bottom = 0.0
    for k in range(2):
        own = seen.local[near & (seen.side == k)]
        if len(own) >= _FEWEST:
            along, across = own[:, 1 - k], own[:, k]
            centred = along - along.mean()
            top += float(centred @ across) * (1 if k == 1 else -1)
            bottom += float(centred @ centred)
    return top, bottom


def _end(seen: _Sides, own: Reals, k: int, level: float, turned: float) -> tuple[float, float]:
    """Return the end of a side away from the corner, and how far it may be off.

    The side is parallel to axis k, at a level of the other axis. Its end is between its last point and the beam that
    missed it, which is farther away if the direction of the box is off by an angle `turned`.
    """
    sign = seen.signs[k]
    ordered = np.sort(sign * seen.local[own, k])
    rays = seen.local - seen.eye
    turn = float(np.median(np.diff(np.sort(np.unwrap(np.arctan2(rays[:, 1], rays[:, 0]))))))
    height, along = abs(level - seen.eye[1 - k]), float(ordered[0] - sign * seen.eye[k])
    missed = np.arctan2(along, height) - turn - np.array([0.0, turned])
    steps = np.where(missed > -np.pi / 2, along - height * np.tan(missed), np.inf)
    # Points that are left out, or merged scans, can be farther apart than beams.
    steps = np.maximum(steps, np.diff(ordered[: min(4, len(ordered))]).mean())
    half = float(steps[0]) / 2 if np.isfinite(steps[0]) else 0.0
    return sign * (float(ordered[0]) - half), max(half, float(steps[1]) - half)


def _agreeing(points: Reals, finite: Reals, distance: float) -> Reals:
    """Return the points near that circle through three of them which has the most points near it."""
    good = np.flatnonzero(finite)
    triples = points[good[all_or_some_sets(len(good), 3, _SAMPLES)]]
    circles = np.asarray(cga2.circle_from_points(*np.moveaxis(triples, 1, 0)))
    off = np.abs(cga2.signed_distance_point_circle(points[good], circles[:, None]))
    near = off <= distance
    best = near[int(np.argmax(near.sum(1)))]
    found = np.zeros(len(points), bool)
    found[good] = best
    return found if best.sum() >= _FEWEST else finite


def _start(points: Reals) -> Reals | None:
    """Return the unit vector most nearly orthogonal to all points, or None if they are on a line."""
    size = float(np.abs(points).max())
    values = scatter(points)
    if not size > 0 or values[0] <= SINGLE**2 * values[1]:
        return None
    scaled = points / size
    squares = (scaled**2).sum(1)
    # X . s = v . x - k x**2/2 - w with s = v + k e0 + w einf is 0 for k = 1 in the sense of least squares.
    solved, *_ = np.linalg.lstsq(np.column_stack([scaled, -np.ones(len(scaled))]), squares / 2, rcond=None)
    dual = np.array([solved[0], solved[1], 1.0, solved[2]])
    square = float(cga2.inner_product_of_vectors(dual, dual))
    if not square > 0:
        return None
    unit = dual / np.sqrt(square)
    return np.asarray(unit * np.array([1.0, 1.0, 1 / size, size]))


def _distances(points: Reals, vector: Reals) -> Reals:
    curvature = vector[2]
    inner = points @ vector[:2] - curvature * (points**2).sum(1) / 2 - vector[3]
    return np.asarray(2 * inner / (1 + np.sqrt(np.maximum(1 - 2 * curvature * inner, 0))))
