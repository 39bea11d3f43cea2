"""gcc makes vectors of the loops of generated modules: of those with exponentials, branches, and many forms."""

from pathlib import Path

import pytest
from scalar_loops import scalar_loops

from gacompiler.generation.checked_in import generated_folder

pytestmark = pytest.mark.peers

MODULES = {"arms": "F64", "quaternion": "F32"}
"""With their precision; all would take as long as a build of all."""


@pytest.mark.parametrize("name", MODULES)
def test_no_loop_is_scalar(name: str, tmp_path: Path) -> None:
    assert scalar_loops(generated_folder() / f"{name}.c", tmp_path, MODULES[name]) == []
