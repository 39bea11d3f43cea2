"""Write the index of the site from ``docs/README.md``, whose lists become the navigation."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from .markdown import headings
from .places import CONTENTS, ROOT

_LINK = re.compile(r"\]\(([^)#:]+)(#[^)]*)?\)")
_BUTTONS = re.compile(r"\n(\*\*\[(?:.+\n)+)(?=\n)")
"""The paragraph of links in bold type, which the site shows as buttons."""


def listed() -> dict[str, list[str]]:
    """Return the pages of each group of the table of contents, as paths from the root of the repository."""
    groups: dict[str, list[str]] = {}
    for section in re.split(r"^## ", CONTENTS.read_text(), flags=re.MULTILINE)[1:]:
        title, _, body = section.partition("\n")
        entries = re.findall(r"^- \[[^]]+\]\(([^)#]+)\)", body, re.MULTILINE)
        groups[title.strip()] = [_from_root(entry) for entry in entries]
    return groups


def index(more: Mapping[str, Sequence[str]]) -> str:
    """Return the index page of the site.

    Parameters
    ----------
    more : mapping of str to list of str
        The groups of generated pages by title: paths from the root, without suffix.
    """
    text = _LINK.sub(lambda match: f"]({_from_root(match[1])}{match[2] or ''})", CONTENTS.read_text())
    text = _BUTTONS.sub(r"\n```{container} hero\n\1\n```\n", text, count=1)
    for title, paths in more.items():
        text += f"\n## {title}\n\n" + "".join(f"- [](/{path}.md)\n" for path in paths)
    groups = {**listed(), **more}
    return text + "".join(_navigation(title, paths) for title, paths in groups.items())


def with_links_to_index(text: str, page: str) -> str:
    """Replace links to the table of contents by links to the index of the site."""

    def led(match: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join(posixpath.dirname(page), match[1]))
        return f"](/index.md{match[2] or ''})" if target == CONTENTS.relative_to(ROOT).as_posix() else match[0]

    return _LINK.sub(led, text)


def _navigation(title: str, paths: Sequence[str]) -> str:
    """Return the hidden list from which Sphinx makes a group of the navigation."""
    lines = [f"/{posixpath.splitext(path)[0] if Path(path).suffix else path}" for path in paths]
    return "\n```{toctree}\n:hidden:\n:caption: " + title + "\n\n" + "\n".join(lines) + "\n```\n"


def _from_root(link: str) -> str:
    """Convert a link of the table of contents to a path from the root."""
    return posixpath.normpath(posixpath.join(CONTENTS.parent.relative_to(ROOT).as_posix(), link))


def title_of(text: str) -> str:
    """Return the title of a page."""
    return headings(text)[0]
