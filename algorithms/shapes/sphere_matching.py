"""Registration of models of spheres: robust matching of balls by annealing, with thin-plate splines (section 22.4)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from generated import sphere_models

from ..arguments import Reals, finite, real_array
from ..evidence import WRONG
from .rasterising import checked_balls
from .sphere_evidence import log_chance, moved_balls
from .sphere_maps import FEWEST, Map, dimensions, fitted_map, reverses
from .sphere_search import OUTLIER, likely_poses
from .sphere_status import SphereMatchStatus

_START, _SEARCHED, _END, _COOLING = 0.1, 0.03, 0.0006, 0.82
"""Temperatures, in squares of the size of the models, at the start, for poses that were searched, and at the end, and
the factor of each step."""
_BALANCING = 12
"""A limit on work: how often rows and columns of assignments are normalised in turn."""
_STIFFNESS = 200.0
"""Stiffness of splines, in units of the temperature."""
_RADII = 2.0
"""Weight of the squared difference of radii."""
_AFFINE_UNTIL = 0.02
"""Temperature above which splines are replaced by affine maps, which cannot fold."""
_DIRECTIONS = 80
"""Points on each sphere for the comparison of surfaces."""
_SURFACE_STEPS = (3.0, 3.0, 1.0, 1.0, 0.3)
"""Stiffness of the splines that move surface to surface."""
_TURN = 0.05
"""Distance, in sizes of the models, that counts as much as a difference of normals by one radian."""
_CONTROL = 1500
"""Points that determine one of these."""


@dataclass(frozen=True, eq=False)
class SphereRegistration:
    """A map from one model of spheres to another.

    Attributes
    ----------
    match : array of int, (n, 2)
        Pairs of indices of balls in the first and second model.
    status : SphereMatchStatus
    residual : float
        Root mean square of the distances of matched centres, in the unit of the models; NaN without a match.
    """

    match: NDArray[np.int64]
    status: SphereMatchStatus
    residual: float
    _maps: tuple[Map, ...] = field(repr=False)
    _start: Reals = field(repr=False)
    _end: Reals = field(repr=False)
    _unit: float = field(repr=False)
    _size: float = field(repr=False)

    def warp(self, points: ArrayLike) -> Reals:
        """Return the images (n, 3) of points of the first model."""
        x = finite(real_array(points, "points", (3,), "points").astype(float), "points")
        moved = (x.reshape(-1, 3) - self._start) / self._unit
        for step in self._maps:
            moved = step(moved) if len(moved) else moved
        return (moved * self._size + self._end).reshape(x.shape)

    def warp_balls(self, balls: ArrayLike) -> Reals:
        """Return the images of balls; radii change as the cube root of volumes."""
        return moved_balls(self.warp, checked_balls(balls))

    def unwarp(self, points: ArrayLike, steps: int = 12) -> Reals:
        """Return the points whose images are given, by a fixed-point iteration of the displacement."""
        x = finite(real_array(points, "points", (3,), "points").astype(float), "points")
        found = x - self._end + self._start
        for _ in range(steps):
            found = found - (self.warp(found) - x)
        return found


def register_spheres(
    a: ArrayLike, b: ArrayLike, kind: str = "nonrigid", *, surfaces: bool | None = None
) -> SphereRegistration:
    """Match the balls of two models and find the map that takes the first to the second.

    Each ball has a soft assignment to those of the other model and to an outlier. Assignments and the map are improved
    alternately, while the temperature decreases (robust point matching). The cost of a pair has the distance of centres
    and the difference of radii.

    Parameters
    ----------
    a, b : array_like, (k, 4)
        Centres and radii, in one unit.
    kind : str, optional
        ``nonrigid`` (thin-plate splines), ``affine`` or ``similarity``.
    surfaces : bool, optional
        Whether to move the surfaces of the unions of balls to each other after the matching. Left out, this is done for
        nonrigid maps of models in which most balls overlap others, as those of `maximal_balls` do.

    Returns
    -------
    SphereRegistration
    """
    if kind not in FEWEST:
        raise ValueError(f"kind: {kind!r}; expected one of {', '.join(FEWEST)}")
    one, two = checked_balls(a, "a"), checked_balls(b, "b")
    if min(len(one), len(two)) == 0:
        raise ValueError(f"{'b' if len(one) else 'a'}: no balls; expected at least {FEWEST[kind]}")
    start, end = (np.median(x[:, :3], axis=0) for x in (one, two))
    sizes = [_size(x, middle) for x, middle in ((one, start), (two, end))]
    first, second = (
        np.column_stack([x[:, :3] - middle, x[:, 3]]) / size
        for x, middle, size in zip((one, two), (start, end), sizes, strict=True)
    )
    frame = start, end, sizes[0], sizes[1]
    none = np.zeros((0, 2), np.int64)
    if min(len(one), len(two)) < FEWEST[kind]:
        return SphereRegistration(none, SphereMatchStatus.TOO_FEW_BALLS, np.nan, (), *frame)
    if min(dimensions(first[:, :3]), dimensions(second[:, :3])) < (2 if kind == "similarity" else 3):
        return SphereRegistration(none, SphereMatchStatus.FLAT, np.nan, (), *frame)
    solid = _solid(first) and _solid(second)
    found, chance = _matched(first, second, kind, solid)
    maps: tuple[Map, ...] = (found,)
    certain = chance < np.log(WRONG)
    if surfaces or (surfaces is None and kind == "nonrigid" and solid):
        maps = _with_surfaces(first, second, maps if certain else (_still(*frame),))
    match, residual = _matches(_moved(maps, first), second)
    status = SphereMatchStatus.OK if certain else SphereMatchStatus.FEW_MATCHES
    return SphereRegistration(match, status, sizes[1] * residual, maps, *frame)


def _size(balls: Reals, middle: Reals) -> float:
    size = float(np.sqrt(np.square(balls[:, :3] - middle).sum(1).mean()) + np.sqrt(np.square(balls[:, 3]).mean()))
    return size if size > 0 else 1.0


def _still(start: Reals, end: Reals, unit: float, size: float) -> Map:
    """Return the map between relative coordinates that leaves points where they are, if the models are near."""
    return (
        _unmoved
        if np.linalg.norm(start - end) > max(unit, size)
        else lambda x: np.asarray((x * unit + start - end) / size)
    )


def _unmoved(points: Reals) -> Reals:
    return points


def _matched(first: Reals, second: Reals, kind: str, solid: bool) -> tuple[Map, float]:
    """Return the map whose predictions of balls are least likely by chance, and the logarithm of that chance."""
    best, least = _tried(first, second, kind, solid, _unmoved, _START)
    if least < np.log(WRONG):
        return best, least
    for start in likely_poses(first, second):
        found, chance = _tried(first, second, kind, solid, start, _SEARCHED)
        if chance < least:
            best, least = found, chance
        if least < np.log(WRONG):
            break
    return best, least


def _tried(first: Reals, second: Reals, kind: str, solid: bool, start: Map, temperature: float) -> tuple[Map, float]:
    found = _annealed(first, second, kind, start, temperature)
    if reverses(found, first):
        return found, 0.0  # the logarithm of a probability of 1
    _, matched, mean = _assigned(moved_balls(found, first), second, _END)
    return found, log_chance(kind, first, second, mean, matched, _STIFFNESS * _END, _RADII, solid)


def _moved(maps: tuple[Map, ...], balls: Reals) -> Reals:
    def whole(x: Reals) -> Reals:
        for step in maps:
            x = step(x)
        return x

    return moved_balls(whole, balls)


def _assigned(moved: Reals, other: Reals, temperature: float) -> tuple[Reals, Reals, Reals]:
    """Return the matrix of assignments, the sum of each row, and the mean ball of each row."""
    affinities = np.asarray(sphere_models.affinities(moved, other, 2 * temperature, _RADII))
    columns = np.ones(len(other))
    for _ in range(_BALANCING):
        rows = 1 / (affinities @ columns + OUTLIER)
        columns = 1 / (rows @ affinities + OUTLIER)
    factor, matched, mean = sphere_models.balanced_row(affinities, columns, other, OUTLIER)
    return factor[:, None] * affinities * columns, np.asarray(matched), np.asarray(mean)


def _annealed(first: Reals, second: Reals, kind: str, found: Map, temperature: float) -> Map:
    """Improve assignments and a map alternately, from a map to start with."""
    while temperature > _END:
        _, matched, mean = _assigned(moved_balls(found, first), second, temperature)
        now = "affine" if kind == "nonrigid" and temperature > _AFFINE_UNTIL else kind
        better = fitted_map(now, first[:, :3], mean[:, :3], matched, _STIFFNESS * temperature)
        if better is None:
            break
        found = better
        temperature *= _COOLING
    return found


def _matches(moved: Reals, second: Reals) -> tuple[NDArray[np.int64], float]:
    """Return the pairs that are assigned to each other with more than half of their weight."""
    assigned, _, _ = _assigned(moved, second, _END)
    column = assigned.argmax(1)
    rows = np.arange(len(moved))
    mutual = (assigned[rows, column] > 1 / 2) & (assigned.argmax(0)[column] == rows)
    match = np.column_stack([rows[mutual], column[mutual]]).astype(np.int64)
    off = moved[match[:, 0], :3] - second[match[:, 1], :3]
    return match, float(np.sqrt(np.square(off).sum(1).mean())) if len(match) else np.nan


# Surfaces.


def _solid(balls: Reals) -> bool:
    """Return whether most balls overlap another one."""
    distances, other = scipy.spatial.cKDTree(balls[:, :3]).query(balls[:, :3], k=2)
    return bool(np.mean(distances[:, 1] < balls[:, 3] + balls[other[:, 1], 3]) > 1 / 2)


def surface_points(balls: Reals, count: int = _DIRECTIONS) -> tuple[Reals, Reals]:
    """Return points of the surface of a union of balls, and the normals there.

    Parameters
    ----------
    balls : array, (k, 4)
    count : int, optional
        Points on each sphere, evenly distributed; those inside other balls are removed.
    """
    turn = np.arange(count) * np.pi * (3 - np.sqrt(5))
    height = 1 - (2 * np.arange(count) + 1) / count
    across = np.sqrt(1 - height * height)
    normals = np.column_stack([across * np.cos(turn), across * np.sin(turn), height])
    points = (balls[:, None, :3] + balls[:, None, 3:] * normals).reshape(-1, 3)
    free = np.ones(len(points), bool)
    tree = scipy.spatial.cKDTree(points)
    for ball in balls:
        free[tree.query_ball_point(ball[:3], ball[3] * (1 - 1e-6))] = False
    return points[free], np.tile(normals, (len(balls), 1))[free]


def _with_surfaces(first: Reals, second: Reals, maps: tuple[Map, ...]) -> tuple[Map, ...]:
    """Append splines that move the surface of the first model to the second, and that to the first."""
    (points, normals), (targets, ends) = surface_points(first), surface_points(second)
    tree = scipy.spatial.cKDTree(np.column_stack([targets, _TURN * ends]))
    rng = np.random.default_rng(0)
    for step in maps:
        points = step(points)
    for stiffness in _SURFACE_STEPS:
        chosen = rng.permutation(len(points))[:_CONTROL]
        distance, nearest = tree.query(np.column_stack([points[chosen], _TURN * normals[chosen]]))
        backwards = scipy.spatial.cKDTree(np.column_stack([points, _TURN * normals]))
        sought = rng.permutation(len(targets))[: _CONTROL // 2]
        away, source = backwards.query(np.column_stack([targets[sought], _TURN * ends[sought]]))
        x = np.vstack([points[chosen], points[source]])
        y, across = (np.vstack([z[nearest], z[sought]]) for z in (targets, ends))
        # Surfaces determine displacements along normals; those along the surface follow from smoothness alone.
        y = x + ((y - x) * across).sum(1, keepdims=True) * across
        off = np.concatenate([distance, away])
        scale = 3 * np.median(off) + 1e-9
        spline = fitted_map("nonrigid", x, y, 1 / (1 + (off / scale) ** 2), stiffness)
        if spline is None:
            break
        points = spline(points)
        maps = (*maps, spline)
    return maps
