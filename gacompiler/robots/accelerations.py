"""Accelerations of one robot from its mass matrix, as expressions."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from ..frontend.operations import select
from ..specs.robots import NO_INERTIA
from .chains import Chain, exact
from .frames import dot, origins, plus
from .inertias import about_origins
from .tables import path_to


def accelerations(chain: Chain, mass_matrix: Sequence[Sequence[Any]], forces: Sequence[Any]) -> tuple[Any, ...]:
    """The solution of ``mass_matrix x = forces``, by ``L^T D L`` from the last variable to the first.

    In that order entries for joints that do not carry each other stay 0 (Featherstone, *Int. J. Robotics Research*
    24:487, 2005).

    Parameters
    ----------
    chain : Chain
    mass_matrix : n rows of n scalars
        Entries that are always 0 are the number 0.
    forces : n scalars

    Returns
    -------
    n scalars
        NaN where what is felt at a joint is no more than rounding.
    """
    rows, solution = [list(row) for row in mass_matrix], list(forces)
    n, sizes, factors = len(rows), list[Any](), list[list[Any]]()
    for k, largest in reversed(list(enumerate(_largest(chain)))):
        felt = rows[k][k]
        is_felt = NO_INERTIA * largest < felt
        size = select(is_felt, 1, 0) / select(is_felt, felt, 0)
        row = [_product(rows[k][i], size) for i in range(k)]
        for i in range(k):
            for j in range(i + 1):
                rows[i][j] = _less(rows[i][j], row[i], rows[k][j])
            solution[i] = _less(solution[i], row[i], solution[k])
        sizes.insert(0, size)
        factors.insert(0, row)
    for k in range(n):
        solution[k] = solution[k] * sizes[k]
        for i in range(k):
            solution[k] = _less(solution[k], factors[k][i], solution[i])
    return tuple(solution)


def _is_zero(x: Any) -> bool:
    return isinstance(x, int) and x == 0


def _product(a: Any, b: Any) -> Any:
    return 0 if _is_zero(a) or _is_zero(b) else a * b


def _less(a: Any, b: Any, c: Any) -> Any:
    """``a - b c``."""
    return a if _is_zero(b) or _is_zero(c) else a - b * c


def _largest(chain: Chain) -> list[Fraction]:
    """For each variable about the most inertia that may be felt there, whatever the axes are."""
    variables, ratios, _ = chain.followed
    points, found = origins(chain), [Fraction(0)] * chain.n_variables
    for joint, (mass, h, tensor) in enumerate(about_origins(chain)):
        spread = tensor[0][0] + tensor[1][1] + tensor[2][2]
        for carrier in path_to(chain, joint):
            away = plus(points[joint], points[carrier], -1)
            about = spread + 2 * abs(dot(away, h)) + mass * dot(away, away)
            felt = about if chain.kinds[carrier] == "revolute" else mass
            if joint == carrier and chain.armature:
                felt += exact(chain.armature[joint])
            found[variables[carrier]] += ratios[carrier] ** 2 * felt
    return found
