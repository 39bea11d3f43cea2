"""Fusing loops preserves the results of procedures and is done only where it is valid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from random import Random
from typing import Any

from gacompiler.ir.procedure import Add, Apply, Clear, Copy, Loop, Place, Procedure, Statement, Storage, Table
from gacompiler.ir.program import Argument, Line, Program, Result
from gacompiler.ir.rows import Counter, Following, Parent, Previous, Row, Through
from gacompiler.ir.run_procedure import run_procedure
from gacompiler.ir.scalar import Op
from gacompiler.passes.fuse import fuse


def apply(target: Place, *sources: Place) -> Apply:
    """Store the sum of some numbers plus one in a place."""
    names = tuple(f"a{k}" for k in range(len(sources)))
    lines, last = [Line("t", Op.ADD, (Fraction(1), names[0] if names else Fraction(1)))], "t"
    for k, name in enumerate(names[1:]):
        lines.append(Line(f"t{k}", Op.ADD, (last, name)))
        last = f"t{k}"
    arguments = tuple(Argument(name, (), (name,)) for name in names)
    name = f"sum_{len(sources)}"
    return Apply(Program(name, arguments, tuple(lines), (Result("r", (), (last,)),)), sources, (target,))


def at(table: str, loop: str = "i") -> Place:
    """The current row of a loop."""
    return Place(table, Counter(loop))


def loop(*body: Statement, reverse: bool = False, counter: str = "i") -> Loop:
    return Loop(counter, "n", reverse, body)


NAMES = ("x", "out", "other", "work", "more", "start")


def procedure(*body: Statement) -> Procedure:
    tables = [
        Table("x", ("n",), (), Storage.ARGUMENT),
        Table("index", ("n",), (), Storage.INDEX, True, "n"),
        Table("out", ("n",), (), Storage.RESULT),
        Table("other", ("n",), (), Storage.RESULT),
        *(Table(name, ("n",), (), Storage.WORK) for name in ("work", "more")),
        Table("start", (), (), Storage.WORK),
    ]
    return Procedure("p", tuple(tables), body)


def results(of: Procedure, n: int = 5, seed: int = 0) -> dict[str, Any]:
    """The results if all tables are zero at first, since the examples read rows that they do not write."""
    cleared = tuple(Clear(table.name) for table in of.of(Storage.WORK, Storage.RESULT))
    of = replace(of, body=(*cleared, *of.body))
    random = Random(seed)
    rows = [[Fraction(random.randint(-9, 9))] for _ in range(n)]
    parents = [[random.randint(-1, k - 1)] for k in range(n)]
    return run_procedure(of, {"n": n}, {"x": rows, "index": parents})


def n_loops(of: Procedure) -> int:
    return sum(isinstance(statement, Loop) for statement in of.body)


def check(expected: int, *body: Statement) -> Procedure:
    """Check the number of loops after fusion, and that the results are unchanged."""
    given = procedure(*body)
    fused = fuse(given)
    assert n_loops(fused) == expected
    for seed in range(5):
        assert results(fused, seed=seed) == results(given, seed=seed)
    return fused


def test_rows_that_are_used_at_once_become_variables() -> None:
    fused = check(1, loop(apply(at("work"), at("x"))), loop(apply(at("out", "j"), at("work", "j")), counter="j"))
    assert fused.table("work").lengths == ()


def test_a_table_of_which_other_rows_are_used_is_kept() -> None:
    fused = check(
        1,
        apply(Place("start")),
        loop(apply(at("work"), at("x"))),
        loop(apply(at("out"), Place("work", Previous("i", "start"))), apply(at("other"), at("out")), reverse=True),
    )
    assert fused.table("work").lengths == ("n",)


def test_a_previous_row_is_available_and_a_following_one_is_not() -> None:
    first = loop(apply(at("work"), at("x")))
    check(1, apply(Place("start")), first, loop(apply(at("out"), Place("work", Previous("i", "start")))))
    check(2, Clear("work"), loop(apply(at("out"), at("work"))), loop(Add(at("x"), Place("work", Following("i")))))


def test_a_scan_over_parents_joins_the_loop_that_it_reads() -> None:
    carry = Place("out", Parent("index", "i", "start"))
    fused = check(1, loop(apply(at("work"), at("x"))), apply(Place("start")), loop(apply(at("out"), carry, at("work"))))
    assert isinstance(fused.body[0], Apply)  # the initial value of the scan is moved in front of the loop


def test_sums_towards_parents_are_read_by_the_same_loop_only_downwards() -> None:
    total = Add(at("work"), Place("more", Through("index", "i")))
    down = loop(apply(at("work"), at("x"), at("more")), total, reverse=True)
    check(1, Clear("more"), down, loop(apply(at("out"), at("work"))))
    check(2, Clear("more"), down, loop(apply(at("out"), at("more"))))


def test_loops_in_opposite_directions_are_not_fused_if_both_carry() -> None:
    forward = loop(apply(at("work"), Place("work", Previous("i", "start")), at("x")))
    backward = loop(apply(at("out"), Place("out", Previous("i", "start")), at("x")), reverse=True)
    check(2, forward, backward)
    check(1, forward, loop(apply(at("out"), at("x")), reverse=True))


def _random_body(random: Random) -> Sequence[Statement]:
    """Loops over random rows, ordered so that tables are computed before they are used as a whole."""
    body: list[Statement] = [apply(Place("start")), Clear("work"), Clear("more"), Clear("out"), Clear("other")]
    for _ in range(random.randint(2, 6)):
        reverse = random.random() < 0.3
        counter = random.choice("ij")
        inner: list[Statement] = []
        for _ in range(random.randint(1, 2)):
            target = random.choice(("out", "other", "work", "more"))
            rows: list[Row] = [Counter(counter), Previous(counter, "start")]
            rows += [] if reverse else [Parent("index", counter, "start")]
            source = Place(random.choice(("x", "out", "other", "work", "more")), random.choice(rows))
            inner.append(apply(at(target, counter), source, at("x", counter)))
            if random.random() < 0.3:
                choices: list[Row] = [Following(counter), Through("index", counter)]
                onto = random.choice(choices)
                inner.append(Add(at("x", counter), Place(random.choice(("out", "work", "more")), onto)))
        body.append(loop(*inner, reverse=reverse, counter=counter))
    return body


def test_random_procedures_compute_the_same() -> None:
    random = Random(3)
    fewer = 0
    for _ in range(100):
        given = procedure(*_random_body(random))
        fused = fuse(given)
        fewer += n_loops(fused) < n_loops(given)
        for n in (1, 2, 5):
            assert results(fused, n) == results(given, n)
    assert fewer > 25


def test_rows_of_a_table_that_is_written_are_read_in_order() -> None:
    """A loop that reads, through an index table, rows that it writes itself cannot run in the other direction."""
    start = loop(apply(at("other"), at("x")), reverse=True)
    carried = loop(apply(at("out"), at("x"), Place("out", Previous("i", "start"))), reverse=True)
    through = Place("other", Through("index", "i"))
    check(2, apply(Place("start")), start, loop(Add(through, at("other"))), carried)


def test_a_copy_of_a_row_that_changes_remains_a_table() -> None:
    """In emitted text a single row may be another name of the row that it was copied from."""
    body: list[Statement] = [Copy(at("out"), at("work")), apply(at("out"), at("x")), apply(at("other"), at("work"))]
    fused = check(1, loop(apply(at("out"), at("x"))), loop(*body))
    assert fused.table("work").lengths == ("n",)
    fused = check(1, loop(apply(at("out"), at("x"))), loop(body[0], body[2]))
    assert fused.table("work").lengths == ()


def test_sines_are_not_fused_with_loops_that_carry() -> None:
    sine = Program("sine", (Argument("a", (), ("a",)),), (Line("t", Op.SIN, ("a",)),), (Result("r", (), ("t",)),))
    turns = loop(Apply(sine, (at("x"),), (at("work"),)))
    carry = Place("out", Previous("i", "start"))
    scan = loop(apply(at("out"), carry, at("work")))
    assert n_loops(fuse(procedure(turns, apply(Place("start")), scan))) == 2
    plain = loop(apply(at("work"), at("x")))
    assert n_loops(fuse(procedure(plain, apply(Place("start")), scan))) == 1
    assert n_loops(fuse(procedure(turns, loop(apply(at("out"), at("work")))))) == 1
    follows = loop(Apply(sine, (at("out"),), (at("other"),)))
    assert n_loops(fuse(procedure(plain, apply(Place("start")), scan, follows))) == 2


def test_copies_that_nothing_reads_are_left_out() -> None:
    """The loop of the copies disappears as well, and copies of which only such copies read."""
    unread = loop(Copy(at("x"), at("work"))), loop(Copy(at("work"), at("more")))
    fused = check(1, loop(apply(at("out"), at("x"))), *unread)
    assert {table.name for table in fused.of(Storage.WORK)} <= {"start"}
    read = check(1, unread[0], loop(apply(at("out"), at("work"))), unread[1])
    assert "more" not in {table.name for table in read.tables}
