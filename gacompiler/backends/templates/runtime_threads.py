"""Batches in pieces, on several threads: the loops hold no lock of Python's.

Copied into every generated module as it is, with the other ``runtime_`` files.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable
from typing import Any

_PIECE = 64
"""Pieces are multiples of so many elements, so that none shares a cache line of results with another."""
_LEAST_WORK = 1 << 23
"""Bytes and operations, in bytes, of a batch that is worth waking threads for: about a tenth of a millisecond."""
_LARGE_WORK = 1 << 27
"""The same of a batch of which each thread has one piece, as large as can be: loops write past the caches what these
do not hold."""
_TURNS = 4
"""Pieces for each thread of other batches. Threads wake late, and whoever is awake takes the next."""


def _threads_wanted() -> int:
    text = os.environ.get("GAC_NUM_THREADS", "1")
    if not text.isdecimal() or int(text) < 1:
        raise ImportError(f"GAC_NUM_THREADS: {text!r}; expected a positive number")
    return int(text)


num_threads = _threads_wanted()
"""How many threads share the elements of a large batch where a call does not say; 1 unless GAC_NUM_THREADS does."""

_pools: dict[int, Any] = {}


def _checked_threads(name: str, wanted: Any) -> int:
    """How many threads a call is to use."""
    if wanted is None:
        wanted = num_threads
    if isinstance(wanted, bool) or not hasattr(wanted, "__index__") or int(wanted) < 1:
        raise ValueError(f"{name}: num_threads is {wanted!r}; expected a positive integer")
    return int(wanted)


def _in_threads(piece: Callable[[int, int], None], size: int, n_threads: int, work: int) -> None:
    """Run ``piece(first, count)`` over a batch of so much work, on this thread and on others."""
    share = -(-size // (n_threads if work > _LARGE_WORK else n_threads * _TURNS))
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
