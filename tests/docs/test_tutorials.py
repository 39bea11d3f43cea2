"""Every block of the tutorials runs, and commands print the output in the page.

``python tests/docs/test_tutorials.py`` writes the current output into the blocks of commands.
"""

from __future__ import annotations

import contextlib
import os
import re
import sys
import tempfile
from pathlib import Path

import pytest
from test_docs import output

FOLDER = Path(__file__).parents[2] / "docs" / "tutorials"
BLOCK = re.compile(r"```(?:python\n(?P<code>.*?)|\n\$ gac (?P<command>[^\n]+)\n(?P<shown>.*?))```", re.DOTALL)


def run(page: Path) -> str:
    """The page with the current output; its blocks run in the current folder, in one namespace, from top to bottom."""
    names = {"__name__": page.stem}

    def done(match: re.Match[str]) -> str:
        if match["command"]:
            return f"```\n$ gac {match['command']}\n{output(match['command'])}```"
        file = re.match(r"# (\w+\.py)\n", match["code"])
        if file:
            Path(file[1]).write_text(match["code"])
        else:
            line = page.read_text()[: page.read_text().index(match[0])].count("\n") + 1
            exec(compile("\n" * line + match["code"], f"docs/tutorials/{page.name}", "exec"), names)
        return match[0]

    return BLOCK.sub(done, page.read_text())


def test_there_is_one_for_each_kind_of_reader() -> None:
    assert {path.stem for path in FOLDER.glob("*.md")} >= {"calling", "generating", "deriving", "algorithms"}


@pytest.mark.parametrize("page", sorted(FOLDER.glob("*.md")), ids=lambda path: path.stem)
@pytest.mark.slow
def test_blocks_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    assert len(BLOCK.findall(page.read_text())) >= 5
    try:
        assert run(page) == page.read_text(), "run `python tests/docs/test_tutorials.py`"
    finally:
        for path in [*tmp_path.glob("*.py"), *tmp_path.glob("out/*.py")]:
            sys.modules.pop(path.stem, None)


if __name__ == "__main__":
    for each in sorted(FOLDER.glob("*.md")):
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            text = run(each)
        each.write_text(text)
        sys.stdout.write(f"{each.name}{os.linesep}")
