"""The benchmark of scan matching writes its page. Nothing here looks at how long anything took."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.peers

ROOT = Path(__file__).parents[2]


def test_a_quick_run_writes_the_page(tmp_path: Path) -> None:
    out = tmp_path / "mapping.md"
    command = [sys.executable, "-m", "benchmarks", "mapping", "--quick", "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    rows = re.findall(r"^\| ([^|]+) \| ([\d.,]+) \| ([^|]*) \|$", out.read_text(), re.MULTILINE)
    assert len(rows) == 3 and all(float(own) > 0 for _, own, _ in rows)
