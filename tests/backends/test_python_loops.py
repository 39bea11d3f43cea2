"""The Python text of kernels with loops: its form, and that reading it back gives the same procedure."""

from __future__ import annotations

import re
from fractions import Fraction
from functools import cache
from random import Random

import pytest
from loop_examples import EXAMPLES, NAMES, loop_module, sources, squares
from selection import some_slow

from gacompiler import SCALAR, array, kernel
from gacompiler.backends import python_source
from gacompiler.backends.module import KernelSource, LoopSource, ModuleSource
from gacompiler.backends.python_loop_reader import outline, python_procedures
from gacompiler.backends.python_loops import costs_text, index_rules
from gacompiler.backends.readers import python_programs
from gacompiler.errors import BackendError, GacError
from gacompiler.frontend.loops import total
from gacompiler.ir.cost import cost
from gacompiler.ir.interpret import interpret
from gacompiler.ir.procedure import Procedure
from gacompiler.ir.program import Argument, Program, Result
from gacompiler.ir.scalar import Op
from gacompiler.passes.loops import compile_loops
from gacompiler.verify_loops import called_programs
from tests.support.all_cases import all_cases


@pytest.fixture(scope="module")
def text() -> str:
    return python_source(loop_module("loops", *EXAMPLES))


@cache
def texts() -> dict[str, str]:
    """The text of each example alone."""
    return {each.name: python_source(loop_module("loops", each)) for each in EXAMPLES}


def values(program: Program) -> list[float]:
    """The results of a program at some points; roots of sums of squares need arguments that are not negative."""
    found: list[float] = []
    for seed in range(12):
        random = Random(seed)
        least = 0.1 if any(line.op is Op.SQRT for line in program.lines) else -0.9
        given = {a.name: [random.uniform(least, 0.9) for _ in a.components] for a in program.arguments}
        results = interpret(program, given, lambda value: float(Fraction(value))).values()
        found += [float(x) for result in results for x in result]
    return found


def same(read: Procedure, compiled: Procedure) -> bool:
    """Whether two procedures have the same tables and statements, and their programs the same values."""
    return outline(read) == outline(compiled) and all(
        values(a) == pytest.approx(values(b))
        for a, b in zip(called_programs(read), called_programs(compiled), strict=True)
    )


def test_every_kernel_is_read_back(text: str) -> None:
    read = python_procedures(text)
    assert read.keys() == set(NAMES)
    for name, source in sources().items():
        assert read[name].tables == source.procedure.tables
        assert same(read[name], source.procedure)


def test_the_text_is_a_loop_over_rows(text: str) -> None:
    assert (
        """    m = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for i in range(n):
        m = _forward_m(m, q[i], axes[i])
    out[:] = _forward_result(tool, m)
"""
        in text
    )
    assert "out_0[i] = _tree_result(_row_or(out_0, parents[i], s_start), x[i], common)" in text
    assert 'shared="axes"' in text and 'indices={"parents": "an earlier row or -1 of n"}' in text
    assert 'cost="n * (51 mul, 36 add, 2 call, 51 fma) + 48 mul, 40 add, 48 fma"' in text


def test_lines_are_short(text: str) -> None:
    statement = re.compile(r"\s+(work|cost)=|\s+\S.* = _\w+\(|def ")  # with as many names as there are tables
    assert max(len(line) for line in text.splitlines() if not statement.match(line)) <= 120


def test_other_readers_ignore_loops(text: str) -> None:
    assert python_programs(text) == {}


def test_index_rules() -> None:
    rules = {name: index_rules(source.procedure) for name, source in sources().items()}
    assert rules["tree"] == rules["kept"] == rules["matrix_products"] == {"parents": "an earlier row or -1 of n"}
    assert rules["picked"] == {"which": "a row of m"}
    assert rules["dense"] == {"rows": "a row or -1 of m", "columns": "a row or -1 of k"}
    assert rules["forward"] == {}


def test_costs_are_sums_over_loops() -> None:
    program = sources()["forward"].procedure.programs[1]
    found = costs_text([("n*m", cost(program)), ("", cost(program)), ("n*m", cost(program))])
    assert found == "n*m * (102 mul, 72 add, 4 call, 102 fma) + 51 mul, 36 add, 2 call, 51 fma"
    assert costs_text([]) == "0 mul, 0 add, 0 fma"


_TOKEN = re.compile(r"[A-Za-z_]\w*|\d+(?:\.\d+)?|[-+*/]|\[:\]")


def mutated(lines: list[str], random: Random) -> list[str] | None:
    """Change or remove one name, number, sign, order or line; return None if the text did not change."""
    k = random.randrange(len(lines))
    found = list(lines)
    kind = random.choice(("token", "token", "token", "token", "delete", "swap", "indent"))
    if kind == "delete":
        del found[k]
    elif kind == "swap" and k + 1 < len(lines):
        found[k], found[k + 1] = found[k + 1], found[k]
    elif kind == "indent":
        found[k] = "    " + found[k]
    else:
        tokens = list(_TOKEN.finditer(lines[k]))
        if not tokens:
            return None
        token = random.choice(tokens)
        others = {t.group() for line in lines for t in _TOKEN.finditer(line)}
        same_kind = [t for t in sorted(others) if t[0].isalpha() == token.group()[0].isalpha() and t != token.group()]
        if token.group()[0].isdigit():  # 1 becomes 0, since every other number is true in a condition, too.
            same_kind = ["0" if token.group() == "1" else str(int(float(token.group())) + 1)]
        if not same_kind:
            return None
        found[k] = lines[k][: token.start()] + random.choice(same_kind) + lines[k][token.end() :]
    return found if found != lines else None


@pytest.mark.parametrize("seed", some_slow(range(2), 1))
@pytest.mark.slow
def test_mutations_are_detected(text: str, seed: int) -> None:
    random = Random(seed)
    start = re.search(r"^def _\w+\(.*\) -> ", text, re.MULTILINE).start()
    head, body = text[:start], text[start : text.index("kernels = tuple")].splitlines()
    documented = {f'    """{source.summary}"""' for source in sources().values()}
    editable = [k for k, line in enumerate(body) if line.strip() and line not in documented and "error=" not in line]
    unnoticed = []
    tried = 0
    while tried < 30:
        first = random.choice(editable)
        span = [k for k in range(first, min(first + 6, len(body))) if k in editable]
        if span != list(range(first, first + len(span))):
            continue
        changed = mutated([body[k] for k in span], random)
        if changed is None:
            continue
        new = [*body[:first], *changed, *body[first + len(span) :]]
        tried += 1
        try:
            read = python_procedures(head + "\n".join(new) + "\n")
        except GacError:
            continue
        if read.keys() == set(NAMES) and all(same(read[n], s.procedure) for n, s in sources().items()):
            unnoticed.append((body[first : first + len(span)], changed))
    assert not unnoticed, unnoticed


@all_cases(
    "before, after",
    [
        (
            "for i in range(n):\n        m = _forward_m(",
            "for i in range(n - 1, -1, -1):\n        m = _forward_m(",
        ),
        ("_row_or(out_0, i + 1, s_start)", "_row_or(out_0, i - 1, s_start)"),
        ("_add_to(c, i - 1, out[i])", "_add_to(c, i + 1, out[i])"),
        ("(rows[i], columns[i])", "(columns[i], rows[i])"),
        ("for k in range(6):", "for k in range(7):"),
        ('work="m(8)"', 'work="m(9)"'),
        ('shared="axes"', 'shared="q"'),
        ("an earlier row or -1 of n", "a row or -1 of n"),
        ("51 mul", "52 mul"),
        ("        r = next_r\n", ""),
        ("    c[:] = 0\n", ""),
    ],
)
def test_a_change_of_a_statement_is_detected(before: str, after: str) -> None:
    name, text = next((name, text) for name, text in texts().items() if before in text)
    try:
        read = python_procedures(text.replace(before, after, 1))
    except BackendError as error:
        assert "Python text" in str(error)
    else:
        assert not same(read[name], sources()[name].procedure)


def test_names_of_parts_belong_to_the_module() -> None:
    loops = LoopSource(compile_loops(squares).procedure, "S", (), ())

    def module(taken: str) -> ModuleSource:
        program = Program(taken, (Argument("x", (), ("x",)),), (), (Result("out", (), ("x",)),))
        kernels = (KernelSource(program, "S", (), cost(program)),)
        return ModuleSource("m", "S", "gac", "00", kernels, (loops,))

    assert "def _squares_result_2(" in python_source(module("squares_result"))
    for taken in ("squares", "squares_rows", "squares_work"):
        with pytest.raises(BackendError, match=f"its name {taken} is already used by kernel"):
            python_source(module(taken))


def test_arguments_named_like_builtins_and_functions() -> None:
    @kernel(range=array(SCALAR, "sin"), sin=SCALAR)
    def odd(range, sin):
        """Arguments with the names of functions."""
        return total(lambda v: v * sin, range)

    procedure = compile_loops(odd).procedure
    text = python_source(ModuleSource("m", "S", "gac", "00", (), (LoopSource(procedure, "S", (), ()),)))
    assert "def odd(sin__, range_, sin_, out):" in text and 'names="range sin out"' in text
    compile(text, "m.py", "exec")
    with pytest.raises(BackendError, match="cost"):
        python_procedures(text)  # without costs
    text = text.replace('cost="0 mul, 0 add, 0 fma"', 'cost="sin * (1 mul, 1 add, 1 fma)"')
    assert outline(python_procedures(text)["odd"]) == outline(procedure)
