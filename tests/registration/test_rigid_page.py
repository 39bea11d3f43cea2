"""The blocks of the page on registration, and the tests that its rows on rigid motions name."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "registration.md").read_text()


@pytest.mark.slow
def test_blocks_run(monkeypatch):
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len(blocks) >= 5
    exec(compile("\n".join(blocks), "docs/registration.md", "exec"), {"__name__": "registration"})


def test_rows_name_tests_that_exist():
    rows = dict(re.findall(r"^\| (15[.\d]+) \|[^|]*\| ([^|]*) \|", PAGE, re.MULTILINE))
    for section in ("15.1.1", "15.3"):
        names = re.findall(r"`(\w+\.py)`", rows[section])
        assert names and all((ROOT / "tests" / "registration" / name).is_file() for name in names)
