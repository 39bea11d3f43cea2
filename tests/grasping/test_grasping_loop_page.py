"""The blocks of the page on guided grasping run, and the tests that it names exist."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "grasping-loop.md").read_text()


@pytest.mark.slow
def test_blocks_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len(blocks) > 4
    exec(compile("\n".join(blocks), "docs/grasping-loop.md", "exec"), {"__name__": "grasping_loop"})


def test_sections_name_tests_that_exist() -> None:
    rows = re.findall(r"^\| (20[.\d]+) \|[^|]*\| ([^|]*) \|", PAGE, re.MULTILINE)
    assert [section for section, _ in rows] == ["20.3", "20.3", "20.3", "20.5", "20.6"]
    for _, names in rows:
        for name in re.findall(r"`(\w+\.py)`", names):
            assert any((ROOT / "tests").rglob(name)), name
