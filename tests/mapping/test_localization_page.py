"""The page on localisation: its blocks run, and the tests that it names exist."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "localization.md"


@pytest.mark.slow
def test_blocks_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(blocks) >= 8
    exec(compile("\n".join(blocks), str(PAGE), "exec"), {"__name__": "page"})


def test_sections_name_tests_that_exist() -> None:
    text = PAGE.read_text()
    for section in ("21.1.4", "21.2", "21.2.1", "21.2.2", "21.2.3", "21.3"):
        rows = [line for line in text.splitlines() if line.startswith(f"| {section} |")]
        names = re.findall(r"`(test_\w+\.py)`", " ".join(rows))
        assert names and all((ROOT / "tests" / "mapping" / name).is_file() for name in names)
