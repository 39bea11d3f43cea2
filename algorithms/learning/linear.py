"""Linear layers: sums of products with weights, from the left, from the right, and from both sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .algebra import Algebra, Array
from .base import Layer, Shape, summed

LEAST_WIDTH = 512
"""The measured number of real inputs and results from which matrices of spinors are faster than wide matrices."""


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
    return (x.reshape(len(x), inner * size) @ wide).reshape(len(x), out, size)


def apply_pull(matrix: Array, x: Array, d: Array) -> tuple[Array, Array]:
    """Return the gradients of ``d . apply(matrix, x)`` with respect to the matrices and x."""
    out, inner, size, _ = matrix.shape
    flat, cotangent = x.reshape(len(x), inner * size), d.reshape(len(d), out * size)
    wide = matrix.transpose(0, 2, 1, 3).reshape(out * size, inner * size)
    gradient = (cotangent.T @ flat).reshape(out, size, inner, size).transpose(0, 2, 1, 3)
    return gradient, (cotangent @ wide).reshape(x.shape)


class _Spinors:
    """Products of sums by matrices over real or complex numbers that represent the algebra."""

    def __init__(self, algebra: Algebra, matrices: Array, side: str, dtype: np.dtype) -> None:
        matrices = matrices if side == "left" else matrices.transpose(0, 2, 1)
        self.d, self.is_complex = matrices.shape[-1], np.iscomplexobj(matrices)
        flat = matrices.reshape(len(matrices), -1)
        # Rows of real numbers; real and imaginary parts alternate.
        self.basis = (
            (np.stack([flat.real, flat.imag], -1) if self.is_complex else flat).reshape(len(flat), -1).astype(dtype)
        )
        columns = matrices.transpose(0, 2, 1).reshape(len(matrices), -1)
        self.columns = (np.stack([columns.real, columns.imag], -1) if self.is_complex else columns).reshape(
            len(flat), -1).astype(dtype)  # fmt: skip
        self.number = np.result_type(dtype, np.complex64) if self.is_complex else np.dtype(dtype)

    def weights(self, w: Array) -> Array:
        """Return (in * d, out * d) for weights (out, in, blades)."""
        out, inner, _ = w.shape
        matrices = (w @ self.basis).view(self.number).reshape(out, inner, self.d, self.d)
        return np.asarray(matrices.transpose(1, 3, 0, 2).reshape(inner * self.d, out * self.d))

    def weights_pull(self, d: Array, out: int) -> Array:
        """Return the gradient with respect to the weights."""
        inner = len(d) // self.d
        rows = np.ascontiguousarray(d.reshape(inner, self.d, out, self.d).transpose(2, 0, 3, 1)).reshape(out, inner, -1)
        return np.asarray(rows.view(rows.real.dtype) @ self.basis.T)

    def rows(self, x: Array) -> Array:
        """Return (batch * d, channels * d): the columns of the matrices of x."""
        batch, channels, size = x.shape
        numbers = (x.reshape(-1, size) @ self.columns).view(self.number).reshape(batch, channels, self.d, self.d)
        return np.asarray(numbers.transpose(0, 2, 1, 3).reshape(batch * self.d, channels * self.d))

    def elements(self, rows: Array, channels: int) -> Array:
        """Return d times the inverse of `rows`, its transpose."""
        numbers = rows.reshape(-1, self.d, channels, self.d).transpose(0, 2, 1, 3)
        flat = np.ascontiguousarray(numbers).reshape(numbers.shape[0] * channels, self.d * self.d)
        found = flat.view(flat.real.dtype) @ self.columns.T
        return np.asarray(found.reshape(len(rows) // self.d, channels, len(self.columns)))


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
        g, target = algebra.grades, algebra.grades[algebra.targets]
        keep = np.isin(target, range(algebra.n + 1) if self.grades is None else self.grades)
        if self.product != "geometric":
            keep &= target == (np.abs(g[:, None] - g) if self.product == "inner" else g[:, None] + g)
        return algebra.signs * keep

    def _spinors(self, algebra: Algebra, x: Array) -> _Spinors | None:
        if self.product != "geometric" or self.grades is not None or algebra.spinors is None:
            return None
        if min(x.shape[1], self.channels) * algebra.size < LEAST_WIDTH:
            return None
        return _Spinors(algebra, algebra.spinors, self.side, x.dtype)

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        w, spinors = parameters[0], self._spinors(algebra, x)
        if spinors:
            y = spinors.elements(spinors.rows(x) @ (spinors.weights(w) / spinors.d), len(w))
        else:
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
            rows, cotangent = spinors.rows(x), spinors.rows(d) / spinors.d
            dw = spinors.weights_pull(rows.conj().T @ cotangent, len(w))
            dx = spinors.elements(cotangent @ spinors.weights(w).conj().T, x.shape[1])
        else:
            left, signs = self.side == "left", self._signs(algebra)
            matrix = (left_matrix if left else right_matrix)(algebra, w, signs)
            gradient, dx = apply_pull(matrix, x, d)
            dw = (left_pull if left else right_pull)(algebra, gradient, signs)
        return dx, [dw, summed(d)] if self.bias else [dw]


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
        gradient, dx = apply_pull(left @ right, x, d)
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
        gradient, dx = apply_pull(before[-1], x, d)
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
