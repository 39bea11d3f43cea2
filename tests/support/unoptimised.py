"""Builds without optimisation, which takes most of the time and changes no result."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from gacompiler.backends import find_compiler

FOLDER = Path(__file__).resolve().parents[2] / "build"
"""Where the command is, whose path is part of the key of the runtime's object files in the user's cache."""


@contextmanager
def without_optimisation() -> Iterator[None]:
    """Let libraries be built by a command that calls the compiler, if there is one, with ``-O0``."""
    compiler = find_compiler()
    with pytest.MonkeyPatch.context() as patch:
        if compiler is not None:
            FOLDER.mkdir(exist_ok=True)
            command = FOLDER / "unoptimised"
            written = FOLDER / f"unoptimised-{os.getpid()}"  # another worker may execute the command meanwhile
            written.write_text(f'#!/bin/sh\nexec {shlex.join(compiler)} "$@" -O0\n')
            written.chmod(0o755)
            written.replace(command)
            patch.setenv("CC", str(command))
        yield
