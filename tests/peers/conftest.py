"""Files of comparisons are not imported if they are deselected, because other libraries take seconds to load."""

from __future__ import annotations

from pathlib import Path

import pytest


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Ignore this folder; pytest does not call this hook for files named on the command line."""
    return True if "not peers" in config.option.markexpr and collection_path.suffix == ".py" else None
