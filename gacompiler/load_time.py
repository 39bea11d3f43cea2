"""When this process loaded the compiler, so that sources that are newer can be told apart from those that run."""

from __future__ import annotations

import time

LOADED = time.time_ns()
"""Nanoseconds, as in the times of files."""
