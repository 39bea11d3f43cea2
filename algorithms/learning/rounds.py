"""Neurons of conformal geometry: spheres as decision surfaces, and radial functions with rotors and dilators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .algebra import Algebra, Array
from .base import Layer, Shape
from .linear import left_matrix, left_pull, right_matrix, right_pull


def _require_reals(algebra: Algebra, name: str) -> None:
    if algebra.n:
        raise ValueError(f"{name}: {algebra}; expected real coordinates, one channel each (algebra 'R')")


@dataclass(frozen=True)
class Hypersphere(Layer):
    """``w . (x, 1, |x|**2 / 2)``: inner products of conformal points and vectors, a sphere or plane of any weight."""

    channels: int

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        _require_reals(algebra, "Hypersphere")
        return algebra, self.channels

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        return [random.normal(size=(self.channels, channels + 2)) / np.sqrt(channels + 2)]

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        w, v = parameters[0], x[..., 0]
        return np.asarray((v @ w[:, :-2].T + w[:, -2] + (v * v).sum(1, keepdims=True) / 2 * w[:, -1])[..., None])

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters."""
        w, v, c = parameters[0], x[..., 0], d[..., 0]
        point = np.concatenate([v, np.ones_like(v[:, :1]), (v * v).sum(1, keepdims=True) / 2], 1)
        return (c @ w[:, :-2] + v * (c @ w[:, -1:]))[..., None], [c.T @ point]


@dataclass(frozen=True)
class ConformalNeuron(Layer):
    """``(r**2 - |x - c|**2) / 2``, the inner product of the conformal point x and the dual sphere of weight 1."""

    channels: int

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        _require_reals(algebra, "ConformalNeuron")
        return algebra, self.channels

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        return [random.normal(size=(self.channels, channels)), np.ones(self.channels)]

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        centre, radius = parameters
        offset = x[:, None, :, 0] - centre
        return np.asarray((radius**2 - (offset * offset).sum(-1))[..., None] / 2)

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters."""
        centre, radius = parameters
        weighted = d * (x[:, None, :, 0] - centre)
        return -weighted.sum(1)[..., None], [weighted.sum(0), radius * d[..., 0].sum(0)]


@dataclass(frozen=True)
class Radial(Layer):
    """Gaussians of vectors of G(2) or G(3), whose axes are turned by a rotor and scaled by dilators.

    The values are ``exp(-|D ~R (x - c) R|**2 / 2)``, summed over the channels in the exponent, where R is divided
    by its norm and D has the exponentials of the last parameters on its diagonal.
    """

    channels: int

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        if (algebra.p, algebra.q, algebra.r) not in ((2, 0, 0), (3, 0, 0)):
            raise ValueError(f"Radial: {algebra}; expected G(2) or G(3)")
        return Algebra(0), self.channels

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters."""
        even = int((algebra.grades % 2 == 0).sum())
        rotor = random.normal(size=(self.channels, even))
        return [random.normal(size=(self.channels, channels, algebra.n)), rotor, np.zeros((self.channels, algebra.n))]

    def _turn(self, algebra: Algebra, rotor: Array) -> tuple[Array, Array, Array]:
        w = np.zeros((len(rotor), algebra.size), rotor.dtype)
        w[:, algebra.grades % 2 == 0] = rotor / np.linalg.norm(rotor, axis=1, keepdims=True)
        return w, left_matrix(algebra, w * algebra.reversal.astype(w.dtype)), right_matrix(algebra, w)

    def _parts(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> tuple[Array, Array, Array]:
        centre, rotor, log = parameters
        _, left, right = self._turn(algebra, rotor)
        turn = (left @ right)[:, 1 : algebra.n + 1, 1 : algebra.n + 1]
        offset = x[:, None, :, 1 : algebra.n + 1] - centre
        return offset, turn, np.einsum("okj,bocj->bock", turn, offset) * np.exp(log)[:, None]

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        scaled = self._parts(algebra, x, parameters)[2]
        return np.asarray(np.exp(-(scaled * scaled).sum((2, 3)) / 2)[..., None])

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters."""
        n, (_, rotor, log) = algebra.n, parameters
        offset, turn, scaled = self._parts(algebra, x, parameters)
        by_scaled = -(d * y)[..., None] * scaled
        by_turned = by_scaled * np.exp(log)[:, None]
        by_offset = np.einsum("bock,okj->bocj", by_turned, turn)
        gradient = np.zeros((len(rotor), algebra.size, algebra.size), x.dtype)
        gradient[:, 1 : n + 1, 1 : n + 1] = np.einsum("bock,bocj->okj", by_turned, offset)
        w, left, right = self._turn(algebra, rotor)
        by_left = left_pull(algebra, gradient @ right.swapaxes(1, 2)) * algebra.reversal
        by_unit = (by_left + right_pull(algebra, left.swapaxes(1, 2) @ gradient))[:, algebra.grades % 2 == 0]
        unit, size = w[:, algebra.grades % 2 == 0], np.linalg.norm(rotor, axis=1, keepdims=True)
        by_rotor = (by_unit - unit * (unit * by_unit).sum(1, keepdims=True)) / size
        dx = np.zeros_like(x)
        dx[..., 1 : n + 1] = by_offset.sum(1)
        return dx, [-by_offset.sum(0), by_rotor.astype(x.dtype), (by_scaled * scaled).sum((0, 2))]
