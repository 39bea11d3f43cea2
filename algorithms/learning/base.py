"""The interface of layers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .algebra import Algebra, Array
from .recorded import Functions, Tensor, computed, pulled

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

    def pull_parameters(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> list[Array]:
        """Compute the gradients of ``d . y`` with respect to the parameters only, which the first layer needs."""
        return self.pull(algebra, x, parameters, y, d)[1]

    def symmetry(self, algebra: str | Algebra) -> str:
        """Return the group of linear maps of vectors with which the layer commutes.

        Raises
        ------
        ValueError
            If it does not commute with all maps that keep the squares of vectors of the algebra.
        """
        found = f"does not commute with the rotations of {Algebra.of(algebra)}"
        raise ValueError(f"{self}: {found}; expected an equivariant layer")


@dataclass(frozen=True)
class Defined(Layer):
    """A layer that is defined once, for arrays of numpy, torch and jax, and commutes with all orthogonal maps.

    Maps of vectors that keep the quadratic form of the algebra act on all blades; the layer commutes with these. In
    G(3,0,1), motions and reflections of space are among them, in G(1,3) boosts, and in G(4,1) conformal maps.
    """

    @property
    def arrays(self) -> int:
        """The number of arrays of parameters."""
        return 0

    def definition(self, f: Functions, algebra: Algebra, x: Tensor, parameters: Sequence[Tensor]) -> Tensor:
        """Compute the result by functions of arrays."""
        raise NotImplementedError

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        return computed(self, algebra, x, parameters)[-1].value

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters."""
        dx, *others = pulled(self, algebra, x, parameters, y, d)
        return dx, others

    def symmetry(self, algebra: str | Algebra) -> str:
        """Return the group of linear maps of vectors with which the layer commutes."""
        return "O({},{},{})".format(*Algebra.of(algebra).signature)


def summed(gradient: Array) -> Array:
    """Sum over the batch."""
    return np.asarray(gradient.sum(axis=0))
