"""Activations: by component, bounded by the norm, gated by grade, and as power series of multivectors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from generated import networks as kernels

from .algebra import Algebra, Array
from .base import Defined, Layer
from .recorded import Functions, Tensor
from .workspace import empty


@dataclass(frozen=True)
class Split(Layer):
    """A real function of every coefficient: "tanh", "sigmoid", "relu", "silu" (x times its sigmoid) or "identity"."""

    function: str = "tanh"

    def __post_init__(self) -> None:
        if self.function not in ("tanh", "sigmoid", "relu", "silu", "identity"):
            raise ValueError(f"Split: {self.function!r}; expected 'tanh', 'sigmoid', 'relu', 'silu' or 'identity'")

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        match self.function:
            case "tanh":
                return np.tanh(x, out=empty(x.shape, x.dtype))
            case "sigmoid":
                return np.asarray(0.5 + 0.5 * np.tanh(0.5 * x))
            case "relu":
                return np.maximum(x, 0)
            case "silu":
                return np.asarray(kernels.silu(x, out=empty(x.shape, x.dtype)))
        return x

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters."""
        match self.function:
            case "tanh":
                return np.asarray(kernels.tanh_pull(y, d, out=empty(y.shape, y.dtype))), []
            case "sigmoid":
                return d * y * (1 - y), []
            case "relu":
                return d * (x > 0), []
            case "silu":
                return np.asarray(kernels.silu_pull(x, d, out=empty(x.shape, x.dtype))), []
        return d, []


@dataclass(frozen=True)
class Bounded(Layer):
    """``x / (slope + |x| / bound)`` of Georgiou and Koutsougeras, with the norm of the coefficients."""

    slope: float = 1.0
    bound: float = 1.0

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        return np.asarray(kernels.bounded(x, x.dtype.type(self.slope), x.dtype.type(self.bound)))

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters."""
        one = x.dtype.type
        return np.asarray(kernels.bounded_vjp_x(x, one(self.slope), one(self.bound), d)[1]), []

    def symmetry(self, algebra: str | Algebra) -> str:
        """Return the group of linear maps of vectors with which the layer commutes.

        Raises
        ------
        ValueError
            If squares of vectors have different signs: then these maps do not keep the norm of the coefficients.
        """
        own = Algebra.of(algebra)
        return f"O({own.n})" if own.is_definite else super().symmetry(own)


@dataclass(frozen=True)
class Gate(Defined):
    """The part of each grade times the logistic function of ``slope |part|**2 + offset``, an equivariant activation.

    The square of the norm is that of the metric, which all rotations of the algebra preserve.
    """

    @property
    def arrays(self) -> int:
        """The number of arrays of parameters."""
        return 2

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        return [np.ones((channels, algebra.n + 1)), np.zeros((channels, algebra.n + 1))]

    def definition(self, f: Functions, algebra: Algebra, x: Tensor, parameters: Sequence[Tensor]) -> Tensor:
        """Compute the result by functions of arrays."""
        slope, offset = parameters
        return x * f.by_blade(algebra, f.logistic(f.squares(algebra, x) * slope + offset))


@dataclass(frozen=True)
class Series(Layer):
    """The hyperbolic tangent as a power series of the multivector, to the fifth order, after `Bounded`."""

    def _inner(self, algebra: Algebra, x: Array) -> tuple[Array, Array, Array]:
        t = Bounded().value(algebra, x, ())
        square = algebra.product(t, t)
        factor = 2 / 15 * algebra.product(square, square) - square / 3
        factor[..., 0] += 1
        return t, square, factor.astype(x.dtype, copy=False)

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        t, _, factor = self._inner(algebra, x)
        return algebra.product(t, factor)

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters."""
        t, square, factor = self._inner(algebra, x)
        dt, df = algebra.product_pull(t, factor, d)
        by_square = sum(algebra.product_pull(square, square, 2 / 15 * df)) - df / 3
        dt = dt + sum(algebra.product_pull(t, t, np.asarray(by_square, x.dtype)))
        return Bounded().pull(algebra, x, (), y, dt.astype(x.dtype, copy=False))
