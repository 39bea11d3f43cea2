"""The blocks of the page on maps, and the tests that it names."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "mapping.md").read_text()


@pytest.mark.slow
def test_blocks_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len(blocks) > 5
    exec(compile("\n".join(blocks), "docs/mapping.md", "exec"), {"__name__": "mapping"})


def test_sections_name_tests_that_exist() -> None:
    rows = re.findall(r"^\| (21[.\d]+) \|[^|]*\| ([^|]*) \|", PAGE, re.MULTILINE)
    assert [section for section, _ in rows] == ["21.1.1", "21.1.2", "21.1.3", "21.1.4", "21.2", "21.3", "21.4", "21.5"]
    for _, names in rows:
        for name in re.findall(r"`(\w+\.py)`", names):
            assert (ROOT / "tests" / "mapping" / name).is_file(), name
