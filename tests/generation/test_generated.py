"""The checked-in modules are those of their specs; `make check` generates and proves them again."""

from __future__ import annotations

from pathlib import Path

import pytest

from gacompiler.backends import body_is_intact
from gacompiler.generation.checked_in import generated_folder, own_specs
from gacompiler.generation.spec_contents import digest_of


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
