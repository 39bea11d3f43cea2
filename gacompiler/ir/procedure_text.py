"""Human-readable text of procedures."""

from __future__ import annotations

from collections.abc import Sequence

from .procedure import Add, Apply, Clear, Copy, Loop, Place, Procedure, Repeat, Statement, Storage, Table
from .rows import Along, Counter, Following, Numbered, Parent, Previous, Shifted, Through, numbers_of


def procedure_text(procedure: Procedure) -> str:
    """Return the loops of a procedure with its programs as calls, followed by its work tables."""
    parameters = ", ".join(_declared(table) for table in procedure.parameters)
    results = ", ".join(_declared(table) for table in procedure.results)
    lines = [f"{procedure.name}({parameters}) -> {results}", *_lines(procedure.body, 1)]
    work = ", ".join(_declared(table) for table in procedure.of(Storage.WORK))
    return "\n".join([*lines, *([f"work: {work}"] if work else [])])


def _declared(table: Table) -> str:
    shape = ", ".join([*table.lengths, *map(str, table.shape)])
    into = f" into {table.into}" if table.into else ""
    return f"{table.name}[{shape}]{into}" if shape else table.name


def _lines(body: Sequence[Statement], depth: int) -> list[str]:
    found = []
    for statement in body:
        text = ""
        match statement:
            case Apply():
                call = f"{statement.program.name}({', '.join(map(place_text, statement.inputs))})"
                text = f"{', '.join(map(place_text, statement.outputs))} = {call}"
            case Add():
                text = f"{place_text(statement.target)} += {place_text(statement.source)}"
            case Copy():
                text = f"{place_text(statement.target)} = {place_text(statement.source)}"
            case Clear():
                text = f"{statement.table} = 0"
            case Loop():
                order = f"reversed({statement.length})" if statement.reverse else statement.length
                until = f" until {statement.until}" if statement.until else ""
                within = f" from {statement.first or 0} to {statement.end or statement.length}"
                within = within if statement.first or statement.end else ""
                text = f"for {statement.counter} in {order}{within}{until}:"
            case Repeat():
                text = f"repeat at most {statement.limit} times until {statement.until}, counting {statement.steps}:"
        found.append("    " * depth + text)
        if isinstance(statement, (Loop, Repeat)):
            found += _lines(statement.body, depth + 1)
    return found


def place_text(place: Place) -> str:
    """Return the text of a row of a table, such as ``axes[i]``."""
    numbers = ", ".join(map(_number_text, numbers_of(place.row)))
    return f"{place.table}[{numbers}]" if numbers else place.table


def at_text(stride: int, counter: str, by: int) -> str:
    """Return the text of the number of a shifted row before the boundary mode applies: ``2 * i - 1``."""
    first = counter if stride == 1 else f"{stride} * {counter}"
    return f"{first} {'-' if by < 0 else '+'} {abs(by)}" if by else first


def _number_text(row: Along) -> str:
    match row:
        case Counter(loop):
            return loop
        case Through(index, loop, column):
            return f"{index}[{loop}, {column}]" if column else f"{index}[{loop}]"
        case Previous(loop, start):
            return f"before {loop}, else {start}"
        case Parent(index, loop, start):
            return f"{index}[{loop}], else {start}"
        case Numbered(number, start):
            return f"{number}, else {start}"
        case Shifted(loop, by, boundary, stride, start):
            return f"{at_text(stride, loop, by)} ({boundary})" + (f", else {start}" if start else "")
        case Following(loop):
            return f"after {loop}"
