"""Proved minimal numbers of operations, which ``python -m benchmarks minimal`` writes; do not edit them by hand."""

from __future__ import annotations

PROVED: dict[str, int] = {}
"""The minimum by the key of the problem (`gacompiler.passes.minimal`)."""
