"""Rarer garbage collection while a kernel is compiled."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock

OBJECTS = 1_000_000
"""New objects between two collections, which is a limit on memory: a tenth of these take some tens of megabytes."""

_lock = Lock()
_compiling = 0
_before = gc.get_threshold()


@contextmanager
def rare_collection(objects: int = OBJECTS) -> Iterator[None]:
    """Collect garbage after more new objects than by default, until the last of the threads that compile has ended.

    A compilation makes hundreds of thousands of nodes, nearly all of which reference counts free. Looking for cycles
    among them as often as by default takes a fifth of its time. Of several limits the first one applies.
    """
    global _compiling, _before
    with _lock:
        if not _compiling:
            _before = gc.get_threshold()
            if _before[0]:  # Zero means that the caller has switched collection off.
                gc.set_threshold(max(_before[0], objects), *_before[1:])
        _compiling += 1
    try:
        yield
    finally:
        with _lock:
            _compiling -= 1
            if not _compiling:
                gc.set_threshold(*_before)
