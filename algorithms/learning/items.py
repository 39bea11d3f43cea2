"""Layers of sets of items, whose channels follow one another: attention and messages; and compositions of layers.

The channels of an input are those of the first item, then those of the second, and so on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arguments import listed, whole_number
from .activations import Gate
from .algebra import Algebra, Array
from .base import Defined, Layer, Shape
from .equivariant import GradeLinear
from .recorded import Functions, Tensor


def _checked(layer: object, where: str) -> Defined:
    if not isinstance(layer, Defined):
        names = "GradeLinear, GradeProduct, Gate, Norm, Invariants, Dropout, Residual, Each, Attention or Messages"
        raise TypeError(f"{where}: {layer!r}; expected {names}")
    return layer


def _each(items: int, channels: int, where: Layer) -> int:
    """Return the number of channels of each item."""
    if items < 1 or channels % items:
        raise ValueError(f"{where}: {channels} channels; expected a multiple of items = {items}")
    return channels // items


@dataclass(frozen=True)
class Residual(Defined):
    """The input plus the result of layers, one after the other."""

    layers: tuple[Defined, ...]

    def __post_init__(self) -> None:
        layers = listed(self.layers, "Residual", "layers")
        object.__setattr__(self, "layers", tuple(_checked(layer, "Residual") for layer in layers))

    @property
    def arrays(self) -> int:
        """The number of arrays of parameters."""
        return sum(layer.arrays for layer in self.layers)

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        found = algebra, channels
        for layer in self.layers:
            found = layer.output(*found)
        if found != (algebra, channels):
            raise ValueError(f"{self}: {found[1]} channels of {found[0]}; expected {channels} of {algebra}")
        return found

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        found = []
        for layer in self.layers:
            found.extend(layer.initial(algebra, channels, random))
            algebra, channels = layer.output(algebra, channels)
        return found

    def definition(self, f: Functions, algebra: Algebra, x: Tensor, parameters: Sequence[Tensor]) -> Tensor:
        """Compute the result by functions of arrays."""
        y, start, shape = x, 0, (algebra, x.shape[1])
        for layer in self.layers:
            stop = start + layer.arrays
            y = layer.definition(f, shape[0], y, parameters[start:stop])
            start, shape = stop, layer.output(*shape)
        return x + y


@dataclass(frozen=True)
class Dropout(Defined):
    """In training, channels become zero with a probability, and the others are divided by 1 - rate.

    Trainings by L-BFGS leave out nothing.

    Parameters
    ----------
    rate : float
        The probability, below 1.
    seed : int
        Layers of a `Network` or of jax with the same seed leave out the same channels. Modules of torch draw from the
        generator of torch instead.
    """

    rate: float
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.rate < 1:
            raise ValueError(f"Dropout: rate {self.rate}; expected a probability below 1")
        whole_number(self.seed, "Dropout: seed")

    def definition(self, f: Functions, algebra: Algebra, x: Tensor, parameters: Sequence[Tensor]) -> Tensor:
        """Compute the result by functions of arrays."""
        return f.kept(x, self.rate, self.seed)


@dataclass(frozen=True)
class Each(Defined):
    """The same layer, with the same parameters, for the channels of each item."""

    items: int
    layer: Defined

    def __post_init__(self) -> None:
        _checked(self.layer, "Each")

    @property
    def arrays(self) -> int:
        """The number of arrays of parameters."""
        return self.layer.arrays

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        after, count = self.layer.output(algebra, _each(self.items, channels, self))
        return after, self.items * count

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        return self.layer.initial(algebra, channels // self.items, random)

    def definition(self, f: Functions, algebra: Algebra, x: Tensor, parameters: Sequence[Tensor]) -> Tensor:
        """Compute the result by functions of arrays."""
        n, channels, size = x.shape
        given = f.reshape(x, (n * self.items, channels // self.items, size))
        y = self.layer.definition(f, algebra, given, parameters)
        return f.reshape(y, (n, self.items * y.shape[1], y.shape[2]))


@dataclass(frozen=True)
class Attention(Defined):
    """Sums over all items, weighted by the exponentials of invariant inner products of queries and keys.

    Queries, keys, values and results are linear by grade. The inner product is that of the metric, divided by the root
    of the number of its terms; in degenerate algebras, blades with null vectors do not contribute. The layer commutes
    with permutations of the items.

    Parameters
    ----------
    items : int
    heads : int
        The channels of an item are divided into as many groups with weights of their own.
    """

    items: int
    heads: int = 1

    @property
    def arrays(self) -> int:
        """The number of arrays of parameters."""
        return 8

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        count = _each(self.items, channels, self)
        if self.heads < 1 or count % self.heads:
            raise ValueError(f"{self}: {count} channels of each item; expected a multiple of heads = {self.heads}")
        return algebra, channels

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        count = channels // self.items
        return [one for _ in range(4) for one in GradeLinear(count).initial(algebra, count, random)]

    def definition(self, f: Functions, algebra: Algebra, x: Tensor, parameters: Sequence[Tensor]) -> Tensor:
        """Compute the result by functions of arrays."""
        n, channels, size = x.shape
        count = channels // self.items
        linear, length = GradeLinear(count), count // self.heads * size
        given = f.reshape(x, (n * self.items, count, size))

        def heads(k: int, signs: bool = False) -> Tensor:
            y = linear.definition(f, algebra, given, parameters[2 * k : 2 * k + 2])
            y = f.linear(y, np.diag(algebra.metric)) if signs else y
            return f.swapped(f.reshape(y, (n, self.items, self.heads, length)), 1, 2)

        products = f.matmul(heads(0, signs=True), f.swapped(heads(1), 2, 3))
        found = f.swapped(f.matmul(f.softmax(products / np.sqrt(length).item()), heads(2)), 1, 2)
        y = linear.definition(f, algebra, f.reshape(found, (n * self.items, count, size)), parameters[6:])
        return f.reshape(y, x.shape)


@dataclass(frozen=True)
class Messages(Defined):
    """Messages between neighbours: gated products, with weights by grade, of sums of both, added for each item.

    Parameters
    ----------
    items : int
    neighbours : tuple of (int, int), optional
        Pairs of the item that gets a message and the item from which it comes. By default, each sample is an item, and
        modules of torch and functions of jax take the pairs with each call.
    """

    items: int = 1
    neighbours: tuple[tuple[int, int], ...] | None = None

    def __post_init__(self) -> None:
        if self.neighbours is None:
            if self.items != 1:
                raise ValueError(f"Messages: no neighbours of {self.items} items; expected pairs of numbers")
            return
        pairs = [listed(pair, "Messages", "pairs") for pair in listed(self.neighbours, "Messages", "pairs")]
        numbers = [whole_number(k, "Messages: neighbour") for pair in pairs for k in pair]
        if not pairs or any(len(pair) != 2 for pair in pairs) or max(numbers) >= self.items:
            raise ValueError(f"Messages: {self.neighbours}; expected at least one pair of numbers below {self.items}")
        object.__setattr__(self, "neighbours", tuple(zip(numbers[::2], numbers[1::2], strict=True)))

    @property
    def arrays(self) -> int:
        """The number of arrays of parameters."""
        return 15

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        _each(self.items, channels, self)
        return algebra, channels

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        count = channels // self.items
        linear = [one for _ in range(6) for one in GradeLinear(count).initial(algebra, count, random)]
        weights = random.normal(size=(count, len(algebra.paths))) / np.sqrt(algebra.n + 1)
        return [*linear, weights, *Gate().initial(algebra, count, random)]

    def definition(self, f: Functions, algebra: Algebra, x: Tensor, parameters: Sequence[Tensor]) -> Tensor:
        """Compute the result by functions of arrays."""
        samples, channels, size = x.shape
        if self.neighbours is not None:
            n, items, (first, second) = samples, self.items, np.array(self.neighbours).T
        elif f.neighbours is not None:
            n, items, (first, second) = 1, samples, f.neighbours
        else:
            raise ValueError(f"{self}: no neighbours; expected them in the layer, or in a call of a module of torch")
        count = channels // self.items
        given = f.reshape(x, (n * items, count, size))

        def linear(k: int, y: Tensor) -> Tensor:
            return GradeLinear(count).definition(f, algebra, y, parameters[2 * k : 2 * k + 2])

        def pairs(k: int) -> Tensor:
            own, other = (f.reshape(linear(j, given), (n, items, count * size)) for j in (k, k + 1))
            return f.reshape(f.rows(own, first) + f.rows(other, second), (n * len(first), count, size))

        products = f.weighted(algebra, pairs(0), pairs(2), parameters[12])
        messages = Gate().definition(f, algebra, products, parameters[13:])
        total = f.sum_rows(f.reshape(messages, (n, len(first), count * size)), first, items)
        y = linear(4, given) + linear(5, f.reshape(total, (n * items, count, size)))
        return f.reshape(y, x.shape)
