"""A test in a Python of its own: what counts references to things all tests share, like None or the type of doubles."""

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
    """Whether this Python runs one test only, so that fixtures need to make no more than that takes."""
    return ALONE in os.environ


def alone(test: Callable[..., None]) -> Callable[..., None]:
    """The test, run by a pytest of its own, where no other test's arrays are freed and no other thread works."""

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
