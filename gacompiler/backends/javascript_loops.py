"""Print kernels with loops as JavaScript: functions of one element, whose tables are arrays of contiguous rows."""

from __future__ import annotations

from ..ir.procedure import Apply, Procedure, Storage, Table
from .loop_statements import is_number, product
from .module import LoopSource
from .printers import Names
from .target_loops import (
    LoopNames,
    RowText,
    RowWords,
    long_work,
    loop_comment,
    named_in,
    numbers,
    short_work,
    work_numbers,
    work_places,
)
from .targets import Language

HELPERS = """
function $table(name, array, length) {
  if (array.length !== length) throw new RangeError(`${name} of length ${array.length}; expected ${length}`);
}

function $work(array, length) {
  if (array === undefined) return new Float64Array(length);
  if (array.length < length) throw new RangeError(`a work space of length ${array.length}; expected ${length}`);
  return array;
}
"""

WINDOWS = """
function $reflect(k, n) {
  while (n > 0 && (k < 0 || k >= n)) k = k < 0 ? -1 - k : 2 * n - 1 - k;
  return k;
}

function $mirror(k, n) {
  while (n > 1 && (k < 0 || k >= n)) k = k < 0 ? -k : 2 * n - 2 - k;
  return n > 1 ? k : 0;
}

function $nearest(k, n) {
  return Math.max(Math.min(k, n - 1), 0);
}

function $wrap(k, n) {
  return (k % n + n) % n;
}

function $constant(k, n) {
  return k;
}

function $isInside(k, n) {
  return k >= 0 && k < n;
}
"""
"""Functions for rows at a distance, which may be beyond the ends of an axis of n rows."""

_WORDS = RowWords(
    language="JavaScript",
    forward="for (let {counter} = {first}; {counter} < {end}; {counter}++)",
    backward="for (let {counter} = {end} - 1; {counter} >= {first}; {counter}--)",
    bound="({value} > 0 ? Math.min(Math.trunc({value}), {length}) : 0)",
    repeat="for (let {counter} = 0; {counter} < {limit}; {counter}++)",
    is_set="{} !== 0",
    row="Math.trunc({value})",
    near="${boundary}({at}, {length})",
    is_inside="$isInside({at}, {length})",
    has_braces=True,
    indent="  ",
    each="for (let {k} = 0; {k} < {size}; {k}++)",
)


def returned(texts: list[str]) -> str:
    """Return the statement that returns one result, or an array of several."""
    return f"return {texts[0]};" if len(texts) == 1 else f"return [{', '.join(texts)}];"


def loop_functions(loop: LoopSource, names: LoopNames, language: Language) -> list[list[str]]:
    """Print the function that returns the size of the work space, and the function for one element."""
    taken = names.inside(language)
    named = named_in(taken, loop.procedure)
    head = f"export function {names.work}({', '.join(named.lengths)}) {{"
    size = [head, f"  return {work_numbers(named)};", "}"]
    work = taken.fresh("work")
    tables = [table.name for table in (*named.parameters, *named.results)]
    own = [
        *loop_comment(loop).split("\n"),
        f"export function {names.own}({', '.join([*named.lengths, *tables, work])}) {{",
        *(f"  {line}" for line in _function(named, taken, names, work)),
        "}",
    ]
    return [size, own]


def _function(named: Procedure, taken: Names, names: LoopNames, work: str) -> list[str]:
    """Print the body of the function for one element, which allocates results and work space that are omitted."""
    body = _JavaScriptText(named, taken, names.parts).lines(named.body)
    given = [table for table in named.parameters if not is_number(table)]
    lines = [f'$table("{table.name}", {table.name}, {numbers(table)});' for table in given]
    lines += [f"{table.name} = $result({table.name}, {numbers(table)});" for table in named.results]
    if long_work(named):
        lines.append(f"{work} = $work({work}, {names.work}({', '.join(named.lengths)}));")
    places = work_places(named)
    ends = [*(begin for _, begin in places[1:]), work_numbers(named)]
    for (table, begin), end in zip(places, ends, strict=False):
        lines.append(f"const {table.name} = {work}.subarray({begin}, {end});")
    lines += [f"const {table.name} = new Float64Array({table.size});" for table in short_work(named)]
    results = [table.name if table.lengths or table.shape else f"{table.name}[0]" for table in named.results]
    return [*lines, *body, returned(results)]


class _JavaScriptText(RowText):
    """Prints the statements of the function for one element; a row is an array and an offset in it."""

    words = _WORDS

    def _called(self, statement: Apply) -> list[str]:
        passed = []
        for argument, place in zip(statement.program.arguments, statement.inputs, strict=True):
            if argument.shape:
                passed += [self._chosen(place, self._array, self._single), self._chosen(place, self._begin, self._zero)]
            else:
                passed.append(self._value(place))
        for place in statement.outputs:
            passed += [self._chosen(place, self._array, self._single), self._chosen(place, self._begin, self._zero)]
        return [f"{self._functions[statement.program.name]}$({', '.join(passed)});"]

    def _cleared(self, table: Table) -> list[str]:
        return [f"{table.name}.fill(0);"]

    # Rows.

    def _array(self, table: Table, row: str) -> str:
        return table.name

    def _single(self, table: Table) -> str:
        return table.name

    def _begin(self, table: Table, row: str) -> str:
        """Return the offset of a row."""
        return product(table.size, row)

    def _zero(self, table: Table) -> str:
        return "0"

    def _cell(self, table: Table, row: str, k: str) -> str:
        return f"{table.name}[{self._place(table, row, k)}]"

    def _only(self, table: Table, k: str) -> str:
        return table.name if is_number(table) and table.storage is Storage.ARGUMENT else f"{table.name}[{k}]"
