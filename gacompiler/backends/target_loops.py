"""Shared parts of the printers of further languages for kernels with loops: names, work space, and copies of rows.

A kernel with loops is a function of one element. Its parameters are the lengths, the arguments and index tables in
their order, the results, and the work space. Its straight-line parts are separate functions.
"""

from __future__ import annotations

from abc import abstractmethod
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ..ir.procedure import Place, Procedure, Storage, Table
from ..ir.program import Program
from .c_loop_names import renamed
from .c_loops import loop_parts
from .documentation import c_loop_comment
from .loop_statements import LoopWords, StatementText, product
from .module import LoopSource
from .printers import Names
from .targets import Language, LanguageNames


@dataclass(frozen=True, slots=True, kw_only=True)
class RowWords(LoopWords):
    """Notation of loops and conditions, including loops over the numbers of a row.

    Attributes
    ----------
    each : str
        The head of a loop of {k} over {size} numbers.
    """

    each: str


class RowText(StatementText):
    """Prints statements in which rows are copied and added number by number."""

    words: RowWords

    def __init__(self, named: Procedure, names: Names, functions: Mapping[str, str]) -> None:
        super().__init__(named, names)
        self._functions = functions
        self._k = names.fresh("k")

    def _copied(self, source: Place, target: Place) -> list[str]:
        return self._moved("{0} = {1};", source, target)

    def _summed(self, source: Place, target: Place) -> list[str]:
        return self._moved("{0} += {1};", source, target)

    def _moved(self, form: str, source: Place, target: Place) -> list[str]:
        table = self._procedure.table(target.table)
        return self._each(table, lambda k: form.format(self._entry(target, k), self._entry(source, k)))

    def _each(self, table: Table, statement: Callable[[str], str]) -> list[str]:
        """Return the lines that execute a statement for every number of a row."""
        if table.size == 1:
            return [statement("0")]
        return self._block(self.words.each.format(k=self._k, size=table.size), [statement(self._k)])

    def _value(self, place: Place) -> str:
        return self._entry(place, "0")

    def _entry(self, place: Place, k: str) -> str:
        """Return the text of a number of a row, which is the only one if the rows are scalars."""
        return self._chosen(place, lambda table, row: self._cell(table, row, k), lambda table: self._only(table, k))

    def _place(self, table: Table, row: str, k: str) -> str:
        """Return the text of the position of a number in a table of contiguous rows."""
        return row if table.size == 1 else f"{product(table.size, row)} + {k}"

    @abstractmethod
    def _cell(self, table: Table, row: str, k: str) -> str:
        """Return the text of the number `k` of the row `row`."""

    @abstractmethod
    def _only(self, table: Table, k: str) -> str:
        """Return the text of the number `k` of the only row of a table."""


@dataclass(frozen=True, slots=True)
class LoopNames:
    """The names of the functions of a kernel with loops.

    Attributes
    ----------
    own, work : str
        The function for one element, and the function that returns the size of its work space.
    parts : mapping of str to str
        The functions of its parts, by the names of their programs.
    """

    own: str
    work: str
    parts: Mapping[str, str]

    def inside(self, language: Language, *others: str) -> LanguageNames:
        """Return names for the variables of a function that calls these functions and others."""
        names = LanguageNames(language)
        for name in (self.own, self.work, *self.parts.values(), *others):
            names.fresh(name)
        return names


def loop_names(procedure: Procedure, own: str, names: LanguageNames, prefix: str = "") -> LoopNames:
    """Choose legal and distinct names for the functions of a kernel, whose own name is already chosen."""
    parts = {part.name: names.fresh(f"{prefix}{part.name}") for part in loop_parts(procedure)}
    return LoopNames(own, names.fresh(f"{own}_work"), parts)


def named_in(names: LanguageNames, procedure: Procedure) -> Procedure:
    """Rename lengths, tables and counters of a procedure for a language."""
    return renamed(procedure, names.fresh)


def long_work(procedure: Procedure) -> list[Table]:
    """Return the work tables in the work space; those of a single row are local variables."""
    return [table for table in procedure.of(Storage.WORK) if table.lengths]


def short_work(procedure: Procedure) -> list[Table]:
    """Return the work tables that are local variables."""
    return [table for table in procedure.of(Storage.WORK) if not table.lengths]


def numbers(table: Table) -> str:
    """Return the size of a table in numbers."""
    return product(table.size, *table.lengths)


def work_numbers(procedure: Procedure) -> str:
    """Return the size of the work space in numbers."""
    return _total(long_work(procedure))


def work_places(procedure: Procedure) -> list[tuple[Table, str]]:
    """Return the tables in the work space with their offsets."""
    tables = long_work(procedure)
    return [(table, _total(tables[:k])) for k, table in enumerate(tables)]


def _total(tables: Sequence[Table]) -> str:
    """Return the total size of tables in numbers: ``5 * n + 2 * n * m``."""
    sizes = Counter[tuple[str, ...]]()
    for table in tables:
        sizes[table.lengths] += table.size
    return " + ".join(product(size, *lengths) for lengths, size in sizes.items()) or "0"


def loop_comment(loop: LoopSource) -> str:
    """Return the comment above a kernel with loops: tables, work space, cost and error."""
    size = work_numbers(loop.procedure)
    use = "not used" if size == "0" else "for intermediate rows"
    return c_loop_comment(loop, f"work[{size}]  {use}.")


def loop_comment_lines(loop: LoopSource) -> list[str]:
    """Return the comment above a kernel with loops without comment markers."""
    return [line[3:] for line in loop_comment(loop).removesuffix(" */").splitlines()]


def programs(loop: LoopSource) -> tuple[Program, ...]:
    """Return the straight-line parts, in the order of the text."""
    return loop_parts(loop.procedure)
