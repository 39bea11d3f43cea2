"""The functions in which layers are defined, on arrays of numpy, with records from which gradients are computed.

A layer is defined once, by `Defined.definition`, in terms of `Functions` and of sums, differences, products and
quotients that broadcast. For networks, the functions are those of `Record`. `frameworks` has them for torch and jax.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Protocol

import numpy as np

from .algebra import Algebra, Array
from .workspace import note, noted

Pull = Callable[[Array], Array]
"""The gradient with respect to an argument, as a function of that with respect to the result."""

_draw: ContextVar[int | None] = ContextVar("draw", default=None)


@contextmanager
def drawn(number: int) -> Iterator[None]:
    """Let `Record` leave out channels, which it does in training only. Equal numbers give equal choices."""
    token = _draw.set(number)
    try:
        yield
    finally:
        _draw.reset(token)


class Tensor(Protocol):
    """An array of numpy in a record, a tensor of torch, or an array of jax."""

    @property
    def shape(self) -> tuple[int, ...]:
        """The numbers of entries along the axes."""

    def __add__(self, other: Any, /) -> Tensor: ...
    def __radd__(self, other: Any, /) -> Tensor: ...
    def __mul__(self, other: Any, /) -> Tensor: ...
    def __rmul__(self, other: Any, /) -> Tensor: ...
    def __truediv__(self, other: float, /) -> Tensor: ...


class Functions(ABC):
    """What definitions of layers are made of, beside the arithmetic of arrays.

    Attributes
    ----------
    neighbours : array or None
        (2, pairs) The neighbours that were passed with a call: places that get messages, and those that send them.
    """

    neighbours: Any = None

    @abstractmethod
    def exp(self, x: Any) -> Tensor:
        """Return exponentials."""

    @abstractmethod
    def log1p(self, x: Any) -> Tensor:
        """Return the logarithms of 1 + x."""

    @abstractmethod
    def arcsinh(self, x: Any) -> Tensor:
        """Return inverse hyperbolic sines."""

    @abstractmethod
    def tanh(self, x: Any) -> Tensor:
        """Return hyperbolic tangents."""

    @abstractmethod
    def softmax(self, x: Any) -> Tensor:
        """Return exponentials divided by their sum over the last axis."""

    @abstractmethod
    def sum(self, x: Any, axis: int) -> Tensor:
        """Return sums over an axis, whose length becomes 1."""

    @abstractmethod
    def reshape(self, x: Any, shape: Sequence[int]) -> Tensor:
        """Return the numbers in another shape."""

    @abstractmethod
    def swapped(self, x: Any, a: int, b: int) -> Tensor:
        """Return x with two axes exchanged."""

    @abstractmethod
    def matmul(self, a: Any, b: Any) -> Tensor:
        """Return matrix products over the last two axes; other axes are the same."""

    @abstractmethod
    def linear(self, x: Any, matrix: Array) -> Tensor:
        """Return ``x @ matrix`` for a constant matrix."""

    @abstractmethod
    def rows(self, x: Any, index: Array) -> Tensor:
        """Return the entries of the second axis at places."""

    @abstractmethod
    def sum_rows(self, x: Any, index: Array, count: int) -> Tensor:
        """Return `count` entries of the second axis: sums of those of x with equal places."""

    @abstractmethod
    def mixed(self, algebra: Algebra, w: Any, x: Any) -> Tensor:
        """Return sums over the channels of x (n, channels, blades) with weights w (results, channels, grades)."""

    @abstractmethod
    def weighted(self, algebra: Algebra, a: Any, b: Any, w: Any) -> Tensor:
        """Return products of a and b (n, channels, blades), with weights (channels, paths) of their parts."""

    @abstractmethod
    def kept(self, x: Any, rate: float, seed: int) -> Tensor:
        """Return x with a part of the channels set to zero in training, and the others divided by what is kept."""

    def logistic(self, x: Any) -> Tensor:
        """Return the logistic function, in a form that does not overflow."""
        return 0.5 + 0.5 * self.tanh(0.5 * x)

    def squares(self, algebra: Algebra, x: Any) -> Tensor:
        """Return the squared norms of the parts of each grade, by the metric."""
        return self.linear(x * x, algebra.metric[:, None] * algebra.by_grade)

    def by_blade(self, algebra: Algebra, x: Any) -> Tensor:
        """Return a number for each blade from one for each grade."""
        return self.linear(x, algebra.by_grade.T)


class Recorded:
    """A value with the record that it belongs to."""

    __array_ufunc__ = None  # Arrays of numpy leave their operators to this class.

    def __init__(self, record: Record, value: Array) -> None:
        self.record, self.value = record, value

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the value."""
        return self.value.shape

    def __add__(self, other: Any) -> Recorded:
        value, shape, d = _value(other), self.shape, np.shape(_value(other))
        return self.record.note(self.value + value, (self, lambda g: _to(g, shape)), (other, lambda g: _to(g, d)))

    __radd__ = __add__

    def __neg__(self) -> Recorded:
        return self.record.note(-self.value, (self, np.negative))

    def __sub__(self, other: Any) -> Recorded:
        return self.__add__(-other)

    def __rsub__(self, other: Any) -> Recorded:
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> Recorded:
        a, b = self.value, _value(other)
        return self.record.note(
            a * b, (self, lambda d: _to(d * b, a.shape)), (other, lambda d: _to(d * a, np.shape(b)))
        )

    __rmul__ = __mul__

    def __truediv__(self, other: float) -> Recorded:
        return self.__mul__(1 / other)


def _value(x: Any) -> Any:
    return x.value if isinstance(x, Recorded) else x


def _to(gradient: Array, shape: tuple[int, ...]) -> Array:
    """Return a gradient summed over the axes along which its variable was broadcast."""
    gradient = gradient.sum(tuple(range(gradient.ndim - len(shape))))
    stretched = tuple(k for k, size in enumerate(shape) if size == 1 and gradient.shape[k] != 1)
    return np.asarray(gradient.sum(stretched, keepdims=True) if stretched else gradient)


class Record(Functions):
    """Functions of arrays of numpy that keep what gradients need, in the order of their computation."""

    def __init__(self) -> None:
        self._steps: list[tuple[Recorded, list[tuple[Recorded, Pull]]]] = []

    def start(self, value: Array) -> Recorded:
        """Return a variable."""
        return Recorded(self, value)

    def note(self, value: Any, *sources: tuple[Any, Pull]) -> Recorded:
        """Return a value that was computed from others."""
        found = Recorded(self, np.asarray(value))
        self._steps.append((found, [(x, pull) for x, pull in sources if isinstance(x, Recorded)]))
        return found

    def gradients(self, y: Recorded, d: Array, variables: Sequence[Recorded]) -> list[Array]:
        """Return the gradients of ``d . y`` with respect to variables."""
        found: dict[int, Array] = {id(y): d}
        for value, sources in reversed(self._steps):
            own = found.pop(id(value), None)
            if own is None:
                continue
            for x, pull in sources:
                one = pull(own)
                found[id(x)] = found[id(x)] + one if id(x) in found else one
        return [found.get(id(x), np.zeros_like(x.value)) for x in variables]

    def exp(self, x: Any) -> Any:
        """Return exponentials."""
        y = np.exp(x.value)
        return self.note(y, (x, lambda d: d * y))

    def log1p(self, x: Any) -> Any:
        """Return the logarithms of 1 + x."""
        return self.note(np.log1p(x.value), (x, lambda d: d / (1 + x.value)))

    def arcsinh(self, x: Any) -> Any:
        """Return inverse hyperbolic sines."""
        return self.note(np.arcsinh(x.value), (x, lambda d: d / np.hypot(1, x.value)))

    def tanh(self, x: Any) -> Any:
        """Return hyperbolic tangents."""
        y = np.tanh(x.value)
        return self.note(y, (x, lambda d: d * (1 - y * y)))

    def softmax(self, x: Any) -> Any:
        """Return exponentials divided by their sum over the last axis."""
        y = np.exp(x.value - x.value.max(-1, keepdims=True))
        y /= y.sum(-1, keepdims=True)
        return self.note(y, (x, lambda d: y * (d - (d * y).sum(-1, keepdims=True))))

    def sum(self, x: Any, axis: int) -> Any:
        """Return sums over an axis, whose length becomes 1."""
        return self.note(x.value.sum(axis, keepdims=True), (x, lambda d: np.broadcast_to(d, x.shape)))

    def reshape(self, x: Any, shape: Sequence[int]) -> Any:
        """Return the numbers in another shape."""
        return self.note(x.value.reshape(shape), (x, lambda d: d.reshape(x.shape)))

    def swapped(self, x: Any, a: int, b: int) -> Any:
        """Return x with two axes exchanged."""
        return self.note(x.value.swapaxes(a, b), (x, lambda d: d.swapaxes(a, b)))

    def matmul(self, a: Any, b: Any) -> Any:
        """Return matrix products over the last two axes; other axes are the same."""
        left, right = a.value, b.value
        return self.note(
            left @ right, (a, lambda d: d @ right.swapaxes(-1, -2)), (b, lambda d: left.swapaxes(-1, -2) @ d)
        )

    def linear(self, x: Any, matrix: Array) -> Any:
        """Return ``x @ matrix`` for a constant matrix."""
        own = matrix.astype(x.value.dtype)
        return self.note(x.value @ own, (x, lambda d: d @ own.T))

    def rows(self, x: Any, index: Array) -> Any:
        """Return the entries of the second axis at places."""
        return self.note(x.value[:, index], (x, lambda d: _sums(d, index, x.shape[1])))

    def sum_rows(self, x: Any, index: Array, count: int) -> Any:
        """Return `count` entries of the second axis: sums of those of x with equal places."""
        return self.note(_sums(x.value, index, count), (x, lambda d: d[:, index]))

    def mixed(self, algebra: Algebra, w: Any, x: Any) -> Any:
        """Return sums over the channels of x (n, channels, blades) with weights w (results, channels, grades)."""
        weights, given, bounds = w.value, x.value, np.searchsorted(algebra.grades, np.arange(algebra.n + 2))
        parts = [slice(*bounds[k : k + 2]) for k in range(algebra.n + 1)]
        y = np.empty((len(given), len(weights), algebra.size), given.dtype)
        for k, own in enumerate(parts):
            y[..., own] = weights[..., k] @ given[..., own]

        def by_x(d: Array) -> Array:
            found: Array = np.empty_like(given)
            for k, own in enumerate(parts):
                found[..., own] = weights[..., k].T @ d[..., own]
            return found

        def by_w(d: Array) -> Array:
            found = [np.tensordot(d[..., own], given[..., own], ((0, 2), (0, 2))) for own in parts]
            return np.asarray(np.stack(found, -1))

        return self.note(y, (w, by_w), (x, by_x))

    def weighted(self, algebra: Algebra, a: Any, b: Any, w: Any) -> Any:
        """Return products of a and b (n, channels, blades), with weights (channels, paths) of their parts."""
        given = a.value, b.value, w.value
        kept: list[tuple[Array, ...]] = []

        def part(k: int) -> Pull:
            def pull(d: Array) -> Any:
                if not kept:
                    kept.append(weighted_pull(algebra, *given, d))
                return kept[0][k]

            return pull

        return self.note(algebra.weighted(*given), (a, part(0)), (b, part(1)), (w, part(2)))

    def kept(self, x: Any, rate: float, seed: int) -> Any:
        """Return x with a part of the channels set to zero in training, and the others divided by what is kept."""
        number = _draw.get()
        if number is None or rate == 0:
            return x
        mask = np.random.default_rng([number, seed]).random((*x.shape[:2], 1)) >= rate
        return x * (mask / (1 - rate)).astype(x.value.dtype)


def weighted_pull(algebra: Algebra, a: Array, b: Array, w: Array, d: Array) -> tuple[Array, Array, Array]:
    """Return the gradients of ``d . weighted(a, b, w)``, where the weights are those of all samples."""
    by_a, by_b, by_w = algebra.weighted_pull(a, b, w, np.ascontiguousarray(d))
    return by_a, by_b, np.asarray(by_w.sum(0))


def _sums(x: Array, index: Array, count: int) -> Array:
    found = np.zeros((len(x), count, *x.shape[2:]), x.dtype)
    places: Any = slice(None), index
    np.add.at(found, places, x)
    return found


Kept = tuple[Any, Record, list[Recorded], Recorded]


def computed(layer: Any, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Kept:
    """Return a layer with a record of its computation, the variables, and the result, whose array remembers them."""
    record = Record()
    variables = [record.start(each) for each in (x, *parameters)]
    found = layer, record, variables, layer.definition(record, algebra, variables[0], variables[1:])
    if found[-1] is not variables[0]:
        note(found[-1].value, found)
    return found


def pulled(layer: Any, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array) -> list[Array]:
    """Return the gradients of ``d . y`` with respect to x and the parameters of a layer, where y is its result."""
    found = noted(y)
    is_own = isinstance(found, tuple) and found[0] is layer and found[2][0].value is x
    _, record, variables, result = found if is_own else computed(layer, algebra, x, parameters)
    return record.gradients(result, d, variables)
