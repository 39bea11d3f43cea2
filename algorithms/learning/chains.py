"""Linear layers with hyperbolic tangents between them, computed together in few passes over memory.

Between the products of matrices, which are those of `Spinors`, one pass computes a result, and one pass the
gradient with respect to it. Coefficients are converted into columns of matrices in the same passes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from generated import networks as kernels

from .activations import Split
from .algebra import Algebra, Array
from .base import Layer, Shape
from .linear import Linear
from .spinors import Spinors
from .workspace import multiplied, note, noted

Hidden = tuple[list[Array], list[Array]]
"""The columns of the input of each linear layer, and the values of the hyperbolic tangents."""


@dataclass(frozen=True)
class Chain(Layer):
    """Linear layers with ``Split("tanh")`` between them; the parameters are those of the layers, in order."""

    layers: tuple[Linear, ...]

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        return algebra, self.layers[-1].channels

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        found = []
        for layer in self.layers:
            found.extend(layer.initial(algebra, channels, random))
            channels = layer.channels
        return found

    def _own(self, parameters: Sequence[Array]) -> list[Sequence[Array]]:
        found, start = [], 0
        for layer in self.layers:
            stop = start + 1 + layer.bias
            found.append(parameters[start:stop])
            start = stop
        return found

    def _computed(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> tuple[Array, Hidden]:
        columns: list[Array] = []
        values: list[Array] = []
        spinors = Spinors.of(algebra, "left", x.dtype)
        last, product = len(self.layers) - 1, None
        for k, (layer, own) in enumerate(zip(self.layers, self._own(parameters), strict=True)):
            columns.append(spinors.rows(x, out=product))
            product = multiplied(columns[-1], spinors.weights(own[0]) / spinors.d)
            offset = own[1] if layer.bias else np.zeros((layer.channels, algebra.size), x.dtype)
            x = spinors.elements(product, layer.channels, offset)
            if k < last:
                np.tanh(x, out=x)
                values.append(x)
        return x, (columns, values)

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        y, hidden = self._computed(algebra, x, parameters)
        note(y, hidden)
        return y

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters."""
        gradients, cotangent = self._back(algebra, x, parameters, y, d)
        spinors, w = Spinors.of(algebra, "left", x.dtype), parameters[0]
        back = multiplied(cotangent, spinors.weights(w).conj().T / spinors.d)
        return spinors.elements(back, x.shape[1], np.zeros((x.shape[1], algebra.size), x.dtype)), gradients

    def pull_parameters(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> list[Array]:
        """Compute the gradients of ``d . y`` with respect to the parameters."""
        return self._back(algebra, x, parameters, y, d)[0]

    def _back(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[list[Array], Array]:
        """Return the gradients of the parameters, and the columns of that of the first layer's result."""
        columns, values = noted(y) or self._computed(algebra, x, parameters)[1]
        spinors, batch = Spinors.of(algebra, "left", x.dtype), len(x)
        cotangent = spinors.rows(d)
        gradients: list[Array] = []
        own = self._own(parameters)
        for k in reversed(range(len(self.layers))):
            layer, w = self.layers[k], own[k][0]
            found = [spinors.weights_pull(columns[k], cotangent, layer.channels)]
            if layer.bias:
                found.append(spinors.sums(cotangent, layer.channels))
            gradients[:0] = found
            if k:
                back = multiplied(cotangent, spinors.weights(w).conj().T / spinors.d)
                parts = spinors.parts(back, batch)
                kernels.tanh_columns_g3(*parts, values[k - 1], out=tuple(parts))  # type: ignore[call-overload]
                cotangent = back
        return gradients, cotangent


def joined(layers: Sequence[Layer], algebra: Algebra, channels: int) -> list[tuple[Layer, int]]:
    """Return the layers with chains in place of the layers that they contain, and the numbers of the latter."""
    found: list[tuple[Layer, int]] = []
    k = 0
    while k < len(layers):
        chain, inner, stop = [], channels, k
        while stop < len(layers):
            layer = layers[stop]
            if not isinstance(layer, Linear) or not layer.uses_columns(algebra, inner):
                break
            chain.append(layer)
            inner, stop = layer.channels, stop + 2
            if stop > len(layers) or layers[stop - 1] != Split("tanh"):
                break
        count = 2 * len(chain) - 1
        if len(chain) < 2:
            found.append((layers[k], 1))
            count = 1
        else:
            found.append((Chain(tuple(chain)), count))
        for layer in layers[k : k + count]:
            algebra, channels = layer.output(algebra, channels)
        k += count
    return found
