"""The recorded form of a kernel with loops: tables of multivectors, and statements that are not yet compiled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..algebra.operations import Operation
from ..ir.procedure import Add, Clear, Copy, Loop, Place, Repeat, Storage, Table
from ..ir.rows import Row
from .expression import Expression, topological
from .kernel import Kernel
from .rows import Leaf, Rows


@dataclass(frozen=True, slots=True)
class Record:
    """A table and the multivectors in each of its rows: a single one, or an array of fixed shape."""

    name: str
    lengths: tuple[str, ...]
    leaves: tuple[Leaf, ...]
    storage: Storage
    shape: tuple[int, ...]
    shared: bool = False
    scope: int = 0
    """The number of the scope in which its rows are visible."""

    @property
    def leaf(self) -> Leaf:
        """The first multivector of a row, which is the only one in tables of intermediate results."""
        return self.leaves[0]

    @property
    def arrays(self) -> list[Rows]:
        """The arrays of all rows of the table, one for each multivector in a row."""
        return [Rows.whole(self.name, self.lengths, leaf) for leaf in self.leaves]

    @property
    def table(self) -> Table:
        """The table as it is represented in procedures."""
        return Table(self.name, self.lengths, self.shape, self.storage, self.shared)


@dataclass(frozen=True, slots=True)
class Source:
    """The location of the value of a symbol: a multivector in a row of a table."""

    place: Place
    leaf: Leaf
    depth: int
    """The number of loops that enclose the symbol's scope."""
    scope: int
    """The number of that scope."""


@dataclass(frozen=True, slots=True)
class Compute:
    """A statement that computes the results of a kernel and writes them to places, one multivector after the other.

    Attributes
    ----------
    kernel : Kernel
    sources : tuple of Source
        The locations of the arguments, in the order of the kernel's parameters.
    names : tuple of str
        The names of the arguments in the author's function.
    targets : tuple of (Place, Leaf)
        The locations of the results, in order.
    """

    kernel: Kernel
    sources: tuple[Source, ...]
    names: tuple[str, ...]
    targets: tuple[tuple[Place, Leaf], ...]


Recorded = Compute | Add | Copy | Clear | Loop | Repeat


def computes(body: Sequence[Recorded]) -> list[Compute]:
    """Return the straight-line parts, in the order of the text."""
    found = []
    for statement in body:
        if isinstance(statement, Compute):
            found.append(statement)
        elif isinstance(statement, (Loop, Repeat)):
            found += computes(statement.body)  # type: ignore[arg-type]
    return found


def targets_in(tables: Sequence[Rows], row: Row = None) -> list[tuple[Place, Leaf]]:
    """Return the targets of results that are written to a row of the given tables."""
    return [(Place(rows.table, row), rows.leaf) for rows in tables]


def is_constant(expression: Expression) -> bool:
    """Return whether an expression contains no symbols."""
    return all(node.operation is not Operation.INPUT for node in topological([expression]))


_FREE = frozenset(
    {
        Operation.NEGATE,
        Operation.REVERSE,
        Operation.GRADE_INVOLUTION,
        Operation.CLIFFORD_CONJUGATE,
        Operation.GRADE,
        Operation.COEFFICIENT,
    }
)
"""Unary operations without arithmetic. Storing their values in a table would lose the relation to their argument."""


def worth_storing(expression: Expression) -> Sequence[Expression]:
    """Return the expression that is worth storing in place of `expression`: its argument under operations without cost.

    The result is empty if that is a symbol or a constant.
    """
    while expression.operation in _FREE:
        (expression,) = expression.arguments
    return () if expression.operation in (Operation.INPUT, Operation.CONSTANT) else (expression,)
