"""Print kernels with loops as Rust: functions of one element, whose tables are slices of rows.

Parts take rows by value, so that a part may write to a row that it reads.
"""

from __future__ import annotations

from collections.abc import Mapping

from ..errors import BackendError
from ..ir.procedure import Apply, Place, Procedure, Storage, Table
from .loop_statements import LoopWords, StatementText, is_number, product
from .module import LoopSource
from .printers import Names
from .target_loops import (
    LoopNames,
    long_work,
    loop_comment_lines,
    named_in,
    numbers,
    short_work,
    work_numbers,
)
from .targets import Language

HELPERS = """
fn _length(name: &str, found: usize, expected: usize) {
    assert!(found == expected, "{name} of {found} rows; expected {expected}");
}

fn _row<T: Real, const K: usize>(table: &[T], k: usize) -> [T; K] {
    table[K * k..K * (k + 1)].try_into().unwrap()
}

fn _add<T: Real>(source: T, target: &mut T) {
    *target = *target + source;
}

fn _add_row<T: Real, const K: usize>(source: [T; K], target: &mut [T; K]) {
    for k in 0..K {
        target[k] = target[k] + source[k];
    }
}

fn _row_mut<T: Real, const K: usize>(table: &mut [T], k: usize) -> &mut [T; K] {
    (&mut table[K * k..K * (k + 1)]).try_into().unwrap()
}
"""
"""Functions for rows of the work space, which is one slice of numbers, and for sums of rows. No kernel can have their
names."""

WINDOWS = """
fn _reflect(mut k: isize, n: usize) -> usize {
    let n = n as isize;
    while n > 0 && (k < 0 || k >= n) {
        k = if k < 0 { -1 - k } else { 2 * n - 1 - k };
    }
    k as usize
}

fn _mirror(mut k: isize, n: usize) -> usize {
    let n = n as isize;
    while n > 1 && (k < 0 || k >= n) {
        k = if k < 0 { -k } else { 2 * n - 2 - k };
    }
    if n > 1 { k as usize } else { 0 }
}

fn _nearest(k: isize, n: usize) -> usize {
    k.min(n as isize - 1).max(0) as usize
}

fn _wrap(k: isize, n: usize) -> usize {
    k.rem_euclid(n as isize) as usize
}

fn _constant(k: isize, _n: usize) -> usize {
    k as usize
}

fn _is_inside(k: isize, n: usize) -> bool {
    k >= 0 && (k as usize) < n
}
"""
"""Functions for rows at a distance, which may be beyond the ends of an axis of n rows."""

_ZERO, _ONE = "T::number(0.0)", "T::number(1.0)"
_WORDS = LoopWords(
    language="Rust",
    forward="for {counter} in {first}..{end}",
    backward="for {counter} in ({first}..{end}).rev()",
    bound=(
        f"(if {{value}} > {_ZERO} {{{{ if {{value}} < T::number({{length}} as f64) {{{{ {{value}}.row() }}}} "
        "else {{ {length} }} }} else {{ 0 }})"
    ),
    repeat="for _ in 0..{limit}",
    condition="if {condition}",
    choice="if {condition} {{ {row} }} else {{ {start} }}",
    index="{index}[{counter}] as usize",
    row="{value}.row()",
    has_row="{value} >= T::number(0.0) && {value} < T::number({length} as f64)",
    near="_{boundary}({at}, {length})",
    is_inside="_is_inside({at}, {length})",
    at="{counter} as isize",
    count=f"{{0}} = {{0}} + {_ONE};",
    is_set=f"{{}} != {_ZERO}",
    has_braces=True,
)


def loop_functions(loop: LoopSource, names: LoopNames, language: Language) -> list[list[str]]:
    """Print the function that returns the size of the work space, and the function for one element."""
    taken = names.inside(language)
    named = named_in(taken, loop.procedure)
    lengths = [f"{length}: usize" for length in named.lengths]
    size = [
        f"/// Return the size of the work space of `{names.own}` in numbers.",
        f"pub fn {names.work}({', '.join(lengths)}) -> usize {{",
        f"    {work_numbers(named)}",
        "}",
    ]
    text = _RustText(named, taken, names.parts)
    comment = [f"/// {line}".rstrip() for line in loop_comment_lines(loop)]
    own = [
        *("/// ```text", *comment, "/// ```"),
        "#[allow(unused_assignments, unused_mut)]",
        f"pub fn {names.own}<T: Real>({', '.join([*lengths, *text.parameters()])}) {{",
        *(f"    {line}" for line in text.function()),
        "}",
    ]
    return [size, own]


class _RustText(StatementText):
    """Prints the function for one element."""

    words = _WORDS

    def __init__(self, named: Procedure, names: Names, functions: Mapping[str, str]) -> None:
        super().__init__(named, names)
        self._functions = functions
        self._work = names.fresh("work")

    def parameters(self) -> list[str]:
        """Return the parameters after the lengths."""
        found = []
        for table in (*self._procedure.parameters, *self._procedure.results):
            if table.storage is Storage.INDEX:
                found.append(f"{table.name}: &[i64]")
            elif is_number(table):
                found.append(f"{table.name}: T")
            else:
                row = f"[{_type(table)}]" if table.lengths else _type(table)
                found.append(f"{table.name}: &{'mut ' * (table.storage is Storage.RESULT)}{row}")
        return [*found, f"{self._work}: &mut [T]"]

    def function(self) -> list[str]:
        """Print the body of the function."""
        named = self._procedure
        body = self.lines(named.body)
        tables = [table for table in (*named.parameters, *named.results) if table.lengths]
        lines = [f'_length("{table.name}", {table.name}.len(), {product(*_rows_of(table))});' for table in tables]
        for table in long_work(named):
            lines.append(f"let ({table.name}, {self._work}) = {self._work}.split_at_mut({numbers(table)});")
        lines += [f"let mut {table.name} = {_zeros(table)};" for table in short_work(named)]
        return [*lines, *body]

    # Statements.

    def _called(self, statement: Apply) -> list[str]:
        written = [place.table for place in statement.outputs]
        if len(set(written)) < len(written):
            where = f"Rust text of {self._procedure.name}"
            raise BackendError(where, f"a part that writes two rows of one of {', '.join(written)}", "one row of each")
        passed = [*map(self._value, statement.inputs), *map(self._written, statement.outputs)]
        return [f"{self._functions[statement.program.name]}({', '.join(passed)});"]

    def _copied(self, source: Place, target: Place) -> list[str]:
        written = self._written(target)
        assigned = written.removeprefix("&mut ") if written.startswith("&mut ") else f"*{written}"
        return [f"{assigned} = {self._value(source)};"]

    def _summed(self, source: Place, target: Place) -> list[str]:
        table = self._procedure.table(target.table)
        # Where both rows are parts of work arrays, Rust cannot infer how long they are.
        function = f"_add_row::<T, {table.size}>" if table.shape else "_add"
        return [f"{function}({self._value(source)}, {self._written(target)});"]

    def _cleared(self, table: Table) -> list[str]:
        if table.lengths:
            return [f"{table.name}.fill({_ZERO if table.storage is Storage.WORK else _zeros(table)});"]
        return [f"{self._single(table)} = {_zeros(table)};"]

    # Rows.

    def _value(self, place: Place) -> str:
        return self._chosen(place, self._row, self._single)

    def _written(self, place: Place) -> str:
        """Return a mutable reference to a row."""
        return self._chosen(place, self._target, self._single_target)

    def _row(self, table: Table, row: str) -> str:
        is_array = table.storage is Storage.WORK and table.shape
        return f"_row({table.name}, {row})" if is_array else f"{table.name}[{row}]"

    def _single(self, table: Table) -> str:
        is_local = table.storage is Storage.WORK or is_number(table)
        return table.name if is_local else f"*{table.name}"

    def _target(self, table: Table, row: str) -> str:
        is_array = table.storage is Storage.WORK and table.shape
        return f"_row_mut({table.name}, {row})" if is_array else f"&mut {table.name}[{row}]"

    def _single_target(self, table: Table) -> str:
        return f"&mut {table.name}" if table.storage is Storage.WORK else table.name


def _rows_of(table: Table) -> tuple[int | str, ...]:
    """Return the factors of the length of a slice: that of rows, but of single entries for index tables."""
    return (table.size, *table.lengths) if table.storage is Storage.INDEX else table.lengths


def _type(table: Table) -> str:
    """Return the type of a row."""
    return f"[T; {table.size}]" if table.shape else "T"


def _zeros(table: Table) -> str:
    return f"[{_ZERO}; {table.size}]" if table.shape else _ZERO
