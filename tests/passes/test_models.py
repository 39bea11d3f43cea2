"""Selection by other cost models: never worse than the default in the model, same layouts, same values."""

from __future__ import annotations

import json
import re
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from compiled_once import compiled_once
from example_kernels import move_point as moved
from selection import some_slow

import gacompiler
from gacompiler import kernel, normalize, sandwich
from gacompiler.algebra.catalog import PGA2, VGA3
from gacompiler.cli import main
from gacompiler.errors import KernelError
from gacompiler.frontend.kernel import Kernel
from gacompiler.generation.cache import Cache
from gacompiler.generation.compiling import compile_definition
from gacompiler.inspect import compared, why
from gacompiler.ir.cost import cost
from gacompiler.ir.cost_models import COUNTS, MODELS
from gacompiler.ir.interpret import Tape
from gacompiler.ir.program import Argument, Program
from gacompiler.ir.scalar import Graph, Op
from gacompiler.passes.divide import divide_each
from gacompiler.passes.reassociate import balanced, plain_terms_first
from gacompiler.passes.record import Compilation
from gacompiler.passes.schedule import schedule
from tests.support.all_cases import all_cases

DIRECTIONS = """from gacompiler import kernel, normalize
from gacompiler.algebra.catalog import VGA3

@kernel(v=VGA3.VECTOR)
def direction(v):
    return normalize(v)
"""
MODES = [name for name in MODELS if name != COUNTS.name]


@kernel(m=PGA2.MOTOR, p=PGA2.POINT)
def moved_in_the_plane(m: Any, p: Any) -> Any:
    return sandwich(m, p)


@kernel(v=VGA3.VECTOR)
def direction(v: Any) -> Any:
    return normalize(v)


def compiled(definition: Kernel, model: str = COUNTS.name) -> Compilation:
    if model == COUNTS.name:
        return compiled_once(definition, forms=False, effort=1)
    return compiled_once(definition, forms=False, cost=model)


@pytest.mark.parametrize("name", MODES)
@pytest.mark.parametrize(
    "definition", some_slow([moved, moved_in_the_plane, direction], moved), ids=lambda each: each.name
)
def test_a_model_selects_no_worse_a_program_than_the_default(definition: Kernel, name: str) -> None:
    usual, found = compiled(definition), compiled(definition, name)
    assert usual.decision is not None and found.decision is not None
    assert found.decision.layouts == usual.decision.layouts
    assert found.model is MODELS[name] and usual.model is COUNTS
    assert MODELS[name].of(found.program) <= MODELS[name].of(usual.program)
    assert usual.cost.total <= found.cost.total
    assert set(usual.candidates) <= set(found.candidates)


def test_the_models_differ() -> None:
    for name, each in (("latency", moved_in_the_plane), ("fma", moved), ("size", direction)):
        assert MODELS[name].of(compiled(each, name).program) < MODELS[name].of(compiled(each).program), name


def _random_program(seed: int) -> Program:
    """Return a program of long sums of products, some of which are shared, with divisions by a reciprocal."""
    rng, graph = Random(seed), Graph()
    inputs = [graph.variable(name) for name in "abcdefgh"]
    values = list(inputs)
    for _ in range(rng.randint(6, 25)):
        x, y = rng.sample(values[-12:], 2)
        values.append(rng.choice([x + y, x - y, x * y, x * y, -x + y]))
    results = [value for value in values[-4:] if value.op not in (Op.VARIABLE, Op.CONSTANT)]
    reciprocal = 1 / (inputs[0] * inputs[0] + 1)
    scaled = tuple(value * reciprocal for value in results)
    return schedule("f", tuple(Argument(n, (), (n,)) for n in "abcdefgh"), (("out", (len(scaled),), scaled),))


@all_cases("seed", range(40))
def test_changes_for_models_preserve_values(seed: int) -> None:
    program, rng = _random_program(seed), Random(seed)
    (result,) = program.results
    numbers = [Fraction(rng.randint(-50, 50), rng.randint(1, 9)) for _ in program.arguments]
    expected = Tape(program).run(numbers, Fraction)
    for change in (balanced, plain_terms_first, divide_each):
        scalars = change(program)
        assert scalars is not None
        found = schedule("f", program.arguments, ((result.name, result.shape, scalars),))
        assert Tape(found).run(numbers, Fraction) == expected
        assert MODELS["size"].of(found) <= MODELS["size"].of(program)
        if change is not divide_each:
            assert cost(found).total <= cost(program).total
        if change is plain_terms_first:
            assert MODELS["fma"].of(found) <= MODELS["fma"].of(program)


def test_a_long_sum_is_balanced() -> None:
    graph = Graph()
    a, *others = (graph.variable(name) for name in "abcdefgh")
    for each in others:
        a = a + each
    arguments = tuple(Argument(n, (), (n,)) for n in "abcdefgh")
    chain = schedule("f", arguments, (("out", (), (a,)),))
    tree = schedule("f", arguments, (("out", (), balanced(chain)),))
    assert (MODELS["latency"].of(chain), MODELS["latency"].of(tree)) == (28, 13)


def test_no_reciprocal_is_replaced_that_is_a_result() -> None:
    graph = Graph()
    reciprocal = 1 / graph.variable("a")
    arguments = (Argument("a", (), ("a",)), Argument("b", (), ("b",)))
    pair = (reciprocal, reciprocal * graph.variable("b"))
    assert divide_each(schedule("f", arguments, (("out", (2,), pair),))) is None


def test_compiled_functions_agree_in_all_models() -> None:
    v = np.random.default_rng(3).uniform(-1, 1, (5, 3))
    functions = {name: gacompiler.compile(direction, "arrays", cost=name) for name in MODELS}
    for name, function in functions.items():
        expected = v / np.linalg.norm(v, axis=1)[:, None]
        np.testing.assert_allclose(function(v), expected, atol=1e-14, err_msg=name)
    assert functions["size"] is gacompiler.compile(direction, "arrays", cost="size")
    assert functions["size"] is not gacompiler.compile(direction, "arrays")
    with pytest.raises(KernelError, match="cost: 'speed'; expected one of counts"):
        gacompiler.compile(direction, "arrays", cost="speed")


def test_models_are_cached_apart(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    found = [compile_definition(direction, cache, 1, name).source.program for name in ("counts", "size") * 2]
    assert found[0] == found[2] != found[1] == found[3]
    assert len(list(tmp_path.iterdir())) == 2


def test_explanations_name_the_model() -> None:
    record = compiled(moved_in_the_plane, "latency")
    text = why(record)
    assert f"cost model latency: {MODELS['latency'].counted}" in text
    assert f"{record.cost}: {record.value(record.best)} cycles" in text if record.best else False
    assert "cycles" in compared(record)
    usual = compiled(moved_in_the_plane)
    assert "cost model" not in why(usual) and "cycles" not in compared(usual)


@pytest.mark.slow
def test_commands_have_the_option(tmp_path: Path) -> None:
    file = tmp_path / "directions.py"
    file.write_text(DIRECTIONS)
    run = CliRunner()
    explained = run.invoke(main, ["cost", "--explain"])
    assert explained.exit_code == 0
    assert all(model.counted in explained.output for model in MODELS.values())
    counted = run.invoke(main, ["cost", str(file), "--cost", "latency", "--json"])
    assert json.loads(counted.output)["direction"]["cost"] == MODELS["latency"].of(
        compiled(direction, "latency").program
    )
    assert "latency (cycles)" in run.invoke(main, ["cost", str(file), "--cost", "latency"]).output
    assert run.invoke(main, ["cost", str(file), "--cost", "speed"]).exit_code == 2
    out = tmp_path / "out"
    made = run.invoke(main, ["generate", str(file), "-o", str(out), "--cost", "latency", "--no-build"])
    assert made.exit_code == 0, made.output
    assert "directions.py --cost latency\n" in (out / "directions.py").read_text()
    verified = run.invoke(main, ["verify", str(file), "-o", str(out), "--cost", "latency", "--json"])
    assert verified.exit_code == 0 and '"proved": true' in verified.output


@pytest.mark.slow
def test_the_example_of_the_page_runs() -> None:
    text = (Path(__file__).parents[2] / "docs" / "cost-models.md").read_text()
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    exec(compile(block, "docs/cost-models.md", "exec"), {"__name__": "cost_models"})
