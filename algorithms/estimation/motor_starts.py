"""Updates of a motor from wide predictions: further starts, and all objects since the beginning."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from generated import pga3

from ..arguments import Reals
from ..motors.recovery import motor_from_objects
from .motor_objects import POINTS, Kind

WIDE = 0.3
"""rad. A prediction that is less certain than this is not the only start of an update."""
_ANGLES = 0.5, -0.5, 1.0, -1.0, 1.5, -1.5
"""Angles of starts about the axes of the covariance, in standard deviations of at most 2 rad."""


@dataclass(frozen=True, slots=True, eq=False)
class Beginning:
    """A wide prediction and all objects measured since, from which the motor is estimated again with each update."""

    motor: Reals
    triangle: Reals
    """Of its covariance."""
    kind: Kind
    variances: Reals
    model: Reals
    seen: Reals

    def fits(self, kind: Kind, variances: Reals) -> bool:
        """Return whether objects of this kind can be used together with those so far."""
        return self.kind is kind and np.array_equal(self.variances, variances)

    def with_objects(self, model: Reals, seen: Reals) -> Beginning:
        """Return the beginning with further objects."""
        return replace(self, model=np.concatenate([self.model, model]), seen=np.concatenate([self.seen, seen]))

    def with_noise(self, noise: Reals) -> Beginning:
        """Return the beginning with a covariance that is larger by `noise`."""
        return replace(self, triangle=self.triangle + noise)


@dataclass(frozen=True, slots=True, eq=False)
class Update:
    """The arguments of an update, except for the motor of the first linearisation."""

    kind: Kind
    motor: Reals
    triangle: Reals
    model: Reals
    seen: Reals
    variances: Reals
    gate: float

    def started_at(self, start: Reals) -> tuple[Reals, Reals, Reals]:
        """Return the motor, the triangle of its covariance, and the numbers of the kernel."""
        found: tuple[Reals, Reals, Reals] = self.kind.update(
            self.motor, self.triangle, self.model, self.seen, self.variances, self.gate, start
        )
        return found

    def best(self, first: tuple[Reals, Reals, Reals], now: Reals, covariance: Reals) -> tuple[Reals, Reals, Reals]:
        """Return the best of the updates from several starts: that with the smallest sum of squares."""
        best, cost = first, _cost(first[2])
        for start in self._starts(now, covariance):
            found = self.started_at(start)
            if _cost(found[2]) < cost:
                best, cost = found, _cost(found[2])
            if cost <= self.kind.n_numbers * found[2][2]:
                break
        return best

    def _starts(self, now: Reals, covariance: Reals) -> list[Reals]:
        """Return the least-squares solution of the objects, and motions of a motor along the axes of its covariance."""
        good = np.isfinite(self.model).all(1) & np.isfinite(self.seen).all(1)
        if self.kind is not POINTS:
            good &= (np.abs(self.model[:, :3]).sum(1) > 0) & (np.abs(self.seen[:, :3]).sum(1) > 0)
        starts = []
        if good.any():
            fit = motor_from_objects(**{self.kind.name: (self.model[good], self.seen[good])})
            starts.append(np.asarray(fit.motor, float))
        values, vectors = np.linalg.eigh(covariance[:3, :3])
        for value, axis in zip(values[::-1], vectors.T[::-1], strict=True):
            if value < WIDE**2:
                continue
            follow = covariance[3:, :3] @ axis / value
            for angle in _ANGLES:
                error = angle * min(2.0, np.sqrt(value)) * np.concatenate([axis, follow])
                starts.append(pga3.motor_product(pga3.motor_exponential(-error / 2), now))
        return starts


def _cost(numbers: Any) -> float:
    return float(numbers[1]) if numbers[3] and np.isfinite(numbers[1]) else np.inf
