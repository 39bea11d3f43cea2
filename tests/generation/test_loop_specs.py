"""Kernels with loops in specs: compiled once, cached, shown, counted, and proved from their text."""

from __future__ import annotations

import functools
import json
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result
from loop_examples import HARD

import gacompiler
from gacompiler import SCALAR, array, kernel
from gacompiler.backends import body_is_intact, build_module, runtime_files
from gacompiler.cli import main, showing
from gacompiler.errors import KernelError
from gacompiler.frontend.loops import fold, total
from gacompiler.frontend.recorded import computes
from gacompiler.generation import compiling
from gacompiler.generation.cache import Cache
from gacompiler.generation.compiled import Compiled, CompiledLoops
from gacompiler.generation.compiling import compile_kernels, source_of
from gacompiler.generation.files import write
from gacompiler.generation.plain_loops import packed_procedure, procedure_of
from gacompiler.generation.rendering import TARGETS, render, render_targets
from gacompiler.generation.spec_files import Spec, load_spec
from gacompiler.ir.procedure import Apply, Procedure, Statement, statements
from gacompiler.passes.loops import compile_loops
from gacompiler.runtime import load_module
from gacompiler.verify import verify_module
from gacompiler.verify_loops import loops_difference, part_truths

SPEC = '''
"""A spec with loops."""
from gacompiler import SCALAR, array, cos, index, kernel, sin
from gacompiler.algebra.catalog import PGA3
from gacompiler.frontend.loops import accumulate, fold, gather, iterate, scan, scatter, total

STEP = {step}

def exponential(angle, axis):
    return cos(angle / 2) - sin(angle / 2) * axis

@kernel(m=PGA3.MOTOR, p=PGA3.POINT)
def move(m, p):
    """Move a point."""
    return m * p * ~m

@kernel(q=array(SCALAR, "n"), axes=array(PGA3.LINE, "n", shared=True), tool=PGA3.MOTOR)
def forward(q, axes, tool):
    """Pose of the end effector."""
    return fold(lambda m, angle, axis: m * exponential(angle * STEP, axis), 1, q, axes) * tool

@kernel(x=array(SCALAR, "n"), parents=index("n"), which=index("n", into="m"), y=array(SCALAR, "m"), a=SCALAR)
def tree(x, parents, which, y, a):
    """Sums along a tree."""
    up = scan(lambda s, v: s + a * v, 0, x, parents=parents)
    return up, accumulate(lambda c, v: c + v, 0, up, parents=parents), scatter(gather(y, which), which, y)

@kernel(a=SCALAR, x=array(SCALAR, "n"))
def root(a, x):
    """Square root of `a` plus a sum of squares."""
    s = total(lambda v: v * v, x) + a * a + 1
    found, converged, _ = iterate(lambda r: (r + s / r) / 2, s, lambda old, new: old - new < 1e-12, 40)
    return found, converged
'''


def spec_of(folder: Path, step: str = "1") -> Spec:
    path = folder / "looping.py"
    path.write_text(SPEC.format(step=step))
    return load_spec(path)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the spec, and with the cache of its compiled kernels."""
    found = tmp_path_factory.mktemp("spec")
    (found / "gac_cache" / "compilations").mkdir(parents=True, mode=0o700)
    (found / "gac_cache").chmod(0o700)
    return found


@pytest.fixture(scope="module")
def cache(folder: Path) -> Cache:
    return Cache(folder / "gac_cache" / "compilations")


@pytest.fixture(scope="module")
def compiled(folder: Path, cache: Cache) -> tuple[Spec, list[Compiled | CompiledLoops]]:
    """The spec and its compiled kernels."""
    spec = spec_of(folder)
    return spec, list(compile_kernels(spec, cache=cache))


@pytest.fixture
def loops(compiled: tuple[Spec, list[Compiled | CompiledLoops]]) -> list[CompiledLoops]:
    return [each for each in compiled[1] if isinstance(each, CompiledLoops)]


def run(*words: str) -> Result:
    return CliRunner().invoke(main, list(words))


# Compiling and caching.


def test_cached_kernels_round_trip(
    compiled: tuple[Spec, list[Compiled | CompiledLoops]], cache: Cache, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiling, "compile_loops", None)
    monkeypatch.setattr(compiling, "compile_kernel", None)
    spec, first = compiled
    for a, b in zip(first, compile_kernels(spec, cache=cache), strict=True):
        assert a.source == b.source and repr(a.source) == repr(b.source)
        if isinstance(a, CompiledLoops) and isinstance(b, CompiledLoops):
            assert a.parts == b.parts


def test_a_changed_constant_is_compiled_again(
    compiled: tuple[Spec, list[Compiled | CompiledLoops]], cache: Cache, tmp_path: Path
) -> None:
    second = compile_kernels(spec_of(tmp_path, "2"), cache=cache)
    changed = [a.kernel.name for a, b in zip(compiled[1], second, strict=True) if a.source != b.source]
    assert changed == ["forward"]


def test_procedures_as_plain_data(loops: list[CompiledLoops]) -> None:
    for record in loops:
        data = json.loads(json.dumps(packed_procedure(record.source.procedure)))
        assert procedure_of(data) == record.source.procedure


def test_docstring_of_a_kernel_with_loops(loops: list[CompiledLoops]) -> None:
    forward, tree, _ = (record.source for record in loops)
    assert [name for name, _ in forward.layouts] == ["q", "axes", "tool", "out"]
    assert [name for name, _ in tree.layouts] == ["x", "y", "a", "out_0", "out_1", "out_2"]
    assert forward.relations == ("tool ~tool = 1",) and forward.summary == "Pose of the end effector."
    worst, rest = forward.error.split(" ulp, ")
    assert 0 < float(worst) < 20 and rest == "64 inputs"
    assert [often for often, _ in forward.costs] == ["n", ""]
    assert dict(tree.costs)["n"].add == 1 + 2 + 1


def test_modules_have_loops_after_other_kernels(
    compiled: tuple[Spec, list[Compiled | CompiledLoops]],
) -> None:
    module = source_of(*compiled)
    assert [each.program.name for each in module.kernels] == ["move"]
    assert [each.procedure.name for each in module.loops] == ["forward", "tree", "root"]
    for name, text in render_targets(module, TARGETS).items():
        places = [text.index(words) for words in ("Move a point.", "Pose of the end effector.", "Square root of")]
        assert body_is_intact(text) and places == sorted(places), name


# Proof.


def test_the_compiled_procedure_is_proved(loops: list[CompiledLoops]) -> None:
    for record in loops:
        assert not loops_difference(record.source.procedure, record, part_truths(record))
        assert loops_difference(None, record, []) == "is not there"


def with_body(procedure: Procedure, change: Any) -> Procedure:
    """Apply a function to every statement of a procedure."""

    def changed(statement: Statement) -> Statement:
        inner = getattr(statement, "body", None)
        own: Statement = change(statement)
        return own if inner is None else replace(own, body=tuple(map(changed, inner)))  # type: ignore[call-arg]

    return replace(procedure, body=tuple(map(changed, procedure.body)))


def test_wrong_loops_and_programs_are_detected(loops: list[CompiledLoops]) -> None:
    record, *_ = loops
    known, own = part_truths(record), record.source.procedure
    assert len(known) == len(computes(record.trace.statements)) == 3

    def backwards(statement: Any) -> Any:
        return replace(statement, reverse=True) if hasattr(statement, "reverse") else statement

    assert "has the statement" in loops_difference(with_body(own, backwards), record, known)
    for number in range(1, 4):

        def negated(statement: Any, name: str = f"forward_{number}") -> Any:
            if not isinstance(statement, Apply) or statement.program.name != name:
                return statement
            (result,) = statement.program.results
            swapped = replace(result, operands=(result.operands[1], result.operands[0], *result.operands[2:]))
            return replace(statement, program=replace(statement.program, results=(swapped,)))

        assert f"forward_{number}: entry" in loops_difference(with_body(own, negated), record, known)
    fewer = replace(own, tables=own.tables[:-1])
    assert "tables, expected" in loops_difference(fewer, record, known)
    other = replace(own, tables=(replace(own.tables[0], shared=True), *own.tables[1:]))
    assert "has the table" in loops_difference(other, record, known)
    assert [s for s in statements(own.body) if isinstance(s, Apply)]


# The command line.


@pytest.fixture
def spec_path(
    compiled: tuple[Spec, list[Compiled | CompiledLoops]], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> str:
    monkeypatch.setenv("GAC_CACHE", str(folder / "gac_cache"))
    return str(compiled[0].path)


def test_cost(spec_path: str) -> None:
    counts = json.loads(run("cost", spec_path, "--json").output)
    assert counts["forward"]["n"]["mul"] == 51 and counts["forward"]["once"]["mul"] == 48
    assert list(counts["root"]) == ["once", "n", "steps"] and "mul" in counts["move"]
    text = run("cost", spec_path).output
    assert "n * (51 mul" in text and "+ 48 mul, 40 add" in text and "move" in text


def test_list(spec_path: str) -> None:
    text = run("list", spec_path).output
    for words in ("PGA3.LINE[n]", "index n into m", "forward", "Sums along a tree."):
        assert words in " ".join(text.split()), words


def test_show(
    spec_path: str, compiled: tuple[Spec, list[Compiled | CompiledLoops]], monkeypatch: pytest.MonkeyPatch
) -> None:
    kernels = {each.name: each for each in compiled[0].kernels}
    once = functools.cache(lambda name: compile_loops(kernels[name]))
    monkeypatch.setattr(showing, "compile_loops", lambda kernel, **_: once(kernel.name))
    text = run("show", f"{spec_path}:forward").output
    assert "for i in n:" in text and "m: PGA3.EVEN stores 1 e12" in text and "m = forward_2(m, q[i], axes[i])" in text
    assert "forward_2(m(8), angle(), axis(6)) -> " in text
    for stage in ("rewrite", "decide", "lower", "candidates"):
        shown = run("show", f"{spec_path}:forward", "--stage", stage)
        assert shown.exit_code == 0 and "forward_1\n" in shown.output and "forward_3\n" in shown.output, stage
    assert "forward_2\n" in run("show", f"{spec_path}:forward", "--why").output
    refused = run("show", f"{spec_path}:forward", "--latex")
    assert refused.exit_code == 1 and "cannot be printed as LaTeX" in refused.output
    assert "no stage 'procedure'" in run("show", f"{spec_path}:move", "--stage", "procedure", "--effort", "0").output
    assert "no stage 'uniform'" in run("show", f"{spec_path}:forward", "--stage", "uniform").output


# Modules.


@pytest.fixture(scope="module")
def hard(tmp_path_factory: pytest.TempPathFactory) -> tuple[Spec, list[Compiled | CompiledLoops], Path]:
    """The spec of hard kernels, its compiled kernels, and the folder of their module."""
    spec = load_spec(Path(__file__).parents[1] / "support" / "loop_examples.py")
    names = {definition.name for definition in HARD}
    spec = replace(spec, kernels=tuple(each for each in spec.kernels if each.name in names))
    found, folder = list(compile_kernels(spec, effort=0)), tmp_path_factory.mktemp("hard")
    write(runtime_files() | render(source_of(spec, found)), folder)
    return spec, found, folder


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["c", "numba", "arrays"])
def test_hard_kernels_are_proved_and_run(backend: str, hard: tuple[Spec, list[Compiled | CompiledLoops], Path]) -> None:
    spec, compiled, folder = hard
    if backend == "c" and build_module(folder / "loop_examples.c") is None:
        pytest.skip("no C compiler")
    module = load_module(folder / "loop_examples.py", f"_hard_{backend}", backend)
    # The same text is proved for every backend, and numba takes half a second for each kernel.
    some = slice(None, None, 5 if backend == "numba" else 1)
    verdicts = verify_module(folder, spec.name, compiled[some], module)
    assert [verdict.kernel for verdict in verdicts] == [each.name for each in spec.kernels][some]
    for verdict in verdicts:
        assert verdict.is_proved and verdict.error < 20, verdict


@kernel(x=array(SCALAR, "n"), a=SCALAR)
def polynomial(x: Any, a: Any) -> Any:
    """A polynomial by Horner's rule."""
    return fold(lambda s, c: s * a + c, 0, x)


def test_compiled_kernels_are_called_and_pickled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GAC_CACHE", str(tmp_path / "gac_cache"))
    (tmp_path / "gac_cache").mkdir(mode=0o700)
    run = gacompiler.compile(polynomial, "arrays")
    assert run([1.0, 2.0, 3.0], 10.0) == 123 and run([[1.0], [2.0]], 10.0).tolist() == [1, 2]
    assert pickle.loads(pickle.dumps(run)) is run and pickle.loads(pickle.dumps(polynomial)) is polynomial

    @kernel(x=array(SCALAR, "n"))
    def local(x: Any) -> Any:
        return total(lambda a: a, x)

    with pytest.raises(KernelError, match="not an attribute of its module"):
        pickle.dumps(local)
