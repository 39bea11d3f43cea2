"""The page about estimation: its blocks run, and its tests exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "estimation.md"


def test_blocks_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(blocks) >= 6
    exec(compile("\n".join(blocks), str(PAGE), "exec"), {"__name__": "page"})


def test_sections_name_tests_that_exist() -> None:
    text = PAGE.read_text()
    for section in ("18.5.1", "18.5.2", "18.5.3", "18.6", "18.6.5", "19.2", "20.1"):
        rows = [line for line in text.splitlines() if line.startswith(f"| {section} |")]
        names = re.findall(r"`(test_\w+\.py)`", " ".join(rows))
        assert names and all((ROOT / "tests" / "estimation" / name).is_file() for name in names)
