"""Refinement of motors: robust distances of points from points, planes and lines, with scales from the data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3
from generated import registration as kernels

from ..arguments import Reals, finite, finite_number, moderate, real_array
from ..elements import MOTOR, POINT, Coefficients, elements
from ..evidence.noise import NORMAL
from ..evidence.triangles import from_triangle
from ..precision import NEGLIGIBLE, ROUNDING
from .clouds import Cloud, cloud_of, normals_of

_ACROSS = 0.02
"""Factor of squared distances along a plane: it holds motions that planes leave free."""
_FEWEST = 6
"""Neighbours that a step needs."""
_MEASURED = {"planes": 1, "lines": 2, "points": 3}
"""Coordinates of a point that a neighbour determines."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A target of refinement: a cloud with a direction and two factors of squared distances for each point."""

    cloud: Cloud
    directions: Reals
    across: Reals
    along: Reals


class Part(NamedTuple):
    """Points with weights, and the surface from which their distances are measured.

    Points are of the source and the surface is of the target, or the opposite if the part is measured back.
    """

    points: Reals
    weights: Reals
    surface: Surface
    back: bool = False


class Sums(NamedTuple):
    """The sums of a part in the last step: information of small motions, weights, squares, and all distances.

    Distances are infinite without a neighbour.
    """

    information: Reals
    weight: float
    squares: float
    distances: Reals


@dataclass(frozen=True, eq=False)
class Refined:
    """A refined motor, with the sums of its last step for each part."""

    motor: Reals
    sums: tuple[Sums, ...]


def points_target(cloud: Cloud) -> Surface:
    """Return a target to whose points distances are measured."""
    n = len(cloud.points)
    return Surface(cloud, np.tile([1.0, 0, 0], (n, 1)), np.ones(n), np.zeros(n))


def planes_target(cloud: Cloud, directions: Reals | None = None) -> Surface:
    """Return a target to whose tangent planes distances are measured."""
    n = len(cloud.points)
    normals = normals_of(cloud) if directions is None else directions
    return Surface(cloud, normals, np.full(n, _ACROSS), np.full(n, 1 - _ACROSS))


def lines_target(cloud: Cloud, directions: Reals) -> Surface:
    """Return a target to whose lines, with unit directions, distances are measured."""
    n = len(cloud.points)
    return Surface(cloud, directions, np.ones(n), np.full(n, _ACROSS - 1))


def neighbours(target: Surface, points: Reals, gate: float, least: float = 0.0) -> tuple[Any, Any, Reals]:
    """Return the row of the nearest point within a gate, whether there is one, and the distance from its surface.

    If the nearest point is nearer than the least distance, the second one is taken.
    """
    if least:
        far, rows = target.cloud.tree.query(points, 2, distance_upper_bound=gate)
        second = (far[:, 0] < least).astype(int)
        far, rows = far[np.arange(len(far)), second], rows[np.arange(len(far)), second]
    else:
        far, rows = target.cloud.tree.query(points, distance_upper_bound=gate)
    found = np.isfinite(far)
    rows = np.where(found, rows, 0)
    off = points - target.cloud.points[rows]
    own = np.einsum("ni,ni->n", off, target.directions[rows])
    square = target.across[rows] * np.einsum("ni,ni->n", off, off) + target.along[rows] * own * own
    return rows, found, np.where(found, np.sqrt(np.maximum(square, 0)), np.inf)


def moved_points(motor: Reals, part: Part) -> Reals:
    """Return the points of a part at the place of its surface."""
    return np.asarray(pga3.move_point(pga3.motor_inverse(motor) if part.back else motor, part.points))


def refined(motor: Reals, parts: Sequence[Part], gates: Sequence[float], scales: Sequence[float]) -> Refined:
    """Take a Gauss-Newton step for each gate, the greatest distance of neighbours, and each scale of residuals.

    A step minimises the sum over all parts. A scale of 0 is taken from the data of each part: three times the
    normalised median of the distances within the gate.
    """
    sums: list[Sums] = []
    for gate, fixed in zip(gates, scales, strict=True):
        steps = [_sums_of(motor, part, gate, fixed) for part in parts]
        if sum(int(np.isfinite(one.distances).sum()) for one, _ in steps) < _FEWEST:
            nothing = np.zeros((6, 6))
            sums = [Sums(nothing, 0.0, 0.0, one.distances) for one, _ in steps]
            break
        sums = [one for one, _ in steps]
        information = sum((one.information for one in sums), np.zeros((6, 6)))
        damped = information + np.diag(NEGLIGIBLE * np.diag(information) + 1e-30)
        slope = sum((slope for _, slope in steps), np.zeros(6))
        step = np.linalg.solve(damped, -slope)
        motor = pga3.normalize_motor(pga3.motor_product(pga3.motor_exponential(step), motor))
    return Refined(motor, tuple(sums))


def _sums_of(motor: Reals, part: Part, gate: float, fixed: float) -> tuple[Sums, Reals]:
    """Return the sums of a part at a motor, and the derivatives of half the sum of squares."""
    surface = part.surface
    rows, found, distances = neighbours(surface, moved_points(motor, part), gate)
    if not found.any():
        return Sums(np.zeros((6, 6)), 0.0, 0.0, distances), np.zeros(6)
    scale = fixed or max(3 * NORMAL * float(np.median(distances[found])), 1e-6 * gate)
    points, targets = part.points, surface.cloud.points
    directions, across, along = surface.directions, surface.across, surface.along
    if part.back:
        points, targets, directions = targets[rows], points, pga3.move_direction(motor, directions[rows])
        across, along, rows = across[rows], along[rows], np.arange(len(points))
    table, slope, (weight, squares) = kernels.alignment_sums(
        motor, points, part.weights * found, targets, directions, across, along, rows, scale
    )
    return Sums(from_triangle(table, 6), float(weight), float(squares), distances), np.asarray(slope)


@dataclass(frozen=True, eq=False)
class Refinement:
    """A refined motion.

    Attributes
    ----------
    motor : array, (8,)
    inliers : array of bool, (n,)
        Points of the source with a neighbour.
    covariance : array, (6, 6)
        Of the coefficients e12 e13 e23 e01 e02 e03 of the small bivector B for which ``exp(B) motor`` is true; infinite
        on the diagonal without enough neighbours.
    residual : float
        Root mean square of the distances, with robust weights.
    """

    motor: Coefficients
    inliers: Any
    covariance: Reals
    residual: float


@elements({"motor": MOTOR}, source=POINT, target=POINT, motor=MOTOR)
def refine(
    source: ArrayLike,
    target: ArrayLike,
    motor: ArrayLike,
    gate: float,
    *,
    to: str = "planes",
    directions: ArrayLike | None = None,
    steps: int = 15,
) -> Refinement:
    """Refine a motor that nearly takes a source to a target.

    Parameters
    ----------
    source : array_like, (n, 3)
    target : array_like, (m, 3)
    motor : array_like, (8,)
        A unit motor of `generated.pga3`.
    gate : float
        The greatest distance of neighbours.
    to : {"planes", "points", "lines"}, optional
        To what distances are measured: tangent planes of the target, its points, or lines through them.
    directions : array_like, (m, 3), optional
        Unit normals of the planes, by default those of neighbours, or unit directions of the lines.
    steps : int, optional
        Gauss-Newton steps. The robust scale of each follows from the distances before it.

    Returns
    -------
    Refinement

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or is not finite, lines have no directions, the target has fewer
        than two points, or the gate is not positive.
    """
    pairs = ((source, "source"), (target, "target"))
    x, y = (_points(p, name) for p, name in pairs)
    if len(y) < 2:
        raise ValueError(f"target: {len(y)} points; expected at least two")
    if finite_number(gate, "gate") <= 0:
        raise ValueError(f"gate: {gate}; expected a positive distance")
    start = finite(real_array(motor, "motor", (8,)), "motor").astype(float)
    along = None
    if directions is not None:
        along = finite(real_array(directions, "directions", (len(y), 3), "directions"), "directions")
    if to not in _MEASURED or (to == "lines" and along is None):
        raise ValueError(f"to: {to!r} without directions; expected planes, points, or lines with directions")
    cloud = cloud_of(y)
    if to == "points":
        surface = points_target(cloud)
    elif to == "lines" and along is not None:
        surface = lines_target(cloud, along)
    else:
        surface = planes_target(cloud, along)
    found = refined(start, [Part(x, np.ones(len(x)), surface)], [gate] * steps, [0.0] * steps)
    if not found.sums:
        found = Refined(found.motor, (Sums(np.zeros((6, 6)), 0.0, 0.0, np.full(len(x), np.inf)),))
    (sums,) = found.sums
    freedom = _MEASURED[to] * sums.weight - 6
    covariance = np.diag(np.full(6, np.inf))
    if freedom > 0 and np.linalg.cond(sums.information) < 1 / ROUNDING:
        covariance = sums.squares / freedom * np.linalg.inv(sums.information)
    residual = float(np.sqrt(sums.squares / sums.weight)) if sums.weight else np.inf
    return Refinement(found.motor, np.isfinite(sums.distances), covariance, residual)


def _points(value: ArrayLike, name: str) -> Reals:
    points = finite(real_array(value, name, (-1, 3), "points"), name).astype(float)
    if points.ndim != 2:
        raise ValueError(f"{name}: shape {points.shape}; expected (n, 3), points")
    return moderate(points, name)
