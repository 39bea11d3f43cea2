"""The blocks of the page on models of spheres."""

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "sphere-models.md"


@pytest.mark.slow
def test_blocks_run() -> None:
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(blocks) == 6
    exec(compile("\n".join(blocks), PAGE.name, "exec"), {"__name__": "sphere_models"})
