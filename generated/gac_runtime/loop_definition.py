"""The definition of a kernel with loops, as it is passed between the parts of the runtime."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from .definition import COUNTS, counted, needs_doubles
from .layout import Layout

ROW_OR, ADD_TO, SUM, BOUND, NUMBER = "_row_or", "_add_to", "_sum", "_bound", "_number"
"""Free names in the text of a loop: read a row or a default, add to a row, add two rows, a bound, and a number."""

ROWS_TYPE = "int(*)(void *, void *, void *, intptr_t)"
"""C type of a compiled loop over elements; it takes lengths, addresses, steps and the number of elements."""


class Table(NamedTuple):
    """An argument, a result, or an intermediate array."""

    name: str
    lengths: tuple[str, ...]
    """The names of the lengths of its leading axes."""
    shape: tuple[int, ...]
    """The shape of a row."""
    rule: str = ""
    """For an index table, the rule that its entries must satisfy, ``an earlier row or -1``."""
    into: str = ""
    """For an index table, the length of the axis that its entries index."""
    shared: bool = False
    """Whether the array is usually the same for all elements of a batch."""

    @property
    def is_index(self) -> bool:
        """Whether the entries are indices of rows."""
        return bool(self.rule)

    def core(self, lengths: Mapping[str, int]) -> tuple[int, ...]:
        """Return the shape for one element."""
        return (*(lengths[name] for name in self.lengths), *self.shape)

    @property
    def shape_text(self) -> str:
        """The documented shape, ``(..., n, 6)``; index tables have no leading axes."""
        sizes = [*self.lengths, *map(str, self.shape)]
        if self.is_index:
            return f"({', '.join(sizes)})" if self.shape else f"({sizes[0]},)"
        return f"({', '.join(['...', *sizes])})"


class Part(NamedTuple):
    """A straight-line part of a kernel with loops, on rows."""

    function: Callable[..., Any]
    shapes: list[tuple[int, ...]]
    out_shapes: list[tuple[int, ...]]


@dataclass(frozen=True, slots=True, eq=False)
class LoopDefinition:
    """A kernel with loops: its function on one element, its tables, and its parts.

    Attributes
    ----------
    name : str
    function : callable
        Takes the lengths, the parameters, the results, and the intermediate tables over lengths.
    lengths : tuple of str
    parameters, results, work : tuple of Table
    parts : mapping of str to Part
        The functions that `function` calls, by name.
    layouts : mapping of str to Layout
    cost : mapping of str to mapping of str to int
        Operations by how often they run: ``""`` once, ``"n"`` for each row, ``"n*m"``.
    signature : str
    repeats : bool
        Whether the number of iterations depends on the numbers of an element.
    """

    name: str
    function: Callable[..., Any]
    lengths: tuple[str, ...]
    parameters: tuple[Table, ...]
    results: tuple[Table, ...]
    work: tuple[Table, ...]
    parts: Mapping[str, Part]
    layouts: Mapping[str, Layout]
    cost: Mapping[str, Mapping[str, int]]
    signature: str
    repeats: bool

    @property
    def in_doubles(self) -> bool:
        """Whether a part computes with integers that single precision rounds."""
        return any(needs_doubles(part.function) for part in self.parts.values())

    def blades(self, name: str) -> str:
        """Return the blades of an argument or a result, as the end of an error message."""
        layout = self.layouts.get(name)
        return f" with last axis {' '.join(layout.blades)}" if layout is not None and layout.blades else ""

    def work_of(self, lengths: Mapping[str, int]) -> int:
        """Return the work for one element, which decides about threads: bytes as doubles, and four per operation."""
        numbers = sum(math.prod(table.core(lengths)) for table in (*self.parameters, *self.results))
        operations = sum(
            sum(counts.values()) * math.prod(lengths.get(name, 1) for name in often.split("*"))
            for often, counts in self.cost.items()
        )
        return 8 * numbers + 4 * operations


def loop_definition(
    function: Callable[..., Any],
    signature: str,
    layouts: Sequence[Layout | None],
    namespace: Mapping[str, Any],
    *,
    cost: str,
    names: str = "",
    shared: str = "",
    indices: Mapping[str, str] | None = None,
    work: str = "",
    repeats: bool = False,
) -> LoopDefinition:
    """Create the definition of a kernel with loops from the declaration in its module, see `GeneratedModule.loops`.

    Its parts are the annotated functions in `namespace`, the global variables of the module, that it calls.
    """
    inputs, outputs = ([_sizes(shape) for shape in part[1:-1].split("),(")] for part in signature.split("->"))
    lengths = tuple(dict.fromkeys(name for named, _ in inputs for name in named))
    code = function.__code__
    public = names.split() or code.co_varnames[len(lengths) : len(lengths) + len(inputs) + len(outputs)]
    rules = {name: rule.rpartition(" of ") for name, rule in (indices or {}).items()}
    tables = [
        Table(name, *sizes, *(rules[name][::2] if name in rules else ("", "")), name in shared.split())
        for name, sizes in zip(public, (*inputs, *outputs), strict=True)
    ]
    declared = [Table(name, *_sizes(sizes)) for name, sizes in re.findall(r"(\w+)\(([^)]*)\)", work)]
    known = {name: layout for name, layout in zip(public, layouts, strict=True) if layout is not None}
    called = {name: namespace[name] for name in code.co_names if name in namespace}
    used = {name: _part(part) for name, part in called.items() if getattr(part, "__annotations__", None)}
    return LoopDefinition(
        function.__name__,
        function,
        lengths,
        tuple(tables[: len(inputs)]),
        tuple(tables[len(inputs) :]),
        tuple(table for table in declared if table.lengths),
        used,
        known,
        _costs(cost),
        signature,
        repeats,
    )


def _part(function: Callable[..., Any]) -> Part:
    """Read the shapes of rows from the annotations of a function, such as ``R8``, ``R3x3`` and ``(R6, R)``."""
    *given, returned = function.__annotations__.values()
    results = returned.strip("()").split(", ")
    shapes, out_shapes = ([tuple(map(int, re.findall(r"\d+", row))) for row in rows] for rows in (given, results))
    return Part(function, shapes, out_shapes)


def _sizes(text: str) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Parse the lengths and the shape of a row in ``n,6``."""
    sizes = [size for size in text.split(",") if size]
    named = tuple(size for size in sizes if not size.isdigit())
    return named, tuple(map(int, sizes[len(named) :]))


def _costs(text: str) -> dict[str, dict[str, int]]:
    """Parse the counts in ``n * (51 mul, 36 add) + 48 mul, 40 add``."""
    found = {}
    for term in text.split(" + "):
        often, mark, counts = term.partition(" * (")
        found[often if mark else ""] = counted(counts.rstrip(")") if mark else term)
    return found


def cost_text(cost: Mapping[str, Mapping[str, int]]) -> str:
    """Return a cost as text for documentation."""
    terms = []
    for often, counts in cost.items():
        shown = [name for name in COUNTS[:-1] if counts[name] or name in ("mul", "add")]
        text = ", ".join(f"{counts[name]} {name}" for name in shown)
        terms.append(f"{often} * ({text})" if often else text)
    return " + ".join(terms)
