"""The page on structure: its blocks run, and its dictionaries are those of the code."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from gacompiler.structure.gibbs import GIBBS, table
from gacompiler.structure.grassmann_cayley import GRASSMANN_CAYLEY

PAGE = Path(__file__).parents[2] / "docs" / "structure.md"


def test_blocks_run() -> None:
    """Execute the blocks in one namespace, from top to bottom, including their assertions."""
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(blocks) >= 6
    exec(compile("\n".join(blocks), "docs/structure.md", "exec"), {"__name__": "structure"})


@pytest.mark.parametrize("dictionary", [GIBBS, GRASSMANN_CAYLEY], ids=["Gibbs", "Grassmann-Cayley"])
def test_dictionaries_are_printed_whole(dictionary: dict) -> None:
    text = PAGE.read_text()
    for name, theirs, ours in table(dictionary):
        one, two = (formula.replace("|", r"\|") for formula in (theirs, ours))  # a bar would end the cell
        assert f"| {name} | `{one}` | `{two}` |" in text
