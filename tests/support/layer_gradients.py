"""Comparison of derivatives of layers with differences."""

from __future__ import annotations

import numpy as np

from algorithms.learning.algebra import Algebra
from algorithms.learning.base import Layer


def check_gradient(
    layer: Layer, algebra: Algebra, channels: int = 3, tolerance: float = 1e-10, h: float = 4e-3
) -> None:
    """Compare the derivative along a random direction with extrapolated differences of steps h."""
    random = np.random.default_rng(1)
    _, out = layer.output(algebra, channels)
    x = random.normal(size=(4, channels, algebra.size))
    parameters = [p + 0.1 * random.normal(size=p.shape) for p in layer.initial(algebra, channels, random)]
    y = layer.value(algebra, x, parameters)
    assert y.shape[1] == out
    d = random.normal(size=y.shape)
    dx, others = layer.pull(algebra, x, parameters, y, d)
    along = [random.normal(size=p.shape) for p in (x, *parameters)]
    expected = sum((a * b).sum() for a, b in zip([dx, *others], along, strict=True))

    def at(t: float) -> float:
        moved = [p + t * a for p, a in zip((x, *parameters), along, strict=True)]
        return float((d * layer.value(algebra, moved[0], moved[1:])).sum())

    # Differences of the tenth order.
    weights = 5 / 6, -5 / 21, 5 / 84, -5 / 504, 1 / 1260
    found = sum(w * (at(k * h) - at(-k * h)) for k, w in enumerate(weights, 1)) / h
    scale = sum(np.abs(a * b).sum() for a, b in zip([dx, *others], along, strict=True))
    assert abs(found - expected) <= tolerance * max(scale, 1)
