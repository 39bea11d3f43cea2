"""Planes and spheres of points with covariances among points of other objects."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from generated import cga3
from generated import navigation as kernels

from ..arguments import Reals, finite_number, real_array
from ..evidence import Freedom, Noise, Problem, by_chance, certain_deviations, consensus, minima, rank
from ..evidence.consensus import N_WRONG, Indices
from ..evidence.gates import WIDE
from ..evidence.least_squares import STEPS
from ..evidence.misfit import has_shape
from ..evidence.sampling import without_copies
from ..evidence.triangles import from_triangle
from ..precision import ROOT, ROUNDING
from .map_3d import Solid, SolidKind
from .navigation_status import FitStatus
from .round_fitting import fit_round
from .samples_of_solids import corners_about, planes_through, spheres_through

_ROUNDS = 20
"""A limit on work: how often points are chosen and weighted again."""
_SAMPLES, _CONFIDENCE, _SEED = 1000, 1 - 1e-6, 0
"""Limits on work: samples of points, and the confidence that one of them has no foreign point."""
_NO_TURN = np.array([1.0, 0.0, 0.0, 0.0])
_FEWEST = {SolidKind.PLANE: 3, SolidKind.SPHERE: 4}
"""Points that determine an object. One more is needed, or nothing contradicts."""
_OUTLINE = 0.92
"""Points of a sphere are left out beyond this share of its radius from the ray to its centre: at its outline, their
depth says nothing."""
_DEGREES = 2, 4
"""A limit on work: degrees of polynomials of places on the object that distances may not follow. They hold bends, and
corners of boxes."""
_LONG = 4.0
"""The variance along a ray is at least this multiple of those across, or the point does not know its ray."""
_MEET = 0.01
"""Rays meet in a camera if they are this near to it, in relation to the distance: depths are then right to that."""
_STRETCH = 2.0
"""The largest ratio of the depths of an object and of a point that are of the same thing."""


@dataclass(frozen=True, slots=True, eq=False)
class SolidFit:
    """Result of `fit_solid`."""

    solid: Solid | None
    """None unless the status is OK."""
    square: float
    """The mean of the squared distances divided by their variances; about 1 if the covariances are right."""
    inliers: Reals
    """(n,) bool."""
    status: FitStatus
    deviation: float = float("nan")
    """The largest standard deviation of the result: of the normal of a plane in radians, or of the centre of a sphere
    in metres."""


def fit_solid(
    points: ArrayLike,
    covariances: ArrayLike,
    kind: SolidKind,
    name: str = "",
    gate: float = 3.5,
    viewpoint: ArrayLike | None = None,
) -> SolidFit:
    """Fit a plane or a sphere to points with covariances, among points of other objects.

    Random samples give the object with the least truncated squared distances. The unit vector of conformal space with
    the least sum of squared distances, each divided by the variance of its point along the normal, is then found by
    Gauss-Newton steps. Points beyond the gate are left out.

    Parameters
    ----------
    points : array_like, (n, 3)
        What is not finite is left out. Exact copies, with their covariances, count once.
    covariances : array_like, (n, 6)
        Upper triangles, as of `stereo_points`.
    kind : SolidKind
    name : str, optional
    gate : float
        In standard deviations.
    viewpoint : array_like, (3,) or (n, 3), optional
        The place of the left camera, or of that of each point. By default that in which the main axes of the
        covariances meet; if they do not meet, covariances are used as they are.

    Returns
    -------
    SolidFit
        UNEXPLAINED if points at random would have as many points near some object, if the distances of points within
        the gate are larger than their noise, or if they follow a shape along the object, such as a bend of a plane.
        DEGENERATE if the points leave the normal of the plane or the radius of the sphere undetermined.

    Raises
    ------
    TypeError, ValueError
        If an argument has a different shape or type, or the gate is not positive.

    Notes
    -----
    The variance of a depth from a disparity grows with its fourth power, so that points which are too near by chance
    would have too much weight: walls at 10 m would be 20 cm too near. With a viewpoint, the squares are those of the
    differences of inverse depths along rays, that is of disparities, whose variance is the same everywhere.
    """
    places = real_array(points, "points", (3,), "points").astype(float).reshape(-1, 3)
    spreads = real_array(covariances, "covariances", (6,), "upper triangles").astype(float).reshape(-1, 6)
    if len(places) != len(spreads):
        raise ValueError(f"covariances: {len(spreads)}; expected {len(places)}, one for each point")
    if finite_number(gate, "gate") <= 0:
        raise ValueError(f"gate: {gate}; expected a positive number of standard deviations")
    eyes = None if viewpoint is None else _one_for_each(viewpoint, len(places))
    good = np.isfinite(places).all(1) & np.isfinite(spreads).all(1)
    kept, again = without_copies(places[good], spreads[good])
    if len(kept) <= _FEWEST[kind]:
        return SolidFit(None, np.nan, np.zeros(len(places), bool), FitStatus.TOO_FEW)
    rows = np.flatnonzero(good)[kept]
    shift = places[rows].mean(0)
    local = places[rows] - shift
    eyes = _meeting(local, spreads[rows]) if eyes is None else eyes[rows] - shift
    found, inliers = _Scene(local, spreads[rows], eyes, kind, gate).fitted()
    whole = np.zeros(len(places), bool)
    whole[good] = inliers[again]
    if found.status != FitStatus.OK:
        return SolidFit(None, found.square, whole, found.status)
    moved = np.asarray(cga3.move_vector(cga3.motor_from_rotor_translation(_NO_TURN, shift), found.vector))
    corners = corners_about(places[whole], moved) if kind == SolidKind.PLANE else np.zeros((0, 3))
    return SolidFit(Solid(kind, moved, corners, name), found.square, whole, FitStatus.OK, found.deviation)


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    status: FitStatus
    vector: Reals
    square: float = float("nan")
    deviation: float = float("nan")


@dataclass(frozen=True, slots=True, eq=False)
class _Scene:
    """Points about the origin, of which some are on an object."""

    points: Reals
    spreads: Reals
    eyes: Reals | None
    kind: SolidKind
    gate: float

    def fitted(self) -> tuple[_Found, Indices]:
        """Return the object with its status, and the points on it."""
        nothing = np.zeros(len(self.points), bool)
        freedom = Freedom(_FEWEST[self.kind], _FEWEST[self.kind], 1, 1, 1e-2)
        solve = planes_through if self.kind == SolidKind.PLANE else spheres_through
        problem = Problem(
            self.points, self.spreads, freedom, partial(solve, self.points), self._distances, self._costs, self._better
        )
        found = consensus(problem, self.gate, _SEED, _CONFIDENCE, _SAMPLES)
        if found.best is None:
            return _Found(FitStatus.DEGENERATE, np.zeros(5)), nothing
        vector, inliers, converged = self._refined(found.best.model, self.gate)
        if not np.isfinite(vector).all() or inliers.sum() <= _FEWEST[self.kind]:
            return _Found(FitStatus.DEGENERATE, vector), inliers
        squares = self.squares(vector, self.points, self.spreads, self.eyes)
        square = float(squares[inliers].mean())
        if not converged:
            return _Found(FitStatus.NOT_CONVERGED, vector, square), inliers
        if by_chance(np.sqrt(squares), self._elsewhere(vector), self.gate, freedom):
            return _Found(FitStatus.UNEXPLAINED, vector, square), inliers
        if self._is_contradicted(vector, squares, inliers):
            return _Found(FitStatus.UNEXPLAINED, vector, square), inliers
        deviation, determined = self._deviation(vector, inliers, square)
        return _Found(FitStatus.OK if determined else FitStatus.DEGENERATE, vector, square, deviation), inliers

    def squares(self, vector: Reals, points: Reals, spreads: Reals, eyes: Reals | None) -> Reals:
        """Return squared distances divided by the variances along the normals; of disparities, if rays are known."""
        off, normals = _offsets(points, vector)
        variances = np.einsum("ki,kij,kj->k", normals, from_triangle(spreads, 3), normals)
        return np.asarray(off**2 / (variances * _stretched(points, eyes, off, normals) ** 2))

    def _distances(self, models: Reals, points: Reals, spreads: Reals) -> Reals:
        rows = [_offsets(points, model) for model in models]
        off, normals = (np.array(each) for each in zip(*rows, strict=True))
        matrices = from_triangle(spreads, 3)
        variances = np.einsum("mki,mki->mk", normals, np.einsum("kij,mkj->mki", matrices, normals))
        return np.asarray(np.abs(off) / np.sqrt(np.maximum(variances, ROUNDING**2)))

    def _costs(self, models: Reals, points: Reals, spreads: Reals, threshold: float) -> Reals:
        return np.asarray((np.minimum(self._distances(models, points, spreads), threshold) ** 2).sum(-1))

    def _better(self, models: Reals, threshold: float, _: float) -> Reals:
        """Return better models of the points within a threshold, for `consensus`."""
        found, curved = models.copy(), self.kind == SolidKind.SPHERE
        for k, near in enumerate(self._distances(models, self.points, self.spreads) <= threshold):
            if near.sum() > _FEWEST[self.kind]:
                found[k] = fit_round(
                    kernels.sphere_step, self.points[near], self.spreads[near], models[k], curved=curved
                )[0]
        return found

    def _refined(self, vector: Reals, gate: float) -> tuple[Reals, Indices, bool]:
        """Return the vector with the least squares of the points within a gate, these, and whether it converged."""
        kept = np.ones(len(self.points), bool)
        inliers, converged = kept, False
        for count in range(_ROUNDS):
            inliers = kept & (self.squares(vector, self.points, self.spreads, self.eyes) <= gate**2)
            if inliers.sum() <= _FEWEST[self.kind] or not np.isfinite(vector).all():
                return vector, inliers, False
            if self.kind == SolidKind.SPHERE and count == 1:
                kept = _is_inside_outline(self.points, self.spreads, vector)
            before, (vector, converged) = vector, self._descended(vector, inliers)
            if count > 1 and np.abs(vector - before).max() <= ROOT * max(1.0, np.abs(vector).max()):
                break
        return vector, inliers, converged

    def _descended(self, vector: Reals, inliers: Indices) -> tuple[Reals, bool]:
        """Return the vector with the least sum of squares of some points, and whether it converged."""
        curved = self.kind == SolidKind.SPHERE
        points, spreads = self.points[inliers], self.spreads[inliers]
        if self.eyes is None:
            return fit_round(kernels.sphere_step, points, spreads, vector, curved=curved)
        eyes = self.eyes[inliers]
        rays, depths, scale = self._by_rays(vector, inliers)
        columns = np.array([0, 1, 2, 3, 4] if curved else [0, 1, 2, 4])

        def equations(states: Reals, _: Indices) -> tuple[Reals, Reals]:
            found = [_depths(eyes, rays, state, columns) for state in states]
            predicted, rows = (np.array(each) for each in zip(*found, strict=True))
            met = np.isfinite(predicted)
            inverse = np.where(met, 1 / np.where(met, predicted, 1), 0)
            residuals = np.where(met, scale * (1 / depths - inverse), 0)
            return residuals, np.where(met[..., None], scale[:, None] * inverse[..., None] ** 2 * rows, 0)

        def moved(step: Reals, states: Reals, _: Indices) -> Reals:
            ahead = states.copy()
            ahead[:, columns] += step
            squares = (ahead[:, :3] ** 2).sum(1) - 2 * ahead[:, 3] * ahead[:, 4]
            return ahead / np.sqrt(np.where(squares > 0, squares, np.nan))[:, None]

        found = minima(vector[None], equations, moved, np.full(1, ROUNDING), STEPS)
        return found.state[0], bool(found.converged[0])

    def _is_contradicted(self, vector: Reals, squares: Reals, inliers: Indices) -> bool:
        """Return whether distances are larger than their noise, or follow a shape along the object."""
        points, spreads = self.points[inliers], from_triangle(self.spreads[inliers], 3)
        off, normals = _offsets(points, vector)
        if self.eyes is None:
            residuals = np.sign(off) * np.sqrt(squares[inliers])
            # The most likely places on the object are independent of the distances from it.
            along = np.einsum("kij,kj->ki", spreads, normals)
            places = points - (off / np.einsum("ki,ki->k", normals, along))[:, None] * along
        else:
            rays, depths, scale = self._by_rays(vector, inliers)
            predicted, _ = _depths(self.eyes[inliers], rays, vector, np.arange(5))
            met = np.isfinite(predicted)
            residuals = (scale * (1 / depths - 1 / predicted))[met]
            places = (self.eyes[inliers] + predicted[:, None] * rays)[met]
        if Noise(1.0).contradicted((residuals**2).sum(), len(residuals) - _FEWEST[self.kind]):
            return True
        if self.kind == SolidKind.PLANE:
            places = places @ np.linalg.svd(vector[None, :3])[2][1:].T
        return has_shape(residuals, places, _DEGREES)

    def _by_rays(self, vector: Reals, inliers: Indices) -> tuple[Reals, Reals, Reals]:
        """Return the rays and depths of some points, and what makes differences of inverse depths standard normal."""
        points, spreads = self.points[inliers], self.spreads[inliers]
        arms = points - self.eyes[inliers]  # type: ignore[index]
        depths = np.linalg.norm(arms, axis=1)
        rays = arms / depths[:, None]
        _, normals = _offsets(points, vector)
        variances = np.einsum("ki,kij,kj->k", normals, from_triangle(spreads, 3), normals)
        # The standard deviation of a depth, over its square, is that of the disparity, which is constant.
        return rays, depths, depths**2 * np.abs(np.einsum("ki,ki->k", normals, rays)) / np.sqrt(variances)

    def _elsewhere(self, vector: Reals) -> Reals:
        """Return the distances of points at random in a cube about the points, with their covariances."""
        rng = np.random.default_rng(_SEED)
        half = np.ptp(self.points, axis=0).max() / 2
        middle = (self.points.max(0) + self.points.min(0)) / 2
        rows = rng.integers(0, len(self.points), N_WRONG)
        places = middle + half * rng.uniform(-1, 1, (N_WRONG, 3))
        return np.sqrt(self.squares(vector, places, self.spreads[rows], None))

    def _deviation(self, vector: Reals, inliers: Indices, square: float) -> tuple[float, bool]:
        """Return the largest standard deviation of the normal or the centre, and whether the points determine it."""
        points = self.points[inliers]
        _, normals = _offsets(points, vector)
        weights = 1 / np.einsum("ki,kij,kj->k", normals, from_triangle(self.spreads[inliers], 3), normals)
        raised = float(Noise(1.0).raised(np.array(square * len(points)), len(points) - _FEWEST[self.kind]))
        if self.kind == SolidKind.PLANE:
            centred = points - np.average(points, axis=0, weights=weights)
            across = np.linalg.svd(vector[None, :3])[2][1:]
            inside = centred @ across.T
            values, axes = np.linalg.eigh(np.einsum("k,ki,kj->ij", weights, inside, inside))
            deviation = float(np.sqrt(raised / max(float(values[0]), ROUNDING)))
            # Points on a line, within their noise, leave the turn about it undetermined.
            narrow = axes[:, 0] @ across
            noise = np.einsum("i,kij,j->k", narrow, from_triangle(self.spreads[inliers], 3), narrow)
            is_wide = Noise(1.0).contradicted(((centred @ narrow) ** 2 / noise).sum(), len(points) - 2)
            return deviation, bool(is_wide and certain_deviations() * deviation <= WIDE)
        rows = np.column_stack([normals, np.ones(len(points))])
        information = np.einsum("k,ki,kj->ij", weights, rows, rows)
        if rank(information) < len(information):
            return np.inf, False
        spread = raised * np.linalg.inv(information)
        deviation = float(np.sqrt(np.linalg.eigvalsh(spread[:3, :3])[-1]))
        return deviation, certain_deviations() * np.sqrt(spread[3, 3]) * abs(vector[3]) <= 1


def _one_for_each(viewpoint: ArrayLike, count: int) -> Reals:
    eyes = real_array(viewpoint, "viewpoint", (3,), "a place").astype(float)
    if eyes.shape not in ((3,), (count, 3)) or not np.isfinite(eyes).all():
        raise ValueError(f"viewpoint: shape {eyes.shape}; expected finite places, (3,) or ({count}, 3)")
    return np.broadcast_to(eyes, (count, 3))


def _meeting(points: Reals, spreads: Reals) -> Reals | None:
    """Return the place (n, 3) in which the main axes of covariances meet, repeated for each point, or None."""
    values, vectors = np.linalg.eigh(from_triangle(spreads, 3))
    if not (values[:, 2] > _LONG * values[:, 1]).all():
        return None
    rays = vectors[:, :, 2]
    across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
    total = across.sum(0)
    if np.linalg.eigvalsh(total)[0] <= ROUNDING * len(points):
        return None
    eye = np.linalg.solve(total, np.einsum("kij,kj->i", across, points))
    arms = points - eye
    missed = np.linalg.norm(np.einsum("kij,kj->ki", across, arms), axis=1)
    far = np.linalg.norm(arms, axis=1)
    return np.broadcast_to(eye, points.shape) if (missed <= _MEET * far).all() else None


def _stretched(points: Reals, eyes: Reals | None, off: Reals, normals: Reals) -> Reals:
    """Return the ratios of the depths of an object, along the rays of points, to those of the points."""
    if eyes is None:
        return np.ones(len(points))
    along = np.einsum("ki,ki->k", normals, points - eyes)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = 1 - off / along
    return np.asarray(np.clip(np.nan_to_num(ratio, nan=1.0), 1 / _STRETCH, _STRETCH))


def _depths(eyes: Reals, rays: Reals, vector: Reals, columns: Indices) -> tuple[Reals, Reals]:
    """Return the depths (k,) at which rays meet an object, and their derivatives by some of its coefficients.

    NaN for rays that miss a sphere, or pass near its outline.
    """
    normal, curvature, level = vector[:3], vector[3], vector[4]
    with np.errstate(divide="ignore", invalid="ignore"):
        if curvature == 0:
            depths = (level - eyes @ normal) / (rays @ normal)
        else:
            arms = normal / curvature - eyes
            along = np.einsum("ki,ki->k", arms, rays)
            square = 1 / curvature**2
            aside = (arms**2).sum(1) - along**2
            half = np.sqrt(np.where(aside <= _OUTLINE**2 * square, square - aside, np.nan))
            depths = along - np.where((arms**2).sum(1) > square, half, -half)
        places = eyes + depths[:, None] * rays
        slope = np.einsum("ki,ki->k", normal - curvature * places, rays)
        rows = np.column_stack([places, -(places**2).sum(1) / 2, -np.ones(len(places))])
        return depths, -rows[:, columns] / slope[:, None]


def _offsets(points: Reals, vector: Reals) -> tuple[Reals, Reals]:
    """Return signed distances of points from an object, and unit normals at its nearest places."""
    curvature = vector[3]
    inner = points @ vector[:3] - curvature * (points**2).sum(1) / 2 - vector[4]
    root = np.sqrt(np.maximum(1 - 2 * curvature * inner, ROUNDING))
    return np.asarray(2 * inner / (1 + root)), (vector[:3] - curvature * points) / root[:, None]


def _is_inside_outline(points: Reals, spreads: Reals, vector: Reals) -> Reals:
    """Return which points, moved along their most uncertain direction, meet a sphere far from its outline.

    Points without such a direction have no outline.
    """
    values, vectors = np.linalg.eigh(from_triangle(spreads, 3))
    directions = vectors[:, :, 2]
    arms = points - vector[:3] / vector[3]
    aside = arms - np.einsum("ki,ki->k", arms, directions)[:, None] * directions
    is_inside = np.linalg.norm(aside, axis=1) * abs(vector[3]) <= _OUTLINE
    return np.asarray(is_inside | (values[:, 2] <= _LONG * values[:, 1]))
