"""Losses of networks and their gradients."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .algebra import Array


def squares(y: Array, target: Array) -> tuple[float, Array]:
    """Return the mean over the samples of half the squared error, and its gradient."""
    error = y - target
    return float(np.vdot(error, error)) / (2 * len(y)), error / y.dtype.type(len(y))


def entropy(y: Array, labels: Array) -> tuple[float, Array]:
    """Return the mean cross entropy of the scalar parts, and its gradient."""
    logits = y[..., 0] - y[..., 0].max(axis=1, keepdims=True)
    rows, weights = np.arange(len(y)), np.exp(logits)
    total = weights.sum(axis=1, keepdims=True)
    loss = float(np.mean(np.log(total[:, 0]) - logits[rows, labels]))
    d = np.zeros_like(y)
    d[..., 0] = weights / total
    d[rows, labels, 0] -= 1
    return loss, d / y.dtype.type(len(y))


LOSSES: dict[str, Callable[[Array, Array], tuple[float, Array]]] = {"squares": squares, "entropy": entropy}
