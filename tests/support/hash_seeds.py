"""Whether generated text depends on the order of sets, which changes with the hash seed of a process."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

PATH = [str(Path(__file__).parent), str(Path(__file__).parents[2])]


def is_the_same_for_every_hash_seed(statements: str, text: str) -> bool:
    """Run statements in a process for each of two hash seeds, and compare digests of a text that they compute."""
    code = f"import sys; sys.path[:0] = {PATH!r}; {statements}; import hashlib; "
    code += f"print(hashlib.sha256(({text}).encode()).hexdigest())"
    found = {
        subprocess.run(
            [sys.executable, "-c", code],
            env={"PYTHONHASHSEED": seed, "PATH": ""},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("0", "1")
    }
    return len(found) == 1 and len(found.pop()) == 65
