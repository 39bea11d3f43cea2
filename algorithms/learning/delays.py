"""Layers of time-delay networks: weights that all times share, and the mean over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .algebra import Algebra, Array
from .base import Layer, Shape
from .linear import Linear


@dataclass(frozen=True)
class Delays(Layer):
    """A linear layer of each `span` successive times, with the same weights at all times.

    The channels of the input are `times` times those of one time, with the channels of the first time first; those of
    the result are ``(times - span + 1) * count``.
    """

    count: int
    times: int
    span: int = 3

    def __post_init__(self) -> None:
        if self.count < 1 or not 1 <= self.span <= self.times:
            raise ValueError(f"Delays: {self}; expected a positive count, and a span from 1 to the number of times")

    def _features(self, channels: int) -> int:
        if channels % self.times:
            raise ValueError(f"Delays: {channels} channels; expected a multiple of {self.times} times")
        return channels // self.times

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        self._features(channels)
        return algebra, (self.times - self.span + 1) * self.count

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        return Linear(self.count).initial(algebra, self.span * self._features(channels), random)

    def _windows(self, x: Array) -> Array:
        """Return the channels of all windows, (batch * windows, span * features, blades)."""
        batch, channels, blades = x.shape
        rows = x.reshape(batch, self.times, -1, blades)
        places = np.arange(self.times - self.span + 1)[:, None] + np.arange(self.span)
        return rows[:, places].reshape(batch * len(places), self.span * (channels // self.times), blades)

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        found = Linear(self.count).value(algebra, self._windows(x), parameters)
        return found.reshape(len(x), -1, x.shape[2])

    def _pull_windows(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        flat = (-1, self.count, x.shape[2])
        return Linear(self.count).pull(algebra, self._windows(x), parameters, y.reshape(flat), d.reshape(flat))

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters."""
        of_windows, own = self._pull_windows(algebra, x, parameters, y, d)
        batch, channels, blades = x.shape
        parts = of_windows.reshape(batch, -1, self.span, channels // self.times, blades)
        dx = np.zeros((batch, self.times, channels // self.times, blades), x.dtype)
        for k in range(self.span):
            dx[:, k : k + parts.shape[1]] += parts[:, :, k]
        return dx.reshape(x.shape), own


@dataclass(frozen=True)
class MeanOverTime(Layer):
    """The mean of the channels of all times."""

    times: int

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        if self.times < 1 or channels % self.times:
            raise ValueError(f"MeanOverTime: {channels} channels; expected a multiple of {self.times} times")
        return algebra, channels // self.times

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        return np.asarray(x.reshape(len(x), self.times, -1, x.shape[2]).mean(1))

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters."""
        return np.tile(d / x.dtype.type(self.times), (1, self.times, 1)), []
