"""Which loops gcc leaves scalar: it does so without a word, and the results are the same."""

from __future__ import annotations

import platform
import re
import subprocess
from collections import Counter
from pathlib import Path

import pytest

from gacompiler.backends.build import GCC_FLAGS, compiler_flags, find_compiler


def scalar_loops(c_path: Path, folder: Path) -> list[str]:
    """The loops over elements of a C file that run one by one; `folder` is for what gcc writes.

    The text of a loop stands once for both precisions and for one or two kinds of machines, each with a report of its
    own. What is left over after vectors of 32 or 64 bytes may have another, which says less.
    """
    compiler = find_compiler()
    if compiler is None or not set(GCC_FLAGS) <= set(compiler_flags(compiler)) or platform.machine() != "x86_64":
        pytest.skip("no gcc on x86-64")
    command = [*compiler, *compiler_flags(compiler), "-fopt-info-vec-optimized", "-c", str(c_path)]
    run = subprocess.run([*command, "-o", str(folder / "object.o")], capture_output=True, text=True, check=True)
    reports = Counter(re.findall(r"\.c:(\d+):\d+: optimized: loop vectorized using (?:32|64) byte", run.stderr))
    text = c_path.read_text(encoding="utf-8")
    machines = {name: 2 if kind == "LOOPS" else 1 for kind, name in re.findall(r"^(LOOPS?)\((\w+)\)$", text, re.M)}
    firsts: dict[str, int] = {}
    name = ""
    for number, line in enumerate(text.splitlines(), 1):
        head = re.match(r"static INLINE void NAME\((\w+)\)\(intptr_t n, char \*\*args", line)
        name = head[1] if head else "" if line == "}" else name
        moves_only = re.match(r"(load|store)_span_", name)
        if name in machines and not moves_only and line.strip().startswith("for (intptr_t i = "):
            firsts.setdefault(name, number)
    assert firsts
    return [name for name, number in firsts.items() if reports[str(number)] < 2 * machines[name]]
