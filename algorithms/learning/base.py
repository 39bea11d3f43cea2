"""The interface of layers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .algebra import Algebra, Array

Shape = tuple[Algebra, int]
"""The algebra and the number of channels of what a layer takes or returns."""


@dataclass(frozen=True)
class Layer:
    """A layer without parameters, for arrays (batch, channels, blades). The functions have no state."""

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        return algebra, channels

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        return []

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        raise NotImplementedError

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters, where y is the result."""
        raise NotImplementedError


def summed(gradient: Array) -> Array:
    """Sum over the batch."""
    return np.asarray(gradient.sum(axis=0))
