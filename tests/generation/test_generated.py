"""The checked-in modules equal the output of their specs and are proved; `make check` does both for all of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from gacompiler.backends import body_is_intact
from gacompiler.generation.cache import open_cache
from gacompiler.generation.checked_in import generated_folder, own_specs
from gacompiler.generation.compiling import compile_kernels, source_of
from gacompiler.generation.files import compare
from gacompiler.generation.rendering import render
from gacompiler.generation.spec_contents import digest_of
from gacompiler.generation.spec_files import load_spec
from gacompiler.runtime import load_module
from gacompiler.verify import verify_module


@pytest.mark.slow
@pytest.mark.parametrize("name", ["vga2", "projective2"])
def test_a_module_equals_the_output_of_its_spec_and_is_proved(name: str) -> None:
    """Vectors, functions, branches and matrices; `test_cache_command` has one module of a few kernels."""
    [path] = (path for path in own_specs() if path.stem == name)
    spec = load_spec(path, f"gac generate --all {path.stem}")
    records = compile_kernels(spec, cache=open_cache())
    diffs = compare(render(source_of(spec, records)), generated_folder())
    assert not diffs, "".join(diffs)[:2000] + "\nrun `make generated` and commit the result"
    loaded = load_module(generated_folder() / f"{path.stem}.py", f"_proved_{path.stem}")
    verdicts = verify_module(generated_folder(), path.stem, records, loaded)
    assert [each.kernel for each in verdicts] == [each.kernel.name for each in records]
    assert [each.kernel for each in verdicts if not each.is_proved] == []


@pytest.mark.parametrize("path", own_specs(), ids=lambda path: path.stem)
def test_a_module_is_of_its_current_spec_and_was_not_edited(path: Path) -> None:
    digest = digest_of(path, path.read_text())
    for ending in ("py", "c", "h"):
        text = (generated_folder() / f"{path.stem}.{ending}").read_text()
        assert f"spec: {digest}" in text[:400], "run `make generated` and commit the result"
        assert body_is_intact(text), f"{path.stem}.{ending} was edited; change the spec instead"


def test_no_module_without_a_spec() -> None:
    names = {path.stem for path in own_specs()}
    assert {path.stem for path in generated_folder().glob("*.py")} == names | {"__init__"}
