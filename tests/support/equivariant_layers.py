"""Equivariant layers for tests of arrays, torch and jax, and products of reflections."""

from __future__ import annotations

import numpy as np

from algorithms.learning import (
    Algebra,
    Attention,
    Each,
    Gate,
    GradeLinear,
    GradeProduct,
    Layer,
    Messages,
    Norm,
    Residual,
)
from algorithms.learning.linear import left_matrix, right_matrix

RING = tuple((k, (k + step) % 3) for k in range(3) for step in (1, 2))
LAYERS = [
    GradeLinear(2), GradeProduct(), Gate(), Norm(), Residual((GradeProduct(), Gate())), Each(3, GradeProduct()),
    Attention(3), Attention(3, heads=2), Messages(3, RING),
]  # fmt: skip


def reflections(algebra: Algebra, count: int, seed: int) -> np.ndarray:
    """The matrix of ``x -> v x / v`` for a product v of vectors that are not null."""
    random, found = np.random.default_rng(seed), np.eye(algebra.size)
    squares = np.diagonal(algebra.signs)[1 : algebra.n + 1]
    for _ in range(count):
        v, length = np.zeros(algebra.n), 0.0
        while abs(length) < 0.5 * v @ v or not v.any():  # far from null vectors, where boosts are large
            v = random.normal(size=algebra.n)
            length = v * v @ squares
        w = np.zeros(algebra.size)
        w[1 : algebra.n + 1] = v
        found = left_matrix(algebra, w) @ right_matrix(algebra, w / length) @ found
    return found


def given(layer: Layer, algebra: Algebra) -> tuple[np.ndarray, list[np.ndarray]]:
    random = np.random.default_rng(1)
    parameters = [p + 0.1 * random.normal(size=p.shape) for p in layer.initial(algebra, 6, random)]
    return random.normal(size=(4, 6, algebra.size)), parameters
