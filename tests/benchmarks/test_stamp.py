"""The stamps of pages of figures notice changes of the code that is measured, and no others."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import __main__ as commands
from benchmarks import stamp

DOCS = Path(__file__).parents[2] / "docs"
TREE = {
    "benchmarks/vision.py": "from . import pages\nfrom algorithms import vision",
    "benchmarks/pages.py": "import gacompiler",
    "benchmarks/growth.py": "import gacompiler",
    "gacompiler/__init__.py": "LIMIT = 1",
    "algorithms/__init__.py": "",
    "algorithms/vision.py": '"""Old text."""\nfrom generated import pga3\ndef f(x):\n    return x + 1',
    "algorithms/wavelets.py": "",
    "generated/pga3.py": "",
    "generated/pga3.c": "x + 1",
    "generated/gac_runtime/__init__.py": "",
    "generated/gac_runtime/gac_runtime.c": "a",
    "generated/gac_runtime/gac_runtime.h": "b",
    "generated/gac_runtime/extension.c": "c",
}


def digests(root: Path, changes: dict[str, str]) -> tuple[str, str]:
    for name, text in {**TREE, **changes}.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return stamp.digest("vision", root), stamp.digest("growth", root)


@pytest.mark.parametrize(
    ("name", "text", "changed"),
    [
        ("algorithms/vision.py", TREE["algorithms/vision.py"].replace("+ 1", "+ 2"), (True, False)),
        ("algorithms/vision.py", TREE["algorithms/vision.py"].replace("Old", "New"), (False, False)),
        ("algorithms/wavelets.py", "x = 1", (False, False)),
        ("generated/pga3.c", "x + 2", (True, False)),
        ("generated/gac_runtime/extension.c", "d", (True, False)),
        ("benchmarks/vision.py", TREE["benchmarks/vision.py"] + "\nN = 5", (True, False)),
        ("gacompiler/__init__.py", "LIMIT = 2", (False, True)),
    ],
)
def test_what_changes_a_digest(name: str, text: str, changed: tuple[bool, bool], tmp_path: Path) -> None:
    before, after = digests(tmp_path / "before", {}), digests(tmp_path / "after", {name: text})
    assert tuple(a != b for a, b in zip(before, after, strict=True)) == changed


def test_a_page_is_current_until_its_code_changes() -> None:
    page = stamp.stamped("# Page\n\nText.\n", "markdown")
    assert page.startswith("# Page\n\nText.\n\nMeasured at commit ") and not stamp.is_outdated(page, "markdown")
    assert stamp.is_outdated(page, "affinity") and stamp.is_outdated("# Page\n\nText.\n", "markdown")


def test_every_page_of_figures_names_its_commit() -> None:
    for page in commands.PAGES:
        assert "\nMeasured at commit " in (DOCS / f"{page}.md").read_text(), page
