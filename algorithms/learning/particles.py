"""Layers of interacting particles: steps in time whose messages between pairs are computed by real layers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from generated import particles as kernels

from .activations import Split
from .algebra import Algebra, Array
from .base import Layer, Shape
from .linear import Linear

_REALS = Algebra(0)
"""The algebra of messages: real numbers."""
_INVARIANTS = _MESSAGES = 4
"""The number of invariants of a pair of particles, and of numbers of its message."""


class _Kernels(NamedTuple):
    """Kernels for all pairs of a number of particles."""

    invariants: Any
    invariants_by_state: Any
    invariants_by_charge: Any
    step: Any
    step_by_state: Any
    step_by_messages: Any


@cache
def _kernels(particles: int, span: float, dtype: np.dtype) -> _Kernels:
    """Bind the pairs and the time of a step, which are checked once."""
    first, second = np.triu_indices(particles, 1)
    pairs = {"first": first, "second": second}
    step = {**pairs, "span": dtype.type(span)}
    return _Kernels(
        kernels.pair_invariants.bind(**pairs),
        kernels.pair_invariants_vjp_state.bind(**pairs),
        kernels.pair_invariants_vjp_charge.bind(**pairs),
        kernels.pair_step.bind(**step),
        kernels.pair_step_vjp_state.bind(**step),
        kernels.pair_step_vjp_weights.bind(**step),
    )


@dataclass(frozen=True)
class Interaction(Layer):
    """The places of particles in G(3) after some time, equivariant under motions, reflections and renumbering.

    The first half of the channels contains a particle each: its place as a vector, and its charge as a scalar. The
    second half contains their velocities. In each step, layers of real numbers compute four factors of directions from
    four invariants of each pair: distance, relative speed, the angle between both, and the product of the charges.
    Messages are added over the pairs of a particle. All steps have the same parameters.

    Parameters
    ----------
    particles : int
    steps : int
    hidden : tuple of int
        The numbers of results of the real layers before the last.
    time : float
        The time of all steps together.
    """

    particles: int
    steps: int = 10
    hidden: tuple[int, ...] = (32, 32)
    time: float = 1.0

    def __post_init__(self) -> None:
        if self.particles < 2 or self.steps < 1 or any(width < 1 for width in self.hidden):
            raise ValueError(f"{self}; expected at least two particles, and positive numbers of steps and results")

    @property
    def _layers(self) -> list[Layer]:
        inner = [layer for width in self.hidden for layer in (Linear(width), Split("silu"))]
        return [*inner, Linear(_MESSAGES)]

    def _kernels(self, x: Array) -> _Kernels:
        return _kernels(self.particles, self.time / self.steps, x.dtype)

    def output(self, algebra: Algebra, channels: int) -> Shape:
        """Return the algebra and the number of channels of the result."""
        if (algebra.p, algebra.q, algebra.r) != (3, 0, 0) or channels != 2 * self.particles:
            raise ValueError(
                f"Interaction: {channels} channels in {algebra}; expected G(3) and {2 * self.particles} channels: "
                f"{self.particles} places with charges, then {self.particles} velocities"
            )
        return algebra, self.particles

    def initial(self, algebra: Algebra, channels: int, random: np.random.Generator) -> list[Array]:
        """Return random parameters, small ones for messages."""
        found, inner = [], _INVARIANTS
        for layer in self._layers:
            found.extend(layer.initial(_REALS, inner, random))
            inner = layer.output(_REALS, inner)[1]
        found[-2] *= 0.1
        return found

    def _own(self, parameters: Sequence[Array]) -> list[Sequence[Array]]:
        """Return the parameters of each of the real layers."""
        found, start = [], 0
        for layer in self._layers:
            stop = start + 2 * isinstance(layer, Linear)
            found.append(parameters[start:stop])
            start = stop
        return found

    def _states(self, x: Array, parameters: Sequence[Array]) -> tuple[list[Array], list[list[Array]]]:
        """Return the states before and after each step, and the values of the real layers in each step."""
        n, own_kernels = self.particles, self._kernels(x)
        layers = list(zip(self._layers, self._own(parameters), strict=True))
        charge = np.ascontiguousarray(x[:, :n, 0])
        states = [np.concatenate([x[:, :n, 1:4], x[:, n:, 1:4]], axis=2)]
        values = []
        for _ in range(self.steps):
            given = own_kernels.invariants(states[-1], charge)
            own = [np.asarray(given).reshape(-1, _INVARIANTS, 1)]
            for layer, weights in layers:
                own.append(layer.value(_REALS, own[-1], weights))
            values.append(own)
            messages = own[-1].reshape(given.shape)
            states.append(np.asarray(own_kernels.step(states[-1], messages)))
        return states, values

    def value(self, algebra: Algebra, x: Array, parameters: Sequence[Array]) -> Array:
        """Compute the result."""
        found = np.zeros((len(x), self.particles, algebra.size), x.dtype)
        found[..., 1:4] = self._states(x, parameters)[0][-1][..., :3]
        return found

    def pull(
        self, algebra: Algebra, x: Array, parameters: Sequence[Array], y: Array, d: Array
    ) -> tuple[Array, list[Array]]:
        """Compute the gradients of ``d . y`` with respect to x and the parameters."""
        n, own_kernels = self.particles, self._kernels(x)
        states, values = self._states(x, parameters)
        layers, owned = self._layers, self._own(parameters)
        charge = np.ascontiguousarray(x[:, :n, 0])
        by_charge, by_state = np.zeros_like(charge), np.zeros((len(x), n, 6), x.dtype)
        by_state[..., :3] = d[..., 1:4]
        gradients = [np.zeros_like(one) for one in parameters]
        for state, own in zip(reversed(states[:-1]), reversed(values), strict=True):
            shape = len(x), n * (n - 1) // 2, _INVARIANTS
            given = state, own[-1].reshape(shape), by_state
            by_value = np.asarray(own_kernels.step_by_messages(*given)[1]).reshape(own[-1].shape)
            by_state = np.asarray(own_kernels.step_by_state(*given)[1])
            stop = len(gradients)
            for k in reversed(range(len(layers))):
                by_value, found = layers[k].pull(_REALS, own[k], owned[k], own[k + 1], by_value)
                for total, one in zip(gradients[stop - len(found) : stop], found, strict=True):
                    total += one
                stop -= len(found)
            given = state, charge, by_value.reshape(shape)
            by_state += np.asarray(own_kernels.invariants_by_state(*given)[1])
            by_charge += np.asarray(own_kernels.invariants_by_charge(*given)[1])
        dx = np.zeros_like(x)
        dx[:, :n, 0], dx[:, :n, 1:4], dx[:, n:, 1:4] = by_charge, by_state[..., :3], by_state[..., 3:]
        return dx, gradients
