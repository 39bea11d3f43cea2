"""Texts of kernels without the measurement of their rounding errors, a fourth of the time that small kernels take."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest


@contextmanager
def errors_are_not_measured() -> Iterator[None]:
    """Print an invented error in texts that are read or compiled; what is made here must not be stored in a cache."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gacompiler.generation.sources.measured_error", lambda program, kernel: (1.0, 64))
        yield
