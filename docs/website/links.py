"""The check of links: relative ones lead to a file and an anchor that are there, others have a plausible form."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from urllib.parse import unquote, urlsplit

from .markdown import anchors, links


def wrong_links(path: Path) -> list[str]:
    """What is wrong with the links of a page or a notebook, a line each."""
    return [f"{path.name}: {target}: {wrong}" for target in links(text_of(path)) if (wrong := _wrong(path, target))]


def text_of(path: Path) -> str:
    """The text of a page; of a notebook that of its Markdown cells."""
    text = path.read_text()
    if path.suffix != ".ipynb":
        return text
    cells = [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "markdown"]
    return "\n\n".join("".join(cell["source"]) for cell in cells)


@cache
def _anchors_of(path: Path) -> set[str]:
    return anchors(text_of(path))


def _wrong(path: Path, target: str) -> str:
    """What is wrong with a link, or nothing."""
    parts = urlsplit(target)
    if parts.scheme:
        return "" if _is_plausible(target) else "no address; expected https://HOST/..."
    file = (path.parent / unquote(parts.path)).resolve() if parts.path else path
    if not file.exists():
        return "no such file"
    if parts.fragment and file.suffix in (".md", ".ipynb") and unquote(parts.fragment) not in _anchors_of(file):
        return f"no such heading; expected one of {', '.join(sorted(_anchors_of(file)))}"
    return ""


def _is_plausible(address: str) -> bool:
    """Whether an external address has the right form; nothing is fetched."""
    parts = urlsplit(address)
    return parts.scheme in ("http", "https") and bool(re.fullmatch(r"[\w-]+(\.[\w-]+)+(:\d+)?", parts.netloc))
