"""Functions that are known by the expressions they gave: what takes the place of a function in a pickle."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..algebra.multivector import Multivector
from ..errors import KernelError
from .expression import Expression, evaluate, lift, topological


@dataclass(frozen=True, slots=True)
class Traced:
    """A kernel's function as its results on symbols.

    Attributes
    ----------
    symbols : tuple
        What the function was called with: expressions, or nested tuples of them.
    value : Expression or nested tuple
        What it gave.
    """

    symbols: tuple[Any, ...]
    value: Any

    def __call__(self, *arguments: Any) -> Any:
        """The value with `arguments` in place of the symbols.

        Raises
        ------
        KernelError
            When an argument has blades that its symbol has not: the expressions were chosen for those.
        """
        if len(arguments) != len(self.symbols):
            raise KernelError("a traced kernel", f"{len(arguments)} arguments", str(len(self.symbols)))
        pairs = list(zip(leaves(self.symbols), leaves(arguments), strict=True))
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
    """Expressions with others in place of some."""
    memory = dict(by)
    for each in topological(expressions, memory):
        arguments = tuple(memory[argument] for argument in each.arguments)
        same = all(a is b for a, b in zip(arguments, each.arguments, strict=True))
        memory[each] = each if same else Expression(each.operation, arguments, each.data, each.algebra)
    return [memory[expression] for expression in expressions]


def leaves(value: Any) -> Iterator[Any]:
    """What nested sequences hold, in order."""
    if isinstance(value, (tuple, list)):
        for each in value:
            yield from leaves(each)
    else:
        yield value


def _like(shape: Any, flat: Iterator[Any]) -> Any:
    return tuple(_like(each, flat) for each in shape) if isinstance(shape, (tuple, list)) else next(flat)
