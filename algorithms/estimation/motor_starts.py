"""Updates of a motor from wide predictions: further starts, and all objects since the beginning."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from generated import pga3

from ..arguments import Reals
from ..evidence import all_or_some_sets
from ..evidence.gates import WIDE
from ..motors.recovery import motor_from_objects
from ..precision import HUGE
from .motor_objects import Kind

_ANGLES = 0.5, -0.5, 1.0, -1.0, 1.5, -1.5
"""A limit on work: angles of starts about the axes of the covariance, in standard deviations of at most 2 rad."""
_SAMPLES = 40
"""A limit on work: the number of sets of objects from which motors are computed. If a third of many objects is wrong,
11 sets of three contain no wrong one."""
_ROUNDS = 8
"""A limit on work: the number of selections of objects within the gate."""


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


class Fit(NamedTuple):
    """The result of an update from some start."""

    cost: float
    """The sum of squares, with the gate for each object outside it."""
    found: tuple[Reals, Reals, Reals]
    """The motor, the triangle of its covariance, and the numbers of the kernel."""
    used: Reals
    """(n,) bool. The objects within the gate."""


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

    def best(self, first: tuple[Reals, Reals, Reals], now: Reals, covariance: Reals) -> Fit:
        """Return the best of the updates from several starts.

        Objects outside the gate cost as much as the gate, so that leaving out right ones is no way to a small sum.
        """
        good = self.kind.usable(self.model, self.seen)
        best = self._selected(first, good)
        for start in self._starts(now, covariance, good):
            if best.cost <= self.kind.n_numbers * good.sum():
                break
            found = self._selected((start, self.triangle, first[2]), good)
            best = found if found.cost < best.cost else best
        return best

    def _selected(self, found: tuple[Reals, Reals, Reals], good: Reals, used: Reals | None = None) -> Fit:
        """Return the result of an update with the objects within the gate, which are selected until they stay."""
        before = used
        for _ in range(_ROUNDS):
            used = good
            if self.gate < HUGE and np.isfinite(found[0]).all():
                used = good & (self.kind.squares(found[0], self.model, self.seen, self.variances) <= self.gate)
            if not used.any() or (before is not None and np.array_equal(used, before)):
                break
            before, found = used, self._of(used, found[0])
        if used is None or not used.any():
            return Fit(np.inf, (self.motor, self.triangle, np.zeros(5)), np.zeros(len(good), bool))
        return Fit(_cost(found[2]) + float(good.sum() - used.sum()) * self.gate, found, used)

    def _of(self, used: Reals, start: Reals) -> tuple[Reals, Reals, Reals]:
        """Return the update by some of the objects, without a gate."""
        found: tuple[Reals, Reals, Reals] = self.kind.update(
            self.motor, self.triangle, self.model[used], self.seen[used], self.variances, HUGE, start
        )
        return found

    def _starts(self, now: Reals, covariance: Reals, good: Reals) -> Iterator[Reals]:
        """Yield the least-squares solutions of all objects, and of small sets of them if there is a gate, and motions
        of a motor along the axes of its covariance."""
        rows, size = np.flatnonzero(good), self.kind.sample_size
        if len(rows):
            yield self._solved(rows)
        if self.gate < HUGE and len(rows) > size:
            for some in all_or_some_sets(len(rows), size, _SAMPLES):
                yield self._solved(rows[some])
        values, vectors = np.linalg.eigh(covariance[:3, :3])
        for value, axis in zip(values[::-1], vectors.T[::-1], strict=True):
            if value < WIDE**2:
                continue
            follow = covariance[3:, :3] @ axis / value
            for angle in _ANGLES:
                error = angle * min(2.0, np.sqrt(value)) * np.concatenate([axis, follow])
                yield pga3.motor_product(pga3.motor_exponential(-error / 2), now)

    def _solved(self, rows: Reals) -> Reals:
        fit = motor_from_objects(**{self.kind.name: (self.model[rows], self.seen[rows])})
        return np.asarray(fit.motor, float)


def _cost(numbers: Any) -> float:
    return float(numbers[1]) if numbers[3] and np.isfinite(numbers[1]) else np.inf
