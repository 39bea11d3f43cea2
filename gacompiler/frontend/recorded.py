"""What a kernel with loops is recorded as: tables of multivectors, and statements that are not compiled yet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..algebra.operations import Operation
from ..ir.procedure import Add, Clear, Copy, Loop, Place, Repeat, Row, Storage, Table
from .expression import Expression, topological
from .kernel import Kernel
from .rows import Leaf, Rows


@dataclass(frozen=True, slots=True)
class Record:
    """A table, and the multivectors in each of its rows: one, or those of an array of a fixed shape."""

    name: str
    lengths: tuple[str, ...]
    leaves: tuple[Leaf, ...]
    storage: Storage
    shape: tuple[int, ...]
    shared: bool = False
    scope: int = 0
    """The number of the scope in which its rows are known."""

    @property
    def leaf(self) -> Leaf:
        """The first multivector of a row, which is the only one in tables of intermediate results."""
        return self.leaves[0]

    @property
    def table(self) -> Table:
        """As procedures have it."""
        return Table(self.name, self.lengths, self.shape, self.storage, self.shared)


@dataclass(frozen=True, slots=True)
class Source:
    """Where the value of a symbol is: a multivector in a row of a table."""

    place: Place
    leaf: Leaf
    depth: int
    """How many loops enclose the symbol's scope."""
    scope: int
    """The number of that scope."""


@dataclass(frozen=True, slots=True)
class Compute:
    """Compute the results of a kernel, and write them to places, one multivector after the other.

    Attributes
    ----------
    kernel : Kernel
    sources : tuple of Source
        Where the arguments are, in the order of the kernel's parameters.
    names : tuple of str
        What the author's function calls the arguments.
    targets : tuple of (Place, Leaf)
        Where the results go, in their order.
    """

    kernel: Kernel
    sources: tuple[Source, ...]
    names: tuple[str, ...]
    targets: tuple[tuple[Place, Leaf], ...]


Recorded = Compute | Add | Copy | Clear | Loop | Repeat


def computes(body: Sequence[Recorded]) -> list[Compute]:
    """The straight-line parts, in the order of the text."""
    found = []
    for statement in body:
        if isinstance(statement, Compute):
            found.append(statement)
        elif isinstance(statement, (Loop, Repeat)):
            found += computes(statement.body)  # type: ignore[arg-type]
    return found


def targets_in(tables: Sequence[Rows], row: Row = None) -> list[tuple[Place, Leaf]]:
    """Where results go that are written to a row of tables."""
    return [(Place(rows.table, row), rows.leaf) for rows in tables]


def is_constant(expression: Expression) -> bool:
    """Whether an expression contains no symbol."""
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
"""Operations of one argument that take no arithmetic. A table of their values would lose how they are related."""


def worth_storing(expression: Expression) -> Sequence[Expression]:
    """The expression, or what it is a part of but for signs; none for that of a symbol or a constant."""
    while expression.operation in _FREE:
        (expression,) = expression.arguments
    return () if expression.operation in (Operation.INPUT, Operation.CONSTANT) else (expression,)
