"""Files of comparisons are not even imported where they are deselected: other libraries take seconds to load."""

from __future__ import annotations

from pathlib import Path

import pytest


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out this folder; a file named on the command line is never asked about."""
    return True if "not peers" in config.option.markexpr and collection_path.suffix == ".py" else None
