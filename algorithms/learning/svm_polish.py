"""Active-set iterations for dual problems of support vector machines: all free variables are solved for at once."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from .gram import GramRows, expanded
from .smo import FAR, Bools, Problem, State, gaps
from .svm_kernels import Floats

_ITERATIONS = 12
"""A limit on work: how often the free variables are solved for; each time some of them reach a bound."""
_DESCENTS = 60
"""A limit on work: the number of steps along the free variables."""
_FIXED = 4
"""The inverse of the share of variables passing a bound that are fixed at a time."""
_RIDGE = 1e-5
"""Added to the diagonal of singular equations, relative to it."""
_LARGEST = 1500
"""Number of free variables up to which their equations are solved."""


def polish(problem: Problem, state: State, tolerance: float, is_free: Bools | None = None) -> bool:
    """Solve for all free variables, and change their set until the conditions of optimality hold.

    The state is changed only if that succeeds.

    Parameters
    ----------
    problem : Problem
    state : State
    tolerance : float
    is_free : array of bool, (m, n), optional
        The first guess; by default the variables that are between their bounds.

    Returns
    -------
    bool
    """
    signed = state.signed.copy()
    rise, fall = problem.slopes(signed)
    offset = np.where(signed > 0, problem.width, -problem.width)
    if is_free is None:
        is_free = (rise == fall) & (signed != 0)
    elif problem.width:
        offset = np.where(problem.targets > 0, problem.width, -problem.width)
    for _ in range(_ITERATIONS):
        count = np.count_nonzero(is_free)
        if not 0 < count <= _LARGEST or not is_free.any(1).all():
            return False
        solved = _solved(problem, signed, is_free, offset)
        if solved is None:
            return False
        signed, constant = solved
        below = np.where((problem.width > 0) & (offset > 0), 0.0, problem.lower)
        above = np.where((problem.width > 0) & (offset < 0), 0.0, problem.upper)
        outside = is_free & ((signed < below) | (signed > above))
        signed = np.where(outside, np.clip(signed, below, above), signed)
        gradient = problem.gradient(signed)
        if not outside.any():
            found = State(signed, gradient, state.steps, state.shrunk)
            lowest, highest = gaps(problem, found)
            if (highest - lowest <= tolerance).all():
                state.signed, state.gradient = signed, gradient
                return True
        rise, fall = problem.slopes(signed)
        slope = gradient + constant[:, None]
        gains, loses = slope + rise < -tolerance / 4, slope + fall > tolerance / 4
        fixed = ~is_free
        is_free = is_free & ~outside
        offset = np.where(fixed & gains & (rise < FAR), rise, offset)
        offset = np.where(fixed & loses & (fall > -FAR), fall, offset)
        is_free = is_free | (fixed & (gains | loses))
    return False


def descend(problem: Problem, state: State) -> bool:
    """Decrease the objective by solving for the free variables; those that would pass a bound are fixed there.

    A part of the variables that pass a bound is fixed at a time, the nearest ones first, until the rest are within
    their bounds. No variable becomes free.

    Returns
    -------
    bool
        Whether the objective has decreased; otherwise the state is unchanged.
    """
    signed = state.signed.copy()
    for _ in range(_DESCENTS):
        rise, fall = problem.slopes(signed)
        is_free = (rise == fall) & (signed != 0)
        if not 0 < np.count_nonzero(is_free) <= _LARGEST or not is_free.any(1).all():
            return False
        offset = np.where(signed > 0, problem.width, -problem.width)
        solved = _solved(problem, signed, is_free, offset)
        if solved is None:
            return False
        change = solved[0] - signed
        below = np.where((problem.width > 0) & (offset > 0), 0.0, problem.lower)
        above = np.where((problem.width > 0) & (offset < 0), 0.0, problem.upper)
        bound = np.where(change > 0, above, below)
        part = np.divide(bound - signed, change, out=np.full(signed.shape, np.inf), where=is_free & (change != 0))
        passed = np.sort(part[part < 1])
        length = passed[len(passed) // _FIXED] if passed.size else 1.0
        signed = np.where(is_free, signed + length * change, signed)
        signed = np.where(part <= min(length, passed.max(initial=0)), bound, signed)
        if not passed.size:
            break
    else:
        return False
    gradient = problem.gradient(signed)
    if problem.objective(signed, gradient) >= problem.objective(state.signed, state.gradient):
        return False
    state.signed, state.gradient = signed, gradient
    return True


def _solved(problem: Problem, signed: Floats, is_free: Bools, offset: Floats) -> tuple[Floats, Floats] | None:
    """Return variables and constants with vanishing derivatives by all free variables, or None without a solution."""
    m = problem.m
    component, sample = np.nonzero(is_free)
    matrix = _submatrix(problem.rows, problem, component, sample)
    rest = np.where(is_free, 0.0, signed)
    right = problem.targets - offset
    if rest.any():
        right = right - problem.rows.image(rest, problem.signs)
    groups = (component[:, None] == np.arange(m)).astype(float)
    right_sides = np.asfortranarray(np.column_stack([right[is_free], groups]))
    factor, info = scipy.linalg.lapack.dpotrf(matrix, lower=1, clean=0)
    ridge = _RIDGE * float(matrix.diagonal().max())
    if info or factor.diagonal().min() ** 2 < ridge:
        # The solution nearest to the present variables; the rest of the iterations reduce its error.
        matrix[np.diag_indices_from(matrix)] += ridge
        right_sides[:, 0] += ridge * signed[is_free]
        factor, info = scipy.linalg.lapack.dpotrf(matrix, lower=1, clean=0)
    if info:
        return None
    z, _ = scipy.linalg.lapack.dpotrs(factor, right_sides, lower=1)
    try:
        constant = np.linalg.solve(groups.T @ z[:, 1:], groups.T @ z[:, 0] + rest.sum(1))
    except np.linalg.LinAlgError:
        return None
    found = rest
    found[is_free] = z[:, 0] - z[:, 1:] @ constant
    return (found, constant) if np.isfinite(found).all() else None


def _submatrix(rows: GramRows, problem: Problem, component: NDArray[np.intp], sample: NDArray[np.intp]) -> Floats:
    """Return the Gram matrix of some variables, in Fortran order."""
    if rows.size == 1:
        return np.array(rows.square(sample)[:, 0].T, order="F")
    used, place = np.unique(sample, return_inverse=True)
    whole = expanded(rows.square(used), problem.m, problem.signs)
    at = component * len(used) + place
    return np.asfortranarray(whole[np.ix_(at, at)])
