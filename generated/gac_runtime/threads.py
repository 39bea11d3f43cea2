"""Batches on several threads, in pieces: the loops hold no lock of Python's."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable
from typing import Any

_PIECE = 64
"""Pieces are multiples of this many elements, so that no two share a cache line of results."""
LEAST_WORK = 1 << 23
"""Work (bytes, and operations as so many bytes) that justifies waking threads: about a tenth of a millisecond."""
_LARGE_WORK = 1 << 27
"""Work from which on each thread gets one piece, as large as possible: loops write past the caches what they do not
hold."""
_PIECES_EACH = 4
"""Pieces for each thread of smaller batches: threads wake late, and whichever is awake takes the next piece."""


def default_threads() -> int:
    """How many threads share the elements of a large batch where nothing else says so: 1, or GAC_NUM_THREADS.

    Raises
    ------
    ImportError
        When GAC_NUM_THREADS is not a positive number.
    """
    text = os.environ.get("GAC_NUM_THREADS", "1")
    if not text.isdecimal() or int(text) < 1:
        raise ImportError(f"GAC_NUM_THREADS: {text!r}; expected a positive number")
    return int(text)


_pools: dict[int, Any] = {}


def checked_threads(name: str, wanted: Any) -> int:
    """A number of threads that somebody asked for; `name` is for the error."""
    if isinstance(wanted, bool) or not hasattr(wanted, "__index__") or int(wanted) < 1:
        raise ValueError(f"{name}: num_threads is {wanted!r}; expected a positive integer")
    return int(wanted)


def in_threads(piece: Callable[[int, int], None], size: int, n_threads: int, work: int) -> None:
    """Run ``piece(first, count)`` over a batch of so much work, on this thread and on others."""
    share = -(-size // (n_threads if work > _LARGE_WORK else n_threads * _PIECES_EACH))
    share += -share % _PIECE
    if n_threads == 1 or share >= size:
        piece(0, size)
        return
    # A pool does not survive a fork, and one of another size is another pool.
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
        # Nobody leaves while others write; who has not begun has nothing left to do.
        pieces.clear()
        begun = [helper for helper in helpers if not helper.cancel()]
        for helper in begun:
            helper.exception()
    for helper in begun:
        helper.result()
