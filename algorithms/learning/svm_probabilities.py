"""Probabilities of classes from the decision values of support vector machines, by Platt's method.

The decision values of a machine for its own training samples are larger than for others. Thus the sigmoid is fitted to
values of samples on which the machine was not trained, by cross-validation.

References
----------
J. Platt, "Probabilistic outputs for support vector machines and comparisons to regularized likelihood methods",
Advances in Large Margin Classifiers, MIT Press 2000, 61-74.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from .svm_kernels import Floats

FOLDS = 5
"""A limit on work: the number of parts for cross-validation, as in libsvm."""
_ITERATIONS = 100
"""A limit on work: Newton steps for two parameters of a convex function. They end earlier without a decrease, on four
random sets after 9 to 18 steps, and no test depends on the number."""
_HALVINGS = 60
"""Floating point: 2**-60 of a step is less than the rounding errors of sums, which have 53 bits."""


def folds_of(number: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the number of a fold for each sample, so that all classes are in all folds.

    Parameters
    ----------
    number : array of int, (n,)
        The classes, each with at least two samples.
    """
    count = np.bincount(number)
    random, found = np.random.default_rng(0), np.zeros(len(number), np.intp)
    for c in range(len(count)):
        own = np.flatnonzero(number == c)
        found[random.permutation(own)] = np.arange(len(own)) % min(FOLDS, count.min())
    return found


def fitted_sigmoid(values: Floats, is_positive: NDArray[np.bool_], weights: Floats) -> tuple[float, float]:
    """Fit ``1 / (1 + exp(-(a f + b)))`` to labels by maximum likelihood, with the targets of Platt.

    The targets are those of a uniform prior for the frequency of errors, so that they are neither 0 nor 1. A sample
    with the weight 2 counts as two samples.

    Returns
    -------
    a, b : float
    """
    positive, negative = float(weights[is_positive].sum()), float(weights[~is_positive].sum())
    target = np.where(is_positive, (positive + 1) / (positive + 2), 1 / (negative + 2))
    scale = float(np.abs(values).max()) or 1.0
    x = np.column_stack([values / scale, np.ones(len(values))])
    found = np.array([0.0, np.log((positive + 1) / (negative + 1))])

    def loss(w: Floats) -> float:
        z = x @ w
        return float((weights * (np.logaddexp(0, z) - target * z)).sum())

    now = loss(found)
    for _ in range(_ITERATIONS):
        p = scipy.special.expit(x @ found)
        gradient, weight = x.T @ (weights * (p - target)), weights * p * (1 - p)
        hessian = (x * weight[:, None]).T @ x + np.finfo(float).eps * (positive + negative) * np.eye(2)
        step = np.linalg.solve(hessian, gradient)
        for halving in range(_HALVINGS):
            trial = found - step * 0.5**halving
            after = loss(trial)
            if after < now:
                break
        else:
            break
        found, now = trial, after
    return float(found[0] / scale), float(found[1])


def probabilities(scores: Floats, sigmoids: Floats) -> Floats:
    """Return the probabilities (n, K) of classes from scores (n,) for two classes, or (n, K).

    The probabilities of more than two classes are those of each class against the others, divided by their sum.
    """
    found = scipy.special.expit(sigmoids[:, 0] * scores.reshape(len(scores), -1) + sigmoids[:, 1])
    if found.shape[1] == 1:
        return np.column_stack([1 - found[:, 0], found[:, 0]])
    total = found.sum(1, keepdims=True)
    return np.asarray(np.where(total > 0, found, 1) / np.where(total > 0, total, found.shape[1]))
