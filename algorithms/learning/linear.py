"""Linear layers: sums of products with weights, from the left, from the right, and from both sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from .algebra import Algebra, Array
from .base import Layer, Shape, summed
from .spinors import Spinors
from .workspace import multiplied

LEAST_WIDTH: float = 100
"""The measured value of ``a b / (a + b)``, for a real inputs and b real results, from which matrices of spinors are
faster than wide matrices; a quarter of it is, where kernels compute columns of the matrices."""


def left_matrix(algebra: Algebra, w: Array, signs: Array | None = None) -> Array:
    """Return the matrices (..., k, j) of ``x -> w x``."""
    signs = algebra.signs if signs is None else signs
    rows = algebra.targets  # Each of i, j and k is the target of the two others.
    columns = np.arange(algebra.size)
    return np.asarray(w[..., rows] * signs[rows, columns].astype(w.dtype))


def right_matrix(algebra: Algebra, w: Array, signs: Array | None = None) -> Array:
    """Return the matrices (..., k, i) of ``x -> x w``."""
    signs = algebra.signs if signs is None else signs
    rows = algebra.targets
    return np.asarray(w[..., rows] * signs[np.arange(algebra.size), rows].astype(w.dtype))


def left_pull(algebra: Algebra, d: Array, signs: Array | None = None) -> Array:
    """Return the gradient with respect to w of ``d . left_matrix(w)``: the transposed table."""
    signs = algebra.signs if signs is None else signs
    columns = np.arange(algebra.size)
    return np.asarray((d[..., algebra.targets, columns] * signs.astype(d.dtype)).sum(-1))


def right_pull(algebra: Algebra, d: Array, signs: Array | None = None) -> Array:
    """Return the gradient with respect to w of ``d . right_matrix(w)``."""
    signs = algebra.signs if signs is None else signs
    columns = np.arange(algebra.size)
    return np.asarray((d[..., algebra.targets, columns] * signs.T.astype(d.dtype)).sum(-1))


def apply(matrix: Array, x: Array) -> Array:
    """Apply matrices (out, in, blades, blades) to x (batch, in, blades) by one product of real matrices."""
    out, inner, size, _ = matrix.shape
    wide = matrix.transpose(1, 3, 0, 2).reshape(inner * size, out * size)
    return multiplied(x.reshape(len(x), inner * size), wide).reshape(len(x), out, size)


def apply_pull(matrix: Array, d: Array) -> Array:
    """Return the gradient of ``d . apply(matrix, x)`` with respect to x."""
    out, inner, size, _ = matrix.shape
    wide = matrix.transpose(0, 2, 1, 3).reshape(out * size, inner * size)
    return multiplied(d.reshape(len(d), out * size), wide).reshape(len(d), inner, size)


def matrix_pull(x: Array, d: Array) -> Array:
    """Return the gradient of ``d . apply(matrix, x)`` with respect to the matrices (out, in, blades, blades)."""
    (batch, out, size), inner = d.shape, x.shape[1]
    found = d.reshape(batch, out * size).T @ x.reshape(batch, inner * size)
    return found.reshape(out, size, inner, size).transpose(0, 2, 1, 3)


@cache
def _kept_signs(algebra: Algebra, product: str, grades: tuple[int, ...] | None) -> Array:
    """Return the signs of the products of blades that a layer keeps, and zeros for the others."""
    g, target = algebra.grades, algebra.grades[algebra.targets]
    keep = np.isin(target, range(algebra.n + 1) if grades is None else grades)
    if product != "geometric":
        keep &= target == (np.abs(g[:, None] - g) if product == "inner" else g[:, None] + g)
    found = algebra.signs * keep
    found.flags.writeable = False
    return np.asarray(found)


@dataclass(frozen=True)
class Linear(Layer):
    """Sums of products of weights and inputs, and a bias: the geometric neuron with the identity as activation.

    Parameters
    ----------
    channels : int
        The number of results.
    side : {"left", "right"}
        The side of the weights.
    product : {"geometric", "inner", "outer"}
    grades : tuple of int, optional
        The grades of the results to keep. The scalar part alone makes a neuron of McCulloch and Pitts.
    bias : bool
    """

    channels: int
    side: str = "left"
    product: str = "geometric"
    grades: tuple[int, ...] | None = None
    bias: bool = True

    def __post_init__(self) -> None:
        if (
            self.channels < 1
            or self.side not in ("left", "right")
            or self.product not in ("geometric", "inner", "outer")
        ):
            raise ValueError(
                f"{self}; expected channels, side 'left' or 'right', product 'geometric', 'inner' or 'outer'"
            )

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        return algebra, self.channels

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        w = random.normal(size=(self.channels, channels, algebra.size)) / np.sqrt(channels * algebra.size)
        return [w, np.zeros((self.channels, algebra.size))] if self.bias else [w]

    def _signs(self, algebra: Algebra) -> Array:
        return _kept_signs(algebra, self.product, self.grades)

    def _spinors(self, algebra: Algebra, x: Array) -> Spinors | None:
        if self.product != "geometric" or self.grades is not None or algebra.spinors is None:
            return None
        if not self._is_wide(algebra, x.shape[1]):
            return None
        return Spinors.of(algebra, self.side, x.dtype)

    def _is_wide(self, algebra: Algebra, channels: int) -> bool:
        inner, out = channels * algebra.size, self.channels * algebra.size
        least = LEAST_WIDTH / 4 if self.side == "left" and algebra.column_kernels else LEAST_WIDTH
        return inner * out >= least * (inner + out)

    def uses_columns(self, algebra: Algebra, channels: int) -> bool:
        """Return whether the layer multiplies columns of matrices that kernels compute."""
        plain = self.product == "geometric" and self.grades is None and self.side == "left"
        return plain and algebra.column_kernels is not None and self._is_wide(algebra, channels)

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        w, spinors = parameters[0], self._spinors(algebra, x)
        if spinors:
            offset = parameters[1] if self.bias else np.zeros((len(w), algebra.size), w.dtype)
            return spinors.elements(multiplied(spinors.rows(x), spinors.weights(w) / spinors.d), len(w), offset)
        matrix = left_matrix if self.side == "left" else right_matrix
        y = apply(matrix(algebra, w, self._signs(algebra)), x)
        if self.bias:
            y += parameters[1]
        return y

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters."""
        w, spinors = parameters[0], self._spinors(algebra, x)
        if spinors:
            cotangent = spinors.rows(d)
            back = multiplied(cotangent, spinors.weights(w).conj().T / spinors.d)
            dx = spinors.elements(back, x.shape[1], np.zeros((x.shape[1], algebra.size), x.dtype))
            return dx, self._gradients(algebra, x, w, d, cotangent)
        matrix = left_matrix if self.side == "left" else right_matrix
        dx = apply_pull(matrix(algebra, w, self._signs(algebra)), d)
        return dx, self._gradients(algebra, x, w, d)

    def pull_parameters(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> list[Array]:
        """Compute the gradients of ``d . y`` with respect to the parameters."""
        spinors = self._spinors(algebra, x)
        return self._gradients(algebra, x, parameters[0], d, spinors.rows(d) if spinors else None)

    def _gradients(self, algebra: Algebra, x: Array, w: Array, d: Array, cotangent: Array | None = None) -> list[Array]:
        spinors = self._spinors(algebra, x)
        if spinors and cotangent is not None:
            dw = spinors.weights_pull(spinors.rows(x), cotangent, len(w))
        else:
            pull = left_pull if self.side == "left" else right_pull
            dw = pull(algebra, matrix_pull(x, d), self._signs(algebra))
        return [dw, summed(d)] if self.bias else [dw]


@dataclass(frozen=True)
class TwoSided(Layer):
    """Sums of ``w x ~w``, the spinor neuron."""

    channels: int

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        return algebra, self.channels

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        return [random.normal(size=(self.channels, channels, algebra.size)) / np.sqrt(algebra.size * np.sqrt(channels))]

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        w = parameters[0]
        reverse = w * algebra.reversal.astype(w.dtype)
        return apply(left_matrix(algebra, w) @ right_matrix(algebra, reverse), x)

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters."""
        w = parameters[0]
        signs = algebra.reversal.astype(w.dtype)
        left, right = left_matrix(algebra, w), right_matrix(algebra, w * signs)
        gradient, dx = matrix_pull(x, d), apply_pull(left @ right, d)
        by_left, by_right = gradient @ right.swapaxes(-1, -2), left.swapaxes(-1, -2) @ gradient
        return dx, [left_pull(algebra, by_left) + signs * right_pull(algebra, by_right)]


@dataclass(frozen=True)
class Rotor(Layer):
    """Sums of ``R x / R`` for products R of an even number of vectors, each divided by its square.

    Every rotor is such a product, so that the constraint of the unit norm holds for all parameters.
    """

    channels: int

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        if algebra.p + algebra.q == 0:
            raise ValueError(f"Rotor: {algebra} has no vector with an inverse; expected another algebra")
        return algebra, self.channels

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        return [random.normal(size=(self.channels, channels, 2 * max(1, algebra.n // 2), algebra.n))]

    def _steps(self, algebra: Algebra, v: Array) -> tuple[Array, Array, Array, Array]:
        w = np.zeros((*v.shape[:-1], algebra.size), v.dtype)
        w[..., 1 : algebra.n + 1] = v
        squares = np.diagonal(algebra.signs)[1 : algebra.n + 1].astype(v.dtype)
        inverse = w / (v * v * squares).sum(-1)[..., None]
        return left_matrix(algebra, w), right_matrix(algebra, inverse), inverse, squares

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        left, right, _, _ = self._steps(algebra, parameters[0])
        matrix = left[:, :, 0] @ right[:, :, 0]
        for k in range(1, left.shape[2]):
            matrix = left[:, :, k] @ right[:, :, k] @ matrix
        return apply(matrix, x)

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters."""
        v = parameters[0]
        left, right, _, squares = self._steps(algebra, v)
        steps, count, n = left @ right, v.shape[2], algebra.n
        before = [np.broadcast_to(np.eye(algebra.size, dtype=v.dtype), steps[:, :, 0].shape)]
        for k in range(count):
            before.append(steps[:, :, k] @ before[-1])
        gradient, dx = matrix_pull(x, d), apply_pull(before[-1], d)
        found = np.empty_like(v)
        for k in reversed(range(count)):
            own = gradient @ before[k].swapaxes(-1, -2)
            by_left = left_pull(algebra, own @ right[:, :, k].swapaxes(-1, -2))[..., 1 : n + 1]
            by_right = right_pull(algebra, left[:, :, k].swapaxes(-1, -2) @ own)[..., 1 : n + 1]
            one = v[:, :, k]
            size = (one * one * squares).sum(-1, keepdims=True)
            along = (by_right * one).sum(-1, keepdims=True)
            found[:, :, k] = by_left + by_right / size - 2 * along * squares * one / size**2
            gradient = steps[:, :, k].swapaxes(-1, -2) @ gradient
        return dx, [found]


def simplified_pull(algebra: Algebra, x: Array, w: Array, d: Array) -> tuple[Array, Array]:
    """Compute the gradients of a left linear layer by the simplified rule: products with principal reverses.

    Equal to the full rule in all algebras without null vectors.

    Raises
    ------
    ValueError
        If the algebra has null vectors, whose blades have no inverses.
    """
    signs = algebra.principal_reversal
    dx = algebra.product((w * signs)[None], d[:, :, None]).sum(1)
    dw = algebra.product(d[:, :, None], (x * signs)[:, None]).sum(0)
    return dx, dw
