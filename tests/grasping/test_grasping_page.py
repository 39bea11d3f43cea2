"""The blocks of the page on grasping, and the tests that its rows name."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "grasping.md").read_text()
PLANS, LOOP = PAGE.split("## A scene")


def run(text, monkeypatch):
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len(blocks) >= 5
    exec(compile("\n".join(blocks), "docs/grasping.md", "exec"), {"__name__": "grasping"})


def test_blocks_of_plans_run(monkeypatch):
    run(PLANS, monkeypatch)


@pytest.mark.slow
def test_blocks_of_the_loop_run(monkeypatch):
    run(LOOP, monkeypatch)


def test_rows_name_tests_that_exist():
    rows = dict(re.findall(r"^\| (20[.\d-]+) \|[^|]*\| ([^|]*) \|", PAGE, re.MULTILINE))
    for section in ("20.2", "20.3", "20.4", "20.5-20.6"):
        names = re.findall(r"`(\w+\.py)`", rows[section])
        assert names and all(any((ROOT / "tests").rglob(name)) for name in names)
