"""Sugeno inference (Takagi, Sugeno and Kang)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import fuzzy as kernels

from ..arguments import Reals
from .functions import FunctionOutput
from .inference import Inference, parts_of_batch
from .program import Program
from .rules import Rule
from .sets import FuzzyVariable
from .status import FuzzyStatus
from .workspace import Workspace


class _Functions(NamedTuple):
    """The functions that rules conclude for one output, a row for each conclusion."""

    program: Program
    """Computes the weighted strengths."""
    constants: Reals
    slopes: Reals


@dataclass(frozen=True)
class Sugeno(Inference):
    """A rule base for Sugeno inference, of order 0 with constants, and of order 1 with affine functions.

    The strength of a rule is the membership of the inputs in its condition, times the weight of the conclusion. An
    output is the mean of the functions of its rules, weighted by the strengths. Rules that conclude the same function
    count separately.

    Parameters
    ----------
    inputs : tuple of FuzzyVariable
    outputs : tuple of FunctionOutput
    rules : tuple of Rule
        A `Conclusion` names an output and one of its functions.
    conjunction : str
        ``"min"`` or ``"product"``
    disjunction : str
        ``"max"``, or ``"sum"`` for the probabilistic sum ``a + b - a b``.
    default : float, None or tuple of them, optional
        The value of all outputs, or of each, where no rule fires; None for NaN.

    Raises
    ------
    TypeError
        If a part has another type.
    ValueError
        If names are unknown or not unique, there is no rule, or a method is unknown.
    """

    inputs: tuple[FuzzyVariable, ...]
    outputs: tuple[FunctionOutput, ...]
    rules: tuple[Rule, ...]
    conjunction: str = "min"
    disjunction: str = "max"
    default: float | tuple[float | None, ...] | None = None

    _functions: ClassVar[bool] = True

    def __post_init__(self) -> None:
        self._check(FunctionOutput)
        known = [one.name for one in self.inputs]
        for output in self.outputs:
            for function in output.functions:
                for name, _ in function.slopes:
                    if name not in known:
                        raise ValueError(
                            f"output {output.name}: function {function.name}: no input {name!r}; "
                            f"expected {', '.join(known)}"
                        )

    @cached_property
    def _concluded(self) -> tuple[_Functions, ...]:
        return tuple(self._functions_of(output) for output in self.outputs)

    def _functions_of(self, output: FunctionOutput) -> _Functions:
        ends = [(rule.condition, end) for rule in self.rules for end in rule.conclusions if end.variable == output.name]
        # An output that no rule concludes has one function with the strength 0.
        results = [[(condition, end.weight)] for condition, end in ends] or [[]]
        constants, slopes = np.zeros(len(results)), np.zeros((len(results), len(self.inputs)))
        number = {one.name: k for k, one in enumerate(self.inputs)}
        for k, (_, end) in enumerate(ends):
            function = output.functions[output.index(end.set)]
            constants[k] = function.constant
            for name, slope in function.slopes:
                slopes[k, number[name]] = slope
        return _Functions(self._program(results), constants, slopes)

    def _fill(self, rows: Reals, work: Workspace, values: Reals, status: NDArray[np.int64]) -> None:
        found = self._input_tables.locate(rows, work)
        for k, (program, *functions) in enumerate(self._concluded):
            strengths = self._input_tables.strengths_at(found, program)
            values[:, k], highest = kernels.mean_of_functions(strengths, found.clipped, *functions)
            status[:, k] = np.where(highest > 0, found.status, FuzzyStatus.NO_RULE_FIRES)
        status[found.status == FuzzyStatus.NOT_FINITE] = FuzzyStatus.NOT_FINITE
        # Affine functions of finite inputs may overflow.
        status[~np.isfinite(values)] = FuzzyStatus.NOT_FINITE
        values[status >= FuzzyStatus.NO_RULE_FIRES] = np.nan

    def gradient(self, inputs: ArrayLike | Mapping[str, ArrayLike]) -> Reals:
        """Compute the derivatives of the outputs with respect to the inputs.

        Memberships are linear between places, and minima and maxima have corners. At a place the derivative is that
        above it, and at the other corners that of one of the sides. Strengths below 1e-300 may make it infinite or NaN.

        Parameters
        ----------
        inputs : array_like, (..., inputs), or mapping from names to arrays
            As for `evaluate`.

        Returns
        -------
        array, (..., outputs, inputs)
            0 with respect to an input outside its range. NaN where no rule fires, also if there is a default, and where
            an input is not finite.

        Raises
        ------
        ValueError
            As for `evaluate`.
        """
        x = self._inputs(inputs)
        rows = x.reshape(-1, x.shape[-1])
        slopes = np.empty((len(rows), len(self.outputs), rows.shape[1]))
        for part, work in parts_of_batch(len(rows)):
            self._fill_derivatives(rows[part], work, slopes[part])
        return slopes.reshape(*x.shape[:-1], *slopes.shape[1:])

    def _fill_derivatives(self, rows: Reals, work: Workspace, slopes: Reals) -> None:
        """Write the derivatives for inputs (n, inputs) to an array (n, outputs, inputs)."""
        found = self._input_tables.locate(rows, work)
        for k, (program, *functions) in enumerate(self._concluded):
            strengths = self._input_tables.strengths_at(found, program)
            by_strength, by_input = kernels.slopes_of_mean(strengths, found.clipped, *functions)
            slopes[:, k] = by_input + self._input_tables.gradients_at(found, program, np.asarray(by_strength))
            slopes[~(strengths > 0).any(1), k] = np.nan
        slopes *= found.inside[:, None, :]
        slopes[found.status == FuzzyStatus.NOT_FINITE] = np.nan
