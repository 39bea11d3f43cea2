"""What the known expressions compile to, once for all tests that ask."""

from __future__ import annotations

from functools import cache

from benchmarks.known import known
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.passes.record import Compilation


@cache
def compiled(name: str) -> Compilation:
    """The record of one of them."""
    return compile_kernel(known()[name].kernel)
