"""Find the loops that gcc does not vectorise, which it does silently and without an effect on results."""

from __future__ import annotations

import platform
import re
import subprocess
from collections import Counter
from pathlib import Path

import pytest

from gacompiler import gac_runtime
from gacompiler.backends.build import GCC_FLAGS, compiler_flags, find_compiler


def scalar_loops(c_path: Path, folder: Path, precision: str) -> list[str]:
    """List the kernels of a C file with a scalar loop over elements, in "F64" or "F32"; gcc writes to `folder`.

    A line instantiates the loops of a kernel, or of a form, for one or two kinds of machines, each with a separate
    report for that line. The remainder after vectors of 32 or 64 bytes may have
    another, shorter report.
    """
    compiler = find_compiler()
    if compiler is None or not set(GCC_FLAGS) <= set(compiler_flags(compiler)) or platform.machine() != "x86_64":
        pytest.skip("no gcc on x86-64")
    include = f"-I{Path(gac_runtime.__path__[0]).parent}"
    command = [*compiler, *compiler_flags(compiler), include, f"-DONLY_{precision}", "-fopt-info-vec-optimized"]
    command += ["-c", str(c_path), "-o", str(folder / "object.o")]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    reports = Counter(re.findall(r"\.c:(\d+):\d+: optimized: loop vectorized using (?:32|64) byte", run.stderr))
    found, seen = [], 0
    for number, line in enumerate(c_path.read_text(encoding="utf-8").splitlines(), 1):
        made = re.match(r"GAC_(FORM|KERNEL|KERNEL_AND_FORMS)\((.*)", line)
        if made is None:
            continue
        words = re.split(r"[, )]+", made[2])
        name, dense = (f"{words[0]} of {words[1]}", words[5]) if made[1] == "FORM" else (words[0], words[2])
        # Blocks for two kinds of machines; in C order direct loops for both, tiles for one.
        seen += 1
        if reports[str(number)] < 2 + {"NO": 0, "TILES": 1, "DIRECT": 2}[dense]:
            found.append(name)
    assert seen
    return found
