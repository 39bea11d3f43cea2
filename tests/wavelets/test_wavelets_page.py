"""The blocks of the page on wavelets run without failing assertions."""

from __future__ import annotations

import re
from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs" / "wavelets.md"


def test_blocks_run() -> None:
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(blocks) == 17
    exec(compile("\n".join(blocks), "docs/wavelets.md", "exec"), {"__name__": "wavelets"})
