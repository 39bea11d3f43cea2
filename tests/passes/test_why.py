"""``gac show --why``: savings of steps follow from the candidates that were tried, and nothing else is claimed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from compiled_once import compiled_once, let_commands_compile_once
from example_kernels import move_point

from gacompiler import kernel
from gacompiler.algebra.catalog import VGA3
from gacompiler.cli import main
from gacompiler.inspect import stage_text, why
from gacompiler.ir.cost import Cost
from gacompiler.passes.candidate import Candidate
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.passes.record import Compilation

EXAMPLE = Path(__file__).parents[1] / "support" / "example_kernels.py"


@pytest.fixture(scope="module")
def record() -> Compilation:
    return compiled_once(move_point, effort=1, cost="counts")


def made(record: Compilation, best: int, *candidates: tuple[str, int], limits: tuple[str, ...] = ()) -> Compilation:
    """A record with candidates of these steps and numbers of products; all are equal to the author's definition."""
    author = record.candidates[0]
    found = tuple(
        Candidate(tuple(steps.split(", ")), author.program, Cost(mul, 0, 0, 0, 0, 0, mul)) for steps, mul in candidates
    )
    return replace(record, candidates=found, best=found[best], limits=limits)


def rows(record: Compilation) -> dict[str, str]:
    """The table of savings by step."""
    table = why(record).split("\n\n")[1].splitlines()
    assert table[0].split() == ["step", "cheapest", "without", "it", "saves"]
    at = {name: table[0].index(name) for name in ("cheapest", "saves")}
    return {line[: at["cheapest"]].strip(): line[at["saves"] :] for line in table[1:]}


def test_the_example_lists_savings(monkeypatch: pytest.MonkeyPatch) -> None:
    let_commands_compile_once(monkeypatch)
    result = CliRunner().invoke(main, ["show", f"{EXAMPLE}:move_point", "--why"])
    assert result.exit_code == 0
    first, taken, *rest = result.output.splitlines()
    assert first.startswith("author's structure") and "36 mul, 33 add" in first and first.endswith("as written")
    assert taken.startswith("taken") and "21 mul, 18 add" in taken
    assert "saved: 30 of 69" in rest
    assert "proved zero in result 0: e1 e2 e0" in rest and "proved constant in result 0: e123 = 1" in rest
    assert max(map(len, result.output.splitlines())) <= 140


def test_every_step_of_the_one_taken_has_a_row(record: Compilation) -> None:
    assert record.best is not None
    saved = rows(record)
    done = [step for step in record.best.steps if step not in ("as written", "0 stages", "not reduced")]
    assert len(saved) == len(done) > 0
    total = record.candidates[0].cost.total - record.best.cost.total
    assert all(0 <= int(text.split(",")[0]) <= total for text in saved.values())


def test_a_step_saves_the_difference_to_the_cheapest_without_it(record: Compilation) -> None:
    made_up = made(
        record, 2, ("as written", 50), ("as written, 0 stages, not reduced, factorised", 40),
        ("as written, 2 stages, reduced, factorised, split_numbers", 30),
        ("as written, 1 stages, reduced, factorised", 33), ("as written, 0 stages, made sparse, factorised", 36),
        ("as written, 2 stages, not reduced, factorised, split_numbers", 38),
    )  # fmt: skip
    assert rows(made_up) == {
        "results named in 2 stages": "6, together with split_numbers",
        "reduced modulo the relations": "8",
        "factorised": "20, together with the others",
        "split_numbers": "3",
    }


def test_a_rewriting_is_compared_with_another_rewriting(record: Compilation) -> None:
    made_up = made(
        record, 1, ("as written", 50), ("sandwiches recognised, results by results, in differences, factorised", 30),
        ("as written, in differences, factorised", 35), ("as written, results by results, factorised", 41),
    )  # fmt: skip
    assert rows(made_up) == {
        "sandwiches recognised": "5, together with results by results",
        "results by results": "5, together with sandwiches recognised",
        "in differences": "11, together with sandwiches recognised",
        "factorised": "20, together with the others",
    }


def test_equally_cheap_candidates_with_fewer_steps_are_named(record: Compilation) -> None:
    made_up = made(
        record, 1, ("as written", 50), ("sandwiches recognised, 1 stages, factorised", 30),
        ("as written, 0 stages, factorised", 30),
    )  # fmt: skip
    assert "as cheap, with less  30 mul, 0 add  as written, 0 stages, factorised" in why(made_up)
    assert rows(made_up) == {
        "sandwiches recognised": "0",
        "results named in 1 stages": "0",
        "factorised": "20, together with the others",
    }


def test_nothing_is_claimed_where_nothing_was_tried(record: Compilation) -> None:
    made_up = made(record, 1, ("as written, 2 x 2 matrices", 50), ("as written, 2 x 2 matrices, factorised", 30))
    assert why(made_up).startswith("first candidate  50 mul")
    assert rows(made_up) == {"2 x 2 matrices": "unknown", "factorised": "20"}


def test_the_author_wins() -> None:
    @kernel(a=VGA3.VECTOR, b=VGA3.VECTOR)
    def dot_product(a, b):  # type: ignore[no-untyped-def]
        return (a * b)["1"]

    text = why(compile_kernel(dot_product))
    assert text.startswith("author's structure taken, 3 mul, 2 add: no accurate one of")


def test_candidates_that_lose_digits_are_reported_as_rejected() -> None:
    """``1 - cos**2`` is cheaper than ``sin**2`` and useless at small angles."""

    @kernel(r=VGA3.ROTOR)
    def squared_sine(r):  # type: ignore[no-untyped-def]
        return r["e12"] * r["e12"] + r["e13"] * r["e13"] + r["e23"] * r["e23"]

    text = why(compile_kernel(squared_sine))
    assert "rejected, because they lose digits: " in text and "the cheapest 1 mul, 1 add: as written" in text
    assert "units of error for ordinary arguments, 16 accepted" in text


def test_candidates_that_lose_digits_are_not_alternatives() -> None:
    @kernel(r=VGA3.ROTOR)
    def squared_sine(r):  # type: ignore[no-untyped-def]
        return r["e12"] * r["e12"] + r["e13"] * r["e13"] + r["e23"] * r["e23"]

    record = compile_kernel(squared_sine)
    bad = next(candidate for candidate in record.candidates if candidate.cost.mul == 1)
    author = record.candidates[0]
    steps = ("as written", "0 stages", "factorised")
    best = Candidate(steps, author.program, Cost(2, 0, 0, 0, 0, 0, 2))
    near = Candidate(("as written", "0 stages", "reduced"), bad.program, Cost(3, 0, 0, 0, 0, 0, 3))
    assert rows(replace(record, candidates=(author, best, near), best=best)) == {"factorised": "3"}


def test_weights_are_reported_where_they_matter(record: Compilation) -> None:
    assert "weights" not in why(record)
    root = Candidate(("as written",), record.program, Cost(36, 33, 1, 1, 0, 0, 70))
    text = why(replace(record, candidates=(root, *record.candidates[1:])))
    assert "saved: 46 of 85 (weights: div 8, sqrt 8)" in text


def test_limits_of_the_search_are_reported(record: Compilation) -> None:
    limits = ("7 systems of polynomials were too large",)
    for text in (why(replace(record, limits=limits)), stage_text(replace(record, limits=limits), "candidates")):
        assert text.splitlines()[-1] == f"not tried: {limits[0]}"
    for text in (why(replace(record, limits=())), stage_text(replace(record, limits=()), "candidates")):
        assert "not tried" not in text


def test_help_explains_why() -> None:
    text = CliRunner().invoke(main, ["show", "--help"]).output
    assert "--why" in text and "saves" in text and ":move --why" in text
