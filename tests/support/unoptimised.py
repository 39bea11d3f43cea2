"""Builds without optimisation, which takes most of the time and changes no result."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from gacompiler.backends import find_compiler


def without_optimisation(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """Let libraries be built by a command in `folder` that calls the compiler, if there is one, with ``-O0``."""
    compiler = find_compiler()
    if compiler is not None:
        command = folder / "compiler"
        command.write_text(f'#!/bin/sh\nexec {shlex.join(compiler)} "$@" -O0\n')
        command.chmod(0o755)
        monkeypatch.setenv("CC", str(command))
