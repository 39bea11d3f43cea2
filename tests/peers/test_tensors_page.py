"""The blocks of the page of tensors run, with torch and jax."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from operator_kernels import compile_quickly

pytestmark = pytest.mark.peers
PAGE = Path(__file__).parents[2] / "docs" / "tensors.md"


def test_blocks_of_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """Execute the blocks in one namespace, from top to bottom, including their assertions."""
    torch, jax = pytest.importorskip("torch"), pytest.importorskip("jax")
    compile_quickly(monkeypatch)
    torch.manual_seed(0)
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(blocks) >= 3
    with jax.enable_x64(True):
        exec(compile("\n".join(blocks), "docs/tensors.md", "exec"), {"__name__": "tensors"})
