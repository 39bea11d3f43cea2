"""Refinement of motors: robust distances of points from points, planes and lines, with scales from the data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from generated import pga3
from generated import registration as kernels

from ..arguments import Reals
from .clouds import Cloud, normals_of

_UPPER = np.triu_indices(6)
_ACROSS = 0.02
"""Factor of squared distances along a plane: it holds motions that planes leave free."""
_DAMPING = 1e-9


@dataclass(frozen=True, eq=False)
class Surface:
    """A target of refinement: a cloud with a direction and two factors of squared distances for each point."""

    cloud: Cloud
    directions: Reals
    across: Reals
    along: Reals


@dataclass(frozen=True, eq=False)
class Refined:
    """A refined motor, with the information of its small motions and the sums of its last step."""

    motor: Reals
    information: Reals
    weight: float
    squares: float
    distances: Reals
    """Of all points, by the metric of the surface; infinite without a neighbour."""


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


def neighbours(target: Surface, points: Reals, gate: float) -> tuple[Any, Any, Reals]:
    """Return the row of the nearest point within a gate, whether there is one, and the distance from its surface."""
    far, rows = target.cloud.tree.query(points, distance_upper_bound=gate)
    found = np.isfinite(far)
    rows = np.where(found, rows, 0)
    off = points - target.cloud.points[rows]
    own = (off * target.directions[rows]).sum(1)
    square = target.across[rows] * (off * off).sum(1) + target.along[rows] * own * own
    return rows, found, np.where(found, np.sqrt(np.maximum(square, 0)), np.inf)


def refined(
    motor: Reals, points: Reals, weights: Reals, target: Surface, gates: list[float], scales: list[float]
) -> Refined:
    """Take a Gauss-Newton step for each gate, the greatest distance of neighbours, and each scale of residuals.

    A scale of 0 is taken from the data: three times the normalised median of the distances within the gate.
    """
    information = np.zeros((6, 6))
    weight = squares = 0.0
    distances = np.full(len(points), np.inf)
    for gate, fixed in zip(gates, scales, strict=True):
        rows, found, distances = neighbours(target, pga3.move_point(motor, points), gate)
        if found.sum() < 6:
            break
        scale = fixed or max(3 * 1.4826 * float(np.median(distances[found])), 1e-6 * gate)
        table, slope, (weight, squares) = kernels.alignment_sums(
            motor, points, weights * found, target.cloud.points, target.directions, target.across, target.along,
            rows, scale,
        )  # fmt: skip
        information = np.zeros((6, 6))
        information[_UPPER] = table
        information = information + np.triu(information, 1).T
        damped = information + np.diag(_DAMPING * np.diag(information) + 1e-30)
        step = np.linalg.solve(damped, -slope)
        motor = pga3.normalize_motor(pga3.motor_product(pga3.motor_exponential(step), motor))
    return Refined(motor, information, float(weight), float(squares), distances)
