"""Process several spec files in parallel, each in a process of its own: kernels share nothing but the processors."""

from __future__ import annotations

import gc
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
from ..passes.collection import rare_collection
from ..passes.interruption import interrupt, is_interruptible, reporting
from .compiling import Progress
from .spec_files import Spec, load_spec

T = TypeVar("T")

Work = Callable[[Spec, Progress], T]
"""A function that processes a spec. The function and its results must be picklable."""

_MOST = 61
"""The maximum number of processes that Windows can wait for."""

_MOST_OBJECTS = 2_000_000
"""The number of new objects after which a process looks for garbage: a limit on memory, of some 150 MB. With the limits
of Python, it looks through the same objects again and again, which took a tenth of the time of compilations."""

_PATIENCE = 0.1
"""Interval at which the pipe of names is polled, in seconds."""


def each_spec(work: Work[T], specs: Sequence[Spec], progress: Progress, jobs: int) -> list[T]:
    """Return the results of `work` for all specs, in the same order.

    Parameters
    ----------
    work : callable
        Takes a spec, and a function that it calls with the name of each kernel before it is compiled.
    specs : sequence of Spec
        The specs are loaded again in the other processes, since functions cannot be sent between processes.
    progress : callable
        Called with the names of kernels from all processes.
    jobs : int
        The maximum number of processes; with 1, all the work is done in the current process.

    Raises
    ------
    GacError
        If `load_spec` or `work` raises it; the other processes are terminated.
    BackendError
        If a process ends before its work is done, for example because it runs out of memory.
    """
    if min(jobs, len(specs)) < 2:
        with rare_collection(_MOST_OBJECTS):
            return [work(spec, progress) for spec in specs]
    context = multiprocessing.get_context("spawn")
    names, sender = context.Pipe(duplex=False)
    listener = _Listener(names, progress)
    listener.start()
    pool = ProcessPoolExecutor(
        min(jobs, len(specs), _MOST), context, _begin, (sender, context.Lock(), is_interruptible())
    )
    try:
        # The longest files come first, so that the last ones are short and the processes end at about the same time.
        longest = sorted(range(len(specs)), key=lambda k: -specs[k].path.stat().st_size)
        futures = {k: pool.submit(_run, work, specs[k].path, specs[k].command, specs[k].algebra) for k in longest}
        for future in wait(futures.values(), return_when=FIRST_EXCEPTION).done:
            future.result()
        results = [futures[k].result() for k in range(len(specs))]
    except BrokenProcessPool as error:
        raise BackendError("a process", "it ended before its work was done", remedy="retry with --jobs 1") from error
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
    """Forwards the names of kernels sent by other processes, without blocking the process that starts it."""

    def __init__(self, names: Connection, progress: Progress) -> None:
        super().__init__(daemon=True)
        self._names, self._progress = names, progress
        self._last = Event()
        self.error: Exception | None = None

    def run(self) -> None:
        """Forward names until `finish` is called and the pipe is empty."""
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
        """Wait until all names sent so far are forwarded, but not for a process that ended while sending one."""
        self._last.set()
        self.join(10 * _PATIENCE)


_sender: Connection
_lock: Lock
"""The connection to which a process sends names of kernels, and the lock that prevents concurrent writes to it."""


def _begin(sender: Connection, lock: Lock, ends_searches: bool) -> None:
    global _sender, _lock
    _sender, _lock = sender, lock
    gc.set_threshold(_MOST_OBJECTS)
    # An interrupt reaches all processes of the command; it is enough that the main process reports it.
    signal.signal(signal.SIGINT, interrupt if ends_searches else signal.SIG_DFL)


def _run(work: Work[T], path: Path, command: str, algebra: str | None) -> T:
    if not is_interruptible():
        return work(load_spec(path, command, algebra), _send)
    with reporting(_send):
        return work(load_spec(path, command, algebra), _send)


def _send(name: str) -> None:
    with _lock:
        _sender.send(name)
