"""Repeated evaluation of expressions over any ring.

The values are those of `evaluate`. Kernels on matrices consist of thousands of operations on scalars. They are applied
here to bare coefficients: a multivector for each would take ten times as long as its coefficient.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ..algebra.coefficients import is_zero, scalar_function
from ..algebra.layout import SCALARS
from ..algebra.meanings import ARITHMETIC
from ..algebra.multivector import Multivector
from ..algebra.operations import SCALAR_FUNCTIONS
from .expression import IS_EXACT, Expression, apply_operation, topological

Value = Any
"""A multivector; for expressions of the algebra of scalars its coefficient, or None for an exact zero."""


class Evaluation:
    """Expressions prepared for evaluation at many points: every argument is a position in one list of values.

    Parameters
    ----------
    expressions : sequence of Expression
    """

    def __init__(self, expressions: Sequence[Expression]) -> None:
        order = topological(expressions)
        places = {expression: k for k, expression in enumerate(order)}
        self._steps = [(each, _scalar_step(each), tuple(places[a] for a in each.arguments)) for each in order]
        self._results = [places[expression] for expression in expressions]

    def run(
        self,
        inputs: Mapping[str, Any],
        lift: Callable[[Any], Any] | None = None,
        values: list[Value] | None = None,
        check: Callable[[Any], None] | None = None,
    ) -> list[Multivector]:
        """Return the values of the expressions.

        Parameters
        ----------
        inputs : mapping of str to coefficient
        lift : callable, optional
            Converts exact constants to the ring of the inputs, as for `evaluate`.
        values : list, optional
            The values of the first steps. Those of the other steps are appended, also if one of them raises an error.
        check : callable, optional
            Called with every coefficient that is computed. It may raise an error.
        """
        values = [] if values is None else values
        for expression, step, at in self._steps[len(values) :]:
            if step is None:
                value = self._general(expression, [values[k] for k in at], inputs, lift)
            else:
                value = step(*[values[k] for k in at])
                if value is not None and is_zero(value):
                    value = None
                elif lift is not None and expression.operation in IS_EXACT:
                    value = lift(value)
            if check is not None and value is not None:
                for number in value.terms.values() if isinstance(value, Multivector) else (value,):
                    check(number)
            values.append(value)
        return [_multivector(self._steps[k][0], values[k]) for k in self._results]

    def _general(
        self,
        expression: Expression,
        values: list[Value],
        inputs: Mapping[str, Any],
        lift: Callable[[Any], Any] | None,
    ) -> Value:
        arguments = [_multivector(each, value) for each, value in zip(expression.arguments, values, strict=True)]
        found = apply_operation(expression, arguments, inputs, lift)
        return found.terms.get(0) if expression.algebra is SCALARS else found


def convert(values: Sequence[Value], function: Callable[[Any], Any]) -> list[Value]:
    """Apply a function to the coefficients of values, for which exact zeros remain."""
    return [
        None if value is None else value.map(function) if isinstance(value, Multivector) else function(value)
        for value in values
    ]


def _multivector(expression: Expression, value: Value) -> Multivector:
    if expression.algebra is not SCALARS:
        return value  # type: ignore[no-any-return]
    return Multivector(SCALARS, {} if value is None else {0: value})


def _scalar_step(expression: Expression) -> Callable[..., Value] | None:
    """Return an operation on scalars as a function of their coefficients; None for all other operations."""
    operation = expression.operation
    if expression.algebra is not SCALARS or any(each.algebra is not SCALARS for each in expression.arguments):
        return None
    if operation in _FUNCTIONS:
        name = operation.value
        return lambda *values: scalar_function(name, *[0 if value is None else value for value in values])
    return ARITHMETIC.get(operation)


_FUNCTIONS = frozenset(SCALAR_FUNCTIONS)
