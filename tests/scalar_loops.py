"""Which loops gcc leaves scalar: it does so without a word, and the results are the same."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from gacompiler.backends.build import GCC_FLAGS, compiler_flags, find_compiler


def scalar_loops(c_path: Path, folder: Path) -> list[str]:
    """The kernels of a C file whose elements at unit stride run one by one; `folder` is for what gcc writes."""
    compiler = find_compiler()
    if compiler is None or not set(GCC_FLAGS) <= set(compiler_flags(compiler)):
        pytest.skip("no gcc")
    command = [*compiler, *compiler_flags(compiler), "-fopt-info-vec-optimized", "-c", str(c_path)]
    run = subprocess.run([*command, "-o", str(folder / "object.o")], capture_output=True, text=True, check=True)
    vectorised = {int(line) for line in re.findall(r"\.c:(\d+):\d+: optimized: loop vectorized", run.stderr)}
    firsts: dict[str, int] = {}
    name = ""
    for number, line in enumerate(c_path.read_text().splitlines(), 1):
        head = re.match(r"static INLINE void NAME\((\w+)_block\)", line)
        name = head[1] if head else name
        if name and line.strip().startswith("for (intptr_t i = "):
            firsts.setdefault(name, number)
    assert firsts
    return [name for name, number in firsts.items() if number not in vectorised]
