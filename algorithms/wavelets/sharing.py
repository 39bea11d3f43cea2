"""Division of work into parts that threads share, without effect on the result, and progress reports."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from operator import index
from threading import Lock
from typing import TypeVar

import scipy

Progress = Callable[[int, int], object]
"""Called with the numbers of completed and of all steps; threads that share the work call it one at a time."""

Part = TypeVar("Part")


def steps(progress: Progress | None, total: int) -> Callable[[], None]:
    """Return a function that any thread calls after each of `total` steps, and that reports progress."""
    done, lock = 0, Lock()

    def step_done() -> None:
        nonlocal done
        if progress is not None:
            with lock:
                done += 1
                progress(done, total)

    return step_done


def n_threads(workers: int | None) -> int:
    """Return the number of threads for `workers`, as in `scipy.fft`: negative values count from the processors."""
    if workers is None:
        # Only a program that imported it can have changed its number of threads.
        return int(scipy.fft.get_workers()) if "scipy.fft" in sys.modules else 1
    processors = os.cpu_count() or 1
    number = index(workers)
    if number == 0 or number < -processors:
        raise ValueError(f"workers: {number}; expected 1 or more, or -1 to {-processors}")
    return number if number > 0 else number + processors + 1


def in_threads(work: Callable[[Part], object], parts: Sequence[Part], workers: int | None) -> None:
    """Call `work` for all parts, in several threads."""
    threads = min(n_threads(workers), len(parts))
    if threads < 2:
        for part in parts:
            work(part)
    else:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(work, parts))


def slices(length: int, size: int) -> Iterator[slice]:
    """Split a length into slices of nearly the same size, about `size`."""
    parts = -(-length // size)
    for k in range(parts):
        yield slice(k * length // parts, (k + 1) * length // parts)


def blocks(images: int, columns: int, rows: int, most: int) -> list[tuple[slice, slice]]:
    """Return blocks of about `most` numbers each: columns of several images, or of a part of one."""
    wide = max(most // rows, 1)
    return [(some, place) for some in slices(images, max(wide // columns, 1)) for place in slices(columns, wide)]


def shares(length: int, workers: int | None) -> list[slice]:
    """Return one slice for each thread."""
    return list(slices(length, -(-length // n_threads(workers)))) if length else []
