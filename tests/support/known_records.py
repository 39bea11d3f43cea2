"""Compiled records of the known expressions, shared by all tests."""

from __future__ import annotations

from functools import cache

from benchmarks.known import known
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.passes.record import Compilation


@cache
def compiled(name: str) -> Compilation:
    """The compiled record of one expression."""
    return compile_kernel(known()[name].kernel, forms=False)
