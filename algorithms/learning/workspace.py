"""Arrays that gradients of the same network use again, because new pages of memory cost as much as products."""

from __future__ import annotations

import threading
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np

from .algebra import Array

_MOST_KINDS = 64
"""A limit on memory: the number of shapes for which arrays are kept."""


class Workspace:
    """Arrays by shape and type, which `empty` returns inside of `used`."""

    def __init__(self) -> None:
        self._arrays: dict[tuple[tuple[int, ...], np.dtype], list[Array]] = defaultdict(list)
        self._taken: dict[tuple[tuple[int, ...], np.dtype], int] = defaultdict(int)
        self._notes: dict[int, Any] = {}
        self._lock = threading.Lock()

    def __reduce__(self) -> tuple[type[Workspace], tuple[()]]:
        return Workspace, ()  # A copy has no arrays in common.

    @contextmanager
    def used(self) -> Iterator[None]:
        """Let `empty` return arrays of this workspace. They are free again at the next use.

        While another thread uses the workspace, `empty` returns new arrays.
        """
        if not self._lock.acquire(blocking=False):
            yield
            return
        token = _current.set(self)
        try:
            self._taken.clear()
            self._notes.clear()
            if len(self._arrays) > _MOST_KINDS:
                self._arrays.clear()
            yield
        finally:
            _current.reset(token)
            self._lock.release()

    def take(self, shape: tuple[int, ...], dtype: np.dtype) -> Array:
        """Return an array that is not taken since the last beginning of a use."""
        key = shape, dtype
        arrays, index = self._arrays[key], self._taken[key]
        self._taken[key] += 1
        if index == len(arrays):
            arrays.append(np.empty(shape, dtype))
        return arrays[index]

    def note(self, array: Array, found: Any) -> None:
        """Keep what belongs to an array until the next use begins."""
        self._notes[id(array)] = array, found

    def noted(self, array: Array) -> Any:
        """Return what was kept, or None."""
        return self._notes.get(id(array), (None, None))[1]


_current: ContextVar[Workspace | None] = ContextVar("workspace", default=None)


def empty(shape: tuple[int, ...], dtype: Any) -> Array:
    """Return an array without values: one of the workspace in use, or a new one."""
    workspace = _current.get()
    return np.empty(shape, dtype) if workspace is None else workspace.take(shape, np.dtype(dtype))


def note(array: Array, found: Any) -> None:
    """Keep what belongs to an array, if a workspace is in use."""
    workspace = _current.get()
    if workspace is not None:
        workspace.note(array, found)


def noted(array: Array) -> Any:
    """Return what `note` kept in the present use of a workspace, or None."""
    workspace = _current.get()
    return None if workspace is None else workspace.noted(array)


def multiplied(a: Array, b: Array) -> Array:
    """Return the matrix product ``a @ b`` in an array of the workspace."""
    return np.matmul(a, b, out=empty((a.shape[0], b.shape[1]), np.result_type(a, b)))
