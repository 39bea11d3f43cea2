"""The documentation shows real output: every ``$`` block is run and must print the text in the page.

``python tests/docs/test_docs.py`` writes the current output into the blocks.
"""

from __future__ import annotations

import functools
import re
import shlex
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from compiled_once import let_commands_compile_once

import gacompiler
from gacompiler.cli import main
from generated import pga3

ROOT = Path(__file__).parents[2]
PAGES = sorted(path for path in (ROOT / "docs").glob("*.md") if "\n$ gac " in path.read_text())
BLOCK = re.compile(r"```\n\$ gac ([^\n]+)\n(.*?)```", re.DOTALL)


def output(command: str) -> str:
    """The output of ``gac command``, run from the root of the repository."""
    result = CliRunner().invoke(main, shlex.split(command))
    assert result.exit_code == 0, result.output
    return result.stdout.rstrip() + "\n"


def current(page: Path) -> str:
    """The page with the current output in its blocks."""
    return BLOCK.sub(lambda match: f"```\n$ gac {match[1]}\n{output(match[1])}```", page.read_text())


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_blocks_print_what_is_shown(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    let_commands_compile_once(monkeypatch)
    assert page.read_text() == current(page), "run `python tests/docs/test_docs.py`"


@pytest.mark.parametrize("name", ["speed", "loops"])
@pytest.mark.slow
def test_blocks_of_a_page_run(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Execute the blocks in one namespace, from top to bottom, including their assertions.

    There is no C compiler and no search for cheaper forms, which takes most of the time and changes no result.
    """
    assert pga3.backend, "loaded before the environment changes"
    monkeypatch.setenv("GAC_BACKEND", "arrays")
    monkeypatch.setattr(gacompiler, "compile", functools.partial(gacompiler.compile, effort=0))
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / f"{name}.md").read_text(), re.DOTALL)
    assert len(blocks) >= 4
    exec(compile("\n".join(blocks), f"docs/{name}.md", "exec"), {"__name__": name})


def test_architecture_is_among_them() -> None:
    assert "architecture.md" in [page.name for page in PAGES]


if __name__ == "__main__":
    for each in [path for path in (ROOT / "docs").glob("*.md") if "\n$ gac " in path.read_text()]:
        each.write_text(current(each))
        sys.stdout.write(f"{each.name}\n")
