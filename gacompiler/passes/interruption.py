"""Interruption of long searches, which then keep the best result so far.

The first interrupt (Ctrl-C) inside `interruptible` sets a flag that searches read between candidates; the second one
ends the process as usual. Outside of it, interrupts raise `KeyboardInterrupt` immediately.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

BEST = "best so far: "
"""The beginning of the texts that `progress` reports."""

_stopped = threading.Event()
_report: list[Callable[[str], None]] = []


def is_interruptible() -> bool:
    """Return whether an interrupt ends searches instead of the process."""
    return signal.getsignal(signal.SIGINT) is interrupt


def is_interrupted() -> bool:
    """Return whether searches are to end with their best result so far."""
    return _stopped.is_set()


def interrupt(_: int = 0, __: FrameType | None = None) -> None:
    """Set the flag. Another interrupt has the usual effect."""
    _stopped.set()
    signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def interruptible() -> Iterator[None]:
    """Let the first interrupt end searches instead of the process. Only the main thread can receive interrupts."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        _stopped.clear()


@contextmanager
def reporting(report: Callable[[str], None]) -> Iterator[None]:
    """Pass the progress of searches to `report`, a short text after each candidate that is cheaper than all others."""
    _report.append(report)
    try:
        yield
    finally:
        _report.remove(report)


def progress(text: str) -> None:
    """Report the progress of a search."""
    for report in _report:
        report(BEST + text)
