"""Paths of the pages in the repository, and of the site."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
CONTENTS = DOCS / "README.md"
"""The table of contents, which is the index of the site and the page that repository browsers show for the folder."""
BUILD = ROOT / "build"
SITE = BUILD / "site"
"""The folder of the site."""
SOURCE = BUILD / "site-source"
"""The input of Sphinx: copies of the pages, and generated pages, in the folders of the repository."""


def pages() -> list[Path]:
    """Return the Markdown pages of the repository that are in the site, except the table of contents."""
    return [ROOT / "README.md", *(path for path in sorted(DOCS.rglob("*.md")) if path != CONTENTS)]


def notebooks() -> list[Path]:
    """Return the notebooks of the site."""
    return sorted((ROOT / "notebooks").glob("*.ipynb"))


def write(path: Path, text: str) -> None:
    """Write a page and its folders; an unchanged page keeps its modification time."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.is_file() or path.read_text() != text:
        path.write_text(text)
