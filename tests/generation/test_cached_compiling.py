"""Results from the cache equal compiled ones, and invalid entries are not used."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gacompiler import kernel
from gacompiler.algebra.catalog import CGA3, VGA3
from gacompiler.errors import KernelError
from gacompiler.generation import compiling
from gacompiler.generation.cache import Cache
from gacompiler.generation.checked_in import own_specs
from gacompiler.generation.compiled import Compiled
from gacompiler.generation.compiling import compile_definition, compile_kernels, render_spec, rendered_before
from gacompiler.generation.fingerprint import PROGRAM_SOURCES, TEXT_SOURCES, digest, fingerprint
from gacompiler.generation.plain import packed, unpacked
from gacompiler.generation.spec_files import Spec, load_spec
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.passes.record import Compilation

ROOT = Path(__file__).parents[2]
SPEC = '''
"""A spec with a helper function and a kernel."""
from gacompiler import kernel
from gacompiler.algebra.catalog import PGA3

def helper(a, b):
    return a {operation} b

@kernel(a=PGA3.POINT, b=PGA3.POINT)
def combined(a, b):
    """Combine `a` and `b`."""
    return helper(a, b)
'''


@pytest.fixture
def cache(tmp_path: Path) -> Cache:
    (tmp_path / "cache").mkdir()
    return Cache(tmp_path / "cache")


def spec_of(folder: Path, operation: str = "&") -> Spec:
    path = folder / "combining.py"
    path.write_text(SPEC.format(operation=operation))
    return load_spec(path)


@pytest.fixture
def nothing_is_compiled(monkeypatch: pytest.MonkeyPatch) -> Any:
    """After a call of this fixture, compiling is an error."""

    def refuse(definition: Any) -> Any:
        raise AssertionError(f"{definition.name} is compiled")

    return lambda: monkeypatch.setattr(compiling, "compile_kernel", refuse)


FEW = {"geometric_product", "norm", "reflect_vector", "rotor_power", "rotor_to_matrix", "rotor_from_matrix"}


def test_cached_kernels_round_trip(cache: Cache, nothing_is_compiled: Any) -> None:
    """Compare every field and the types of numbers, with functions, branches, matrices and forms."""
    spec = load_spec(next(path for path in own_specs() if path.stem == "vga2"))
    spec = replace(spec, kernels=tuple(each for each in spec.kernels if each.name in FEW))
    assert len(spec.kernels) == len(FEW)
    first = compile_kernels(spec, cache=cache)
    assert [each.kernel for each in first] == list(spec.kernels)
    nothing_is_compiled()
    again = compile_kernels(spec, cache=cache)
    assert again == first and repr(again) == repr(first)
    assert any(each.source.uniform for each in first)


def test_modules_are_printed_once(cache: Cache, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spec = spec_of(tmp_path)
    assert rendered_before(spec, cache) is None and rendered_before(spec, None) is None
    files = render_spec(spec)
    assert render_spec(spec, cache=cache) == files
    monkeypatch.setattr(compiling, "render", None)
    monkeypatch.setattr(compiling, "compile_kernel", None)
    assert render_spec(spec, cache=cache) == rendered_before(spec, cache) == files
    with pytest.raises(TypeError):
        render_spec(spec)  # without a cache everything is computed again


def test_the_names_of_all_kernels_are_reported(cache: Cache, tmp_path: Path) -> None:
    reported: list[str] = []
    for _ in range(2):
        compile_kernels(spec_of(tmp_path), reported.append, cache)
    assert reported == ["combining.combined"] * 2


def test_a_changed_helper_is_compiled_again(cache: Cache, tmp_path: Path) -> None:
    (first,) = compile_kernels(spec_of(tmp_path), cache=cache)
    (second,) = compile_kernels(spec_of(tmp_path, "^"), cache=cache)
    assert first.source.program != second.source.program
    assert second == Compiled.of(compile_kernel(second.kernel))
    assert render_spec(spec_of(tmp_path), cache=cache) != render_spec(spec_of(tmp_path, "^"), cache=cache)


def test_a_changed_header_is_printed_again(cache: Cache, tmp_path: Path) -> None:
    spec = spec_of(tmp_path)
    texts = [
        render_spec(each, cache=cache)["combining.h"]
        for each in (spec, replace(spec, summary="Another."), replace(spec, command="make"), replace(spec, digest="0"))
    ]
    assert len(set(texts)) == 4


@pytest.mark.parametrize("wrong", [None, [], {}, {"program": []}, "text", {"combining.py": "", "other.c": ""}, 0])
def test_an_entry_of_another_form_is_replaced(wrong: Any, cache: Cache, tmp_path: Path) -> None:
    spec = spec_of(tmp_path)
    files, (compiled,) = render_spec(spec, cache=cache), compile_kernels(spec, cache=cache)
    keys = [path.name for path in cache.folder.iterdir()]
    assert len(keys) == 2
    for key in keys:
        cache.put(key, wrong)
    assert rendered_before(spec, cache) is None
    assert compile_kernels(spec, cache=cache) == [compiled] and render_spec(spec, cache=cache) == files
    assert rendered_before(spec, cache) == files


def test_partial_entries_are_not_used() -> None:
    compiled = Compiled.of(compile_kernel(product))
    whole = packed(compiled)
    assert unpacked(product, whole) == compiled
    for name in whole:
        with pytest.raises((LookupError, TypeError, ValueError)):
            unpacked(product, {k: v for k, v in whole.items() if k != name})


@kernel(a=VGA3.VECTOR, b=VGA3.VECTOR)
def product(a, b):  # type: ignore[no-untyped-def]
    """Multiply."""
    return a * b


def test_an_invalid_program_is_not_used(cache: Cache) -> None:
    """The program has a line with an undefined operand."""
    compiled = compile_definition(product, cache)
    (key,) = (path.name for path in cache.folder.iterdir())
    entry = cache.get(key)
    assert entry is not None
    entry["program"][2][3][2] = "t99"
    cache.put(key, entry)
    assert compile_definition(product, cache) == compiled


def test_errors_are_the_same_with_a_cache(cache: Cache) -> None:
    @kernel(a=VGA3.VECTOR, b=CGA3.POINT)
    def mixed(a, b):  # type: ignore[no-untyped-def]
        return a * b

    @kernel(a=VGA3.VECTOR, returns=VGA3.ROTOR)
    def unfit(a):  # type: ignore[no-untyped-def]
        return a

    for definition in (mixed, unfit):
        messages = set()
        for each in (None, cache, cache):
            with pytest.raises(KernelError) as caught:
                compile_definition(definition, each)
            messages.add(str(caught.value))
        assert len(messages) == 1 and definition.name in messages.pop()
    assert list(cache.folder.iterdir()) == []


def test_a_kernel_without_a_description_is_not_cached(cache: Cache) -> None:
    quotient = VGA3.layout("QUOTIENT", "e1 e2", implied={"e3": lambda x: x["e1"] / x["e2"]})

    @kernel(a=quotient)
    def norm(a):  # type: ignore[no-untyped-def]
        return a * a

    assert compile_definition(norm, cache).source.cost.div == 1
    product = VGA3.layout("PRODUCT", "e1 e2", implied={"e3": lambda x: x["e1"] * x["e2"]})
    assert list(cache.folder.iterdir()) == []
    compile_definition(kernel(a=product)(norm.function), cache)
    assert len(list(cache.folder.iterdir())) == 1


def test_a_digest_is_of_names_and_contents(tmp_path: Path) -> None:
    def now(newest: int = 2**63) -> str | None:
        return digest(tmp_path, ("a.py", "folder"), newest)

    assert now() is None, "there are no sources"
    (tmp_path / "folder" / "__pycache__").mkdir(parents=True)
    found = []
    for name, text in [("a.py", "x"), ("a.py", "y"), ("folder/b.py", ""), ("folder/c.jinja", ""), ("folder/b.py", "x")]:
        (tmp_path / name).write_text(text)
        found.append(now())
    (tmp_path / "folder" / "c.jinja").rename(tmp_path / "folder" / "d.jinja")
    found.append(now())
    assert len(set(found)) == 6 and None not in found
    (tmp_path / "folder" / "__pycache__" / "b.pyc").write_text("x")
    (tmp_path / "another.py").write_text("x")
    (tmp_path / "folder" / ".#b.py").symlink_to("nobody@host")  # as editors lock files
    assert now() == found[-1]
    os.utime(tmp_path / "folder" / "b.py", ns=(0, 10**18))
    for path in ("a.py", "folder/d.jinja"):
        os.utime(tmp_path / path, ns=(0, 0))
    assert now(10**18) == found[-1] and now(10**18 - 1) is None, "this is not the source that runs"


def loaded_by(module: str) -> set[str]:
    code = f"import sys, {module}; print(*(getattr(m, '__file__', None) for m in list(sys.modules.values())))"
    alone = {"gacompiler.passes.pipeline": "import gacompiler.algebra.catalog; "}.get(module, "")
    done = subprocess.run([sys.executable, "-c", alone + code], cwd=ROOT, capture_output=True, text=True, check=True)
    paths = [Path(word) for word in done.stdout.split() if word.endswith(".py")]
    package = ROOT / "gacompiler"
    return {path.relative_to(package).as_posix() for path in paths if package in path.parents}


ABOVE = (
    *("__init__.py", "extras.py", "load_time.py", "packages.py"),
    *("derivatives/", "robots/", "cluscript/", "scripts.py"),
)
"""Modules that the package itself loads: it creates definitions, which are traced before they are looked up."""


@pytest.mark.parametrize(
    ("module", "sources"),
    [("gacompiler.passes.pipeline", PROGRAM_SOURCES), ("gacompiler.generation.rendering", TEXT_SOURCES)],
)
def test_no_source_is_forgotten(module: str, sources: tuple[str, ...]) -> None:
    known = tuple(name if name.endswith(".py") else f"{name}/" for name in sources)
    forgotten = {name for name in loaded_by(module) if not name.startswith(known + ABOVE)}
    assert forgotten == set()


def test_no_cache_is_used_while_the_sources_are_not_known(
    cache: Cache, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process whose sources were edited after its start would store results of the old ones under the new hash."""
    monkeypatch.setattr(compiling, "fingerprint", lambda sources: None)
    spec = spec_of(tmp_path)
    assert render_spec(spec, cache=cache) == render_spec(spec)
    assert compile_definition(product, cache) == compile_definition(product)
    assert list(cache.folder.iterdir()) == []


COMPILE = """
import sys
from pathlib import Path
from gacompiler.generation.cache import Cache
from gacompiler.generation import compiling
from gacompiler.generation.spec_files import load_spec
n_compiled = 0
def counted(kernel, compile_kernel=compiling.compile_kernel, **options):
    global n_compiled
    n_compiled += 1
    return compile_kernel(kernel, **options)
compiling.compile_kernel = counted
before = compiling.rendered_before(load_spec(Path(sys.argv[1])), Cache(Path(sys.argv[2]))) is not None
compiling.render_spec(load_spec(Path(sys.argv[1])), cache=Cache(Path(sys.argv[2])))
print(n_compiled, before)
"""


@pytest.mark.slow
def test_changes_of_compiler_and_printer_invalidate_their_entries(cache: Cache, tmp_path: Path) -> None:
    spec_of(tmp_path)
    shutil.copytree(ROOT / "gacompiler", tmp_path / "copy" / "gacompiler", ignore=shutil.ignore_patterns("__pycache__"))

    def compiled(change: str = "") -> str:
        if change:
            path = tmp_path / "copy" / "gacompiler" / change
            path.write_text(path.read_text() + "\n\n")
        done = subprocess.run(
            [sys.executable, "-c", COMPILE, str(tmp_path / "combining.py"), str(cache.folder)],
            cwd=tmp_path / "copy", env={**os.environ, "PYTHONPATH": str(tmp_path / "copy")},
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        return done.stdout.strip()

    assert [compiled(), compiled()] == ["1 False", "0 True"]
    assert [compiled("passes/factor.py"), compiled()] == ["1 False", "0 True"]
    assert [compiled("backends/c.py"), compiled()] == ["0 False", "0 True"]
    assert compiled("objects/draw.py") == "0 True"


def test_the_sources_of_this_process_are_known() -> None:
    program, text = fingerprint(PROGRAM_SOURCES), fingerprint(TEXT_SOURCES)
    assert program is not None and text is not None and program != text


def test_only_proved_kernels_are_cached(cache: Cache, monkeypatch: pytest.MonkeyPatch) -> None:
    def unproved(definition: Any, effort: int, cost: str) -> Compilation:
        raise KernelError(definition.name, "it is not proved")

    monkeypatch.setattr(compiling, "compile_kernel", unproved)
    with pytest.raises(KernelError, match="not proved"):
        compile_definition(product, cache)
    assert list(cache.folder.iterdir()) == []
