"""Several spec files at once, each in a process of its own: kernels share nothing but the processors."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.queues import SimpleQueue
from pathlib import Path
from threading import Thread
from typing import NamedTuple, TypeVar

from .errors import BackendError
from .generate import Progress, Spec, load_spec

T = TypeVar("T")

Work = Callable[[Spec, Progress], T]
"""What is done with a spec: a function of a module, which a process can find by its name, as it can its result."""


class Order(NamedTuple):
    """How to load a spec, in any process: as `load_spec` takes it."""

    path: Path
    command: str | None = None
    algebra: str | None = None


def processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def each_spec(work: Work[T], orders: Sequence[Order], progress: Progress, jobs: int) -> list[T]:
    """The results of `work` on every spec, in the order given.

    Parameters
    ----------
    work : callable
        Takes a spec, and a function that is told the name of each kernel before its turn.
    orders : sequence of Order
        The specs.
    progress : callable
        Is told the names, from all processes.
    jobs : int
        At most so many processes at a time; with one there is none but this.

    Raises
    ------
    GacError
        As `load_spec` and `work` raise; the other processes are not waited for.
    BackendError
        When a process ends before its work is done, for want of memory perhaps.
    """
    if min(jobs, len(orders)) < 2:
        return [work(load_spec(*order), progress) for order in orders]
    context = multiprocessing.get_context("spawn")
    names: SimpleQueue[str | None] = context.SimpleQueue()
    listener = Thread(target=_pass_on, args=(names, progress), daemon=True)
    listener.start()
    pool = ProcessPoolExecutor(min(jobs, len(orders)), context, _begin, (names,))
    try:
        # The longest first: what comes last is short, and the processes end together.
        longest = sorted(orders, key=lambda order: -order.path.stat().st_size)
        futures: dict[Order, Future[T]] = {order: pool.submit(_run, work, order) for order in longest}
        return [futures[order].result() for order in orders]
    except BrokenProcessPool as error:
        raise BackendError("a process", "it ended before its work was done", remedy="try with --jobs 1") from error
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        names.put(None)
        listener.join()


_names: SimpleQueue[str | None]
"""Where a process tells the names of kernels."""


def _begin(names: SimpleQueue[str | None]) -> None:
    global _names
    _names = names
    # Whoever interrupts the command interrupts all its processes, and one that tells of it is enough.
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _run(work: Work[T], order: Order) -> T:
    return work(load_spec(*order), _names.put)


def _pass_on(names: SimpleQueue[str | None], progress: Progress) -> None:
    while (name := names.get()) is not None:
        progress(name)
