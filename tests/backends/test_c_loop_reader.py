"""Kernels with loops are read back from C as they were printed, and every change of the text is detected."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from random import Random

import pytest
from loop_examples import EXAMPLES, chain, loop_module, loop_source, tree

from gacompiler.backends import c_procedures, c_programs, c_source
from gacompiler.backends.c_loop_names import named_in_c
from gacompiler.backends.c_loops import lane_lines
from gacompiler.backends.module import LoopSource, ModuleSource
from gacompiler.backends.shared_parts import with_shared_parts
from gacompiler.errors import BackendError, GacError
from gacompiler.frontend.kernel import Kernel
from gacompiler.ir.procedure import Add, Apply, Copy, Loop, Place, Procedure, Repeat, Statement
from gacompiler.ir.program import Program
from gacompiler.ir.rows import Counter as Row
from gacompiler.ir.rows import Previous

SEED = 2026


def _shape(program: Program) -> Program:
    """A program reduced to the shapes of its arguments and results."""
    arguments = tuple(
        replace(argument, name="", components=("",) * len(argument.components)) for argument in program.arguments
    )
    results = tuple(replace(result, name="", operands=("",) * len(result.operands)) for result in program.results)
    return Program("", arguments, (), results)


def _shapes(body: tuple[Statement, ...]) -> tuple[Statement, ...]:
    found: list[Statement] = []
    for statement in body:
        match statement:
            case Apply():
                found.append(replace(statement, program=_shape(statement.program)))
            case Loop() | Repeat():
                found.append(replace(statement, body=_shapes(statement.body)))
            case _:
                found.append(statement)
    return tuple(found)


def _module(procedure: Procedure) -> ModuleSource:
    return ModuleSource("loops", "", "", "", (), (LoopSource(procedure, "", (), ()),))


@cache
def _read(definition: Kernel) -> tuple[str, dict[str, Procedure]]:
    """The text of a kernel, and what is read from it."""
    text = c_source(_module(loop_source(definition).procedure))
    return text, c_procedures(text)


@pytest.mark.parametrize("definition", EXAMPLES, ids=lambda kernel: kernel.name)
def test_text_is_read_as_it_was_printed(definition: Kernel) -> None:
    procedure = loop_source(definition).procedure
    found = _read(definition)[1][procedure.name]
    # A length and an argument may share a name, but not in C.
    procedure = named_in_c(procedure)[0]
    assert found.tables == procedure.tables and found.lengths == procedure.lengths
    assert _shapes(found.body) == _shapes(procedure.body)
    assert found.signature == procedure.signature


def test_modules_with_several_kernels() -> None:
    text = c_source(loop_module("loops", *EXAMPLES))
    assert list(c_procedures(text)) == [definition.name for definition in EXAMPLES]
    assert c_programs(text) == {}


def test_names_that_c_reserves() -> None:
    """Tables, lengths and counters may have names of C, of the runtime or of each other."""
    procedure = loop_source(chain).procedure
    names = {"moves": "REAL", "points": "n", "out_0": "work", "out_1": "gac_args", "m_start": "far"}
    text = c_source(_module(_renamed(procedure, names)))
    found = c_procedures(text)["chain"]
    assert [table.name for table in found.tables] == ["vREAL", "n_", "work", "vgac_args", "far_"]
    assert found == replace(named_in_c(_renamed(procedure, names))[0], body=found.body)
    assert "REAL *work_)" in text.replace("\n    ", " ")


def _renamed(procedure: Procedure, names: dict[str, str]) -> Procedure:
    def place(given: Place) -> Place:
        row = given.row
        row = replace(row, start=names[row.start]) if isinstance(row, Previous) else row
        return Place(names[given.table], row)

    def statement(given: Statement) -> Statement:
        match given:
            case Apply():
                return replace(given, inputs=tuple(map(place, given.inputs)), outputs=tuple(map(place, given.outputs)))
            case Loop():
                return replace(given, body=tuple(map(statement, given.body)))
        raise AssertionError(given)

    tables = tuple(replace(table, name=names[table.name]) for table in procedure.tables)
    return Procedure(procedure.name, tables, tuple(map(statement, procedure.body)))


def _mutations(text: str) -> Iterator[tuple[str, str]]:
    """Yield the kind of change and the text with one token changed after the first list of tables."""
    first = text.index("#define TABLES_")
    tokens = list(re.finditer(r"\w+|[-+*<>=?:&|!]+|[,;()\[\]{}]", text[first:]))
    names = sorted({match[0] for match in tokens if match[0].isidentifier()})
    random = Random(SEED)
    for k, match in enumerate(tokens):
        start, end = first + match.start(), first + match.end()

        def changed(new: str, start: int = start, end: int = end) -> str:
            return text[:start] + new + text[end:]

        if match[0].isdigit():
            yield "number", changed(str(int(match[0]) + 1))
        elif match[0].isidentifier():
            yield "name", changed(random.choice([name for name in names if name != match[0]]))
        elif match[0] in ("+", "-", "*", "<", ">", ">=", "++", "--"):
            others = {"+": "-", "-": "+", "*": "+", "<": ">", ">": "<", ">=": ">", "++": "--", "--": "++"}
            yield "operator", changed(others[match[0]])
        yield "left out", changed("")
        if k + 2 < len(tokens) and tokens[k + 1][0] == "," and tokens[k + 2][0] != match[0]:
            other = tokens[k + 2]
            between = text[end : first + other.start()]
            yield "exchanged", text[:start] + other[0] + between + match[0] + text[first + other.end() :]


@pytest.mark.parametrize("definition", EXAMPLES, ids=lambda kernel: kernel.name)
def test_changes_are_detected(definition: Kernel) -> None:
    text, right = _read(definition)
    every = list(_mutations(text))
    random, kinds = Random(SEED), sorted({kind for kind, _ in every})
    assert len(kinds) >= 3
    for kind in kinds:
        for changed in random.sample([changed for other, changed in every if other == kind], 2):
            assert changed != text
            try:
                found = c_procedures(changed)
            except GacError:
                continue
            assert found != right, (kind, _difference(text, changed))


@pytest.mark.parametrize("bounds", ["i = n; i < n", "i = 1; i < n", "i = n; i < 0", "i = 0; i < 0", "i = 0; i < 3"])
def test_loops_run_over_all_rows_of_a_length(bounds: str) -> None:
    text = c_source(_module(loop_source(chain).procedure))
    changed = text.replace("i = 0; i < n", bounds)
    assert changed != text
    with pytest.raises(BackendError, match="chain: a loop over no length"):
        c_procedures(changed)


def _difference(a: str, b: str) -> list[tuple[str, str]]:
    return [(x, y) for x, y in zip(a.splitlines(), b.splitlines(), strict=False) if x != y][:1]


def test_lanes_must_agree() -> None:
    """A text whose lanes run over different rows is rejected for that reason, before the comparison of texts."""
    module = with_shared_parts(_module(loop_source(tree).procedure))
    text = c_source(module)
    lines = "\n".join(lane_lines(module.loops[0].procedure))
    call = next(line for line in lines.splitlines() if "tree_result_2_lanes" in line)
    with pytest.raises(BackendError, match="tree_lanes"):
        c_procedures(text.replace(call, call.replace("out_0", "out_1", 1)))


@pytest.mark.parametrize(
    ("statement", "found"),
    [
        (Copy(Place("out_0", Row("i")), Place("out_0", Previous("i", "s_start"))), "is written at"),
        (Add(Place("x", Row("i")), Place("out_0", Previous("i", "s_start"))), "a sum in"),
    ],
)
def test_rows_that_may_not_exist_are_rejected(statement: Statement, found: str) -> None:
    procedure = loop_source(tree).procedure
    loop = next(each for each in procedure.body if isinstance(each, Loop))
    broken = replace(procedure, body=(replace(loop, body=(statement,)),))
    with pytest.raises(BackendError, match=found):
        c_source(_module(broken))
