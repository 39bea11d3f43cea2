"""Traced functions, represented by the expressions that they returned, for pickling."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..algebra.multivector import Multivector
from ..errors import KernelError
from .expression import Expression, evaluate, lift, topological


@dataclass(frozen=True, slots=True)
class Traced:
    """A kernel's function, represented by its result on symbols.

    Attributes
    ----------
    symbols : tuple
        The arguments that the function was called with: expressions, or nested tuples of expressions.
    value : Expression or nested tuple
        The result.
    """

    symbols: tuple[Any, ...]
    value: Any

    def __call__(self, *arguments: Any) -> Any:
        """Return the value with the symbols replaced by `arguments`.

        Raises
        ------
        KernelError
            If the number of arguments differs, or an argument has blades that its symbol does not have. The
            expressions are valid only for the blades of the symbols.
        """
        if len(arguments) != len(self.symbols):
            raise KernelError("a traced kernel", f"{len(arguments)} arguments", str(len(self.symbols)))
        pairs = list(zip(leaves(self.symbols), leaves(arguments), strict=True))
        if all(symbol is argument for symbol, argument in pairs):
            return self.value
        for symbol, argument in pairs:
            blades = argument.blades if isinstance(argument, (Expression, Multivector)) else frozenset({0})
            if not blades <= symbol.blades:
                raise KernelError("a traced kernel", f"{argument} for {symbol}", f"blades of {symbol.data.layout}")
        values = [lift(each) for each in leaves(self.value)]
        if any(isinstance(argument, Expression) for _, argument in pairs):
            found: list[Any] = substituted(values, {symbol: lift(argument) for symbol, argument in pairs})
        else:
            known = {symbol: symbol.data.layout.algebra.scalar(0).lift(argument) for symbol, argument in pairs}
            found = evaluate(values, {}, known)
        return _like(self.value, iter(found))


def substituted(expressions: Sequence[Expression], by: Mapping[Expression, Expression]) -> list[Expression]:
    """Replace subexpressions by others."""
    memory = dict(by)
    for each in topological(expressions, memory):
        arguments = tuple(memory[argument] for argument in each.arguments)
        same = all(a is b for a, b in zip(arguments, each.arguments, strict=True))
        memory[each] = each if same else Expression(each.operation, arguments, each.data, each.algebra)
    return [memory[expression] for expression in expressions]


def leaves(value: Any) -> Iterator[Any]:
    """Yield the leaves of nested sequences, in order."""
    if isinstance(value, (tuple, list)):
        for each in value:
            yield from leaves(each)
    else:
        yield value


def _like(shape: Any, flat: Iterator[Any]) -> Any:
    return tuple(_like(each, flat) for each in shape) if isinstance(shape, (tuple, list)) else next(flat)
