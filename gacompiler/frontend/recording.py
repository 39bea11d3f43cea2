"""The kernel with loops that is being traced, which loop functions record their statements in."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING

from ..errors import KernelError

if TYPE_CHECKING:
    from .recorder import Recorder

_CURRENT: ContextVar[Recorder | None] = ContextVar("recorder", default=None)


def is_recording() -> bool:
    """Return whether a kernel with loops is being traced."""
    return _CURRENT.get() is not None


def current() -> Recorder:
    """Return the recorder of the kernel that is being traced.

    Raises
    ------
    KernelError
        If no kernel with loops is being traced.
    """
    recorder = _CURRENT.get()
    if recorder is None:
        raise KernelError("a loop", "no kernel with loops is being traced", "a call inside the function of a kernel")
    return recorder


@contextmanager
def recording(recorder: Recorder) -> Iterator[Recorder]:
    """Make `recorder` the current recorder of loop functions."""
    token = _CURRENT.set(recorder)
    try:
        yield recorder
    finally:
        _CURRENT.reset(token)
