"""Select the processors that this process runs on, if the system supports it."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Collection, Iterator


def processors() -> Collection[int]:
    """Return the processors that this process may use, empty if the system does not report them."""
    return os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else ()


def use_one_processor() -> None:
    """Restrict this process to one processor."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


@contextlib.contextmanager
def on_processors(chosen: Collection[int]) -> Iterator[None]:
    """Run this thread and the processes that it starts on `chosen` processors; an empty set changes nothing."""
    if not chosen or not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, chosen)
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)
