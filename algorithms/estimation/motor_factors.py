"""Factors of graphs of motors: measurements of poses, velocities and biases as residuals with derivatives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from generated import motor_graphs as kernels

from ..arguments import Reals

POSE, VELOCITY, BIAS = "pose", "velocity", "bias"
PARTS = {POSE: slice(0, 6), VELOCITY: slice(6, 9), BIAS: slice(9, 15)}
"""The parameters of a state: a perturbation of its pose, its velocity, and its biases of rates and of forces."""
N_PARAMETERS = 15
"""The number of parameters of a state: motion, velocity, and the biases of both inertial sensors."""


class States(NamedTuple):
    """What is estimated, one row for each state."""

    motors: Reals
    """(n, 8) Unit motors from the frames of poses to that of the map."""
    velocities: Reals
    """(n, 3) In the frame of the map."""
    biases: Reals
    """(n, 6) Of the angular rates and of the specific forces, in the frames of poses."""

    def moved(self, change: Reals) -> States:
        """Return the states after changes (n, 15)."""
        motors = kernels.moved_motor(self.motors, np.ascontiguousarray(change[:, PARTS[POSE]]))
        return States(
            np.asarray(motors), self.velocities + change[:, PARTS[VELOCITY]], self.biases + change[:, PARTS[BIAS]]
        )

    def change_from(self, other: States) -> Reals:
        """Return the changes (n, 15) that move other states to these."""
        turns = kernels.difference_of_motors(self.motors, other.motors)[0]
        return np.concatenate([turns, self.velocities - other.velocities, self.biases - other.biases], 1)


def _of_difference(value: Reals, measured: Reals) -> tuple[Reals, ...]:
    return value - measured, np.broadcast_to(np.eye(value.shape[1]), (*value.shape, value.shape[1]))


def _of_change(before: Reals, after: Reals, measured: Reals) -> tuple[Reals, ...]:
    rest, rows = _of_difference(after - before, measured)
    return rest, -rows, rows


@dataclass(frozen=True, slots=True)
class Kind:
    """What a factor measures."""

    name: str
    variables: tuple[tuple[str, int], ...]
    """The variables of a factor: the kind, and which of its states has it."""
    n_numbers: int
    """The number of residuals after `Factors.roots`, of which those of flat motions choose three."""
    equations: Callable[..., tuple[Reals, ...]]
    """Function from the variables and the data to residuals and their derivatives by each variable."""


PRIOR = Kind("prior", ((POSE, 0),), 6, kernels.difference_of_motors)
MOTION = Kind("motion", ((POSE, 0), (POSE, 1)), 6, kernels.relative_motion)
FLAT_MOTION = Kind("flat motion", ((POSE, 0), (POSE, 1)), 3, kernels.relative_motion)
LINES = Kind("lines", ((POSE, 0),), 4, kernels.seen_line)
PLANES = Kind("planes", ((POSE, 0),), 3, kernels.seen_plane)
POINTS = Kind("points", ((POSE, 0),), 3, kernels.seen_point)
PLACE = Kind("position", ((POSE, 0),), 3, kernels.place_of_pose)
SPEED = Kind("velocity", ((VELOCITY, 0),), 3, _of_difference)
BIASES = Kind("bias", ((BIAS, 0),), 6, _of_difference)
WALK = Kind("bias walk", ((BIAS, 0), (BIAS, 1)), 6, _of_change)
INERTIAL = Kind("inertial", ((POSE, 0), (VELOCITY, 0), (BIAS, 0), (POSE, 1), (VELOCITY, 1)), 9, kernels.inertial_motion)


@dataclass(frozen=True, slots=True, eq=False)
class Factors:
    """Factors of one kind."""

    kind: Kind
    states: Reals
    """(m, k) The states of each factor."""
    data: tuple[Reals, ...]
    """What was measured, one row for each factor."""
    roots: Reals
    """(m, k, r) or (k, r) Matrices that make the covariance of residuals that of k independent unit numbers."""
    robust: Reals
    """(m,) bool. Factors with a bounded influence."""

    def columns(self, position: Reals) -> Reals:
        """Return the parameters (m, p) of factors from those of states (n, 15)."""
        return np.concatenate([position[self.states[:, k], PARTS[name]] for name, k in self.kind.variables], 1)

    def linearised(self, states: States) -> tuple[Reals, Reals]:
        """Return residuals (m, r) in standard deviations, and their derivatives (m, r, p)."""
        every = dict(zip(PARTS, states, strict=True))
        variables = (np.take(every[name], self.states[:, k], 0) for name, k in self.kind.variables)
        rest, *rows = self.kind.equations(*variables, *self.data)
        return (self.roots @ rest[:, :, None])[:, :, 0], self.roots @ np.concatenate(rows, 2)

    def kept(self, which: Reals, number: Reals) -> Factors:
        """Return some of the factors, with other numbers of states."""
        roots = self.roots if self.roots.ndim == 2 else self.roots[which]
        data = tuple(each[which] for each in self.data)
        return Factors(self.kind, number[self.states[which]], data, roots, self.robust[which])


@dataclass(frozen=True, slots=True, eq=False)
class Summary:
    """What factors that were left out say of some states: a linear factor of all of them."""

    states: Reals
    """(1, k)"""
    about: States
    """The states at which the factors were linearised."""
    rest: Reals
    """(r,) Residuals there, in standard deviations."""
    rows: Reals
    """(r, 15 k) Derivatives by changes of the states."""
    robust: Reals = field(default_factory=lambda: np.zeros(1, bool))

    def columns(self, position: Reals) -> Reals:
        """Return the parameters (1, 15 k) of the factor, -1 for those that it does not depend on."""
        return np.where(self.rows.any(0), position[self.states].reshape(-1), -1)[None]

    def linearised(self, states: States) -> tuple[Reals, Reals]:
        """Return residuals (1, r), and their derivatives (1, r, 15 k)."""
        now = States(*(each[self.states[0]] for each in states))
        rest = self.rest + self.rows @ now.change_from(self.about).ravel()
        by_turns = kernels.difference_of_motors(now.motors, self.about.motors)[1]
        rows = self.rows.reshape(len(self.rest), -1, N_PARAMETERS).copy()
        rows[:, :, PARTS[POSE]] = np.einsum("rki,kij->rkj", rows[:, :, PARTS[POSE]], by_turns)
        return rest[None], rows.reshape(1, len(self.rest), -1)

    def kept(self, which: Reals, number: Reals) -> Summary:
        """Return the factor with other numbers of states."""
        return Summary(number[self.states], self.about, self.rest, self.rows)
