"""Run a test in a separate Python process, for counts of references to shared objects such as None and float64."""

from __future__ import annotations

import functools
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
ALONE = "GAC_TEST_ALONE"


def is_alone() -> bool:
    """Whether this process runs a single test, so that fixtures prepare only what that test needs."""
    return ALONE in os.environ


def alone(test: Callable[..., None]) -> Callable[..., None]:
    """Run the test in a separate pytest process, where no other test frees arrays and no other thread runs."""

    @functools.wraps(test)
    def run(*arguments: Any, **named: Any) -> None:
        if is_alone():
            test(*arguments, **named)
            return
        node = os.environ["PYTEST_CURRENT_TEST"].rsplit(" ", 1)[0]
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", "", node]
        done = subprocess.run(command, cwd=ROOT, env={**os.environ, ALONE: "1"}, capture_output=True, text=True)
        assert done.returncode == 0 and "1 passed" in done.stdout, done.stdout + done.stderr

    return run
