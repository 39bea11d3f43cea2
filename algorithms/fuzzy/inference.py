"""What Mamdani and Sugeno inference have in common: texts, inputs, strengths of rules, and batches."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, real_array
from .base import RuleBase
from .inputs import InputTables
from .program import Program, program_of
from .rules import can_fire
from .status import FuzzyStatus
from .text import parse
from .workspace import Workspace
from .writing import write

_CHUNK = 4096
"""Number of elements of a batch that are handled at once, so that tables remain in the cache."""


@dataclass(frozen=True, eq=False)
class FuzzyOutput:
    """Values of the outputs of a rule base.

    Attributes
    ----------
    values : array, (..., outputs)
        NaN if the status says that there is none, or the default of the output if no rule fires.
    status : int array, (..., outputs)
        `FuzzyStatus`
    """

    values: Reals
    status: NDArray[Any]


_Self = TypeVar("_Self", bound="Inference")


class Inference(RuleBase):
    """A rule base that is evaluated by `generated.fuzzy`; see `Mamdani` and `Sugeno`."""

    _functions: ClassVar[bool]
    """Whether rules conclude functions, and not sets."""

    @classmethod
    def parse(cls: type[_Self], text: str) -> _Self:
        """Read a rule base from text; see `algorithms.fuzzy.text`.

        Raises
        ------
        TypeError
            If `text` is not a string.
        ValueError
            If the text cannot be read. The message has the number of the line, what was found, and what was expected.
        """
        return cls(**parse(text, cls._functions))

    @classmethod
    def read(cls: type[_Self], path: str | Path) -> _Self:
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
        return write(self, self._methods(), self._implication())

    def _methods(self) -> tuple[str, ...]:
        """Return the method of each output for a text, or nothing."""
        return ()

    def _implication(self) -> str | None:
        return None

    @cached_property
    def _numbers(self) -> dict[tuple[str, str], int]:
        names = [(variable.name, one.name) for variable in self.inputs for one in variable.sets]
        return {name: k for k, name in enumerate(names)}

    def _program(self, results: Sequence[Any]) -> Program:
        return program_of(results, self._numbers, self.conjunction, self.disjunction)

    @cached_property
    def _rules_program(self) -> Program:
        return self._program([[(rule.condition, 1.0)] for rule in self.rules])

    @cached_property
    def _input_tables(self) -> InputTables:
        return InputTables(self.inputs)

    @property
    def rule_status(self) -> NDArray[np.int_]:
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
        for part, work in parts_of_batch(len(rows)):
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
        for part, work in parts_of_batch(len(rows)):
            self._fill(rows[part], work, values[part], status[part])
        for k, default in enumerate(self.defaults):
            if default is not None:
                values[status[:, k] == FuzzyStatus.NO_RULE_FIRES, k] = default
        shape = *x.shape[:-1], len(self.outputs)
        return FuzzyOutput(values.reshape(shape), status.reshape(shape))

    def _fill(self, rows: Reals, work: Workspace, values: Reals, status: NDArray[np.int64]) -> None:
        """Write the values and statuses of inputs (n, inputs) to arrays (n, outputs)."""
        raise NotImplementedError


def parts_of_batch(count: int) -> Iterator[tuple[slice, Workspace]]:
    """Iterate over the parts of a batch, with arrays for intermediate results that all of them use."""
    work = Workspace(min(count, _CHUNK))
    for start in range(0, count, _CHUNK):
        yield slice(start, start + _CHUNK), work
