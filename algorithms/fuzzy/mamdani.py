"""Mamdani inference."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, real_array
from .base import RuleBase
from .inputs import InputTables
from .program import Program, program_of
from .rules import can_fire
from .status import FuzzyStatus
from .tables import OutputTables
from .text import parse, write
from .workspace import Workspace

_CHUNK = 4096
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
    TypeError
        If a part has another type.
    ValueError
        If names are unknown or not unique, there is no rule, or a method is unknown.
    """

    @classmethod
    def parse(cls, text: str) -> Mamdani:
        """Read a rule base from text; see `fuzzy_text`.

        Raises
        ------
        TypeError
            If `text` is not a string.
        ValueError
            If the text cannot be read. The message has the number of the line, what was found, and what was expected.
        """
        base = parse(text)
        return cls(**{one.name: getattr(base, one.name) for one in fields(base)})

    @classmethod
    def read(cls, path: str | Path) -> Mamdani:
        """Read a rule base from a text file in UTF-8; errors are those of `parse` and of reading files."""
        # Some editors begin files in UTF-8 with a byte order mark.
        return cls.parse(Path(path).read_text(encoding="utf-8-sig"))

    def to_text(self) -> str:
        """Write the rule base as text, from which `parse` reads an equal one.

        Raises
        ------
        ValueError
            If a name is not a word that a text can contain.
        """
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
    def _input_tables(self) -> InputTables:
        return InputTables(self.inputs)

    @cached_property
    def _tables(self) -> tuple[OutputTables, ...]:
        return tuple(OutputTables(output, self.implication == "product") for output in self.outputs)

    @property
    def rule_status(self) -> NDArray[Any]:
        """For each rule, `FuzzyStatus`: OK, or RULE_NEVER_FIRES if it changes no output for any input in the ranges."""
        never = int(FuzzyStatus.RULE_NEVER_FIRES)
        return np.array([0 if can_fire(rule, self.inputs, self.outputs) else never for rule in self.rules])

    def _inputs(self, inputs: ArrayLike | Mapping[str, ArrayLike]) -> Reals:
        if not isinstance(inputs, Mapping):
            return real_array(inputs, "inputs", (len(self.inputs),), "one number for each input").astype(float)
        names = [one.name for one in self.inputs]
        if set(inputs) != set(names):
            raise ValueError(f"inputs: {', '.join(map(str, inputs))}; expected {', '.join(names)}")
        arrays = [real_array(inputs[name], name).astype(float) for name in names]
        try:
            return np.stack(np.broadcast_arrays(*arrays), -1)
        except ValueError:
            shapes = ", ".join(f"{name} {array.shape}" for name, array in zip(names, arrays, strict=True))
            raise ValueError(f"inputs: shapes {shapes}; expected shapes that broadcast") from None

    def _results(self, inputs: ArrayLike | Mapping[str, ArrayLike], program: Program) -> Reals:
        """Return the results (..., m) of a program, NaN where an input is not finite."""
        x = self._inputs(inputs)
        rows = x.reshape(-1, x.shape[-1])
        found = np.empty((len(rows), len(program.ends)))
        for part, work in _parts(len(rows)):
            results, status = self._input_tables.strengths(rows[part], program, work)
            results[status == FuzzyStatus.NOT_FINITE] = np.nan
            found[part] = results
        return found.reshape(*x.shape[:-1], found.shape[-1])

    def strengths(self, inputs: ArrayLike | Mapping[str, ArrayLike]) -> Reals:
        """Compute the strengths of the rules, before weights.

        Parameters
        ----------
        inputs : array_like, (..., inputs), or mapping from names to arrays
            As for `evaluate`.

        Returns
        -------
        array, (..., rules)
            NaN where an input is not finite.

        Raises
        ------
        ValueError
            As for `evaluate`.
        """
        return self._results(inputs, self._rules_program)

    def cuts(self, inputs: ArrayLike | Mapping[str, ArrayLike]) -> Reals:
        """Compute the strengths at which the sets of the outputs are clipped.

        Parameters
        ----------
        inputs : array_like, (..., inputs), or mapping from names to arrays
            As for `evaluate`.

        Returns
        -------
        array, (..., sets)
            For all sets of all outputs, in order, the largest weighted strength of the rules that conclude it; NaN
            where an input is not finite.

        Raises
        ------
        ValueError
            As for `evaluate`.
        """
        return self._results(inputs, self._cuts_program)

    def evaluate(self, inputs: ArrayLike | Mapping[str, ArrayLike]) -> FuzzyOutput:
        """Compute the outputs.

        Parameters
        ----------
        inputs : array_like, (..., inputs), or mapping from names to arrays
            Arrays of a mapping broadcast. Inputs outside their ranges are replaced by the nearest ones inside.

        Returns
        -------
        FuzzyOutput

        Raises
        ------
        ValueError
            If the last axis does not have one number for each input, or names are missing or unknown.
        """
        x = self._inputs(inputs)
        rows = x.reshape(-1, x.shape[-1])
        shape = len(rows), len(self.outputs)
        values, status = np.empty(shape), np.empty(shape, np.int64)
        for part, work in _parts(len(rows)):
            self._fill(rows[part], work, values[part], status[part])
        shape = *x.shape[:-1], len(self.outputs)
        return FuzzyOutput(values.reshape(shape), status.reshape(shape))

    def _fill(self, rows: Reals, work: Workspace, values: Reals, status: NDArray[np.int64]) -> None:
        """Write the values and statuses of inputs (n, inputs) to arrays (n, outputs)."""
        cuts, state = self._input_tables.strengths(rows, self._cuts_program, work)
        status[:] = state[:, None]
        first = 0
        for k, (table, method) in enumerate(zip(self._tables, self.defuzzify, strict=True)):
            own = cuts[:, first : first + table.sets]
            first += table.sets
            values[:, k], fires = table.numbers(method, np.ascontiguousarray(own), work)
            if not fires.all():
                silent = ~fires & (state != FuzzyStatus.NOT_FINITE)
                status[silent, k] = FuzzyStatus.NO_RULE_FIRES
                values[~fires, k] = np.nan
        if state.any():
            values[state == FuzzyStatus.NOT_FINITE] = np.nan


def _parts(count: int) -> Iterator[tuple[slice, Workspace]]:
    """Iterate over the parts of a batch, with arrays for intermediate results that all of them use."""
    work = Workspace(min(count, _CHUNK))
    for start in range(0, count, _CHUNK):
        yield slice(start, start + _CHUNK), work


def grasp_controller() -> Mamdani:
    """Read the rule base of a hand that closes around an object, as in section 20.7 (`grasp_controller.rules`)."""
    return Mamdani.read(Path(__file__).with_name("grasp_controller.rules"))
