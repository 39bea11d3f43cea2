"""The benchmark of kernels under numba writes its page. No test depends on measured times."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.peers
def test_a_quick_run_writes_the_page(tmp_path: Path) -> None:
    pytest.importorskip("numba")
    if not any((ROOT / "generated" / "_build").glob("pga3-*")):
        pytest.skip("not built")
    out = tmp_path / "numba.md"
    command = [sys.executable, "-m", "benchmarks", "chain", "--quick", "--sizes", "20", "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    text = out.read_text()
    assert [line for line in text.splitlines() if line.startswith("## Kernels")] == [
        "## Kernels, float64",
        "## Kernels, float32",
    ]
    cells = re.findall(r"([\d.]+) ([\d.]+) \*\*([\d.]+)\*\*", text)
    assert len(cells) == 2 * 2 * (3 + 3)
    for c, ours, ratio in cells:
        assert float(ratio) == pytest.approx(float(ours) / float(c), abs=0.006 + 0.01 * float(ratio))
