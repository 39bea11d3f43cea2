"""Mamdani inference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import fuzzy as kernels

from ..arguments import Reals, real_array
from .fuzzy_base import RuleBase
from .fuzzy_program import Program, program_of
from .fuzzy_rules import can_fire
from .fuzzy_status import FuzzyStatus
from .fuzzy_tables import OutputTables
from .fuzzy_text import parse, write

_CHUNK = 2048
"""Number of elements of a batch that are handled at once, so that tables remain in the cache."""


@dataclass(frozen=True, eq=False)
class FuzzyOutput:
    """Values of the outputs of a rule base.

    Attributes
    ----------
    values : array, (..., outputs)
        NaN if the status says that there is none.
    status : int array, (..., outputs)
        `FuzzyStatus`
    """

    values: Reals
    status: NDArray[Any]


@dataclass(frozen=True)
class Mamdani(RuleBase):
    """A rule base for Mamdani inference.

    The strength of a rule is the membership of the inputs in its condition, times the weight of the conclusion. The
    set of a conclusion is clipped at the largest strength of its rules, or multiplied by it, and the output is a
    number of the union of these sets, as in scikit-fuzzy.

    Parameters
    ----------
    inputs, outputs : tuple of FuzzyVariable
    rules : tuple of Rule
    defuzzify : str or tuple of str
        ``"centroid"``, ``"bisector"``, ``"mom"``, ``"som"`` or ``"lom"``, of all outputs or of each.
    conjunction : str
        ``"min"`` or ``"product"``
    disjunction : str
        ``"max"``, or ``"sum"`` for the probabilistic sum ``a + b - a b``.
    implication : str
        ``"min"`` clips sets, ``"product"`` multiplies them.

    Raises
    ------
    ValueError
        If names are unknown or not unique, there is no rule, or a method is unknown.
    """

    @classmethod
    def parse(cls, text: str) -> Mamdani:
        """Read a rule base from text; see `fuzzy_text`.

        Raises
        ------
        ValueError
            With the number of the line, if the text cannot be read.
        """
        base = parse(text)
        return cls(**{one.name: getattr(base, one.name) for one in fields(base)})

    @classmethod
    def read(cls, path: str | Path) -> Mamdani:
        """Read a rule base from a text file in UTF-8."""
        return cls.parse(Path(path).read_text(encoding="utf-8"))

    def to_text(self) -> str:
        """Write the rule base as text, from which `parse` reads an equal one."""
        return write(self)

    @cached_property
    def _numbers(self) -> dict[tuple[str, str], int]:
        names = [(variable.name, one.name) for variable in self.inputs for one in variable.sets]
        return {name: k for k, name in enumerate(names)}

    def _program(self, results: Sequence[Any]) -> Program:
        return program_of(results, self._numbers, self.conjunction, self.disjunction)

    @cached_property
    def _cuts_program(self) -> Program:
        return self._program([
            [(rule.condition, c.weight) for rule in self.rules for c in rule.conclusions
             if (c.variable, c.set) == (output.name, one.name)]
            for output in self.outputs for one in output.sets
        ])  # fmt: skip

    @cached_property
    def _rules_program(self) -> Program:
        return self._program([[(rule.condition, 1.0)] for rule in self.rules])

    @cached_property
    def _variable(self) -> NDArray[np.int64]:
        return np.repeat(np.arange(len(self.inputs)), [len(one.sets) for one in self.inputs])

    @cached_property
    def _tables(self) -> tuple[OutputTables, ...]:
        return tuple(OutputTables(output, self.implication == "product") for output in self.outputs)

    @cached_property
    def _slopes(self) -> tuple[Reals, ...]:
        return tuple(np.diff(one.memberships, axis=0) / np.diff(one.places)[:, None] for one in self.inputs)

    @property
    def rule_status(self) -> NDArray[Any]:
        """For each rule, `FuzzyStatus`: OK, or RULE_NEVER_FIRES if no input in the ranges gives it a strength."""
        inputs = {one.name: one for one in self.inputs}
        never = int(FuzzyStatus.RULE_NEVER_FIRES)
        return np.array([0 if can_fire(rule, inputs) else never for rule in self.rules])

    def _inputs(self, inputs: ArrayLike | Mapping[str, ArrayLike]) -> Reals:
        if not isinstance(inputs, Mapping):
            return real_array(inputs, "inputs", (len(self.inputs),), "one number for each input").astype(float)
        names = [one.name for one in self.inputs]
        if set(inputs) != set(names):
            raise ValueError(f"inputs: {', '.join(map(str, inputs))}; expected {', '.join(names)}")
        return np.stack(np.broadcast_arrays(*(real_array(inputs[name], name).astype(float) for name in names)), -1)

    def _run(self, x: Reals, program: Program) -> Reals:
        """Return the results (n, m) of a program for finite inputs (n, inputs) in the ranges."""
        offsets, heights, slopes = np.empty(x.shape), [], []
        for k, (variable, slope) in enumerate(zip(self.inputs, self._slopes, strict=True)):
            scale = (variable.samples - 1) / (variable.high - variable.low)
            cell = ((x[:, k] - variable.low) * scale).astype(np.int64)
            np.minimum(cell, variable.samples - 2, out=cell)
            offsets[:, k] = x[:, k] - variable.places[cell]
            heights.append(variable.memberships.take(cell, 0))
            slopes.append(slope.take(cell, 0))
        found = kernels.strengths(
            offsets, np.concatenate(heights, 1), np.concatenate(slopes, 1), self._variable, program.literals,
            program.rows, program.ends,
        )  # fmt: skip
        return np.asarray(found)

    def _clipped(self, x: Reals) -> tuple[Reals, NDArray[np.bool_], NDArray[np.bool_]]:
        """Return inputs in the ranges, whether they are finite, and whether they were in the ranges."""
        low, high = np.array([[one.low, one.high] for one in self.inputs]).T
        finite = np.asarray(np.isfinite(x).all(-1))
        clipped = np.clip(np.where(finite[:, None], x, low), low, high)
        return clipped, finite, np.asarray((clipped == x).all(-1))

    def strengths(self, inputs: ArrayLike | Mapping[str, ArrayLike]) -> Reals:
        """Compute the strengths of the rules, before weights.

        Parameters
        ----------
        inputs : array_like, (..., inputs), or mapping from names to arrays

        Returns
        -------
        array, (..., rules)
            NaN where an input is not finite.
        """
        x = self._inputs(inputs)
        clipped, finite, _ = self._clipped(x.reshape(-1, x.shape[-1]))
        found = self._run(clipped, self._rules_program)
        found[~finite] = np.nan
        return found.reshape(*x.shape[:-1], len(self.rules))

    def cuts(self, inputs: ArrayLike | Mapping[str, ArrayLike]) -> Reals:
        """Compute the strengths (..., sets) of all sets of the outputs, in order; NaN where an input is not finite."""
        x = self._inputs(inputs)
        clipped, finite, _ = self._clipped(x.reshape(-1, x.shape[-1]))
        found = self._run(clipped, self._cuts_program)
        found[~finite] = np.nan
        return found.reshape(*x.shape[:-1], found.shape[-1])

    def evaluate(self, inputs: ArrayLike | Mapping[str, ArrayLike]) -> FuzzyOutput:
        """Compute the outputs.

        Parameters
        ----------
        inputs : array_like, (..., inputs), or mapping from names to arrays
            Inputs outside their ranges are replaced by the nearest ones inside.

        Returns
        -------
        FuzzyOutput
        """
        x = self._inputs(inputs)
        rows = x.reshape(-1, x.shape[-1])
        values, status = np.empty((len(rows), len(self.outputs))), np.empty((len(rows), len(self.outputs)), np.int64)
        for start in range(0, len(rows), _CHUNK):
            part = slice(start, start + _CHUNK)
            values[part], status[part] = self._evaluated(rows[part])
        shape = *x.shape[:-1], len(self.outputs)
        return FuzzyOutput(values.reshape(shape), status.reshape(shape))

    def _evaluated(self, rows: Reals) -> tuple[Reals, NDArray[np.int64]]:
        clipped, finite, inside = self._clipped(rows)
        cuts = self._run(clipped, self._cuts_program)
        values, status = [], []
        first = 0
        for output, table, method in zip(self.outputs, self._tables, self.defuzzify, strict=True):
            own = np.ascontiguousarray(cuts[:, first : first + len(output.sets)])
            first += len(output.sets)
            found, fires = _defuzzified(table, own, method)
            state = np.where(inside, int(FuzzyStatus.OK), int(FuzzyStatus.CLIPPED))
            state[~fires] = FuzzyStatus.NO_RULE_FIRES
            state[~finite] = FuzzyStatus.NOT_FINITE
            found[~fires | ~finite] = np.nan
            values.append(found)
            status.append(state)
        return np.stack(values, -1), np.stack(status, -1)


def _defuzzified(table: OutputTables, cuts: Reals, method: str) -> tuple[Reals, NDArray[np.bool_]]:
    """Return numbers of unions, and whether the unions are not empty."""
    if method == "centroid":
        area, moment = table.areas(cuts)
        fires = np.asarray(area > 0)
        return np.asarray(moment / np.where(fires, area, 1)), fires
    fires = np.asarray((cuts > 0).any(1))
    if method == "bisector":
        return table.bisectors(cuts), fires
    return np.array(table.maxima(cuts)[("mom", "som", "lom").index(method)]), fires


def grasp_controller() -> Mamdani:
    """Read the rule base of a hand that closes around an object, as in section 20.7 (`grasp_controller.rules`)."""
    return Mamdani.read(Path(__file__).with_name("grasp_controller.rules"))
