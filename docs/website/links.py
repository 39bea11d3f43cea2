"""Check links: relative links must lead to an existing file and anchor, and others must have a plausible form."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from urllib.parse import unquote, urlsplit

from .markdown import anchors, links


def wrong_links(path: Path) -> list[str]:
    """Return a message for each wrong link of a page or a notebook."""
    return [f"{path.name}: {target}: {wrong}" for target in links(text_of(path)) if (wrong := _wrong(path, target))]


def text_of(path: Path) -> str:
    """Return the text of a page, or that of the Markdown cells of a notebook."""
    text = path.read_text()
    if path.suffix != ".ipynb":
        return text
    cells = [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "markdown"]
    return "\n\n".join("".join(cell["source"]) for cell in cells)


@cache
def _anchors_of(path: Path) -> set[str]:
    return anchors(text_of(path))


def _wrong(path: Path, target: str) -> str:
    """Return what is wrong with a link; empty if nothing is."""
    parts = urlsplit(target)
    if parts.scheme:
        return "" if _is_plausible(target) else "not an address; expected https://HOST/..."
    file = (path.parent / unquote(parts.path)).resolve() if parts.path else path
    if not file.exists():
        return "no such file"
    if parts.fragment and file.suffix in (".md", ".ipynb") and unquote(parts.fragment) not in _anchors_of(file):
        return f"no such heading; expected one of {', '.join(sorted(_anchors_of(file)))}"
    return ""


def _is_plausible(address: str) -> bool:
    """Return whether an external address has the right form, without fetching it."""
    parts = urlsplit(address)
    return parts.scheme in ("http", "https") and bool(re.fullmatch(r"[\w-]+(\.[\w-]+)+(:\d+)?", parts.netloc))
