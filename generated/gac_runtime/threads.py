"""Multithreaded loops over pieces of a batch; compiled loops release the GIL."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable
from typing import Any

_PIECE = 64
"""Sizes of pieces are multiples of this number of elements, so that no two pieces share a cache line of results."""
LEAST_WORK = 1 << 23
"""Smallest work for which threads are used, about a tenth of a millisecond, in bytes; an operation counts as four."""
_LARGE_WORK = 1 << 27
"""Work above which each thread gets a single piece, as large as possible: loops bypass the caches when they write
results that do not fit."""
_PIECES_EACH = 4
"""Pieces per thread for smaller batches: threads take time to wake, and any awake thread takes the next piece."""


def default_threads() -> int:
    """Return the default number of threads for large batches: GAC_NUM_THREADS if set, else 1.

    Raises
    ------
    ImportError
        If GAC_NUM_THREADS is not a positive integer.
    """
    text = os.environ.get("GAC_NUM_THREADS", "1")
    if not text.isdecimal() or int(text) < 1:
        raise ImportError(f"GAC_NUM_THREADS: {text!r}; expected a positive integer")
    return int(text)


_pools: dict[int, Any] = {}


def checked_threads(name: str, wanted: Any) -> int:
    """Check a requested number of threads; `name` is the kernel in the error message."""
    if isinstance(wanted, bool) or not hasattr(wanted, "__index__") or int(wanted) < 1:
        raise ValueError(f"{name}: num_threads is {wanted!r}; expected a positive integer")
    return int(wanted)


def in_threads(piece: Callable[[int, int], None], size: int, n_threads: int, work: int) -> None:
    """Run ``piece(first, count)`` over a batch with the given total work, on this thread and on others."""
    share = -(-size // (n_threads if work > _LARGE_WORK else n_threads * _PIECES_EACH))
    share += -share % _PIECE
    if n_threads == 1 or share >= size:
        piece(0, size)
        return
    # A pool does not survive a fork; each number of threads has its own pool.
    key = os.getpid() << 16 | n_threads
    pool = _pools.get(key)
    if pool is None:
        from concurrent.futures import ThreadPoolExecutor

        pool = _pools.setdefault(key, ThreadPoolExecutor(n_threads - 1, "gacompiler"))
    pieces = deque(range(0, size, share))

    def take() -> None:
        while pieces:
            try:
                first = pieces.popleft()
            except IndexError:
                return
            piece(first, min(share, size - first))

    helpers: list[Any] = []
    try:
        for _ in range(min(n_threads, len(pieces)) - 1):
            helpers.append(pool.submit(take))
        take()
    finally:
        # Wait for threads that are still writing; those that have not started have nothing left to do.
        pieces.clear()
        begun = [helper for helper in helpers if not helper.cancel()]
        for helper in begun:
            helper.exception()
    for helper in begun:
        helper.result()
