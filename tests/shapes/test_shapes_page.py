"""The blocks of the page on shapes, and the tests that it names."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "shapes.md").read_text()


@pytest.mark.slow
def test_blocks_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len(blocks) >= 5
    exec(compile("\n".join(blocks), "docs/shapes.md", "exec"), {"__name__": "shapes"})


def test_sections_name_tests_that_exist() -> None:
    rows = re.findall(r"^\| (\d+[.\d]+) \|[^|]*\| ([^|]*) \|", PAGE, re.MULTILINE)
    assert [section for section, _ in rows][:3] == ["17.1.1", "17.1.2", "17.2"]
    for _, names in rows:
        for name in re.findall(r"`(\w+\.py)`", names):
            assert (ROOT / "tests" / "shapes" / name).is_file(), name
