"""Steps of training: stochastic gradients with momentum, Rprop and Adam, and schedules of their rates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..arguments import finite_number, positive_number
from .algebra import Array

Schedule = Callable[[int], float]
"""The factor of the rate in an epoch."""


def cosine(epochs: int, last: float = 0.0) -> Schedule:
    """Return a schedule that decreases from 1 to `last` like half a period of the cosine."""
    positive_number(epochs, "epochs")
    finite_number(last, "last")
    return lambda epoch: last + (1 - last) * 0.5 * (1 + float(np.cos(np.pi * min(epoch, epochs) / epochs)))


def halving(every: int) -> Schedule:
    """Return a schedule that halves the rate after every so many epochs."""
    positive_number(every, "every")
    return lambda epoch: 0.5 ** (epoch // every)


@dataclass
class Sgd:
    """Gradient steps with momentum."""

    rate: float = 0.01
    momentum: float = 0.9
    _speed: Array | None = field(default=None, repr=False)

    def step(self, parameters: Array, gradient: Array, factor: float) -> None:
        """Change the parameters in place."""
        if self._speed is None:
            self._speed = np.zeros_like(parameters)
        self._speed *= self.momentum
        self._speed -= factor * self.rate * gradient
        parameters += self._speed


@dataclass
class Adam:
    """Steps scaled by running means of gradients and of their squares (Kingma and Ba)."""

    rate: float = 0.005
    decays: tuple[float, float] = (0.9, 0.999)
    small: float = 1e-8
    _means: list[Array] = field(default_factory=list, repr=False)
    _count: int = field(default=0, repr=False)

    def step(self, parameters: Array, gradient: Array, factor: float) -> None:
        """Change the parameters in place."""
        if not self._means:
            self._means = [np.zeros_like(parameters), np.zeros_like(parameters)]
        self._count += 1
        scaled = []
        for mean, decay, value in zip(self._means, self.decays, (gradient, gradient * gradient), strict=True):
            mean *= decay
            mean += (1 - decay) * value
            scaled.append(mean / (1 - decay**self._count))
        parameters -= factor * self.rate * scaled[0] / (np.sqrt(scaled[1]) + self.small)


@dataclass
class Rprop:
    """Steps by the signs of gradients; each parameter has its own size of step. For full batches."""

    first: float = 0.01
    growth: float = 1.2
    decrease: float = 0.5
    bounds: tuple[float, float] = (1e-8, 1.0)
    _previous: Array | None = field(default=None, repr=False)
    _sizes: Array | None = field(default=None, repr=False)

    def step(self, parameters: Array, gradient: Array, factor: float) -> None:
        """Change the parameters in place."""
        if self._previous is None or self._sizes is None:
            self._previous, self._sizes = np.zeros_like(gradient), np.full_like(gradient, self.first)
        agreement = self._previous * gradient
        scale = np.where(agreement > 0, self.growth, np.where(agreement < 0, self.decrease, 1.0))
        self._sizes = np.clip(self._sizes * scale, *self.bounds).astype(parameters.dtype)
        used = np.where(agreement < 0, 0, gradient)
        parameters -= factor * np.sign(used) * self._sizes
        self._previous = used


Optimizer = Sgd | Adam | Rprop
