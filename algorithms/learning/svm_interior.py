"""Interior-point iterations for dual problems of linear machines with few features.

The Gram matrix of n samples with d features is ``X X'``. Each Newton step solves equations of d + 1 unknowns, and few
steps are needed, however badly the features are scaled. The result is the start of steps of pairs.

References
----------
M. C. Ferris, T. S. Munson, "Interior-point methods for massive support vector machines", SIAM Journal on Optimization
13 (2002), 783-804.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from .svm_kernels import Floats

_ITERATIONS = 100
"""A limit on work, chosen by trial. Most of nine problems needed 10 to 40 iterations, and 1,000 instead of 100 led to
the same violations, those of rounding errors. No test depends on the number."""
_BACK = 0.995
"""A limit on work, chosen by trial: the share of the way to the nearest bound that a step goes. Any share below 1 keeps
the variables inside. On nine problems, 0.98 and 0.999 needed nearly as many iterations. No test depends on it."""
_START = 0.01
"""A limit on work, chosen by trial: the least distance of the first variables from their bounds, relative to the span.
Any start inside the bounds will do, but one near a bound takes short steps. No test depends on it."""


def interior_point(
    features: Floats, target: Floats, lower: Floats, upper: Floats, width: float, tolerance: float
) -> Floats:
    """Minimise ``|X'b|^2 / 2 - t'b + width |b|`` with the bounds, for variables with the sum 0.

    Parameters
    ----------
    features : array, (n, d)
    target, lower, upper : array, (n,)
    width : float
        Variables are split into their positive and negative parts if it is not 0.
    tolerance : float
        Of the conditions of optimality. The iterations end earlier if rounding errors prevent progress.

    Returns
    -------
    array, (n,)
    """
    if not width:
        return _minimised(features, -target, lower, upper, tolerance)
    linear = np.concatenate([width - target, -width - target])
    zero = np.zeros(len(target))
    low, high = np.concatenate([zero, lower]), np.concatenate([upper, zero])
    return np.asarray(_minimised(np.vstack([features] * 2), linear, low, high, tolerance).reshape(2, -1).sum(0))


def _minimised(features: Floats, linear: Floats, low: Floats, high: Floats, tolerance: float) -> Floats:
    """Minimise ``|X'b|^2 / 2 + linear'b`` for ``low <= b <= high`` and ``sum(b) = 0``."""
    is_open = high > low
    x = np.column_stack([features[is_open], np.ones(np.count_nonzero(is_open))])
    span, total = (high - low)[is_open], -float(low.sum())
    # The variables v = b - low have the multipliers z and w of their bounds 0 and span; u is that of the sum.
    slope = linear[is_open] + x[:, :-1] @ (features.T @ low)
    v = span * np.clip(total / span.sum(), _START, 1 - _START)
    scale = max(float(np.abs(slope).max()), tolerance)
    z, w, u, best = np.full(len(v), scale), np.full(len(v), scale), 0.0, np.inf
    found = v
    for _ in range(_ITERATIONS):
        rest = span - v
        dual = slope + x[:, :-1] @ (x[:, :-1].T @ v) + u - z + w
        inside = np.where(v * scale < z * span, 0.0, np.where(rest * scale < w * span, span, v))
        free = (inside > 0) & (inside < span)
        error = max(float(np.abs(dual).max()), float(np.maximum(z, w)[free].max(initial=0)))
        if not error < np.inf:
            break
        if error < best:
            best, found = error, inside
        # A derivative by a free variable is `dual` plus a multiplier, at most twice the error, and the violation is the
        # difference of two. The other half of the tolerance is for the move of variables to their bounds.
        if error <= tolerance / 8:
            break
        solve = _newton(x, v, rest, z, w, dual, total - float(v.sum()))
        mean = float(v @ z + rest @ w) / (2 * len(v))
        if solve is None or not mean > 0:
            break
        # Mehrotra's predictor and corrector.
        dv, _, dz, dw = solve(-v * z, -rest * w)
        part = _length((v, dv), (rest, -dv), (z, dz), (w, dw))
        after = float((v + part * dv) @ (z + part * dz) + (rest - part * dv) @ (w + part * dw)) / (2 * len(v))
        centre = mean * (after / mean) ** 3
        dv, du, dz, dw = solve(centre - v * z - dv * dz, centre - rest * w + dv * dw)
        part = _BACK * _length((v, dv), (rest, -dv), (z, dz), (w, dw))
        v, u, z, w = v + part * dv, u + part * du, z + part * dz, w + part * dw
        if not (v.min() > 0 and (span - v).min() > 0):
            break
    result = low.copy()
    result[is_open] += _with_sum(found, span, total)
    return result


def _newton(
    x: Floats, v: Floats, rest: Floats, z: Floats, w: Floats, dual: Floats, primal: float
) -> Callable[[Floats, Floats], tuple[Floats, float, Floats, Floats]] | None:
    """Return a function of the wanted products with multipliers that solves the Newton equations, or None."""
    inverse = 1 / (z / v + w / rest)
    weighted = x * np.sqrt(inverse)[:, None]
    matrix = weighted.T @ weighted
    matrix[np.diag_indices(len(matrix) - 1)] += 1
    size = 1 / np.sqrt(matrix.diagonal())
    factor, info = scipy.linalg.lapack.dpotrf(matrix * size * size[:, None], lower=1)
    if info:
        return None

    def solve(to_v: Floats, to_rest: Floats) -> tuple[Floats, float, Floats, Floats]:
        right = -dual + to_v / v - to_rest / rest
        sides = x.T @ (inverse * right)
        sides[-1] -= primal
        step = size * scipy.linalg.lapack.dpotrs(factor, size * sides, lower=1)[0]
        dv = inverse * (right - x @ step)
        return dv, float(step[-1]), (to_v - z * dv) / v, (to_rest + w * dv) / rest

    return solve


def _length(*pairs: tuple[Floats, Floats]) -> float:
    """Return the greatest part of a step, at most 1, for which no number becomes negative."""
    parts = [float((-number[step < 0] / step[step < 0]).min(initial=1)) for number, step in pairs]
    return min(parts)


def _with_sum(v: Floats, span: Floats, total: float) -> Floats:
    """Return variables whose sum is right, by small changes of those that are between their bounds, if possible."""
    missing = total - float(v.sum())
    room = span - v if missing > 0 else v
    inside = np.where((v > 0) & (v < span), room, 0)
    room = inside if inside.sum() >= abs(missing) else room
    return np.asarray(np.clip(v + missing * room / room.sum(), 0, span)) if missing else v
