"""The compiled runtime for tests with a cache of their own."""

from __future__ import annotations

from pathlib import Path

import pytest
from compiled_runtime import copy_compiled_runtime


@pytest.fixture(scope="session")
def runtime_objects(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The compiled runtime in the form that a cache stores."""
    folder = tmp_path_factory.mktemp("runtime")
    return copy_compiled_runtime(folder, folder / "cache")
