"""Least squares in kernels: Levenberg and Marquardt's steps on a manifold, each from the sums over all residuals."""

from fractions import Fraction
from itertools import combinations_with_replacement
from typing import Any, NamedTuple

import gacompiler as ga
from gacompiler import iterate, maximum, minimum, select
from gacompiler.specs.families.covariances import choose, dot, size_of_triangle, square

FIRST_DAMPING, LEAST_DAMPING, LARGEST_DAMPING = Fraction(1, 10**4), Fraction(1, 10**12), 10**8
"""Damping relative to the diagonal: at the start, where it has no effect, and where steps are shorter than rounding."""
SETTLED = Fraction(1, 10**14)
"""The part of the sum of squares by which a step must be expected to decrease it: less is rounding."""
ROUNDING = Fraction(1, 10**22)
"""A sum of squares of pixels below this is rounding."""
TINY = Fraction(1, 10**40)
"""Added to the diagonal, so that there is a step where a parameter has no influence."""
UNKNOWN = 10**30
"""More than any sum of squares."""


class _State(NamedTuple):
    """The state with the least sum of squares so far, the next one, and the normal equations of the former."""

    best: Any
    following: Any
    table: Any
    slope: Any
    cost: Any
    damping: Any
    done: Any


class Descent(NamedTuple):
    """The end of a descent."""

    state: Any
    table: Any
    """The upper triangle of the normal equations,"""
    slope: Any
    """half of the derivatives of the sum of squares,"""
    cost: Any
    """and the sum."""
    gain: Any
    """The decrease of the sum that is expected from the step that solves the equations."""
    ended: Any
    """1 if no step decreases the sum any further, else 0."""
    steps: Any


def descend(start, n_parameters, equations, moved, at_most, rounding=ROUNDING, settled=SETTLED):
    """Minimise a sum of squares.

    Parameters
    ----------
    start : tuple of scalar
    n_parameters : int
        The number of coordinates of a step.
    equations : callable
        Function from a state to the upper triangle of the normal equations, half of the derivatives and the sum of
        squares, in one tuple.
    moved : callable
        Function from a state and a step to a state.
    at_most : scalar
        The maximum number of steps.
    rounding : number
        A sum of squares below this is rounding.
    settled : scalar
        The part of the sum of squares by which a last step is expected to decrease it.

    Returns
    -------
    Descent
    """
    n, size = len(start), size_of_triangle(n_parameters)

    def body(now):
        sums = equations(now.following)
        better = sums[-1] < now.cost
        kept = choose(better, (*now.following, *sums), (*now.best, *now.table, *now.slope, now.cost))
        state, table, slope, cost = kept[:n], kept[n : n + size], kept[n + size : -1], kept[-1]
        damping = select(better, maximum(now.damping / 10, LEAST_DAMPING), now.damping * 10)
        step, gain = step_of(table, slope, damping)
        done = select(gain <= settled * cost + rounding, 1, select(damping > LARGEST_DAMPING, 1, 0))
        return _State(state, tuple(moved(state, step)), table, slope, cost, damping, done)

    first = _State(start, start, (0,) * size, (0,) * n_parameters, UNKNOWN, 10 * FIRST_DAMPING, 0)
    found, ended, steps = iterate(body, first, lambda _, new: new.done > 0, at_most)
    _, gain = step_of(found.table, found.slope, LEAST_DAMPING)
    return Descent(found.best, found.table, found.slope, found.cost, gain, ended, steps)


def truncated_equations(columns, off, square, limit):
    """Return what `equations` of `descend` sums for one residual, whose square counts at most `limit`.

    Parameters
    ----------
    columns : sequence of sequence of scalar
        The derivatives of the residual by each coordinate of a step; beyond the limit they count as 0.
    off : sequence of scalar
        The residual.
    square, limit : scalar
        The square of the residual, and what may have been added to it; and the largest one.
    """
    used = select(square < limit, 1, 0)
    table = tuple(used * dot(a, b) for a, b in combinations_with_replacement(columns, 2))
    return (*table, *(used * dot(column, off) for column in columns), minimum(square, limit))


def step_of(table, slope, damping):
    """Return the damped step, and the decrease of the sum of squares that it is expected to cause."""
    matrix = square(table, len(slope))
    damped = [list(row) for row in matrix]
    for k in range(len(slope)):
        damped[k][k] = matrix[k][k] * (1 + damping) + TINY
    step, _ = ga.solve_symmetric(damped, slope)
    return [-x for x in step], dot(step, slope)
