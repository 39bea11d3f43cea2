"""Accelerations of one robot from its mass matrix, as expressions."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from ..frontend.operations import select
from ..specs.robots import NO_INERTIA
from .chains import Chain, exact
from .exact_tables import path_to
from .frames import dot, origins, plus
from .inertias import about_origins


def accelerations(chain: Chain, mass_matrix: Sequence[Sequence[Any]], forces: Sequence[Any]) -> tuple[Any, ...]:
    """Solve ``mass_matrix x = forces`` by the factorisation ``L^T D L``, from the last variable to the first.

    In this order, entries for pairs of joints of which neither carries the other remain 0 (Featherstone, *Int. J.
    Robotics Research* 24:487, 2005).

    Parameters
    ----------
    chain : Chain
    mass_matrix : n rows of n scalars
        Entries that are always 0 are given as the number 0.
    forces : n scalars

    Returns
    -------
    n scalars
        NaN if the inertia at a joint is no larger than rounding errors.
    """
    rows, solution = [list(row) for row in mass_matrix], list(forces)
    n, inverses, factors = len(rows), list[Any](), list[list[Any]]()
    for k, largest in reversed(list(enumerate(_largest_inertias(chain)))):
        inertia = rows[k][k]
        is_significant = NO_INERTIA * largest < inertia
        inverse = select(is_significant, 1, 0) / select(is_significant, inertia, 0)
        row = [_product(rows[k][i], inverse) for i in range(k)]
        for i in range(k):
            for j in range(i + 1):
                rows[i][j] = _less(rows[i][j], row[i], rows[k][j])
            solution[i] = _less(solution[i], row[i], solution[k])
        inverses.insert(0, inverse)
        factors.insert(0, row)
    for k in range(n):
        solution[k] = solution[k] * inverses[k]
        for i in range(k):
            solution[k] = _less(solution[k], factors[k][i], solution[i])
    return tuple(solution)


def _is_zero(x: Any) -> bool:
    return isinstance(x, int) and x == 0


def _product(a: Any, b: Any) -> Any:
    return 0 if _is_zero(a) or _is_zero(b) else a * b


def _less(a: Any, b: Any, c: Any) -> Any:
    """Return ``a - b c``."""
    return a if _is_zero(b) or _is_zero(c) else a - b * c


def _largest_inertias(chain: Chain) -> list[Fraction]:
    """Return an approximate upper bound of the inertia at each variable, for any directions of the axes."""
    variables, ratios, _ = chain.followed
    points, found = origins(chain), [Fraction(0)] * chain.n_variables
    for joint, (mass, h, tensor) in enumerate(about_origins(chain)):
        spread = tensor[0][0] + tensor[1][1] + tensor[2][2]
        for carrier in path_to(chain, joint):
            away = plus(points[joint], points[carrier], -1)
            about = spread + 2 * abs(dot(away, h)) + mass * dot(away, away)
            if chain.kinds[carrier] == "floating":
                for freedom, bound in enumerate((about,) * 3 + (mass,) * 3):
                    found[freedom] += bound
                continue
            inertia = about if chain.kinds[carrier] == "revolute" else mass
            if joint == carrier and chain.armature:
                inertia += exact(chain.armature[joint])
            found[variables[carrier]] += ratios[carrier] ** 2 * inertia
    return found
