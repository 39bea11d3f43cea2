"""Read and write Markdown: headings and links of a page, tables, and code."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Iterator, Sequence

from markdown_it import MarkdownIt
from markdown_it.token import Token

_PARSER = MarkdownIt("commonmark").enable("table")


def _inline(text: str) -> Iterator[Token]:
    """Yield the inline elements of a page, except those in code."""
    for token in _PARSER.parse(text):
        yield from token.children or ()


def links(text: str) -> list[str]:
    """Return the targets of all links and images of a page, in order."""
    found = []
    for token in _inline(text):
        if token.type == "link_open":
            found.append(str(token.attrs["href"]))
        elif token.type == "image":
            found.append(str(token.attrs["src"]))
    return found


def images(text: str) -> list[tuple[str, str]]:
    """Return the target and the description of every image of a page."""
    return [(str(token.attrs["src"]), token.content) for token in _inline(text) if token.type == "image"]


def headings(text: str) -> list[str]:
    """Return the headings of a page without markup."""
    tokens = _PARSER.parse(text)
    found = []
    for before, token in itertools.pairwise(tokens):
        if before.type == "heading_open":
            parts = token.children or ()
            found.append("".join(part.content for part in parts if part.type in ("text", "code_inline")))
    return found


def anchors(text: str) -> set[str]:
    """Return the anchors of headings in a repository browser."""
    found: set[str] = set()
    for heading in headings(text):
        plain = re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")
        anchor, count = plain, 0
        while anchor in found:
            count += 1
            anchor = f"{plain}-{count}"
        found.add(anchor)
    return found


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table; the cells are Markdown."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines) + "\n"


def code(text: str) -> str:
    """Return text as inline code; empty text remains empty."""
    return f"`{text}`" if text else ""


def directive(name: str, argument: str = "", **options: str) -> str:
    """Return a directive of reStructuredText in a Markdown page."""
    lines = [f".. {name}:: {argument}".rstrip(), *(f"   :{key}: {value}".rstrip() for key, value in options.items())]
    return "```{eval-rst}\n" + "\n".join(lines) + "\n```\n"


def first_sentence(text: str) -> str:
    """Return the first sentence of a text, on one line."""
    paragraph = " ".join(text.strip().split("\n\n")[0].split())
    return re.split(r"(?<=[^.].[.])(?=\s[A-Z`*\"'])", paragraph)[0]
