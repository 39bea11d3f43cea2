"""Programs of other languages, which a machine may lack."""

from __future__ import annotations

import shutil
import subprocess
from functools import cache

import pytest

SANITIZED = (
    *("-fsanitize=address,undefined", "-fno-sanitize-recover=all"),
    *("--param", "asan-instrumentation-with-call-threshold=0"),
    "-fno-sanitize=null,object-size,pointer-overflow,alignment",
)
"""Options of gcc for text whose accesses are checked, compiled in half the time that the first two take.

A check is a call of the sanitizer's library, compiled in less time than its instructions at each access, and the
address sanitizer reports the use of the pointers that are left out.
"""


@cache
def runs(command: str) -> bool:
    """Whether a program runs here; a launcher without the program it would start is on the PATH but does not run."""
    return shutil.which(command) is not None and (
        subprocess.run([command, "--version"], capture_output=True, check=False).returncode == 0
    )


def needs(command: str) -> pytest.MarkDecorator:
    """Skip a test where a program does not run."""
    return pytest.mark.skipif(not runs(command), reason=f"no {command} that runs")
