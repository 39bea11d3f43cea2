"""Call functions with a time limit, in a second process that is killed and replaced if it takes too long."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Any


class TimeLimitExceeded(Exception):
    """A call took longer than its time limit."""


class Worker:
    """Calls one function of a module in another process.

    Parameters
    ----------
    function : callable
        A function at module level, so that the other process can import it.
    limit : float
        Maximum duration of a call in seconds.
    """

    def __init__(self, function: Callable[..., Any], limit: float) -> None:
        self._function, self._limit = function, limit
        self._process: Any = None
        self._connection: Any = None

    def __enter__(self) -> Worker:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop()

    def __call__(self, *arguments: Any) -> Any:
        """Call the function, and return its result.

        Raises
        ------
        TimeLimitExceeded
            If the call takes too long.
        Exception
            The exception that the function raises.
        """
        if self._process is None:
            self._start()
        self._connection.send(arguments)
        if not self._connection.poll(self._limit):
            self._stop()
            raise TimeLimitExceeded(f"more than {self._limit:g} s")
        succeeded, value = self._connection.recv()
        if not succeeded:
            raise value
        return value

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, other = context.Pipe()
        self._process = context.Process(target=_serve, args=(self._function, other), daemon=True)
        self._process.start()
        other.close()
        self._connection.recv()  # the time to import the function's module is not counted

    def _stop(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._connection.close()
            self._process = None


def _serve(function: Callable[..., Any], connection: Connection) -> None:
    connection.send("ready")
    while True:
        try:
            arguments = connection.recv()
        except EOFError:
            return
        try:
            answer = True, function(*arguments)
        except Exception as error:
            answer = False, error
        connection.send(answer)
