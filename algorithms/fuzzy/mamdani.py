"""Mamdani inference."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals
from .base import one_of
from .inference import Inference
from .program import Program
from .rules import Rule
from .sets import DEFUZZIFIERS, FuzzyVariable, instances
from .status import FuzzyStatus
from .tables import OutputTables
from .unequal import tables_of
from .workspace import Workspace


@dataclass(frozen=True)
class Mamdani(Inference):
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
    default : float, None or tuple of them, optional
        The value of all outputs, or of each, where no rule fires; None for NaN.

    Raises
    ------
    TypeError
        If a part has another type.
    ValueError
        If names are unknown or not unique, there is no rule, a method is unknown, or a default is outside its range.
    """

    inputs: tuple[FuzzyVariable, ...]
    outputs: tuple[FuzzyVariable, ...]
    rules: tuple[Rule, ...]
    defuzzify: str | tuple[str, ...] = "centroid"
    conjunction: str = "min"
    disjunction: str = "max"
    implication: str = "min"
    default: float | tuple[float | None, ...] | None = None

    _functions: ClassVar[bool] = False

    def __post_init__(self) -> None:
        self._check(FuzzyVariable)
        count, by = len(self.outputs), self.defuzzify
        methods = (by,) * count if isinstance(by, str) else instances(by, str, "defuzzify")
        if len(methods) != count:
            raise ValueError(f"defuzzify: {len(methods)} methods; expected one, or one for each of {count} outputs")
        for method in methods:
            one_of("defuzzify", method, DEFUZZIFIERS)
        self._set("defuzzify", methods)
        one_of("implication", self.implication, ("min", "product"))

    def _methods(self) -> tuple[str, ...]:
        return tuple(self.defuzzify)

    def _implication(self) -> str:
        return self.implication

    @cached_property
    def _cuts_program(self) -> Program:
        return self._program([
            [(rule.condition, c.weight) for rule in self.rules for c in rule.conclusions
             if (c.variable, c.set) == (output.name, one.name)]
            for output in self.outputs for one in output.sets
        ])  # fmt: skip

    @cached_property
    def _tables(self) -> tuple[OutputTables, ...]:
        return tuple(tables_of(output, self.implication == "product") for output in self.outputs)

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


def grasp_controller() -> Mamdani:
    """Read the rule base of a hand that closes around an object, as in section 20.7 (`grasp_controller.rules`)."""
    return Mamdani.read(Path(__file__).with_name("grasp_controller.rules"))
