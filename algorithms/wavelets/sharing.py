"""Work in parts: shared among threads, which change no number, and told of as it goes on."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from operator import index
from threading import Lock
from typing import TypeVar

import scipy.fft

Progress = Callable[[int, int], object]
"""Told how many of how many steps are done; where threads share the work, by any of them, one at a time."""

Part = TypeVar("Part")


def steps(progress: Progress | None, total: int) -> Callable[[], None]:
    """What is called after each of so many steps, by any thread, and tells how many are done."""
    done, lock = 0, Lock()

    def told() -> None:
        nonlocal done
        if progress is not None:
            with lock:
                done += 1
                progress(done, total)

    return told


def n_threads(workers: int | None) -> int:
    """How many threads `workers` are, counted as by `scipy.fft`: negative numbers from the number of processors."""
    if workers is None:
        return int(scipy.fft.get_workers())
    processors = os.cpu_count() or 1
    number = index(workers)
    if number == 0 or number < -processors:
        raise ValueError(f"workers: {number}; expected 1 or more, or -1 to {-processors}")
    return number if number > 0 else number + processors + 1


def in_threads(work: Callable[[Part], object], parts: Sequence[Part], workers: int | None) -> None:
    """Do all of some work, shared among threads."""
    threads = min(n_threads(workers), len(parts))
    if threads < 2:
        for part in parts:
            work(part)
    else:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(work, parts))


def slices(length: int, size: int) -> Iterator[slice]:
    """Parts of nearly the same size, of about `size`."""
    parts = -(-length // size)
    for k in range(parts):
        yield slice(k * length // parts, (k + 1) * length // parts)


def blocks(images: int, columns: int, rows: int, most: int) -> list[tuple[slice, slice]]:
    """Columns of images that together have about `most` numbers: of several images, or parts of one."""
    wide = max(most // rows, 1)
    return [(some, place) for some in slices(images, max(wide // columns, 1)) for place in slices(columns, wide)]


def shares(length: int, workers: int | None) -> list[slice]:
    """One part for each thread."""
    return list(slices(length, -(-length // n_threads(workers)))) if length else []
