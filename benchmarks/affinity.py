"""Which processors this process runs on, where the system lets it choose."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Collection, Iterator


def processors() -> Collection[int]:
    """Those that it may use; empty where the system does not say."""
    return os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else ()


def use_one_processor() -> None:
    """Keep this process on one."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


@contextlib.contextmanager
def on_processors(chosen: Collection[int]) -> Iterator[None]:
    """Let this thread, and what it starts, run on these; an empty set changes nothing."""
    if not chosen or not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, chosen)
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)
