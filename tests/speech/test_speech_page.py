"""The blocks of the page on speech, the tests that it names, and its picture."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from algorithms.wavelets.lie_filters import GENERATORS

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "speech.md").read_text()


def test_blocks_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len(blocks) == 5
    exec(compile("\n".join(blocks), "docs/speech.md", "exec"), {"__name__": "speech"})


def test_sections_name_tests_that_exist() -> None:
    rows = re.findall(r"^\| (13[.\d]+) \|[^|]*\| ([^|]*) \|", PAGE, re.MULTILINE)
    assert [section for section, _ in rows] == ["13.1", "13.1.1", "13.1.2", "13.2", "13.3", "13.4"]
    for _, names in rows:
        for name in re.findall(r"`([\w/]+\.py)`", names):
            assert (ROOT / name).is_file(), name


def test_picture() -> None:
    pytest.importorskip("matplotlib")
    from algorithms.wavelets.orbit_pictures import plot_lie_filters

    axes = plot_lie_filters().axes
    assert [a.get_title() for a in axes] == list(GENERATORS)
    assert abs(axes[2].images[0].get_array()).max() < 1e-9 < abs(axes[3].images[0].get_array()).max()
