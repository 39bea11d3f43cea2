"""Prose is free of the words that CONTRIBUTING says not to use."""

import ast
import itertools
import re
import tokenize
from pathlib import Path

import pytest
from markdown_it import MarkdownIt

ROOT = Path(__file__).parents[2]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
FOLDERS = ("gacompiler", "algorithms", "benchmarks", "docs", "tests")
SOURCES = sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py") if path != Path(__file__))


def avoided() -> list[str]:
    """The left column of the table."""
    section = (ROOT / "docs" / "CONTRIBUTING.md").read_text().partition("## Write plain English")[2]
    rows = re.findall(r"^\| ([^|]+) \| [^|]+ \|$", section.partition("\n## ")[0], re.MULTILINE)
    return [row for row in rows if row != "avoid"]


def pattern() -> re.Pattern[str]:
    """Any of the words, which may be divided between two lines of a comment."""
    words = [word.replace(" ", r"(?:\s|#)+") for word in avoided()]
    return re.compile(rf"\b(?:{'|'.join(words)})\b", re.IGNORECASE)


def perhaps() -> re.Pattern[str]:
    """Any of the words with anything but words between their parts, as where a string is divided: where to look."""
    words = [word.replace(" ", r"(?:\W|\\n|\b[fr]\b)+") for word in avoided()]
    return re.compile(rf"\b(?:{'|'.join(words)})\b", re.IGNORECASE)


def prose(path: Path) -> list[tuple[int, str]]:
    """Comments and docstrings of a source file, and its other text of several words, with their lines."""
    text = path.read_text()
    with path.open("rb") as file:
        found = [(t.start[0], t.string) for t in tokenize.tokenize(file.readline) if t.type == tokenize.COMMENT]
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value.strip():
            found.append((node.lineno, node.value))
    return found


def test_the_list_is_found_and_finds() -> None:
    assert len(avoided()) >= 8 and "of before" in avoided()
    assert (
        pattern().search("the value of\n# before")
        and pattern().search("Errors are told")
        and not pattern().search("kind")
    )
    divided = 'f"the value of "\n        f"before"', r"the value of\nbefore", "# the value of\n    # before", "are told"
    assert all(map(perhaps().search, divided)) and not perhaps().search("of the kind before")


@pytest.mark.parametrize("folder", FOLDERS)
def test_sources_avoid_the_words(folder: str) -> None:
    words, somewhere, found = pattern(), perhaps(), []
    for path in SOURCES:
        if path.relative_to(ROOT).parts[0] == folder and somewhere.search(path.read_text()):
            for line, text in prose(path):
                found += [f"{path.relative_to(ROOT)}:{line}: {match[0]}" for match in words.finditer(text)]
    assert not found, "\n".join(found)


def test_pages_avoid_the_words() -> None:
    words, found = pattern(), []
    for path in PAGES:
        text = path.read_text()
        if path.name == "CONTRIBUTING.md":
            text = re.sub(r"^\|.*$", "", text, flags=re.MULTILINE)
        for match in words.finditer(text):
            found.append(f"{path.relative_to(ROOT)}:{text.count(chr(10), 0, match.start()) + 1}: {match[0]}")
    assert not found, "\n".join(found)


def sentences(text: str) -> list[str]:
    """The sentences of the paragraphs of a page; code counts as a word, and tables do not count."""
    found: list[str] = []
    tokens = MarkdownIt("commonmark").enable("table").parse(text)
    for before, token in itertools.pairwise(tokens):
        if token.type == "inline" and before.type == "paragraph_open":
            words = "".join(part.content if part.content else " " for part in token.children or ())
            found += re.split(r"(?<=[.!?])\s+", words)
    return found


def test_sentences_have_at_most_fifty_words() -> None:
    assert len(max(sentences("One. Two three\nfour! `x` five.\n\n| a b c d e |\n|---|\n"), key=len).split()) == 3
    for path in PAGES:
        if path.name == "CHANGELOG.md":  # its entries are lists of changes
            continue
        for sentence in sentences(path.read_text()):
            assert len(sentence.split()) <= 50, f"{path.name}: {sentence}"
