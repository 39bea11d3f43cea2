"""Least squares over intrinsic parameters, distortion and the poses of planes, which are eliminated view by view."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from generated import lenses, pga3

from ..arguments import Reals
from ..evidence.least_squares import FACTOR, FIRST, LEAST, MOST
from ..precision import ROUNDING, SQUARED
from .distortion import NAMES, Model

N_INTRINSICS = 5
"""Of the kernels: ``fx fy cx cy skew``."""
N_POSE = 6
"""The number of parameters of a pose."""
State = TypeVar("State")
_STEPS = 1000
"""A limit on work: the number of iterations from a start. Ten are usual; correlated rational terms need hundreds."""


class Views(NamedTuple):
    """Points of planes and their pixels; the shorter of unequal views are filled up with points of weight 0."""

    places: Reals
    """(v, n, 2) relative to their centroids."""
    pixels: Reals
    """(v, n, 2)"""
    weights: Reals
    """(v, n) 1 or 0."""

    def part(self, which: Reals) -> Views:
        """Return some of the views."""
        return Views(*(each[which] for each in self))


@dataclass(frozen=True, slots=True, eq=False)
class Lens:
    """Parameters of a camera, and the poses of planes."""

    model: Model
    intrinsics: Reals
    """(5,) as in the kernels."""
    k: Reals
    """(8,) or (4,)"""
    poses: Reals
    """(v, 8) Motors from the frames of the planes to that of the camera."""


@dataclass(frozen=True, slots=True, eq=False)
class Adjustment:
    """A minimum of the sum of squared distances of pixels."""

    lens: Lens
    costs: Reals
    """(v,) Sum of squares of each view."""
    information: Reals
    """(p, p) Of the used parameters, after elimination of the poses."""
    converged: bool

    @property
    def cost(self) -> float:
        """The sum of squares."""
        return float(self.costs.sum())


def views_of(places: list[Reals], pixels: list[Reals]) -> tuple[Views, Reals]:
    """Return views of points relative to their centroids, and these (v, 2)."""
    n = max(map(len, places))
    centroids = np.array([each.mean(0, dtype=float) for each in places])
    shape = len(places), n
    found = Views(np.zeros((*shape, 2)), np.zeros((*shape, 2)), np.zeros(shape))
    for k, (place, image) in enumerate(zip(places, pixels, strict=True)):
        # A repeated point keeps what has weight 0 finite.
        found.places[k], found.pixels[k] = place[0] - centroids[k], image[0]
        found.places[k, : len(place)], found.pixels[k, : len(image)] = place - centroids[k], image
        found.weights[k, : len(place)] = 1
    return found, centroids


def adjusted(start: Lens, views: Views, used: Reals) -> Adjustment:
    """Minimise the squared distances of pixels by Levenberg and Marquardt's iterations.

    Parameters
    ----------
    start : Lens
    views : Views
    used : array of int, (p,)
        The numbers of the estimated parameters among the intrinsic ones, followed by the coefficients of the lens. With
        none, only poses are estimated.

    Returns
    -------
    Adjustment
    """
    exact = SQUARED * float((views.pixels**2).sum())
    found = descended(start, lambda lens: sums_of(lens, views), _moved, used, exact)
    return Adjustment(found.state, found.sums[:, -1, -1], found.information, found.converged)


class Descended(NamedTuple, Generic[State]):
    """The end of a descent."""

    state: State
    sums: Reals
    """(v, q, q) Of the equations of each view."""
    information: Reals
    """(p, p) Of the used parameters, after elimination of the poses; 0 if there is none."""
    converged: bool


def descended(
    start: State,
    sums_of: Callable[[State], Reals],
    moved: Callable[[State, Reals, Reals, Reals], State],
    used: Reals,
    exact: float,
) -> Descended[State]:
    """Minimise sums of squares over parameters that views share and poses of their own.

    Parameters
    ----------
    start
        The first state.
    sums_of : callable
        Function from a state to the sums of products (v, q, q) of the columns of the equations of each view: those of
        shared parameters, of the pose, and the residual.
    moved : callable
        Function from a state, `used`, steps of used parameters (p,) and of poses (v, 6) to a state.
    used : array of int, (p,)
        The columns of the parameters that are estimated.
    exact : float
        A sum of squares below this is rounding.

    Returns
    -------
    Descended
    """
    state, sums = start, sums_of(start)
    cost, damping, converged = _cost(sums), FIRST, False
    if not np.isfinite(cost):
        return Descended(start, sums, np.zeros((len(used),) * 2), False)
    for _ in range(_STEPS):
        step, pose_steps, _ = _solved(sums, used, damping)
        trial = moved(state, used, step, pose_steps)
        new = sums_of(trial)
        change = cost - _cost(new)
        if change > 0:
            state, sums, cost, damping = trial, new, _cost(new), max(damping / FACTOR, LEAST)
        else:
            damping *= FACTOR
        if abs(change) <= ROUNDING * cost or cost <= exact or damping > MOST:
            converged = True
            break
    return Descended(state, sums, _solved(sums, used, 0.0)[2], converged)


def _cost(sums: Reals) -> float:
    return float(sums[:, -1, -1].sum())


def sums_of(lens: Lens, views: Views) -> Reals:
    """Return sums of products of equations (v, q, q): intrinsic parameters, coefficients, pose, distance."""
    kernel = lenses.brown_sums if lens.model == "brown" else lenses.fisheye_sums
    poses = np.ascontiguousarray(pga3.motor_to_matrix(lens.poses)[:, :3])
    with np.errstate(all="ignore"):
        triangle = kernel(poses, lens.intrinsics, lens.k, *views)
    size = N_INTRINSICS + len(lens.k) + N_POSE + 1
    rows, columns = _lower(size)
    whole = np.empty((len(triangle), size, size))
    whole[:, rows, columns] = whole[:, columns, rows] = triangle
    return whole


@lru_cache(maxsize=10)
def _lower(size: int) -> tuple[Reals, Reals]:
    return np.tril_indices(size)


def _solved(sums: Reals, used: Reals, damping: float) -> tuple[Reals, Reals, Reals]:
    """Return steps of the used parameters (p,) and poses (v, 6), and the equations without poses (p, p).

    The steps are 0 if the equations are singular.
    """
    size = sums.shape[-1]
    of_pose = slice(size - 1 - N_POSE, size - 1)
    own, right = sums[:, of_pose, of_pose].copy(), sums[:, of_pose, size - 1 :]
    across = sums[:, of_pose, used]
    common, side = sums[:, used[:, None], used].sum(0), sums[:, used, -1].sum(0)
    own[:, range(N_POSE), range(N_POSE)] *= 1 + damping
    common[range(len(used)), range(len(used))] *= 1 + damping
    try:
        solved = np.linalg.solve(own, np.concatenate([across, right], -1))
        transposed = np.swapaxes(across, 1, 2)
        reduced = common - (transposed @ solved[..., :-1]).sum(0)
        step = -np.linalg.solve(reduced, side - (transposed @ solved[..., -1:]).sum(0)[:, 0])
    except np.linalg.LinAlgError:
        return np.zeros(len(used)), np.zeros((len(sums), N_POSE)), np.zeros((len(used),) * 2)
    return step, -(solved[..., -1] + solved[..., :-1] @ step), reduced


def _moved(lens: Lens, used: Reals, step: Reals, pose_steps: Reals) -> Lens:
    parameters = np.concatenate([lens.intrinsics, lens.k])
    parameters[used] += step
    with np.errstate(all="ignore"):
        moved = pga3.motor_product(pga3.motor_exponential(np.ascontiguousarray(pose_steps)), lens.poses)
        poses = pga3.normalize_motor(moved)
    intrinsics, k = parameters[:N_INTRINSICS].copy(), parameters[N_INTRINSICS:].copy()
    return replace(lens, intrinsics=intrinsics, k=k, poses=poses)


def equations(lens: Lens, views: Views) -> tuple[Reals, Reals, Reals]:
    """Return the equations of all points, with rows of weight 0 for missing ones.

    Returns
    -------
    off : array, (v, 2 n)
        Distances of the images of points from the pixels.
    rows : array, (v, 2 n, q)
        Their derivatives by intrinsic parameters, coefficients and pose.
    sights : array, (v, n, 3)
        The points in the camera frame.
    """
    kernel = lenses.project_brown_derivatives if lens.model == "brown" else lenses.project_fisheye_derivatives
    poses = pga3.motor_to_matrix(lens.poses)[:, None, :3]
    flat = np.concatenate([views.places, np.zeros((*views.places.shape[:-1], 1))], -1)
    with np.errstate(all="ignore"):
        pixels, rows = kernel(np.ascontiguousarray(poses), lens.intrinsics, lens.k, flat)
    weights = views.weights[..., None]
    off = np.where(weights > 0, pixels - views.pixels, 0)
    v = len(views.places)
    sights = flat @ np.swapaxes(poses[:, 0, :, :3], 1, 2) + poses[..., 3]
    whole = np.where(weights[..., None] > 0, rows, 0).reshape(v, -1, rows.shape[-1])
    return off.reshape(v, -1), whole, sights


def used_parameters(model: Model, skew: bool, n_coefficients: int) -> Reals:
    """Return the numbers of the parameters to estimate, as in `adjusted`."""
    assert n_coefficients <= len(NAMES[model])
    return np.concatenate(
        [np.arange(N_INTRINSICS if skew else N_INTRINSICS - 1), N_INTRINSICS + np.arange(n_coefficients)]
    )
