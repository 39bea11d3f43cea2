"""Random inputs of kernels with loops (lengths, index tables and elements), and the values of the function there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import cycle
from random import Random
from typing import Any

import mpmath

from ..frontend.expression import Expression
from ..frontend.kernel import Kernel, trace
from ..frontend.loop_trace import unrolled
from ..frontend.rows import IndexOf, RowsOf
from ..frontend.unrolled import steps_limited
from ..ir.procedure import Procedure, Storage
from .samples import SPREADS, Meaning, is_real, sample

Rows = list[list[Any]]


@dataclass(frozen=True, slots=True)
class Case:
    """A kernel with loops for arrays of known lengths.

    Attributes
    ----------
    kernel : Kernel
    lengths : mapping of str to int
    indices : mapping of str to tuple of int
        The contents of the index tables, tuples of integers for rows of several columns.
    flat : Kernel
        An equivalent kernel without loops. It returns the results row by row.
    """

    kernel: Kernel
    lengths: Mapping[str, int]
    indices: Mapping[str, tuple[Any, ...]]
    flat: Kernel

    @classmethod
    def of(cls, kernel: Kernel, procedure: Procedure, lengths: Mapping[str, int], random: Random) -> Case:
        """Create a case with valid random index tables."""
        indices = index_tables(procedure, lengths, random)
        return cls(kernel, lengths, indices, unrolled(kernel, lengths, indices))

    def arguments(self, inputs: Mapping[str, Any]) -> dict[str, Rows]:
        """Return the rows of arguments and index tables from the coefficients of the kernel without loops."""
        found: dict[str, Rows] = {
            name: [list(k) if isinstance(k, tuple) else [k] for k in table] for name, table in self.indices.items()
        }
        remaining = iter(self.flat.parameters)
        for parameter in self.kernel.parameters:
            if isinstance(parameter.type, IndexOf):
                continue
            numbers = [inputs[name] for name in next(remaining).components]
            count = 1
            for name in parameter.type.lengths if isinstance(parameter.type, RowsOf) else ():
                count *= self.lengths[name]
            step = len(numbers) // count
            found[parameter.name] = [numbers[k * step : (k + 1) * step] for k in range(count)]
        return found

    def expressions(self, most_steps: int) -> tuple[Expression, ...]:
        """Return the results of the kernel without loops, with at most `most_steps` steps of each iteration."""
        with steps_limited(most_steps):
            return trace(self.flat).expressions

    def points(
        self, expressions: Sequence[Expression], random: Random, n: int
    ) -> Iterator[tuple[dict[str, Rows], list[Any]]]:
        """Yield up to `n` points at which the function is defined: the arguments and the values of the expressions."""
        found = 0
        meaning = Meaning(expressions)
        for spread, _ in zip(cycle(SPREADS), range(8 * n), strict=False):
            inputs = sample(self.flat, random, spread=spread)
            try:
                values = meaning.at(inputs)
            except (ZeroDivisionError, ValueError, mpmath.libmp.ComplexResult):
                continue
            if all(is_real(value) for multivector in values for value in multivector.terms.values()):
                yield self.arguments(inputs), values
                found += 1
                if found == n:
                    return

    def near_one(self, random: Random) -> dict[str, Rows]:
        """Return the rows of ordinary random elements, as exact numbers."""
        return self.arguments(sample(self.flat, random, near_one=True))


def consecutive(names: Sequence[str], n: int) -> dict[str, int]:
    """Return consecutive lengths from `n`."""
    return {name: n + k for k, name in enumerate(names)}


def few_rows(names: Sequence[str]) -> list[dict[str, int]]:
    """Return small lengths for three comparisons.

    Each length takes three values in an order of its own. Any two lengths differ in at least two comparisons, so that
    one of them cannot stand for the other. The first six take 1, 2 and 3, and each further six are 3 larger.
    """
    orders = [(n, n % 3 + 1, (n + 1) % 3 + 1) for n in (1, 2, 3)]
    orders += [order[::-1] for order in orders]
    return [{name: orders[k % 6][case] + 3 * (k // 6) for k, name in enumerate(names)} for case in range(3)]


def index_tables(procedure: Procedure, lengths: Mapping[str, int], random: Random) -> dict[str, tuple[Any, ...]]:
    """Return random index tables that are valid: parents precede their rows, and rows that are read exist."""
    found: dict[str, tuple[Any, ...]] = {}
    for table in procedure.of(Storage.INDEX):
        (length,) = table.lengths
        first = 0 if table.name in procedure.read_through else -1
        earlier = table.name in procedure.parent_tables or (table.into == length and first < 0)
        rows = range(lengths[length])
        if earlier and first == 0:  # The first row refers to itself, since there is no earlier row.
            found[table.name] = tuple(random.randint(0, max(0, k - 1)) for k in rows)
            continue
        if table.shape:
            found[table.name] = tuple(
                tuple(random.randint(first, lengths[table.into] - 1) for _ in range(table.size)) for _ in rows
            )
            continue
        found[table.name] = tuple(random.randint(first, k - 1 if earlier else lengths[table.into] - 1) for k in rows)
    return found


def in_doubles(arguments: Mapping[str, Rows]) -> dict[str, Rows]:
    """Round arguments to doubles; index tables are not changed."""
    return {
        name: [[x if isinstance(x, int) and not isinstance(x, Fraction) else float(x) for x in row] for row in rows]
        for name, rows in arguments.items()
    }
