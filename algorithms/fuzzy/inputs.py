"""The tables of the inputs of a rule base for the kernels of `generated.fuzzy`, and the strengths of its rules."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from generated import fuzzy as kernels

from ..arguments import Reals
from .program import Program
from .sets import FuzzyVariable
from .status import FuzzyStatus
from .workspace import Workspace

_EPS = float(np.finfo(float).eps)


class Located(NamedTuple):
    """Inputs of a batch, and where they are in the tables."""

    clipped: Reals
    """The inputs (n, inputs) in their ranges; NaN counts as the lower end."""
    inside: NDArray[np.bool_]
    """Whether each input (n, inputs) was in its range."""
    table: Reals
    """For each input, the row of the place below it."""
    status: NDArray[np.int64]
    """`FuzzyStatus` (n,)"""


class InputTables:
    """The inputs of a rule base, prepared for the computation of strengths.

    Parameters
    ----------
    inputs : sequence of FuzzyVariable
    """

    def __init__(self, inputs: Sequence[FuzzyVariable]) -> None:
        width = 1 + max(len(one.sets) for one in inputs)
        total = sum(one.samples for one in inputs)
        self._rows = np.zeros((total, width, 2))
        ranges, first = [], 0
        self._unequal = [(k, one.places) for k, one in enumerate(inputs) if one.grid]
        self._firsts = np.cumsum([0, *(one.samples for one in inputs[:-1])])
        for one in inputs:
            rows, sets = self._rows[first : first + one.samples], len(one.sets)
            rows[:, 0, 0] = one.places
            rows[:, 1 : 1 + sets, 0] = one.memberships
            # The last place has a row of its own, so that memberships of all places are exact.
            rows[:-1, 1 : 1 + sets, 1] = np.diff(one.memberships, axis=0) / np.diff(one.places)[:, None]
            scale = (one.samples - 1) / (one.high - one.low)
            # Rounding errors must not assign a place to the row before it.
            errors = min(4 * _EPS * (max(abs(one.low), abs(one.high)) * scale + one.samples), 0.25)
            ranges.append((one.low, one.high, scale, first + errors, first + one.samples - 1))
            first += one.samples
        self._ranges = np.array(ranges, float)
        self._place = np.arange(len(inputs)) * width
        members = [(k, k * width + 1 + j) for k, one in enumerate(inputs) for j in range(len(one.sets))]
        variable, member = np.array(members, np.int64).T
        self._variable, self._member = np.ascontiguousarray(variable), np.ascontiguousarray(member)

    def locate(self, x: Reals, work: Workspace) -> Located:
        """Find the rows of inputs (n, inputs)."""
        n, count = x.shape
        clipped, rows, inside = kernels.rows_of_inputs(x, self._ranges)
        whole = work.indices("input rows", n, count)
        np.copyto(whole, rows, casting="unsafe")
        for k, places in self._unequal:
            whole[:, k] = self._firsts[k] + np.searchsorted(places, clipped[:, k], "right") - 1
        table = work.array("inputs", n, count, *self._rows.shape[1:])
        self._rows.take(whole, 0, out=table, mode="clip")
        status = np.zeros(n, np.int64)
        if not inside.all():
            status[inside < 1] = FuzzyStatus.CLIPPED
            status[~np.isfinite(x).all(1)] = FuzzyStatus.NOT_FINITE
        return Located(np.asarray(clipped), np.asarray(clipped == x), table.reshape(n, -1, 2), status)

    def strengths_at(self, found: Located, program: Program) -> Reals:
        """Return the results (n, m) of a program."""
        return np.asarray(kernels.strengths(found.clipped, found.table, *self._arguments(program)))

    def gradients_at(self, found: Located, program: Program, weights: Reals) -> Reals:
        """Return the derivatives (n, inputs) of sums of the results of a program, with weights (n, m)."""
        _, slopes = kernels.strengths_vjp_x(  # type: ignore[call-overload]
            found.clipped, found.table, *self._arguments(program), weights
        )
        return np.asarray(slopes)

    def _arguments(self, program: Program) -> tuple[NDArray[np.generic], ...]:
        return self._place, self._member, self._variable, program.literals, program.rows, program.ends

    def strengths(self, x: Reals, program: Program, work: Workspace) -> tuple[Reals, NDArray[np.int64]]:
        """Return the results (n, m) of a program for inputs (n, inputs), and `FuzzyStatus` (n,) of the inputs.

        Inputs outside their ranges count as the nearest ones inside, and NaN as the lower end.
        """
        found = self.locate(x, work)
        return self.strengths_at(found, program), found.status
