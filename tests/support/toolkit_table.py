"""One row of the table of the toolkit: an operation that users of geometric algebra expect, and its location."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Entry:
    """An operation, its function, the source of its formula, and the test against an independent result."""

    entry: str
    """The operation in a few words."""
    algebra: str
    """``pga3``, ``pga2``, ``cga3`` ..., the generated module, or ``motors`` for ``algorithms.motors``."""
    function: str
    """Its name in that module."""
    source: str
    """Book, paper, or the definition."""
    test: str
    """``file.py::test_name``, without parameters."""


def rows(algebra: str, source: str, test: str, text: str) -> tuple[Entry, ...]:
    """Entries of one algebra, source and test, from lines ``operation: function function ...``."""
    found = []
    for line in text.strip().splitlines():
        entry, _, functions = line.strip().partition(": ")
        found += [Entry(entry, algebra, function, source, test) for function in functions.split()]
    return tuple(found)
