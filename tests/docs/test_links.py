"""Links of the pages, the notebooks and the README lead to existing files and headings."""

from __future__ import annotations

from pathlib import Path

import pytest
from website.links import wrong_links
from website.places import CONTENTS, notebooks, pages


def test_links_are_valid() -> None:
    assert [wrong for path in (CONTENTS, *pages(), *notebooks()) for wrong in wrong_links(path)] == []


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ("missing.md", "no such file"),
        ("other.md#nowhere", "no such heading"),
        ("#nowhere", "no such heading"),
        ("http:/broken", "not an address"),
        ("htp://example.org", "not an address"),
        ("https://example", "not an address"),
    ],
)
def test_wrong_links_are_named(target: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "other.md").write_text("# Some *title*\n")
    page = tmp_path / "page.md"
    page.write_text(f"# Page\n\n[a]({target}) [b](other.md#some-title) [c](#page) [d](https://example.org/x#y)\n")
    (wrong,) = wrong_links(page)
    assert wrong.startswith(f"page.md: {target}: {message}")
