"""Compilations that several tests look at, made once in a process."""

from __future__ import annotations

from functools import cache
from typing import Any

import pytest

from gacompiler.frontend.kernel import Kernel
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.passes.record import Compilation

_RECORDS: dict[Any, Compilation] = {}

compiled_once = cache(compile_kernel)
"""`compile_kernel` for tests that look at its record."""


def _compiled_once_for_commands(definition: Kernel, **options: Any) -> Compilation:
    function = definition.function
    used = tuple(function.__globals__.get(name) for name in function.__code__.co_names)
    key = function.__code__, function.__closure__, used, definition.parameters, definition.returns, *options.items()
    if key not in _RECORDS:
        _RECORDS[key] = compiled_once(definition, **options)
    return _RECORDS[key]


def let_commands_compile_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let ``gac show`` compile a definition once, which it reads from the same file for each command."""
    monkeypatch.setattr("gacompiler.cli.showing.compile_kernel", _compiled_once_for_commands)
