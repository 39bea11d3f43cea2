"""Effort levels: each keeps what the level below found, results are the same, and records say what is missing."""

from __future__ import annotations

import math
import signal
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from compiled_once import compiled_once, let_commands_compile_once
from example_kernels import move_point as moved
from selection import some_slow

import gacompiler
from gacompiler import acos, kernel, sandwich
from gacompiler.algebra.catalog import CGA3, VGA2, VGA3
from gacompiler.cli import main
from gacompiler.errors import KernelError
from gacompiler.frontend.kernel import Kernel
from gacompiler.generation.cache import Cache
from gacompiler.generation.compiling import compile_definition
from gacompiler.ir.cost import cost
from gacompiler.passes import interruption
from gacompiler.passes.effort import LEVELS, effort_of
from gacompiler.passes.interruption import interruptible, is_interrupted, reporting
from gacompiler.passes.pipeline import INTERRUPTED, NO_SEARCH, compile_kernel
from tests.support.all_cases import all_cases

EXAMPLE = Path(__file__).parents[1] / "support" / "example_kernels.py"


@kernel(m=VGA3.ROTOR, n=VGA3.ROTOR, v=VGA3.VECTOR)
def moved_twice(m: Any, n: Any, v: Any) -> Any:
    return sandwich(m * n, v) + v


@kernel(m=VGA2.ROTOR, v=VGA2.VECTOR)
def turned_in_the_plane(m: Any, v: Any) -> Any:
    return sandwich(m, v) + v


@kernel(a=CGA3.POINT, b=CGA3.POINT, c=CGA3.POINT)
def circle(a: Any, b: Any, c: Any) -> Any:
    return a ^ b ^ c


@pytest.mark.slow
def test_limits_of_work_end_a_search_and_not_the_compilation() -> None:
    """The forms of this kernel for uniform arguments exceed the limit on products of polynomials."""

    @kernel(m=CGA3.MOTOR, k=CGA3.MOTOR, x=CGA3.POINT)
    def by_two_motors(m: Any, k: Any, x: Any) -> Any:
        return sandwich(m, sandwich(k, x))

    @kernel(m=CGA3.MOTOR, x=CGA3.POINT)
    def by_one(m: Any, x: Any) -> Any:
        return sandwich(m, x)

    two, one = (cost(compile_kernel(each).program).total for each in (by_two_motors, by_one))
    assert two <= 2 * one


@pytest.mark.parametrize(
    "definition", some_slow([moved, circle, moved_twice], circle, moved_twice), ids=lambda each: each.name
)
def test_a_higher_level_never_costs_more_and_stores_the_same(definition: Kernel) -> None:
    records = [compiled_once(definition, forms=False, effort=level) for level in range(3)]
    totals = [record.cost.total for record in records]
    assert totals == sorted(totals, reverse=True)
    assert totals[1] < totals[0]
    assert len({record.decision.layouts for record in records if record.decision}) == 1
    assert [record.effort for record in records] == list(LEVELS[:3])


def test_level_0_is_the_structure_of_the_author() -> None:
    record = compiled_once(moved, effort=0)
    (only,) = record.candidates
    assert only is record.best and only.origin == "as written" and record.uniform == ()
    assert only.cost == compiled_once(moved, forms=False, effort=1).candidates[0].cost
    assert record.limits == (NO_SEARCH,)


def test_limits_grow_with_the_level() -> None:
    for lower, higher in pairwise(LEVELS):
        limits = [(getattr(lower, name), getattr(higher, name)) for name in lower.__slots__]
        assert all(a < b for a, b in limits)


@all_cases("level", [-1, 4, 1.0, "1", True, None])
def test_other_levels_are_refused(level: Any) -> None:
    with pytest.raises(KernelError, match=r"effort: .*; expected a level from 0 to 3"):
        effort_of(level)


def test_compiled_functions_agree_at_all_levels() -> None:
    random = np.random.default_rng(1)
    angle = random.uniform(-1, 1, 5)
    m = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    v = random.uniform(-1, 1, (5, 2))
    c, s = np.cos(2 * angle), np.sin(2 * angle)
    turned = np.stack([c * v[:, 0] + s * v[:, 1], c * v[:, 1] - s * v[:, 0]], axis=-1)
    for level in range(2):
        found = gacompiler.compile(turned_in_the_plane, "arrays", effort=level)(m, v)
        np.testing.assert_allclose(found, turned + v, atol=1e-14)


def test_levels_are_cached_apart(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    costs = [compile_definition(turned_in_the_plane, cache, level).source.cost for level in (0, 1, 0, 1)]
    assert costs[0] == costs[2] != costs[1] == costs[3]
    assert len(list(tmp_path.iterdir())) == 2


def test_options_of_commands(monkeypatch: pytest.MonkeyPatch) -> None:
    let_commands_compile_once(monkeypatch)
    runs = {
        level: CliRunner().invoke(main, ["show", f"{EXAMPLE}:move_point", "--effort", level, "--why"]).output
        for level in "01"
    }
    assert f"not tried: {NO_SEARCH}" in runs["0"] and "36 mul, 33 add" in runs["0"]
    assert "21 mul, 18 add" in runs["1"]
    refused = CliRunner().invoke(main, ["cost", str(EXAMPLE), "--effort", "4"])
    assert refused.exit_code == 2 and "0<=x<=3" in refused.output


def test_progress_is_reported_for_each_better_candidate() -> None:
    texts: list[str] = []
    with reporting(texts.append):
        record = compile_kernel(moved, forms=False)
    assert texts[0] == f"best so far: move_point: {record.candidates[0].cost}"
    assert texts[-1] == f"best so far: move_point: {record.cost}"
    compile_kernel(turned_in_the_plane)
    assert len(texts) == len(set(texts)), "nothing is reported afterwards"


@pytest.fixture
def interrupted_search(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Raise SIGINT once the author's form has been built, as Ctrl-C would."""
    sent: list[bool] = []

    def report(text: str) -> None:
        if not sent:
            sent.append(True)
            signal.raise_signal(signal.SIGINT)

    with reporting(report):
        yield
    assert sent


@pytest.mark.usefixtures("interrupted_search")
def test_an_interrupt_keeps_the_best_result(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    before = signal.getsignal(signal.SIGINT)
    with interruptible():
        compiled = compile_definition(moved, cache, 3)
        record = compile_kernel(moved, effort=3)
        assert is_interrupted()
    assert signal.getsignal(signal.SIGINT) is before and not is_interrupted()
    assert INTERRUPTED in record.limits
    best = compiled_once(moved, forms=False, effort=1).cost.total
    assert best <= compiled.source.cost.total <= record.candidates[0].cost.total
    assert not list(tmp_path.iterdir()), "an interrupted search is not cached"


@pytest.mark.usefixtures("interrupted_search")
def test_commands_say_that_they_were_interrupted() -> None:
    result = CliRunner().invoke(main, ["show", f"{EXAMPLE}:move_point", "--effort", "3", "--why"])
    assert result.exit_code == 0
    assert "interrupted: kept the best results so far; cheaper ones may exist" in result.stderr
    assert result.stderr.count("\n") == 1
    assert f"not tried: {INTERRUPTED}" in result.stdout


def test_a_second_interrupt_ends_the_command() -> None:
    with pytest.raises(KeyboardInterrupt), interruptible():
        signal.raise_signal(signal.SIGINT)
        assert is_interrupted()
        signal.raise_signal(signal.SIGINT)
    assert not is_interrupted() and not interruption.is_interruptible()


def test_texts_of_deep_expressions_are_short() -> None:
    @kernel(a=VGA3.VECTOR, b=VGA3.EVEN)
    def arc_cosine(a: Any, b: Any) -> Any:
        return acos(power_tower(a, b))

    definition = kernel(a=VGA3.VECTOR, b=VGA3.EVEN)(power_tower)
    assert len(repr(definition.traced())) < 3000
    assert len(str(definition.traced().function.value)) <= 10_000
    with pytest.raises(KernelError) as error:
        compile_kernel(arc_cosine)
    assert len(str(error.value)) < 1500 and " ... " in str(error.value)


def power_tower(a: Any, b: Any) -> Any:
    x = a * b
    for _ in range(60):
        x = x * x + b
    return x


def test_residues_replace_long_fractions() -> None:
    """A power of degree 3**8 with rational coefficients, whose values have more than 40 000 digits."""

    @kernel(v=VGA3.EVEN)
    def power(v: Any) -> Any:
        x = v
        for _ in range(8):
            x = x * x * x
        return x

    record = compile_kernel(power, effort=0)
    random = Random(4)
    angle = random.uniform(-1, 1)
    run = gacompiler.compile(power, "arrays", effort=0)
    found = run(np.array([math.cos(angle), math.sin(angle), 0.0, 0.0]))
    expected = [math.cos(3**8 * angle), math.sin(3**8 * angle), 0, 0]
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert record.cost.div == 0


@pytest.mark.slow
def test_modules_of_level_0_are_verified(tmp_path: Path) -> None:
    run = CliRunner()
    made = run.invoke(main, ["generate", str(EXAMPLE), "-o", str(tmp_path), "--effort", "0", "--no-build"])
    assert made.exit_code == 0, made.output
    result = run.invoke(main, ["verify", str(EXAMPLE), "-o", str(tmp_path), "--effort", "0", "--json"])
    assert result.exit_code == 0 and '"proved": true' in result.output
