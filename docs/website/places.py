"""Where the pages of the repository are, and where the site is built."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
CONTENTS = DOCS / "README.md"
"""The table of contents: the index of the site, and what a browser of the repository shows for the folder."""
BUILD = ROOT / "build"
SITE = BUILD / "site"
"""The finished pages."""
SOURCE = BUILD / "site-source"
"""What Sphinx reads: a copy of the pages and the generated ones, in the folders of the repository."""


def pages() -> list[Path]:
    """The Markdown pages of the repository that the site has, except the table of contents."""
    return [ROOT / "README.md", *(path for path in sorted(DOCS.rglob("*.md")) if path != CONTENTS)]


def notebooks() -> list[Path]:
    """The notebooks of the site."""
    return sorted((ROOT / "notebooks").glob("*.ipynb"))


def write(path: Path, text: str) -> None:
    """Write a page and the folders that it is in; a page that has not changed keeps its time."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.is_file() or path.read_text() != text:
        path.write_text(text)
