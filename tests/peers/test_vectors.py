"""gcc makes vectors of the loop of every kernel under ``generated/``."""

from pathlib import Path

import pytest
from scalar_loops import scalar_loops

from gacompiler.generate import generated_folder

pytestmark = pytest.mark.peers

MODULES = sorted(path.stem for path in generated_folder().glob("*.c"))


@pytest.mark.parametrize("name", MODULES)
def test_no_loop_is_scalar(name: str, tmp_path: Path) -> None:
    assert scalar_loops(generated_folder() / f"{name}.c", tmp_path) == []
