"""Layers that commute with rotations and reflections: weights of grades, weighted products, invariants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .algebra import Algebra, Array
from .base import Layer, Shape, summed


@dataclass(frozen=True)
class GradeLinear(Layer):
    """Sums with one real weight for each grade; the bias is a scalar."""

    channels: int

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        return algebra, self.channels

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        w = random.normal(size=(self.channels, channels, algebra.n + 1)) / np.sqrt(channels)
        return [w, np.zeros(self.channels)]

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        w, bias = parameters
        y = np.empty((len(x), self.channels, algebra.size), x.dtype)
        for k in range(algebra.n + 1):
            y[..., algebra.grades == k] = w[..., k] @ x[..., algebra.grades == k]
        y[..., 0] += bias
        return y

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters."""
        w, _ = parameters
        dx, dw = np.empty_like(x), np.empty_like(w)
        for k in range(algebra.n + 1):
            own = algebra.grades == k
            dx[..., own] = w[..., k].T @ d[..., own]
            dw[..., k] = np.tensordot(d[..., own], x[..., own], ((0, 2), (0, 2)))
        return dx, [dw, summed(d[..., 0])]


@dataclass(frozen=True)
class GradeProduct(Layer):
    """Products of the channels with linear combinations of them, with a weight for each triple of grades."""

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        weights = random.normal(size=(channels, len(algebra.paths))) / np.sqrt(algebra.n + 1)
        return [*GradeLinear(channels).initial(algebra, channels, random), weights]

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        other = GradeLinear(x.shape[1]).value(algebra, x, parameters[:2])
        return algebra.weighted(x, other, parameters[2])

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters."""
        linear = GradeLinear(x.shape[1])
        other = linear.value(algebra, x, parameters[:2])
        dx, by_other, weights = algebra.weighted_pull(x, other, parameters[2], d)
        rest, gradients = linear.pull(algebra, x, parameters[:2], other, by_other)
        return dx + rest, [*gradients, summed(weights)]


@dataclass(frozen=True)
class Invariants(Layer):
    """The logarithms of 1 + the squared norms of all grades, as real channels.

    They are invariant under the rotations of any algebra: the square of the norm is that of the metric. Where squares
    can be negative, their inverse hyperbolic sines take the place of the logarithms.

    Parameters
    ----------
    pool : int
        The number of neighbouring channels whose squares are added.
    """

    pool: int = 1

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        if self.pool < 1 or channels % self.pool:
            raise ValueError(f"Invariants: {channels} channels; expected a multiple of pool = {self.pool}")
        return Algebra(0), channels // self.pool * (algebra.n + 1)

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        groups = algebra.square_norms(x).reshape(len(x), x.shape[1] // self.pool, self.pool, algebra.n + 1).sum(2)
        numbers = np.log1p(groups) if algebra.is_definite else np.arcsinh(groups)
        return np.asarray(numbers.reshape(len(x), groups.shape[1] * groups.shape[2], 1))

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters."""
        slope = (d * (np.exp(-y) if algebra.is_definite else 1 / np.cosh(y))).reshape(
            len(x), x.shape[1] // self.pool, algebra.n + 1
        )
        return 2 * x * algebra.metric.astype(x.dtype) * np.repeat(slope, self.pool, axis=1)[..., algebra.grades], []
