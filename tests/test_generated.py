"""The checked-in modules are what their specs give, and proved: each spec is compiled once for both."""

from __future__ import annotations

from pathlib import Path

import pytest

from gacompiler.backends.module import ModuleSource
from gacompiler.generate import compare, generated_folder, kernel_source, load_spec, own_specs, render
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.prove import verify_module
from gacompiler.runtime import load_module


@pytest.mark.parametrize("path", own_specs(), ids=lambda path: path.stem)
def test_a_module_is_what_its_spec_gives_and_is_proved(path: Path) -> None:
    spec = load_spec(path, f"gac generate --all {path.stem}")
    records = [compile_kernel(each) for each in spec.kernels]
    sources = tuple(map(kernel_source, records))
    module = ModuleSource(spec.name, spec.summary, spec.command, spec.digest, sources)
    diffs = compare(render(module), generated_folder())
    assert not diffs, "".join(diffs)[:2000] + "\nrun `make generated` and commit the result"
    loaded = load_module(generated_folder() / f"{path.stem}.py", f"_proved_{path.stem}")
    verdicts = verify_module(generated_folder(), path.stem, records, loaded)
    assert [each.kernel for each in verdicts] == [each.kernel.name for each in records]
    assert [each.kernel for each in verdicts if not each.is_proved] == []


def test_no_module_without_a_spec() -> None:
    names = {path.stem for path in own_specs()}
    assert {path.stem for path in generated_folder().glob("*.py")} == names | {"__init__"}
