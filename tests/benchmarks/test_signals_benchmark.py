"""The benchmark of transforms of signals writes its page. No test depends on measured times."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.peers

ROOT = Path(__file__).parents[2]


def test_a_quick_run_writes_the_page(tmp_path: Path) -> None:
    out = tmp_path / "signals.md"
    command = [sys.executable, "-m", "benchmarks", "signals", "--quick", "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    rows = re.findall(r"\| ([\d.]+) \| [^|]+ \| ([\d.]+) \| \*\*([\d.]+)\*\* \|", out.read_text())
    assert len(rows) >= 8
    for own, other, ratio in rows:
        # Times are printed to 0.005 ms.
        error = 0.006 + 0.006 / float(other) * (1 + float(ratio))
        assert float(ratio) == pytest.approx(float(own) / float(other), abs=error)
