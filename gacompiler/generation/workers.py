"""Several spec files at once, each in a process of its own: kernels share nothing but the processors."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Lock
from pathlib import Path
from threading import Event, Thread
from typing import TypeVar

from ..errors import BackendError
from .compiling import Progress
from .spec_files import Spec, load_spec

T = TypeVar("T")

Work = Callable[[Spec, Progress], T]
"""What is done with a spec: a function of a module, which a process can find by its name, as it can its result."""

_MOST = 61
"""Processes that Windows waits for at a time."""

_PATIENCE = 0.1
"""Seconds."""


def each_spec(work: Work[T], specs: Sequence[Spec], progress: Progress, jobs: int) -> list[T]:
    """The results of `work` on every spec, in the order given.

    Parameters
    ----------
    work : callable
        Takes a spec, and a function that is told the name of each kernel before its turn.
    specs : sequence of Spec
        Functions do not cross processes: another process loads its spec again.
    progress : callable
        Is told the names, from all processes.
    jobs : int
        At most so many processes at a time; with one there is none but this.

    Raises
    ------
    GacError
        As `load_spec` and `work` raise; the other processes are ended.
    BackendError
        When a process ends before its work is done, for want of memory perhaps.
    """
    if min(jobs, len(specs)) < 2:
        return [work(spec, progress) for spec in specs]
    context = multiprocessing.get_context("spawn")
    names, told = context.Pipe(duplex=False)
    listener = _Listener(names, progress)
    listener.start()
    pool = ProcessPoolExecutor(min(jobs, len(specs), _MOST), context, _begin, (told, context.Lock()))
    try:
        # The longest first: what comes last is short, and the processes end together.
        longest = sorted(range(len(specs)), key=lambda k: -specs[k].path.stat().st_size)
        futures = {k: pool.submit(_run, work, specs[k].path, specs[k].command, specs[k].algebra) for k in longest}
        for future in wait(futures.values(), return_when=FIRST_EXCEPTION).done:
            future.result()
        results = [futures[k].result() for k in range(len(specs))]
    except BrokenProcessPool as error:
        raise BackendError("a process", "it ended before its work was done", remedy="try with --jobs 1") from error
    except BaseException:
        for process in list((pool._processes or {}).values()):  # Python 3.14 has terminate_workers
            process.terminate()
        raise
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        listener.finish()
    if listener.error is not None:
        raise listener.error
    return results


class _Listener(Thread):
    """Passes on the names that processes tell; the process that it is in never waits for one of them."""

    def __init__(self, names: Connection, progress: Progress) -> None:
        super().__init__(daemon=True)
        self._names, self._progress = names, progress
        self._last = Event()
        self.error: Exception | None = None

    def run(self) -> None:
        """Until no more are told."""
        while self._names.poll(_PATIENCE) or not self._last.is_set():
            if not self._names.poll():
                continue
            name = self._names.recv()
            try:
                if self.error is None:
                    self._progress(name)
            except Exception as error:
                self.error = error

    def finish(self) -> None:
        """Wait for what is told already, but not for a process that ended in the middle of a name."""
        self._last.set()
        self.join(10 * _PATIENCE)


_told: Connection
_lock: Lock
"""Where a process tells the names of kernels, and what lets one at a time do so."""


def _begin(told: Connection, lock: Lock) -> None:
    global _told, _lock
    _told, _lock = told, lock
    # Whoever interrupts the command interrupts all its processes, and one that tells of it is enough.
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _run(work: Work[T], path: Path, command: str, algebra: str | None) -> T:
    return work(load_spec(path, command, algebra), _tell)


def _tell(name: str) -> None:
    with _lock:
        _told.send(name)
