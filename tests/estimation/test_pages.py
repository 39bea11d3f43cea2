"""The blocks of the pages on body-eye calibration and tracking."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize("page", ["body-eye.md", "tracking.md"])
def test_blocks_run(page: str) -> None:
    blocks = re.findall(r"```python\n(.*?)```", (DOCS / page).read_text(), re.DOTALL)
    assert len(blocks) > 5
    exec(compile("\n".join(blocks), f"docs/{page}", "exec"), {"__name__": page})
