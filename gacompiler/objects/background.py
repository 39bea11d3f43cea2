"""A queue of commands that create files in the background, with as many running at a time as there are processors.

Daemon threads start the commands, wait for them, and end when the queue is empty. A running command continues after the
program ends, so that its file reaches the cache however short the program is.
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
    """A file that is created by a command.

    Parameters
    ----------
    target : Path
        The path of the file. The command creates the file atomically, or not at all.
    prepare : callable
        Writes the input of the command and returns the command. It is called immediately before the command runs.

    Attributes
    ----------
    failure : str
        The reason if the command has failed; else empty.
    """

    def __init__(self, target: Path, prepare: Callable[[], Sequence[str]]) -> None:
        self.target = target
        self.failure = ""
        self._prepare = prepare
        self._ended = threading.Event()

    @property
    def is_done(self) -> bool:
        """Whether the file exists."""
        return self.target.exists()

    def run(self) -> None:
        """Create the file and wait for it, unless another process has created it in the meantime."""
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
            If it has failed.
        """
        self._ended.wait()
        if self.failure:
            raise BackendError(
                "C compiler", f"it failed: {self.failure}", "a working compiler", "or set GAC_BACKEND=arrays"
            )


class Queue:
    """A queue of jobs, in the order in which they were added.

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
        """Jobs that have not started."""
        with self._lock:
            return list(self._waiting)

    @property
    def running(self) -> list[Job]:
        """Jobs whose commands are running."""
        with self._lock:
            return list(self._running)

    def add(self, job: Job) -> None:
        """Add a job, which starts as soon as a processor is free; return immediately."""
        with self._lock:
            self._waiting.append(job)
        self.start()

    def start(self) -> None:
        """Start a waiting job if a processor is free; callers need this only in forked processes."""
        with self._lock:
            if not self._waiting or self._workers >= processors():
                return
            self._workers += 1
        try:
            threading.Thread(target=self._work, name="gacompiler-build", daemon=True).start()
        except RuntimeError:  # too many threads, or the interpreter is shutting down: a later call tries again
            with self._lock:
                self._workers -= 1

    def finish(self, job: Job) -> None:
        """Run a job now if it has not started, and wait for it; errors as in `Job.wait`."""
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
        """Return running jobs to the queue in a forked process, which does not inherit threads."""
        self._lock = threading.Lock()
        self._workers = 0
        self._waiting = deque([*self._running, *self._waiting])
        self._running = []


QUEUE = Queue()
"""The jobs of this process for the C compiler."""
