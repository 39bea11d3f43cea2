"""Commands that make files while the program goes on: as many at a time as there are processors, the others in a queue.

Threads start the commands and wait for them; nobody else does. They are daemons and end when nothing is left to do, and
a command outlives the program, so that what was begun reaches the cache however short the program is.
"""

from __future__ import annotations

import os
import subprocess
import threading
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path

from ..backends.build import processors
from ..errors import BackendError


class Job:
    """A file that a command makes.

    Parameters
    ----------
    target : Path
        Where the file belongs. The command puts it there in one step, or not at all.
    prepare : callable
        Writes what the command reads, and gives the command. It is called right before that runs.

    Attributes
    ----------
    failure : str
        Why there is no file, where the command has failed; else empty.
    """

    def __init__(self, target: Path, prepare: Callable[[], Sequence[str]]) -> None:
        self.target = target
        self.failure = ""
        self._prepare = prepare
        self._ended = threading.Event()

    @property
    def is_done(self) -> bool:
        """Whether the file is there."""
        return self.target.exists()

    def run(self) -> None:
        """Make the file, unless another process has done so in the meantime; wait for it."""
        try:
            self.failure = "" if self.is_done else self._run()
        except (OSError, ValueError, subprocess.SubprocessError) as error:
            self.failure = f"{type(error).__name__}: {error}"
        finally:
            self._ended.set()

    def _run(self) -> str:
        nothing = subprocess.DEVNULL
        with subprocess.Popen(
            self._prepare(), stdin=nothing, stdout=nothing, stderr=subprocess.PIPE, text=True, errors="replace",
            start_new_session=True,
        ) as process:  # fmt: skip
            _, errors = process.communicate()
        if process.returncode == 0 and self.is_done:
            return ""
        lines = errors.splitlines() or [f"it ended with status {process.returncode}"]
        return lines[-1 if lines[0].startswith("Traceback") else 0]

    def wait(self) -> None:
        """Wait until the command has ended.

        Raises
        ------
        BackendError
            When it has failed.
        """
        self._ended.wait()
        if self.failure:
            raise BackendError("C compiler", f"it failed: {self.failure}", "a working one", "or set GAC_BACKEND=arrays")


class Queue:
    """Jobs in the order in which they came.

    Attributes
    ----------
    waiting, running : list of Job
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._waiting: deque[Job] = deque()
        self._running: list[Job] = []
        self._workers = 0
        if hasattr(os, "register_at_fork"):
            os.register_at_fork(after_in_child=self._after_fork)

    @property
    def waiting(self) -> list[Job]:
        """Jobs that have not begun."""
        with self._lock:
            return list(self._waiting)

    @property
    def running(self) -> list[Job]:
        """Jobs whose commands run."""
        with self._lock:
            return list(self._running)

    def add(self, job: Job) -> None:
        """Let a job begin as soon as there is room; this does not wait for anything."""
        with self._lock:
            self._waiting.append(job)
        self.start()

    def start(self) -> None:
        """Begin what waits, where there is room: jobs begin by themselves but in a process that was forked."""
        with self._lock:
            if not self._waiting or self._workers >= processors():
                return
            self._workers += 1
        try:
            threading.Thread(target=self._work, name="gacompiler-build", daemon=True).start()
        except RuntimeError:  # no more threads, or the interpreter is about to end: a later call tries again
            with self._lock:
                self._workers -= 1

    def finish(self, job: Job) -> None:
        """Run a job now if it has not begun, and wait for it; errors as in `Job.wait`."""
        with self._lock:
            is_own = job in self._waiting
            if is_own:
                self._waiting.remove(job)
        if is_own:
            job.run()
        job.wait()

    def _work(self) -> None:
        while True:
            with self._lock:
                if not self._waiting:
                    self._workers -= 1
                    return
                job = self._waiting.popleft()
                self._running.append(job)
            job.run()
            with self._lock:
                self._running.remove(job)

    def _after_fork(self) -> None:
        """In the child there are no threads: what they were doing waits again."""
        self._lock = threading.Lock()
        self._workers = 0
        self._waiting = deque([*self._running, *self._waiting])
        self._running = []


QUEUE = Queue()
"""What this process has for the C compiler."""
