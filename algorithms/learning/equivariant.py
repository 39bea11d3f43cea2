"""Layers that commute with rotations and reflections: weights of grades, weighted products, norms, invariants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .algebra import Algebra, Array
from .base import Defined, Shape
from .recorded import Functions, Tensor


@dataclass(frozen=True)
class GradeLinear(Defined):
    """Sums with one real weight for each grade; the bias is a scalar."""

    channels: int

    @property
    def arrays(self) -> int:
        """The number of arrays of parameters."""
        return 2

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        return algebra, self.channels

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        w = random.normal(size=(self.channels, channels, algebra.n + 1)) / np.sqrt(channels)
        return [w, np.zeros(self.channels)]

    def definition(self, f: Functions, algebra: Algebra, x: Tensor, parameters: Sequence[Tensor]) -> Tensor:
        """Compute the result by functions of arrays."""
        w, bias = parameters
        return f.mixed(algebra, w, x) + f.linear(f.reshape(bias, (-1, 1)), np.eye(1, algebra.size))


@dataclass(frozen=True)
class GradeProduct(Defined):
    """Products of the channels with linear combinations of them, with a weight for each triple of grades."""

    @property
    def arrays(self) -> int:
        """The number of arrays of parameters."""
        return 3

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        weights = random.normal(size=(channels, len(algebra.paths))) / np.sqrt(algebra.n + 1)
        return [*GradeLinear(channels).initial(algebra, channels, random), weights]

    def definition(self, f: Functions, algebra: Algebra, x: Tensor, parameters: Sequence[Tensor]) -> Tensor:
        """Compute the result by functions of arrays."""
        other = GradeLinear(x.shape[1]).definition(f, algebra, x, parameters[:2])
        return f.weighted(algebra, x, other, parameters[2])


@dataclass(frozen=True)
class Norm(Defined):
    """The parts of each grade times a weight, divided by the fourth root of 1 + the mean of their squares squared.

    The mean is that over the channels. Squares are those of the metric, which may be negative; their mean square is
    not, and makes large parts of the size of 1. Parts without a norm, such as null vectors, are not changed.
    """

    @property
    def arrays(self) -> int:
        """The number of arrays of parameters."""
        return 1

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return parameters, which are 1."""
        return [np.ones((channels, algebra.n + 1))]

    def definition(self, f: Functions, algebra: Algebra, x: Tensor, parameters: Sequence[Tensor]) -> Tensor:
        """Compute the result by functions of arrays."""
        squares = f.squares(algebra, x)
        size = f.log1p(f.sum(squares * squares, 1) / x.shape[1])
        return x * f.by_blade(algebra, f.exp(-0.25 * size) * parameters[0])


@dataclass(frozen=True)
class Invariants(Defined):
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

    def definition(self, f: Functions, algebra: Algebra, x: Tensor, parameters: Sequence[Tensor]) -> Tensor:
        """Compute the result by functions of arrays."""
        count = x.shape[1] // self.pool
        squares = f.reshape(f.squares(algebra, x), (x.shape[0], count, self.pool, algebra.n + 1))
        groups = f.sum(squares, 2)
        numbers = f.log1p(groups) if algebra.is_definite else f.arcsinh(groups)
        return f.reshape(numbers, (x.shape[0], count * (algebra.n + 1), 1))
