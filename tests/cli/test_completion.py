"""The shells complete commands and options of ``gac``, by the lines that the tutorial shows."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROGRAM = "from gacompiler.cli import main; main(prog_name='gac')"


def completed(shell: str, words: str) -> str:
    """What ``gac`` prints for a completion of the last word."""
    count = len(words.split()) - (not words.endswith(" "))
    last = "" if words.endswith(" ") else words.split()[-1]
    number = {"fish": last}.get(shell, str(count))
    more = {"_GAC_COMPLETE": f"{shell}_complete", "COMP_WORDS": words, "COMP_CWORD": number, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", PROGRAM], env={**os.environ, **more}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
@pytest.mark.slow
def test_commands_and_options_are_completed(shell: str) -> None:
    assert re.search(r"\bgenerate\b", completed(shell, "gac gen"))
    assert "--header-only" in completed(shell, "gac generate --hea")


def test_the_tutorial_names_the_shells() -> None:
    text = (ROOT / "docs" / "tutorials" / "generating.md").read_text()
    for shell in ("bash", "zsh", "fish"):
        assert f"{shell}_source" in text
