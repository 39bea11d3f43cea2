"""The time when this process loaded the compiler, for the detection of source files that changed since."""

from __future__ import annotations

import time

LOADED = time.time_ns()
"""Nanoseconds since the epoch, as in the modification times of files."""
